"""four-bar-row: parallelograms in a row, which fall into line and go on."""

from __future__ import annotations

import math

from atwood import Frame, Number, Scene, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link


class FourBarRow(Scene):
    """Upright cranks in a row, their tops joined by couplers: many loops, one degree of freedom.

    The IFToMM benchmark A02, in the plane or, with ``space="space"``, in space, where each loop has three constraints
    too many. Twice in each turn all bars lie in one line; there any crank could turn either way, and what keeps them
    parallel is their motion alone.
    """

    windows: int = parameter(2, minimum=1, integer=True, doc="Number of four-bars.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of every bar.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of every bar.")
    speed: Number = parameter(1.0, unit="m/s", doc="Velocity of the first crank's top at the start, to the right.")
    t_end = 10.0

    def build(self) -> None:
        """Set up the row with its cranks upright."""
        count = self.windows
        thin = 1e-4 * self.mass * self.length**2
        grounds = self.add("ground", [Ground(position=(i * self.length, 0.0, 0.0)) for i in range(count + 1)])
        feet = self.add("foot", [Pivot() for _ in range(count + 1)])
        bars = [Link(length=self.length, mass=self.mass, axial_moment=thin) for _ in range(2 * count + 1)]
        cranks, couplers = self.add("crank", bars[: count + 1]), self.add("coupler", bars[count + 1 :])
        lefts = self.add("left", [Pivot() for _ in range(count)])
        rights = self.add("right", [Pivot() for _ in range(count)])
        for i, (ground, foot, crank) in enumerate(zip(grounds, feet, cranks, strict=True)):
            self.connect(ground.frame, foot.a)
            self.connect(foot.b, crank.a)
            self.guess[f"foot[{i}].angle"] = 0.5 * math.pi
        for i, (left, coupler, right) in enumerate(zip(lefts, couplers, rights, strict=True)):
            first: Frame = cranks[i].b
            self.connect(first, left.a)
            self.connect(left.b, coupler.a)
            self.connect(coupler.b, right.a)
            self.connect(right.b, cranks[i + 1].b)
            self.guess[f"left[{i}].angle"] = -0.5 * math.pi
            self.guess[f"right[{i}].angle"] = 0.5 * math.pi
        self.start["foot[0].angle"] = 0.5 * math.pi
        self.start["foot[0].angular_velocity"] = -self.speed / self.length
