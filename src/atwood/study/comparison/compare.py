"""Speed against error: one scene in both forms, at several tolerances, against a reference."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np

from atwood.arguments import each, instance, takes, whole
from atwood.errors import AtwoodError
from atwood.forms.canonical import is_canonical
from atwood.forms.residuals import LEVELS
from atwood.integrators.methods import EXPLICIT, GAUSS, IDA, METHODS, TSITOURAS
from atwood.integrators.protocol import Statistics
from atwood.lazy_dataclasses import replace
from atwood.model.compose.composite import Model
from atwood.model.local.flatten import flatten
from atwood.pipeline import assemble_flat
from atwood.progress import told
from atwood.result.result import Result
from atwood.simulation.problem.arguments import FORM, FORMS, LEVEL, LIMITS, NAME, PROGRESS, RTOL, T_END, check_span
from atwood.study.comparison.found import Comparison, ComparisonRow, environment
from atwood.study.comparison.reference import Assembled, Reference, errors_by_part, find_reference, run_form
from atwood.study.comparison.work import shares_of

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
"""Relative tolerances at which solvers are compared unless others are given: from a look at a motion to a reference."""


@takes(
    scene=instance("a scene, such as Scene()", Model),
    t_end=T_END,
    rtols=each(RTOL, "tolerances between 0 and 1", 1),
    forms=each(FORM, f"some of {', '.join(map(repr, FORMS))}", 1),
    levels=each(LEVEL, f"some of {', '.join(map(repr, LEVELS))}", 1),
    outputs=whole("a whole number of output times, 2 to 1,000,000", 2, 1_000_000),
    max_seconds=LIMITS["max_seconds"],
    total_seconds=LIMITS["max_seconds"],
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
    total_seconds: float | None = None,
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
    total_seconds
        Limit of all runs together; what there is no time left for is in the rows with that reason.
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
    limits = _Limits(max_seconds, total_seconds)
    with told(progress, flat.name, lambda what, done, of: (done / of, what)) as called:
        watch = called or (lambda what, done, of: None)
        reference = find_reference(
            scene, flat, assembled, end, outputs, limits.of_a_run(patience), lambda what: watch(what, 0, total)
        )
        for form, level, solver in kinds:
            results: list[Result | None] = []
            first = len(rows)
            for rtol in sorted(rtols, reverse=True):
                row = ComparisonRow(form, level, METHODS[solver].title, rtol)
                watch(f"{row.label} at rtol {rtol:g}", len(rows) + 2, total)
                row, result = _measure(assembled, row, solver, reference, limits)
                rows.append(row)
                results.append(result)
            rows[first:] = _estimated(rows[first:], results, limits)
    return Comparison(flat.name, float(reference.time[-1]), reference, tuple(rows), environment())


class _Limits:
    """What time there is for a run.

    Parameters
    ----------
    each, together
        Limits of each run, and of all, s.
    """

    def __init__(self, each: float | None, together: float | None) -> None:
        self._each, self._end = each, None if together is None else time.monotonic() + together

    def of_a_run(self, most: float | None = None) -> float | None:
        """Return the limit of a run that begins now; zero where no time is left."""
        given = self._each if most is None else most
        left = np.inf if self._end is None else max(0.0, self._end - time.monotonic())
        return given if left == np.inf else min(given or np.inf, left)


def _estimated(rows: Sequence[ComparisonRow], results: Sequence[Result | None], limits: _Limits) -> list[ComparisonRow]:
    """Return rows with the estimates that runs give of their own errors, by the next more accurate run of their kind.

    The last, which has none, is solved once more, as `Result.accuracy` does.
    """
    found = []
    for row, one, other in zip(rows, results, (*results[1:], None), strict=True):
        estimate = None
        if one is not None and (other is not None or (row.wall_s or 0.0) < _LONG) and limits.of_a_run() != 0.0:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    estimate = Result(one.run, second=None if other is None else other.run).accuracy.reached
            except AtwoodError:
                estimate = None  # there is no second solution
        found.append(replace(row, estimate=estimate))
    return found


def _kinds(assembled: Assembled, forms: Sequence[str], levels: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Yield forms with their levels and solvers; without constraints the levels of the dae form are all one.

    IDA solves every form, so that form and method are told apart; the explicit method comes on top where it can, and
    the symplectic one where the scene has a Hamiltonian. With gaps and slips there are explicit methods alone.
    """
    assembly = assembled("dae", "ggl")
    if assembly.maximal.contacts:
        yield from ((form, "", solver.key) for form in forms for solver in (EXPLICIT, TSITOURAS))
        return
    if "reduced" in forms:
        yield "reduced", "", IDA.key
        if assembly.reduced.coordinates:
            yield "reduced", "", EXPLICIT.key
        if is_canonical(assembly):
            yield "reduced", "", GAUSS.key
    if "dae" in forms:
        has_constraints = bool(assembly.maximal.constraints)
        yield from (("dae", level, IDA.key) for level in (levels if has_constraints else levels[:1]))
        if has_constraints:  # levels say how constraints enter the residual, which explicit steps do not have
            yield "dae", "", EXPLICIT.key


