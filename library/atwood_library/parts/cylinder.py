"""Cylinder: a solid circular cylinder."""

from __future__ import annotations

import math

from atwood import Number, Outline, Scalar, parameter
from atwood_library.interfaces.shape import revolved
from atwood_library.interfaces.solid import Tensor
from atwood_library.interfaces.straight_shape import StraightShape


class Cylinder(StraightShape):
    """A solid circular cylinder: ``m r^2/2`` about its axis, ``m (3 r^2 + l^2)/12`` across."""

    synonyms = ("BodyCylinder",)

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius.")

    def volume(self) -> Scalar:
        """Return the volume."""
        return math.pi * self.radius * self.radius * self.length

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        square = self.radius * self.radius
        return revolved(self.lies_along(), square / 2.0, (3.0 * square + self.length * self.length) / 12.0)

    def outline(self) -> Outline:
        """Return what it looks like."""
        half, r = 0.5 * self.length, self.radius
        return Outline.revolved(((0.0, -half), (r, -half), (r, half), (0.0, half)), self.lies_along())
