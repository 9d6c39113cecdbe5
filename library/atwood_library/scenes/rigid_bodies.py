"""rigid-bodies: a cuboid, a disc and five masses on ten rods, each turning freely."""

from __future__ import annotations

import math

from atwood import Model, Number, Scene, Triple, parameter
from atwood_library.parts.box import Box
from atwood_library.parts.disc import Disc
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class RigidBodies(Scene):
    """A cuboid and a disc from their sizes, and five equal masses that ten rods join each to each.

    The five masses are a triangle and two poles above and below it. Nine rods would do, so that one is too many: their
    tensions are not unique, and those of least size are reported. All of them turn about the vertical at one rate. The
    moments of inertia are those of textbooks: ``m (b^2 + c^2)/12``, ``m r^2/2`` and ``m r^2/4``, and sums over masses.
    """

    sides: Triple = parameter((0.3, 0.5, 0.8), unit="m", size=3, doc="Sides of the cuboid.")
    radius: Number = parameter(0.4, unit="m", above=0.0, doc="Radius of the disc, and of the triangle.")
    height: Number = parameter(0.5, unit="m", above=0.0, doc="Height of the poles above and below the triangle.")
    mass: Number = parameter(1.2, unit="kg", above=0.0, doc="Mass of the cuboid, of the disc and of each of the five.")
    rate: Number = parameter(3.0, unit="rad/s", doc="Rate at which they turn.")
    space = "space"
    gravity = 0.0
    t_end = 2.0

    def build(self) -> None:
        """Put them side by side."""
        x, y, z = self.sides
        self.add("cuboid", Model()).add("body", Box(length_x=x, length_y=y, length_z=z, mass=self.mass))
        self.add("disc", Model()).add("body", Disc(radius=self.radius, mass=self.mass, axis="z"))
        for number, name in enumerate(("cuboid", "disc")):
            self.start.update({f"{name}.body.spin.{axis}": self.rate * (axis == "z") for axis in "xyz"})
            self.start.update({f"{name}.body.velocity.{axis}": 0.0 for axis in "xyz"})
            self.start.update({f"{name}.body.position.{axis}": (number + 1.0) * 2.0 * (axis == "x") for axis in "xyz"})
            self.start.update({f"{name}.body.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
        frame = self.add("frame", Model())
        places = self.places()
        for n, place in enumerate(places):
            frame.add(f"mass{n}", PointMass(mass=self.mass))
            velocity = (-self.rate * place[1], self.rate * place[0], 0.0)
            for axis, where, speed in zip("xyz", place, velocity, strict=True):
                self.start[f"frame.mass{n}.position.{axis}"] = where
                self.start[f"frame.mass{n}.velocity.{axis}"] = speed
        for i, first in enumerate(places):
            for j in range(i):
                rod = frame.add(f"rod{j}{i}", Rod(length=math.dist(first, places[j])))
                frame.connect(rod.a, frame[f"mass{j}"].point)
                frame.connect(rod.b, frame[f"mass{i}"].point)

    def places(self) -> list[tuple[float, float, float]]:
        """Return where the five masses are at the start: the triangle, then the poles."""
        turns = [2.0 * math.pi * n / 3.0 for n in range(3)]
        ring = [(self.radius * math.cos(a), self.radius * math.sin(a), 0.0) for a in turns]
        return [*ring, (0.0, 0.0, self.height), (0.0, 0.0, -self.height)]
