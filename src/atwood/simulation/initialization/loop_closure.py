"""Loops that Newton's method does not close from the guess: where else they close, or how near they come.

The method of Levenberg and Marquardt (Nocedal and Wright, Numerical Optimization, section 10.3) makes the sum of
squares of what is missed as small as it gets, from the rough place and from others around it. One of these is found
body by body, from the world outwards: Newton's method on all guesses together turns every joint of a chain at once, and
may settle where none of them is met, while what is said of a body depends on its own coordinates and on those of what
it hangs on, which are known by then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.matrices import LARGEST_FULL, least_norm, scaled, to_array
from atwood.simulation.dynamics.kinematic_map import KinematicMap, orientations
from atwood.simulation.dynamics.scales import is_length
from atwood.simulation.initialization.system import System

_SHIFTS = (0.1, 0.2, 0.3, 0.5, 0.5, 0.8, 0.8, 1.2, 1.2, 1.8, 1.8, 2.5, 2.5, 3.1, 3.1)
"""How far other places to begin from are, at most: rad, or shares of the scene's size."""

_ALIKE = 3
"""Where so many other places lead to what was found first, no more are tried."""


@dataclass(frozen=True)
class Nearest:
    """The place found that misses least.

    Attributes
    ----------
    coordinates
        The place.
    residual
        What is missed there, in the units of each row.
    size
        Root of the sum of squares, each over its unit.
    """

    coordinates: FloatArray
    residual: FloatArray
    size: float


def units_of_rows(assembly: Assembly, equations: Equations, system: System, length: float) -> FloatArray:
    """Return what counts as one in each row of a system: the scene's extent for what is missed in metres, else 1."""
    found = []
    for one in equations.constraints if system.constraints else ():
        if one.value is not None:
            found.append(length if is_length(equations, one.key) else 1.0)
    found += [length if target.observable.unit == "m" else 1.0 for target in system.targets]
    return np.array(found)