def _measure(
    assembled: Assembled, row: ComparisonRow, solver: str, reference: Reference, limits: _Limits
) -> tuple[ComparisonRow, Result | None]:
    """Make one run, and return its row with numbers and the run, or with the reason why there are none."""
    end, limit = float(reference.time[-1]), limits.of_a_run()
    if limit == 0.0:
        return replace(row, reason="no time was left"), None
    try:
        for _ in range(2):
            result = run_form(assembled, row.form, row.level or "ggl", row.rtol, end, reference.time, limit, solver)
            if result.status != "time_limit" or result.statistics.steps:
                break  # else the time went into compiling, which is done by now
    except AtwoodError as problem:
        return replace(row, reason=problem.message), None
    if result.status != "finished":
        return replace(row, reason=result.message or result.status.replace("_", " ")), None
    errors = errors_by_part(reference, result)
    error = float(np.max([0.0, *errors.values()]))
    missed, done = result.constraint_max, result.statistics
    if not np.isfinite(error):
        return replace(row, reason="the motion is not finite"), None
    least, outputs_s = _costs(assembled, row, solver, reference, result)
    return replace(
        row,
        error=error,
        wall_s=least.seconds - least.monitor_seconds,
        steps=done.steps,
        residuals=done.residual_evaluations,
        jacobians=done.jacobian_evaluations,
        monitor_s=least.monitor_seconds,
        outputs_s=outputs_s,
        energy_drift=result.energy.max_drift,
        constraint_drift=max(missed["position"], missed["velocity"]),
        constraint_held=max(missed["held_position"], missed["held_velocity"]),
        within_reference=error <= 10.0 * reference.error,
        errors=errors,
        **shares_of(result, row.rtol, least.seconds - least.monitor_seconds),
    ), result


def _costs(
    assembled: Assembled, row: ComparisonRow, solver: str, reference: Reference, taken: Result
) -> tuple[Statistics, float]:
    """Return the cost of the integration alone, and the time that outputs take: it can be the longer one."""
    if taken.statistics.seconds > _LONG:
        return taken.statistics, _beside(taken)

    def again(outputs: Any, samples: int) -> Result:
        end = float(reference.time[-1])
        return run_form(assembled, row.form, row.level or "ggl", row.rtol, end, outputs, None, solver, samples)

    runs = [again(2, 1) for _ in range(3)]
    least = min((run.statistics for run in runs), key=lambda one: one.seconds - one.monitor_seconds)
    return least, max(0.0, _beside(again(reference.time, 1)) - min(map(_beside, runs)))


def _beside(run: Result) -> float:
    """Return what a run took beside its integration, s."""
    return max(0.0, run.timings.get("integration", 0.0) - run.statistics.seconds)


_LONG = 0.5
"""Above so many seconds a run is not repeated to time it."""
