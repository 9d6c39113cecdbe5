"""RotationalSensor: an angle with its rates."""

from __future__ import annotations

from atwood import Component, Scalar, Shaft, connector, observable, parameter
from atwood_library.interfaces.along_coordinates import accelerated, between


class RotationalSensor(Component):
    """Measures an angle, turns counted, and its first and second rate, from another one or from the ground."""

    synonyms = (
        *("Rotational.Sensors.AngleSensor", "Rotational.Sensors.SpeedSensor"),
        *("Rotational.Sensors.AccSensor", "RelAngleSensor", "Rotational.Sensors.RelSpeedSensor"),
        *("Rotational.Sensors.RelAccSensor", "MultiSensor", "Encoder", "Tachometer"),
        *("Rotational.Sensors.MultiSensor", "Rotational.Components.RelativeStates"),
    )
    spaces = ("plane", "space")

    against: str = parameter("ground", choices=("flange", "ground"), doc="What it is measured from.")
    a: Shaft = connector(Shaft, "The angle that is measured from.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that is measured.")

    @observable(unit="rad", doc="The angle, turns counted.", rate="angular_velocity")
    def angle(self) -> Scalar:
        """Return the angle."""
        return between(self)[0]

    @observable(unit="rad/s", doc="Its rate.")
    def angular_velocity(self) -> Scalar:
        """Return the rate."""
        return between(self)[1]

    @observable(unit="rad/s^2", doc="Its second rate.")
    def angular_acceleration(self) -> Scalar:
        """Return the second rate."""
        return accelerated(self)
