"""Sweeps as arrays with names, dimensions and coordinates, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.result.formats.dataset import Dataset, Variable, needed, unique_name
from atwood.study.sweeps.result import Sweep, SweepStatistics

_OWN = ("run", "time", "end_time", "status", "steps")
"""What stands beside the quantities of a sweep."""


def labels(sweep: Sweep) -> dict[str, str]:
    """Return what each thing that was varied is called beside the quantities: no two of these names are the same.

    A parameter has its path, a start value ``start.`` before it, since there is mostly a quantity of its path.
    """
    taken = {*_OWN, *sweep.quantities}
    found = {}
    for path in sweep.parameters:
        found[path] = unique_name(f"parameter.{path}" if path in taken else path, taken)
    for path in sweep.start:
        found[path] = unique_name(f"start.{path}", taken)
    return found


def as_dataset(sweep: Sweep) -> Dataset:
    """Return a sweep as arrays: a grid has a dimension for each thing that was varied, a list the dimension ``run``."""
    named = labels(sweep)
    is_grid = len(named) == len(sweep.shape)
    runs = tuple(named.values()) if is_grid else ("run",)
    found = [Variable("time", ("time",), sweep.time, "s", "Time.", True)]
    for path, label in named.items():
        values, along = (sweep.axis(path), (label,)) if is_grid else (sweep.varied[path], runs)
        meaning = "Start value." if path in sweep.start else "Parameter."
        found.append(Variable(label, along, values, sweep.units.get(path, ""), meaning, True))
    numbers = np.arange(len(sweep)).reshape(sweep.shape)
    found.append(Variable("run", runs, numbers, "1", "Number of the run.", True))
    for path, each in sweep.quantities.items():
        values = each.reshape(*sweep.shape, len(sweep.time))
        found.append(Variable(path, (*runs, "time"), values, sweep.units[path], sweep.meanings.get(path, "")))
    ends, steps = sweep.end_time.reshape(sweep.shape), sweep.steps.reshape(sweep.shape)
    found.append(Variable("end_time", runs, ends, "s", "Time that the run reached."))
    found.append(Variable("steps", runs, steps, "1", "Steps of the solver."))
    found.append(Variable("status", runs, np.array(sweep.status).reshape(sweep.shape), "", "How the run ended."))
    return Dataset("Atwood sweep", tuple(found), about_sweep(sweep))


def as_table(sweep: Sweep) -> Any:
    """Return a sweep as a table of pandas; see `Sweep.to_dataframe`."""
    pandas, times = needed("pandas"), len(sweep.time)
    index = pandas.MultiIndex.from_product([range(len(sweep)), sweep.time], names=["run", "time"])
    columns = {label: np.repeat(sweep.varied[path], times) for path, label in labels(sweep).items()}
    columns["status"] = np.repeat(np.array(sweep.status), times)
    table = pandas.DataFrame(columns | {path: values.ravel() for path, values in sweep.quantities.items()}, index=index)
    named = {label: sweep.units.get(path, "") for path, label in labels(sweep).items()}
    table.attrs["units"] = {**named, **{path: sweep.units[path] for path in sweep.quantities}, "time": "s"}
    return table


def about_sweep(sweep: Sweep) -> dict[str, Any]:
    """Return all of a sweep that is no array, as plain data."""
    words = {path for path, values in sweep.varied.items() if values.dtype.kind != "f"}
    kinds = [[path, label, path in sweep.start, path in words] for path, label in labels(sweep).items()]
    whole = sweep.to_dict()
    return {
        **{name: whole[name] for name in ("scene", "form", "level", "rtol", "shape", "messages", "statistics")},
        "varied": kinds,
        "paths": list(sweep.paths),
    }


def from_dataset(data: Dataset) -> Sweep:
    """Return the sweep that arrays were made of."""
    arrays, about = data.by_path(), data.about
    shape = tuple(about["shape"])
    varied = {}
    for _, label, *_ in about["varied"]:
        one, every = arrays[label], arrays["run"].dimensions
        along = [size if name in one.dimensions else 1 for name, size in zip(every, shape, strict=True)]
        varied[label] = np.broadcast_to(one.values.reshape(along), shape).ravel()
    quantities = {path: arrays[path] for path in about["paths"]}
    runs = int(np.prod(shape))
    return from_parts(
        about,
        time=arrays["time"].values,
        varied=varied,
        quantities={path: one.values.reshape(runs, -1) for path, one in quantities.items()},
        units={path: one.unit for path, one in arrays.items()},
        meanings={path: one.meaning for path, one in quantities.items()},
        status=tuple(arrays["status"].values.ravel().tolist()),
        end_time=arrays["end_time"].values.ravel(),
        steps=arrays["steps"].values.ravel(),
    )


def from_parts(
    about: Mapping[str, Any],
    *,
    time: NDArray[Any],
    varied: Mapping[str, NDArray[Any]],
    quantities: Mapping[str, NDArray[Any]],
    units: Mapping[str, str],
    meanings: Mapping[str, str],
    status: tuple[str, ...],
    end_time: NDArray[Any],
    steps: NDArray[Any],
) -> Sweep:
    """Return a sweep from its arrays and what `about_sweep` says of it."""
    runs = int(np.prod(about["shape"]))
    expected = [(time, time.shape[:1]), (end_time, (runs,)), (steps, (runs,))]
    expected += [(values, (runs,)) for values in varied.values()]
    expected += [(values, (runs, *time.shape)) for values in quantities.values()]
    if not time.size or any(a.shape != shape or a.dtype.kind not in "biufU" for a, shape in expected):
        raise ValueError("its arrays do not fit together")
    if len(status) != runs or not all(isinstance(one, str) for one in (*status, *meanings, *meanings.values())):
        raise ValueError("it does not say how its runs ended, or what its quantities mean")
    statistics = dict(about["statistics"])
    statistics["reassembled"] = {int(run): text for run, text in statistics["reassembled"].items()}
    known = {one.name for one in fields(SweepStatistics)}
    kinds = [(path, label, is_start) for path, label, is_start, *_ in about["varied"]]
    return Sweep(
        scene=about["scene"],
        form=about["form"],
        level=about["level"],
        rtol=about["rtol"],
        time=time,
        end_time=end_time,
        parameters={path: varied[label] for path, label, is_start in kinds if not is_start},
        start={path: varied[label] for path, label, is_start in kinds if is_start},
        shape=tuple(about["shape"]),
        quantities=dict(quantities),
        units={path: units.get(label, "") for path, label, _ in kinds} | {path: units[path] for path in quantities},
        meanings=dict(meanings),
        status=status,
        messages={int(run): text for run, text in about["messages"].items()},
        steps=np.asarray(steps, dtype=np.int64),
        statistics=SweepStatistics(**{name: value for name, value in statistics.items() if name in known}),
    )
