"""LoadedCross: what the two hinges of a universal joint can carry."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, Load, Number, Scalar, as_vector, dissipation, force, is_zero, parameter, potential, signal
from atwood_library.interfaces.loads import (
    check_stops,
    damper_function,
    elastic_energy,
    rigid_stops,
    stop_restitution,
    stops_of,
    turn_apart,
)


class LoadedCross(Component):
    """A joint with `angle_a` and `rate_a` about `axis_a` of frame a, and `angle_b` and `rate_b` about `axis_b` of b."""

    stiffness_a: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of the spring about the first axis for one radian.",
        symbol="kappa_a",
    )
    natural_angle_a: Number = parameter(
        0.0, unit="rad", doc="First angle at which its spring has no torque.", symbol="alpha_0"
    )
    damping_a: Number = parameter(
        0.0,
        unit="N*m*s/rad",
        minimum=0.0,
        doc="Torque of the damper about the first axis for one radian a second.",
        symbol="c_a",
    )
    lower_stop_a: Number | None = parameter(
        None, unit="rad", doc="First angle below which a stop acts, if any.", symbol="alpha_min"
    )
    upper_stop_a: Number | None = parameter(
        None, unit="rad", doc="First angle above which a stop acts, if any.", symbol="alpha_max"
    )
    motor_a: Number = signal(0.0, unit="N*m", doc="Torque of the motor about the first axis on frame b, against a.")
    stiffness_b: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of the spring about the second axis for one radian.",
        symbol="kappa_b",
    )
    natural_angle_b: Number = parameter(
        0.0, unit="rad", doc="Second angle at which its spring has no torque.", symbol="beta_0"
    )
    damping_b: Number = parameter(
        0.0,
        unit="N*m*s/rad",
        minimum=0.0,
        doc="Torque of the damper about the second axis for one radian a second.",
        symbol="c_b",
    )
    lower_stop_b: Number | None = parameter(
        None, unit="rad", doc="Second angle below which a stop acts, if any.", symbol="beta_min"
    )
    upper_stop_b: Number | None = parameter(
        None, unit="rad", doc="Second angle above which a stop acts, if any.", symbol="beta_max"
    )
    motor_b: Number = signal(0.0, unit="N*m", doc="Torque of the motor about the second axis on frame b, against a.")
    stop_stiffness: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of a stop for one radian beyond it.",
        symbol="k_s",
    )

    stop_restitution: Number | None = stop_restitution()

    def check_values(self) -> None:
        """Refuse stops that are rigid and elastic, and those that are nowhere."""
        super().check_values()
        bounds = self.lower_stop_a, self.upper_stop_a, self.lower_stop_b, self.upper_stop_b
        check_stops(self, self.stop_stiffness, self.stop_restitution, *bounds)

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the springs and in the stops."""
        joint: Any = self
        stops_a = stops_of(self.stop_stiffness, self.stop_restitution, self.lower_stop_a, self.upper_stop_a)
        stops_b = stops_of(self.stop_stiffness, self.stop_restitution, self.lower_stop_b, self.upper_stop_b)
        first = elastic_energy(joint.angle_a, (self.stiffness_a, self.natural_angle_a), stops_a)
        return first + elastic_energy(joint.angle_b, (self.stiffness_b, self.natural_angle_b), stops_b)

    above_lower_stop_a, below_upper_stop_a = rigid_stops(
        lambda joint: joint.angle_a(),
        ("lower_stop_a", "upper_stop_a"),
        "stop_restitution",
        unit="N*m",
        doc="First angle {way} its {end} stop.",
        reaction_doc="Torque of the {end} stop of the first angle, where it is rigid.",
        spaces=("space",),
    )
    above_lower_stop_b, below_upper_stop_b = rigid_stops(
        lambda joint: joint.angle_b(),
        ("lower_stop_b", "upper_stop_b"),
        "stop_restitution",
        unit="N*m",
        doc="Second angle {way} its {end} stop.",
        reaction_doc="Torque of the {end} stop of the second angle, where it is rigid.",
        spaces=("space",),
    )

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the dampers."""
        joint: Any = self
        first = damper_function(lambda: (joint.rate_a(),), self.damping_a)
        return first + damper_function(lambda: (joint.rate_b(),), self.damping_b)

    @force
    def motor_torques(self) -> Iterable[Load]:
        """Return the torques of the motors; the axes are square, so each works on its own angle alone."""
        joint: Any = self
        for frame, axis, motor in ((joint.a, joint.axis_a, self.motor_a), (joint.b, joint.axis_b, self.motor_b)):
            if not is_zero(motor):
                yield from turn_apart(joint.a, joint.b, frame.to_world(as_vector(axis)) * motor)
