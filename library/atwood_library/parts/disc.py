"""Disc: a round plate or a ring."""

from __future__ import annotations

import math

from atwood import Number, Outline, Scalar, parameter
from atwood_library.interfaces.shape import Shape, revolved
from atwood_library.interfaces.solid import Tensor


class Disc(Shape):
    """A round plate, or a ring, about an axis through its frame, which is at its centre.

    Its moments are ``m (R^2 + r^2)/2`` about its axis and ``m (3 (R^2 + r^2) + h^2)/12`` across, with the thickness h.
    Unless said otherwise its axis is y, so that in a plane it is a wheel. A hoop, with equal radii, and a disc without
    thickness have a mass but no density.
    """

    synonyms = ("Disk",)

    radius: Number = parameter(0.5, unit="m", above=0.0, doc="Outer radius, R.")
    inner_radius: Number = parameter(
        0.0, unit="m", minimum=0.0, doc="Radius of the hole, r; at most the outer one.", symbol="r_i"
    )
    thickness: Number = parameter(0.0, unit="m", minimum=0.0, doc="Thickness along the axis, h.", symbol="h")
    axis: str = parameter("y", choices=("x", "y", "z"), doc="Axis of the frame that it is square to.")

    def check_values(self) -> None:
        """Refuse a hole that is larger than the disc."""
        self.check_hole(self.inner_radius, self.radius)
        super().check_values()

    def volume(self) -> Scalar:
        """Return the volume."""
        return math.pi * (self.radius - self.inner_radius) * (self.radius + self.inner_radius) * self.thickness

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        squares = self.radius * self.radius + self.inner_radius * self.inner_radius
        return revolved(self.axis, squares / 2.0, (3.0 * squares + self.thickness * self.thickness) / 12.0)

    def outline(self) -> Outline:
        """Return what it looks like."""
        half, outer, inner = 0.5 * self.thickness, self.radius, self.inner_radius
        if inner == 0.0:
            return Outline.revolved(((0.0, -half), (outer, -half), (outer, half), (0.0, half)), self.axis)
        corners = ((inner, -half), (outer, -half), (outer, half), (inner, half))
        return Outline.revolved(corners, self.axis, is_ring=True)
