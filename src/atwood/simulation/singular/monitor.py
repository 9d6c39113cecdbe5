"""Looks out for singular positions while a scene runs, and finds the way over them.

A solver that takes steps would come to grief there at small tolerances, and at large ones it could leap into another
way to move without a complaint. So the motion is looked at now and then; where it has come near a singular position it
is worked out anew as polynomials over the place (`atwood.simulation.singular.collocation`), and if the solver went
another way the run goes on from their end.
"""

from __future__ import annotations

import time

import numpy as np

from atwood.errors import AtwoodError, SolveError
from atwood.integrators.compiled_functions import Lookout
from atwood.integrators.protocol import FloatArray, Status, StepResult
from atwood.simulation.problem.problem import Plan
from atwood.simulation.problem.projection import project_safely, project_states
from atwood.simulation.singular.collocation import Arc, Path, find_arc, follow
from atwood.simulation.singular.crossing import SingularCrossing, stuck_at
from atwood.simulation.singular.looks import Look, as_lookout, compiled_looks, cubic, going_on, stride_from
from atwood.simulation.singular.rank_measure import RankMeasure, find_crossing, find_loss, nearly_lost, zero_ahead
from atwood.simulation.singular.rest import is_slow, rests_at, slowest
from atwood.tolerances import tolerances

__all__ = ["SingularityMonitor", "singularity_monitor_of"]

_REVIEW = 8
"""So many looks are judged together where they are not compiled."""

_LOW = 0.3
"""Only where the measure is so small, relative to the largest so far, is it looked at more closely."""

_CLOSE = 0.05
"""The same on the finer look."""

_QUITE_CLOSE = 0.02
"""The same where a motion is followed past a position that it does not pass through."""

_NEAR = 0.6
"""The same where a solver cannot start behind a position at a tight tolerance: rounding is larger there."""

_FALLEN = 1e-2
"""The same where the motion may be at a singular position already, and stay there."""

_REACH = 0.2
"""An arc begins so far before the place, in what moves most, if it can."""

_CENTRED = 0.06
"""So far from its middle an arc may pass the place, relative to half its length; its points keep twice that away."""

_ACCURATE = 1e-7
"""Arcs over a place are taken whose estimates are smaller, or within the tolerance; errors are far below these."""

_FINE = 17

_AHEAD = -0.8, 1.6, 13
"""A position is looked for from so far behind to so far ahead of the last look, in strides between looks, at so many
points: what is just ahead lies between two of them."""

_AT_START = 0.7
"""Where less than this share is left at a start of what constraints are around it, it is looked ahead from there."""

_BEYOND = 2.5
"""The motion is guessed so far behind the last look, in strides."""

_AROUND = (-2.0, -1.0, 1.0, 2.0)
"""So many strides from where it begins constraints are looked at to see how independent they are elsewhere."""

_AGREES = 30.0
"""Times the tolerance: a solver whose states behind the place differ by less from the arc has gone the same way."""


def singularity_monitor_of(
    plan: Plan, tolerance: float, end: float, step_result: StepResult
) -> SingularityMonitor | None:
    """Return what looks out for singular positions; None where there can be none: without loops.

    Without projection (plain index 1) drift is to be seen, and nothing is looked out for.

    Parameters
    ----------
    plan, tolerance, end, step_result
        See `SingularityMonitor`.
    """
    if not plan.is_projected or not plan.assembly.reduced.constraints:
        return None
    return SingularityMonitor(plan, tolerance, end, step_result)


