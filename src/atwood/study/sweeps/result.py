"""What a sweep gives: values, quantities, how each run went, and all of it as arrays with names and dimensions."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import check
from atwood.arrays import FloatArray
from atwood.display import count_of, data_of, listed
from atwood.errors import ResultError, check_known, near_matches, suggestion
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import PATH
from atwood.result.formats.dataset import Dataset, Variable, of_tables, to_xarray, unique_name
from atwood.table import Shown, Table, facts

if TYPE_CHECKING:
    from atwood.study.sweeps.indices import SobolIndices


@dataclass(frozen=True)
class SweepStatistics:
    """What a sweep has cost.

    Attributes
    ----------
    runs, failed
        How many runs there were, and how many of them have no end.
    batched
        How many were run in machine code, many at a time.
    why_single
        Why the others were run one by one, if that was so for all.
    reassembled
        For each run that needed equations of its own, why.
    threads
        How many threads shared the work; 0 for an executor.
    solver_seconds
        Time in the solver, summed over all runs.
    wall_seconds
        Time of the whole sweep.
    """

    runs: int
    failed: int
    batched: int
    why_single: str
    reassembled: Mapping[int, str]
    threads: int
    solver_seconds: float
    wall_seconds: float


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """Many runs of one scene.

    ``sweep["bob2.position.x"]`` is a quantity of all runs, of shape (runs, times); where a run failed, or ended before
    a time, it is nan.

    Attributes
    ----------
    scene, form, level, rtol
        What was run.
    time
        Output times, s.
    end_time
        For each run, the time that it reached, s; nan where it could not start.
    parameters, start
        What was varied, in SI units: for each path one value a run.
    shape
        Of the grid: the number of values of each path that was varied, in order; one number for a list.
    design
        How distributions were sampled; empty where there were none.
    quantities
        By path, shape (runs, times).
    units, meanings
        SI units, and one line of meaning, by path.
    status
        For each run ``"finished"``, ``"stopped"`` (by an event), ``"failed"``, ``"step_limit"``, ``"time_limit"`` or
        ``"interrupted"``.
    messages
        Why a run did not finish, by its number.
    steps
        Steps of the solver, for each run.
    statistics
        What it has cost.
    """

    scene: str
    form: str
    level: str
    rtol: float
    time: FloatArray
    end_time: FloatArray
    parameters: Mapping[str, NDArray[Any]]
    start: Mapping[str, NDArray[Any]]
    shape: tuple[int, ...]
    quantities: Mapping[str, FloatArray]
    units: Mapping[str, str]
    meanings: Mapping[str, str]
    status: tuple[str, ...]
    messages: Mapping[int, str]
    steps: NDArray[np.int64]
    statistics: SweepStatistics
    design: str = ""

    def tables(self) -> tuple[Table, ...]:
        """Return a few facts about the sweep."""
        (_, title), *rest = self._facts()
        return (facts(rest, f"Sweep of {title}"),)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.paths)

    def _facts(self) -> Iterator[tuple[str, str]]:
        """Yield what there is to say of it in a few lines; the first is its title."""
        grid = f", a grid of {' x '.join(map(str, self.shape))}" if len(self.shape) > 1 else ""
        yield "scene", f"{self.scene}, {self.form} form: {count_of(len(self), 'run')}{grid}"
        ranges = (f"{path} {_range(values)} {self.units.get(path, '')}" for path, values in self.varied.items())
        yield "varied", listed((text.strip() for text in ranges), 4)
        many = count_of(len(self.time), "time")
        yield "quantities", f"{listed(self.quantities)} at {many}, t = {self.time[-1]:g} s the last"
        counts = {one: self.status.count(one) for one in dict.fromkeys(self.status)}
        yield "status", ", ".join(f"{number} {one.replace('_', ' ')}" for one, number in counts.items())
        if self.messages:
            yield "messages", listed((f"run {run}: {text}" for run, text in self.messages.items()), 2)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the quantities."""
        return tuple(self.quantities)

    @property
    def varied(self) -> dict[str, NDArray[Any]]:
        """What was varied, one value a run, in the order of the grid."""
        return {**self.parameters, **self.start}

    @property
    def failed(self) -> tuple[int, ...]:
        """Numbers of the runs that have no end; `messages` says why."""
        return tuple(k for k, one in enumerate(self.status) if one not in ("finished", "stopped"))

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, path: str) -> FloatArray:
        """Return a quantity of all runs, shape (runs, times)."""
        path = str(check(PATH, path, "path", "Sweep"))
        if path not in self.quantities:
            kept = suggestion(path, near_matches(path, self.paths)) or f"It kept {', '.join(self.paths[:12])}."
            advice = f"{kept} Whatever else a sweep keeps is said with its argument quantities."
            raise ResultError("the sweep did not keep such a quantity", where=path, advice=advice)
        return self.quantities[path]

    def end(self, path: str) -> FloatArray:
        """Return a quantity at the last output time of all runs, shape (runs,)."""
        return np.asarray(self[path][:, -1])

    def grid(self, path: str) -> FloatArray:
        """Return a quantity at the last output time, in the shape of the grid."""
        return self.end(path).reshape(self.shape)

    def axis(self, path: str) -> NDArray[Any]:
        """Return the values of one axis of the grid."""
        varied = self.varied
        path = str(check(PATH, path, "path", "Sweep.axis"))
        check_known(path, varied, "this was not varied", error=ResultError)
        if len(self.shape) == 1:
            return varied[path]
        position = list(varied).index(path)
        found: NDArray[Any] = np.moveaxis(varied[path].reshape(self.shape), position, 0)
        return found.reshape(self.shape[position], -1)[:, 0]

    def sobol_indices(self, path: str, samples: int = 200) -> SobolIndices:
        """Return how much of the variance of a quantity at the end comes from each thing that was varied.

        The sweep must have the design ``"saltelli"``. Points with a run that has no end are left out, and counted.

        Parameters
        ----------
        path
            The quantity.
        samples
            How many bootstrap samples the errors come from.

        Returns
        -------
        SobolIndices
            First-order and total indices with their errors.

        Raises
        ------
        AtwoodError
            If the sweep has another design, did not keep the quantity, or it does not vary.
        """
        from atwood.study.sweeps.indices import find_indices

        return find_indices(self, path, samples)

    def to_dict(self) -> dict[str, Any]:
        """Return the sweep as plain data; what is nan becomes None."""
        heads = data_of(self, "scene", "form", "level", "rtol", "time", "shape", "design", "parameters", "start")
        quantities = {path: [*map(_finite, values)] for path, values in self.quantities.items()}
        told = data_of(self, "units", "status", "messages")
        ends = {"end_time": _finite(self.end_time), **data_of(self, "steps", "statistics")}
        return {**heads, "quantities": quantities, **told, **ends}

    def save(self, file: str | os.PathLike[str]) -> Path:
        """Save the sweep as ``.nc`` (NetCDF-3), ``.npz``, ``.mat`` (MATLAB), ``.csv`` or ``.json``.

        What was varied has its own names beside the quantities: parameters their paths, start values ``start.`` before
        theirs. A grid has a dimension for each of them, a list the dimension ``run``. `atwood.load_sweep` reads it.

        Parameters
        ----------
        file
            Where to; its suffix says how.
        """
        from atwood.study.sweeps.files import save_sweep

        return save_sweep(self, file)

    def to_dataframe(self) -> Any:
        """Return a table of pandas: a row for each run and output time, with what was varied, and the quantities.

        Returns
        -------
        pandas.DataFrame
            With the index ``run``, ``time``; ``attrs["units"]`` has the SI units by column.

        Raises
        ------
        UsageError
            If pandas is not installed (``pip install 'atwood[data]'``).
        """
        return as_table(self)

    def to_xarray(self) -> Any:
        """Return the sweep as a dataset of xarray, with what was varied as coordinates.

        Returns
        -------
        xarray.Dataset
            A grid has a dimension for each thing that was varied, and ``time``; a list has ``run`` and ``time``.
            Parameters have their paths, start values ``start.`` before theirs.

        Raises
        ------
        UsageError
            If xarray is not installed (``pip install 'atwood[data]'``).
        """
        return to_xarray(as_dataset(self))

    def plot(self, paths: Any = None, file: str | os.PathLike[str] | None = None) -> Any:
        """Draw quantities at the end over what was varied, a map where two values were, and return the figure.

        Parameters
        ----------
        paths
            Which quantities; all when not given.
        file
            Where to save it; its suffix says how.
        """
        # Views stand above studies, and are looked up when one is wanted.
        return import_module("atwood.plotting.plots.sweep").plot_sweep(self, paths, file)


def _finite(values: FloatArray) -> list[float | None]:
    """Return numbers for JSON, None where there is none."""
    return [one if np.isfinite(one) else None for one in values.tolist()]


def _range(values: NDArray[Any]) -> str:
    if values.dtype.kind != "f":
        return listed(dict.fromkeys(values.tolist()), 4)
    return f"{np.min(values):g} to {np.max(values):g}"


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
    pandas, times = of_tables("pandas"), len(sweep.time)
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
    told = data_of(sweep, "scene", "form", "level", "rtol", "shape", "design", "messages", "statistics")
    return {**told, "varied": kinds, "paths": list(sweep.paths)}


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
        **{name: about[name] for name in ("scene", "form", "level", "rtol")},
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
        design=about.get("design", ""),
        statistics=SweepStatistics(**{name: value for name, value in statistics.items() if name in known}),
    )
