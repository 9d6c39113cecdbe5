"""StraightShape: what shapes with two ends on their axis have in common."""

from __future__ import annotations

from atwood import Frame, Number, Placement, Triple, connector, joint, parameter
from atwood_library.interfaces.shape import Axis, Shape, along


class StraightShape(Shape):
    """A shape along an axis of its frame, which is at its centre; frames a and b are in the middles of its ends."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length, from a to b.")
    axis: str = parameter(
        "z", choices=("x", "y", "z", "direction"), doc="Axis of the frame that it lies along, from a to b."
    )
    direction: Triple = parameter((0.0, 0.0, 1.0), direction=True, doc="With that axis, any direction in the frame.")
    a: Frame = connector(Frame, "The middle of the end at the negative side of the axis.")
    b: Frame = connector(Frame, "The middle of the end at the positive side of the axis.")

    def lies_along(self) -> Axis:
        """Return the axis that it lies along."""
        return self.direction if self.axis == "direction" else self.axis

    @joint("frame", "a", rigid=True, spaces=("line", "plane", "space"))
    def near_end(self) -> Placement:
        """Place a in the axes of the frame."""
        return Placement(along(self.lies_along(), -0.5 * self.length), 0.0, axes="a")

    @joint("frame", "b", rigid=True, spaces=("line", "plane", "space"))
    def far_end(self) -> Placement:
        """Place b in the axes of the frame."""
        return Placement(along(self.lies_along(), 0.5 * self.length), 0.0, axes="a")
