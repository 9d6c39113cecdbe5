"""Ground: a frame fixed in the world."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Number,
    Placement,
    Triple,
    as_vector,
    connector,
    is_zero,
    joint,
    parameter,
    turn,
)


class Ground(Component):
    """A frame fixed in the world.

    Its `force` and `torque` are what the ground exerts on everything that is connected to it.
    """

    synonyms = ("Fixed", "World frame", "World", "MultiBody.Parts.Fixed")

    position: Triple = parameter(
        (0.0, 0.0, 0.0),
        unit="m",
        size=3,
        place=True,
        doc="Position in world axes (x right, y into the page, z up).",
    )
    angle: Number = parameter(0.0, unit="rad", doc="Rotation in the plane x-z, counter-clockwise; in space, about -y.")
    axis: Triple = parameter(
        (0.0, -1.0, 0.0), turning=True, doc="Another axis of the rotation, which is right-handed about it."
    )
    frame: Frame = connector(Frame, "The fixed frame.")

    @joint("world", "frame", rigid=True, spaces=("line", "plane", "space"), reaction="exerted by the ground")
    def fixation(self) -> Placement:
        """Place the frame in the world."""
        axis = as_vector(self.axis)
        along_y = not self.in_space or (is_zero(axis.x) and is_zero(axis.z))
        return Placement(as_vector(self.position), -axis.y * self.angle if along_y else turn(axis, self.angle))
