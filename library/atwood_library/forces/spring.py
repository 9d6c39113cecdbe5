"""Spring: a linear line spring."""

from __future__ import annotations

from atwood import Component, Point, Scalar, connector, dot, is_zero, observable, parameter, potential


class Spring(Component):
    """A massless spring between two points, linear in its extension.

    Potential energy ``1/2 k (d - d0)^2`` with the distance d of its ends (Goldstein, section 1.4). On a line the
    distance is signed in the order in which the ends start, as in a textbook's row of masses.
    """

    synonyms = ("LineForce",)

    stiffness: float = parameter(1.0, unit="N/m", minimum=0.0, doc="Force for an extension by one metre.")
    natural_length: float = parameter(0.0, unit="m", minimum=0.0, doc="Length without force.")
    acts: str = parameter(
        "restoring",
        choices=("restoring", "repelling"),
        doc="Whether it pulls back to its natural length, or pushes away from it as one of negative stiffness.",
    )
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    def signed_stiffness(self) -> Scalar:
        """Return the stiffness, negative where the spring repels."""
        return self.stiffness if self.acts == "restoring" else -self.stiffness

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
