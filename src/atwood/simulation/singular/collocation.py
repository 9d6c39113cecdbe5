"""A stretch of a motion as polynomials of time, found where single steps cannot go.

The polynomials fulfil the equations at the points of Gauss and Legendre, none of which lies in the middle of the
stretch or at its ends (E. Hairer, S. P. Norsett and G. Wanner, *Solving Ordinary Differential Equations I*, section
II.7). So they pass smoothly over a place in the middle where the equations determine nothing. They are found by
repeated integration, with each state projected onto the constraints before forces are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.clock import check_time
from atwood.errors import AtwoodError
from atwood.integrators.protocol import CompiledRates
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.dynamics.reactions import accelerations_at
from atwood.simulation.problem.explicit_scene import compiled_on_constraints
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import ProjectedStates, nearly_projected, project_safely, project_states
from atwood.simulation.singular.arc_routine import (
    LAST,
    NOWHERE,
    PATIENCE,
    ROUNDED,
    SETTLED,
    SWEEPS,
    SWEPT,
    TOO_FAR,
    Sweeps,
)
from atwood.simulation.singular.crossing_routine import POINTS, singular_routines

States: TypeAlias = tuple[FloatArray, FloatArray]
"""Coordinates and speeds, each of shape (number, times)."""

State: TypeAlias = tuple[float, FloatArray, FloatArray]
"""A time, coordinates and speeds."""

_DERIVATIVE = legendre.legder(np.eye(POINTS + 1))
"""Gives coefficients of the derivative of a polynomial from its own."""

_CLOSE = 3e-2
"""Once a sweep changes less, one Newton step is enough to project what it gave."""


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
        each = _values(x, len(self.speeds)).T
        accelerations = (_DERIVATIVE @ self.speeds) * (2.0 / (self.end - self.start))
        return (each @ self.coordinates).T, (each @ self.speeds).T, (each[:, :-1] @ accelerations).T


def _values(x: FloatArray, count: int) -> FloatArray:
    """Return Legendre polynomials, one row each; NumPy's own function takes three times as long for few places."""
    found = np.ones((count, len(x)))
    found[1] = x
    for k in range(2, count):
        np.multiply(x, found[k - 1], out=found[k])
        found[k] += (1.0 - 1.0 / k) * (found[k] - found[k - 2])
    return found


def states_on(arcs: Sequence[Arc], t: FloatArray) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
    """Return which times are within one of some arcs in a row, and coordinates and speeds there."""
    starts, ends = (np.array([getattr(one, name) for one in arcs]) for name in ("start", "end"))
    which = starts.searchsorted(t) - 1
    inside = (which >= 0) & (t < ends[which])
    which = which[inside]
    each = _values((2.0 * t[inside] - starts[which] - ends[which]) / (ends - starts)[which], POINTS + 1)
    tables = (np.stack([getattr(one, name) for one in arcs])[which] for name in ("coordinates", "speeds"))
    q, u = (np.einsum("kt,tkn->nt", each, one) for one in tables)
    return inside, q, u


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


def find_arc(
    plan: SceneProblem,
    t: float,
    q: FloatArray,
    u: FloatArray,
    end: float,
    guess: Callable[[FloatArray], States | None] | None = None,
) -> Arc | None:
    """Return how a motion goes on from a state; None where no smooth motion is found."""
    x = points()[0]
    times = t + 0.5 * (end - t) * (x + 1.0)
    if not np.all(np.diff(times) > 0.0):  # too short for the digits of time
        return None
    try:
        with np.errstate(all="ignore"):
            known = None if guess is None else guess(times)
            begin = known or (np.repeat(q[:, None], POINTS, 1), np.repeat(u[:, None], POINTS, 1))
            return _settle(plan, (t, q, u), end, times, begin, known is None)
    except (AtwoodError, np.linalg.LinAlgError):  # a state without a value, or without accelerations: nothing goes on
        return None


