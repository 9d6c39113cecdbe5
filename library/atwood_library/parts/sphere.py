"""Sphere: a ball, solid or hollow."""

from __future__ import annotations

import math

from atwood import Number, Outline, Scalar, parameter
from atwood_library.interfaces.shape import Shape, diagonal
from atwood_library.interfaces.solid import Tensor


class Sphere(Shape):
    """A ball, solid or with a concentric cavity: ``2 m (R^5 - r^5)/(5 (R^3 - r^3))`` about every axis.

    With equal radii it is a thin shell, which has a mass but no density. Its frame is at its centre.
    """

    synonyms = ("Ball",)

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Outer radius, R.")
    inner_radius: Number = parameter(
        0.0, unit="m", minimum=0.0, doc="Radius of the cavity, r; at most the outer one.", symbol="r_i"
    )

    def check_values(self) -> None:
        """Refuse a cavity that is larger than the ball."""
        self.check_hole(self.inner_radius, self.radius)
        super().check_values()

    def volume(self) -> Scalar:
        """Return the volume, without cancellation for thin shells."""
        ratio = self.inner_radius / self.radius
        wall = self.radius - self.inner_radius
        return 4.0 / 3.0 * math.pi * self.radius * self.radius * wall * (1.0 + ratio + ratio * ratio)

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        ratio = self.inner_radius / self.radius
        cubes = 1.0 + ratio + ratio * ratio
        cube = ratio * ratio * ratio
        moment = 0.4 * self.radius * self.radius * ((cubes + cube + cube * ratio) / cubes)
        return diagonal(moment, moment, moment)

    def outline(self) -> Outline:
        """Return what it looks like from outside."""
        angles = [math.pi * (step / 18.0 - 0.5) for step in range(19)]
        inside = [(self.radius * math.cos(one), self.radius * math.sin(one)) for one in angles[1:-1]]
        return Outline.revolved([(0.0, -self.radius), *inside, (0.0, self.radius)])
