"""LinkedRope: a heavy rope as a row of rods and masses."""

from __future__ import annotations

from atwood import Model, Number, Point, connector, parameter
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class LinkedRope(Model):
    """A heavy rope, or a chain, as a row of equal rods that bend freely where they meet; its mass is where they meet.

    Half a link's mass is at each end. It does not stretch, and can push, which a slack rope does not notice.
    """

    synonyms = ("Heavy rope", "Cable", "Catenary")

    links: int = parameter(10, minimum=2, integer=True, doc="Number of links.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the whole rope.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the whole rope.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    def build(self) -> None:
        """Join one link to the next."""
        rods = self.add("rod", [Rod(length=self.length / self.links) for _ in range(self.links)])
        share = self.mass / self.links
        ends = [0.5 * share, *[share] * (self.links - 1), 0.5 * share]
        knots = self.add("knot", [PointMass(mass=one) for one in ends])
        self.connect(self.a, knots[0].point)
        for number, rod in enumerate(rods):
            self.connect(knots[number].point, rod.a)
            self.connect(rod.b, knots[number + 1].point)
        self.connect(self.b, knots[-1].point)
