"""Components of a user, with laws of their own: what the generator adds to the parts of the library."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Frame,
    Load,
    Placement,
    Point,
    PointInertia,
    Scalar,
    Shaft,
    Vector,
    as_vector,
    connector,
    constraint,
    cos,
    cross,
    dot,
    force,
    inertia,
    joint,
    lagrangian,
    observable,
    parameter,
    potential,
    signal,
)

X, Y, Z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)


class OwnSpring(Component):
    """A spring whose energy grows with the fourth power of its length, and whose stiffness changes with time."""

    stiffness: float = parameter(1.0, unit="N/m", above=0.0, doc="Stiffness near the natural length, halved.")
    natural_length: float = parameter(1.0, unit="m", above=0.0, doc="Length without force.")
    growth: float = signal(1.0, doc="Factor of the stiffness.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def energy(self) -> Scalar:
        """Return ``k g (r^2 - l^2)^2 / (4 l^2)``."""
        d, square = self.b.position - self.a.position, self.natural_length * self.natural_length
        stretch = dot(d, d) - square
        return 0.25 * self.stiffness * self.growth * stretch * stretch / square


class OwnSwirl(Component):
    """A force between two points across their distance and their velocity, which has no energy."""

    twisting: float = parameter(0.2, unit="N*s/m", doc="Force for a unit of the velocity.")
    pulling: float = parameter(0.5, unit="N/m", doc="Force for a unit of the distance.")
    axis: tuple[float, float, float] = parameter((0.0, 1.0, 0.0), turning=True, doc="Across what, in the world.")
    a: Point = connector(Point, "One point.")
    b: Point = connector(Point, "The other point.")

    @force
    def push(self) -> Iterable[Load]:
        """Return ``n x (c v + k d)`` on b, and the opposite on a."""
        arm = self.pulling * (self.b.position - self.a.position)
        total = cross(as_vector(self.axis), arm + self.twisting * (self.b.velocity - self.a.velocity))
        yield Load(self.b, total)
        yield Load(self.a, -1.0 * total)


class OwnSurface(Component):
    """A point on a paraboloid that is fixed in a frame."""

    spaces = ("space",)

    radius_1: float = parameter(1.0, unit="m", doc="Radius of curvature along x.")
    radius_2: float = parameter(1.0, unit="m", doc="Radius of curvature along y.")
    a: Frame = connector(Frame, "The frame.")
    b: Point = connector(Point, "The point.")

    @constraint(reaction="normal", unit="N", doc="Force on the point along z.")
    def height(self) -> Scalar:
        """Return ``z - x^2/(2 r1) - y^2/(2 r2)``."""
        x, y, z = (dot(self.b.position - self.a.position, self.a.to_world(n)) for n in (X, Y, Z))
        return z - 0.5 * (x * x / self.radius_1 + y * y / self.radius_2)


class OwnWire(Component):
    """A point on a parabola in the x-z plane of a frame, with a chart: a joint of one coordinate."""

    spaces = ("plane", "space")

    radius: float = parameter(1.0, unit="m", above=0.0, doc="Radius of curvature where the parabola is lowest.")
    a: Frame = connector(Frame, "The frame.")
    b: Point = connector(Point, "The point.")

    @constraint(reaction="normal", unit="N", doc="Force on the point along z.", spaces=("plane", "space"))
    def height(self) -> Scalar:
        """Return ``z - x^2/(2 r)``."""
        x, z = (dot(self.b.position - self.a.position, self.a.to_world(n)) for n in (X, Z))
        return z - 0.5 * x * x / self.radius

    @constraint(reaction="across", unit="N", doc="Force on the point along y.", spaces=("space",))
    def aside(self) -> Scalar:
        """Return the place along y."""
        return dot(self.b.position - self.a.position, self.a.to_world(Y))

    @joint("a", "b", coordinates=("reach",), solves=("height", "aside"), spaces=("plane", "space"))
    def slide(self, reach: Scalar) -> Placement:
        """Place the point by its x."""
        return Placement(Vector(reach, 0.0, 0.5 * reach * reach / self.radius), axes="a")

    @observable(unit="m", doc="Place of the point along x of the frame.", spaces=("plane", "space"))
    def reach(self) -> Scalar:
        """Return the x of the point."""
        return dot(self.b.position - self.a.position, self.a.to_world(X))


class OwnFlywheel(Component):
    """A wheel whose moment of inertia changes twice a turn."""

    mean: float = parameter(0.5, unit="kg*m^2", above=0.0, doc="Mean moment of inertia.")
    swing: float = parameter(0.2, unit="kg*m^2", doc="By how much it changes.")
    shaft: Shaft = connector(Shaft, "The hinge that it is on.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return the kinetic energy."""
        return 0.5 * (self.mean + self.swing * cos(2.0 * self.shaft.value)) * self.shaft.rate * self.shaft.rate


class OwnLeak(Component):
    """A mass that changes with time; what leaves has the velocity that the body has there."""

    mass: float = signal(1.0, unit="kg", doc="Mass.")
    point: Point = connector(Point, "Where it is.")

    @inertia
    def matter(self) -> Iterable[PointInertia]:
        """Return the mass."""
        return [PointInertia([self.point], [[self.mass]])]


OWN: dict[str, type[Component]] = {
    "own_spring": OwnSpring,
    "own_swirl": OwnSwirl,
    "own_surface": OwnSurface,
    "own_wire": OwnWire,
    "own_flywheel": OwnFlywheel,
    "own_leak": OwnLeak,
}
"""Sorts of ties and their components."""