def closest(
    system: System, units: FloatArray, scales: FloatArray, t: float, q: FloatArray, iterations: int = 300
) -> Nearest:
    """Return the place near another one where the sum of squares of what is missed is least."""
    assert system.kinematic_map is not None
    still = np.zeros_like(scales)

    def look(place: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual, matrix = system.at(t, place, still)
        return residual / units, to_array(scaled(matrix, scales, units))

    residual, jacobian = look(q)
    cost = float(residual @ residual)
    damping, growth = 1e-3 * max(float(np.max(np.sum(jacobian**2, axis=0), initial=0.0)), 1e-12), 2.0
    for _ in range(iterations):
        gradient = jacobian.T @ residual
        if float(np.max(np.abs(gradient), initial=0.0)) <= 1e-14 * max(1.0, cost) or cost < 1e-30:
            break
        step = -np.linalg.solve(jacobian.T @ jacobian + damping * np.eye(len(scales)), gradient)
        longest = float(np.max(np.abs(step)))
        step *= min(1.0, 0.5 / longest) if longest > 0.5 else 1.0
        expected = -float(step @ gradient) - 0.5 * float(np.sum((jacobian @ step) ** 2))
        trial = system.kinematic_map.moved(t, q, scales * step)
        try:
            new_residual, new_jacobian = look(trial)
            new_cost = float(new_residual @ new_residual)
        except KernelEvaluationError:
            new_cost = np.inf
        gain = 0.5 * (cost - new_cost) / expected if expected > 0.0 else -1.0
        if new_cost < cost:
            is_done = longest < 1e-10 and cost - new_cost <= 1e-15 * cost
            q, residual, jacobian, cost = trial, new_residual, new_jacobian, new_cost
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            growth = 2.0
            if is_done:
                break
        else:
            if longest < 1e-12:
                break
            damping, growth = damping * growth, 2.0 * growth
    return Nearest(q, residual * units, cost**0.5)


def places_around(
    system: System, scales: FloatArray, t: float, q: FloatArray, hangs: bool = False
) -> Iterator[FloatArray]:
    """Yield a place and then others around it, the same ones each time, farther and farther away."""
    assert system.kinematic_map is not None
    random = np.random.default_rng(20)
    yield q
    if hangs:
        yield system.kinematic_map.moved(t, q, _lowered(system, scales))
    for size in _SHIFTS if len(scales) <= LARGEST_FULL else ():
        yield system.kinematic_map.moved(t, q, size * scales * random.uniform(-1.0, 1.0, len(scales)))


def _lowered(system: System, scales: FloatArray) -> FloatArray:
    """Return the displacement that lowers free points, each by a little more than the one before."""
    heights = [i for i, one in enumerate(system.speed_names) if one.endswith(".position.z'")]
    down = np.zeros(len(scales))
    down[heights] = -0.3 * (1.0 + np.arange(len(heights)) / max(len(heights), 1)) * scales[heights]
    return down


def closest_of_all(
    system: System,
    units: FloatArray,
    scales: FloatArray,
    t: float,
    q: FloatArray,
    is_enough: Callable[[Nearest], bool] = lambda nearest: nearest.size < 1e-12,
) -> Nearest | None:
    """Return the least of what `closest` finds from a place and from others around it; None if nothing has a value."""
    best: Nearest | None = None
    alike = 0
    for place in places_around(system, scales, t, q):
        try:
            found = closest(system, units, scales, t, place)
        except (KernelEvaluationError, np.linalg.LinAlgError):
            continue
        # Of places that miss alike the first is the nearest to the guess.
        if best is None or found.size < best.size * (1.0 - 1e-6) - 1e-13:
            best, alike = found, 0
        elif found.size < best.size * (1.0 + 1e-6) + 1e-13:
            alike += 1
        if is_enough(best) or alike == _ALIKE:
            break
    return best


IndexArray = NDArray[np.intp]


_TURNS = (0.0, 2.0, -2.0)
"""rad. From each of these Newton's method finds an angle that is a third of a turn away at most."""

_MET = 1e-20
"""Sum of squares of what is left of conditions on one body, in their sizes, where they are met."""

_TRIED = 3
"""From so many of the places that are roughly best the way is followed."""


@dataclass(frozen=True)
class _Said:
    """What is said of places: conditions, each in units of its size, at a time."""

    system: System
    weights: FloatArray
    time: float

    @property
    def kinematic_map(self) -> KinematicMap:
        assert self.system.kinematic_map is not None
        return self.system.kinematic_map

    def at(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual, matrix = self.system.at(self.time, q, np.zeros(self.system.speeds))
        return residual * self.weights, to_array(matrix) * self.weights[:, None]

    def misfit(self, q: FloatArray, rows: IndexArray) -> float:
        try:
            residual = self.at(q)[0][rows]
        except KernelEvaluationError:
            return np.inf
        return float(residual @ residual)


def placed_in_turn(equations: Equations, system: System, length: float, t: float, q: FloatArray) -> FloatArray:
    """Return coordinates that are found body by body."""
    rows, columns = np.asarray(system.rows, dtype=np.intp), np.asarray(system.columns, dtype=np.intp)
    last = np.full(system.shape[0], -1)
    np.maximum.at(last, rows, columns)
    units = np.array([length if one.observable.unit == "m" else 1.0 for one in system.targets])
    task, begin = _Said(system, 1.0 / units, t), 0
    for end in sorted({int(one) + 1 for one in last if one >= 0}):
        own = np.flatnonzero(last == end - 1)
        q = _placed(equations, task, q, np.arange(begin, end), own)
        begin = end
    return q


def _placed(equations: Equations, task: _Said, q: FloatArray, own: IndexArray, rows: IndexArray) -> FloatArray:
    """Return coordinates of which some are where some conditions are met as well as can be."""
    to_speeds = task.kinematic_map
    moving = own if to_speeds.is_plain else np.flatnonzero(np.any(to_speeds.matrix(task.time, q)[own] != 0.0, axis=0))
    trials = [(task.misfit(trial, rows), number, trial) for number, trial in enumerate(_trials(equations, q, own))]
    best, least = q, trials[0][0]
    for size, _, trial in sorted(trials, key=lambda one: one[:2])[:_TRIED]:
        found, size = _followed(task, trial, rows, moving, size)
        if size < 0.99 * least:
            best, least = found, size
        if least < _MET:
            break
    return best


def _trials(equations: Equations, q: FloatArray, own: IndexArray) -> Iterator[FloatArray]:
    """Yield coordinates of which some are at places that no other is far from; the given ones first."""
    yield q
    mine, of_orientations = set(own.tolist()), set[int]()
    for orientation in equations.orientation_coordinates:
        of_orientations.update(orientation.coordinates)
        if orientation.kind == "quaternion" and mine.issuperset(orientation.coordinates):
            for candidate in orientations():
                trial = q.copy()
                trial[list(orientation.coordinates)] = candidate
                yield trial
    angles = [i for i in sorted(mine - of_orientations) if equations.names[i].unit == "rad"][:3]
    for turns in list(product(_TURNS, repeat=len(angles)))[1:]:
        trial = q.copy()
        trial[angles] += turns
        yield trial


def _followed(
    task: _Said, q: FloatArray, rows: IndexArray, moving: IndexArray, size: float
) -> tuple[FloatArray, float]:
    """Return where the method of Gauss and Newton leads to, along some speeds, and what is left there."""
    for _ in range(20):
        if not _MET < size < np.inf:
            break
        residual, matrix = task.at(q)
        step = np.zeros(task.system.speeds)
        step[moving] = least_norm(matrix[np.ix_(rows, moving)], residual[rows])
        for _ in range(5):
            trial = task.kinematic_map.moved(task.time, q, -step)
            left = task.misfit(trial, rows)
            if left < size:
                break
            step *= 0.4
        else:
            break
        q, size = trial, left
    return q, size
