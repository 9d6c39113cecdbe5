"""LoadedHinge: what a joint can carry about its axis: a spring, a damper, a motor and stops.

All of them are absent, and cost nothing, while their parameters are zero or not given.
"""

from __future__ import annotations

from typing import Any

from atwood import Number, Scalar, dissipation, parameter, potential
from atwood_library.interfaces.axis_motor import AxisMotor
from atwood_library.interfaces.loads import (
    check_stops,
    damper_function,
    elastic_energy,
    rigid_stops,
    stop_restitution,
    stops_of,
)


class LoadedHinge(AxisMotor):
    """A joint between frames a and b with the observables `angle` and `angular_velocity`, which can carry loads."""

    stiffness: Number = parameter(0.0, unit="N*m/rad", minimum=0.0, doc="Torque of the spring for one radian.")
    natural_angle: Number = parameter(0.0, unit="rad", doc="Angle at which the spring has no torque.", symbol="theta_0")
    damping: Number = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque of the damper for one radian a second.")
    stop_stiffness: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of a stop for one radian beyond it.",
        symbol="k_s",
    )
    lower_stop: Number | None = parameter(
        None, unit="rad", doc="Angle below which a stop acts; none if not given.", symbol="theta_min"
    )
    upper_stop: Number | None = parameter(
        None, unit="rad", doc="Angle above which a stop acts; none if not given.", symbol="theta_max"
    )
    stop_restitution: Number | None = stop_restitution()

    def check_values(self) -> None:
        """Refuse stops that are rigid and elastic, and those that are nowhere."""
        super().check_values()
        check_stops(self, self.stop_stiffness, self.stop_restitution, self.lower_stop, self.upper_stop)

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stops."""
        joint: Any = self
        stops = stops_of(self.stop_stiffness, self.stop_restitution, self.lower_stop, self.upper_stop)
        return elastic_energy(joint.angle, (self.stiffness, self.natural_angle), stops)

    above_lower_stop, below_upper_stop = rigid_stops(
        lambda joint: joint.angle(),
        ("lower_stop", "upper_stop"),
        "stop_restitution",
        unit="N*m",
        doc="Angle {way} the {end} stop.",
        reaction_doc="Torque of the {end} stop, where it is rigid.",
    )

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        joint: Any = self
        return damper_function(lambda: (joint.angular_velocity(),), self.damping)
