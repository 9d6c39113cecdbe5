"""PairPotential: what two points do to each other at a distance."""

from __future__ import annotations

from collections.abc import Iterator

from atwood import Number, Point, Scalar, Vector, connector, norm, observable, parameter
from atwood_library.interfaces.interaction import Interaction


class PairPotential(Interaction):
    """The interaction of two points at a distance: gravity, charges of either sign, or any function V(r).

    Both feel it, along the line that joins them (Goldstein, section 3.1).
    """

    synonyms = ("Two-body force", "Central force", "Coulomb force", "Newtonian gravity")

    charge_a: Number = parameter(1.0, unit="C", doc="For charges: that of a.")
    charge_b: Number = parameter(1.0, unit="C", doc="For charges: that of b.")
    a: Point = connector(Point, "One point.")
    b: Point = connector(Point, "The other point.")

    def pairs(self) -> Iterator[tuple[Point, Point, Scalar]]:
        """Yield the pair."""
        yield self.a, self.b, self.charge_a * self.charge_b

    @observable(unit="m", doc="Distance of the points.")
    def distance_apart(self) -> Scalar:
        """Return the distance."""
        return norm(self.b.position - self.a.position)

    @observable(unit="N", doc="Force on b, in world axes.")
    def force(self) -> Vector:
        """Return the force."""
        return self.pull(*next(self.pairs()))
