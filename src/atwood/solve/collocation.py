"""A stretch of a motion as polynomials of time, found where single steps cannot go.

The polynomials fulfil the equations at the points of Gauss and Legendre, none of which lies in the middle of the
stretch or at its ends (E. Hairer, S. P. Norsett and G. Wanner, *Solving Ordinary Differential Equations I*, section
II.7). So they pass smoothly over a place in the middle where the equations determine nothing. They are found by
repeated integration, with each state projected onto the constraints before forces are asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from atwood.errors import AtwoodError
from atwood.solve.driver import FloatArray
from atwood.solve.problem import Plan
from atwood.solve.projection import project_safely, project_states
from atwood.solve.reactions import accelerations_and_multipliers

__all__ = ["Arc", "find_arc"]

_POINTS, _FEWER = 12, 10
"""Of the polynomials, and of those that they are compared with."""

_SWEEPS = 60
_SETTLED = 1e-14
_ROUNDED = 1e-8
"""Relative to the scene's sizes: changes that are smaller and do not shrink any more are those of rounding."""


@dataclass(frozen=True, eq=False)
class Arc:
    """A motion from one time to another.

    Attributes
    ----------
    start, end
        When, s.
    coordinates, speeds
        Coefficients of Legendre polynomials of time, from -1 at the start to 1 at the end; shape (order, number).
    error
        Estimate of the largest error of its states, relative to the scene's sizes.
    """

    start: float
    end: float
    coordinates: FloatArray
    speeds: FloatArray
    error: float

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return coordinates, speeds and accelerations at times, each of shape (number, times)."""
        x = (2.0 * np.asarray(t, dtype=float) - self.start - self.end) / (self.end - self.start)
        slope = legendre.legder(self.speeds) * (2.0 / (self.end - self.start))
        q, u, a = (legendre.legval(x, one) for one in (self.coordinates, self.speeds, slope))
        return np.asarray(q), np.asarray(u), np.asarray(a)


def find_arc(plan: Plan, t: float, q: FloatArray, u: FloatArray, end: float) -> Arc | None:
    """Return how a motion goes on from a state; None where no smooth motion is found.

    Parameters
    ----------
    plan
        The scene in its mode.
    t, q, u
        A state that fulfils the constraints.
    end
        When the arc is to end. A place where constraints depend on each other may lie in the middle between.
    """
    try:
        with np.errstate(all="ignore"):
            begin = (q[:, None] + np.zeros(_FEWER), u[:, None] + np.zeros(_FEWER))
            rough = _settle(plan, (t, q, u), end, begin, _FEWER)
            if rough is None:
                return None
            x, _ = _points(_POINTS)
            times = t + 0.5 * (end - t) * (x + 1.0)
            fine = _settle(plan, (t, q, u), end, rough.at(times)[:2], _POINTS)
    except AtwoodError:  # a state without a value, or without accelerations: nothing goes on smoothly here
        return None
    if fine is None:
        return None
    apart = [one - other for one, other in zip(fine.at(times)[:2], rough.at(times)[:2], strict=True)]
    return replace(fine, error=max(fine.error, _size(plan, *apart)))


@cache
def _points(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the points, and the matrix that gives coefficients of the integral from values at them."""
    x, weights = legendre.leggauss(count)
    order = np.arange(count)
    coefficients = (order + 0.5)[:, None] * (legendre.legvander(x, count - 1) * weights[:, None]).T
    return x, np.asarray(legendre.legint(coefficients, lbnd=-1), dtype=np.float64)


def _settle(
    plan: Plan,
    begin: tuple[float, FloatArray, FloatArray],
    end: float,
    guess: tuple[FloatArray, FloatArray],
    count: int,
) -> Arc | None:
    """Integrate the rates at the points again and again until nothing changes."""
    t, q, u = begin
    x, integral = _points(count)
    half = 0.5 * (end - t)
    times, reach = t + half * (x + 1.0), legendre.legvander(x, count)
    last = np.inf
    (places, speeds) = guess
    for _ in range(_SWEEPS):
        rates, accelerations = _rates(plan, times, places, speeds)
        moved, turned = half * (integral @ rates.T), half * (integral @ accelerations.T)
        moved[0] += q
        turned[0] += u
        now = (reach @ moved).T, (reach @ turned).T
        change = _size(plan, now[0] - places, now[1] - speeds)
        places, speeds = now
        if not np.isfinite(change) or change > 1e3:
            return None
        if change < _SETTLED or (change < _ROUNDED and change >= 0.5 * last):
            return Arc(t, end, moved, turned, change)
        last = change
    return None


def _rates(plan: Plan, t: FloatArray, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of coordinates and speeds at states near the constraints."""
    made = project_states(plan, t, q, u)
    q, u = made.coordinates, made.speeds
    for i in np.flatnonzero(made.doubtful | ~np.all(np.isfinite(q), axis=0) | ~np.all(np.isfinite(u), axis=0)):
        q[:, i], u[:, i] = project_safely(plan, float(t[i]), q[:, i], u[:, i])
    kept = np.asarray(plan.finding.kept, dtype=np.intp)
    accelerations = accelerations_and_multipliers(plan.assembly, plan.assembly.form, t, q, u, kept)[0]
    turning = plan.balance.turning
    if turning.is_plain:
        return u, accelerations
    return np.stack([turning.rates(float(t[i]), q[:, i], u[:, i]) for i in range(len(t))], axis=1), accelerations


def _size(plan: Plan, q: FloatArray, u: FloatArray) -> float:
    """Return the size of a difference of states, relative to the scene's sizes."""
    places = np.max(np.abs(q) / plan.coordinate_sizes[:, None], initial=0.0)
    return float(max(places, np.max(np.abs(u) * plan.scales.time / plan.sizes[:, None], initial=0.0)))
