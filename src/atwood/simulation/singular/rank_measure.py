"""How near states of a mechanism with loops are to a singular position, and where a motion passes through one.

At a singular position some constraints follow from the others which nowhere near do so. The measure is the smallest
singular value of the independent constraints' slopes, scaled; for large scenes one that is near it and costs less:
how long the shortest displacement is that changes all constraints by about as much. Either falls to zero at an even
rate as the position is approached, and rises again behind it.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import scaled, to_array
from atwood.numerics.rank import decompose, lost_rank, rank, singular_values
from atwood.simulation.problem.problem import Plan
from atwood.simulation.problem.projection import ConstraintsAt, constraints_at
from atwood.simulation.singular.collocation import Arc
from atwood.tolerances import tolerances

_UNEVEN = 0.5
"""By so large a share steps on both sides of a zero may differ."""

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


_SMALL = 40
"""Up to so many constraints singular values cost little."""


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

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.rows = np.zeros(plan.balance.constraints)

    def learn(self, t: FloatArray, q: FloatArray) -> FloatArray:
        """Learn from states how much constraints change, and return the measure there; see `at`."""
        now = self._constraints(t, q)
        np.maximum(self.rows, np.max(now.rows, axis=0), out=self.rows)
        return self._of(now)

    def at(self, t: FloatArray, q: FloatArray) -> FloatArray:
        """Return the measure, shape (states,)."""
        return self._of(self._constraints(t, q))

    def _of(self, now: ConstraintsAt) -> FloatArray:
        share, count = now.rows / self.rows, len(now.value)
        if now.normal is None and len(now.kept) <= _SMALL:
            slopes = (now.jacobian * share[:, :, None])[:, now.kept]
            if not slopes.shape[1]:
                return np.ones(count)  # what constraints there are follow from what is eliminated
            if not np.all(np.isfinite(slopes)):
                return np.full(count, np.nan)
            return np.asarray(singular_values(slopes)[:, -1])
        right = np.sin(_GOLDEN * np.arange(1.0, now.value.shape[1] + 1.0)) * np.ones((count, 1))
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
    far = np.inf
    for _ in range(2):  # once more near by, where nothing else bends the measure
        times = middle + half * _POINTS[0]
        away = measure.at(times, arc.at(times)[0])
        root = _sign_change(away)
        if root is None:
            return None
        far = min(far, float(max(away[0], away[-1])))
        middle, half = middle + half * root, 0.3 * half
    return middle, far


_POINTS = legendre.leggauss(12)

_SERIES = (np.arange(12) + 0.5)[:, None] * (legendre.legvander(_POINTS[0], 11) * _POINTS[1][:, None]).T
"""Gives coefficients of Legendre polynomials from values at the points."""


def _sign_change(away: FloatArray) -> float | None:
    """Return where a measure at the points of Gauss and Legendre falls to zero to rise again; None if it does not.

    What falls to zero and rises again is smooth if its sign changes there.
    """
    x = _POINTS[0]
    order, least = np.arange(len(x)), int(np.argmin(away))
    if not np.all(np.isfinite(away)) or least in (0, len(x) - 1):
        return None
    smoothest, found = np.inf, None
    for first in (least, least + 1):  # the right one of two is that whose coefficients die away
        series = _SERIES @ np.where(order < first, -away, away)
        tail = float(np.sum(np.abs(series[-2:])))
        if tail < smoothest:
            smoothest, found = tail, _root(series, float(x[first - 1]), float(x[first]))
    return found


def _root(series: FloatArray, below: float, above: float) -> float:
    """Return where a series of Legendre polynomials is zero between two places of which it has the signs - and +.

    By false position, the end that stays being given half its weight (M. Dowell and P. Jarratt, *A modified regula
    falsi method*, BIT 11, 1971).
    """
    coefficients = series.tolist()
    low, high = legendre.legval([below, above], series).tolist()
    x, last = below, 0.0
    for _ in range(_ROOT_STEPS):
        if not above - below > _ROOTED:
            break
        x = (below * high - above * low) / (high - low) if low < 0.0 < high else 0.5 * (below + above)
        value = _clenshaw(coefficients, x)
        if value == 0.0:
            break
        if value < 0.0:
            below, low, high = x, value, 0.5 * high if last < 0.0 else high
        else:
            above, high, low = x, value, 0.5 * low if last > 0.0 else low
        last = value
    return x


_ROOT_STEPS, _ROOTED = 60, 1e-15
"""So many steps of false position at most, and how long the last interval is: rounding of numbers of size one."""


def _clenshaw(coefficients: list[float], x: float) -> float:
    """Return the value of a series of Legendre polynomials at one place; numbers one by one are fastest here."""
    value = after = 0.0
    for k in range(len(coefficients) - 1, 0, -1):
        value, after = coefficients[k] + ((2 * k + 1) * x * value) / (k + 1) - (k + 1) / (k + 2) * after, value
    return coefficients[0] + x * value - 0.5 * after


def zero_ahead(times: FloatArray, away: FloatArray) -> float | None:
    """Return when a measure falls to zero at an even rate, and rises again, between some times; None if it does not."""
    least = int(np.argmin(away)) if np.all(np.isfinite(away)) else 0
    if not 0 < least < len(away) - 1:
        return None
    before, here, after = away[least - 1 : least + 2].tolist()
    higher, lower, way = (before, after, 1.0) if before > after else (after, before, -1.0)
    if not abs((higher - here) - (here + lower)) < _UNEVEN * (higher - here):
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
