"""What mass, centre and inertia of a body must fulfil, and what is said where they do not."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from atwood.arguments import real, show
from atwood.arrays import FloatArray
from atwood.errors import ParameterError

__all__ = ["checked_array", "checked_number", "checked_rotation", "symmetric_part", "verify_moments"]


_SYMMETRY = 1e-9
"""How far opposite elements of an inertia may be apart, relative to its largest one."""

_PHYSICAL = 1e-5
"""How far moments may be from what a body can have, relative to the largest one: six printed digits of a thin plate,
whose greatest moment is exactly the sum of the other two, must pass."""

_ROTATION = 1e-9
"""How far the product of a rotation matrix with its transpose may be from the unit matrix."""


def verify_moments(inertia: FloatArray) -> FloatArray:
    """Return a tensor that a body can have, or raise an error where its principal moments are not.

    A principal moment that is negative by what printed digits leave (a needle's) becomes zero: motion about such an
    axis would have a negative energy.
    """
    moments, axes = np.linalg.eigh(inertia)
    allowed = _PHYSICAL * float(np.max(np.abs(moments)))
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if moments[0] < -allowed:
        raise ParameterError(
            f"the inertia has a negative principal moment: its principal moments are {listed} kg m^2",
            advice=_advice(inertia, "No axis of a body has a negative moment of inertia."),
        )
    excess = moments[2] - moments[0] - moments[1]
    if excess > allowed:
        raise ParameterError(
            f"no body has the principal moments {listed} kg m^2: the largest, {moments[2]:.6g}, is greater than the "
            f"sum of the other two, {moments[0] + moments[1]:.6g}",
            advice=_advice(inertia, "Each moment of inertia must be at most the sum of the other two."),
        )
    if moments[0] >= -1e-14 * moments[2]:
        return inertia
    mended: FloatArray = (axes * np.maximum(moments, 0.0)) @ axes.T
    return symmetric_part(mended)


def _advice(inertia: FloatArray, rule: str) -> str:
    """Return the rule that is broken, and whether opposite signs of the products of inertia would mend it."""
    flipped = 2 * np.diag(np.diag(inertia)) - inertia
    moments = np.linalg.eigvalsh(flipped)
    allowed = _PHYSICAL * float(np.max(np.abs(moments)))
    if np.any(flipped != inertia) and moments[0] >= -allowed and moments[2] - moments[0] - moments[1] <= allowed:
        return (
            f"{rule} With the opposite signs off the diagonal it would be a body's: these elements are minus the "
            f"products of inertia."
        )
    return rule


def symmetric_part(inertia: FloatArray) -> FloatArray:
    """Return the symmetric part of a tensor that is symmetric but for rounding."""
    gap = np.abs(inertia - inertia.T)
    row, column = np.unravel_index(int(np.argmax(gap)), gap.shape)
    if gap[row, column] > _SYMMETRY * float(np.max(np.abs(inertia))):
        names = "xyz"
        raise ParameterError(
            f"the inertia is not symmetric: I_{names[row]}{names[column]} = {inertia[row, column]:.6g} and "
            f"I_{names[column]}{names[row]} = {inertia[column, row]:.6g} kg m^2",
            advice="Give the same value on both sides of the diagonal.",
        )
    return (inertia + inertia.T) / 2


def checked_rotation(value: ArrayLike) -> FloatArray:
    """Return a checked rotation matrix."""
    turn = checked_array(value, (3, 3), "rotation", "")
    if np.max(np.abs(turn @ turn.T - np.eye(3))) > _ROTATION:
        raise ParameterError(
            "the rotation is not one: its columns are not unit vectors at right angles",
            advice="Give a matrix whose columns are the axes of the body's frame.",
        )
    if np.linalg.det(turn) < 0:
        raise ParameterError("the rotation is a mirror image", advice="Give right-handed axes (determinant +1).")
    return turn


def checked_number(value: float, name: str, unit: str) -> float:
    """Return a finite number."""
    try:
        number = real(value)
    except Exception:  # a value of somebody else's class may raise anything
        raise ParameterError(f"the {name} is {show(value)}", advice=f"Give a number in {unit}.") from None
    if not math.isfinite(number):
        raise ParameterError(f"the {name} is {number}", advice=f"Give a finite number in {unit}.")
    return number


def checked_array(value: ArrayLike, shape: tuple[int, ...], name: str, unit: str) -> FloatArray:
    """Return an own copy of an array of finite numbers of a given shape."""
    try:
        array = np.array(value, dtype=float)
    except Exception:  # a value of somebody else's class may raise anything
        raise ParameterError(f"the {name} is {show(value)}", advice=f"Give numbers of shape {shape}.") from None
    if array.shape != shape:
        raise ParameterError(f"the {name} has shape {array.shape}", advice=f"Give numbers of shape {shape}.")
    if not np.all(np.isfinite(array)):
        unit_text = f" in {unit}" if unit else ""
        raise ParameterError(f"the {name} is not finite: {array.tolist()}", advice=f"Give finite numbers{unit_text}.")
    return array
