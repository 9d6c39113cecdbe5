"""What a comparison found: a row for each run, in text, as data, in files and as pictures."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from atwood.arguments import FILE, takes
from atwood.errors import UsageError
from atwood.files import check_directory
from atwood.late import dataclass, names_of
from atwood.result.formats.companion import write_with_companion
from atwood.showing import count_of, data_of, fitted
from atwood.simulation.problem.options import how_solved
from atwood.study.comparison.reference import Reference
from atwood.study.comparison.verdict import judge
from atwood.table import Shown, Table, table

__all__ = ["RELATIVE", "Comparison", "ComparisonRow", "check_rows_file", "write_rows"]

RELATIVE = (
    "Errors and constraint drifts are relative to the size of the scene, or in rad; energy drifts to what it exchanges."
)
"""What the figures of a comparison are relative to."""

_NUMBERS = ("rtol", "error", "estimate", "ms", "steps", "residuals", "Jacobians", "energy", "constraint")


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
    energy_drift
        Error of the energy, relative to what the scene exchanges; see `atwood.result.energy.EnergyLedger`.
    constraint_drift
        By how much the constraints are missed by what the run gives, relative to the scene's sizes.
    constraint_held
        The same for the solver's own states, before projection.
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
    energy_drift: float | None = None
    constraint_drift: float | None = None
    constraint_held: float | None = None
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
        return (table(headings, [row.cells() for row in self.rows], title, notes),)

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
    """Save the rows of comparisons as one CSV file, and return it; see `Comparison.save`.

    Parameters
    ----------
    comparisons
        Made in one environment.
    file
        Where to.
    """
    target = check_rows_file(file)
    names = ["scene", "t_end", *names_of(ComparisonRow)]

    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(names)
    for one in comparisons:
        for row in one.rows:
            cells = (getattr(row, name) for name in names[2:])
            table.writerow([one.scene, one.t_end, *("" if cell is None else cell for cell in cells)])
    environment = comparisons[0].environment if comparisons else {}
    write_with_companion(target, text.getvalue().encode(), {"environment": environment})
    return target


def check_rows_file(file: str | os.PathLike[str]) -> Path:
    """Return a file for rows, or refuse one that they cannot be written to."""
    target = Path(file)
    if target.suffix.lower() != ".csv":
        raise UsageError(f"the suffix {target.suffix!r} is not known", where=str(file), advice="Use .csv.")
    check_directory(target)
    return target