@cache
def points() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the points, and the matrices that give coefficients of a polynomial and its integral from values there."""
    x, weights = legendre.leggauss(POINTS)
    order = np.arange(POINTS)
    coefficients = (order + 0.5)[:, None] * (legendre.legvander(x, POINTS - 1) * weights[:, None]).T
    return x, coefficients, np.asarray(legendre.legint(coefficients, lbnd=-1), dtype=np.float64)


_REACH = legendre.legvander(legendre.leggauss(POINTS)[0], POINTS)
"""Gives values at the points from coefficients."""


def _settle(
    plan: SceneProblem,
    begin: State,
    end: float,
    times: FloatArray,
    guess: States,
    is_far: bool,
) -> Arc | None:
    """Integrate the rates at the points again and again until nothing changes."""
    t, q, u = begin
    half, last, sizes = 0.5 * (end - t), np.inf, list[float]()
    states = np.ascontiguousarray(np.concatenate(guess).T)
    code = compiled_on_constraints(plan, t, np.concatenate([q, u])) if plan.has_rates else None
    if code is not None:
        sweeps = sweeps_of(plan, code, np.concatenate([q, u]), half, times, states)
        went = sweeps()
        if went == NOWHERE:
            return None
        if went == SWEPT:
            return Arc(t, end, sweeps.integrated[:, : len(q)], sweeps.integrated[:, len(q) :], sweeps.error)
    for _ in range(SWEEPS):
        check_time()
        integrated = _sweep(plan, begin, half, times, states, is_far)
        now = _REACH @ integrated
        change = _size(plan, *_parts(now - states, len(q)))
        states[:] = now
        if not change <= TOO_FAR:
            return None
        sizes.append(change)
        if len(sizes) > PATIENCE and change > 0.3 * sizes[-PATIENCE] and change > ROUNDED:
            return None
        left = change * change / last if last < np.inf else change  # what the next sweep would change, about
        if min(change, 10.0 * left) < SETTLED or (change < ROUNDED and change >= 0.5 * last):
            rest = _size(plan, *_parts(np.sum(np.abs(integrated[-LAST:]), axis=0)[None, :], len(q)))
            return Arc(t, end, integrated[:, : len(q)], integrated[:, len(q) :], max(min(change, left), rest))
        last, is_far = change, change > _CLOSE
    return None


def _parts(states: FloatArray, coordinates: int) -> States:
    """Return coordinates and speeds of states, one row each."""
    return states[:, :coordinates].T, states[:, coordinates:].T


def sweeps_of(
    plan: SceneProblem,
    code: CompiledRates,
    first: FloatArray,
    half: float,
    times: FloatArray,
    states: FloatArray,
    settled: float = SETTLED,
    accurate: float = np.inf,
) -> Sweeps:
    """Return sweeps by machine code, from coordinates and speeds at the start and guesses at the points."""
    sizes = np.concatenate([plan.coordinate_sizes, plan.sizes / plan.scales.time])
    arrays, kinematic_map = (times, points()[2], _REACH, first, states, sizes), plan.balance.kinematic_map
    settle = singular_routines().code.addresses["settle"]
    return Sweeps(code, arrays, half, len(plan.coordinate_sizes), kinematic_map.is_plain, settle, settled, accurate)


def _sweep(
    plan: SceneProblem, begin: State, half: float, times: FloatArray, states: FloatArray, is_far: bool
) -> FloatArray:
    """Return coefficients of coordinates and speeds from states at the points, one row each."""
    _, q, u = begin
    integral = points()[2]
    held = _projected(plan, times, *_parts(states, len(q)), is_far)
    kept, balance = np.asarray(plan.finding.kept, dtype=np.intp), plan.columns(plan.balance.program.program)
    accelerations = accelerations_at(
        plan.assembly, plan.assembly.form, times, held.coordinates, held.speeds, kept, balance
    )
    turned = half * (integral @ accelerations.T)
    turned[0] += u
    later = (_REACH @ turned).T  # known already, and twice as near as what the places would follow from
    rates = plan.balance.kinematic_map.rates_each(times, held.coordinates, held.hold(later))
    moved = half * (integral @ rates.T)
    moved[0] += q
    return np.concatenate([moved, turned], axis=1)


def _projected(plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray, is_far: bool) -> ProjectedStates:
    """Return states near the constraints, or at first far from them, that are projected onto these."""
    if not plan.balance.constraints:
        return ProjectedStates(q, u, lambda speeds: speeds)
    if not is_far:
        return nearly_projected(plan, t, q, u)
    made = project_states(plan, t, q, u)
    q, u = made.coordinates, made.speeds
    bad = made.doubtful | ~np.all(np.isfinite(q), axis=0) | ~np.all(np.isfinite(u), axis=0)
    for i in np.flatnonzero(bad):
        q[:, i], u[:, i] = project_safely(plan, float(t[i]), q[:, i], u[:, i])
    return ProjectedStates(q, u, lambda speeds: speeds)


def _size(plan: SceneProblem, q: FloatArray, u: FloatArray) -> float:
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
    plan: SceneProblem,
    state: State,
    end: float,
    tolerance: float,
    measure: Callable[[FloatArray, FloatArray], FloatArray],
) -> Path | None:
    """Return how a motion goes on past a singular position that it comes close to; None if it cannot be followed.

    Arcs become so short that none of them leaps over what it should turn away from: a measure of how near the position
    is falls on none of them to less than a half.
    """
    t, q, u = state
    whole, arcs = end - t, []
    h = 0.25 * whole
    far = here = float(measure(np.array([t]), q[:, None])[0])
    x = points()[0]
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
