"""Mass1D: a mass that moves on a straight line."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Number,
    Placement,
    Point,
    PointInertia,
    Scalar,
    Slide,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    inertia,
    joint,
    observable,
    parameter,
)


class Mass1D(Component):
    """A mass that moves on a straight line through `origin` along `axis`.

    In a scene on a line it moves on the scene's own line. In a plane the guide holds it with `side_force`, so that
    one-dimensional and planar parts can meet.
    """

    synonyms = ("Mass on a line", "Translational.Components.Mass")

    mass: Number = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    origin: Triple = parameter(
        (0.0, 0.0, 0.0),
        unit="m",
        size=3,
        place=True,
        doc="Point of the line where the displacement is zero.",
        symbol="x_0",
    )
    axis: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction of the line.")
    flange: Point = connector(Point, "The mass.")
    slide: Slide = connector(Slide, "The displacement, where drives take hold of it.", of="displacement")

    def direction(self) -> Vector:
        """Return the direction of the line."""
        return self.line if self.on_a_line else as_vector(self.axis)

    @inertia
    def material_point(self) -> Iterable[PointInertia]:
        """Return the inertia."""
        yield PointInertia((self.flange,), ((self.mass,),))

    @constraint(
        reaction="side_force", unit="N", doc="Force of the guide on the mass, along the axis turned by a quarter turn."
    )
    def guide(self) -> Scalar:
        """Return the distance from the line; nothing on a line, where it cannot leave."""
        axis = self.direction()
        return (
            dot(self.flange.position - as_vector(self.origin), Vector(-axis.z, 0.0, axis.x))
            if not self.on_a_line
            else 0.0
        )

    @joint("world", "flange", coordinates=("displacement",), solves=("guide",), spaces=("line", "plane"))
    def move(self, displacement: Scalar) -> Placement:
        """Place the mass on the line."""
        axis, origin = self.direction(), as_vector(self.origin)
        start = axis * dot(axis, origin) if self.on_a_line else origin
        return Placement(start + axis * displacement)

    @observable(unit="m", doc="Distance from the origin along the line.", rate="speed", spaces=("line", "plane"))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.flange.position - as_vector(self.origin), self.direction())

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("line", "plane"))
    def speed(self) -> Scalar:
        """Return the speed."""
        return dot(self.flange.velocity, self.direction())

    @observable(unit="m", doc="Position in world axes.")
    def position(self) -> Vector:
        """Return the position."""
        return self.flange.position

    @observable(unit="m/s", doc="Velocity in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.flange.velocity

    @observable(unit="m/s^2", doc="Acceleration in world axes.")
    def acceleration(self) -> Vector:
        """Return the acceleration."""
        return self.flange.acceleration
