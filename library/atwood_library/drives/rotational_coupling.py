"""RotationalCoupling: two angles joined rigidly, and what passes between them."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Shaft, connector, constraint, observable, parameter


class RotationalCoupling(Component):
    """Two angles joined rigidly, as flanges bolted together; it measures the torque and the power that pass."""

    synonyms = (
        *("Rotational.Sensors.TorqueSensor", "Rotational.Sensors.PowerSensor", "Torque cell"),
        *("Flange connection", "Rotational.Components.Disc"),
    )
    spaces = ("plane", "space")

    offset: Number = parameter(0.0, unit="rad", doc="By how much b is ahead of a.")
    a: Shaft = connector(Shaft, "One angle.")
    b: Shaft = connector(Shaft, "The other angle.")

    @constraint(reaction="torque", unit="N*m", doc="Torque that a exerts on b.")
    def joined(self) -> Scalar:
        """Return by how much they are off."""
        return self.b.value - self.a.value - self.offset

    @observable(unit="W", doc="Power that passes from a to b.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("torque") * self.b.rate
