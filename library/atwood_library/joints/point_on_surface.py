"""PointOnSurface: a point on a curved surface that is given by two parameters."""

from __future__ import annotations

from typing import Any

from atwood import (
    Component,
    Frame,
    Number,
    Placement,
    Point,
    Scalar,
    Vector,
    connector,
    constraint,
    dot,
    event,
    joint,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import velocity_seen

_PARAMETERS = {"p": "rad", "q": "rad"}


class PointOnSurface(Component):
    """A point that slides without friction on a surface fixed in a frame that may move. A part of space.

    The surface is written once, as the place of the point in the axes of frame a for each value of two parameters, in
    units of `scale`: ``surface=("p", "q", "0.5*(p**2 + q**2)")`` is a bowl above its x and y, and
    ``("sin(p)*cos(q)", "sin(p)*sin(q)", "-cos(p)")`` a sphere in angles, with the coordinates' own singular places. The
    parameters are the coordinates of the joint. A massless marker in the x-y plane of frame a is as many `scale` away
    from its origin as they say. The surface holds from both sides. See `PointOnLevelSurface` for ``f(x, y, z) = 0``.
    """

    synonyms = ("Bead on a surface", "Surface joint")
    spaces = ("space",)

    surface: Any = parameter(
        ("p", "q", 0.0),
        size=3,
        function_of=_PARAMETERS,
        doc="The surface in the axes of frame a, in units of scale.",
    )
    scale: Number = parameter(
        1.0, unit="m", above=0.0, unit_length=True, doc="Length for a unit of the surface's functions.", symbol="a"
    )
    edge: Any = parameter(
        1.0, function_of=_PARAMETERS, doc="A function that is positive within the surface and zero at its edge."
    )
    a: Frame = connector(Frame, "The frame that carries the surface.")
    b: Point = connector(Point, "The point.")
    marker: Point = connector(Point, "The marker in the x-y plane of frame a; nothing need be joined to it.")

    def place(self, p: Scalar, q: Scalar) -> Vector:
        """Return the place on the surface, in the axes of frame a."""
        place: Vector = self.surface(p, q) * self.scale
        return place

    def measured(self, axis: int) -> Scalar:
        """Return a parameter as the marker says it."""
        return dot(self.marker.position - self.a.position, self.a.axes[axis]) / self.scale

    @constraint(
        reaction="marker_force",
        doc="Force that keeps the marker in its plane; zero unless something is joined to it.",
        spaces=("space",),
    )
    def marker_guide(self) -> Scalar:
        """Return the distance of the marker from the x-y plane."""
        return dot(self.marker.position - self.a.position, self.a.axes[2])

    @constraint(reaction="force", unit="N", doc="Force of the surface on the point, in world axes.", spaces=("space",))
    def on_surface(self) -> Vector:
        """Return the distance of the point from the place that the marker says."""
        place = self.a.to_world(self.place(self.measured(0), self.measured(1)))
        gap: Vector = self.b.position - self.a.position - place
        return gap

    @joint("a", "b", coordinates=("parameter_1", "parameter_2"), solves=("on_surface",), spaces=("space",))
    def slide(self, p: Scalar, q: Scalar) -> Placement:
        """Place the point on the surface."""
        return Placement(self.place(p, q), axes="a")

    @joint("a", "marker", coordinates=("parameter_1", "parameter_2"), solves=("marker_guide",), spaces=("space",))
    def mark(self, p: Scalar, q: Scalar) -> Placement:
        """Place the marker."""
        return Placement(Vector(p * self.scale, q * self.scale, 0.0), axes="a")

    @event(direction=-1, target="stop", message="the point has reached the edge of the surface", spaces=("space",))
    def reaches_edge(self) -> Scalar:
        """Return the function of the edge."""
        return self.edge(self.parameter_1(), self.parameter_2())

    @observable(
        unit="rad", doc="First parameter of the surface at the point.", rate="rate_1", spaces=("space",), symbol="u"
    )
    def parameter_1(self) -> Scalar:
        """Return the parameter."""
        return self.measured(0)

    @observable(
        unit="rad", doc="Second parameter of the surface at the point.", rate="rate_2", spaces=("space",), symbol="v"
    )
    def parameter_2(self) -> Scalar:
        """Return the parameter."""
        return self.measured(1)

    @observable(unit="rad/s", doc="Rate of the first parameter.", spaces=("space",))
    def rate_1(self) -> Scalar:
        """Return the rate, as seen from frame a."""
        return dot(velocity_seen(self.a, self.marker), self.a.axes[0]) / self.scale

    @observable(unit="rad/s", doc="Rate of the second parameter.", spaces=("space",))
    def rate_2(self) -> Scalar:
        """Return the rate, as seen from frame a."""
        return dot(velocity_seen(self.a, self.marker), self.a.axes[1]) / self.scale
