"""Spring: a linear line spring."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Number,
    Point,
    PointInertia,
    Scalar,
    connector,
    dot,
    inertia,
    is_zero,
    observable,
    parameter,
    potential,
)


class Spring(Component):
    """A spring between two points, linear in its extension, massless unless a mass is given.

    Potential energy ``1/2 k (d - d0)^2`` with the distance d of its ends (Goldstein, section 1.4). On a line the
    distance is signed in the order in which the ends start, as in a textbook's row of masses. A mass is spread evenly
    over the coils, each of which moves as its place between the ends does: ``m (va^2 + va . vb + vb^2)/6``; or it is at
    one place between them.
    """

    synonyms = (
        *("LineForce", "Translational spring in space", "LineForceWithMass", "Coil spring"),
        *("LineForceWithTwoMasses", "SpringDamperParallel", "SpringDamperSeries"),
    )

    stiffness: Number = parameter(1.0, unit="N/m", minimum=0.0, doc="Force for an extension by one metre.")
    natural_length: Number = parameter(0.0, unit="m", minimum=0.0, doc="Length without force.")
    acts: str = parameter(
        "restoring",
        choices=("restoring", "repelling"),
        doc="Whether it pulls back to its natural length, or pushes away from it as one of negative stiffness.",
    )
    mass: Number = parameter(0.0, unit="kg", minimum=0.0, doc="Mass of the spring.")
    mass_at: Number | None = parameter(
        None,
        minimum=0.0,
        maximum=1.0,
        doc="Where the mass is, from 0 at a to 1 at b; none if it is spread evenly.",
        symbol="eta",
    )
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    def signed_stiffness(self) -> Scalar:
        """Return the stiffness, negative where the spring repels."""
        return self.stiffness if self.acts == "restoring" else -self.stiffness

    @inertia
    def coils(self) -> Iterable[PointInertia]:
        """Return the inertia of the coils."""
        if is_zero(self.mass):
            return
        if self.mass_at is None:
            first, mixed, second = self.mass / 3.0, self.mass / 6.0, self.mass / 3.0
        else:
            s, rest = self.mass_at, 1.0 - self.mass_at
            first, mixed, second = self.mass * (rest * rest), self.mass * (s * rest), self.mass * (s * s)
        yield PointInertia([self.a, self.b], [[first, mixed], [mixed, second]])

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy; without natural length it is smooth where the ends meet."""
        if not self.on_a_line and is_zero(self.natural_length):
            r = self.b.position - self.a.position
            return 0.5 * self.signed_stiffness() * dot(r, r)
        extension = self.distance(self.a, self.b) - self.natural_length
        return 0.5 * self.signed_stiffness() * extension * extension

    @observable(unit="m", doc="Distance of the ends.")
    def length(self) -> Scalar:
        """Return the length."""
        return self.distance(self.a, self.b)

    @observable(unit="N", doc="Tension; negative when the spring pushes.")
    def tension(self) -> Scalar:
        """Return the tension."""
        return self.signed_stiffness() * (self.distance(self.a, self.b) - self.natural_length)
