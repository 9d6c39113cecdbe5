"""Pivot: a hinge between two frames."""

from __future__ import annotations

from typing import ClassVar

from atwood import (
    Frame,
    Placement,
    Scalar,
    Shaft,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    joint,
    observable,
    parameter,
    turn,
)
from atwood_library.interfaces.bearings import angle_about, axes_parallel, parallel_torque, rate_about
from atwood_library.interfaces.loaded_hinge import LoadedHinge


class Pivot(LoadedHinge):
    """A hinge: the two frames share their position and turn freely against each other about one axis.

    In a plane the axis is the plane's normal; in space it is any direction that is fixed in both frames (a revolute
    joint). Its `force` and, in space, its `torque` are what it exerts on frame b, in world axes. It can carry a spring,
    a damper, a motor and stops.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        *("Revolute", "Hinge", "Pin joint", "Revolute joint", "RevolutePlanarLoopConstraint"),
        *("MultiBody.Joints.Constraints.Revolute", "JointUSR", "JointSSR", "JointRRR", "JointRRP"),
    )

    axis: Triple = parameter(
        (0.0, -1.0, 0.0),
        turning=True,
        doc="Axis in both frames; the angle is right-handed about it, so counter-clockwise in a plane unless reversed.",
    )
    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The frame that turns.")
    shaft: Shaft = connector(Shaft, "The angle, where gears take hold of it.", of="angle")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

    @joint("a", "b", coordinates=("angle",), solves=("coincidence",))
    def turn(self, angle: Scalar) -> Placement:
        """Place b at a, turned in the plane."""
        return Placement(Vector(0.0, 0.0, 0.0), -as_vector(self.axis).y * angle)

    @joint("a", "b", coordinates=("angle",), solves=("coincidence", "bearing"), spaces=("space",))
    def turn_in_space(self, angle: Scalar) -> Placement:
        """Place b at a, turned about the axis."""
        return Placement(Vector(0.0, 0.0, 0.0), turn(as_vector(self.axis), angle), axes="a")

    @joint("a", "b", solves=("coincidence",), spaces=("line",))
    def meet(self) -> Placement:
        """Place b at a; nothing turns on a line."""
        return Placement(Vector(0.0, 0.0, 0.0), 0.0)

    @observable(
        unit="rad",
        doc="Angle of frame b from frame a about the axis.",
        periodic=True,
        rate="angular_velocity",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        if self.in_space:
            return angle_about(self.a, self.b, as_vector(self.axis))
        return -as_vector(self.axis).y * (self.b.angle - self.a.angle)

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        if self.in_space:
            return rate_about(self.a, self.b, as_vector(self.axis))
        return as_vector(self.axis).y * (self.b.angular_velocity.y - self.a.angular_velocity.y)

    @observable(unit="N*m", doc="Torque of the bearing on frame b, in world axes.", spaces=("space",))
    def torque(self) -> Vector:
        """Return the torque of the bearing."""
        reactions = self.reaction("bearing_1"), self.reaction("bearing_2")
        return parallel_torque(self.a, as_vector(self.axis), reactions)
