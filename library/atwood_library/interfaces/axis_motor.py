"""AxisMotor: a motor about the axis of a joint."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, Load, Number, force, is_zero, signal
from atwood_library.interfaces.loads import turn_apart


class AxisMotor(Component):
    """A joint between frames a and b with an `axis_in_world`, about which a motor turns b against a."""

    motor: Number = signal(0.0, unit="N*m", doc="Torque of the motor on frame b, and against frame a.")

    @force
    def motor_torque(self) -> Iterable[Load]:
        """Return the torque of the motor on both frames."""
        if is_zero(self.motor):
            return
        joint: Any = self
        yield from turn_apart(joint.a, joint.b, joint.axis_in_world() * self.motor)
