"""Bar: a slender uniform body with two ends."""

from __future__ import annotations

import math

from atwood import Number, Outline, Scalar, parameter
from atwood_library.interfaces.shape import revolved
from atwood_library.interfaces.solid import Tensor
from atwood_library.interfaces.straight_shape import StraightShape


class Bar(StraightShape):
    """A slender uniform bar: ``m l^2/12`` across and nothing about its own axis.

    It is a rigid body with frames, where a `Rod` joins two points; and like a `Link`, but with its frame at its centre.
    In space its spin about its own axis has no inertia: it is left at rest where nothing acts on it, as between two
    balls or along a guide, and refused where something does. A `Cylinder` has some.
    """

    synonyms = ("Slender rod",)

    area: Number = parameter(1e-4, unit="m^2", above=0.0, doc="Area of its section, which counts with a density only.")

    def volume(self) -> Scalar:
        """Return the volume."""
        return self.area * self.length

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        return revolved(self.lies_along(), 0.0, self.length * self.length / 12.0)

    def outline(self) -> Outline:
        """Return what it looks like: a round bar of its section."""
        half, r = 0.5 * self.length, math.sqrt(self.area / math.pi)
        return Outline.revolved(((0.0, -half), (r, -half), (r, half), (0.0, half)), self.lies_along())
