"""Sweeps in files: NetCDF-3, NPZ, MATLAB, CSV and JSON.

A file appears under its name only once it is complete, and holds a checksum, so that one that was cut off or damaged is
refused. Of a CSV the checksum stands in a file beside it, ``runs.csv.json``, with what is no number; in older versions,
in a last line that begins with ``#``. NetCDF and JSON files of older versions have none and are read as before.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import FILE, instance, takes
from atwood.files import by_suffix, check_directory, read_checked, write_atomically
from atwood.result.formats.companion import digest, read_with_companion, write_with_companion
from atwood.result.formats.dataset import Dataset, Variable
from atwood.result.formats.matlab import read_matlab, write_matlab
from atwood.result.formats.netcdf import read_netcdf, write_netcdf
from atwood.result.formats.npz import read_npz, write_npz
from atwood.study.sweeps.result import Sweep, about_sweep, as_dataset, from_dataset, from_parts, labels


@takes(sweep=instance("a Sweep", Sweep), file=FILE)
def save_sweep(sweep: Sweep, file: str | os.PathLike[str]) -> Path:
    """Save a sweep."""
    target = Path(file)
    write, _ = _format_of(target)
    if write is _write_csv:
        write(sweep, target)
    else:
        write_atomically(target, lambda part: write(sweep, part))
    return target


@takes(file=FILE)
def load_sweep(file: str | os.PathLike[str]) -> Sweep:
    """Read a sweep that was saved.

    Parameters
    ----------
    file
        A file that `Sweep.save` wrote.

    Raises
    ------
    UsageError
        If it does not exist, its suffix is not known, or it holds something else.
    """
    source = Path(file)
    _, read = _format_of(source)
    return read_checked(source, read, "sweep", "Save the sweep again.")


def check_sweep_target(file: str | os.PathLike[str]) -> None:
    """Refuse a file that a sweep could not be saved to, before the work is done."""
    _format_of(Path(file))
    check_directory(Path(file))


# -- arrays ------------------------------------------------------------------------------------------------------------


def _write_with(write: Callable[[Dataset, Path, str], None]) -> Callable[[Sweep, Path], None]:
    def written(sweep: Sweep, file: Path) -> None:
        data = as_dataset(sweep)
        write(data, file, data.checksum())

    return written


def _read_with(read: Callable[[Path], tuple[Dataset, str | None]]) -> Callable[[Path], Sweep]:
    def found(file: Path) -> Sweep:
        data, checksum = read(file)
        return from_dataset(data.verified(checksum))

    return found


def _read_netcdf(file: Path) -> Sweep:
    data, checksum = read_netcdf(file)
    if checksum is None:
        return _from_old_netcdf(data)
    return from_dataset(data.verified(checksum))


def _from_old_netcdf(data: Dataset) -> Sweep:
    """Return a sweep of older versions, whose variables are numbered and two of which may have one path."""
    time = next(one for one in data.variables if one.path == "time")
    quantities = [one for one in data.variables if one.dimensions == ("run", "time")]
    values = {one.path: one.values.tolist() for one in quantities}
    return _from_dict({**data.about, "time": time.values.tolist(), "quantities": values}, _meanings(quantities))


def _meanings(quantities: list[Variable]) -> dict[str, str]:
    return {one.path: one.meaning for one in quantities if one.meaning != one.path}


# -- JSON --------------------------------------------------------------------------------------------------------------


def _write_json(sweep: Sweep, file: Path) -> None:
    data = {**sweep.to_dict(), "meanings": dict(sweep.meanings)}
    file.write_text(json.dumps({**data, "checksum": digest(data)}, allow_nan=False) + "\n", encoding="utf-8")


def _read_json(file: Path) -> Sweep:
    data = json.loads(file.read_text(encoding="utf-8"))
    checksum = data.pop("checksum", None)
    if checksum is None and "meanings" in data:
        raise ValueError("its checksum is missing")
    if checksum is not None and checksum != digest(data):
        raise ValueError("its checksum is that of other contents")
    return _from_dict(data, data.get("meanings", {}))


def _from_dict(data: Mapping[str, Any], meanings: Mapping[str, str]) -> Sweep:
    """Return the sweep that `Sweep.to_dict` was made of."""
    starts = {f"start.{path}": values for path, values in data["start"].items()}
    columns = {**data["parameters"], **starts}
    return from_parts(
        {**data, "varied": [[label.removeprefix("start."), label, label in starts] for label in columns]},
        time=np.array(data["time"], dtype=float),
        varied={label: np.array(values) for label, values in columns.items()},
        quantities={path: np.array(rows, dtype=float) for path, rows in data["quantities"].items()},
        units={**data["units"], **{f"start.{path}": data["units"].get(path, "") for path in data["start"]}},
        meanings=meanings,
        status=tuple(data["status"]),
        end_time=np.array(data["end_time"], dtype=float),
        steps=np.array(data["steps"]),
    )


# -- CSV ---------------------------------------------------------------------------------------------------------------

_LAST_LINE = "# rows: {rows}, sha256: {checksum}, about: {about}\n"
"""Of older versions."""


def _write_csv(sweep: Sweep, file: Path) -> None:
    """Write what was varied, the time and the quantities, with units in brackets; what is not known is empty."""
    named = labels(sweep)
    heads = ["run", "status", *(_head(label, sweep.units.get(path, "")) for path, label in named.items()), "time [s]"]
    heads += [_head(path, sweep.units[path]) for path in sweep.paths]
    varied = [values.tolist() for values in sweep.varied.values()]
    rows: list[Sequence[object]] = [heads]
    for run, status in enumerate(sweep.status):
        first = [run, status, *(_cell(values[run]) for values in varied)]
        for k, t in enumerate(sweep.time.tolist()):
            row = [_cell(float(values[run, k])) for values in sweep.quantities.values()]
            rows.append([*first, _cell(t), *row])
    whole = sweep.to_dict()
    known = {"end_time": whole["end_time"], "steps": whole["steps"]}
    write_with_companion(file, rows, {**about_sweep(sweep), **known, "meanings": sweep.meanings})


def _head(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _cell(value: Any) -> Any:
    return ("" if not np.isfinite(value) else repr(value)) if isinstance(value, float) else value


def _read_csv(file: Path) -> Sweep:
    content, about = read_with_companion(file)
    if about is None:
        content, about = _of_older_versions(content)
    heads, *lines = csv.reader(io.StringIO(content, newline=""))
    columns = list(zip(*lines, strict=True))
    runs = int(np.prod(about["shape"]))
    count, middle = len(lines) // runs, 2 + len(about["varied"])
    varied, units = {}, {}
    for (_, label, _, is_text), head, column in zip(about["varied"], heads[2:], columns[2:], strict=False):
        units[label] = _unit(head, label)
        varied[label] = np.array(column[::count]) if is_text else _numbers(column[::count])
    quantities = {}
    for path, head, column in zip(about["paths"], heads[middle + 1 :], columns[middle + 1 :], strict=True):
        units[path] = _unit(head, path)
        quantities[path] = _numbers(column).reshape(runs, count)
    return from_parts(
        about,
        time=_numbers(columns[middle][:count]),
        varied=varied,
        quantities=quantities,
        units=units,
        meanings=about["meanings"],
        status=tuple(columns[1][::count]),
        end_time=np.array(about["end_time"], dtype=float),
        steps=np.array(about["steps"]),
    )


def _of_older_versions(content: str) -> tuple[str, Mapping[str, Any]]:
    """Return the table of a CSV, and what its last line says."""
    cut = content.rstrip("\n").rfind("\n") + 1
    content, last = content[:cut], content[cut:]
    about_text = last.partition(", about: ")[2].rstrip("\n")
    checksum = hashlib.sha256((content + about_text).encode()).hexdigest()
    rows = content.count("\n") - 1
    if last.strip() != _LAST_LINE.format(rows=rows, checksum=checksum, about=about_text).strip():
        raise ValueError("it is cut off, or the file beside it (.csv.json) is missing")
    about: Mapping[str, Any] = json.loads(about_text)
    return content, about


def _unit(head: str, name: str) -> str:
    return head[len(name) + 2 : -1]


def _numbers(cells: tuple[str, ...]) -> NDArray[Any]:
    return np.array([float(cell) if cell else np.nan for cell in cells])


# -- which -------------------------------------------------------------------------------------------------------------

_Write = Callable[[Sweep, Path], None]
_Read = Callable[[Path], Sweep]
_FORMATS: dict[str, tuple[_Write, _Read]] = {
    ".csv": (_write_csv, _read_csv),
    ".nc": (_write_with(write_netcdf), _read_netcdf),
    ".npz": (_write_with(write_npz), _read_with(read_npz)),
    ".mat": (_write_with(write_matlab), _read_with(read_matlab)),
    ".json": (_write_json, _read_json),
}


def _format_of(target: Path) -> tuple[_Write, _Read]:
    return by_suffix(target, _FORMATS, f"Use {', '.join(_FORMATS)}.")
