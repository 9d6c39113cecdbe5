"""LoadedSlide: what a joint can carry along its axis: a spring, a damper, an actuator and stops.

All of them are absent, and cost nothing, while their parameters are zero or not given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import (
    Component,
    Load,
    Scalar,
    cross,
    dissipation,
    force,
    is_zero,
    maximum,
    minimum,
    parameter,
    potential,
    signal,
)


class LoadedSlide(Component):
    """A joint between frames a and b with the observables `displacement` and `speed`, which can carry loads."""

    stiffness: float = parameter(0.0, unit="N/m", minimum=0.0, doc="Force of the spring for one metre.")
    natural_length: float = parameter(0.0, unit="m", doc="Displacement at which the spring has no force.")
    damping: float = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force of the damper for one metre a second.")
    stop_stiffness: float = parameter(0.0, unit="N/m", minimum=0.0, doc="Force of a stop for one metre beyond it.")
    lower_stop: float | None = parameter(None, unit="m", doc="Displacement below which a stop acts; none if not given.")
    upper_stop: float | None = parameter(None, unit="m", doc="Displacement above which a stop acts; none if not given.")
    actuator: float = signal(0.0, unit="N", doc="Force of the actuator on frame b, and against frame a.")

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stops."""
        joint: Any = self
        energy: Scalar = 0.0
        if not is_zero(self.stiffness):
            stretch = joint.displacement() - self.natural_length
            energy = energy + 0.5 * self.stiffness * stretch * stretch
        if self.lower_stop is not None:
            below = minimum(joint.displacement() - self.lower_stop, 0.0)
            energy = energy + 0.5 * self.stop_stiffness * below * below
        if self.upper_stop is not None:
            above = maximum(joint.displacement() - self.upper_stop, 0.0)
            energy = energy + 0.5 * self.stop_stiffness * above * above
        return energy

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper (Rayleigh's function; Goldstein, section 1.5)."""
        if is_zero(self.damping):
            return 0.0
        joint: Any = self
        rate = joint.speed()
        return 0.5 * self.damping * rate * rate

    @force
    def actuator_force(self) -> Iterable[Load]:
        """Return the force of the actuator on both frames, at the place of frame b."""
        if is_zero(self.actuator):
            return
        joint: Any = self
        push = joint.axis_in_world() * self.actuator
        yield Load(joint.b, force=push)
        arm = joint.b.position - joint.a.position
        yield Load(joint.a, force=-push, torque=cross(arm, -push))
