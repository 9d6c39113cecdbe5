"""PointOnPlane: a point on a table."""

from __future__ import annotations

from atwood import (
    Frame,
    Placement,
    Point,
    Scalar,
    Triple,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    normals,
    parameter,
)
from atwood_library.interfaces.loaded_plate import LoadedPlate


class PointOnPlane(LoadedPlate):
    """A point that slides on a plane fixed in a frame. A part of space.

    Displacements are along the two directions that make a right-handed set with the normal. It can carry a
    spring to the origin, a damper, actuators and a rim.
    """

    spaces = ("space",)

    axis: Triple = parameter((0.0, 0.0, 1.0), direction=True, doc="Normal of the plane, in frame a.")
    a: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    b: Point = connector(Point, "The point.")

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on the point along the normal; negative when pulled.",
        spaces=("space",),
    )
    def contact(self) -> Scalar:
        """Return the height above the plane."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @joint("a", "b", coordinates=("displacement_1", "displacement_2"), solves=("contact",), spaces=("space",))
    def lie(self, displacement_1: Scalar, displacement_2: Scalar) -> Placement:
        """Place the point on the plane."""
        first, second = normals(as_vector(self.axis))
        return Placement(first * displacement_1 + second * displacement_2, axes="a")
