"""Torque: an applied torque."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Frame,
    Load,
    Number,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    force,
    observable,
    parameter,
    signal,
)


class Torque(Component):
    """A torque on a frame about a given axis, as a given function of time.

    In a plane the axis is the plane's normal. In space it is fixed in the world, in the frame itself
    (``resolved_in="body"``), or in a third frame, `other`. With ``reacts_on="other"`` the opposite torque acts on
    `other`: a motor between two frames.
    """

    synonyms = ("WorldTorque", "Applied torque", "Couple", "WorldForceAndTorque", "ForceAndTorque")
    spaces = ("plane", "space")

    axis: Triple = parameter(
        (0.0, -1.0, 0.0),
        turning=True,
        doc="Axis, in the axes that it is resolved in; the torque is right-handed about it, so counter-clockwise in a "
        "plane unless reversed.",
    )
    resolved_in: str = parameter(
        "world", choices=("world", "body", "other"), doc="The axes in which the torque's axis is given."
    )
    reacts_on: str = parameter("world", choices=("world", "other"), doc="What takes the opposite torque.")
    value: Number = signal(0.0, unit="N*m", doc="Torque about the axis, a function of time.")
    frame: Frame = connector(Frame, "Where the torque acts.")
    other: Frame = connector(
        Frame,
        "The frame that the axis is given in, or that takes the opposite torque.",
        when={"resolved_in": ("other",), "reacts_on": ("other",)},
    )

    def in_world(self) -> Vector:
        """Return the axis in world axes."""
        axis = as_vector(self.axis)
        if self.resolved_in == "world":
            return axis
        return (self.frame if self.resolved_in == "body" else self.other).to_world(axis)

    @force
    def applied_torque(self) -> Iterable[Load]:
        """Return the load."""
        torque: Vector = self.in_world() * self.value
        yield Load(self.frame, torque=torque)
        if self.reacts_on == "other":
            yield Load(self.other, torque=-torque)

    @observable(unit="N*m", doc="Torque about the axis.")
    def torque(self) -> Scalar:
        """Return the torque."""
        return self.value

    @observable(unit="N*m", doc="Torque on the frame in world axes.", spaces=("space",))
    def torque_in_world(self) -> Vector:
        """Return the torque as a vector."""
        return self.in_world() * self.value
