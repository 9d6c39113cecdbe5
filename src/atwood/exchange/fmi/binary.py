"""The binary of an FMU, called through ctypes: FMI 2.0 and 3.0, model exchange and co-simulation."""

from __future__ import annotations

import ctypes
import math
import platform
import shutil
import stat
import sys
import tempfile
import weakref
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from atwood.errors import AtwoodError, SolveError, UnsupportedError, UsageError
from atwood.exchange.fmi.reading import REALS, Description, Variable, read_description
from atwood.lazy_dataclasses import dataclass

_LARGEST = 2**32
"""An FMU whose files have more bytes than these is refused."""
_MOST_ITERATIONS = 1000
"""More discrete states than these at one moment are no answer."""
_OK, _WARNING, _DISCARD = 0, 1, 2
_STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")

_TYPES_2: dict[str, tuple[str, Any]] = {
    "Real": ("Real", ctypes.c_double),
    "Integer": ("Integer", ctypes.c_int),
    "Enumeration": ("Integer", ctypes.c_int),
    "Boolean": ("Boolean", ctypes.c_int),
}
_TYPES_3: dict[str, tuple[str, Any]] = {
    "Float64": ("Float64", ctypes.c_double),
    "Float32": ("Float32", ctypes.c_float),
    "Boolean": ("Boolean", ctypes.c_bool),
    "Enumeration": ("Int64", ctypes.c_int64),
    **{f"Int{bits}": (f"Int{bits}", getattr(ctypes, f"c_int{bits}")) for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": (f"UInt{bits}", getattr(ctypes, f"c_uint{bits}")) for bits in (8, 16, 32, 64)},
}

_Logger2 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
_Logger3 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class _Callbacks2(ctypes.Structure):
    _fields_ = (
        ("logger", _Logger2),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class _EventInfo2(ctypes.Structure):
    _fields_ = (
        ("again", ctypes.c_int),
        ("terminates", ctypes.c_int),
        ("nominals_changed", ctypes.c_int),
        ("states_changed", ctypes.c_int),
        ("is_defined", ctypes.c_int),
        ("next", ctypes.c_double),
    )


@dataclass(frozen=True)
class Discrete:
    """What the iteration at an event has said: whether the FMU asks to end, and its next time event or None, s."""

    terminates: bool
    next: float | None


@dataclass(frozen=True, eq=False)
class _Group:
    """Numbers of one type that one call gets or sets: references, and their places in a row of numbers."""

    name: str
    ctype: Any
    is_real: bool
    references: Any
    count: int
    places: tuple[int, ...]


def platform_folder(version: int) -> str:
    """Return the name of the folder in which an FMU has binaries for this computer."""
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}.get(sys.platform, sys.platform)
    bits = 64 if sys.maxsize > 2**32 else 32
    if version == 2 and platform.machine().lower() in ("x86_64", "amd64", "i686", "x86"):
        return {"windows": "win"}.get(system, system) + str(bits)
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{system}"


def open_archive(path: Path) -> zipfile.ZipFile:
    """Return the archive of an FMU.

    Raises
    ------
    UsageError
        If there is no such file, it is no archive, it is too large, or a file of it would lie outside of its folder.
    """
    try:
        archive = zipfile.ZipFile(path)
    except OSError as error:
        raise UsageError(f"the FMU cannot be read ({error.strerror or error})", where=str(path)) from None
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise UsageError(f"it is no FMU: the archive is damaged ({error})", where=str(path)) from None
    for one in archive.infolist():
        name = one.filename.replace("\\", "/")
        is_link = stat.S_ISLNK(one.external_attr >> 16)
        if is_link or name.startswith("/") or ":" in name or ".." in PurePosixPath(name).parts:
            archive.close()
            raise UsageError(f"its file {one.filename!r} would lie outside of its folder", where=str(path))
    if sum(one.file_size for one in archive.infolist()) > _LARGEST:
        archive.close()
        raise UsageError("its files are larger than 4 GiB", where=str(path))
    return archive


def describe(path: Path) -> Description:
    """Return what an FMU says of itself; none of its code is run."""
    with open_archive(path) as archive:
        return read_description(_content(archive, "modelDescription.xml", path), path)


def _content(archive: zipfile.ZipFile, name: str, path: Path) -> bytes:
    try:
        return archive.read(name)
    except KeyError:
        raise UsageError(f"it is no FMU: it has no {name}", where=str(path)) from None
    except Exception as error:  # zlib and zipfile raise what they like at damaged files
        raise UsageError(f"its {name} is damaged ({error})", where=str(path)) from None


class Binary:
    """The shared library of an FMU, loaded from a folder that is removed with it.

    Parameters
    ----------
    path
        The FMU.
    description
        What it says of itself.
    kind
        ``"model exchange"`` or ``"co-simulation"``.
    """

    def __init__(self, path: Path, description: Description, kind: str) -> None:
        self.path, self.description, self.kind = path, description, kind
        self.version = description.version
        self.messages: list[str] = []
        folder = platform_folder(self.version)
        ending = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
        identifier = description.identifiers[kind]
        self._folder = tempfile.mkdtemp(prefix="atwood-fmu-")
        weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        with open_archive(path) as archive:
            names = archive.namelist()
            wanted = f"binaries/{folder}/{identifier}{ending}"
            if wanted not in names:
                there = sorted({name.split("/")[1] for name in names if name.startswith("binaries/") and name[9:]})
                has = f"binaries for {', '.join(there)}" if there else "sources alone"
                raise UnsupportedError(f"it has {has}, and none for {folder}", where=str(path))
            for name in names:
                if name.startswith(("binaries/" + folder, "resources/")) and not name.endswith("/"):
                    target = Path(self._folder, name)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    target.write_bytes(_content(archive, name, path))
        try:
            self._library = ctypes.CDLL(str(Path(self._folder, wanted)))
        except OSError as error:
            raise UnsupportedError(f"its binary cannot be loaded ({error})", where=str(path)) from None
        self._types = _TYPES_2 if self.version == 2 else _TYPES_3
        own = weakref.ref(self)
        self.logger: Any = (
            _Logger2(lambda _, __, status, ___, text: _note(own, status, text))
            if self.version == 2
            else _Logger3(lambda _, status, __, text: _note(own, status, text))
        )
        if self.version == 2:
            c = ctypes.CDLL("msvcrt" if sys.platform == "win32" else None)
            allocate, free = (ctypes.cast(one, ctypes.c_void_p) for one in (c.calloc, c.free))
            self._callbacks = _Callbacks2(self.logger, allocate, free, None, None)

    @property
    def resources(self) -> Path:
        """The folder with its resources."""
        return Path(self._folder, "resources")

    def function(self, name: str) -> Any:
        """Return a function of the binary by its name without prefix."""
        try:
            return getattr(self._library, f"fmi{self.version}{name}")
        except AttributeError:
            raise UnsupportedError(
                f"its binary has no function fmi{self.version}{name}", where=str(self.path)
            ) from None

    def groups(self, variables: Sequence[Variable]) -> tuple[_Group, ...]:
        """Return by which calls variables are got or set; all numbers of an array are among them."""
        found: dict[tuple[str, Any], list[int]] = {}
        for place, one in enumerate(variables):
            found.setdefault(self._types[one.type], []).append(place)
        result = []
        for (name, ctype), places in found.items():
            references = list(dict.fromkeys(variables[place].reference for place in places))
            row = (ctypes.c_uint * len(references))(*references)
            is_real = variables[places[0]].type in REALS
            result.append(_Group(name, ctype, is_real, row, len(references), tuple(places)))
        return tuple(result)

    def instantiate(self) -> ctypes.c_void_p:
        """Return a new instance."""
        own, name = self.description, b"atwood"
        if self.version == 2:
            make, kind = self.function("Instantiate"), 0 if self.kind == "model exchange" else 1
            make.restype = ctypes.c_void_p
            uri = self.resources.as_uri().encode()
            made = make(name, kind, own.token.encode(), uri, ctypes.byref(self._callbacks), 0, 0)
        else:
            is_exchange = self.kind == "model exchange"
            make = self.function("InstantiateModelExchange" if is_exchange else "InstantiateCoSimulation")
            make.restype = ctypes.c_void_p
            flags = [ctypes.c_bool(False)] * (2 if is_exchange else 4)
            more: list[Any] = [] if is_exchange else [None, ctypes.c_size_t(0)]
            folder = f"{self.resources}/".encode() if self.resources.is_dir() else None
            ending = [None, self.logger] if is_exchange else [None, self.logger, None]
            made = make(name, own.token.encode(), folder, *flags, *more, *ending)
        if not made:
            raise SolveError(f"no instance of it can be made{self.said()}", where=str(self.path))
        return ctypes.c_void_p(made)

    def said(self) -> str:
        """Return what it has logged of errors, as the end of a sentence, and forget it."""
        text = "; ".join(self.messages[-3:])
        self.messages.clear()
        return f": {text}" if text else ""


def _note(binary: Any, status: int, text: bytes | None) -> None:
    own = binary()
    if own is not None and status > _WARNING and text:
        own.messages.append(text.decode("utf-8", "replace")[:300])


def _free(binary: Binary, pointer: ctypes.c_void_p) -> None:
    free = binary.function("FreeInstance")
    free.restype = None
    free(pointer)


class Instance:
    """One instance of an FMU."""

    def __init__(self, binary: Binary) -> None:
        self.binary, self.version = binary, binary.version
        self._pointer = binary.instantiate()
        self._free = weakref.finalize(self, _free, binary, self._pointer)

    def close(self) -> None:
        """Free it."""
        self._free()

    def call(self, name: str, *arguments: Any) -> bool:
        """Call a function of the FMU, and return whether it has answered; it may discard a state.

        Raises
        ------
        SolveError
            If it returns an error.
        """
        status = self.binary.function(name)(self._pointer, *arguments)
        if status in (_OK, _WARNING):
            return True
        if status == _DISCARD:
            return False
        said = _STATUS[status] if 0 <= status < len(_STATUS) else status
        if status == 4:
            self._free.detach()  # after a fatal error nothing may be called
        raise SolveError(f"fmi{self.version}{name} returns {said}{self.binary.said()}", where=str(self.binary.path))

    def must(self, name: str, *arguments: Any) -> None:
        """Call a function that has to answer."""
        if not self.call(name, *arguments):
            raise SolveError(f"fmi{self.version}{name} discards{self.binary.said()}", where=str(self.binary.path))

    def get(self, groups: Sequence[_Group], values: list[float]) -> bool:
        """Read variables into a row of numbers, and return whether they have values."""
        for one in groups:
            size = len(one.places)
            row = (one.ctype * size)()
            sizes = () if self.version == 2 else (ctypes.c_size_t(size),)
            if not self.call(f"Get{one.name}", one.references, ctypes.c_size_t(one.count), row, *sizes):
                return False
            for place, value in zip(one.places, row, strict=True):
                values[place] = float(value)
        return True

    def set(self, groups: Sequence[_Group], values: Sequence[float]) -> None:
        """Set variables from a row of numbers."""
        for one in groups:
            given = [values[place] for place in one.places]
            size = len(given)
            row = (one.ctype * size)(*(given if one.is_real else [_whole(value, one.ctype) for value in given]))
            sizes = () if self.version == 2 else (ctypes.c_size_t(size),)
            self.must(f"Set{one.name}", one.references, ctypes.c_size_t(one.count), row, *sizes)

    def numbers(self, name: str, size: int) -> list[float] | None:
        """Return the row of numbers that a function gives; None where it discards the state."""
        row = (ctypes.c_double * size)()
        return list(row) if not size or self.call(name, row, ctypes.c_size_t(size)) else None

    def begin(self, start: float, set_values: Callable[[], None]) -> None:
        """Initialize it, with a function that sets what may be set before."""
        true, zero = (ctypes.c_int, 0) if self.version == 2 else (ctypes.c_bool, False)
        set_values()
        if self.version == 2:
            self.must("SetupExperiment", true(zero), _real(0.0), _real(start), true(zero), _real(0.0))
            self.must("EnterInitializationMode")
        else:
            self.must("EnterInitializationMode", true(zero), _real(0.0), _real(start), true(zero), _real(0.0))
        self.must("ExitInitializationMode")

    def settle(self) -> Discrete:
        """Iterate discrete states in event mode until they stay, and go on to continuous time."""
        for _ in range(_MOST_ITERATIONS):
            if self.version == 2:
                info = _EventInfo2()
                self.must("NewDiscreteStates", ctypes.byref(info))
                again, terminates, defined, following = info.again, info.terminates, info.is_defined, info.next
            else:
                flags = [ctypes.c_bool(False) for _ in range(5)]
                time = ctypes.c_double()
                self.must("UpdateDiscreteStates", *map(ctypes.byref, flags), ctypes.byref(time))
                again, terminates, defined = flags[0].value, flags[1].value, flags[4].value
                following = time.value
            if terminates or not again:
                self.must("EnterContinuousTimeMode")
                if defined and not math.isfinite(following):
                    raise SolveError("its next time event is no finite number", where=str(self.binary.path))
                return Discrete(bool(terminates), following if defined else None)
        raise SolveError("its discrete states do not settle at an event", where=str(self.binary.path))

    def step(self, start: float, end: float) -> None:
        """Make a step of co-simulation."""
        size = _real(end - start)
        if self.version == 2:
            self.must("DoStep", _real(start), size, ctypes.c_int(1))
            return
        flags, last = [ctypes.c_bool(False) for _ in range(3)], ctypes.c_double()
        pointers = [*map(ctypes.byref, flags), ctypes.byref(last)]
        self.must("DoStep", _real(start), size, ctypes.c_bool(True), *pointers)
        if flags[1].value or flags[2].value:
            what = "asks to end" if flags[1].value else f"returns early, at {last.value:.9g} s,"
            raise SolveError(f"at t = {end:.9g} it {what} within a step", where=str(self.binary.path))

    def directional(self, unknowns: Any, knowns: Any, size: int) -> list[float] | None:
        """Return derivatives of variables by one; None where it has none at this state."""
        seed, row, one = (ctypes.c_double * 1)(1.0), (ctypes.c_double * size)(), ctypes.c_size_t(1)
        n = ctypes.c_size_t(size)
        sizes = ((), ()) if self.version == 2 else ((one,), (n,))
        done = self.call("GetDirectionalDerivative", unknowns, n, knowns, one, seed, *sizes[0], row, *sizes[1])
        return list(row) if done else None


_real = ctypes.c_double


def _whole(value: float, ctype: Any) -> int:
    number = round(value)
    if ctype is ctypes.c_bool:
        return number != 0
    if ctype(number).value != number:
        raise AtwoodError(f"{value:g} is out of the range of its type")
    return number
