"""What joints in space have in common: axes that stay parallel, frames that do not turn against each other."""

from __future__ import annotations

from atwood import Frame, Point, Scalar, Vector, atan2, cross, dot, normals, sqrt

__all__ = [
    "angle_about",
    "axes_parallel",
    "frames_parallel",
    "parallel_torque",
    "rate_about",
    "rate_along",
    "sideways",
    "twist_about",
    "twist_axis",
    "twist_cosine",
    "twist_rate",
    "unturned_torque",
    "velocity_seen",
]


def axes_parallel(a: Frame, b: Frame, axis: Vector) -> tuple[Scalar, Scalar]:
    """Return two scalars that are zero when an axis, fixed in both frames, is the same direction.

    Parameters
    ----------
    a, b
        The frames.
    axis
        Unit vector in the axes of either frame.
    """
    first, second = normals(axis)
    along_b = b.to_world(axis)
    return dot(a.to_world(first), along_b), dot(a.to_world(second), along_b)


def parallel_torque(a: Frame, axis: Vector, multipliers: tuple[Scalar, Scalar]) -> Vector:
    """Return the torque on frame b, in world axes, N m, that the multipliers of `axes_parallel` stand for.

    Turning b by a small rotation changes ``n_a . axis_b`` by its component along ``axis_b x n_a``.
    """
    first, second = normals(axis)
    n: Vector = a.to_world(first) * multipliers[0] + a.to_world(second) * multipliers[1]
    return cross(a.to_world(axis), n)


def frames_parallel(a: Frame, b: Frame) -> tuple[Scalar, Scalar, Scalar]:
    """Return three scalars that are zero when frame b is not turned against frame a."""
    xa, ya, za = a.axes
    xb, yb, zb = b.axes
    return dot(za, yb), dot(xa, zb), dot(ya, xb)


def unturned_torque(a: Frame, multipliers: tuple[Scalar, Scalar, Scalar]) -> Vector:
    """Return the torque on frame b, in world axes, N m, that the multipliers of `frames_parallel` stand for."""
    xa, ya, za = a.axes
    total: Vector = xa * multipliers[0] + ya * multipliers[1] + za * multipliers[2]
    return total


def sideways(a: Frame, b: Frame, axis: Vector) -> tuple[Scalar, Scalar]:
    """Return the distance of frame b from an axis through frame a, along the two normals of the axis, m."""
    first, second = normals(axis)
    arm = b.position - a.position
    return dot(arm, a.to_world(first)), dot(arm, a.to_world(second))


def angle_about(a: Frame, b: Frame, axis: Vector) -> Scalar:
    """Return the angle of frame b from frame a about an axis that both share, rad, within one turn."""
    first, second = normals(axis)
    turned = b.to_world(first)
    return atan2(dot(turned, a.to_world(second)), dot(turned, a.to_world(first)))


def rate_about(a: Frame, b: Frame, axis: Vector) -> Scalar:
    """Return the rate of the angle of frame b from frame a about an axis of frame a, rad/s."""
    return dot(b.angular_velocity - a.angular_velocity, a.to_world(axis))


def rate_along(a: Frame, b: Point, axis: Vector) -> Scalar:
    """Return the speed of b along an axis of frame a, as seen from frame a, m/s."""
    return dot(velocity_seen(a, b), a.to_world(axis))


def velocity_seen(a: Frame, b: Point) -> Vector:
    """Return the velocity of b as seen from frame a, in world axes, m/s (Goldstein, section 4.9)."""
    seen: Vector = b.velocity - a.velocity - cross(a.angular_velocity, b.position - a.position)
    return seen


def twist_about(a: Frame, b: Frame, axis: Vector) -> Scalar:
    """Return by how much frame b is twisted against frame a about an axis, rad, within half a turn either way.

    The rotation from a to b is split into the turn about the axis and the shortest turn that then takes the axis of a
    into that of b; the twist is the angle of the first. Where both frames share the axis it is the angle of a hinge.
    Of the rotation's matrix ``R`` in axes with the third along the axis it is ``atan2(R21 - R12, R11 + R22)``; with
    unit quaternion q it is ``2 atan2(q . axis, q0)`` (Dobrowolski, Swing-twist decomposition in Clifford algebra,
    arXiv:1506.05481).
    """
    across, along = _twist_parts(a, b, axis)
    return atan2(across, along)


def twist_cosine(a: Frame, b: Frame, axis: Vector) -> Scalar:
    """Return the cosine of the twist of frame b against frame a about an axis."""
    across, along = _twist_parts(a, b, axis)
    return along / sqrt(along * along + across * across)


def twist_axis(a: Frame, b: Frame, axis: Vector) -> Vector:
    """Return the vector whose product with the relative angular velocity is the rate of `twist_about`.

    It is ``(n_a + n_b) / (1 + n_a . n_b)`` with the axis in both frames, which for a hinge is the axis itself: the rate
    of the shortest turn from one axis to the other has no component along their mean.
    """
    along_a, along_b = a.to_world(axis), b.to_world(axis)
    mean: Vector = (along_a + along_b) / (1.0 + dot(along_a, along_b))
    return mean


def twist_rate(a: Frame, b: Frame, axis: Vector, in_space: bool) -> Scalar:
    """Return the rate of the twist of frame b against frame a about an axis, rad/s; in a plane about its normal."""
    spin = b.angular_velocity - a.angular_velocity
    return dot(spin, twist_axis(a, b, axis)) if in_space else axis.y * spin.y


def _twist_parts(a: Frame, b: Frame, axis: Vector) -> tuple[Scalar, Scalar]:
    """Return sine and cosine of the twist, times ``1 + n_a . n_b``."""
    first, second = normals(axis)
    a1, a2, b1, b2 = a.to_world(first), a.to_world(second), b.to_world(first), b.to_world(second)
    return dot(b1, a2) - dot(b2, a1), dot(a1, b1) + dot(a2, b2)
