"""Cone: a solid circular cone."""

from __future__ import annotations

import math

from atwood import Frame, Number, Outline, Placement, Scalar, Vector, connector, joint, parameter
from atwood_library.interfaces.shape import Shape, along, revolved
from atwood_library.interfaces.solid import Tensor


class Cone(Shape):
    """A solid circular cone; its frame is at the centre of its base, and its tip lies along an axis of the frame.

    Its centre of mass is at a quarter of its height, and about it the moments are ``3 m r^2/10`` about the axis and
    ``3 m (4 r^2 + h^2)/80`` across.
    """

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of the base, r.")
    height: Number = parameter(0.2, unit="m", above=0.0, doc="Height, h, from the base to the tip.")
    axis: str = parameter("z", choices=("x", "y", "z"), doc="Axis of the frame that points from the base to the tip.")
    tip: Frame = connector(Frame, "The tip.")

    def volume(self) -> Scalar:
        """Return the volume."""
        return math.pi / 3.0 * self.radius * self.radius * self.height

    def center_of_mass(self) -> Vector:
        """Return the centre of mass."""
        return along(self.axis, 0.25 * self.height)

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        square = self.radius * self.radius
        return revolved(self.axis, 0.3 * square, 3.0 / 80.0 * (4.0 * square + self.height * self.height))

    @joint("frame", "tip", rigid=True, spaces=("line", "plane", "space"))
    def top(self) -> Placement:
        """Place the tip in the axes of the frame."""
        return Placement(along(self.axis, self.height), 0.0, axes="a")

    def outline(self) -> Outline:
        """Return what it looks like."""
        return Outline.revolved(((0.0, 0.0), (self.radius, 0.0), (0.0, self.height)), self.axis)
