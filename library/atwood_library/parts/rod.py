"""Rod: two points at a fixed distance."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Number,
    Placement,
    Point,
    PointInertia,
    Scalar,
    Vector,
    atan2,
    connector,
    constraint,
    cos,
    dot,
    inertia,
    joint,
    observable,
    parameter,
    sin,
)
from atwood_library.interfaces.poles import angle_off_pole, rate_off_pole


class Rod(Component):
    """A straight rod, hinged at both ends: it keeps its ends at a fixed distance.

    Without mass it only carries a tension. With mass it is uniform and slender; its kinetic energy in terms of the
    velocities of its ends is ``m/6 (v_a^2 + v_a.v_b + v_b^2)`` (the integral of ``1/2 v^2`` over its length, in
    which the velocity is linear). The angle is zero when b hangs straight below a, and counter-clockwise; in space it
    is that of the rod as seen along y.
    """

    synonyms = ("SphericalSpherical", "Massless rod")

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length.")
    mass: Number = parameter(0.0, unit="kg", minimum=0.0, doc="Mass, spread uniformly.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @inertia
    def uniform_rod(self) -> Iterable[PointInertia]:
        """Return the consistent mass matrix of the two ends."""
        third, sixth = self.mass / 3.0, self.mass / 6.0
        yield PointInertia((self.a, self.b), ((third, sixth), (sixth, third)))

    @constraint(
        reaction="tension",
        unit="N",
        sign=-1.0,
        doc="Tension, with mass its mean over the length; negative when pushed.",
    )
    def fixed_distance(self) -> Scalar:
        """Return ``(r^2 - l^2)/(2 l)``, whose multiplier is minus the tension; on a line, the distance less l."""
        if self.on_a_line:
            return self.distance(self.a, self.b) - self.length
        r = self.b.position - self.a.position
        return dot(r, r) * (0.5 / self.length) - 0.5 * self.length

    @joint("a", "b", coordinates=("angle",), solves=("fixed_distance",), spaces=("plane",))
    def swing(self, angle: Scalar) -> Placement:
        """Place b at an angle from the downward vertical through a."""
        return Placement(Vector(self.length * sin(angle), 0.0, -(self.length * cos(angle))))

    @joint("a", "b", solves=("fixed_distance",), spaces=("line",))
    def stand_off(self) -> Placement:
        """Place b on the line, on the side of a where it starts."""
        return Placement(self.line * (self.side(self.a, self.b) * self.length))

    @observable(
        unit="rad",
        doc="Angle from the downward vertical, counter-clockwise.",
        periodic=True,
        rate="angular_velocity",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle; in space, where both ends are seen at one place, it is as if the rod hung."""
        r = self.b.position - self.a.position
        if not self.in_space:
            return atan2(r.x, -r.z)
        return angle_off_pole(r.x, -r.z, self.length)

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return ``(r x v) / r^2``, of the components along x and z."""
        r = self.b.position - self.a.position
        v = self.b.velocity - self.a.velocity
        turning, square = r.x * v.z - r.z * v.x, r.x * r.x + r.z * r.z
        return rate_off_pole(turning, square, square, self.length) if self.in_space else turning / square
