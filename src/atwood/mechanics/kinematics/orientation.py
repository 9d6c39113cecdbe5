"""Orientation inside bodies and in the world: one angle in the plane, three axes in space, from quaternions or angles.

What differs between plane and space is here, so that everything else is written once. Euler angles are singular where
the first and the third axis are parallel. They have a margin that rises through zero well before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

from atwood.expr import Expression, Scalar, cos, is_zero, sin
from atwood.model.values.rotation import IDENTITY, Axes, Rotation, Turn, as_rotation, compose, from_axes, to_axes
from atwood.model.values.space import Space, Vector, cross, planar_axes
from atwood.topology.bodies import Body, RigidStep
from atwood.topology.orientation_coordinates import OrientationCoordinates

NodeTurn: TypeAlias = Scalar | Axes
"""How a node is turned from its body: an angle in the plane, rad; in space its axes in those of the body."""

Quaternion: TypeAlias = tuple[Scalar, Scalar, Scalar, Scalar]
"""Scalar part first."""


def body_offsets(body: Body, space: Space) -> tuple[dict[int, Vector], dict[int, NodeTurn]]:
    """Return offset and turn of each node in the axes of a body."""
    offsets: dict[int, Vector] = {body.root: Vector(0.0, 0.0, 0.0)}
    turns: dict[int, NodeTurn] = {body.root: IDENTITY if space.is_spatial else 0.0}
    for step in body.steps:
        offsets[step.child], turns[step.child] = _rigid_step(step, offsets[step.parent], turns[step.parent], space)
    return offsets, turns


def _rigid_step(step: RigidStep, offset: Vector, turn: NodeTurn, space: Space) -> tuple[Vector, NodeTurn]:
    placement = step.joint.local.placement
    child_turn: NodeTurn
    if space.is_spatial:
        rotation = as_rotation(0.0 if placement.rotation is None else placement.rotation)
        assert isinstance(turn, tuple)
        child_turn = compose(turn, (rotation.inverse() if step.backwards else rotation).axes())
    else:
        angle: Any = 0.0 if placement.rotation is None else placement.rotation
        child_turn = plain(turn) - angle if step.backwards else plain(turn) + angle
    shift = placement.displacement
    if placement.axes == "a" and space.has_rotation:
        shift = rotate(shift, child_turn if step.backwards else turn)
    return (offset - shift if step.backwards else offset + shift), child_turn


def plain(turn: NodeTurn) -> Scalar:
    """Return a turn in the plane, which is an angle."""
    assert not isinstance(turn, tuple)
    return turn


def rotate(vector: Vector, turn: NodeTurn) -> Vector:
    """Return, in the axes of a body, a vector that is given in those of a node."""
    if isinstance(turn, tuple):
        return from_axes(turn, vector)
    if is_zero(turn):
        return vector
    return from_axes(planar_axes(turn), vector)


def node_axes(angle: Expression | None, axes: Axes | None, turn: NodeTurn) -> Axes | None:
    """Return the axes of a node in world axes; None if its body has no orientation."""
    if isinstance(turn, tuple):
        return None if axes is None else compose(axes, turn)
    return None if angle is None else planar_axes(angle + turn)


def spin_in_world(components: Sequence[Expression], axes: Axes | None) -> Vector:
    """Return an angular velocity or acceleration in world axes from its components (see `Kinematics`)."""
    if len(components) == 3 and axes is not None:
        return from_axes(axes, Vector(*components))
    return Vector(0.0, -components[0], 0.0)


def torque_components(torque_W: Vector, axes: Axes | None, space: Space) -> tuple[Scalar, ...]:
    """Return the components of a torque as those of angular velocities are: counter-clockwise, or in body axes."""
    if space.is_spatial:
        return tuple(torque_W if axes is None else to_axes(axes, torque_W))
    return (-torque_W.y,)


def inertial_torque(moment: Scalar | Axes, spin: Sequence[Expression], spin_rate: Sequence[Expression]) -> list[Scalar]:
    """Return the rate of angular momentum about the centre of mass, in the axes of the body.

    In space Euler's equations, ``J alpha + omega x J omega`` (Goldstein, section 5.5); in the plane ``J alpha``.
    """
    if not isinstance(moment, tuple):
        return [moment * spin_rate[0]]
    omega, alpha = Vector(*spin), Vector(*spin_rate)
    return list(from_axes(moment, alpha) + _gyroscopic(moment, omega))


def _gyroscopic(tensor: Axes, omega: Vector) -> Vector:
    """Return ``omega x J omega``; about principal axes with one difference of moments for each component."""
    off = (tensor[0].y, tensor[0].z, tensor[1].z)
    if all(is_zero(entry) for entry in off):
        a, b, c = tensor[0].x, tensor[1].y, tensor[2].z
        return Vector(
            omega.y * omega.z * (c - b),
            omega.z * omega.x * (a - c),
            omega.x * omega.y * (b - a),
        )
    return cross(omega, from_axes(tensor, omega))


def quaternion_axes(quaternion: Sequence[Scalar]) -> Axes:
    """Return the axes of a frame from its quaternion, scalar part first, of whatever size it is.

    Divided by the square of its size, so that the size means nothing and cannot drift (Goldstein, section 4.5, with
    e0 to e3 of any sum of squares).
    """
    w, x, y, z = quaternion
    twice = 2.0 / (w * w + x * x + y * y + z * z)
    xs, ys, zs = x * twice, y * twice, z * twice
    wx, wy, wz, xx, xy, xz = w * xs, w * ys, w * zs, x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    return (
        Vector(1.0 - (yy + zz), xy + wz, xz - wy),
        Vector(xy - wz, 1.0 - (xx + zz), yz + wx),
        Vector(xz + wy, yz - wx, 1.0 - (xx + yy)),
    )


def quaternion_rates(quaternion: Sequence[Expression], spin: Sequence[Expression]) -> list[Scalar]:
    """Return a quaternion's derivative, ``1/2 q (0, omega)``, from the angular velocity in body axes, rad/s."""
    w, x, y, z = quaternion
    a, b, c = (0.5 * component for component in spin)
    return [
        -(x * a + y * b + z * c),
        w * a + (y * c - z * b),
        w * b + (z * a - x * c),
        w * c + (x * b - y * a),
    ]


