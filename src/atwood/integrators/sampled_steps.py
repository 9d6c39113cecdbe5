"""Steps judged by samples, where what could be passed over is a function in Python of which nothing else is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from atwood.arrays import FloatArray
from atwood.integrators.compiled_functions import StepGuard

SAMPLES = 16
"""Into so many parts a step is divided where functions of the motion are looked at."""

GRID = 20_000
"""Into so many parts a run is divided where functions of time alone are looked at."""

_LONGEST = 4.0
"""A step may be so many times as long as the root of what a function changes by in all over its second derivative."""

_SHORTEST = 1e-9
"""Relative to the run: shorter steps are not judged, so that a function may jump."""


class SampledSteps:
    """Judges steps by samples of functions, and by another guard if there is one.

    Parameters
    ----------
    timed
        ``timed(t)``: the functions of time alone.
    moving
        ``moving(t, y)``: the functions of the motion.
    span
        The times of the run, s.
    other
        What else judges steps.
    """

    def __init__(
        self,
        timed: Callable[[float], FloatArray],
        moving: Callable[[float, FloatArray], FloatArray],
        span: tuple[float, float],
        other: StepGuard | None = None,
    ) -> None:
        self._moving, self._other = moving, other
        self._least = self._most = np.zeros(0)
        self._shortest = _SHORTEST * (span[1] - span[0])
        times = np.linspace(*span, GRID + 1)
        first = timed(span[0])
        rows = np.array([timed(t) for t in times.tolist()]) if len(first) else np.zeros((len(times), 0))
        self._times, self._allowed = times, np.full(GRID + 1, np.inf)
        if rows.size:
            longest = np.min(_allowed(rows, np.ptp(rows, axis=0)), axis=1) * (times[1] - times[0])
            self._allowed[1:-1] = longest

    def guard(self) -> StepGuard:
        """Return what a method is given; it has no compiled function."""
        return StepGuard(0, 0, self.passes, self)

    def passes(self, t0: float, y0: FloatArray, p0: FloatArray, t1: float, y1: FloatArray, p1: FloatArray) -> bool:
        """Return whether a step is good: from time, values and rates at its beginning to those at its end."""
        h = t1 - t0
        if h <= self._shortest:
            return True
        if self._other is not None and not self._other.passes(t0, y0, p0, t1, y1, p1):
            return False
        first, last = np.searchsorted(self._times, (t0, t1))
        if h > np.min(self._allowed[max(0, first - 1) : last + 1], initial=np.inf):
            return False
        shares = np.linspace(0.0, 1.0, SAMPLES + 1)[:, None]
        rest = 1.0 - shares
        values = rest**2 * (1 + 2 * shares) * y0 + shares**2 * (3 - 2 * shares) * y1
        values = values + h * shares * rest * (rest * p0 - shares * p1)
        rows = np.array([self._moving(t0 + h * s, y) for s, y in zip(shares[:, 0].tolist(), values, strict=True)])
        if not rows.size:
            return True
        if not self._least.size:
            self._least, self._most = rows.min(axis=0), rows.max(axis=0)
        self._least, self._most = np.minimum(self._least, rows.min(axis=0)), np.maximum(self._most, rows.max(axis=0))
        return bool(np.all(_allowed(rows, self._most - self._least) >= SAMPLES))


def _allowed(rows: FloatArray, change: FloatArray) -> FloatArray:
    """Return how long a step may be about each inner sample, in distances of samples."""
    bend = np.abs(np.diff(rows, 2, axis=0))
    rounding = 1e-12 * np.max(np.abs(rows), axis=0)
    with np.errstate(all="ignore"):
        found = _LONGEST * np.sqrt(change / np.where(bend > rounding, bend, 0.0))
    return np.where(np.isfinite(found), found, np.inf)
