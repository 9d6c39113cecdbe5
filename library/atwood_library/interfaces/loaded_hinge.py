"""LoadedHinge: what a joint can carry about its axis: a spring, a damper, a motor and stops.

All of them are absent, and cost nothing, while their parameters are zero or not given.
"""

from __future__ import annotations

from typing import Any

from atwood import Number, Scalar, dissipation, parameter, potential
from atwood_library.interfaces.axis_motor import AxisMotor
from atwood_library.interfaces.loads import damper_function, elastic_energy


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

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stops."""
        joint: Any = self
        stops = self.stop_stiffness, self.lower_stop, self.upper_stop
        return elastic_energy(joint.angle, (self.stiffness, self.natural_angle), stops)

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        joint: Any = self
        return damper_function(lambda: (joint.angular_velocity(),), self.damping)
