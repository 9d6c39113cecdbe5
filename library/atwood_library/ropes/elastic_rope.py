"""ElasticRope: a rope that gives, over any number of pulleys."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from atwood import (
    Component,
    Groove,
    Number,
    Point,
    Scalar,
    connector,
    dissipation,
    dot,
    is_zero,
    observable,
    parameter,
    potential,
    select,
    signal,
)


class ElasticRope(Component):
    """A massless rope that stretches from a to b over any number of ideal pulleys, and never pushes.

    Its tension is ``k (s - l)`` where the path s from a to b is longer than the rope, and zero where it is slack; while
    it is stretched, a damper takes half the power ``c s'^2/2``. A winch that lets it out is the input `paid_out`.
    """

    synonyms = ("Bungee", "Elastic cable", "Tether")

    pulleys: int = parameter(0, minimum=0, integer=True, doc="How many pulleys it passes.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length without tension.")
    stiffness: Number = parameter(1e3, unit="N/m", above=0.0, doc="Tension for an extension by one metre.")
    damping: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Tension for a metre a second, while stretched.")
    paid_out: Number = signal(0.0, unit="m", doc="Length that is let out besides, a function of time.")
    a: Point = connector(Point, "One end.")
    over: Sequence[Groove] = connector(Groove, "The pulleys it passes, in order from a to b.", count="pulleys")
    b: Point = connector(Point, "The other end.")

    def pieces(self) -> list[tuple[Point, Point]]:
        """Return the ends of the straight pieces, from a to b."""
        return list(pairwise([self.a, *self.over, self.b]))

    @observable(unit="m", doc="Length of the path from a to b.")
    def reach(self) -> Scalar:
        """Return the sum of the straight pieces."""
        total: Scalar = 0.0
        for p, q in self.pieces():
            total = total + self.distance(p, q, None if self.pulleys else 1.0)
        return total

    def extension(self) -> Scalar:
        """Return by how much it is longer than without tension."""
        return self.reach() - self.length - self.paid_out

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        extension = self.extension()
        return select(extension > 0.0, 0.5 * self.stiffness * extension * extension, 0.0)

    @dissipation
    def loss(self) -> Scalar:
        """Return half the power that the damper takes while the rope is stretched."""
        if is_zero(self.damping):
            return 0.0
        rate: Scalar = 0.0
        for p, q in self.pieces():
            apart = q.velocity - p.velocity
            rate = rate + dot(apart, q.position - p.position) / self.distance(p, q, None if self.pulleys else 1.0)
        return select(self.extension() > 0.0, 0.5 * self.damping * rate * rate, 0.0)

    @observable(unit="N", doc="Tension of the spring in it.")
    def tension(self) -> Scalar:
        """Return the tension without that of the damper."""
        extension = self.extension()
        return select(extension > 0.0, self.stiffness * extension, 0.0)