class SingularityMonitor:
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
    lookout
        What a session may look with; None where nothing can be compiled.
    next
        When somebody should look next, s; infinite where a session does.
    trouble
        Where the solver failed at a singular position that it could not be helped over: its time, and the number of
        the constraint that nearly follows from the others there; None elsewhere.
    """

    trouble: tuple[float, int] | None

    def __init__(self, plan: Plan, tolerance: float, end: float, step_result: StepResult) -> None:
        self.plan, self.tolerance = plan, tolerance
        self._whole = end - step_result.t
        self.seconds = 0.0
        self.agreed: list[SingularCrossing] = []
        self._n, self._m = plan.program.coordinates, len(plan.sizes)
        self._looks: list[Look] = []
        self._away: list[float] = []
        self._judged = -np.inf
        self._largest = 0.0
        self._measures = RankMeasure(plan)
        self._compiled = compiled_looks(plan, self._whole, len(step_result.y))
        if self._compiled is not None:
            errors = plan.balance.errors.near(step_result.t, step_result.y[: self._n], plan.sizes)
            self._compiled.rows[:] = tolerances.TRUSTED * errors
            self._measures.rows = self._compiled.rows
        self._start, self._is_behind = step_result, False
        self._starts_low = False
        self._begin_looks()

    @property
    def lookout(self) -> Lookout | None:
        """See the attributes."""
        return None if self._compiled is None else as_lookout(self._compiled)

    def look_in_python(self) -> None:
        """Look step by step, since the session cannot."""
        if self._compiled is not None:
            self._compiled = None
            self._begin_looks()

    def restart(self, step_result: StepResult, is_behind: bool = False) -> None:
        """Begin again from a state, perhaps behind a singular position."""
        self._start, self._is_behind = step_result, is_behind
        self._begin_looks()

    def _begin_looks(self) -> None:
        self._looks, self._away = [], []
        self._judged = -np.inf
        self.trouble = None
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

    def _look_around(self) -> None:
        """See how independent constraints are around the start, which may be near a singular position itself."""
        assert self._compiled is not None
        here = Look(self._start.t, self._start.y, self._start.yp)
        stride = stride_from(self.plan, here, np.inf)
        if not np.isfinite(stride):
            return
        times = here.t + stride * np.array(_AROUND)
        self._compiled.restart()
        for t, y in zip(times.tolist(), going_on(self.plan, here, times).T, strict=True):
            self._compiled.note(t, np.concatenate([y, self._start.y[len(y) :]]), self._start.yp)
        t, q = self._compiled.best
        self._measures.learn(np.array([t]), q[:, None])

    def note(self, step_result: StepResult) -> None:
        """Take up a state, and decide when to look again."""
        if self._looks and step_result.t <= self._looks[-1].t:
            return
        one = Look(step_result.t, step_result.y, step_result.yp)
        self._looks.append(one)
        self.next = step_result.t + stride_from(self.plan, one, self._whole)

    def look(self, step_result: StepResult, between: bool, at_end: bool) -> SingularCrossing | None:
        """Take up what a solver gave, and return the first singular position over which it must be helped.

        Parameters
        ----------
        step_result
            Where the solver is, or where and why it ended.
        between
            Whether this is where the monitor wanted to look, or a session noticed something, and not an output.
        at_end
            Whether the run is to end here.
        """
        ended = step_result.status not in (Status.REACHED, Status.NOTICED)
        if step_result.status is Status.INTERRUPTED or not (between or at_end or ended):
            return None
        if not self._take(step_result, at_end, ended):
            return None
        began = time.perf_counter()
        try:
            self._measure()
            failed = step_result.status is Status.FAILED
            found = self._first_minimum(at_end or ended, failed)
            if found is None and not (at_end or ended):
                found = self._coming(step_result.t)
            if found is None and failed:
                found = self._ahead() or self._from_start(step_result.t)
            self._forget()
            return found
        finally:
            self.seconds += time.perf_counter() - began

    def _take(self, step_result: StepResult, at_end: bool, ended: bool) -> bool:
        """Take up what has been noted; return whether it is to be looked at."""
        compiled = self._compiled
        if compiled is None:
            self.note(step_result)
            return at_end or ended or len(self._looks) - len(self._away) >= _REVIEW
        if at_end or ended:
            compiled.note(step_result.t, step_result.y, step_result.yp)
        compiled.settle()
        if not compiled.has_seen_low and not ended:
            return False
        self._looks, self._away = [Look(*one) for one in compiled.take()], []
        t, q = compiled.best
        self._largest = max(self._largest, float(self._measures.learn(np.array([t]), q[:, None])[0]))
        return True

    def ahead_of_start(self) -> SingularCrossing | None:
        """Return the singular position just ahead of where it began to look; None where none is known to be near."""
        if not self._starts_low:
            return None
        self._starts_low = False
        self._looks = [Look(self._start.t, self._start.y, self._start.yp)]
        self._away = []
        self._measure()
        return self._coming(self._start.t)

    def _coming(self, now: float) -> SingularCrossing | None:
        """Return the singular position just ahead of a solver, which need not come near it; None if there is none.

        Solvers take ever shorter steps close to one, and a small error there can lead to another way to move.
        """
        last = self._looks[-1]
        stride = stride_from(self.plan, last, np.inf)
        if not (self._away[-1] > 0.0 and stride < np.inf):
            return None
        times = last.t + stride * np.linspace(*_AHEAD)
        near = zero_ahead(times, self._measures.at(times, going_on(self.plan, last, times)[: self._n]))
        if near is None or not near > now:
            return None
        self.plan.compiles_columns = True
        begin = self._begin(near, 1.0)
        return None if begin is None else self._over(near, *begin)

    def _ahead(self) -> SingularCrossing | None:
        """Return the singular position towards which the motion was going when a solver failed; None if to none."""
        times, away = [one.t for one in self._looks], self._away
        for last in (len(away) - 1, len(away) - 2):
            if last < 1 or not 0.0 <= away[last] < away[last - 1]:
                continue
            step = times[last] - times[last - 1]
            t = times[last] + step * away[last] / (away[last - 1] - away[last])
            found = self._pass(t, failed=True) if t < times[last] + 3.0 * step else None
            if found is not None:
                return found
        return None

    def _from_start(self, near: float) -> SingularCrossing | None:
        """Return the way on from a start that is near a singular position, or has one just ahead, at a time.

        Behind a crossing rounding can be too large for a solver at first; there the motion goes away from the place.
        """
        first = self._looks[0]
        stride = stride_from(self.plan, first, np.inf)  # also beyond the end of a short run, where it is not looked at
        stride = stride if np.isfinite(stride) else self._whole
        begin = self._state(first)
        if begin is None or not near < first.t + 0.1 * stride:
            return None
        longest: Path | None = None
        for share in (1.0, 0.3, 0.1):
            arc = find_arc(self.plan, *begin, first.t + share * stride)
            if arc is None or not arc.error < max(self.tolerance, _ACCURATE):
                continue
            times = np.linspace(arc.start, arc.end, _FINE)
            away = self._measures.learn(times, arc.at(times)[0])
            found = find_crossing(self._measures, arc)
            if found is not None:
                return self._crossing(arc, *found)
            largest = max(
                self._largest, float(np.max(away))
            )  # of a run that is too short to have been far from it, too
            leaves = away[0] < (_NEAR * largest if self._is_behind else _QUITE_CLOSE * away[-1])
            if longest is None and leaves and np.all(np.diff(away[1:]) > 0.0):
                longest = Path((arc,))
        return None if longest is None else SingularCrossing(longest.start, 0, (), (), longest)

    def _measure(self) -> None:
        if new := self._looks[len(self._away) :]:
            t = np.array([one.t for one in new])
            q = np.stack([one.y[: self._n] for one in new], axis=1)
            self._away += self._measures.learn(t, q).tolist()
            self._largest = max([self._largest, *(one for one in self._away[-len(new) :] if np.isfinite(one))])

    def _forget(self) -> None:
        """Drop looks that are not needed any more."""
        cut = len(self._looks) - 6
        if cut > 0:
            del self._looks[:cut], self._away[:cut]

    def _first_minimum(self, at_end: bool, failed: bool) -> SingularCrossing | None:
        away = self._away
        for i in range(len(away) if at_end else len(away) - 1):
            t = self._looks[i].t
            if t <= self._judged:
                continue
            self._judged = t
            before = away[i - 1] if i else np.inf
            behind = away[i + 1] if i + 1 < len(away) else np.inf
            is_least = away[i] <= min(before, behind, _LOW * self._largest)
            if not is_least and not away[i] <= _FALLEN * self._largest < before < np.inf:
                continue
            rest = self._rest(max(i - 1, 0), min(i + 1, len(away) - 1)) if is_least else None
            if rest is not None:
                self.agreed.append(rest)
                continue
            near = self._closest(max(i - 1, 0), min(i + 1, len(away) - 1)) if is_least else None
            found = None if near is None else self._pass(*near, failed)
            heading = self._heading(i) if found is None else None
            if heading is not None:
                found = self._pass(*heading, failed)
            if found is None:
                continue
            if not self._went_along(found):
                return found
            self.agreed.append(found)
        return None

    def _heading(self, i: int) -> tuple[float, float] | None:
        """Return when the motion before a look would have come to a singular position about then; None if not.

        Where the solver has leapt into another way to move, what comes behind says nothing about the place.
        """
        away, times = self._away, [one.t for one in self._looks]
        for last in (i, i - 1):
            if last >= 1 and away[last] < away[last - 1]:
                step = times[last] - times[last - 1]
                t = times[last] + step * away[last] / (away[last - 1] - away[last])
                if t <= times[min(i + 1, len(times) - 1)]:
                    return t, away[i]
        return None

    def _went_along(self, crossing: SingularCrossing) -> bool:
        """Return whether the solver went over a singular position by itself, the same way and as accurately."""
        path, n, m = crossing.path, self._n, self._m
        if path is None:
            return True
        behind = crossing.time + 0.1 * (path.end - crossing.time)
        looks = [one for one in self._looks if behind < one.t <= path.end]
        if not looks:
            return False
        q, u, _ = path.at(np.array([one.t for one in looks]))
        y = np.stack([one.y for one in looks], axis=1)
        kinematic_map = self.plan.balance.kinematic_map
        places = (kinematic_map.normalized(y[:n]) - kinematic_map.normalized(q)) / self.plan.coordinate_sizes[:, None]
        speeds = (y[n : n + m] - u) / self.plan.sizes[:, None] * self.plan.scales.time
        return max(float(np.max(np.abs(places))), float(np.max(np.abs(speeds)))) < _AGREES * self.tolerance

    def _rest(self, first: int, last: int) -> SingularCrossing | None:
        """Return that the motion between some looks comes to rest where it is singular; None if it does not."""
        one, other = self._looks[first], self._looks[last]
        times = np.linspace(one.t, other.t, 65)
        known = self._between(times) if first < last else None
        near = None if known is None else slowest(times, known[1], self.plan.sizes)
        if near is None:
            return None
        assert known is not None
        away = self._measures.at(np.array([near]), known[0][:, [int(np.argmin(np.abs(times - near)))]])[0]
        begin = self._state(one) if away < _CLOSE * self._largest else None
        arc = None if begin is None else find_arc(self.plan, *begin, 2.0 * near - one.t, self._between)
        if arc is None or not arc.error < max(self.tolerance, _ACCURATE):
            return None
        rest = rests_at(self.plan, self._measures, arc, self._largest, self._fastest, self.tolerance)
        if rest is None:
            return None
        lost = nearly_lost(self._measures, rest, arc.at(np.array([rest]))[0][:, 0])
        return SingularCrossing(rest, 0, *self._said((lost,)), None)

    @property
    def _fastest(self) -> float:
        """The largest speed at the looks that are kept, in units of the scene's sizes."""
        speeds = slice(self._n, self._n + self._m)
        return max(float(np.max(np.abs(one.y[speeds]) / self.plan.sizes)) for one in self._looks)

    def _closest(self, first: int, last: int) -> tuple[float, float] | None:
        """Return when the motion between some looks is closest to a singular position, and how close; if it is."""
        times, places = [], []
        for one, other in zip(self._looks[first:last], self._looks[first + 1 : last + 1], strict=True):
            h = other.t - one.t
            s = np.linspace(0.0, 1.0, _FINE)
            if first == 0:  # perhaps it starts quite near
                s = np.unique(np.concatenate([s, np.geomspace(1e-5, 0.05, _FINE)]))
            a, b, v, w = (part[: self._n, None] for part in (one.y, other.y, h * one.yp, h * other.yp))
            places.append(cubic(s, (a, b), (v, w)))
            times.append(one.t + h * s)
        if not times:
            return None
        t, q = np.concatenate(times), np.concatenate(places, axis=1)
        away = self._measures.at(t, q)
        if not np.all(np.isfinite(away)):
            return None
        least = int(np.argmin(away))
        if away[least] > _CLOSE * self._largest or least in (0, len(t) - 1):
            return None
        return float(t[least]), float(away[least])

    def _pass(self, near: float, away: float = 0.0, failed: bool = False) -> SingularCrossing | None:
        """Return the singular crossing near a time; None where the motion is as anywhere else."""
        self.plan.compiles_columns = True  # the arcs take many evaluations of few states each
        tried: set[float] = set()
        for reach in (1.0, 2.0, 0.5, 0.25, 0.1):
            begin = self._begin(near, reach)
            if begin is None or begin[0] in tried:
                continue
            tried.add(begin[0])
            found = self._over(near, *begin)
            if found is not None:
                return found
        begin = self._begin(near, 1.0)
        if begin is None or begin[0] == self._looks[0].t:
            found = self._from_start(near)
            if found is not None:
                return found
        if begin is None or away > _QUITE_CLOSE * self._largest:
            return None
        return self._past(near, begin, failed)

    def _past(self, near: float, begin: tuple[float, FloatArray, FloatArray], failed: bool) -> SingularCrossing | None:
        """Return the way past a singular position that the motion comes close to."""
        measure = self._measures
        try:
            tolerance = max(1e-2 * self.tolerance, 1e-10)
            path = follow(self.plan, begin, 2.0 * near - begin[0], tolerance, measure.at)
        except AtwoodError:
            path = None
        if path is not None:
            times = np.concatenate([np.linspace(one.start, one.end, 5) for one in path.arcs])
            return SingularCrossing(float(times[np.argmin(measure.at(times, path.at(times)[0]))]), 0, (), (), path)
        lost = nearly_lost(measure, near, min(self._looks, key=lambda one: abs(one.t - near)).y[: self._n])
        if failed:
            self.trouble = near, lost
            return None
        return SingularCrossing(near, 0, *self._said((lost,)), None)

    def explain(self, message: str) -> SolveError | None:
        """Return the error of a solver that failed at a singular position; None if it failed elsewhere."""
        if self.trouble is None:
            return None
        t, lost = self.trouble
        return stuck_at(self.plan.assembly.own_equations.constraints[lost], t, message)

    def _said(self, constraints: tuple[int, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the labels of constraints, and the parts that they belong to."""
        every = [self.plan.assembly.own_equations.constraints[i] for i in constraints]
        return tuple(one.label for one in every), tuple(dict.fromkeys(one.key[0] for one in every))

    def _begin(self, near: float, reach: float) -> tuple[float, FloatArray, FloatArray] | None:
        """Return a state from which an arc may start."""
        speeds, sizes = slice(self._n, self._n + self._m), self.plan.sizes
        moved = ((one, float(np.max(np.abs(one.y[speeds]) / sizes)) * (near - one.t)) for one in reversed(self._looks))
        one = next((one for one, move in moved if move >= reach * _REACH), None)
        if one is None and self._looks[0].t < near:
            one = self._looks[0]
        return None if one is None else self._state(one)

    def _state(self, one: Look) -> tuple[float, FloatArray, FloatArray] | None:
        """Return a state that fulfils the constraints; None if there is none."""
        q, u = one.y[: self._n], one.y[self._n : self._n + self._m]
        made = project_states(self.plan, np.array([one.t]), q[:, None], u[:, None])
        if not made.doubtful[0]:
            return one.t, made.coordinates[:, 0], made.speeds[:, 0]
        try:
            return one.t, *project_safely(self.plan, one.t, q, u)
        except AtwoodError:
            return None

    def _over(self, near: float, t: float, q: FloatArray, u: FloatArray) -> SingularCrossing | None:
        """Return the way over a singular position near a time, from a state."""
        plan, accurate = self.plan, max(self.tolerance, _ACCURATE)
        for _ in range(8):
            arc = find_arc(plan, t, q, u, 2.0 * near - t, self._between)
            if arc is None or not arc.error < accurate:
                # It is too long: perhaps one half of the way is not.
                arc = find_arc(plan, t, q, u, 0.5 * (t + near))
                if arc is None or not arc.error < accurate:
                    return None
                q, u, _ = (one[:, 0] for one in arc.at(np.array([arc.end])))
                t, (q, u) = arc.end, plan.balance.project(arc.end, q, u, plan.sizes)
                continue
            found = find_crossing(self._measures, arc)
            if found is None or found[0] <= t:
                return None
            now, away = found
            if abs(now - near) > _CENTRED * (near - t):
                near = now
                continue
            return self._crossing(arc, now, away)
        return None

    def _between(self, t: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return coordinates and speeds at times, from what the solver gave around them; None beyond that."""
        looks = self._looks
        if len(looks) < 2 or not looks[0].t <= t[0]:
            return None
        if t[-1] > looks[-1].t + _BEYOND * (looks[-1].t - looks[-2].t):
            return None
        times = np.array([one.t for one in looks])
        y, yp = (np.stack([getattr(one, name)[: self._n + self._m] for one in looks], axis=1) for name in ("y", "yp"))
        after = np.clip(np.searchsorted(times, t), 1, len(times) - 1)
        h = times[after] - times[after - 1]
        both = cubic(
            (t - times[after - 1]) / h, (y[:, after - 1], y[:, after]), (h * yp[:, after - 1], h * yp[:, after])
        )
        return both[: self._n], both[self._n :]

    def _crossing(self, arc: Arc, t: float, away: float) -> SingularCrossing | None:
        """Return the singular crossing that an arc makes at a time; None if that is no singular position."""
        if is_slow(self.plan, arc, t, self._fastest, self.tolerance):
            return None
        loss = find_loss(self._measures, arc, t, away)
        return (
            None
            if loss is None
            else SingularCrossing(t, loss.rank, *self._said(loss.constraints), Path((arc,)), loss.gap)
        )
