"""Curves: whether they are smooth where a point may go."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

from atwood import AtwoodError, ParameterError

__all__ = ["check_curve"]

_SAMPLES = 2000
_REACH = 100.0
"""rad. A curve without ends is looked at so far either way."""


def check_curve(curve: Any, lower: float | None, upper: float | None, where: str) -> None:
    """Refuse a curve that jumps, has a corner or stands still between its ends.

    Parameters
    ----------
    curve
        A function of the parameter whose value is a vector.
    lower, upper
        Its ends; None where it goes on.
    where
        The path of the parameter, for the error.

    Raises
    ------
    ParameterError
        If it does; the error says where.
    """
    if lower is not None and upper is not None and lower >= upper:
        raise ParameterError(f"its upper end {upper:g} is not beyond its lower end {lower:g}", where=where)
    said = _roughness(curve, lower, upper)
    if said:
        raise ParameterError(
            said,
            where=where,
            advice="Give a curve that is smooth where the point goes; lower_end and upper_end say how far that is.",
        )


@lru_cache(maxsize=64)
def _roughness(curve: Any, lower: float | None, upper: float | None) -> str:
    """Return what makes a curve no smooth one; empty if nothing does."""
    low = lower if lower is not None else min(-_REACH, (upper or 0.0) - _REACH)
    high = upper if upper is not None else max(_REACH, (lower or 0.0) + _REACH)
    slope = curve.derivative("p")

    def size(p: float) -> float:
        try:
            return math.hypot(*slope(p))
        except (AtwoodError, ArithmeticError, ValueError):
            return math.nan

    inside = [low + (high - low) * (i + 0.5) / _SAMPLES for i in range(_SAMPLES)]
    sizes = [size(p) for p in inside]
    largest = max((one for one in sizes if math.isfinite(one)), default=0.0)
    for i in range(1, _SAMPLES - 1):
        if sizes[i] <= sizes[i - 1] and sizes[i] <= sizes[i + 1] and sizes[i] < 0.2 * largest:
            p = _lowest(size, inside[i - 1], inside[i + 1])
            if size(p) < 1e-6 * largest:
                return f"the curve has a cusp at p = {p:.6g}, where its tangent is zero"
    for p in _corners(curve, inside):
        step = 1e-7 * max(1.0, abs(p))
        before, after = ([float(c) for c in curve(p + side * step)] for side in (-1.0, 1.0))
        if math.dist(before, after) > 1e-4 * max(largest, 1.0):
            return f"the curve jumps at p = {p:.6g}"
        before, after = ([float(c) for c in slope(p + side * step)] for side in (-1.0, 1.0))
        if math.dist(before, after) > 1e-4 * largest:
            return f"the curve has a corner at p = {p:.6g}"
    return ""


def _lowest(function: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function is least between two places, by thirds."""
    for _ in range(80):
        first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, second) if function(first) <= function(second) else (first, high)
    return 0.5 * (low + high)


def _corners(curve: Any, places: list[float]) -> Iterator[float]:
    """Yield where what a curve's choices compare changes its sign."""
    for switch in curve.corners():
        values = [float(switch(p)) for p in places]
        for low, high, before, after in zip(places, places[1:], values, values[1:], strict=False):
            if before == 0.0:
                yield low
            if before * after >= 0.0:
                continue
            for _ in range(60):
                middle = 0.5 * (low + high)
                if float(switch(middle)) * before > 0.0:
                    low = middle
                else:
                    high = middle
            yield round(0.5 * (low + high), 12) + 0.0
