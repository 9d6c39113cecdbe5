"""Damper: a linear line damper."""

from __future__ import annotations

from atwood import Component, Number, Point, Scalar, connector, dissipation, dot, observable, parameter


class Damper(Component):
    """A massless damper between two points, linear in the rate of their distance.

    Rayleigh function ``1/2 c d'^2`` (Goldstein, section 1.5).
    """

    synonyms = ("DamperParallel", "Dashpot", "SpringDamperParallel", "SpringDamperSeries")

    damping: Number = parameter(1.0, unit="N*s/m", minimum=0.0, doc="Force for a rate of one metre a second.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @dissipation
    def rayleigh_function(self) -> Scalar:
        """Return half the dissipated power."""
        rate = self.rate()
        return 0.5 * self.damping * rate * rate

    @observable(unit="m/s", doc="Rate of the distance of the ends.")
    def rate(self) -> Scalar:
        """Return the rate of the distance."""
        velocity = self.b.velocity - self.a.velocity
        if self.on_a_line:
            return dot(velocity, self.line) * self.side(self.a, self.b)
        separation = self.b.position - self.a.position
        return dot(separation, velocity) / self.distance(self.a, self.b)

    @observable(unit="N", doc="Tension; negative when the damper pushes.")
    def tension(self) -> Scalar:
        """Return the tension."""
        return self.damping * self.rate()
