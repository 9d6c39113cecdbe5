"""Numbers of programs as those that were meant: fractions, multiples of pi, decimals."""

from __future__ import annotations

import math
from fractions import Fraction

from atwood.theory.formulas.tree import Number

__all__ = ["as_decimal", "as_fraction", "of_pi"]

_LARGEST_DENOMINATOR = 360
_NEAR = 1e-14
"""Relative: a few operations on fractions like 1/12 round by less."""


def as_fraction(value: float) -> Number:
    """Return a number as the small fraction that it is up to rounding, or as it is."""
    if not math.isfinite(value):
        return value
    fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
    near = abs(float(fraction) - value) <= _NEAR * abs(value)
    return fraction if near else value


def of_pi(value: float) -> Fraction | None:
    """Return a number as a fraction of pi, if it is one and no fraction itself."""
    turns = Fraction(value / math.pi).limit_denominator(180)
    if turns and abs(float(turns) * math.pi - value) <= _NEAR * abs(value):
        return turns
    return None


def as_decimal(value: float) -> Number:
    """Return a number without the digits that rounding made; a whole one as a fraction."""
    rounded = float(f"{value:.14g}")
    return Fraction(int(rounded)) if rounded.is_integer() and abs(rounded) < 1e9 else rounded
