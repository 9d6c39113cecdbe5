"""Planar: a plate on a table."""

from __future__ import annotations

from atwood import (
    Frame,
    Placement,
    Scalar,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    normals,
    observable,
    parameter,
    turn,
)
from atwood_library.interfaces.bearings import angle_about, axes_parallel, rate_about
from atwood_library.interfaces.loaded_plate import LoadedPlate
from atwood_library.interfaces.loaded_twist import LoadedTwist


class Planar(LoadedPlate, LoadedTwist):
    """A plate on a table: frame b slides on a plane through frame a, and turns about its normal. A part of space.

    Displacements are along the two directions that make a right-handed set with the normal. It can carry a
    spring to the origin, dampers, actuators, a rim, and whatever acts on the angle.
    """

    synonyms = ("Planar joint",)
    spaces = ("space",)

    axis: tuple[float, float, float] = parameter((0.0, 0.0, 1.0), direction=True, doc="Normal, in both frames.")
    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on frame b along the normal; negative when pulled.",
        spaces=("space",),
    )
    def contact(self) -> Scalar:
        """Return the height above the plane."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

    @joint(
        "a",
        "b",
        coordinates=("displacement_1", "displacement_2", "angle"),
        solves=("contact", "bearing"),
        spaces=("space",),
    )
    def lie(self, displacement_1: Scalar, displacement_2: Scalar, angle: Scalar) -> Placement:
        """Place b on the plane, turned about the normal."""
        axis = as_vector(self.axis)
        first, second = normals(axis)
        return Placement(first * displacement_1 + second * displacement_2, turn(axis, angle), axes="a")

    @observable(
        unit="rad", doc="Angle of frame b about the normal.", periodic=True, rate="angular_velocity", spaces=("space",)
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        return angle_about(self.a, self.b, as_vector(self.axis))

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("space",))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return rate_about(self.a, self.b, as_vector(self.axis))
