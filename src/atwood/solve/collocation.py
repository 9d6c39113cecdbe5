"""A stretch of a motion as polynomials of time, found where single steps cannot go.

The polynomials fulfil the equations at the points of Gauss and Legendre, none of which lies in the middle of the
stretch or at its ends (E. Hairer, S. P. Norsett and G. Wanner, *Solving Ordinary Differential Equations I*, section
II.7). So they pass smoothly over a place in the middle where the equations determine nothing. They are found by
repeated integration, with each state projected onto the constraints before forces are asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from atwood.errors import AtwoodError
from atwood.solve.driver import FloatArray
from atwood.solve.problem import Plan
from atwood.solve.projection import project_safely, project_states
from atwood.solve.reactions import accelerations_and_multipliers

__all__ = ["Arc", "Path", "find_arc", "follow"]

_POINTS, _FEWER = 12, 10
"""Of the polynomials, and of those that they are compared with."""

_SWEEPS = 60
_PATIENCE = 8
"""In so many sweeps changes must become clearly smaller."""

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


@dataclass(frozen=True, eq=False)
class Path:
    """A motion as arcs, each beginning where the one before ends."""

    arcs: tuple[Arc, ...]

    @property
    def start(self) -> float:
        """When it begins, s."""
        return self.arcs[0].start

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.arcs[-1].end

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return coordinates, speeds and accelerations at times, each of shape (number, times)."""
        t = np.asarray(t, dtype=float)
        if len(self.arcs) == 1:
            return self.arcs[0].at(t)
        which = np.clip(np.searchsorted([one.start for one in self.arcs], t, side="right") - 1, 0, None)
        shapes = (self.arcs[0].coordinates.shape[1], self.arcs[0].speeds.shape[1], self.arcs[0].speeds.shape[1])
        found = tuple(np.zeros((number, len(t))) for number in shapes)
        for i in np.unique(which):
            for all_of, some in zip(found, self.arcs[i].at(t[which == i]), strict=True):
                all_of[:, which == i] = some
        return found[0], found[1], found[2]


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
    last, sizes = np.inf, []
    places, speeds = guess
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
        sizes.append(change)
        if len(sizes) > _PATIENCE and change > 0.3 * sizes[-_PATIENCE] and change > _ROUNDED:
            return None
        if change < _SETTLED or (change < _ROUNDED and change >= 0.5 * last):
            return Arc(t, end, moved, turned, change)
        last = change
    return None


def _rates(plan: Plan, t: FloatArray, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of coordinates and speeds at states near the constraints."""
    if plan.balance.constraints:
        made = project_states(plan, t, q, u)
        q, u = made.coordinates, made.speeds
        bad = made.doubtful | ~np.all(np.isfinite(q), axis=0) | ~np.all(np.isfinite(u), axis=0)
        for i in np.flatnonzero(bad):
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


_SMALLEST = 1e-9
"""Arcs of this length, relative to the whole, are not tried."""

_TRIES, _FEWEST, _WORK = 600, 60, 60_000
"""So many arcs are tried, fewer where there are many unknowns: so many divided by their number."""

_NOISE, _LOUDEST = 1e-13, 2e-7
"""Rounding, which grows with how near a singular position is, and where it hides which way a motion goes on."""


def follow(
    plan: Plan,
    state: tuple[float, FloatArray, FloatArray],
    end: float,
    tolerance: float,
    measure: Callable[[FloatArray, FloatArray], FloatArray],
) -> Path | None:
    """Return how a motion goes on past a singular position that it comes close to; None if it cannot be followed.

    Arcs become so short that none of them leaps over what it should turn away from: a measure of how near the position
    is falls on none of them to less than a half.

    Parameters
    ----------
    plan
        The scene in its mode.
    state
        Time, coordinates and speeds, which fulfil the constraints.
    end
        When the path is to end.
    tolerance
        The error of an arc, relative to the scene's sizes, where rounding leaves room for it.
    measure
        Gives the measure at times and places.
    """
    t, q, u = state
    whole, arcs = end - t, []
    h = 0.25 * whole
    far = here = float(measure(np.array([t]), q[:, None])[0])
    x = _points(_POINTS)[0]
    for _ in range(int(np.clip(_WORK / plan.program.size, _FEWEST, _TRIES))):
        h = min(h, end - t)
        arc = find_arc(plan, t, q, u, t + h)
        noise = _NOISE * far / here
        if noise > _LOUDEST:
            return None
        if arc is not None and arc.error < max(tolerance, noise):
            times = np.append(t + 0.5 * h * (x + 1.0), arc.end)
            away = measure(times, arc.at(times)[0])
            if np.min(away) >= 0.5 * here:
                arcs.append(arc)
                if arc.end >= end:
                    return Path(tuple(arcs))
                q, u, _ = (one[:, 0] for one in arc.at(np.array([arc.end])))
                q, u = project_safely(plan, arc.end, q, u)
                t, here, h = arc.end, float(away[-1]), 1.6 * h
                continue
        h *= 0.4
        if h < _SMALLEST * whole:
            return None
    return None
