"""LoadedHinge: what a joint can carry about its axis: a spring, a damper, a motor and stops.

All of them are absent, and cost nothing, while their parameters are zero or not given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, Load, Scalar, dissipation, force, is_zero, maximum, minimum, parameter, potential, signal


class LoadedHinge(Component):
    """A joint between frames a and b with the observables `angle` and `angular_velocity`, which can carry loads."""

    stiffness: float = parameter(0.0, unit="N*m/rad", minimum=0.0, doc="Torque of the spring for one radian.")
    natural_angle: float = parameter(0.0, unit="rad", doc="Angle at which the spring has no torque.")
    damping: float = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque of the damper for one radian a second.")
    stop_stiffness: float = parameter(
        0.0, unit="N*m/rad", minimum=0.0, doc="Torque of a stop for one radian beyond it."
    )
    lower_stop: float | None = parameter(None, unit="rad", doc="Angle below which a stop acts; none if not given.")
    upper_stop: float | None = parameter(None, unit="rad", doc="Angle above which a stop acts; none if not given.")
    motor: float = signal(0.0, unit="N*m", doc="Torque of the motor on frame b, and against frame a.")

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stops."""
        joint: Any = self
        energy: Scalar = 0.0
        if not is_zero(self.stiffness):
            twist = joint.angle() - self.natural_angle
            energy = energy + 0.5 * self.stiffness * twist * twist
        if self.lower_stop is not None:
            below = minimum(joint.angle() - self.lower_stop, 0.0)
            energy = energy + 0.5 * self.stop_stiffness * below * below
        if self.upper_stop is not None:
            above = maximum(joint.angle() - self.upper_stop, 0.0)
            energy = energy + 0.5 * self.stop_stiffness * above * above
        return energy

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper (Rayleigh's function; Goldstein, section 1.5)."""
        if is_zero(self.damping):
            return 0.0
        joint: Any = self
        rate = joint.angular_velocity()
        return 0.5 * self.damping * rate * rate

    @force
    def motor_torque(self) -> Iterable[Load]:
        """Return the torque of the motor on both frames."""
        if is_zero(self.motor):
            return
        joint: Any = self
        torque = joint.axis_in_world() * self.motor
        yield Load(joint.b, torque=torque)
        yield Load(joint.a, torque=-torque)
