"""Ropes that hold nothing for a while: when, and how they hang then."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.result.result import Result

__all__ = ["hanging", "pulling"]


def pulling(result: Result, part: str) -> NDArray[np.bool_]:
    """Return at which output times a rope has a law in its mode: slack, or let go, it has none.

    Parameters
    ----------
    result
        The run.
    part
        Path of the rope.
    """
    pieces = []
    for segment in result.run.segments:
        local = segment.assembly.mechanism.locals_[part]
        acts = bool(local.constraints or local.joints or local.potentials)
        pieces.append(np.full(len(segment.time), acts)[segment.shown])
    return np.concatenate(pieces)


def hanging(ends: FloatArray, spare: float) -> FloatArray:
    """Return a slack rope as a parabola, about as much longer than the straight way as it has to spare.

    Parameters
    ----------
    ends
        Both ends on the page, m, shape (2, 2).
    spare
        By how much it is longer than the way between them, m.
    """
    share = np.linspace(0.0, 1.0, 41)[:, None]
    sag = np.sqrt(0.375 * spare * (float(np.linalg.norm(ends[1] - ends[0])) + 0.5 * spare))
    line: FloatArray = ends[0] + share * (ends[1] - ends[0]) - np.array([0.0, 4.0 * sag]) * share * (1.0 - share)
    return line
