"""Speed against error: one scene in both forms, at several tolerances, against a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np

from atwood.arguments import each, instance, takes, whole
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.forms.canonical import is_canonical
from atwood.forms.dae import LEVELS
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.model.local.flatten import flatten
from atwood.pipeline import assemble_flat
from atwood.progress import told
from atwood.showing import count_of, fitted, html_table
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.arguments import FORM, FORMS, LEVEL, LIMITS, NAME, PROGRESS, RTOL, T_END, check_span
from atwood.simulation.problem.closed_loops import solve_at
from atwood.simulation.problem.options import SOLVERS
from atwood.simulation.problem.preparation import make_plan
from atwood.simulation.run.choice import implicit_solver
from atwood.study.comparison.reference import (
    Assembled,
    Reference,
    find_reference,
    run_form,
    scaled_difference,
    table_at,
)
from atwood.study.comparison.verdict import judge

__all__ = ["RELATIVE", "Comparison", "ComparisonRow", "Reference", "compare"]

RELATIVE = (
    "Errors and constraint drifts are relative to the size of the scene, or in rad; energy drifts to what it exchanges."
)
"""What the figures of a comparison are relative to."""

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)


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
    wall_s
        Time spent integrating, without outputs on the way, s: the least of three runs.
    steps
        Steps of the solver.
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
    wall_s: float | None = None
    steps: int | None = None
    energy_drift: float | None = None
    constraint_drift: float | None = None
    constraint_held: float | None = None
    within_reference: bool = False
    reason: str = ""

    @property
    def label(self) -> str:
        """Form and level in words, and the method where it is not the one that both forms share."""
        form = f"{self.form} ({self.level})" if self.level else self.form
        other = next((key for key in ("explicit", "gauss") if self.solver == SOLVERS[key]), "")
        return f"{form}, {other}" if other else form


@dataclass(frozen=True)
class Comparison:
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
    """

    scene: str
    t_end: float
    reference: Reference
    rows: tuple[ComparisonRow, ...]

    @property
    def verdict(self) -> str:
        """What the comparison says, in one line."""
        return judge((row.label, row.error, row.wall_s) for row in self.rows if not row.reason)

    def __str__(self) -> str:
        head = f"{'form':<24}{'rtol':>8}{'error':>10}{'ms':>10}{'steps':>8}{'energy':>10}{'constraint':>12}"
        lines = [f"{self.scene} to t = {self.t_end:g} s, against {self.reference.description}", "", head]
        for row in self.rows:
            if row.reason:
                lines.append(f"{row.label:<24}{row.rtol:>8.0e}  {row.reason}")
                continue
            numbers = (row.error, 1e3 * (row.wall_s or 0.0), row.steps, row.energy_drift, row.constraint_drift)
            error, wall, steps, energy, drift = (float(number or 0.0) for number in numbers)
            mark = "*" if row.within_reference else " "
            lines.append(
                f"{row.label:<24}{row.rtol:>8.0e}{error:>9.1e}{mark}{wall:>10.3g}{steps:>8.0f}{energy:>10.1e}{drift:>12.1e}"
            )
        return "\n".join([*lines, RELATIVE, "", self.verdict])

    def __repr__(self) -> str:
        runs = f"{count_of(len(self.rows), 'run')} to t = {self.t_end:g} s, against {self.reference.description}"
        failed = sum(bool(row.reason) for row in self.rows)
        lines = [f"<Comparison of {self.scene}: {runs}>", self.verdict, *([f"{failed} without numbers"] * bool(failed))]
        return fitted("\n    ".join(line for line in lines if line))

    def _repr_html_(self) -> str:
        heads = ("form", "rtol", "error", "ms", "steps", "energy drift", "constraint drift", "")
        cells = []
        for row in self.rows:
            wall = None if row.wall_s is None else 1e3 * row.wall_s
            numbers = (row.error, wall, row.steps, row.energy_drift, row.constraint_drift)
            shown = ("" if one is None else one if isinstance(one, int) else f"{one:.3g}" for one in numbers)
            note = row.reason or ("as accurate as the reference" if row.within_reference else "")
            cells.append((row.label, f"{row.rtol:.0e}", *shown, note))
        title = f"{self.scene} to t = {self.t_end:g} s, against {self.reference.description}"
        return html_table(title, heads, cells, f"{RELATIVE} {self.verdict}")

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data."""
        reference = self.reference
        return {
            "scene": self.scene,
            "t_end": self.t_end,
            "reference": {
                "kind": reference.kind,
                "description": reference.description,
                "error": reference.error,
                "note": reference.note,
                "quantities": list(reference.quantities),
            },
            "rows": [dict(vars(row)) for row in self.rows],
            "verdict": self.verdict,
        }

    def plot(self, file: Any = None) -> Any:
        """Draw the work-precision diagram, and return the figure.

        Parameters
        ----------
        file
            Where to save it; its suffix says how.
        """
        from importlib import import_module  # views stand above studies, and are looked up when one is wanted

        return import_module("atwood.plotting.plots.precision").plot_comparison(self, file)


@takes(
    scene=instance("a scene, such as Scene()", Model),
    t_end=T_END,
    rtols=each(RTOL, "tolerances between 0 and 1", 1),
    forms=each(FORM, f"some of {', '.join(map(repr, FORMS))}", 1),
    levels=each(LEVEL, f"some of {', '.join(map(repr, LEVELS))}", 1),
    outputs=whole("a whole number of output times, 2 to 1,000,000", 2, 1_000_000),
    max_seconds=LIMITS["max_seconds"],
    name=NAME,
    progress=PROGRESS,
)
def compare(
    scene: Model,
    *,
    t_end: float | str | None = None,
    rtols: Sequence[float] = TOLERANCES,
    forms: Sequence[str] = FORMS,
    levels: Sequence[str] = ("ggl", "index1-projected", "index1"),
    outputs: int = 101,
    max_seconds: float | None = 60.0,
    name: str | None = None,
    progress: Callable[[str, int, int], object] | None = None,
) -> Comparison:
    """Run a scene in both forms at several tolerances, and measure what each costs for which error.

    Parameters
    ----------
    scene
        The scene. Where its class has a method ``closed_form(t)`` that gives trajectories by path, and its start is
        the one that the closed form belongs to, errors are measured against that; where all coordinates but one are
        ignorable, against quadratures (`atwood.reduced`); else against a solution that is far more accurate.
    t_end
        Time of the end, s; the scene's own if not given.
    rtols
        Relative tolerances.
    forms, levels
        Forms, and levels of the dae form.
    outputs
        Number of output times at which errors are measured.
    max_seconds
        Limit of each run; the reference may take ten times as long.
    name
        What to call the scene.
    progress
        Called with what is being done, how many runs are done, and of how many.

    Returns
    -------
    Comparison
        A row for each run; a run that fails stays in it, with the reason.

    Raises
    ------
    SolveError
        If no reference could be found.
    UsageError
        If a form, a level or a tolerance makes no sense.
    """
    flat = flatten(scene, name)
    assembled = cache(lambda form, level: assemble_flat(flat, form=form, level=level))
    kinds = list(_kinds(assembled, forms, levels))
    total = len(kinds) * len(rtols) + 2
    end = flat.t_end if t_end is None else float(t_end)
    check_span(flat.t_start, end)
    patience = None if max_seconds is None else 10.0 * max_seconds
    rows: list[ComparisonRow] = []
    with told(progress, flat.name, lambda what, done, of: (done / of, what)) as called:
        watch = called or (lambda what, done, of: None)
        reference = find_reference(scene, flat, assembled, end, outputs, patience, lambda what: watch(what, 0, total))
        for form, level, solver in kinds:
            for rtol in sorted(rtols, reverse=True):
                row = ComparisonRow(form, level, SOLVERS[solver], rtol)
                watch(f"{row.label} at rtol {rtol:g}", len(rows) + 2, total)
                rows.append(_measure(assembled, row, solver, reference, max_seconds))
    return Comparison(flat.name, float(reference.time[-1]), reference, tuple(rows))


def _kinds(assembled: Assembled, forms: Sequence[str], levels: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Yield forms with their levels and solvers; without constraints the levels of the dae form are all one.

    IDA solves every form, so that form and method are told apart; the explicit method comes on top where it can, and
    the symplectic one where the scene has a Hamiltonian.
    """
    shared = implicit_solver()
    assembly = assembled("dae", "ggl")
    if "reduced" in forms:
        yield "reduced", "", shared
        if assembly.reduced.coordinates and not assembly.reduced.constraints:
            yield "reduced", "", "explicit"
            if is_canonical(assembly):
                yield "reduced", "", "gauss"
        elif assembly.reduced.constraints and _formulas_solve(assembled("reduced", "ggl")):
            yield "reduced", "", "explicit"
    if "dae" in forms:
        has_constraints = bool(assembly.maximal.constraints)
        yield from (("dae", level, shared) for level in (levels if has_constraints else levels[:1]))


