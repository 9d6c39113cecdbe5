"""From programs to loaded machine code, by way of the cache.

What is made once in a process, whichever thread asks first.

Where routines are written: what names their machine code in the cache without printing them.
"""

from __future__ import annotations

import ctypes
import functools
import json
import threading
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray, address_of
from atwood.clock import within_time
from atwood.codegen.cache import Cache, default_cache, make_key
from atwood.codegen.llvm.engine import (
    LoadedCode,
    compile_text,
    load_code,
    target_description,
)
from atwood.codegen.llvm.module import CodeOptions, Part, write_module
from atwood.codegen.routines import own_name
from atwood.errors import KernelEvaluationError, UnsupportedError
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.stages import stage

if TYPE_CHECKING:
    from atwood.codegen.routines import Routine

_GENERATOR = 1
"""Counts changes to the generated code that do not show in `GENERATORS`."""

GENERATORS = (
    *(
        f"llvm/{one}.py"
        for one in ("build", "engine", "layout", "linear_systems", "loops", "module", "own", "printer", "text")
    ),
    "routines.py",
)
"""The files, by their place in the room of the code generators, on which the machine code of a program depends.

What other modules write is part of the key by itself; see `RoutineSource`.
"""

P = ParamSpec("P")
T = TypeVar("T")


def once(make: Callable[P, T]) -> Callable[P, T]:
    """Return a function that makes something at its first call, and returns the same ever after.

    Unlike `functools.cache` it makes it once even if several threads ask at the same time: code of which there are two,
    one of them forgotten, would be taken out of memory while it runs.
    """
    lock, made = threading.RLock(), dict[tuple[object, ...], T]()

    @functools.wraps(make)
    def found(*given: P.args, **named: P.kwargs) -> T:
        if given not in made:
            with lock:
                if given not in made:
                    made[given] = make(*given, **named)
        return made[given]

    return found


prologue_at = lru_cache(maxsize=256)(ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3))
"""What computes, at an address, what depends on parameters alone: from values, to a place, with scratch."""

_SMALL = 20_000
"""Beyond so many nodes LLVM's quickest level is used: it takes a sixth of the time, for code that is a tenth slower.

Where loops leave no more lines than these, the level is at least one.
"""


_BRIEF = 500
"""The same for programs that are run for short stretches, between which far more is done."""


