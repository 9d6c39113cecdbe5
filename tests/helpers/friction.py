"""Parts of a user's own whose forces depend on their constraint forces: Coulomb friction."""

from __future__ import annotations

import math
from collections.abc import Iterable

from atwood import (
    Component,
    Frame,
    Load,
    Placement,
    Point,
    Scalar,
    Vector,
    absolute,
    as_vector,
    atan2,
    connector,
    constraint,
    cos,
    cross,
    dot,
    exp,
    force,
    joint,
    norm,
    observable,
    parameter,
    potential,
    signal,
    sin,
    sqrt,
)

from .stick_slip import StickSlip


class RoughSlope(StickSlip):
    """A point on a straight slope through the origin of a frame, with Coulomb friction."""

    angle: float = parameter(0.0, unit="rad", doc="Inclination, counter-clockwise.")
    friction: float = parameter(0.0, minimum=0.0, doc="Friction for each newton of normal force.")
    starts: str = parameter("slips_ahead", choices=("slips_ahead", "slips_back", "sticks"), doc="How it starts.")
    a: Frame = connector(Frame, "What carries the slope.")
    b: Point = connector(Point, "The point.")

    def along(self) -> Vector:
        """Return the direction of the slope."""
        return self.a.to_world(Vector(cos(self.angle), 0.0, sin(self.angle)))

    def across(self) -> Vector:
        """Return the normal of the slope."""
        return self.a.to_world(Vector(-sin(self.angle), 0.0, cos(self.angle)))

    def slip(self) -> Scalar:
        """Return how fast the point slides on the slope."""
        arm = self.b.position - self.a.position
        seen = self.b.velocity - self.a.velocity - cross(self.a.angular_velocity, arm)
        return dot(seen, self.along())

    @constraint(reaction="normal", unit="N", doc="Force on the point along the normal.")
    def wall(self) -> Scalar:
        """Return the distance from the slope."""
        return dot(self.b.position - self.a.position, self.across())

    @joint("a", "b", coordinates=("way",), solves=("wall",), spaces=("plane",))
    def slide(self, way: Scalar) -> Placement:
        """Place the point on the slope."""
        return Placement(Vector(cos(self.angle), 0.0, sin(self.angle)) * way, axes="a")

    @observable(unit="m", doc="Way along the slope.")
    def way(self) -> Scalar:
        """Return the way."""
        return dot(self.b.position - self.a.position, self.along())

    @constraint(reaction="grip", unit="N", doc="Force on the point along the slope.", modes=("sticks",))
    def hold(self) -> Scalar:
        """Return the slip."""
        return self.slip()

    def most(self) -> Scalar:
        """Return the largest friction."""
        return self.friction * absolute(self.reaction("normal"))

    def rub(self, sign: float) -> Iterable[Load]:
        """Return friction on the point, and its reaction."""
        push = self.along() * (sign * self.most())
        arm = self.b.position - self.a.position
        return [Load(self.b, push), Load(self.a, -push, -cross(arm, push))]

    @force(modes=("slips_ahead",))
    def rub_ahead(self) -> Iterable[Load]:
        """Return the friction while it slides ahead."""
        return self.rub(-1.0)

    @force(modes=("slips_back",))
    def rub_back(self) -> Iterable[Load]:
        """Return the friction while it slides back."""
        return self.rub(1.0)


class RoughHoop(Component):
    """A point on a rough ring in the plane, which slides counter-clockwise."""

    radius: float = parameter(1.0, unit="m", above=0.0, doc="Radius of the ring.")
    friction: float = parameter(0.0, minimum=0.0, doc="Friction for each newton of normal force.")
    rule: str = parameter("size", choices=("size", "inwards", "smooth"), doc="What is taken of the normal force.")
    a: Frame = connector(Frame, "What carries the ring, at its centre.")
    b: Point = connector(Point, "The point.")

    @constraint(reaction="normal", unit="N", sign=-1.0, doc="Force on the point towards the centre.")
    def ring(self) -> Scalar:
        """Return ``(r^2 - R^2)/(2 R)``, whose slope is one."""
        arm = self.b.position - self.a.position
        return 0.5 * dot(arm, arm) / self.radius - 0.5 * self.radius

    @joint("a", "b", coordinates=("angle",), solves=("ring",), spaces=("plane",))
    def go_round(self, angle: Scalar) -> Placement:
        """Place the point on the ring."""
        return Placement(Vector(cos(angle), 0.0, sin(angle)) * self.radius, axes="a")

    @observable(unit="rad", doc="Angle, counter-clockwise from the right.", periodic=True)
    def angle(self) -> Scalar:
        """Return the angle."""
        arm = self.b.position - self.a.position
        ahead, up = self.a.to_world(Vector(1.0, 0.0, 0.0)), self.a.to_world(Vector(0.0, 0.0, 1.0))
        return atan2(dot(arm, up), dot(arm, ahead))

    @force
    def rub(self) -> Iterable[Load]:
        """Return the friction."""
        normal = self.reaction("normal")
        size = {"size": absolute, "smooth": lambda n: sqrt(n * n + 0.01), "inwards": lambda n: n}[self.rule](normal)
        arm = (self.b.position - self.a.position) / self.radius
        push = Vector(arm.z, 0.0, -arm.x) * (self.friction * size)
        return [Load(self.b, push), Load(self.a, -push, -cross(arm * self.radius, push))]


