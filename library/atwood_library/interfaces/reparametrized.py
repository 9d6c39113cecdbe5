"""reparametrized: a curve by its arc length, or by one of its coordinates, instead of its own parameter."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from atwood import ParameterError, Scalar, Vector, cos, sin
from atwood_library.joints.point_on_curve import PointOnCurve

__all__ = ["reparametrized"]

_DEGREES = (16, 32, 64, 128, 256, 384)
_ROUNDING = 2e-13
_CLOSED = 1e-9

Array = NDArray[np.float64]


def reparametrized(curve: Any, lower: float, upper: float, by: str = "arc length") -> Callable[[Scalar], Vector]:
    """Return the same curve as a function of its arc length, or of a coordinate, for joints on curves.

    ``PointOnCurve(curve=reparametrized(("p", 0, "p**2/2"), -3, 3))`` has the arc length for its coordinate, which is
    zero where p is, if that lies between the ends, and else at the lower end. Arc length and coordinates are in units
    of the joint's `scale`. The inverse function is a sum of Chebyshev polynomials, or of a Fourier series where the
    curve comes round between its ends, to rounding; the arc length of a closed curve goes on counting.

    Parameters
    ----------
    curve
        As for `PointOnCurve`: three functions of p.
    lower, upper
        Between which parameters p; beyond these the curve is not known, unless it is closed.
    by
        ``"arc length"``, ``"x"``, ``"y"`` or ``"z"``.

    Raises
    ------
    ParameterError
        If the curve is not smooth there, or a coordinate does not grow, or fall, all the way.
    """
    where = "reparametrized"
    if by not in ("arc length", "x", "y", "z"):
        raise ParameterError(f"{by!r} is no coordinate of a curve", where=where, advice="arc length, x, y or z.")
    if not lower < upper:
        raise ParameterError(f"its upper end {upper:g} is not beyond its lower end {lower:g}", where=where)
    part = PointOnCurve(curve=curve, lower_end=lower, upper_end=upper)
    part.check_values()
    own = part.curve
    slope = own.derivative("p")

    def rate(p: float) -> float:
        tangent = slope(p)
        return math.hypot(*tangent) if by == "arc length" else float(tangent["xyz".index(by)])

    speed = _resolved(lambda places: np.array([rate(float(p)) for p in places]), lower, upper, where)
    zero = 0.0 if lower <= 0.0 <= upper else lower
    begin = 0.0 if by == "arc length" else float(own(zero)["xyz".index(by)])
    length: Array = np.asarray(chebyshev.chebint(speed, scl=0.5 * (upper - lower)), dtype=float)
    at_zero = float(_at(length, zero, lower, upper))

    def covered(p: Array) -> Array:
        return begin + _at(length, p, lower, upper) - at_zero

    first, last = (float(covered(np.array(p))) for p in (lower, upper))
    samples = np.array([rate(float(p)) for p in np.linspace(lower, upper, 400)])
    if np.min(np.abs(samples)) < 1e-6 * np.max(np.abs(samples)) or np.ptp(np.sign(samples)) > 0.0:
        raise ParameterError(
            f"{by} does not grow, or fall, all the way from p = {lower:g} to {upper:g}",
            where=where,
            advice="Give ends between which it does, or take the arc length.",
        )

    def inverse(s: Array) -> Array:
        p = lower + (upper - lower) * (s - first) / (last - first)
        for _ in range(60):
            step = (covered(p) - s) / _at(speed, p, lower, upper)
            p = np.clip(p - step, lower - 1e-9, upper + 1e-9)
            if np.max(np.abs(step)) <= 4e-16 * (upper - lower):
                break
        return p

    if by == "arc length" and _is_closed(own, lower, upper):
        waves = _waves(inverse, first, last, where)
        return lambda p: own(_on_circle(waves, (p - first) / (last - first), lower, upper))
    low, high = min(first, last), max(first, last)
    series = [float(c) for c in _resolved(inverse, low, high, where)]
    return lambda p: own(_clenshaw(series, (2.0 * p - (low + high)) / (high - low)))


def _resolved(function: Callable[[Array], Array], lower: float, upper: float, where: str) -> Array:
    """Return the Chebyshev coefficients of a function between two places, as many as rounding lets be known."""

    def on_unit(x: Any) -> Any:
        return function(lower + 0.5 * (upper - lower) * (1.0 + x))

    for degree in _DEGREES:
        found = chebyshev.chebinterpolate(on_unit, degree)
        size = float(np.max(np.abs(found)))
        if np.max(np.abs(found[-4:])) <= _ROUNDING * size:
            kept = np.flatnonzero(np.abs(found) > 1e-15 * size)
            return np.asarray(found[: int(kept[-1]) + 1 if len(kept) else 1], dtype=float)
    raise ParameterError(
        "the curve bends too sharply between its ends for one series", where=where, advice="Give nearer ends."
    )


def _at(series: Array, p: Any, lower: float, upper: float) -> Array:
    """Return a series at places between its ends."""
    return np.asarray(chebyshev.chebval((2.0 * p - (lower + upper)) / (upper - lower), series))


def _is_closed(curve: Any, lower: float, upper: float) -> bool:
    """Return whether a curve comes round between its ends: to the same place, in the same direction."""
    for function in (curve, curve.derivative("p"), curve.derivative("p").derivative("p")):
        one, other = ([float(c) for c in function(p)] for p in (lower, upper))
        if math.dist(one, other) > _CLOSED * (1.0 + math.hypot(*one)):
            return False
    return True


def _waves(inverse: Callable[[Array], Array], first: float, last: float, where: str) -> list[tuple[float, float]]:
    """Return cosine and sine coefficients of how the parameter of a closed curve is ahead of an even motion."""
    for count in _DEGREES:
        share = np.arange(2 * count) / (2 * count)
        p = inverse(first + (last - first) * share)
        whole = inverse(np.array([first, last]))
        ahead = (p - whole[0]) / (whole[1] - whole[0]) - share
        found = np.fft.rfft(ahead) / (2 * count)
        if np.max(np.abs(found[-4:])) <= _ROUNDING:
            kept = np.flatnonzero(np.abs(found) > 1e-16)
            top = int(kept[-1]) + 1 if len(kept) else 1
            return [(float(found[0].real), 0.0)] + [(2.0 * float(c.real), -2.0 * float(c.imag)) for c in found[1:top]]
    raise ParameterError("the curve bends too sharply for one series", where=where, advice="Give it without ends.")


def _on_circle(waves: list[tuple[float, float]], share: Scalar, lower: float, upper: float) -> Scalar:
    """Return the parameter at a share of the length of a closed curve."""
    ahead: Scalar = waves[0][0] + share
    for number, (c, s) in enumerate(waves[1:], start=1):
        angle = 2.0 * math.pi * number * share
        ahead = ahead + c * cos(angle) + s * sin(angle)
    return lower + (upper - lower) * ahead


def _clenshaw(series: list[float], x: Scalar) -> Scalar:
    """Return a sum of Chebyshev polynomials, by Clenshaw's recurrence."""
    later: Scalar = 0.0
    latest: Scalar = 0.0
    for one in reversed(series[1:]):
        later, latest = one + 2.0 * x * later - latest, later
    return series[0] + x * later - latest
