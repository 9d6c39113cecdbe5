"""RotaryDrive: a prescribed rotation between two frames."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Number,
    Placement,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    cos,
    dot,
    joint,
    normals,
    observable,
    parameter,
    signal,
    sin,
    turn,
)
from atwood_library.interfaces.bearings import axes_parallel


class RotaryDrive(Component):
    """A hinge whose angle is a given function of time: a motor that turns exactly as told.

    Its `force` and, in a plane, `torque` are what it exerts on frame b; in space `motor_torque` is about the axis.
    """

    synonyms = ("Revolute with prescribed motion", "Servo")
    spaces = ("plane", "space")

    axis: Triple = parameter(
        (0.0, -1.0, 0.0),
        turning=True,
        doc="Axis in both frames; the angle is right-handed about it, so counter-clockwise in a plane unless reversed.",
    )
    rotation: Number = signal(0.0, unit="rad", doc="Angle of frame b from frame a, a function of time.")
    a: Frame = connector(Frame, "The frame that carries the motor.")
    b: Frame = connector(Frame, "The frame that is turned.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @constraint(reaction="torque", unit="N*m", doc="Torque on frame b, counter-clockwise.", spaces=("line", "plane"))
    def track(self) -> Scalar:
        """Return the deviation of the angle."""
        return self.b.angle - self.a.angle + as_vector(self.axis).y * self.rotation

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

    @constraint(
        reaction="motor_torque", unit="N*m", doc="Torque of the motor on frame b about the axis.", spaces=("space",)
    )
    def follow(self) -> Scalar:
        """Return the sine of the deviation of the angle."""
        first, second = normals(as_vector(self.axis))
        turned = self.b.to_world(first)
        along, across = dot(turned, self.a.to_world(first)), dot(turned, self.a.to_world(second))
        return across * cos(self.rotation) - along * sin(self.rotation)

    @joint("a", "b", solves=("coincidence", "track"), spaces=("plane",))
    def turn(self) -> Placement:
        """Place b at a, turned as prescribed."""
        return Placement(Vector(0.0, 0.0, 0.0), -as_vector(self.axis).y * self.rotation)

    @joint("a", "b", solves=("coincidence", "bearing", "follow"), spaces=("space",))
    def turn_in_space(self) -> Placement:
        """Place b at a, turned about the axis as prescribed."""
        return Placement(Vector(0.0, 0.0, 0.0), turn(as_vector(self.axis), self.rotation), axes="a")

    @observable(unit="rad", doc="Prescribed angle.", spaces=("plane", "space"))
    def angle(self) -> Scalar:
        """Return the prescribed angle."""
        return self.rotation