def rotation_quaternion(rotation: Rotation) -> Quaternion:
    """Return the unit quaternion of a rotation: of each turn ``(cos(angle/2), n sin(angle/2))``, one after another."""
    found: Quaternion = (1.0, 0.0, 0.0, 0.0)
    for one in rotation.turns:
        half = 0.5 * one.angle
        s = sin(half)
        found = quaternion_product(found, (cos(half), one.axis.x * s, one.axis.y * s, one.axis.z * s))
    return found


def node_quaternions(body: Body) -> dict[int, Quaternion]:
    """Return, in space, the quaternion of each node of a body in the axes of the body."""
    found: dict[int, Quaternion] = {body.root: (1.0, 0.0, 0.0, 0.0)}
    for step in body.steps:
        given = step.joint.local.placement.rotation
        rotation = as_rotation(0.0 if given is None else given)
        own = rotation_quaternion(rotation.inverse() if step.backwards else rotation)
        found[step.child] = quaternion_product(found[step.parent], own)
    return found


def quaternion_product(p: Sequence[Any], q: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Return the quaternion of the turn q within the frame p: of terms, numbers or arrays."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3],
        p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1],
    )


BASES: tuple[Axes, Axes] = (IDENTITY, (IDENTITY[1], IDENTITY[2], IDENTITY[0]))
"""Axes that Euler angles are measured from, in the world's."""

_BASE_QUATERNIONS: tuple[Quaternion, Quaternion] = ((1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5))

FARTHEST_COSINE = 0.9
"""Largest cosine between the first and the third axis of Euler angles; from the other base it is at most 0.44."""


def orientation_axes(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Axes:
    """Return the axes of a body in the world's."""
    if orientation.kind == "quaternion":
        return quaternion_axes(values)
    return compose(BASES[orientation.base], _turns(orientation, values).axes())


def orientation_quaternion(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Quaternion:
    """Return the quaternion of a body, of any size, scalar part first."""
    if orientation.kind == "quaternion":
        w, x, y, z = values
        return w, x, y, z
    return quaternion_product(_BASE_QUATERNIONS[orientation.base], rotation_quaternion(_turns(orientation, values)))


def orientation_rates(
    orientation: OrientationCoordinates, values: Sequence[Expression], spin: Sequence[Expression]
) -> list[Scalar]:
    """Return the derivatives of the coordinates of an orientation."""
    if orientation.kind == "quaternion":
        return quaternion_rates(values, spin)
    return _euler_rates(orientation, values, Vector(*spin))


def orientation_margin(orientation: OrientationCoordinates, values: Sequence[Expression]) -> Expression | None:
    """Return what rises through zero where the coordinates are to be switched; None if they are regular everywhere."""
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
    """Return the angular velocity in the axes of the body from the derivatives of Euler angles."""
    first, second, third = orientation.turns
    turns = _turns(orientation, angles).turns
    phi, theta, psi = (IDENTITY[axis] * rate for axis, rate in zip((first, second, third), rates, strict=True))
    return list(to_axes(turns[2].axes(), to_axes(turns[1].axes(), phi) + theta) + psi)
