"""LossyGear: a gear whose teeth and bearings rub, so that it may lock itself."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood import Scalar, dry_friction, maximum, observable, parameter
from atwood_library.joints.gear import Gear

__all__ = ["LossyGear"]


class LossyGear(Gear):
    """A gear with friction of its teeth and of its bearings, by which it may stick.

    Where a drives, ``torque passed on = efficiency_a * torque of a - bearing_a``, and where b drives ``torque passed on
    = torque of a / efficiency_b - bearing_b``, both as they are seen at a and along the motion (C. Pelchen,
    C. Schweiger and M. Otter, *Modeling and Simulating the Efficiency of Gearboxes and of Planetary Gearboxes*, 2nd
    Modelica Conference, 2002, equations 10 to 16). At rest it holds whatever lies between the two directions.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        *("Worm gear", "Self-locking gear", "Gear with efficiency", "Rotational.Components.LossyGear"),
    )

    efficiency_a: Any = parameter(
        "1.0",
        unit="1",
        function_of={"v": "rad/s"},
        doc="Share that the teeth pass on where a drives, at a speed v of a.",
    )
    efficiency_b: Any = parameter(
        "1.0",
        unit="1",
        function_of={"v": "rad/s"},
        doc="Share that the teeth pass on where b drives, at a speed v of a.",
    )
    bearing_a: Any = parameter(
        "0.0", unit="N*m", function_of={"v": "rad/s"}, doc="Friction of the bearings, seen at a, where a drives."
    )
    bearing_b: Any = parameter(
        "0.0", unit="N*m", function_of={"v": "rad/s"}, doc="Friction of the bearings, seen at a, where b drives."
    )

    @dry_friction(reaction="loss_torque", unit="N*m", limit="largest", doc="Torque of the losses on joint a.")
    def turning(self) -> Scalar:
        """Speed of a past the housing."""
        return self.a.rate if self.support == "ground" else self.a.rate - self.housing.rate

    def largest(self) -> Scalar:
        """Return the loss in the direction of the motion."""
        way, rate = self.turning_direction, self.a.rate
        speed = way * (rate if self.support == "ground" else rate - self.housing.rate)
        passed = -(way * self.reaction("torque_a"))
        of_a = (passed + self.bearing_a(speed)) / self.efficiency_a(speed)
        of_b = (passed + self.bearing_b(speed)) * self.efficiency_b(speed)
        return maximum(of_a, of_b) - passed

    @observable(unit="N*m", doc="Torque of joint a on the gear, about its axis.")
    def input_torque(self) -> Scalar:
        """Return the torque."""
        return -(self.reaction("torque_a") + self.reaction("loss_torque"))
