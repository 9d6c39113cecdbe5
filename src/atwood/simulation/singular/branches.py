"""Branches of the motion through or past a singular configuration, predicted from monitor samples.

When the motion is near one, and which samples are judged, is decided in `atwood.simulation.singular.monitor`. While
IDA goes on by itself samples are taken by compiled functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError
from atwood.forms.caches import Key
from atwood.integrators.protocol import StepMonitor
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.problem.explicit_scene import project_quickly
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import project_safely, project_states
from atwood.simulation.singular.collocation import Arc, Path, find_arc, follow
from atwood.simulation.singular.crossing import (
    RankMeasure,
    SingularCrossing,
    find_crossing,
    find_loss,
    has_few,
    is_slow,
    labels_of,
    nearly_lost,
    rests_at,
    slowest,
    stuck_at,
)
from atwood.simulation.singular.crossing_routine import BEYOND, CENTRED, REACH

if TYPE_CHECKING:
    from atwood.codegen.sundials.step_monitor import MonitorCode, MonitorData

_LOOKOUT: Key[MonitorCode] = Key("machine code of the singularity monitor")

_MOVE = 0.3
"""Between two looks nothing moves by more of its size; an angle by so many radians."""

_SHARE = 0.01
"""What rests is looked at after this share of a run: it may be set in motion."""

_LOW = 0.35
"""Only where less than this share of the most that it has been is left of a constraint, beside those before it, is
anything done in Python. At a singular position nothing is left of one, and a look before it at most `_MOVE`."""

_WORN = 0.5
"""Which of redundant constraints are kept is asked again where less than this share of what it was is left of one."""

_LARGEST = 600
"""With more constraints they are looked at in Python, which knows where their slopes have no entries."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A state on the way: time, unknowns and their rates."""

    t: float
    y: FloatArray
    yp: FloatArray


def stride_from(plan: SceneProblem, look: Sample, whole: float) -> float:
    """Return the time in which something moves as far as it may until the next look; never beyond the end."""
    speeds = slice(plan.program.coordinates, plan.program.coordinates + len(plan.sizes))
    speed, pull = (float(np.max(np.abs(one[speeds]) / plan.sizes)) for one in (look.y, look.yp))
    if not np.isfinite(speed + pull):
        return _SHARE * whole
    # the root of pull/2 h^2 + speed h = move, without cancellation
    below = speed + np.sqrt(speed * speed + 2.0 * pull * _MOVE)
    stride = 2.0 * _MOVE / below if below > 0.0 else np.inf
    return stride if stride < whole else _SHARE * whole


