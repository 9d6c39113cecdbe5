"""Results in files: NetCDF-3, NPZ, MATLAB and CSV.

A file appears under its name only once it is complete, and keeps numbers exactly, with units, meanings and everything
that is known about the run: its parameters, its scene, what was asked for, and versions. So it can be run again.

Each holds a checksum of its contents, so that a file that was cut off or damaged is refused and never gives other
values. Of a CSV the checksum and all that is no number stand in a file beside it, ``run.csv.json``, so that any program
can read it; alone it is read unchecked. In older versions the checksum stood in a last line that begins with ``#``, and
the headings were in quotes, which says that there is such a line; still older ones have none.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from atwood.arguments import FILE, instance, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, listed
from atwood.errors import UsageError
from atwood.files import by_suffix, check_directory, read_checked, write_atomically
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.model.declare.connectors import PATHS, Quantity
from atwood.result.about import describe_all
from atwood.result.formats.companion import read_with_companion, write_with_companion
from atwood.result.formats.dataset import Dataset, json_text
from atwood.result.formats.matlab import read_matlab, write_matlab
from atwood.result.formats.netcdf import read_netcdf, write_netcdf
from atwood.result.formats.npz import check_unpacked
from atwood.result.result import Result
from atwood.result.trajectories import Trajectories

PICTURE = ".glb"
"""Suffix of files that hold what a run looks like, and none of its numbers."""


@dataclass(frozen=True, eq=False)
class SavedResult(Trajectories):
    """Trajectories that were read from a file; a mapping from paths to arrays, as a `Result` is.

    Attributes
    ----------
    time
        Output times, s.
    quantities
        Trajectories by path.
    units, meanings
        SI unit and one line of meaning by path; a CSV file alone holds no meanings.
    metadata
        What was known about the run; empty for a CSV file without the one beside it.
    """

    time: FloatArray
    quantities: Mapping[str, FloatArray]
    units: Mapping[str, str]
    meanings: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = Trajectories.__repr__

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of all quantities."""
        return tuple(self.quantities)

    @property
    def status(self) -> str:
        """How the run ended; empty if the file does not say."""
        return str(self.metadata.get("status", ""))

    def scene(self, trust: Iterable[str] = ()) -> Model:
        """Return the scene that was run, as `load_scene` reads it: ``simulate(saved.scene(), **saved.settings())``.

        Parameters
        ----------
        trust
            Names of modules with parts of one's own, which may be imported; see `from_data`.

        Raises
        ------
        UsageError
            If the file does not hold it, or a class in it cannot be found, or is in a module that is not trusted.
        """
        from atwood.model.compose.serialization import from_data

        return from_data(self._from_metadata("source"), trust)

    def settings(self, **others: Any) -> dict[str, Any]:
        """Return what `simulate` was asked for, to run the scene again.

        Parameters
        ----------
        **others
            Arguments that take the place of those of then.

        Raises
        ------
        UsageError
            If the file does not say, or a condition was a function of Python, which no file holds, and is not given.
        """
        asked = {**self._from_metadata("asked").get("again", {}), **others}
        for name in ("until", "record"):
            if name not in others and asked.get(name, ()) is None:
                advice = f"Give settings({name}=...) the function, or None to run without."
                raise UsageError(f"{name!r} was a function, which files do not hold", where=name, advice=advice)
        return asked

    def _from_metadata(self, name: str) -> Any:
        if not isinstance(self.metadata.get(name), Mapping):
            why = self.metadata.get("no_source", "it is of an older version, or a CSV file alone")
            raise UsageError(f"the file does not say how to run it again: {why}", advice="Run the scene itself.")
        return self.metadata[name]

    def unit(self, path: str) -> str:
        """Return the SI unit of a quantity."""
        return self.units[self._known(path)]

    def describe(self, path: str) -> str:
        """Return one line of meaning of a quantity."""
        return self.meanings.get(self._known(path), "")

    def __contains__(self, path: object) -> bool:
        return isinstance(path, (str, Quantity)) and str(path) in self.quantities

    def array(self, path: str) -> FloatArray:
        """Return a quantity at the output times, shape (times,)."""
        return self.quantities[self._known(path)]

    @takes(paths=PATHS)
    def table(self, paths: Iterable[str] | None = None) -> dict[str, FloatArray]:
        """Return quantities by path; all when no paths are given."""
        return super().table(paths)

    def _about(self) -> Mapping[str, Any]:
        return self.metadata

    def _facts(self) -> Iterator[tuple[str, str]]:
        kind = self.metadata.get("method", self.metadata.get("form", ""))
        yield "SavedResult", f"{self.metadata.get('scene', 'a run')}{kind and ', '}{kind}"
        if self.status:
            yield "status", self.status.replace("_", " ")
        if len(self.time):
            span = f"{self.time[0]:g} to {self.time[-1]:g} s, "
            yield "time", span + count_of(len(self.time), "output time")
        yield count_of(len(self.quantities), "quantity", "quantities"), listed(self.quantities)


