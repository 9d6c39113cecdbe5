"""The rotation vector between two frames, as a smooth function of their axes."""

from __future__ import annotations

import math

from atwood import Frame, Scalar, Vector, dot, sqrt

__all__ = ["half_turn_margin", "rotation_vector"]

_ARCTANGENT = tuple((-1.0) ** k / (2 * k + 1) for k in range(12))
"""Coefficients of ``atan(y)/y`` in ``y^2``; up to y = tan(pi/16) what is left out is below rounding."""

_NEARLY_HALF_A_TURN = 4.0 * math.cos(0.4995 * math.pi) ** 2


def rotation_vector(a: Frame, b: Frame) -> Vector:
    """Return the rotation vector of frame b from frame a, rad: along the axis of the rotation, as long as its angle.

    It has the same components in both frames. With the rotation's matrix ``R`` and angle theta, the quaternion is
    ``cos(theta/2) = sqrt(1 + tr R)/2`` and ``n sin(theta/2) = vee(R - R^T)/(4 cos(theta/2))`` (Goldstein, section 4.5).
    The half angle is then halved three times by ``tan(x/2) = tan x / (1 + sqrt(1 + tan^2 x))``, and the series of the
    arctangent gives the angle: no step is singular, or divides by something small, below half a turn.

    Parameters
    ----------
    a, b
        The frames.
    """
    (a1, a2, a3), (b1, b2, b3) = a.axes, b.axes
    twice = sqrt(_four_cosines(a, b))  # 2 cos(theta/2)
    sines = Vector(
        dot(a3, b2) - dot(a2, b3),
        dot(a1, b3) - dot(a3, b1),
        dot(a2, b1) - dot(a1, b2),
    )  # 4 n cos(theta/2) sin(theta/2)
    y: Vector = sines / (twice * (twice + 2.0))  # n tan(theta/4)
    for _ in range(2):
        y = y / (1.0 + sqrt(1.0 + dot(y, y)))
    square = dot(y, y)
    series: Scalar = _ARCTANGENT[-1]
    for coefficient in reversed(_ARCTANGENT[:-1]):
        series = series * square + coefficient
    found: Vector = y * (16.0 * series)
    return found


def half_turn_margin(a: Frame, b: Frame) -> Scalar:
    """Return how far the rotation of frame b from frame a is from half a turn: zero a thousandth before it."""
    return _four_cosines(a, b) - _NEARLY_HALF_A_TURN


def _four_cosines(a: Frame, b: Frame) -> Scalar:
    """Return ``4 cos^2(theta/2)``, which is one more than the trace."""
    (a1, a2, a3), (b1, b2, b3) = a.axes, b.axes
    return 1.0 + dot(a1, b1) + dot(a2, b2) + dot(a3, b3)
