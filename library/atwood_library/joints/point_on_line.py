"""PointOnLine: a point on a straight wire."""

from __future__ import annotations

from atwood import (
    Frame,
    Placement,
    Point,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    normals,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import rate_along
from atwood_library.interfaces.loaded_slide import LoadedSlide


class PointOnLine(LoadedSlide):
    """A point that slides on a straight line fixed in a frame, through the frame's origin.

    The displacement is zero at the origin of frame a and grows along the axis. It can carry a spring, a damper, an
    actuator and stops.
    """

    spaces = ("plane", "space")

    axis: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction, in frame a.")
    a: Frame = connector(Frame, "The frame that carries the line; its origin is on it.")
    b: Point = connector(Point, "The point.")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction=("side_force_1", "side_force_2"),
        unit="N",
        doc="Force on the point along a normal of the line.",
        spaces=("space",),
    )
    def wire(self) -> tuple[Scalar, Scalar]:
        """Return the distance from the line along its two normals."""
        first, second = normals(as_vector(self.axis))
        arm = self.b.position - self.a.position
        return dot(arm, self.a.to_world(first)), dot(arm, self.a.to_world(second))

    @constraint(
        reaction="side_force", unit="N", doc="Force on the point square to the line, to its left.", spaces=("plane",)
    )
    def wire_in_plane(self) -> Scalar:
        """Return the distance from the line, to its left."""
        axis = as_vector(self.axis)
        return dot(self.b.position - self.a.position, self.a.to_world(Vector(-axis.z, 0.0, axis.x)))

    @joint("a", "b", coordinates=("displacement",), solves=("wire", "wire_in_plane"), spaces=("plane", "space"))
    def slide(self, displacement: Scalar) -> Placement:
        """Place the point on the line."""
        return Placement(as_vector(self.axis) * displacement, axes="a")

    @observable(unit="m", doc="Distance along the line.", rate="speed", spaces=("plane", "space"))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("plane", "space"))
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        return rate_along(self.a, self.b, as_vector(self.axis))
