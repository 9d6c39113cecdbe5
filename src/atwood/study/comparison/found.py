"""A comparison: a row for each run, where it was measured, a verdict in one line, data, files and pictures."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from atwood.arguments import FILE, takes
from atwood.display import count_of, data_of, duration, fitted
from atwood.files import check_target
from atwood.lazy_dataclasses import dataclass, names_of
from atwood.result.about import versions
from atwood.result.formats.companion import write_with_companion
from atwood.simulation.problem.options import how_solved
from atwood.study.comparison.reference import Reference
from atwood.table import Shown, Table, table

RELATIVE = (
    "Errors and constraint drifts are relative to the size of the scene, or in rad; energy drifts to what it exchanges."
)
"""What the figures of a comparison are relative to."""

_NUMBERS = ("rtol", "error", "estimate", "ms", "steps", "residuals", "Jacobians", "energy", "constraint")

_WORK = ("equations", "jacobians", "linear", "projections", "own", "monitor", "outputs")
"""Kinds of work of a run, each with a field of `ComparisonRow`."""


@dataclass(frozen=True)
class ComparisonRow:
    """One run of a comparison.

    Attributes
    ----------
    form, level
        Form, and level of the dae form.
    solver
        Name of the solver.
    rtol
        Relative tolerance.
    error
        Largest scaled difference from the reference, in positions of bodies and angles.
    estimate
        The same as the run itself tells it, without the reference: `Result.accuracy`, by the next more accurate run of
        its kind. None where there is none.
    wall_s
        Time spent integrating, s, without outputs on the way and without what looks out for singular positions between
        steps, which is none of the form's own cost: the least of three runs.
    steps
        Steps of the solver.
    residuals, jacobians
        Evaluations of the equations, and of their Jacobian with its factorisation.
    monitor_s
        Time spent looking out for singular positions, s.
    outputs_s
        Time spent on handing out states, s: interpolation, projection onto the constraints, recording.
    equations_s, jacobians_s
        What of the time spent integrating went into evaluations of the equations and of their Jacobian, s: how often
        there was one, times what one takes by itself. Explicit methods evaluate accelerations, in which the
        elimination is. None where functions in Python are called, in runs with events, and where a method has programs
        of its own.
    linear_s, projections_s
        The same of factorisations and solutions with them, of matrices that are not sparse, and of projections onto
        the constraints at the ends of steps; None where there are none.
    own_s
        What is left of it: the method's own steps, predictions, error estimates.
    energy_drift
        Error of the energy, relative to what the scene exchanges; see `atwood.result.energy.EnergyLedger`.
    constraint_drift
        By how much the constraints are missed by what the run gives, relative to the scene's sizes.
    constraint_held
        The same for the solver's own states, before projection.
    errors
        The largest scaled difference from the reference in the quantities of each part, by path.
    within_reference
        Whether the error is not larger than ten times the reference's own.
    reason
        Why there are no numbers; empty if there are.
    """

    form: str
    level: str
    solver: str
    rtol: float
    error: float | None = None
    estimate: float | None = None
    wall_s: float | None = None
    steps: int | None = None
    residuals: int | None = None
    jacobians: int | None = None
    monitor_s: float | None = None
    outputs_s: float | None = None
    equations_s: float | None = None
    jacobians_s: float | None = None
    linear_s: float | None = None
    projections_s: float | None = None
    own_s: float | None = None
    energy_drift: float | None = None
    constraint_drift: float | None = None
    constraint_held: float | None = None
    errors: Mapping[str, float] = field(default_factory=dict)
    within_reference: bool = False
    reason: str = ""

    @property
    def label(self) -> str:
        """Form, level and solver in words, such as ``"dae (ggl), IDA"``."""
        return how_solved(self.form, self.level, [self.solver])

    def cells(self) -> tuple[str, ...]:
        """Return form, tolerance, error, estimate, ms, counts, and drifts of energy and constraints as texts."""
        form = (self.label, f"{self.rtol:.0e}")
        if self.reason:
            return (*form, "failed", *[""] * (len(_NUMBERS) - 2))
        mark = "*" if self.within_reference else ""
        numbers = (self.estimate, 1e3 * (self.wall_s or 0.0), self.steps, self.residuals, self.jacobians)
        estimate, wall, *counts = ("" if one is None else one for one in numbers)
        drifts = (f"{drift or 0.0:.1e}" for drift in (self.energy_drift, self.constraint_drift))
        told = estimate if estimate == "" else f"{estimate:.1e}"
        return (*form, f"{self.error or 0.0:.1e}{mark}", told, f"{wall:.3g}", *(str(one) for one in counts), *drifts)

    def shares(self) -> tuple[str, ...]:
        """Return form, tolerance, ms of each kind of work, and the part with the largest error, as texts."""
        works = (getattr(self, f"{name}_s") for name in _WORK)
        worst = max(self.errors, key=self.errors.__getitem__, default="")
        return (self.label, f"{self.rtol:.0e}", *("" if s is None else f"{1e3 * s:.3g}" for s in works), worst)


@dataclass(frozen=True)
class Comparison(Shown):
    """What each form costs for which error.

    Attributes
    ----------
    scene
        Name of the scene.
    t_end
        Time of the end, s.
    reference
        What the errors are measured against.
    rows
        One for each form, level and tolerance.
    environment
        On what it was measured: processor, versions, threads, date.
    """

    scene: str
    t_end: float
    reference: Reference
    rows: tuple[ComparisonRow, ...]
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """What the comparison says, in one line."""
        return judge((row.label, row.error, row.wall_s) for row in self.rows if not row.reason)

    def tables(self) -> tuple[Table, ...]:
        """Return a row for each run, with why those failed that did."""
        failed = [f"{row.label} at {row.rtol:.0e} failed: {row.reason}" for row in self.rows if row.reason]
        near = any(row.within_reference for row in self.rows)
        told = [f"Errors are against {self.reference.description}.", self.reference.note, *failed, RELATIVE]
        told += ["* within ten times the error of the reference itself"] * near
        title, notes = f"{self.scene} to t = {self.t_end:g} s", [*filter(None, told), "", self.verdict]
        headings = ("form", *(f"{name}>" for name in _NUMBERS))
        where = "Where the time goes, ms; outputs and the look-out for singular positions come on top; largest error"
        names = ("form", "rtol>", *(f"{name}>" for name in _WORK), "in")
        shares = table(names, [row.shares() for row in self.rows if not row.reason], where)
        return table(headings, [row.cells() for row in self.rows], title, notes), shares

    __str__ = Shown.as_text

    def __repr__(self) -> str:
        runs = f"{count_of(len(self.rows), 'run')} to t = {self.t_end:g} s, against {self.reference.description}"
        failed = sum(bool(row.reason) for row in self.rows)
        lines = [f"<Comparison of {self.scene}: {runs}>", self.verdict, *([f"{failed} without numbers"] * bool(failed))]
        return fitted("\n    ".join(line for line in lines if line))

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data."""
        reference = data_of(self.reference, "kind", "description", "error", "note")
        return {
            **data_of(self, "scene", "t_end"),
            "reference": reference | {"quantities": list(self.reference.quantities)},
            **data_of(self, "rows", "verdict", "environment"),
        }

    @takes(file=FILE)
    def save(self, file: str | os.PathLike[str]) -> Path:
        """Save the rows as CSV, and the environment in a file beside it, ``rows.csv.json``.

        Parameters
        ----------
        file
            Where to; its suffix is ``.csv``.

        Raises
        ------
        UsageError
            If it has another suffix, or cannot be written.
        """
        return write_rows([self], file)

    def plot(self, file: Any = None) -> Any:
        """Draw the work-precision diagram, and return the figure.

        Parameters
        ----------
        file
            Where to save it; its suffix says how.
        """
        from importlib import import_module  # views stand above studies, and are looked up when one is wanted

        return import_module("atwood.plotting.plots.precision").plot_comparison(self, file)


