"""LoadedBall: what a joint that turns in every way can carry."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import (
    Component,
    Load,
    Number,
    Scalar,
    Triple,
    Vector,
    as_vector,
    cos,
    dissipation,
    dot,
    force,
    is_zero,
    parameter,
    potential,
    signal,
    unilateral,
)
from atwood_library.interfaces.loads import (
    check_stops,
    damper_function,
    elastic_stop,
    past_bend,
    stop_restitution,
    turn_apart,
)


class LoadedBall(Component):
    """A joint between frames a and b that turn against each other about more than one axis.

    The spring has the energy ``k (1 - cos x)`` with the angle x of the whole turn, so its torque is ``k sin x`` about
    the axis of that turn, and it knows no direction. The damper's torque is against the relative angular velocity.
    The stop is a cone about an axis of frame a, in which the same axis of frame b stays.
    """

    stiffness: Number = parameter(0.0, unit="N*m/rad", minimum=0.0, doc="Torque of the spring for one small radian.")
    damping: Number = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque of the damper for one radian a second.")
    stop_stiffness: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of the stop for one radian beyond it.",
        symbol="k_s",
    )
    stop_axis: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Axis of the cone in frame a, and what stays within it in frame b."
    )
    bend_stop: Number | None = parameter(
        None,
        unit="rad",
        above=0.0,
        maximum=3.1,
        doc="Angle between the axes at which the stop acts; none if not given.",
    )
    stop_restitution: Number | None = stop_restitution()
    motor_x: Number = signal(0.0, unit="N*m", doc="Torque on frame b along x of frame a, and against frame a.")
    motor_y: Number = signal(0.0, unit="N*m", doc="Torque on frame b along y of frame a, and against frame a.")
    motor_z: Number = signal(0.0, unit="N*m", doc="Torque on frame b along z of frame a, and against frame a.")

    def check_values(self) -> None:
        """Refuse a stop that is rigid and elastic, and one that is nowhere."""
        super().check_values()
        check_stops(self, self.stop_stiffness, self.stop_restitution, self.bend_stop)

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stop."""
        joint: Any = self
        a, b = joint.a, joint.b
        energy: Scalar = 0.0
        if not is_zero(self.stiffness):
            # The trace of a turn by x is 1 + 2 cos x.
            turned = 0.5 * (sum(map(dot, a.axes, b.axes)) - 1.0) if self.in_space else cos(b.angle - a.angle)
            energy = energy + self.stiffness * (1.0 - turned)
        if self.bend_stop is None or self.stop_restitution is not None:
            return energy
        return energy + elastic_stop(self._past_stop(), self.stop_stiffness)

    @unilateral(
        reaction="bend_stop_torque",
        unit="N*m",
        restitution="stop_restitution",
        given=("bend_stop", "stop_restitution"),
        doc="Torque of the cone, where it is rigid.",
        spaces=("plane", "space"),
    )
    def within_bend_stop(self) -> Scalar:
        """Return how far the axis is within the cone."""
        return -self._past_stop()

    def _past_stop(self) -> Scalar:
        joint: Any = self
        axis = as_vector(self.stop_axis)
        assert self.bend_stop is not None
        return past_bend(dot(joint.a.to_world(axis), joint.b.to_world(axis)), self.bend_stop)

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        joint: Any = self
        return damper_function(lambda: tuple(joint.b.angular_velocity - joint.a.angular_velocity), self.damping)

    @force
    def motor_torque(self) -> Iterable[Load]:
        """Return the torque of the motors on both frames."""
        if all(is_zero(motor) for motor in (self.motor_x, self.motor_y, self.motor_z)):
            return
        joint: Any = self
        yield from turn_apart(joint.a, joint.b, joint.a.to_world(Vector(self.motor_x, self.motor_y, self.motor_z)))
