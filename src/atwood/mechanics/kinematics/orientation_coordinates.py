"""Orientations in space by quaternions or Euler angles: axes, quaternion, rates, and the distance from a singularity.

Euler angles are singular where the first and the third axis are parallel. They have a margin that rises through zero
well before.
"""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, Scalar
from atwood.mechanics.kinematics.orientation import (
    Quaternion,
    quaternion_axes,
    quaternion_product,
    quaternion_rates,
    rotation_quaternion,
)
from atwood.model.values.rotation import IDENTITY, Axes, Rotation, Turn, compose, from_axes, to_axes
from atwood.model.values.vector import Vector
from atwood.topology.orientation_coordinates import OrientationCoordinates

__all__ = [
    "BASES",
    "euler_spin",
    "orientation_axes",
    "orientation_margin",
    "orientation_quaternion",
    "orientation_rates",
]

BASES: tuple[Axes, Axes] = (IDENTITY, (IDENTITY[1], IDENTITY[2], IDENTITY[0]))
"""Axes that Euler angles are measured from, in the world's."""

_BASE_QUATERNIONS: tuple[Quaternion, Quaternion] = ((1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5))

FARTHEST_COSINE = 0.9
"""Largest cosine between the first and the third axis of Euler angles; from the other base it is at most 0.44."""


def orientation_axes(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Axes:
    """Return the axes of a body in the world's.

    Parameters
    ----------
    orientation
        Which coordinates they are.
    values
        Its coordinates.
    """
    if orientation.kind == "quaternion":
        return quaternion_axes(values)
    return compose(BASES[orientation.base], _turns(orientation, values).axes())


def orientation_quaternion(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Quaternion:
    """Return the quaternion of a body, of any size, scalar part first.

    Parameters
    ----------
    orientation, values
        See `orientation_axes`.
    """
    if orientation.kind == "quaternion":
        w, x, y, z = values
        return w, x, y, z
    return quaternion_product(_BASE_QUATERNIONS[orientation.base], rotation_quaternion(_turns(orientation, values)))


def orientation_rates(
    orientation: OrientationCoordinates, values: Sequence[Expression], spin: Sequence[Expression]
) -> list[Scalar]:
    """Return the derivatives of the coordinates of an orientation.

    Parameters
    ----------
    orientation, values
        See `orientation_axes`.
    spin
        Angular velocity in the axes of the body, rad/s.
    """
    if orientation.kind == "quaternion":
        return quaternion_rates(values, spin)
    return _euler_rates(orientation, values, Vector(*spin))


def orientation_margin(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Expression | None:
    """Return what rises through zero where the coordinates are to be switched; None if they are regular everywhere.

    Parameters
    ----------
    orientation, values
        See `orientation_axes`.
    """
    if orientation.is_homogeneous:
        return None
    first, _, third = orientation.turns
    along = values[1].graph.convert(_turns(orientation, values).axes()[third][first])
    return along * along - FARTHEST_COSINE**2


def _turns(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Rotation:
    return Rotation(tuple(Turn(IDENTITY[axis], angle) for axis, angle in zip(orientation.turns, values, strict=True)))


def _euler_rates(orientation: OrientationCoordinates, values: Sequence[Expression], spin: Vector) -> list[Scalar]:
    """Return the rates of Euler angles: the angular velocity seen before the third turn is solved for them.

    There it is ``phi' a + theta' e_j + psi' e_k`` with a the first axis, seen from behind the second turn (Goldstein,
    section 4.9).
    """
    first, second, third = orientation.turns
    turns = _turns(orientation, values).turns
    before = from_axes(turns[2].axes(), spin)
    axis = to_axes(turns[1].axes(), IDENTITY[first])
    across = 3 - second - third
    phi_rate = before[across] / axis[across]
    return [phi_rate, before[second], before[third] - axis[third] * phi_rate]


def euler_spin(
    orientation: OrientationCoordinates, angles: Sequence[Expression], rates: Sequence[Expression]
) -> list[Scalar]:
    """Return the angular velocity in the axes of the body from the derivatives of Euler angles.

    Parameters
    ----------
    orientation
        Euler angles.
    angles, rates
        The angles and their derivatives (Goldstein, section 4.9).
    """
    first, second, third = orientation.turns
    turns = _turns(orientation, angles).turns
    phi, theta, psi = (IDENTITY[axis] * rate for axis, rate in zip((first, second, third), rates, strict=True))
    return list(to_axes(turns[2].axes(), to_axes(turns[1].axes(), phi) + theta) + psi)
