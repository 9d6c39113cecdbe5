"""Angles and rates near where they mean nothing: at the poles of polar coordinates.

There an angle is zero and its rate has no value, whichever way the state came there: what rounding leaves of a distance
that is zero would give one form an angle and the other none.
"""

from __future__ import annotations

from atwood import Scalar, atan2, select

__all__ = ["angle_off_pole", "rate_off_pole"]

NEARNESS = 1e-20
"""Square of the distance from a pole, over the size, below which it is taken to be zero: 1e-10 rad."""


def angle_off_pole(across: Scalar, along: Scalar, size: Scalar = 1.0) -> Scalar:
    """Return ``atan2(across, along)``, rad; at the pole it is zero, and has a derivative by `across`.

    Parameters
    ----------
    across, along
        Sine and cosine of the angle times the distance from the pole.
    size
        What the distance is compared with.
    """
    square = across * across + along * along
    return atan2(across, select(square > NEARNESS * size * size, along, size))


def rate_off_pole(numerator: Scalar, denominator: Scalar, square: Scalar, size: Scalar = 1.0) -> Scalar:
    """Return a quotient, which has no value (nan) at the pole.

    Parameters
    ----------
    numerator, denominator
        Of a rate; the denominator vanishes at the pole.
    square
        Square of the distance from the pole.
    size
        What the distance is compared with.
    """
    off = select(square > NEARNESS * size * size, 1.0, 0.0)
    return (numerator * off) / (denominator * off)