@dataclass(frozen=True)
class Built:
    """Code that is ready to be called.

    Attributes
    ----------
    code
        The functions in memory.
    scratch
        The length of the scratch array that they need.
    from_cache
        Whether nothing had to be compiled.
    """

    code: LoadedCode
    scratch: int
    from_cache: bool

    def derive(self, name: str, program: Program, parameter_values: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return what depends on parameters alone, and the room that the code needs."""
        values = np.array(parameter_values, dtype=np.float64)
        count = len(program.parameters)
        if values.shape != (count,):
            raise KernelEvaluationError(
                f"needs {count} parameter values but got an array of shape {values.shape}", where=program.name
            )
        derived, scratch = np.empty(len(program.prologue)), np.empty(self.scratch)
        prologue: Callable[..., None] = prologue_at(self.code.addresses[f"{name}_prologue"])
        prologue(address_of(values), address_of(derived), address_of(scratch))
        return derived, scratch


def default_options(parts: Sequence[Part], is_brief: bool = False) -> CodeOptions:
    """Return how to compile programs of this size on this machine; brief ones are run for short stretches at a time."""
    size = sum(part.program.size for part in parts)
    return CodeOptions(level=1 if size <= (_BRIEF if is_brief else _SMALL) else 0)


def build_lanes(parts: Sequence[Part], runs: int) -> Built:
    """Compile programs for so many runs side by side.

    Raises
    ------
    UnsupportedError
        If there is no code in lanes for an operation of a program.
    """
    return build_code(parts, replace(default_options(parts), runs=runs))


def build_code(
    parts: Sequence[Part],
    options: CodeOptions,
    *,
    exports: Sequence[str] = (),
    routines: RoutineSource | None = None,
    cached: bool = True,
) -> Built:
    """Compile programs, or take them from the cache."""
    with stage("code"):
        return within_time(lambda: build_now(parts, options, exports, routines, cached))


def build_now(
    parts: Sequence[Part],
    options: CodeOptions,
    exports: Sequence[str],
    routines: RoutineSource | None,
    cached: bool,
) -> Built:
    """Do the same without looking at the clock."""
    names = [*exports, *(name for part in parts for name in (part.name, f"{part.name}_prologue"))]
    store = default_cache() if cached else None
    key = key_of(parts, options, routines) if store else ""
    if store is not None:
        found = _from_cache(store, key, names)
        if found is not None:
            return found
    module = write_module(parts, options)
    written = list(routines.write()) if routines is not None else []
    text = module.text
    if written:
        from atwood.codegen.llvm.printer import print_routines

        text = f"{text}\n{print_routines(written)}"
    is_short = module.has_loops and text.count("\n") <= _SMALL
    code = compile_text(text, max(options.level, 1) if is_short else options.level, has_variables=bool(written))
    loaded = load_code(code, names, _own_addresses(module.functions))
    if store is not None:
        about = {"scratch": module.scratch, "functions": module.functions}
        store.write(key, json.dumps(about).encode() + b"\n" + code)
    return Built(loaded, module.scratch, False)


def _own_addresses(names: Sequence[str]) -> dict[str, int]:
    """Return where elementary functions and elimination are, by what they are called in a module."""
    if not names:
        return {}
    from atwood.codegen.llvm.own import address_of

    return {own_name(one): address_of(one) for one in names}


def _from_cache(store: Cache, key: str, names: Sequence[str]) -> Built | None:
    """Return what the cache holds, or None if it holds nothing that can be used."""
    content = store.read(key)
    if content is None:
        return None
    line, _, code = content.partition(b"\n")
    try:
        about = json.loads(line)
        loaded = load_code(code, names, _own_addresses(about["functions"]))
        return Built(loaded, int(about["scratch"]), True)
    except (ValueError, KeyError, TypeError, RuntimeError, UnsupportedError):
        return None


def key_of(parts: Sequence[Part], options: CodeOptions, routines: RoutineSource | None) -> str:
    """Return the name of machine code in the cache."""
    written = routines.key if routines is not None else ()
    programs = [(part.name, part.program.digest, part.positions, part.lanes, part.packed) for part in parts]
    return make_key([_GENERATOR, hash_of_generators(), programs, options, written, target_description()])


@cache
def hash_of_generators(room: Path = Path(__file__).parents[1]) -> str:
    """Return a hash of the files that write code, so that no change to them goes unnoticed."""
    total = sha256()
    for name in GENERATORS:
        try:
            total.update((room / name).read_bytes())
        except OSError as error:
            raise UnsupportedError(
                f"the source of a code generator cannot be read: {error}",
                where=name,
                advice="Install atwood with its sources, or switch the cache of machine code off: ATWOOD_CACHE=0.",
            ) from error
    return total.hexdigest()


_PACKAGE = Path(__file__).parents[2]


@dataclass(frozen=True)
class RoutineSource:
    """A function that writes routines, and the files on which they depend.

    Attributes
    ----------
    module
        The module with the function ``write_routines``, within the package; it is imported only to write them.
    files
        The other source files of the package that decide what it writes, without those of the language.
    arguments
        What it is called with.
    """

    module: str
    files: tuple[str, ...] = ()
    arguments: tuple[object, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """What the routines depend on."""
        return (self.module, _hash((self.module.replace(".", "/") + ".py", *self.files)), self.arguments)

    def write(self) -> Sequence[Routine]:
        """Write the routines."""
        found: Sequence[Routine] = import_module(f"atwood.{self.module}").write_routines(*self.arguments)
        return found


@cache
def _hash(files: tuple[str, ...]) -> str:
    total = sha256()
    for name in files:
        total.update((_PACKAGE / name).read_bytes())
    return total.hexdigest()