@takes(result=instance("a Result, as simulate returns it", Result), file=FILE, paths=PATHS)
def save_result(result: Result, file: str | os.PathLike[str], paths: Iterable[str] | None = None) -> Path:
    """Save the trajectories of a run.

    Parameters
    ----------
    result
        The run.
    file
        Where to; its suffix says how: ``.nc`` (NetCDF-3), ``.npz`` (NumPy), ``.mat`` (MATLAB) or ``.csv``; or
        ``.glb``: shapes and motion of a scene in space as glTF 2.0.
    paths
        Which quantities; all when not given.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    UsageError
        If the suffix is not known, or the file cannot be written.
    """
    if Path(file).suffix.lower() == PICTURE:
        if paths is not None:
            raise UsageError("it holds shapes and motion, and no quantities by path", where=str(file))
        return Path(import_module("atwood.exchange.gltf").write_gltf(result, Path(file)))
    _format_of(Path(file))  # refused before any work is done
    wanted = tuple(result.paths if paths is None else paths)
    saved = SavedResult(
        result.time,
        result.table(wanted),
        {path: result.unit(path) for path in wanted},
        {path: result.describe(path) for path in wanted},
        describe_all(result),
    )
    return write_trajectories(saved, file)


def write_trajectories(saved: SavedResult, file: str | os.PathLike[str]) -> Path:
    """Write trajectories to a file, and return it; see `save_result`."""
    target, (write, _) = Path(file), _format_of(Path(file))
    if write is _write_csv:
        write(saved, target)
    else:
        write_atomically(target, lambda part: write(saved, part))
    return target


@takes(file=FILE)
def load_result(file: str | os.PathLike[str]) -> SavedResult:
    """Read trajectories that were saved.

    Parameters
    ----------
    file
        A file that `save_result` wrote.

    Raises
    ------
    UsageError
        If it does not exist, its suffix is not known, or it holds something else.
    """
    source = Path(file)
    _, read = _format_of(source)
    return read_checked(source, lambda file: _sound(read(file)), "result", "Save the run again.")


def _sound(saved: SavedResult) -> SavedResult:
    """Return what was read, if it is numbers at times, each with a unit."""
    known = (saved.units, saved.meanings, saved.metadata)
    arrays = [np.asarray(one) for one in (saved.time, *saved.quantities.values())]
    if not all(isinstance(one, Mapping) for one in known) or not saved.units.keys() >= saved.quantities.keys():
        raise ValueError("its units and meanings are not by path")
    if any(one.shape != (len(saved.time),) or one.dtype.kind not in "fiu" for one in arrays):
        raise ValueError("its quantities are no numbers at its times")
    return saved


def check_target(file: str | os.PathLike[str]) -> None:
    """Refuse a file that a result could not be saved to, before the work is done."""
    if Path(file).suffix.lower() != PICTURE:
        _format_of(Path(file))
    check_directory(Path(file))


# -- checksums ---------------------------------------------------------------------------------------------------------


def _checksum(saved: SavedResult) -> str:
    """Return the SHA-256 of all that a file holds, whatever its format makes of it."""
    about = {
        "paths": list(saved.quantities),
        "units": dict(saved.units),
        "meanings": {path: text for path, text in saved.meanings.items() if text},
        "metadata": json.loads(json_text(saved.metadata)),
    }
    found = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    for values in (saved.time, *saved.quantities.values()):
        found.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return found.hexdigest()


def _verified(saved: SavedResult, checksum: str | None) -> SavedResult:
    """Return what was read, if it is what was saved; files of older versions do not say."""
    if checksum is not None and checksum != _checksum(saved):
        raise ValueError("its checksum is that of other contents")
    return saved


