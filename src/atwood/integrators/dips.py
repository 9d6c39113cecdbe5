"""Event functions that come near zero between two points of a solution: what tangents say, and where to look.

A function that is convex between two points lies above its tangents there.  If each tangent keeps the sign up to the
middle, so does the function.  Where one does not, the function is read between, at the least value of the cubic through
both points with these slopes (Hermite), and both parts are judged in the same way.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np

from atwood.arrays import BoolArray
from atwood.codegen.tangents import FULL, STEEP
from atwood.integrators.protocol import FloatArray
from atwood.late import dataclass

__all__ = ["Point", "find_dip", "may_dip"]

_HALF = 0.5
_MOST = 200
"""A step is read at no more places than these: what then is left is a touch, not a passage."""

_SHORTEST = 1e-6
"""Parts of a step that are shorter than this share are not divided: there the depth is rounding."""


@dataclass(frozen=True, eq=False)
class Point:
    """Event functions and their rates of change along the solution at a time."""

    time: float
    values: FloatArray
    slopes: FloatArray


def may_dip(first: Point, last: Point, signs: FloatArray, share: float = FULL) -> BoolArray:
    """Return which functions may lose the sign between two points at both of which they have it.

    Parameters
    ----------
    first, last
        The points.
    signs
        The sign of each; zero for those that are not looked at.
    share
        Up to which share of the distance the tangents must keep the sign.
    """
    width = last.time - first.time
    with np.errstate(all="ignore"):
        a, b = signs * first.values, signs * last.values
        down, up = signs * first.slopes * width, signs * last.slopes * width
        falls = (a + share * down <= 0.0) | (b - share * up <= 0.0)
        steep = np.maximum(abs(down), abs(up)) > STEEP * np.maximum(a, b)
    found: BoolArray = (a > 0.0) & (b > 0.0) & (falls | steep)
    return found


def find_dip(first: Point, last: Point, signs: FloatArray, read: Callable[[float, float], Point]) -> float | None:
    """Return a time at which one of the functions has lost its sign between two points; None if none does.

    Parameters
    ----------
    first, last
        The points.
    signs
        The sign of each function; zero for those that are not looked at.
    read
        The point at a time, with slopes taken over a part of a distance.
    """
    shortest = _SHORTEST * (last.time - first.time)
    parts, count, share = [(first, last)], 0, FULL
    while parts and count < _MOST:
        a, b = parts.pop()
        width = b.time - a.time
        suspects = np.flatnonzero(may_dip(a, b, signs, share))
        if not len(suspects) or width <= shortest:
            continue
        lowest = min(_lowest(a, b, int(i), float(signs[i])) for i in suspects)
        point = read(a.time + lowest * width, width)
        if np.any((signs != 0.0) & (signs * point.values <= 0.0)):
            return point.time
        parts += [(point, b), (a, point)]
        count, share = count + 1, _HALF
    return None


def _lowest(a: Point, b: Point, i: int, sign: float) -> float:
    """Return where, as a share, the cubic of a function is least; the middle where it has no least value inside."""
    width = b.time - a.time
    down, up = (sign * float(one.slopes[i]) * width for one in (a, b))
    rise = sign * float(b.values[i] - a.values[i])
    square, linear = 3.0 * (down + up - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * down - up)
    inside = linear * linear - 4.0 * square * down
    below = linear + sqrt(inside) if inside >= 0.0 else 0.0
    share = -2.0 * down / below if below != 0.0 else 0.5
    return min(max(share, 1e-3), 1.0 - 1e-3) if 0.0 < share < 1.0 else 0.5
