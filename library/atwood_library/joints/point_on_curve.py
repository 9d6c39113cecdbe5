"""PointOnCurve: a point on a curved wire."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood import (
    Component,
    Frame,
    Number,
    Placement,
    Point,
    Scalar,
    Shaft,
    Vector,
    connector,
    constraint,
    dot,
    event,
    is_zero,
    joint,
    norm,
    observable,
    parameter,
    sqrt,
)
from atwood_library.interfaces.bearings import velocity_seen
from atwood_library.interfaces.curves import check_curve


class PointOnCurve(Component):
    """A point that slides without friction on a curve fixed in a frame that may move: a bead on a wire.

    The curve is written once, as the place of the point in the axes of frame a for each value of a parameter:
    ``curve=("cos(p)", 0, "sin(p)")``, in units of `scale`. The parameter is the coordinate of the joint, and goes on
    counting where a closed curve comes round. A massless marker on the x axis of frame a is as many `scale` away from
    its origin as the parameter says, which makes the parameter known also where no body hangs on this joint. In a
    plane, y of the curve does not count. With an offset the point keeps that distance
    from the curve, as the axle of a roller on a cam does.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        "Bead on a wire",
        "Curve joint",
        "Point on a path",
        "Cam with a roller",
        "Cam follower",
    )
    spaces = ("plane", "space")

    curve: Any = parameter(
        ("p", 0.0, 0.0), size=3, function_of={"p": "rad"}, doc="The curve in the axes of frame a, in units of scale."
    )
    scale: Number = parameter(
        1.0, unit="m", above=0.0, unit_length=True, doc="Length for a unit of the curve's functions.", symbol="a"
    )
    offset: Number = parameter(
        0.0,
        unit="m",
        doc="Distance of the point from a curve in the x-z plane of frame a, to its left as the parameter grows.",
    )
    lower_end: Number | None = parameter(
        None,
        unit="rad",
        doc="Parameter at which the curve begins; none if it goes on.",
        symbol="u_min",
    )
    upper_end: Number | None = parameter(
        None, unit="rad", doc="Parameter at which the curve ends; none if it goes on.", symbol="u_max"
    )
    a: Frame = connector(Frame, "The frame that carries the curve.")
    b: Point = connector(Point, "The point.")
    marker: Point = connector(Point, "The marker on the x axis of frame a; nothing need be joined to it.")
    shaft: Shaft = connector(Shaft, "The parameter, where other parts take hold of it.", of="parameter")

    def check_values(self) -> None:
        """Refuse a curve with a corner, a cusp or a jump between its ends."""
        check_curve(self.curve, self.lower_end, self.upper_end, f"{self.path or type(self).__name__}.curve")

    def place(self, p: Scalar) -> Vector:
        """Return the place on the curve, in the axes of frame a."""
        place = self.within(self.curve(p))
        if is_zero(self.offset):
            return place
        tangent = self.curve.derivative("p")(p)
        left = Vector(-1.0 * tangent.z, 0.0, tangent.x)
        aside: Vector = left * (self.offset / sqrt(tangent.x * tangent.x + tangent.z * tangent.z))
        return place + aside

    def within(self, vector: Vector) -> Vector:
        """Return a vector of the curve in metres; in a plane, only what lies there."""
        return Vector(vector.x, vector.y if self.in_space else 0.0, vector.z) * self.scale

    def tangent(self) -> Vector:
        """Return the derivative of the place by the parameter, in world axes."""
        p, curve = self.parameter(), self.curve
        slope = self.within(curve.derivative("p")(p))
        if not is_zero(self.offset):  # the offset curve is longer, or shorter, as the curve bends
            first, second = curve.derivative("p")(p), curve.derivative("p").derivative("p")(p)
            square = first.x * first.x + first.z * first.z
            bend = (first.x * second.z - first.z * second.x) / (square * sqrt(square))
            slope = slope * (1.0 - self.offset * bend / self.scale)
        return self.a.to_world(slope)

    @constraint(
        reaction=("marker_force_1", "marker_force_2"),
        doc="Force that keeps the marker on its axis; zero unless something is joined to it.",
        spaces=("space",),
    )
    def marker_guide(self) -> tuple[Scalar, Scalar]:
        """Return the distance of the marker from the x axis."""
        arm = self.marker.position - self.a.position
        _, y, z = self.a.axes
        return dot(arm, y), dot(arm, z)

    @constraint(
        reaction="marker_force", doc="Force that keeps the marker on its axis; see marker_force_1.", spaces=("plane",)
    )
    def marker_guide_in_plane(self) -> Scalar:
        """Return the distance of the marker from the x axis."""
        return dot(self.marker.position - self.a.position, self.a.axes[2])

    @constraint(
        reaction="force", unit="N", doc="Force of the curve on the point, in world axes.", spaces=("plane", "space")
    )
    def on_curve(self) -> Vector:
        """Return the distance of the point from the place that the marker says."""
        gap: Vector = self.b.position - self.a.position - self.a.to_world(self.place(self.measured()))
        return gap

    @joint("a", "b", coordinates=("parameter",), solves=("on_curve",), spaces=("plane", "space"))
    def slide(self, p: Scalar) -> Placement:
        """Place the point on the curve."""
        return Placement(self.place(p), axes="a")

    @joint("a", "marker", coordinates=("parameter",), solves=("marker_guide",), spaces=("space",))
    def mark(self, p: Scalar) -> Placement:
        """Place the marker."""
        return Placement(Vector(p * self.scale, 0.0, 0.0), axes="a")

    @joint("a", "marker", coordinates=("parameter",), solves=("marker_guide_in_plane",), spaces=("plane",))
    def mark_in_plane(self, p: Scalar) -> Placement:
        """Place the marker."""
        return Placement(Vector(p * self.scale, 0.0, 0.0), axes="a")

    @event(direction=-1, target="stop", message="the point has reached the end of the curve", spaces=("plane", "space"))
    def reaches_lower_end(self) -> Scalar:
        """Return the way to the lower end."""
        return self.parameter() - self.lower_end if self.lower_end is not None else 1.0

    @event(direction=-1, target="stop", message="the point has reached the end of the curve", spaces=("plane", "space"))
    def reaches_upper_end(self) -> Scalar:
        """Return the way to the upper end."""
        return self.upper_end - self.parameter() if self.upper_end is not None else 1.0

    def measured(self) -> Scalar:
        """Return the parameter as the marker says it."""
        return dot(self.marker.position - self.a.position, self.a.axes[0]) / self.scale

    @observable(
        unit="rad", doc="Parameter of the curve at the point.", rate="rate", spaces=("plane", "space"), symbol="u"
    )
    def parameter(self) -> Scalar:
        """Return the parameter."""
        return self.measured()

    @observable(unit="rad/s", doc="Rate of the parameter.", spaces=("plane", "space"))
    def rate(self) -> Scalar:
        """Return the rate of the parameter, as seen from frame a."""
        return dot(velocity_seen(self.a, self.marker), self.a.axes[0]) / self.scale

    @observable(unit="m/s", doc="Speed along the curve, as the parameter grows.", spaces=("plane", "space"))
    def speed(self) -> Scalar:
        """Return the speed along the curve, as seen from frame a."""
        return self.rate() * norm(self.tangent())

    @observable(unit="m", doc="Position on the curve in the axes of frame a.", spaces=("plane", "space"))
    def local_position(self) -> Vector:
        """Return the place."""
        return self.place(self.parameter())