# -- NetCDF and MATLAB -------------------------------------------------------------------------------------------------


def _from_dataset(data: Dataset, checksum: str | None) -> SavedResult:
    arrays = {one.path: one for one in data.variables}
    time = arrays.pop("time").values
    saved = SavedResult(
        time,
        {path: one.values for path, one in arrays.items()},
        {path: one.unit for path, one in arrays.items()},
        {path: one.meaning for path, one in arrays.items()},
        data.about,
    )
    return _verified(saved, checksum)


def _through_dataset(
    write: Callable[[Dataset, Path, str], None], read: Callable[[Path], tuple[Dataset, str | None]]
) -> tuple[_Write, _Read]:
    """Return how a result is written and read by what writes and reads data sets."""
    return (
        lambda saved, file: write(saved.as_dataset(), file, _checksum(saved)),
        lambda file: _from_dataset(*read(file)),
    )


# -- NPZ ---------------------------------------------------------------------------------------------------------------

_ABOUT = "atwood"


def _write_npz(saved: SavedResult, file: Path) -> None:
    about = {
        "metadata": saved.metadata,
        "units": saved.units,
        "meanings": saved.meanings,
        "checksum": _checksum(saved),
    }
    arrays: dict[str, Any] = {"time": saved.time, **saved.quantities, _ABOUT: np.array(json_text(about))}
    with file.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays)


def _read_npz(file: Path) -> SavedResult:
    check_unpacked(file)
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as data:  # a damaged file is closed, too
        about = json.loads(str(data[_ABOUT]))
        quantities = {name: data[name] for name in data.files if name not in ("time", _ABOUT)}
        saved = SavedResult(data["time"], quantities, about["units"], about["meanings"], about["metadata"])
        return _verified(saved, about.get("checksum"))


# -- CSV ---------------------------------------------------------------------------------------------------------------

_HEADING = re.compile(r"(.+) \[(.*)\]$")


_LAST_LINE = "# rows: {rows}, sha256: {checksum}\n"
"""Of older versions."""


def _write_csv(saved: SavedResult, file: Path) -> None:
    columns = [saved.time.tolist(), *(values.tolist() for values in saved.quantities.values())]
    heads = ["time [s]", *(f"{path} [{saved.units[path]}]" for path in saved.quantities)]
    rows = (map(repr, row) for row in zip(*columns, strict=True))
    write_with_companion(file, chain([heads], rows), {"meanings": saved.meanings, "metadata": saved.metadata})


def _read_csv(file: Path) -> SavedResult:
    content, about = read_with_companion(file)
    if content.startswith('"'):
        cut = content.rstrip("\n").rfind("\n") + 1
        content, last = content[:cut], content[cut:]
        checksum = hashlib.sha256(content.encode()).hexdigest()
        expected = _LAST_LINE.format(rows=content.count("\n") - 1, checksum=checksum)
        if last.strip() != expected.strip():
            raise ValueError("it is cut off, or its checksum is that of other contents")
    reader = csv.reader(io.StringIO(content, newline=""))
    headings = next(reader)
    rows = [[float(value) for value in row] for row in reader]
    units: dict[str, str] = {}
    for heading in headings:
        match = _HEADING.match(heading)
        if match is None:
            raise ValueError(f"a heading without a unit: {heading!r}")
        units[match[1]] = match[2]
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(headings)).T
    quantities = dict(zip(units, values, strict=True))
    time = quantities.pop("time")
    return SavedResult(time, quantities, {path: units[path] for path in quantities}, **(about or {}))


# -- which -------------------------------------------------------------------------------------------------------------

_Write = Callable[[SavedResult, Path], None]
_Read = Callable[[Path], SavedResult]
_FORMATS: dict[str, tuple[_Write, _Read]] = {
    ".nc": _through_dataset(write_netcdf, read_netcdf),
    ".npz": (_write_npz, _read_npz),
    ".csv": (_write_csv, _read_csv),
    ".mat": _through_dataset(write_matlab, read_matlab),
}


def _format_of(file: Path) -> tuple[_Write, _Read]:
    advice = "Use .nc (NetCDF-3), .npz (NumPy), .mat (MATLAB) or .csv; of a run .glb (glTF) too."
    return by_suffix(file, _FORMATS, advice)
