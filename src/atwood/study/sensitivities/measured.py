"""Measurements for a fit: columns over time by the paths of quantities, from tables, datasets, files and results."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from atwood.arguments import show
from atwood.arrays import FloatArray, IndexArray
from atwood.errors import AtwoodError, UsageError, suggestion_in_parts
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.lazy_dataclasses import dataclass
from atwood.model.values.units import parse_unit
from atwood.result.files import SavedResult
from atwood.result.result import Result

_HEADING = re.compile(r"(?P<path>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*\Z")


@dataclass(frozen=True, eq=False)
class Measured:
    """One experiment.

    Attributes
    ----------
    name
        Where it comes from, in words.
    time
        Times at which the run is asked for, s, each once.
    place
        For each sample the number of its time, shape (samples,).
    values
        By path of a quantity, SI units, shape (samples,).
    given
        Parameters and start values of this experiment alone, by path.
    """

    name: str
    time: FloatArray
    place: IndexArray
    values: Mapping[str, FloatArray]
    given: Mapping[str, Any]


def read_experiments(assembly: Assembly, data: Any, quantities: Iterable[str] | None) -> tuple[Measured, ...]:
    """Return the experiments of a fit: one set of data, or a list of these, or of pairs of data and what was set."""
    several = data if isinstance(data, (list, tuple)) else [data]
    if not several:
        raise UsageError("there are no data", where="fit", advice="Give a table, a file or a result.")
    return tuple(_experiment(assembly, one, quantities, k, len(several)) for k, one in enumerate(several))


def _experiment(assembly: Assembly, data: Any, quantities: Iterable[str] | None, number: int, count: int) -> Measured:
    given: Mapping[str, Any] = {}
    if isinstance(data, tuple) and len(data) == 2 and isinstance(data[1], Mapping):
        data, given = data
    name = str(data) if isinstance(data, (str, os.PathLike)) else "the data" if count == 1 else f"experiment {number}"
    time, columns, units = _read(data, name)
    known = assembly.observables
    chosen = list(columns)
    if quantities is not None:
        chosen = list(dict.fromkeys(quantities))
    elif isinstance(data, (Result, SavedResult)):
        chosen = [one.name for one in assembly.reduced.names if one.name in columns and one.name in known]
    stray = [one for one in chosen if one not in known]
    if stray or not chosen:
        advice = f"{suggestion_in_parts(stray[0], known) if stray else ''} Or name what counts in quantities."
        raise UsageError(
            f"no quantity is called as its column {', '.join(stray[:1])}", where=name, advice=advice.strip()
        )
    values = {}
    for one in find_observables(assembly, chosen):
        if one.path not in columns:
            raise UsageError(f"it has no column {one.path}", where=name, advice=f"It has {', '.join(columns)}.")
        values[one.path] = _converted(columns[one.path], units.get(one.path, ""), one.unit, f"{name}: {one.path}")
    time = _converted(time, units.get("", ""), "s", f"{name}: its times")
    if np.any(time < assembly.flat.t_start):
        raise UsageError(
            f"it has a time of {float(np.min(time)):g} s, before the run starts at {assembly.flat.t_start:g} s",
            where=name,
            advice="Count times from the start of the run.",
        )
    if not np.max(time) > assembly.flat.t_start:
        raise UsageError("all its times are that of the start", where=name, advice="Give times of the motion.")
    every, place = np.unique(time, return_inverse=True)
    return Measured(name, every, np.reshape(place, -1), values, given)


def _converted(values: FloatArray, unit: str, wanted: str, where: str) -> FloatArray:
    """Return numbers in an SI unit; what is none, or of another dimension, is refused."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise UsageError(
            f"its value in row {int(bad[0])} is {values[bad[0]]:g}",
            where=where,
            advice="Leave out rows without values.",
        )
    if not unit:
        return values
    try:
        own, asked = parse_unit(unit), parse_unit(wanted)
    except AtwoodError as error:
        raise UsageError(error.message, where=where, advice=error.advice) from None
    if not own.has_dimension_of(asked):
        raise UsageError(f"it is in {unit}, and the quantity is in {wanted}", where=where, advice=f"Give {wanted}.")
    return values * (own.factor / asked.factor)


_Columns = tuple[FloatArray, dict[str, FloatArray], dict[str, str]]
"""Times, columns by path, and units by path; the unit of times is that of an empty path."""


