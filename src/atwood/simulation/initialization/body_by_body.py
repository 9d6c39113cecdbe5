"""Where bodies are put by what is said of each: one after another, from the world outwards.

Newton's method on all guesses together turns every joint of a chain at once, and may settle where none of them is met.
What is said of a body depends on its own coordinates and on those of what it hangs on, which are known by then.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.matrices import to_array
from atwood.numerics.solutions import least_norm
from atwood.simulation.dynamics.kinematic_map import KinematicMap, orientations
from atwood.simulation.initialization.system import System

__all__ = ["placed_in_turn"]

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
    """Return coordinates that are found body by body.

    Parameters
    ----------
    equations
        The scene in generalized coordinates, in the order in which bodies are placed.
    system
        What is said, without constraints.
    length
        Extent of the scene, m.
    t, q
        Time, and where to begin.
    """
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