class Capstan(Component):
    """A rope round a fixed post from a to b, which slips towards b: its tension grows by exp(mu phi)."""

    friction: float = parameter(0.2, minimum=0.0, doc="Friction of rope on post.")
    wrap: float = parameter(math.pi, unit="rad", doc="Angle of the rope on the post.")
    length: float = parameter(2.0, unit="m", above=0.0, doc="Length of the rope.")
    a: Point = connector(Point, "The end that is drawn in.")
    post: Point = connector(Point, "The post.")
    b: Point = connector(Point, "The end that is drawn out.")

    def spans(self) -> tuple[Vector, Vector]:
        """Return the ways from the post to both ends."""
        return self.a.position - self.post.position, self.b.position - self.post.position

    @constraint(reaction="tension", unit="N", sign=-1.0, doc="Tension at a.")
    def rope(self) -> Scalar:
        """Return by how much it is stretched."""
        first, second = self.spans()
        return norm(first) + norm(second) - self.length

    @force
    def rub(self) -> Iterable[Load]:
        """Return what the tension at b has more than that at a."""
        _, way = self.spans()
        pull = way / norm(way) * (-(exp(self.friction * self.wrap) - 1.0) * self.reaction("tension"))
        return [Load(self.b, pull), Load(self.post, -pull)]


class RoughPad(Component):
    """Friction on a point against x, of a size that comes from elsewhere."""

    friction: float = parameter(0.3, minimum=0.0, doc="Friction for each newton.")
    load: float = signal(0.0, unit="N", doc="Normal force.")
    b: Point = connector(Point, "The point.")

    @force
    def rub(self) -> Iterable[Load]:
        """Return the friction."""
        return [Load(self.b, Vector(-self.friction * self.load, 0.0, 0.0))]


class WrongPotential(RoughHoop):
    """A potential that reads a reaction."""

    @potential
    def energy(self) -> Scalar:
        """Return nonsense."""
        return self.reaction("normal") * self.radius


class JournalBearing(Component):
    """A hinge whose friction is that of its whole force on a pin, while it turns counter-clockwise."""

    friction: float = parameter(0.2, minimum=0.0, doc="Friction for each newton.")
    pin: float = parameter(0.05, unit="m", minimum=0.0, doc="Radius of the pin.")
    a: Frame = connector(Frame, "What carries the pin.")
    b: Frame = connector(Frame, "What turns on it.")

    @constraint(reaction=("force_x", "force_z"), unit="N", doc="Force on b.", spaces=("plane",))
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return the gap."""
        gap = self.b.position - self.a.position
        return gap.x, gap.z

    @joint("a", "b", coordinates=("angle",), solves=("bearing",), spaces=("plane",))
    def turn(self, angle: Scalar) -> Placement:
        """Turn b."""
        return Placement(Vector(0.0, 0.0, 0.0), angle)

    @observable(unit="rad", doc="Angle of b.")
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.b.angle - self.a.angle

    def moment(self) -> Scalar:
        """Return the torque of the friction."""
        x, z = self.reaction("force_x"), self.reaction("force_z")
        return self.friction * self.pin * sqrt(x * x + z * z)

    @force
    def rub(self) -> Iterable[Load]:
        """Return the friction; the y axis points into the page, clockwise."""
        torque = Vector(0.0, self.moment(), 0.0)
        return [Load(self.b, torque=torque), Load(self.a, torque=-torque)]


class RoughPlane(Component):
    """A rough plane in space on which a point slides any way."""

    spaces = ("space",)

    friction: float = parameter(0.2, minimum=0.0, doc="Friction for each newton.")
    normal: tuple[float, float, float] = parameter((0.0, 0.0, 1.0), direction=True, doc="Normal of the plane.")
    b: Point = connector(Point, "The point.")

    @constraint(reaction="support", unit="N", doc="Force along the normal.")
    def plane(self) -> Scalar:
        """Return the distance from the plane."""
        return dot(self.b.position, as_vector(self.normal))

    @force
    def rub(self) -> Iterable[Load]:
        """Return friction against the velocity."""
        v = self.b.velocity
        return [Load(self.b, v / norm(v) * (-self.friction * absolute(self.reaction("support"))))]
