"""Screw: a nut on a thread."""

from __future__ import annotations

from math import pi

from atwood import (
    Frame,
    Placement,
    Scalar,
    Shaft,
    Vector,
    as_vector,
    connector,
    constraint,
    cos,
    dot,
    joint,
    normals,
    observable,
    parameter,
    sin,
    turn,
)
from atwood_library.interfaces.bearings import angle_about, axes_parallel, rate_about, rate_along, sideways
from atwood_library.interfaces.loaded_hinge import LoadedHinge


class Screw(LoadedHinge):
    """A nut on a thread: frame b moves along an axis of frame a by `pitch` for each turn about it. A part of space.

    It can carry a spring, a damper, a motor and stops of the angle.
    """

    synonyms = ("Helical joint", "Screw joint")
    spaces = ("space",)

    axis: tuple[float, float, float] = parameter((0.0, 0.0, 1.0), direction=True, doc="Axis, in both frames.")
    pitch: float = parameter(0.01, unit="m", doc="Displacement for one turn; negative for a left-handed thread.")
    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")
    shaft: Shaft = connector(Shaft, "The angle, where gears take hold of it.", of="angle")

    def axis_in_world(self) -> Vector:
        """Return the axis in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction=("guide_1", "guide_2"),
        unit="N",
        doc="Multiplier of the guide: force on frame b along a normal of the axis.",
        spaces=("space",),
    )
    def guide(self) -> tuple[Scalar, Scalar]:
        """Return the distance from the axis along its two normals."""
        return sideways(self.a, self.b, as_vector(self.axis))

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of a bearing, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axes in the two frames differ."""
        return axes_parallel(self.a, self.b, as_vector(self.axis))

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

    @observable(unit="m", doc="Distance of frame b along the axis.", rate="speed", spaces=("space",))
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.", spaces=("space",))
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        return rate_along(self.a, self.b, as_vector(self.axis))

    @observable(
        unit="rad", doc="Angle of frame b about the axis.", periodic=True, rate="angular_velocity", spaces=("space",)
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        return angle_about(self.a, self.b, as_vector(self.axis))

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("space",))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return rate_about(self.a, self.b, as_vector(self.axis))
