"""Angles that count their turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["unwrap"]


def unwrap(
    values: NDArray[np.float64],
    start: float | None,
    time: NDArray[np.float64] | None = None,
    rate: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return an angle without jumps by whole turns.

    With its rate at the samples, also more than half a turn from sample to sample is counted.

    Parameters
    ----------
    values
        Samples, each within one turn, rad.
    start
        What the angle was said to be at the start, which fixes the number of whole turns; none if not given.
    time, rate
        Times of the samples and rate of the angle there; without them, what turns fast is counted wrong.
    """
    if not len(values):
        return values
    steps = np.diff(values)
    steps = np.where(np.isnan(steps), steps, np.remainder(steps + np.pi, 2.0 * np.pi) - np.pi)
    if time is not None and rate is not None:
        spans = np.diff(time)
        with np.errstate(invalid="ignore"):
            expected = 0.5 * (rate[1:] + rate[:-1]) * spans
            # Where the rate jumps, as near the pole of Euler angles, it says nothing of what lies between.
            is_steady = np.isfinite(expected) & (np.abs(np.diff(rate)) * spans < np.pi)
        steps = steps + 2.0 * np.pi * np.where(is_steady, np.round((expected - steps) / (2.0 * np.pi)), 0.0)
    smooth: NDArray[np.float64] = values[0] + np.concatenate([[0.0], np.cumsum(steps)])
    if start is not None:
        smooth = smooth + 2.0 * np.pi * np.round((start - smooth[0]) / (2.0 * np.pi))
    return smooth
