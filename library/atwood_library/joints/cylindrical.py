"""Cylindrical: a shaft that turns and slides in a bush."""

from __future__ import annotations

from atwood import (
    Frame,
    Placement,
    Scalar,
    Shaft,
    Slide,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    observable,
    parameter,
    turn,
)
from atwood_library.interfaces.bearings import angle_about, axes_parallel, rate_about, rate_along, sideways
from atwood_library.interfaces.loaded_slide import LoadedSlide
from atwood_library.interfaces.loaded_twist import LoadedTwist


class Cylindrical(LoadedSlide, LoadedTwist):
    """A shaft in a bush: frame b turns about an axis of frame a and slides along it. A part of space.

    Along the axis and about it, it can carry springs, dampers, an actuator, a motor and stops.
    """

    synonyms = ("Cylindrical joint",)
    spaces = ("space",)

    axis: tuple[float, float, float] = parameter((0.0, 0.0, 1.0), direction=True, doc="Axis, in both frames.")
    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")
    shaft: Shaft = connector(Shaft, "The angle, where gears take hold of it.", of="angle")
    carriage: Slide = connector(Slide, "The displacement, where gears take hold of it.", of="displacement")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction=("guide_1", "guide_2"),
        unit="N",
        doc="Multiplier of the guide: force on frame b along a normal of the axis.",
        spaces=("space",),
    )
    def guide(self) -> tuple[Scalar, Scalar]:
        """Return the distance from the axis along its two normals."""
        return sideways(self.a, self.b, as_vector(self.axis))

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

    @joint("a", "b", coordinates=("displacement", "angle"), solves=("guide", "bearing"), spaces=("space",))
    def slide_and_turn(self, displacement: Scalar, angle: Scalar) -> Placement:
        """Place b along the axis, turned about it."""
        axis = as_vector(self.axis)
        return Placement(axis * displacement, turn(axis, angle), axes="a")

    @observable(unit="m", doc="Distance of frame b along the axis.", rate="speed", spaces=("space",))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("space",))
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        return rate_along(self.a, self.b, as_vector(self.axis))

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
