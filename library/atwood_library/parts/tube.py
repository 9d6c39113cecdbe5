"""Tube: a hollow circular cylinder."""

from __future__ import annotations

import math

from atwood import Number, Outline, Scalar, parameter
from atwood_library.interfaces.shape import revolved
from atwood_library.interfaces.solid import Tensor
from atwood_library.interfaces.straight_shape import StraightShape


class Tube(StraightShape):
    """A hollow circular cylinder: ``m (R^2 + r^2)/2`` about its axis, ``m (3 (R^2 + r^2) + l^2)/12`` across.

    With equal radii it is a thin-walled tube, which has a mass but no density.
    """

    synonyms = ("Hollow cylinder",)

    outer_radius: Number = parameter(0.1, unit="m", above=0.0, doc="Outer radius, R.", symbol="R")
    inner_radius: Number = parameter(
        0.08, unit="m", minimum=0.0, doc="Inner radius, r; at most the outer one.", symbol="r_i"
    )

    def check_values(self) -> None:
        """Refuse a bore that is wider than the tube."""
        self.check_hole(self.inner_radius, self.outer_radius)
        super().check_values()

    def volume(self) -> Scalar:
        """Return the volume."""
        outer, inner = self.outer_radius, self.inner_radius
        return math.pi * (outer - inner) * (outer + inner) * self.length

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        squares = self.outer_radius * self.outer_radius + self.inner_radius * self.inner_radius
        return revolved(self.lies_along(), squares / 2.0, (3.0 * squares + self.length * self.length) / 12.0)

    def outline(self) -> Outline:
        """Return what it looks like."""
        half, outer, inner = 0.5 * self.length, self.outer_radius, self.inner_radius
        if inner == 0.0:
            return Outline.revolved(((0.0, -half), (outer, -half), (outer, half), (0.0, half)), self.lies_along())
        corners = ((inner, -half), (outer, -half), (outer, half), (inner, half))
        return Outline.revolved(corners, self.lies_along(), is_ring=True)
