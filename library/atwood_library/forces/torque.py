"""Torque: an applied torque."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, Frame, Load, Scalar, Vector, connector, force, observable, signal


class Torque(Component):
    """A torque on a frame, counter-clockwise, with a value given as a function of time."""

    value: float = signal(0.0, unit="N*m", doc="Torque, counter-clockwise, a function of time.")
    frame: Frame = connector(Frame, "Where the torque acts.")

    @force
    def applied_torque(self) -> Iterable[Load]:
        """Return the load; counter-clockwise is about -y."""
        yield Load(self.frame, torque=Vector(0.0, -self.value, 0.0))

    @observable(unit="N*m", doc="Torque, counter-clockwise.")
    def torque(self) -> Scalar:
        """Return the torque."""
        return self.value
