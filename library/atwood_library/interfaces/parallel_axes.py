"""Joints of space that keep an axis of two frames parallel, and those that keep the two on one line."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import angle_about, axes_parallel, rate_about, rate_along, sideways


class ParallelAxes(Component):
    """A joint between frames a and b, whose axis has one direction in both: an angle is left. A part of space."""

    spaces = ("space",)

    axis: Triple = parameter((0.0, 0.0, 1.0), direction=True, doc="Axis, in both frames.")
    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

    @observable(
        unit="rad", doc="Angle of frame b about the axis.", periodic=True, rate="angular_velocity", spaces=("space",)
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        return angle_about(self.a, self.b, as_vector(self.axis))

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("space",))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return rate_about(self.a, self.b, as_vector(self.axis))


class CommonAxis(ParallelAxes):
    """A joint between frames a and b, whose axes lie on one line: an angle and a displacement are left."""

    @constraint(
        reaction=("guide_1", "guide_2"),
        unit="N",
        doc="Multiplier of the guide: force on frame b along a normal of the axis.",
        spaces=("space",),
    )
    def guide(self) -> tuple[Scalar, Scalar]:
        """Return the distance from the axis along its two normals."""
        return sideways(self.a, self.b, as_vector(self.axis))

    @observable(unit="m", doc="Distance of frame b along the axis.", rate="speed", spaces=("space",))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.axis_in_world())

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("space",))
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        return rate_along(self.a, self.b, as_vector(self.axis))
