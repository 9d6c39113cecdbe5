"""Event functions that come near zero between two points of a solution: what tangents say, and where to look.

A function that is convex between two points lies above its tangents there.  If each tangent keeps the sign up to the
middle, so does the function.  Where one does not, the function is read between, at the least value of the cubic through
both points with these slopes (Hermite), and both parts are judged in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt

from atwood.codegen.tangents import FULL, STEEP
from atwood.lazy_dataclasses import dataclass

_HALF = 0.5
_MOST = 200
"""A step is read at no more places than these: what then is left is a touch, not a passage."""

_SHORTEST = 1e-6
"""Parts of a step that are shorter than this share are not divided: there the depth is rounding."""


@dataclass(frozen=True, eq=False)
class Point:
    """Event functions and their rates of change along the solution at a time."""

    time: float
    values: Sequence[float]
    slopes: Sequence[float]


def may_dip(first: Point, last: Point, signs: Sequence[float], share: float = FULL) -> list[bool]:
    """Return which functions may lose the sign between two points at both of which they have it."""
    width = last.time - first.time
    return [
        sign != 0.0 and _may(sign * a, sign * b, sign * down * width, sign * up * width, share)
        for a, b, down, up, sign in zip(first.values, last.values, first.slopes, last.slopes, signs, strict=True)
    ]


def _may(a: float, b: float, down: float, up: float, share: float) -> bool:
    if not (a > 0.0 and b > 0.0):
        return False
    return a + share * down <= 0.0 or b - share * up <= 0.0 or max(abs(down), abs(up)) > STEEP * max(a, b)


def find_dip(first: Point, last: Point, signs: Sequence[float], read: Callable[[float, float], Point]) -> float | None:
    """Return a time at which one of the functions has lost its sign between two points; None if none does."""
    shortest = _SHORTEST * (last.time - first.time)
    parts, count, share = [(first, last)], 0, FULL
    while parts and count < _MOST:
        a, b = parts.pop()
        width = b.time - a.time
        suspects = [i for i, may in enumerate(may_dip(a, b, signs, share)) if may]
        if not suspects or width <= shortest:
            continue
        lowest = min(_lowest(a, b, i, signs[i]) for i in suspects)
        point = read(a.time + lowest * width, width)
        if any(sign and sign * value <= 0.0 for sign, value in zip(signs, point.values, strict=True)):
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
