"""Slider: a straight guide between two frames."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Placement,
    Scalar,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    observable,
    parameter,
)


class Slider(Component):
    """A guide: frame b moves along an axis of frame a and does not turn against it.

    Its `side_force` and `torque` are what it exerts on frame b.
    """

    axis: tuple[float, float, float] = parameter(
        (1.0, 0.0, 0.0),
        direction=True,
        doc="Direction of the guide in frame a.",
    )
    a: Frame = connector(Frame, "The frame that carries the guide.")
    b: Frame = connector(Frame, "The frame that slides.")

    def normal(self) -> Vector:
        """Return the axis turned counter-clockwise by a quarter turn, in the axes of frame a."""
        axis = as_vector(self.axis)
        return Vector(-axis.z, 0.0, axis.x)

    @constraint(
        reaction="side_force", unit="N", doc="Force exerted on frame b, along the axis turned by a quarter turn."
    )
    def guide(self) -> Scalar:
        """Return the distance from the axis."""
        return dot(self.b.position - self.a.position, self.a.to_world(self.normal()))

    @constraint(reaction="torque", unit="N*m", doc="Torque exerted on frame b, counter-clockwise.")
    def lock(self) -> Scalar:
        """Return the angle between the frames."""
        return self.b.angle - self.a.angle

    @joint("a", "b", coordinates=("displacement",), solves=("guide", "lock"), spaces=("line", "plane"))
    def slide(self, displacement: Scalar) -> Placement:
        """Place b along the axis."""
        return Placement(as_vector(self.axis) * displacement, 0.0, axes="a")

    @observable(unit="m", doc="Distance of frame b from frame a along the axis.", spaces=("line", "plane"))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("line", "plane"))
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        axis = self.a.to_world(as_vector(self.axis))
        r = self.b.position - self.a.position
        w = self.a.angular_velocity.y
        v = self.b.velocity - self.a.velocity - Vector(w * r.z, 0.0, -w * r.x)
        return dot(v, axis)
