"""Sweeps in files: CSV, NetCDF-3 and JSON; a file appears under its name only once it is complete."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from atwood.arguments import FILE, instance, takes
from atwood.errors import UsageError
from atwood.files import check_directory, write_atomically
from atwood.study.sweeps.result import Sweep

__all__ = ["check_sweep_target", "save_sweep"]


@takes(sweep=instance("a Sweep", Sweep), file=FILE)
def save_sweep(sweep: Sweep, file: str | os.PathLike[str]) -> Path:
    """Save a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    file
        Where to; its suffix says how: ``.csv`` (a row for each run and time), ``.nc`` (NetCDF-3) or ``.json``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    UsageError
        If the suffix is not known, or the file cannot be written.
    """
    target = Path(file)
    write = _format_of(target)
    write_atomically(target, lambda part: write(sweep, part))
    return target


def check_sweep_target(file: str | os.PathLike[str]) -> None:
    """Refuse a file that a sweep could not be saved to, before the work is done."""
    _format_of(Path(file))
    check_directory(Path(file))


def _format_of(target: Path) -> Callable[[Sweep, Path], None]:
    suffix = target.suffix.lower()
    if suffix not in _FORMATS:
        problem = f"the suffix {target.suffix!r} is not known" if target.suffix else "the name has no suffix"
        raise UsageError(problem, where=str(target), advice=f"Use {', '.join(_FORMATS)}.")
    return _FORMATS[suffix]


def _write_csv(sweep: Sweep, file: Path) -> None:
    """Write what was varied, the time and the quantities, with units in brackets; what is not known is empty."""
    heads = ["run", "status", *(_head(sweep, path) for path in sweep.varied), "time [s]"]
    heads += [_head(sweep, path) for path in sweep.paths]
    varied = [values.tolist() for values in sweep.varied.values()]
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        for run, status in enumerate(sweep.status):
            first = [run, status, *(_cell(values[run]) for values in varied)]
            for k, t in enumerate(sweep.time.tolist()):
                row = [_cell(float(values[run, k])) for values in sweep.quantities.values()]
                writer.writerow([*first, _cell(t), *row])


def _head(sweep: Sweep, path: str) -> str:
    unit = sweep.units.get(path, "")
    return f"{path} [{unit}]" if unit else path


def _cell(value: Any) -> Any:
    return ("" if not np.isfinite(value) else repr(value)) if isinstance(value, float) else value


def _write_json(sweep: Sweep, file: Path) -> None:
    file.write_text(json.dumps(sweep.to_dict(), allow_nan=False) + "\n", encoding="utf-8")


def _write_netcdf(sweep: Sweep, file: Path) -> None:
    """Write variables by number with the dimensions run and time; their paths are attributes, since names are short."""
    from scipy.io import netcdf_file

    data: Any
    with netcdf_file(str(file), "w", version=2) as data:
        data.title = b"Atwood sweep"
        about = {name: one for name, one in sweep.to_dict().items() if name not in ("quantities", "time")}
        data.atwood = json.dumps(about, allow_nan=False).encode()
        data.createDimension("run", len(sweep))
        data.createDimension("time", len(sweep.time))
        _variable(data, "time", sweep.time, ("time",), "time", "s", "Time.")
        _variable(data, "end_time", sweep.end_time, ("run",), "end_time", "s", "The time that a run reached.")
        for number, (path, values) in enumerate(sweep.varied.items()):
            if values.dtype.kind == "f":  # words are in the attribute
                _variable(
                    data, f"varied_{number}", values, ("run",), path, sweep.units.get(path, ""), "What was varied."
                )
        for number, (path, values) in enumerate(sweep.quantities.items()):
            about_it = sweep.meanings.get(path, "")
            _variable(data, f"quantity_{number}", values, ("run", "time"), path, sweep.units[path], about_it)


def _variable(
    data: Any, name: str, values: Any, dimensions: tuple[str, ...], path: str, unit: str, meaning: str
) -> None:
    variable = data.createVariable(name, "d", dimensions)
    variable[:] = values
    variable.path, variable.units, variable.long_name = path.encode(), unit.encode(), (meaning or path).encode()


_FORMATS: dict[str, Callable[[Sweep, Path], None]] = {".csv": _write_csv, ".nc": _write_netcdf, ".json": _write_json}
