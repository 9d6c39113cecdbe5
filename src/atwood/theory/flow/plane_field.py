"""Curves of a vector field in a plane: through points, spaced evenly, and into and out of saddles."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np
from scipy.stats import qmc

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy

Field: TypeAlias = Callable[[FloatArray], FloatArray]
"""Gives the rates at points, both of shape (points, 2)."""

_STEP = 1.0 / 150.0
"""Of a curve, relative to the window."""

_LONGEST = 8.0
"""A curve ends after so many widths of the window."""

_NEAR = 1e-3
"""Relative to the window: a curve that comes so near to a point of rest ends there."""

_ASIDE = 1e-4
"""Relative to the window: so far from a saddle its curves begin."""

_CANDIDATES, _ROUND, _ROUNDS = 512, 24, 5
"""Points that are tried for curves, those of one round at most, and rounds."""


@dataclass(frozen=True)
class Window:
    """A rectangle: the ranges of both quantities."""

    across: tuple[float, float]
    up: tuple[float, float]

    @property
    def size(self) -> FloatArray:
        """Width and height."""
        return np.array([self.across[1] - self.across[0], self.up[1] - self.up[0]])

    @property
    def corner(self) -> FloatArray:
        """The lower left corner."""
        return np.array([self.across[0], self.up[0]])


def curves_through(
    field: Field, points: FloatArray, window: Window, rest: FloatArray, both_ways: bool = True
) -> Iterator[FloatArray]:
    """Yield curves of a field through points, each until it leaves the window, closes, or comes to rest.

    They are followed by their length, by the classical Runge-Kutta method (Hairer, Norsett and Wanner, Solving ODEs I,
    section II.1).
    """
    size, corner = window.size, window.corner
    count = len(points)
    starts = (points - corner) / size
    still = (rest.reshape(-1, 2) - corner) / size
    if both_ways:
        starts, signs = np.concatenate([starts, starts]), np.repeat([1.0, -1.0], count)
    else:
        signs = np.repeat([1.0, -1.0], count // 2)

    def unit(at: FloatArray) -> FloatArray:
        rates = field(corner + at * size) / size * signs[alive, None]
        return np.asarray(rates / np.maximum(np.hypot(rates[:, :1], rates[:, 1:]), 1e-300))

    steps = int(_LONGEST / _STEP)
    paths = np.full((steps + 1, len(starts), 2), np.nan)
    paths[0] = starts
    alive, now = np.arange(len(starts)), starts.copy()
    closed = np.zeros(len(starts), dtype=bool)
    for k in range(steps):
        here = now[alive]
        a = unit(here)
        b = unit(here + 0.5 * _STEP * a)
        c = unit(here + 0.5 * _STEP * b)
        d = unit(here + _STEP * c)
        there = here + _STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        now[alive] = there
        paths[k + 1, alive] = there
        out = np.any((there < -0.01) | (there > 1.01), axis=1) | ~np.all(np.isfinite(there), axis=1)
        back = (np.linalg.norm(there - starts[alive], axis=1) < 1.01 * _STEP) & (k > 10)
        closed[alive[back]] = True
        at_rest = np.zeros(len(alive), dtype=bool)
        if len(still) and k > 10:
            at_rest = np.min(np.linalg.norm(there[:, None] - still, axis=2), axis=1) < max(_NEAR, 0.6 * _STEP)
        alive = alive[~(out | back | at_rest)]
        if not len(alive):
            break
    found = [path[np.all(np.isfinite(path), axis=1)] for path in np.swapaxes(paths, 0, 1)]
    for k in range(count):
        ahead = found[k]
        if closed[k]:
            ahead = np.concatenate([ahead, ahead[:1]])
        elif both_ways:
            ahead = np.concatenate([found[count + k][:0:-1], ahead])
        yield corner + ahead * size


def spaced_curves(
    field: Field, window: Window, rest: FloatArray, known: Sequence[FloatArray], spacing: float = 0.055
) -> Iterator[FloatArray]:
    """Yield curves that fill a window evenly.

    Each begins away from all others (in the manner of Jobard and Lefer, Visualization in Scientific Computing, 1997).
    """
    size, corner = window.size, window.corner
    candidates = qmc.Halton(2, scramble=False).random(_CANDIDATES + 1)[1:]
    taken = [(one - corner) / size for one in known] + [(rest.reshape(-1, 2) - corner) / size]
    for _ in range(_ROUNDS):
        candidates = candidates[_distance(candidates, np.concatenate(taken)) > spacing]
        chosen: list[FloatArray] = []
        for one in candidates:
            if len(chosen) < _ROUND and all(np.linalg.norm(one - other) > 2.0 * spacing for other in chosen):
                chosen.append(one)
        if not chosen:
            break
        for curve in curves_through(field, corner + np.array(chosen) * size, window, rest):
            own = (curve - corner) / size
            crowded = np.mean(_distance(own[::5], np.concatenate(taken)) < 0.5 * spacing)
            if len(own) > 5 and crowded < 0.3:
                yield curve
                taken.append(own)


def separatrices(
    field: Field, saddles: Sequence[tuple[FloatArray, FloatArray]], window: Window, rest: FloatArray
) -> list[FloatArray]:
    """Return the curves into and out of saddles."""
    size = window.size
    ahead, back = list[FloatArray](), list[FloatArray]()
    for place, matrix in saddles:
        values, vectors = np.linalg.eig(matrix / size[:, None] * size)
        for value, vector in zip(values.real, vectors.real.T, strict=True):
            for sign in (1.0, -1.0):
                begin = place + sign * _ASIDE * vector / np.linalg.norm(vector) * size
                (ahead if value > 0.0 else back).append(begin)
    if not ahead:
        return []
    found = curves_through(field, np.array([*ahead, *back]), window, rest, both_ways=False)
    return [curve[::-1] if k >= len(ahead) else curve for k, curve in enumerate(found)]


def _distance(points: FloatArray, others: FloatArray) -> FloatArray:
    """Return how far each point is from the nearest of some others."""
    if not len(others):
        return np.full(len(points), np.inf)
    return np.asarray(scipy.spatial.KDTree(others).query(points)[0])