def cubic(s: FloatArray, ends: tuple[FloatArray, FloatArray], slopes: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return the cubic through two states with their rates, at shares of the way from one to the other."""
    (a, b), (v, w) = ends, slopes
    found: FloatArray = a + s * v + s**2 * (3.0 * (b - a) - 2.0 * v - w) + s**3 * (2.0 * (a - b) + v + w)
    return found


def going_on(plan: SceneProblem, look: Sample, times: FloatArray) -> FloatArray:
    """Predict coordinates and speeds at times near a look from the accelerations there, shape (number, times)."""
    n, m = plan.program.coordinates, len(plan.sizes)
    later = np.asarray(times) - look.t
    u = look.y[n : n + m, None] + look.yp[n : n + m, None] * later
    middle = look.y[n : n + m, None] + 0.5 * look.yp[n : n + m, None] * later
    q = np.repeat(look.y[:n, None], len(later), axis=1)
    moved = plan.balance.kinematic_map.moved_each(np.full(len(later), look.t), q, middle * later)
    return np.concatenate([moved, u])


def compiled_monitor(plan: SceneProblem, whole: float, size: int) -> MonitorData | None:
    """Return what looks at a motion by itself, for one run; None where nothing can be compiled."""
    held, assembly = plan.balance.program, plan.assembly
    if plan.not_compilable or held.constraints > _LARGEST:
        return None
    from atwood.codegen.sundials.step_monitor import LookRate, compile_monitor

    places = held.jacobian_rows, held.jacobian_columns
    code = assembly.shared.get(
        _LOOKOUT,
        lambda: compile_monitor(held.constraints_alone, held.speeds, size, places),
        assembly.form,
        size,
    )
    rate = LookRate(_MOVE, whole, _SHARE * whole, _LOW, _WORN if plan.finding.redundant else 0.0)
    return code.bind(assembly.parameter_values, plan.sizes, plan.finding.kept, rate, has_few(plan))


def as_step_monitor(data: MonitorData) -> StepMonitor:
    """Return what a session is given to look with."""
    from atwood.codegen.sundials.step_monitor import NOTICED, PAUSED

    code = data.code
    data.spend(0.0)
    return StepMonitor(
        code.drive, code.fill, NOTICED, PAUSED, data.address, data.due, data.due_at, code.look_address, data.spend, data
    )


_CLOSE = 0.05
"""Only where the measure is so small on a finer look, relative to the largest so far, is a way over it looked for."""

_QUITE_CLOSE = 0.02
"""The same where a motion is followed past a position that it does not pass through."""

_NEAR = 0.6
"""The same where a solver cannot start behind a position at a tight tolerance: rounding is larger there."""

ACCURATE = 1e-7
"""Arcs over a place are taken whose estimates are smaller, or within the tolerance; errors are far below these."""

_FINE = 17

_AGREES = 30.0
"""Times the tolerance: a solver whose states behind the place differ by less from the arc has gone the same way."""


class Branches:
    """The ways of a motion over singular positions, from the looks that were taken at it.

    Parameters
    ----------
    plan
        The scene in its mode.
    tolerance
        The relative tolerance of the run.
    whole
        The length of the stretch, s.

    Attributes
    ----------
    trouble
        Where the solver failed at a singular position that it could not be helped over: its time, and the number of
        the constraint that nearly follows from the others there; None elsewhere.
    """

    trouble: tuple[float, int] | None

    def __init__(self, plan: SceneProblem, tolerance: float, whole: float) -> None:
        self.plan, self.tolerance, self._whole = plan, tolerance, whole
        self._n, self._m = plan.program.coordinates, len(plan.sizes)
        self._samples: list[Sample] = []
        self._largest = 0.0
        self._measures = RankMeasure(plan)
        self._is_behind = False

    def _from_start(self, near: float) -> SingularCrossing | None:
        """Return the way on from a start that is near a singular position, or has one just ahead, at a time.

        Behind a crossing rounding can be too large for a solver at first; there the motion goes away from the place.
        """
        first = self._samples[0]
        stride = stride_from(self.plan, first, np.inf)  # also beyond the end of a short run, where it is not looked at
        stride = stride if np.isfinite(stride) else self._whole
        begin = self._state(first)
        if begin is None or not near < first.t + 0.1 * stride:
            return None
        longest: Path | None = None
        for share in (1.0, 0.3, 0.1):
            arc = find_arc(self.plan, *begin, first.t + share * stride)
            if arc is None or not arc.error < max(self.tolerance, ACCURATE):
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

    def _went_along(self, crossing: SingularCrossing) -> bool:
        """Return whether the solver went over a singular position by itself, the same way and as accurately."""
        path, n, m = crossing.path, self._n, self._m
        if path is None:
            return True
        behind = crossing.time + 0.1 * (path.end - crossing.time)
        looks = [one for one in self._samples if behind < one.t <= path.end]
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
        one, other = self._samples[first], self._samples[last]
        times = np.linspace(one.t, other.t, 65)
        known = self._between(times) if first < last else None
        near = None if known is None else slowest(times, known[1], self.plan.sizes)
        if near is None:
            return None
        assert known is not None
        away = self._measures.at(np.array([near]), known[0][:, [int(np.argmin(np.abs(times - near)))]])[0]
        begin = self._state(one) if away < _CLOSE * self._largest else None
        arc = None if begin is None else find_arc(self.plan, *begin, 2.0 * near - one.t, self._between)
        if arc is None or not arc.error < max(self.tolerance, ACCURATE):
            return None
        rest = rests_at(self.plan, self._measures, arc, self._largest, self._fastest, self.tolerance)
        if rest is None:
            return None
        lost = nearly_lost(self._measures, rest, arc.at(np.array([rest]))[0][:, 0])
        return SingularCrossing(rest, 0, *labels_of(self.plan, (lost,)), None)

    @property
    def _fastest(self) -> float:
        """The largest speed at the looks that are kept, in units of the scene's sizes."""
        speeds = slice(self._n, self._n + self._m)
        return max(float(np.max(np.abs(one.y[speeds]) / self.plan.sizes)) for one in self._samples)

    def _closest(self, first: int, last: int) -> list[tuple[float, float]]:
        """Return when the motion between some looks is closest to singular positions, and how close, in order."""
        times, places = [], []
        for one, other in zip(self._samples[first:last], self._samples[first + 1 : last + 1], strict=True):
            h = other.t - one.t
            s = np.linspace(0.0, 1.0, _FINE)
            if first == 0:  # perhaps it starts quite near
                s = np.unique(np.concatenate([s, np.geomspace(1e-5, 0.05, _FINE)]))
            a, b, v, w = (part[: self._n, None] for part in (one.y, other.y, h * one.yp, h * other.yp))
            places.append(cubic(s, (a, b), (v, w)))
            times.append(one.t + h * s)
        if not times:
            return []
        t, q = np.concatenate(times), np.concatenate(places, axis=1)
        away = self._measures.at(t, q)
        if not np.all(np.isfinite(away)):
            return []
        least = (away[1:-1] <= np.minimum(away[:-2], away[2:])) & (away[1:-1] <= _CLOSE * self._largest)
        return [(float(t[k]), float(away[k])) for k in np.nonzero(least)[0] + 1]

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
        if begin is None or begin[0] == self._samples[0].t:
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
        lost = nearly_lost(measure, near, min(self._samples, key=lambda one: abs(one.t - near)).y[: self._n])
        if failed:
            self.trouble = near, lost
            return None
        return SingularCrossing(near, 0, *labels_of(self.plan, (lost,)), None)

    def explain(self, message: str) -> SolveError | None:
        """Return the error of a solver that failed at a singular position; None if it failed elsewhere."""
        if self.trouble is None:
            return None
        t, lost = self.trouble
        return stuck_at(self.plan.assembly.own_equations.constraints[lost], t, message)

    def _begin(self, near: float, reach: float) -> tuple[float, FloatArray, FloatArray] | None:
        """Return a state from which an arc may start."""
        speeds, sizes = slice(self._n, self._n + self._m), self.plan.sizes
        moved = (
            (one, float(np.max(np.abs(one.y[speeds]) / sizes)) * (near - one.t)) for one in reversed(self._samples)
        )
        one = next((one for one, move in moved if move >= reach * REACH), None)
        if one is None and self._samples[0].t < near:
            one = self._samples[0]
        return None if one is None else self._state(one)

    def _state(self, one: Sample) -> tuple[float, FloatArray, FloatArray] | None:
        """Return a state that fulfils the constraints; None if there is none."""
        q, u = one.y[: self._n], one.y[self._n : self._n + self._m]
        found = project_quickly(self.plan, one.t, q, u)
        if found is not None:
            return one.t, *found
        made = project_states(self.plan, np.array([one.t]), q[:, None], u[:, None])
        if not made.doubtful[0]:
            return one.t, made.coordinates[:, 0], made.speeds[:, 0]
        try:
            return one.t, *project_safely(self.plan, one.t, q, u)
        except AtwoodError:
            return None

    def _over(self, near: float, t: float, q: FloatArray, u: FloatArray) -> SingularCrossing | None:
        """Return the way over a singular position near a time, from a state."""
        plan, accurate = self.plan, max(self.tolerance, ACCURATE)
        before: tuple[Arc, ...] = ()
        for _ in range(8):
            arc = find_arc(plan, t, q, u, 2.0 * near - t, self._between)
            if arc is None or not arc.error < accurate:
                # It is too long: perhaps one half of the way is not.
                arc = find_arc(plan, t, q, u, 0.5 * (t + near))
                if arc is None or not arc.error < accurate:
                    return None
                q, u, _ = (one[:, 0] for one in arc.at(np.array([arc.end])))
                t, (q, u) = arc.end, plan.balance.project(arc.end, q, u, plan.sizes)
                before = (*before, arc)  # outputs on it are of the way, too
                continue
            found = find_crossing(self._measures, arc)
            if found is None or found[0] <= t:
                return None
            now, away = found
            if abs(now - near) > CENTRED * (near - t):
                near = now
                continue
            return self._crossing(arc, now, away, before)
        return None

    def _between(self, t: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return coordinates and speeds at times, from what the solver gave around them; None beyond that."""
        looks = self._samples
        if len(looks) < 2 or not looks[0].t <= t[0]:
            return None
        if t[-1] > looks[-1].t + BEYOND * (looks[-1].t - looks[-2].t):
            return None
        times = np.array([one.t for one in looks])
        y, yp = (np.stack([getattr(one, name)[: self._n + self._m] for one in looks], axis=1) for name in ("y", "yp"))
        after = np.clip(np.searchsorted(times, t), 1, len(times) - 1)
        h = times[after] - times[after - 1]
        both = cubic(
            (t - times[after - 1]) / h, (y[:, after - 1], y[:, after]), (h * yp[:, after - 1], h * yp[:, after])
        )
        return both[: self._n], both[self._n :]

    def _crossing(self, arc: Arc, t: float, away: float, before: tuple[Arc, ...] = ()) -> SingularCrossing | None:
        """Return the singular crossing that an arc makes at a time, perhaps behind others; None if it makes none."""
        if is_slow(self.plan, arc, t, self._fastest, self.tolerance):
            return None
        loss = find_loss(self._measures, arc, t, away)
        return (
            None
            if loss is None
            else SingularCrossing(t, loss.rank, *labels_of(self.plan, loss.constraints), Path((*before, arc)), loss.gap)
        )
