"""Long runs: how energy and other conserved quantities drift over many periods, by method."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arguments import instance, number, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.display import fitted, plain
from atwood.errors import AtwoodError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.canonical import is_canonical
from atwood.integrators.methods import EXPLICIT, GAUSS, IDA, TAYLOR
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.pipeline import assemble, simulate
from atwood.progress import told
from atwood.result.result import Result
from atwood.simulation.problem.arguments import LIMITS, NAME, PROGRESS
from atwood.simulation.problem.options import how_solved
from atwood.study.comparison.found import environment
from atwood.table import Shown, Table, table
from atwood.theory.symmetry.conserved import conserved

_WINDOW = 50
"""Samples in the period before each mark."""

_CONSERVED = 1e-9
"""Of the energy that is exchanged: with more work than this the energy is not conserved."""

_METHODS = (
    ("reduced", GAUSS.key, 1e-8),
    ("reduced", TAYLOR.key, 1e-8),
    ("reduced", TAYLOR.key, 1e-15),
    ("reduced", EXPLICIT.key, 1e-8),
    ("reduced", IDA.key, 1e-8),
    ("dae", IDA.key, 1e-8),
)


@dataclass(frozen=True)
class LongRow:
    """A long run with one method.

    Attributes
    ----------
    form, solver, rtol
        How it was made.
    marks
        After how many periods errors were taken.
    reached
        To how many periods it came in the time that there was.
    steps, wall_s
        Steps, and the time of the integration, s.
    energy
        At each mark the largest error of the energy in the period before it, relative to the energy exchanged; None
        where it did not come to it.
    invariants
        The same of all other conserved quantities together, relative to their sizes; empty where there are none.
    reason
        Why there are no numbers; empty if there are.
    """

    form: str
    solver: str
    rtol: float
    marks: tuple[int, ...] = ()
    reached: float = 0.0
    steps: int = 0
    wall_s: float = 0.0
    energy: tuple[float | None, ...] = ()
    invariants: tuple[float | None, ...] = ()
    reason: str = ""

    @property
    def label(self) -> str:
        """Form, method and tolerance."""
        return f"{how_solved(self.form, 'ggl' * (self.form == 'dae'), [self.solver])}, rtol {self.rtol:.0e}"

    def costs(self) -> tuple[str, str]:
        """Return microseconds for a period, and steps, as texts."""
        return f"{1e6 * self.wall_s / max(self.reached, 1e-9):.3g}", f"{self.steps:,}"

    @property
    def grows(self) -> bool:
        """Whether its error of the energy grows: at the end by more than the root of the time since the mark before.

        Errors of bounded size do not, whenever they reach it, and those of rounding grow with that root.
        """
        known = [(mark, max(one, 1e-15)) for mark, one in zip(self.marks, self.energy, strict=True) if one is not None]
        if len(known) < 2:
            return False
        (before, _), (end, last) = known[-2:]
        return last > math.sqrt(end / before) * max(one for _, one in known[:-1])


@dataclass(frozen=True)
class LongComparison(Shown):
    """How conserved quantities drift over many periods.

    Attributes
    ----------
    scene
        Name of the scene.
    period
        What counts as a period, s.
    marks
        After how many periods errors were taken.
    conserved
        Names of the conserved quantities besides the energy.
    rows
        One for each method.
    environment
        On what it was measured.
    """

    scene: str
    period: float
    marks: tuple[int, ...]
    conserved: tuple[str, ...]
    rows: tuple[LongRow, ...]
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """What it says, in a few sentences."""
        known = [row for row in self.rows if not row.reason and row.energy and row.energy[0] is not None]
        if not known:
            return "No method gave an answer."
        whole_way = [row for row in known if row.energy[-1] is not None]
        steady = [row.label for row in known if not row.grows]
        said = [f"The error of the energy does not grow with {'; '.join(steady)}." if steady else "All errors grow."]
        if whole_way:
            best = min(whole_way, key=lambda row: row.energy[-1] or 0.0)
            fast = min(whole_way, key=lambda row: row.wall_s)
            said.append(f"After {self.marks[-1]:,} periods {best.label} errs least, by {best.energy[-1]:.1e}")
            said[-1] += "." if best is fast else f"; {fast.label} is fastest, {best.wall_s / fast.wall_s:.2g} times."
        late = [f"{row.label} ({row.reached:,.0f})" for row in known if row.energy[-1] is None]
        if late:
            said.append(f"Out of time before the end: {'; '.join(late)}.")
        return " ".join(said)

    def tables(self) -> tuple[Table, ...]:
        """Return the errors of the energy, and those of the other conserved quantities, a row for each method."""
        marks, costs = [f"{mark:,}>" for mark in self.marks], ("us/period>", "steps>")
        title = (
            f"{self.scene}: error of the energy, relative to what is exchanged, after so many periods of "
            f"{self.period:.4g} s"
        )
        failed = [f"{row.label}  {row.reason}" for row in self.rows if row.reason]
        rows = [(row.label, *row.costs(), *_written(row.energy)) for row in self.rows if not row.reason]
        found = [table(("method", *costs, *marks), rows, title, failed)]
        if self.conserved:
            title = f"the same of {', '.join(self.conserved)}, relative to their sizes"
            rows = [(row.label, *_written(row.invariants)) for row in self.rows if row.invariants]
            found.append(table(("method", *marks), rows, title))
        found[-1] = replace(found[-1], notes=(*found[-1].notes, "", self.verdict))
        return tuple(found)

    __str__ = Shown.as_text

    def __repr__(self) -> str:
        return fitted(f"<LongComparison of {self.scene}, {self.marks[-1]:,} periods: {self.verdict}>")

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {**plain(vars(self)), "verdict": self.verdict}


def _written(values: Sequence[float | None]) -> list[str]:
    return ["-" if one is None else f"{one:.1e}" for one in values]


@takes(
    scene=instance("a scene, such as Scene()", Model),
    periods=whole("a whole number of periods, 10 to 1,000,000", 10, 1_000_000),
    period=optional(number("a number of seconds above 0", above=0.0)),
    max_seconds=LIMITS["max_seconds"],
    name=NAME,
    progress=PROGRESS,
)
def compare_long(
    scene: Model,
    *,
    periods: int = 10_000,
    period: float | None = None,
    max_seconds: float | None = 20.0,
    name: str | None = None,
    progress: Callable[[str, int, int], object] | None = None,
) -> LongComparison:
    """Run a scene for many periods with several methods, and take the errors of what is conserved along the way.

    The symplectic method of Gauss, whose error of the energy does not grow (Hairer, Lubich and Wanner, Geometric
    Numerical Integration, section IX.8), beside Taylor series, the explicit method and IDA in both forms.

    Parameters
    ----------
    scene
        The scene; nothing may put in or take energy.
    periods
        How many.
    period
        What counts as one, s; from the motion of the coordinates about their means if not given.
    max_seconds
        Limit of each run; what came before it is in the rows.
    name
        What to call the scene.
    progress
        Called with what is being done, how many runs are done, and of how many.

    Returns
    -------
    LongComparison
        A row for each method; one that cannot solve the scene says why.

    Raises
    ------
    UsageError
        If the energy of the scene is not conserved.
    """
    assembly = assemble(scene, name=name)
    length = _period(assembly) if period is None else float(period)
    exchanged = _exchanged(assembly, length)
    marks = tuple(sorted({*(10**k for k in range(int(math.log10(periods)) + 1)), periods}))
    begin = assembly.flat.t_start
    windows = [np.linspace(max(0.0, mark - 1.0), mark, _WINDOW) for mark in marks]
    times = begin + length * np.unique(np.concatenate([[0.0], *windows]))
    monitor, rows = conserved(assembly), list[LongRow]()
    methods = [one for one in _METHODS if one[1] != GAUSS.key or is_canonical(assembly)]
    with told(progress, assembly.flat.name, lambda what, done, of: (done / of, what)) as called:
        for number_done, (form, solver, rtol) in enumerate(methods):
            row = LongRow(form, solver, rtol)
            if called is not None:
                called(row.label, number_done, len(methods))
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    result = simulate(
                        assembly if form == "reduced" else assemble(scene, form=form, name=name),
                        t_end=float(times[-1]),
                        rtol=rtol,
                        solver=solver,
                        outputs=times,
                        samples=1,
                        max_seconds=max_seconds,
                        monitor=monitor,
                    )
                rows.append(_row(row, result, begin, (length, exchanged), marks))
            except AtwoodError as error:
                rows.append(replace(row, reason=error.message))
    others = tuple(one.name for one in monitor if one.unit != "J")
    return LongComparison(assembly.flat.name, length, marks, others, tuple(rows), environment())


def _row(row: LongRow, result: Result, begin: float, sizes: tuple[float, float], marks: Sequence[int]) -> LongRow:
    """Return what a run says; sizes are a period and the energy that is exchanged."""
    passed, total = (result.time - begin) / sizes[0], result.energy.total
    drifts = {"": np.abs(total - total[0]) / sizes[1]}
    for one in result.conserved.values() if result.conserved is not None else ():
        if one.unit != "J":
            drifts[one.name] = np.abs(one.values - one.values[0]) / (one.size or 1.0)

    def at(values: FloatArray, mark: int) -> float | None:
        if passed[-1] < mark * (1.0 - 1e-9):
            return None
        return float(np.max(values[(passed >= mark - 1.0 - 1e-9) & (passed <= mark * (1.0 + 1e-9))]))

    energy = tuple(at(drifts[""], mark) for mark in marks)
    rest = [values for name, values in drifts.items() if name]
    worst = np.max(rest, axis=0) if rest else None
    return replace(
        row,
        marks=tuple(marks),
        reached=float(result.run.segments[-1].time[-1] - begin) / sizes[0],
        steps=result.statistics.steps,
        wall_s=result.statistics.seconds,
        energy=energy,
        invariants=() if worst is None else tuple(at(worst, mark) for mark in marks),
    )


def _period(assembly: Assembly) -> float:
    """Return twice the mean time between two passages of a coordinate through its mean; of the fastest, s."""
    run = simulate(assembly, outputs=4001)
    found = [float(run.time[-1] - run.time[0])]
    for one in assembly.reduced.names:
        if one.name in run:
            values = run[one.name] - np.mean(run[one.name])
            at = np.flatnonzero(np.diff(np.sign(values)) != 0.0)
            if len(at) > 2:
                found.append(2.0 * float(run.time[at[-1]] - run.time[at[0]]) / (len(at) - 1))
    return min(found)


def _exchanged(assembly: Assembly, length: float) -> float:
    """Return the energy that is exchanged in a period, J; refuse a scene whose energy is not conserved."""
    start = assembly.flat.t_start
    run = simulate(assembly, t_end=start + min(assembly.flat.t_end - start, 10.0 * length))
    ledger = run.energy
    if float(np.ptp(ledger.work)) > _CONSERVED * ledger.exchanged:
        raise UsageError(
            "its energy is not conserved, so that a drift says nothing of the method",
            where=assembly.flat.name,
            advice=f"Take out what drives or damps it: {ledger.parts.describe().splitlines()[0]}.",
        )
    return ledger.exchanged or 1.0
