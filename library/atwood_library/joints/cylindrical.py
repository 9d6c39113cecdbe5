"""Cylindrical: a shaft that turns and slides in a bush."""

from __future__ import annotations

from atwood import Placement, Scalar, Shaft, Slide, as_vector, connector, joint, turn
from atwood_library.interfaces.loaded_slide import LoadedSlide
from atwood_library.interfaces.loaded_twist import LoadedTwist
from atwood_library.interfaces.parallel_axes import CommonAxis


class Cylindrical(CommonAxis, LoadedSlide, LoadedTwist):
    """A shaft in a bush: frame b turns about an axis of frame a and slides along it. A part of space.

    Along the axis and about it, it can carry springs, dampers, an actuator, a motor and stops.
    """

    synonyms = ("Cylindrical joint",)

    shaft: Shaft = connector(Shaft, "The angle, where gears take hold of it.", of="angle")
    carriage: Slide = connector(Slide, "The displacement, where gears take hold of it.", of="displacement")

    @joint("a", "b", coordinates=("displacement", "angle"), solves=("guide", "bearing"), spaces=("space",))
    def slide_and_turn(self, displacement: Scalar, angle: Scalar) -> Placement:
        """Place b along the axis, turned about it."""
        axis = as_vector(self.axis)
        return Placement(axis * displacement, turn(axis, angle), axes="a")
