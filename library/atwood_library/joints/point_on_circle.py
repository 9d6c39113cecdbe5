"""PointOnCircle: a point on a ring."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Frame,
    Load,
    Number,
    Placement,
    Point,
    Scalar,
    Triple,
    Vector,
    as_vector,
    atan2,
    connector,
    constraint,
    cos,
    cross,
    dot,
    force,
    is_zero,
    joint,
    normals,
    observable,
    parameter,
    sin,
)
from atwood_library.interfaces.bearings import velocity_seen
from atwood_library.interfaces.loaded_hinge import LoadedHinge
from atwood_library.interfaces.loads import push_apart


class PointOnCircle(LoadedHinge):
    """A point that slides on a circle fixed in a frame, about the frame's origin.

    The angle is right-handed about the axis, and zero where the first of its `normals` points: for an axis along x, y
    or z that is the next of the frame's axes. In a plane the circle lies in the plane, whatever the axis is set to; the
    angle is counter-clockwise, and zero where the frame's z axis points, as with the axis -y in space. It can carry a
    spring, a damper, a motor and stops of the angle.
    """

    spaces = ("plane", "space")

    axis: Triple = parameter((0.0, 0.0, 1.0), direction=True, doc="Axis of the circle, in frame a.")
    radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius of the circle.")
    a: Frame = connector(Frame, "The frame that carries the circle; its origin is the centre.")
    b: Point = connector(Point, "The point.")

    def axis_vector(self) -> Vector:
        """Return the axis in frame a."""
        return as_vector(self.axis) if self.in_space else Vector(0.0, -1.0, 0.0)

    @constraint(reaction="axial_force", unit="N", doc="Force on the point along the axis.", spaces=("space",))
    def height(self) -> Scalar:
        """Return the height above the plane of the circle."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @constraint(
        reaction="radial_force", unit="N", doc="Force on the point away from the centre.", spaces=("plane", "space")
    )
    def ring(self) -> Scalar:
        """Return ``(r^2 - R^2)/(2 R)``, whose slope is one."""
        arm = self.b.position - self.a.position
        return dot(arm, arm) * (0.5 / self.radius) - 0.5 * self.radius

    @joint("a", "b", coordinates=("angle",), solves=("height", "ring"), spaces=("plane", "space"))
    def go_round(self, angle: Scalar) -> Placement:
        """Place the point on the circle."""
        first, second = normals(self.axis_vector())
        return Placement((first * cos(angle) + second * sin(angle)) * self.radius, axes="a")

    @observable(
        unit="rad", doc="Angle on the circle.", periodic=True, rate="angular_velocity", spaces=("plane", "space")
    )
    def angle(self) -> Scalar:
        """Return the angle from the first normal of the axis."""
        first, second = normals(self.axis_vector())
        arm = self.b.position - self.a.position
        return atan2(dot(arm, self.a.to_world(second)), dot(arm, self.a.to_world(first)))

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle as seen from frame a."""
        arm = self.b.position - self.a.position
        return dot(cross(arm, velocity_seen(self.a, self.b)), self.a.to_world(self.axis_vector())) / (
            self.radius * self.radius
        )

    @force
    def motor_torque(self) -> Iterable[Load]:
        """Return the force of the motor along the circle, and its reaction: together the motor's torque."""
        if is_zero(self.motor):
            return
        arm = self.b.position - self.a.position
        push = cross(self.a.to_world(self.axis_vector()), arm) * (self.motor / (self.radius * self.radius))
        yield from push_apart(self.a, self.b, push)
