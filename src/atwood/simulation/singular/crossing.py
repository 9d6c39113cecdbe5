"""Singular configurations that a run passed through, came close to, or came to rest in.

Where all bars of a row of parallelograms lie in one line some constraints follow from the others, and how the
mechanism goes on is not determined by where it is. Its motion until then goes on smoothly in one way only. A motion
that reaches the place with little speed would turn back a little before or behind it for another energy. So it is told
apart from one that passes, and from one that turns back clearly, by more than what its errors can change.

How near a state is to one is measured by the smallest singular value of the independent constraints' slopes, scaled;
for large scenes by one that is near it and costs less: how long the shortest displacement is that changes all
constraints by about as much. Either falls to zero at an even rate as the position is approached, and rises again
behind it.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, uneven
from atwood.codegen.sundials.rank_looks import SMALL, UNEVEN
from atwood.errors import SolveError
from atwood.integrators.event_location import EventLocator, Root
from atwood.integrators.protocol import State
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Constraint
from atwood.numerics.matrices import scaled, to_array
from atwood.numerics.rank import decompose, lost_rank, rank, singular_values
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import ConstraintsAt, constraints_at, errors_at, normal_equations
from atwood.simulation.singular.collocation import Arc, points
from atwood.simulation.singular.crossing_routine import NARROWER, sign_change
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.sundials.step_monitor import MonitorData
    from atwood.simulation.singular.collocation import Path

_PIECES = 8
"""In so many pieces a path is searched for events."""


@dataclass(frozen=True, eq=False)
class SingularCrossing:
    """A singular position that a run passed through, or came close to.

    Attributes
    ----------
    time
        When, s.
    ways
        How many more degrees of freedom the mechanism has there than near by; zero where it only comes close.
    constraints
        What follows from the other constraints there, and nowhere near.
    parts
        The parts that these belong to.
    path
        The motion over the place or past it; None where it could not be told.
    gap
        By how much the constraints do not quite hold there, relative to the scene's sizes.
    """

    time: float
    ways: int
    constraints: tuple[str, ...]
    parts: tuple[str, ...]
    path: Path | None
    gap: float = 0.0

    @property
    def is_told(self) -> bool:
        """Whether there is something to tell: not where a motion only came close, and could be followed."""
        return self.ways > 0 or self.path is None

    def has_in_its_middle(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return which times are so near that states are better taken from the path than projected."""
        return np.asarray(np.abs(t - self.time) < 0.1 * self._half)

    def covers(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return at which times states are better taken from the path than from between the ends of a solver's step."""
        return np.zeros(len(t), dtype=bool) if self.path is None else (t > self.path.start) & (t < self.path.end)

    def leaves_open(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return at which times reactions are not determined, within rounding."""
        return np.asarray(np.abs(t - self.time) < 1e-6 * self._half) if self.ways else np.zeros(len(t), dtype=bool)

    @property
    def _half(self) -> float:
        return 0.0 if self.path is None else self.path.end - self.time

    def describe(self) -> str:
        """Return it as a sentence."""
        more = len(self.constraints) - 3
        said = ", ".join(self.constraints[:3]) + (f" and {more} more" if more > 0 else "")
        follow = "follows" if len(self.constraints) == 1 else "follow"
        if self.path is None:
            return (
                f"t = {self.time:.6g} s: came so close to a singular position, where {said} nearly {follow} from the "
                "other constraints, that it could not be told which way the mechanism goes on: do not rely on what "
                "comes after"
            )
        return (
            f"t = {self.time:.6g} s: passed through a singular position, where {said} {follow} from the other "
            f"constraints and there {'is one more way' if self.ways == 1 else f'are {self.ways} more ways'} to move; "
            f"went on smoothly{self._fit}"
        )

    @property
    def _fit(self) -> str:
        """What is to be said of lengths that do not quite fit."""
        if self.gap < 1e-12:
            return ""
        return f" (lengths fit there to {self.gap:.0e} of the scene's size, which was taken for exactly)"


def stuck_at(constraint: Constraint, t: float, message: str) -> SolveError:
    """Return the error of a solver that failed at a singular position."""
    return SolveError(
        f"near t = {t:.6g} the mechanism comes to a singular position, where {constraint.label} nearly follows from "
        f"the other constraints, too slowly or too closely to determine how the motion continues: {message}",
        where=constraint.key[0],
        advice="Change lengths, start or speed slightly, so that the motion clearly crosses the singular position "
        "or avoids it.",
    )


def begun_at(constraint: Constraint, t: float) -> SolveError:
    """Return the error of a run that is interrupted at a singular position, as by a time event."""
    return SolveError(
        f"at t = {t:.9g} the run begins anew where the mechanism is in a singular position, as far as rounding tells: "
        f"{constraint.label} follows from the other constraints there, and how the motion continues is not determined",
        where=constraint.key[0],
        advice="Move what happens at this time, such as a step of a force or a sample, by a millionth of a second, or "
        "take the reduced form.",
    )


def events_on(path: Path, plan: SceneProblem, probe: EventProbe) -> Root | None:
    """Return the first event on a path; None if there is none."""
    if not probe.event_functions:
        return None
    size, n, m = plan.program.size, plan.program.coordinates, len(plan.sizes)

    def at(t: float) -> State:
        q, u, a = (one[:, 0] for one in path.at(np.array([t])))
        y, yp = np.zeros(size), np.zeros(size)
        y[:n], y[n : n + m], yp[n : n + m] = plan.balance.kinematic_map.normalized(q), u, a
        yp[:n] = plan.balance.kinematic_map.rates(t, y[:n], u)
        return t, y, yp

    locator = EventLocator(plan.problem(probe.function(), probe.directions), path.end - path.start)
    locator.restart(at(path.start))
    times = np.linspace(path.start, path.end, _PIECES + 1).tolist()
    found = (locator.search(one, other, at) for one, other in pairwise(times))
    return next((root for root in found if root is not None), None)


_ENERGIES, _PLACES = 30.0, 300.0
"""Times the tolerance: what a run's errors may change, of energies and of places, relative to their sizes."""

_LEAST = 1e-7
"""At tighter tolerances the same; rank is judged to be lost within 1e-5."""


def least_energy(tolerance: float) -> float:
    """Return the share of a motion's energy that is little at the tolerance of a run."""
    return max(_ENERGIES * tolerance, _LEAST)


def is_slow(plan: SceneProblem, arc: Arc, t: float, fastest: float, tolerance: float) -> bool:
    """Return whether a motion has so little energy at a time that errors could have it turn back."""
    here, *ends = np.max(np.abs(arc.at(np.array([t, arc.start, arc.end]))[1]) / plan.sizes[:, None], axis=0).tolist()
    return bool(here**2 < least_energy(tolerance) * max(fastest, *ends) ** 2)


def slowest(t: FloatArray, speeds: FloatArray, sizes: FloatArray) -> float | None:
    """Return when a motion is slowest between some times; None where it is at their ends."""
    square = np.sum((speeds / sizes[:, None]) ** 2, axis=0)
    least = int(np.argmin(square))
    if least in (0, len(t) - 1):
        return None
    before, here, after = square[least - 1 : least + 2].tolist()
    bend = before - 2.0 * here + after
    share = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(t[least] + share * (t[1] - t[0]))


def rests_at(
    plan: SceneProblem, measure: RankMeasure, arc: Arc, far: float, fastest: float, tolerance: float
) -> float | None:
    """Return when an arc comes to rest so close to a singular position that errors decide what follows, or None."""
    times = np.linspace(arc.start, arc.end, 65)
    rest = slowest(times, arc.at(times)[1], plan.sizes)
    if rest is None:
        return None
    near = measure.at(np.array([rest]), arc.at(np.array([rest]))[0])[0] < max(_PLACES * tolerance, _LEAST) * far
    return rest if near and is_slow(plan, arc, rest, fastest, tolerance) else None


_FEW = 20
"""The same where rows have few entries, of which the other measure makes less work: it sees a position only quite near
where one of several mechanisms is in it."""


def has_few(plan: SceneProblem) -> bool:
    """Return whether there are so few constraints that their singular values cost little."""
    return len(plan.finding.kept) <= (SMALL if normal_equations(plan) is None else _FEW)


@dataclass(frozen=True)
class Loss:
    """What is lost at a singular position.

    Attributes
    ----------
    rank
        By how much the number of independent constraints is less there than near by; zero if only those that were
        kept depend on each other, and some that were left out take their places.
    constraints
        Numbers of constraints that follow from those before them there, and nowhere near.
    gap
        By how much the place misses the constraints, relative to the scene's sizes.
    """

    rank: int
    constraints: tuple[int, ...]
    gap: float = 0.0


class RankMeasure:
    """How far states are from a singular position.

    Each constraint is measured by how much it has changed most so far: one that hardly changes where it is asked for is
    just what is looked for.

    Parameters
    ----------
    plan
        The scene in its mode.
    """

    def __init__(self, plan: SceneProblem) -> None:
        self.plan = plan
        self.rows = np.zeros(plan.balance.constraints)
        self.compiled: MonitorData | None = None

    def learn(self, t: FloatArray, q: FloatArray, known: int | None = None) -> FloatArray:
        """Learn from states, the first if so many are given, how much constraints change; return the measure of all."""
        if self.compiled is not None:
            least = tolerances.TRUSTED * errors_at(self.plan, t, q)
            return self.compiled.measures(t, q, len(t) if known is None else known, least)
        now = self._constraints(t, q)
        np.maximum(self.rows, np.max(now.rows[:known], axis=0), out=self.rows)
        return self._of(now)

    def at(self, t: FloatArray, q: FloatArray) -> FloatArray:
        """Return the measure, shape (states,)."""
        if self.compiled is not None:
            return self.compiled.measures(t, q, 0, self.rows)
        return self._of(self._constraints(t, q))

    def _of(self, now: ConstraintsAt) -> FloatArray:
        share, count = now.rows / self.rows, len(now.value)
        if now.normal is None and len(now.kept) <= SMALL:
            slopes = (now.jacobian * share[:, :, None])[:, now.kept]
            if not slopes.shape[1]:
                return np.ones(count)  # what constraints there are follow from what is eliminated
            found, is_known = np.full(count, np.nan), np.isfinite(slopes).all(axis=(1, 2))
            found[is_known] = singular_values(slopes[is_known])[:, -1] if is_known.any() else np.nan
            return found
        right = uneven(now.value.shape[1]) * np.ones((count, 1))
        with np.errstate(all="ignore"):
            step = now.step(right / share)
            size: FloatArray = np.linalg.norm(right[:, now.kept], axis=1) / np.linalg.norm(step, axis=1)
        return size

    def jacobian_at(self, t: float, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the Jacobian of all constraints at one place, scaled, and by how much positions miss them."""
        now = self.plan.balance.constraints_at(t, q, np.zeros_like(self.plan.sizes))
        constraint_jacobian = to_array(scaled(now.jacobian, self.plan.sizes, self.rows))
        return constraint_jacobian, np.abs(now.value / self.rows)[self.plan.balance.holonomic]

    def _constraints(self, t: FloatArray, q: FloatArray) -> ConstraintsAt:
        return constraints_at(self.plan, t, q, np.zeros((len(self.plan.sizes), len(t))))


def find_crossing(measure: RankMeasure, arc: Arc) -> tuple[float, float] | None:
    """Return when an arc passes closest to a singular position, and how far away it is at its ends; None if never."""
    middle, half = 0.5 * (arc.start + arc.end), 0.5 * (arc.end - arc.start)
    x, series, _ = points()
    far = np.inf
    for _ in range(2):  # once more near by, where nothing else bends the measure
        times = middle + half * x
        away = measure.at(times, arc.at(times)[0])
        root = sign_change(away, x, series)
        if root is None:
            return None
        far = min(far, float(max(away[0], away[-1])))
        middle, half = middle + half * root, NARROWER * half
    return middle, far


def zero_ahead(times: FloatArray, away: FloatArray) -> float | None:
    """Return when a measure falls to zero at an even rate, and rises again, between some times; None if it does not."""
    least = int(np.argmin(away)) if np.all(np.isfinite(away)) else 0
    if not 0 < least < len(away) - 1:
        return None
    before, here, after = away[least - 1 : least + 2].tolist()
    higher, lower, way = (before, after, 1.0) if before > after else (after, before, -1.0)
    if not abs((higher - here) - (here + lower)) < UNEVEN * (higher - here):
        return None  # it turns back before zero
    share = way * here / (here + lower)
    return float(times[least] + share * (times[1] - times[0]))


def find_loss(measure: RankMeasure, arc: Arc, t: float, away: float) -> Loss | None:
    """Return what is lost at a time of an arc; None if that is no singular position."""
    finding = measure.plan.finding
    q = measure.plan.balance.kinematic_map.normalized(arc.at(np.array([t]))[0][:, 0])
    constraint_jacobian, misses = measure.jacobian_at(t, q)
    kept = list(finding.kept)
    if not lost_rank(singular_values(constraint_jacobian[kept]), away):
        return None
    if not np.max(misses, initial=0.0) < tolerances.NEARLY_FITS:
        return None
    least = tolerances.SINGULAR * away
    lost = finding.rank - rank(constraint_jacobian, least)
    if lost <= 0:
        return Loss(0, ())
    left = set(_independent(constraint_jacobian, least))
    return Loss(lost, tuple(i for i in kept if i not in left), float(np.max(misses, initial=0.0)))


def labels_of(plan: SceneProblem, constraints: tuple[int, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the labels of constraints, and the parts that they belong to."""
    every = [plan.assembly.own_equations.constraints[i] for i in constraints]
    return tuple(one.label for one in every), tuple(dict.fromkeys(one.key[0] for one in every))


def nearly_lost(measure: RankMeasure, t: float, q: FloatArray) -> int:
    """Return the number of the constraint that most nearly follows from the others at a place."""
    constraint_jacobian, _ = measure.jacobian_at(t, measure.plan.balance.kinematic_map.normalized(q))
    kept = list(measure.plan.finding.kept)
    return kept[int(np.argmax(np.abs(decompose(constraint_jacobian[kept]).left[:, -1])))]


def _independent(constraint_jacobian: FloatArray, least: float) -> list[int]:
    """Return the numbers of rows that depend on none before them, by what is left of each, whatever its size."""
    kept: list[int] = []
    basis = np.empty((min(constraint_jacobian.shape), constraint_jacobian.shape[1]))
    for i, row in enumerate(constraint_jacobian):
        known = basis[: len(kept)]
        left = row - (known @ row) @ known
        left = left - (known @ left) @ known
        rest = float(np.linalg.norm(left))
        if rest > 10.0 * least and len(kept) < len(basis):
            basis[len(kept)] = left / rest
            kept.append(i)
    return kept
