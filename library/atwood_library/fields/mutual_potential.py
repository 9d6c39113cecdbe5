"""MutualPotential: what each of many points does to every other at a distance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from atwood import Number, Point, Scalar, connector, parameter
from atwood_library.interfaces.interaction import Interaction


class MutualPotential(Interaction):
    """The interaction of every two of n points: gravity, equal charges, or any function V(r) that all pairs share."""

    synonyms = ("N-body gravity", "All pairs")

    count: int = parameter(2, minimum=2, integer=True, doc="How many points.")
    charge: Number = parameter(1.0, unit="C", doc="For charges: that of each point.")
    point: Sequence[Point] = connector(Point, "The points.", count="count")

    def pairs(self) -> Iterator[tuple[Point, Point, Scalar]]:
        """Yield every two points."""
        for a, b in combinations(self.point, 2):
            yield a, b, self.charge * self.charge
