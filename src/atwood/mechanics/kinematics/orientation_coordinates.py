"""Orientations in space by the coordinates of a chart: axes, quaternion, rates, and how near it is to being singular.

Three coordinates are the fewest, and are singular somewhere: modified Rodrigues parameters and rotation vectors where
the angle is one full turn, Euler angles where the first and the third axis are parallel. Each chart has a margin that
rises through zero well before.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial, pi

from atwood.expr import Expression, Scalar
from atwood.mechanics.kinematics.orientation import (
    Quaternion,
    quaternion_axes,
    quaternion_product,
    quaternion_rates,
    rotation_quaternion,
)
from atwood.model.values.rotation import IDENTITY, Axes, Rotation, Turn, compose, from_axes, to_axes
from atwood.model.values.vector import Vector, cross, dot
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

FARTHEST_RODRIGUES = 1.5
"""Square of the largest modified Rodrigues parameters: 203 degrees, which become 157."""

FARTHEST_ROTATION = 1.15 * pi
"""Largest rotation vector, rad: 207 degrees, which become 153."""

FARTHEST_COSINE = 0.9
"""Largest cosine between the first and the third axis of Euler angles; from the other base it is at most 0.44."""

_TERMS = 16
"""Of the series for the rotation vector: exact to rounding up to one full turn."""


def orientation_axes(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Axes:
    """Return the axes of a body in the world's.

    Parameters
    ----------
    orientation
        The chart.
    values
        Its coordinates.
    """
    if orientation.kind == "quaternion":
        return quaternion_axes(values)
    if orientation.kind.startswith("euler-"):
        return compose(BASES[orientation.base], _turns(orientation, values).axes())
    quaternion = orientation_quaternion(orientation, values)
    if orientation.kind == "rodrigues":
        size = 1.0 + _square(values)
        return quaternion_axes(quaternion, size * size)
    return quaternion_axes(quaternion, 1.0)


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
    if orientation.kind.startswith("euler-"):
        return quaternion_product(_BASE_QUATERNIONS[orientation.base], rotation_quaternion(_turns(orientation, values)))
    x, y, z = values
    if orientation.kind == "rodrigues":
        return 1.0 - _square(values), 2.0 * x, 2.0 * y, 2.0 * z
    sine, rest, half = _half_angle(values)
    by = 0.5 * sine
    return sine - half * rest, by * x, by * y, by * z


def orientation_rates(
    orientation: OrientationCoordinates, values: Sequence[Expression], spin: Sequence[Expression]
) -> list[Scalar]:
    """Return the derivatives of a chart's coordinates.

    Parameters
    ----------
    orientation, values
        See `orientation_axes`.
    spin
        Angular velocity in the axes of the body, rad/s.
    """
    if orientation.kind == "quaternion":
        return quaternion_rates(values, spin)
    if orientation.kind.startswith("euler-"):
        return _euler_rates(orientation, values, Vector(*spin))
    place, omega = Vector(*values), Vector(*spin)
    if orientation.kind == "rodrigues":
        # 1/4 [(1 - p^2) omega + 2 p x omega + 2 p (p . omega)] (Schaub and Junkins, section 3.6)
        lean = 0.25 * (1.0 - _square(values))
        along = 0.5 * dot(place, omega)
        return list(omega * lean + cross(place, omega) * 0.5 + place * along)
    # omega + 1/2 v x omega + g v x (v x omega), g = (1 - phi cot phi) / v^2, phi = |v|/2 (Schaub, section 3.5)
    sine, rest, _ = _half_angle(values)
    across = cross(place, omega)
    return list(omega + across * 0.5 + cross(place, across) * (0.25 * rest / sine))


def orientation_margin(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Expression | None:
    """Return what rises through zero where a chart is to be left; None if it is regular everywhere.

    Parameters
    ----------
    orientation, values
        See `orientation_axes`.
    """
    if orientation.is_homogeneous:
        return None
    if orientation.kind == "rodrigues":
        return _square(values) - FARTHEST_RODRIGUES
    if orientation.kind == "rotation-vector":
        return _square(values) - FARTHEST_ROTATION**2
    first, _, third = orientation.turns
    along = values[1].graph.convert(_turns(orientation, values).axes()[third][first])
    return along * along - FARTHEST_COSINE**2


def _square(values: Sequence[Expression]) -> Expression:
    x, y, z = values
    return x * x + y * y + z * z


def _half_angle(values: Sequence[Expression]) -> tuple[Expression, Expression, Expression]:
    """Return, with phi half the angle of a rotation vector, ``sin phi / phi``, what gives the cosine, and phi^2.

    The second is ``(sin phi / phi - cos phi) / phi^2``. Both are power series of phi^2 that converge everywhere, so
    that they are smooth at zero with all their derivatives.
    """
    half = 0.25 * _square(values)
    sine = [(-1) ** k / factorial(2 * k + 1) for k in range(_TERMS)]
    rest = [(-1) ** k * (1 / factorial(2 * k + 2) - 1 / factorial(2 * k + 3)) for k in range(_TERMS)]
    return _series(sine, half), _series(rest, half), half


def _series(coefficients: Sequence[float], x: Expression) -> Expression:
    total = x.graph.constant(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total = total * x + coefficient
    return total


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
        The chart, of Euler angles.
    angles, rates
        The angles and their derivatives (Goldstein, section 4.9).
    """
    first, second, third = orientation.turns
    turns = _turns(orientation, angles).turns
    phi, theta, psi = (IDENTITY[axis] * rate for axis, rate in zip((first, second, third), rates, strict=True))
    return list(to_axes(turns[2].axes(), to_axes(turns[1].axes(), phi) + theta) + psi)
