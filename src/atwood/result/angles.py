"""Angles that count their turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["unwrap"]


def unwrap(values: NDArray[np.float64], start: float | None) -> NDArray[np.float64]:
    """Return an angle without jumps by whole turns.

    Parameters
    ----------
    values
        Samples, each within one turn, rad.
    start
        What the angle was said to be at the start, which fixes the number of whole turns; none if not given.
    """
    if not len(values):
        return values
    smooth: NDArray[np.float64] = np.unwrap(values)
    if start is not None:
        smooth = smooth + 2.0 * np.pi * np.round((start - smooth[0]) / (2.0 * np.pi))
    return smooth
