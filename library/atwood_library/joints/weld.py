"""Weld: a rigid connection of two frames."""

from __future__ import annotations

from atwood import Component, Frame, Placement, as_vector, connector, is_zero, joint, parameter, turn


class Weld(Component):
    """A rigid connection: frame b keeps its place in frame a. What it joins becomes one body.

    Its `force` and `torque` are what it exerts on frame b and everything that hangs on it.
    """

    synonyms = ("FixedTranslation", "FixedRotation", "Rigid connection", "Fixed joint")

    displacement: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="m", size=3, doc="Position of frame b in the axes of frame a."
    )
    angle: float = parameter(0.0, unit="rad", doc="Rotation of frame b from frame a, right-handed about the axis.")
    axis: tuple[float, float, float] = parameter(
        (0.0, -1.0, 0.0), turning=True, doc="Axis of the rotation; unless reversed, counter-clockwise in a plane."
    )
    a: Frame = connector(Frame, "One frame.")
    b: Frame = connector(Frame, "The other frame.")

    @joint("a", "b", rigid=True, spaces=("line", "plane", "space"), reaction="exerted on frame b")
    def fixation(self) -> Placement:
        """Place b in the axes of a."""
        axis = as_vector(self.axis)
        rotation = turn(axis, self.angle) if self.in_space and not is_zero(self.angle) else -axis.y * self.angle
        return Placement(as_vector(self.displacement), rotation, axes="a")