def write_rows(comparisons: Sequence[Comparison], file: str | os.PathLike[str]) -> Path:
    """Save the rows of comparisons as one CSV file, and return it; see `Comparison.save`."""
    target = check_rows_file(file)
    names = ["scene", "t_end", *names_of(ComparisonRow)]

    rows: list[Sequence[object]] = [names]
    for one in comparisons:
        for row in one.rows:
            cells = (getattr(row, name) for name in names[2:])
            cells = (" ".join(f"{k}={v:.3g}" for k, v in c.items()) if isinstance(c, dict) else c for c in cells)
            rows.append([one.scene, one.t_end, *("" if cell is None else cell for cell in cells)])
    environment = comparisons[0].environment if comparisons else {}
    write_with_companion(target, rows, {"environment": environment})
    return target


def check_rows_file(file: str | os.PathLike[str]) -> Path:
    """Return a file for rows, or refuse one that they cannot be written to."""
    target = Path(file)
    check_target(target, [".csv"])
    return target


_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def environment() -> dict[str, str]:
    """Return processor, system, versions, BLAS, threads and date, in words."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {**_lasting(), "threads": _threads(), "load": _load(), "date": now}


@cache
def _lasting() -> dict[str, str]:
    found = versions()
    python = found.pop("python")
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.release()}",
        "python": f"{platform.python_implementation()} {python}",
        "versions": ", ".join(f"{name} {number}" for name, number in [*found.items(), ("llvm", _llvm())]),
        "blas": _blas(),
    }


def _processor() -> str:
    """Return the name of the processor, and how many of them may be used."""
    name = platform.processor() or platform.machine()
    table = Path("/proc/cpuinfo")
    if table.is_file():
        lines = (line.partition(":") for line in table.read_text(encoding="utf-8", errors="replace").splitlines())
        name = next((value.strip() for key, _, value in lines if key.strip() == "model name"), name)
    return f"{name}, {platform.machine()}"


def _threads() -> str:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    given = ", ".join(f"{name}={os.environ[name]}" for name in _THREADS if name in os.environ)
    return f"runs in one thread of {usable}; BLAS: {given or 'as it chooses'}"


def _load() -> str:
    """Return how busy the machine was in the last minute; figures taken beside other work mean little."""
    return f"{os.getloadavg()[0]:.1f} over the last minute" if hasattr(os, "getloadavg") else "unknown"


def _llvm() -> str:
    from llvmlite import binding

    return ".".join(map(str, binding.llvm_version_info))


def _blas() -> str:
    import numpy as np

    told: Any = np.show_config(mode="dicts")
    found = told.get("Build Dependencies", {}).get("blas", {}) if isinstance(told, dict) else {}
    return " ".join(str(found[key]) for key in ("name", "version") if found.get(key)) or "unknown"


def judge(rows: Iterable[tuple[str, float | None, float | None]]) -> str:
    """Return which form is cheapest at an error that all reach, and by how much."""
    curves: dict[str, list[tuple[float, float]]] = {}
    for label, error, wall in rows:
        if error is not None and wall:
            curves.setdefault(label, []).append((max(error, 1e-16), wall))
    if len(curves) < 2:
        return "There is nothing to compare." if not curves else f"Only {next(iter(curves))} gave an answer."
    span = _common_errors(curves)
    if span is None:
        return "The forms reach no error in common: look at the rows."
    target = 10.0 ** round(math.log10(span))
    found = ((cost_at(points, target), label) for label, points in curves.items())
    costs = sorted((cost, label) for cost, label in found if cost is not None)
    (least, best), (most, _worst) = costs[0], costs[-1]
    if most < 1.15 * least:
        return f"For an error of {target:.0e} all cost the same, {duration(least)}."
    rest = ", ".join(f"{label} {duration(cost)}" for cost, label in costs[1:])
    times = f"up to {most / least:.1f} times as long"
    return f"For an error of {target:.0e}, {best} takes {duration(least)}; {rest}: {times}."


def _common_errors(curves: dict[str, list[tuple[float, float]]]) -> float | None:
    """Return an error that as many curves as possible reach, at least two of them."""
    candidates = sorted({10.0 ** round(math.log10(error)) for points in curves.values() for error, _ in points})
    counted = [(sum(_reaches(points, error) for points in curves.values()), error) for error in candidates]
    most = max(count for count, _ in counted)
    if most < 2:
        return None
    shared = [error for count, error in counted if count == most]
    return shared[len(shared) // 2]


def _reaches(points: list[tuple[float, float]], error: float) -> bool:
    """Return whether an error lies between the smallest and the largest of a curve, or nearly so."""
    errors = [one for one, _ in points]
    return min(errors) / 3.0 <= error <= 3.0 * max(errors)


def cost_at(points: list[tuple[float, float]], error: float) -> float | None:
    """Return the time at an error, between the runs by logarithms; None if they do not come near it."""
    if not _reaches(points, error):
        return None
    ordered = sorted(points)
    errors, walls = (np.log([point[i] for point in ordered]) for i in (0, 1))
    return float(np.exp(np.interp(math.log(error), errors, walls)))