def _read(data: Any, name: str) -> _Columns:
    if isinstance(data, (Result, SavedResult)):
        return data.time, {path: np.asarray(data[path], dtype=float) for path in data.paths}, {}
    if isinstance(data, (str, os.PathLike)):
        return _csv(Path(data), name)
    if isinstance(data, Mapping) and not hasattr(data, "coords"):
        columns = {str(key): _numbers(value, name, str(key)) for key, value in data.items()}
        return _first_is_time(columns, name)
    if hasattr(data, "coords") and hasattr(data, "data_vars"):
        return _dataset(data, name)
    if hasattr(data, "columns") and hasattr(data, "index"):
        return _table(data, name)
    raise UsageError(
        f"{type(data).__name__} is nothing that data are read from",
        where=name,
        advice="Give a table of pandas, a dataset of xarray, a CSV file, a dictionary of arrays or a result.",
    )


def _numbers(values: Any, name: str, column: str) -> FloatArray:
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        stray = next((one for one in values if not _is_number(one)), values)
        said = f"its entry {show(stray)} is no number"
        raise UsageError(said, where=f"{name}: {column}", advice="Leave out rows without values.") from None
    if found.ndim != 1 or not len(found):
        raise UsageError(f"its shape is {found.shape}, and not one of numbers over time", where=f"{name}: {column}")
    return found


def _is_number(one: Any) -> bool:
    try:
        float(one)
    except (TypeError, ValueError):
        return False
    return True


def _first_is_time(columns: Mapping[str, FloatArray], name: str) -> _Columns:
    """Return columns of which the first is the time; a unit stands in brackets behind the path."""
    if len(columns) < 2:
        raise UsageError("it has no column beside that of the time", where=name, advice="The first column is the time.")
    if len({len(one) for one in columns.values()}) > 1:
        raise UsageError("its columns differ in length", where=name, advice="Give each of them a value for each time.")
    found, units = {}, {}
    for number, (heading, values) in enumerate(columns.items()):
        match = _HEADING.match(heading)
        path = "" if number == 0 else (match["path"] if match else heading)
        found[path], units[path] = values, (match["unit"] or "") if match else ""
    time = found.pop("")
    return time, found, {path: unit for path, unit in units.items() if unit}


def _csv(file: Path, name: str) -> _Columns:
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:  # some programs begin a file with a mark of order
            reader = csv.reader(stream)
            rows = [(row, reader.line_num) for row in reader if row and not row[0].lstrip().startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"it cannot be read ({error})", where=name) from None
    if len(rows) < 2:
        said = "it has no rows below its headings" if rows else "it is empty"
        raise UsageError(said, where=name, advice="Write headings in its first line and numbers below.")
    heading = [one.strip() for one in rows[0][0]]
    if len(heading) == 1:
        advice = "The first column is the time; columns are separated by commas."
        raise UsageError(f"it has a single column, {heading[0]!r}", where=name, advice=advice)
    twice = next((one for k, one in enumerate(heading) if one in heading[:k]), None)
    if twice is not None:
        raise UsageError(f"it has two columns {twice!r}", where=name, advice="Leave one of them out.")
    for line, number in rows[1:]:
        if len(line) != len(heading):
            raise UsageError(f"line {number} has {len(line)} entries under {len(heading)} headings", where=name)
    columns = {one: _numbers([line[k] for line, _ in rows[1:]], name, one) for k, one in enumerate(heading)}
    return _first_is_time(columns, name)


def _table(data: Any, name: str) -> _Columns:
    units = dict(getattr(data, "attrs", {}).get("units", {}))
    columns = {str(one): _numbers(data[one], name, str(one)) for one in data.columns}
    counted = type(data.index).__name__ == "RangeIndex" and data.index.name is None
    if not counted:
        columns = {data.index.name or "time": _numbers(data.index, name, "its index"), **columns}
    time, found, own = _first_is_time(columns, name)
    own = {path: unit for path, unit in units.items() if path in found} | own
    return time, found, ({"": units["time"]} if units.get("time") else {}) | own


def _dataset(data: Any, name: str) -> _Columns:
    if "time" not in data.coords:
        raise UsageError("it has no coordinate 'time'", where=name, advice="Call its times so, in seconds.")
    found = {str(one): _numbers(data[one].values, name, str(one)) for one in data.data_vars}
    units = {str(one): str(data[one].attrs.get("units", "")) for one in data.data_vars}
    units[""] = str(data["time"].attrs.get("units", ""))
    return _numbers(data["time"].values, name, "time"), found, {path: unit for path, unit in units.items() if unit}