def _formulas_solve(assembly: Assembly) -> bool:
    """Return whether formulas solve the closed loops of a scene where it starts."""
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_plan(assembly, start.time, q, u, start.length, 1.0)
    return solve_at(plan, start.time, q, u) is not None


def _measure(
    assembled: Assembled, row: ComparisonRow, solver: str, reference: Reference, max_seconds: float | None
) -> ComparisonRow:
    """Make one run, and return its row with numbers, or with the reason why there are none."""
    blank = (row.form, row.level, row.solver, row.rtol)
    end = float(reference.time[-1])
    try:
        result = run_form(assembled, row.form, row.level or "ggl", row.rtol, end, reference.time, max_seconds, solver)
    except AtwoodError as problem:
        return ComparisonRow(*blank, reason=problem.message)
    if result.status != "finished":
        return ComparisonRow(*blank, reason=result.message or result.status.replace("_", " "))
    error = scaled_difference(
        reference.quantities, table_at(result, reference.quantities, reference.time), reference.scales
    )
    missed = result.constraint_max
    if not np.isfinite(error):
        return ComparisonRow(*blank, reason="the motion is not finite")
    return ComparisonRow(
        *blank,
        error=error,
        wall_s=_integration_time(assembled, row, solver, end, result.statistics.seconds),
        steps=result.statistics.steps,
        energy_drift=result.energy.max_drift,
        constraint_drift=max(missed["position"], missed["velocity"]),
        constraint_held=max(missed["held_position"], missed["held_velocity"]),
        within_reference=error <= 10.0 * reference.error,
    )


def _integration_time(assembled: Assembled, row: ComparisonRow, solver: str, end: float, taken: float) -> float:
    """Return the time of the integration alone: handing out states can take longer than making them."""
    if taken > _LONG:
        return taken
    runs = (run_form(assembled, row.form, row.level or "ggl", row.rtol, end, 2, None, solver, 1) for _ in range(3))
    return min(run.statistics.seconds for run in runs)


_LONG = 0.5
"""Above so many seconds a run is not repeated to time it."""
