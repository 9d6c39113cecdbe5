"""Screw: a nut on a thread."""

from __future__ import annotations

from math import pi

from atwood import (
    Number,
    Placement,
    Scalar,
    Shaft,
    as_vector,
    connector,
    constraint,
    cos,
    dot,
    joint,
    normals,
    parameter,
    sin,
    turn,
)
from atwood_library.interfaces.loaded_hinge import LoadedHinge
from atwood_library.interfaces.parallel_axes import CommonAxis


class Screw(CommonAxis, LoadedHinge):
    """A nut on a thread: frame b moves along an axis of frame a by `pitch` for each turn about it. A part of space.

    It can carry a spring, a damper, a motor and stops of the angle.
    """

    synonyms = ("Helical joint", "Screw joint")

    pitch: Number = parameter(0.01, unit="m", doc="Displacement for one turn; negative for a left-handed thread.")
    shaft: Shaft = connector(Shaft, "The angle, where gears take hold of it.", of="angle")

    @constraint(
        reaction="thread_torque", unit="N*m", doc="Torque of the thread on frame b about the axis.", spaces=("space",)
    )
    def thread(self) -> Scalar:
        """Return the sine of the angle that is missing; so no turn has to be counted."""
        axis = as_vector(self.axis)
        first, second = normals(axis)
        wanted = self.displacement() * (2.0 * pi / self.pitch)
        turned = self.b.to_world(first)
        along, across = dot(turned, self.a.to_world(first)), dot(turned, self.a.to_world(second))
        return across * cos(wanted) - along * sin(wanted)

    @joint("a", "b", coordinates=("angle",), solves=("guide", "bearing", "thread"), spaces=("space",))
    def wind(self, angle: Scalar) -> Placement:
        """Place b along the axis as far as it is turned about it."""
        axis = as_vector(self.axis)
        return Placement(axis * (angle * (self.pitch / (2.0 * pi))), turn(axis, angle), axes="a")
