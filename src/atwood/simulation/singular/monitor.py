"""Looks out for singular positions while a scene runs, and finds the way over them.

A solver that takes steps would come to grief there at small tolerances, and at large ones it could leap into another
way to move without a complaint. So the motion is looked at now and then; where it has come near a singular position it
is worked out anew as polynomials over the place (`atwood.simulation.singular.collocation`), and if the solver went
another way the run goes on from their end.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.sundials.rank_looks import AHEAD, FALLEN, LOW
from atwood.forms.caches import Key
from atwood.integrators.protocol import Status, StepMonitor, StepResult
from atwood.simulation.problem.explicit_scene import compiled_on_constraints
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.singular.branches import (
    ACCURATE,
    Branches,
    Sample,
    as_step_monitor,
    compiled_monitor,
    going_on,
    stride_from,
)
from atwood.simulation.singular.crossing import SingularCrossing, begun_at, has_few, nearly_lost, zero_ahead
from atwood.simulation.singular.passing import Passages, PassedCrossing
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.sundials.step_monitor import MonitorData
    from atwood.integrators.protocol import CompiledRates

_BEGUN: Key[tuple[MonitorData, bool] | None] = Key("first looks for singular positions")

_LOOKED_AHEAD: Key[tuple[SingularCrossing | None, list[float]]] = Key("first look ahead")

_REVIEW = 8
"""So many looks are judged together where they are not compiled."""

_ON_A_PLACE = 5e-7
"""A start whose least share is below this is on a singular position, as far as rounding tells: some 30 roots of it."""

_AT_START = 0.7
"""Where less than this share is left at a start of what constraints are around it, it is looked ahead from there."""

_MOST_JUDGED = 60
"""Looks at more constraints are judged in Python, which knows where their slopes have no entries."""

_AROUND = (-2.0, -1.0, 1.0, 2.0)
"""So many strides from where it begins constraints are looked at to see how independent they are elsewhere."""


def singularity_monitor_of(
    plan: SceneProblem, tolerance: float, end: float, step_result: StepResult
) -> SingularityMonitor | None:
    """Return what looks out for singular positions; None where there can be none: without loops.

    Without projection (plain index 1) drift is to be seen, and nothing is looked out for.
    """
    if not plan.is_projected or not plan.assembly.reduced.constraints:
        return None
    return SingularityMonitor(plan, tolerance, end, step_result)


class SingularityMonitor(Branches):
    """Looks out for singular positions while a scene runs.

    When it looks depends on the motion alone, so that outputs change nothing. Where a session can do so it looks by
    itself, compiled, and comes back only where something is low.

    Parameters
    ----------
    plan
        The scene in its mode.
    tolerance
        The relative tolerance of the run.
    end
        When the stretch ends at the latest, s.
    step_result
        The state at its start.

    Attributes
    ----------
    seconds
        Time spent.
    agreed
        Crossings that the solver made by itself, and well; whoever takes them into a record empties the list.
    step_monitor
        What a session may look with; None where nothing can be compiled.
    next
        When somebody should look next, s; infinite where a session does.
    """

    _passages: Passages | None = None
    _best: tuple[float, FloatArray] | None = None
    _seen_ahead: tuple[FloatArray, FloatArray] | None = None

    def __init__(self, plan: SceneProblem, tolerance: float, end: float, step_result: StepResult) -> None:
        super().__init__(plan, tolerance, end - step_result.t)
        self.seconds = 0.0
        self.agreed: list[SingularCrossing] = []
        self._away: list[float] = []
        self._judged = -np.inf
        self._compiled: MonitorData | None = None
        self._start, self._is_behind = step_result, False
        self._starts_low = False
        about = step_result.t, step_result.y.tobytes(), step_result.yp.tobytes(), self._whole, plan.finding.kept
        self._about: tuple[object, ...] | None = about
        begun = plan.assembly.kept.get(_BEGUN, self._first_looks, *about)
        if begun is None:
            self._begin_looks()
        elif self._compiled is None:  # a run from the same state has looked around before
            self._start_anew()
            first, self._starts_low = begun
            self._compiled = first.copied()
            self._measure_with(self._compiled)
            self.next = np.inf

    def _first_looks(self) -> tuple[MonitorData, bool] | None:
        """Look at the start, and around it; return what came of it, and whether something is low there.

        None where nothing can be compiled.
        """
        plan, start = self.plan, self._start
        self._compiled = compiled_monitor(plan, self._whole, len(start.y))
        if self._compiled is None:
            return None
        errors = plan.balance.errors.near(start.t, start.y[: self._n], plan.sizes)
        self._compiled.rows[:] = tolerances.TRUSTED * errors
        self._measure_with(self._compiled)
        self._begin_looks()
        return self._compiled.copied(), self._starts_low

    def _measure_with(self, compiled: MonitorData) -> None:
        """Take rows, and where there are few of them the measure, from machine code."""
        self._measures.rows = compiled.rows
        self._measures.compiled = compiled if has_few(self.plan) else None

    @property
    def step_monitor(self) -> StepMonitor | None:
        """See the attributes."""
        found = None if self._compiled is None else as_step_monitor(self._compiled)
        return found if found is None or self._passages is None else self._passages.watched(found)

    def pass_in_steps(self, end: float, rates: CompiledRates | None) -> None:
        """Let explicit steps up to a time pass singular positions by themselves, if they can, with their own rates."""
        compiled, plan = self._compiled, self.plan
        is_plain = plan.has_rates and has_few(plan) and len(plan.balance.holonomic) == plan.balance.constraints
        if compiled is not None and compiled.judges and is_plain:
            start = self._start.t, self._start.y
            rates = rates or compiled_on_constraints(plan, *start)
            assert rates is not None
            self._passages = Passages(plan, compiled, rates, self.tolerance, max(self.tolerance, ACCURATE), end)

    def take_passed(self) -> list[PassedCrossing]:
        """Return what steps have passed by themselves since this was last asked."""
        passed = [] if self._passages is None else self._passages.take()
        if passed:
            self._start_anew()
            self._since, self._is_behind, self._about = passed[-1].arcs[-1].end, True, None
        return passed

    def look_in_python(self) -> None:
        """Sample step by step, since the session cannot."""
        if self._compiled is not None:
            self._compiled = self._measures.compiled = None
            self._begin_looks()

    def restart(self, step_result: StepResult, is_behind: bool = False) -> None:
        """Begin again from a state, perhaps behind a singular position."""
        self._start, self._is_behind, self._about = step_result, is_behind, None
        self._begin_looks()

    def _start_anew(self) -> None:
        self._samples, self._away = [], []
        self._judged, self._since = -np.inf, self._start.t
        self.trouble = None

    def _begin_looks(self) -> None:
        self._start_anew()
        if self._compiled is None:
            self.note(self._start)
            return
        self.next = np.inf
        if not self._is_behind:
            self._look_around()
        self._compiled.restart()
        self._compiled.note(self._start.t, self._start.y, self._start.yp)
        self._compiled.settle()
        self._starts_low = self._compiled.least_share < _AT_START and not self._is_behind
        finding, is_plain = self.plan.finding, self.plan.balance.kinematic_map.is_plain
        if is_plain and not finding.redundant and len(finding.kept) <= _MOST_JUDGED:
            self._compiled.judge_from(self._start.t)

    def _look_around(self) -> None:
        """See how independent constraints are around the start, which may be near a singular position itself."""
        assert self._compiled is not None
        here = Sample(self._start.t, self._start.y, self._start.yp)
        stride = stride_from(self.plan, here, np.inf)
        if not np.isfinite(stride):
            return
        times = here.t + stride * np.array(_AROUND)
        self._compiled.restart()
        for t, y in zip(self._in_run(times).tolist(), going_on(self.plan, here, times).T, strict=True):
            self._compiled.note(t, np.concatenate([y, self._start.y[len(y) :]]), self._start.yp)
        t, q = self._compiled.best
        self._measures.learn(np.array([t]), q[:, None])

    def note(self, step_result: StepResult) -> None:
        """Take up a state, and decide when to look again."""
        if self._samples and step_result.t <= self._samples[-1].t:
            return
        one = Sample(step_result.t, step_result.y, step_result.yp)
        self._samples.append(one)
        self.next = step_result.t + stride_from(self.plan, one, self._whole)

    def look(self, step_result: StepResult, between: bool, at_end: bool) -> SingularCrossing | None:
        """Take up what a solver gave, and return the first singular position over which it must be helped."""
        ended = step_result.status not in (Status.REACHED, Status.NOTICED)
        if step_result.status is Status.INTERRUPTED or not (between or at_end or ended):
            return None
        if not self._take(step_result, at_end, ended):
            return None
        began = time.perf_counter()
        try:
            self._measure(looks_ahead=not (at_end or ended))
            failed = step_result.status is Status.FAILED
            found = self._first_minimum(at_end or ended, failed)
            if found is None and not (at_end or ended):
                found = self._coming(step_result.t)
            if found is None and failed:
                found = self._ahead() or self._from_start(step_result.t)
            self._forget()
            if self._compiled is not None:
                self._compiled.take_judged(self._judged)
            return found
        finally:
            self.seconds += time.perf_counter() - began

    def _take(self, step_result: StepResult, at_end: bool, ended: bool) -> bool:
        """Take up what has been noted; return whether it is to be looked at."""
        compiled = self._compiled
        if compiled is None:
            self.note(step_result)
            return at_end or ended or len(self._samples) - len(self._away) >= _REVIEW
        if at_end or ended:
            compiled.note(step_result.t, step_result.y, step_result.yp)
        compiled.settle()
        if not ended and not (compiled.has_seen_low and (not at_end or compiled.finds_at_end())):
            return False
        self._largest = max(self._largest, compiled.largest)
        self._samples, self._away = [Sample(*one) for one in compiled.take()], []
        self._best = compiled.best
        return True

    def ahead_of_start(self) -> SingularCrossing | None:
        """Return the singular position just ahead of where it began to look; None where none is known to be near."""
        if not self._starts_low:
            return None
        self._starts_low = False
        self._check_start()
        self._samples, self._away = [Sample(self._start.t, self._start.y, self._start.yp)], []
        if self._about is None:
            self._measure()
            return self._coming(self._start.t)
        about = *self._about, self.tolerance
        found, self._away = self.plan.assembly.kept.get(_LOOKED_AHEAD, self._first_ahead, *about)
        self._largest = max(self._largest, self._away[0]) if np.isfinite(self._away[0]) else self._largest
        return found

    def _check_start(self) -> None:
        """Raise an error where a run goes on from a state that rounding does not tell from a singular position.

        Rounding e of maximal coordinates moves what is nearly free by e/s, and its speed by e/s^2 of itself, at a
        measure s. Reduced coordinates of a loop are one another's functions there, and keep their digits.
        """
        compiled, start = self._compiled, self._start
        if self.plan.assembly.form == "dae" and compiled is not None and compiled.least_share < _ON_A_PLACE:
            lost = nearly_lost(self._measures, start.t, start.y[: self._n])
            raise begun_at(self.plan.assembly.own_equations.constraints[lost], start.t)

    def _first_ahead(self) -> tuple[SingularCrossing | None, list[float]]:
        """Return what is just ahead of the start of a run, and the measure there."""
        self._measure()
        return self._coming(self._start.t), self._away[:]

    def _in_run(self, times: FloatArray) -> FloatArray:
        """Return times, none of them outside the run: what begins slowly has long strides, and drives other places."""
        return np.clip(times, self._since, self._since + self._whole)

    def _coming(self, now: float) -> SingularCrossing | None:
        """Return the singular position just ahead of a solver, which need not come near it; None if there is none.

        Solvers take ever shorter steps close to one, and a small error there can lead to another way to move.
        """
        last = self._samples[-1]
        stride = stride_from(self.plan, last, np.inf)
        if not (self._away[-1] > 0.0 and stride < np.inf):
            return None
        times, away = self._seen_ahead or (self._times_ahead(last, stride), None)
        if away is None:
            away = self._measures.at(self._in_run(times), going_on(self.plan, last, times)[: self._n])
        near = zero_ahead(times, away)
        if near is None or not near > now:
            return None
        self.plan.compiles_columns = True
        begin = self._begin(near, 1.0)
        return None if begin is None else self._over(near, *begin)

    def _ahead(self) -> SingularCrossing | None:
        """Return the singular position towards which the motion was going when a solver failed; None if to none."""
        times, away = [one.t for one in self._samples], self._away
        for last in (len(away) - 1, len(away) - 2):
            if last < 1 or not 0.0 <= away[last] < away[last - 1]:
                continue
            step = times[last] - times[last - 1]
            t = times[last] + step * away[last] / (away[last - 1] - away[last])
            found = self._pass(t, failed=True) if t < times[last] + 3.0 * step else None
            if found is not None:
                return found
        return None

    @staticmethod
    def _times_ahead(last: Sample, stride: float) -> FloatArray:
        return last.t + stride * np.linspace(*AHEAD)

    def _measure(self, looks_ahead: bool = False) -> None:
        """Measure what was noted, the best look that is not noted any more, and what may be ahead, all at once."""
        new, best, n = self._samples[len(self._away) :], self._best, self._n
        self._best, self._seen_ahead = None, None
        if not new:
            return
        parts = [(np.array([one.t for one in new]), np.stack([one.y[:n] for one in new], axis=1))]
        if best is not None:
            parts.append((np.array([best[0]]), best[1][:, None]))
        known, last = sum(len(one[0]) for one in parts), self._samples[-1]
        stride = stride_from(self.plan, last, np.inf) if looks_ahead else np.inf
        times = self._times_ahead(last, stride) if stride < np.inf else np.zeros(0)
        if len(times):
            parts.append((self._in_run(times), going_on(self.plan, last, times)[:n]))
        t, q = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
        away = self._measures.learn(t, q, known)
        self._away += away[: len(new)].tolist()
        self._largest = max([self._largest, *(one for one in away[:known].tolist() if np.isfinite(one))])
        if len(times):
            self._seen_ahead = times, away[known:]

    def _forget(self) -> None:
        """Drop looks that are not needed any more."""
        cut = len(self._samples) - 6
        if cut > 0:
            del self._samples[:cut], self._away[:cut]

    def _first_minimum(self, at_end: bool, failed: bool) -> SingularCrossing | None:
        away = self._away
        for i in range(len(away) if at_end else len(away) - 1):
            t = self._samples[i].t
            if t <= self._judged:
                continue
            self._judged = t
            before = away[i - 1] if i else np.inf
            behind = away[i + 1] if i + 1 < len(away) else np.inf
            is_least = away[i] <= min(before, behind, LOW * self._largest)
            if not is_least and not away[i] <= FALLEN * self._largest < before < np.inf:
                continue
            rest = self._rest(max(i - 1, 0), min(i + 1, len(away) - 1)) if is_least else None
            if rest is not None:
                self.agreed.append(rest)
                continue
            for found in self._crossings_at(i, is_least, failed):
                if not self._went_along(found):
                    return found
                self.agreed.append(found)
        return None

    def _crossings_at(self, i: int, is_least: bool, failed: bool) -> Iterator[SingularCrossing]:
        """Yield the crossings that a look sees, of places close to each other several, or the one that was ahead."""
        passed = -np.inf
        for near, least in self._closest(max(i - 1, 0), min(i + 1, len(self._away) - 1)) if is_least else []:
            found = self._pass(near, least, failed) if near > passed else None
            if found is not None:
                passed = near if found.path is None else found.path.end
                yield found
        heading = self._heading(i) if passed == -np.inf else None
        found = None if heading is None else self._pass(*heading, failed)
        if found is not None:
            yield found

    def _heading(self, i: int) -> tuple[float, float] | None:
        """Return when the motion before a look would have come to a singular position about then; None if not.

        Where the solver has leapt into another way to move, what comes behind says nothing about the place.
        """
        away, times = self._away, [one.t for one in self._samples]
        for last in (i, i - 1):
            if last >= 1 and away[last] < away[last - 1]:
                step = times[last] - times[last - 1]
                t = times[last] + step * away[last] / (away[last - 1] - away[last])
                if t <= times[min(i + 1, len(times) - 1)]:
                    return t, away[i]
        return None
