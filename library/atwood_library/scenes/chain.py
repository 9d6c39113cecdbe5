"""chain: point masses on massless rods, one below the other."""

from __future__ import annotations

import math

from atwood import Number, Point, Scene, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class Chain(Scene):
    """A chain of equal links, one end fixed, released horizontally at rest."""

    links: int = parameter(10, minimum=1, integer=True, doc="Number of links.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the whole chain.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass at the end of each link.")
    t_end = 1.0

    ground: Ground = Ground()

    def build(self) -> None:
        """Hang one link on the other."""
        rods = self.add("rod", [Rod(length=self.length / self.links) for _ in range(self.links)])
        bobs = self.add("bob", [PointMass(mass=self.mass) for _ in range(self.links)])
        end: Point = self.ground.frame
        for i, (rod, bob) in enumerate(zip(rods, bobs, strict=True)):
            self.connect(end, rod.a)
            self.connect(rod.b, bob.point)
            end = bob.point
            self.start[f"rod[{i}].angle"] = math.pi / 2.0
            self.start[f"rod[{i}].angular_velocity"] = 0.0
