"""FrameOnCurve: a frame that moves along a curve and turns with it."""

from __future__ import annotations

from atwood import Frame, Placement, Scalar, Vector, atan2, connector, constraint, cross, dot, joint, observable, sqrt
from atwood_library.joints.point_on_curve import PointOnCurve


class FrameOnCurve(PointOnCurve):
    """A frame slides without friction along a curve in the x-z plane of frame a, with its x axis along the tangent.

    A car on a track, a slide on a bent rail: otherwise as `PointOnCurve`. Its y axis is that of frame a. In a plane the
    angle of what hangs on it is a dependent coordinate.
    """

    synonyms = ("Car on a track", "Roller coaster", "Bent guide")

    b: Frame = connector(Frame, "The frame that moves; its x axis is along the tangent.")

    def direction(self, p: Scalar) -> Vector:
        """Return the direction of the tangent, in the axes of frame a."""
        slope = self.curve.derivative("p")(p)
        flat = Vector(slope.x, 0.0, slope.z)
        along: Vector = flat / sqrt(dot(flat, flat))
        return along

    @constraint(
        reaction="torque", unit="N*m", doc="Torque of the curve on frame b, counter-clockwise.", spaces=("plane",)
    )
    def lock(self) -> Scalar:
        """Return the sine of the angle from the tangent to the x axis of b."""
        return -1.0 * cross(self.a.to_world(self.direction(self.measured())), self.b.axes[0]).y

    @constraint(
        reaction=("lock_1", "lock_2", "lock_3"),
        unit="N*m",
        doc="Multiplier of the guide: torque on frame b about an axis.",
        spaces=("space",),
    )
    def lock_in_space(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return by how much the axes of b are turned against the tangent and the y axis of a."""
        along = self.a.to_world(self.direction(self.measured()))
        xb, _, zb = self.b.axes
        return dot(self.a.axes[1], zb), dot(along, zb), dot(self.a.axes[1], xb)

    @joint("a", "b", coordinates=("parameter",), solves=("on_curve", "lock_in_space"), spaces=("space",))
    def slide_in_space(self, p: Scalar) -> Placement:
        """Place the frame on the curve, turned about -y into the tangent."""
        along = self.direction(p)
        return Placement(self.place(p), atan2(along.z, along.x), axes="a")

    @joint("a", "b", coordinates=("parameter",), solves=("on_curve",), spaces=("plane",))
    def slide(self, p: Scalar) -> Placement:
        """Place the frame on the curve; the lock turns it."""
        return Placement(self.place(p), axes="a")

    @observable(
        unit="rad", doc="Angle of the tangent in frame a, counter-clockwise.", periodic=True, spaces=("plane", "space")
    )
    def slope_angle(self) -> Scalar:
        """Return the angle."""
        along = self.direction(self.parameter())
        return atan2(along.z, along.x)
