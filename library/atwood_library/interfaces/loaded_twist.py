"""LoadedTwist: what a joint that also moves otherwise can carry about its axis."""

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


class LoadedTwist(AxisMotor):
    """A joint with `angle` and `angular_velocity` about an axis, beside displacements with loads of their own."""

    torsional_stiffness: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of the torsion spring for one radian.",
        symbol="kappa",
    )
    natural_angle: Number = parameter(
        0.0, unit="rad", doc="Angle at which the torsion spring has no torque.", symbol="theta_0"
    )
    torsional_damping: Number = parameter(
        0.0,
        unit="N*m*s/rad",
        minimum=0.0,
        doc="Torque of the torsion damper for one radian a second.",
        symbol="c_phi",
    )
    angle_stop_stiffness: Number = parameter(
        0.0,
        unit="N*m/rad",
        minimum=0.0,
        doc="Torque of a stop of the angle for one radian beyond it.",
        symbol="k_s",
    )
    lower_angle_stop: Number | None = parameter(
        None,
        unit="rad",
        doc="Angle below which a stop acts; none if not given.",
        symbol="theta_min",
    )
    upper_angle_stop: Number | None = parameter(
        None,
        unit="rad",
        doc="Angle above which a stop acts; none if not given.",
        symbol="theta_max",
    )
    angle_stop_restitution: Number | None = stop_restitution()

    def check_values(self) -> None:
        """Refuse stops that are rigid and elastic, and those that are nowhere."""
        super().check_values()
        check_stops(
            self, self.angle_stop_stiffness, self.angle_stop_restitution, self.lower_angle_stop, self.upper_angle_stop
        )

    @potential
    def torsion_energy(self) -> Scalar:
        """Return the energy in the torsion spring and in the stops of the angle."""
        joint: Any = self
        stops = stops_of(
            self.angle_stop_stiffness, self.angle_stop_restitution, self.lower_angle_stop, self.upper_angle_stop
        )
        return elastic_energy(joint.angle, (self.torsional_stiffness, self.natural_angle), stops)

    above_lower_angle_stop, below_upper_angle_stop = rigid_stops(
        lambda joint: joint.angle(),
        ("lower_angle_stop", "upper_angle_stop"),
        "angle_stop_restitution",
        unit="N*m",
        doc="Angle {way} the {end} stop.",
        reaction_doc="Torque of the {end} stop of the angle, where it is rigid.",
    )

    @dissipation
    def torsion_damper_function(self) -> Scalar:
        """Return half the power of the torsion damper."""
        joint: Any = self
        return damper_function(lambda: (joint.angular_velocity(),), self.torsional_damping)
