"""TranslationalSensor: a displacement with its rates."""

from __future__ import annotations

from atwood import Component, Scalar, Slide, connector, observable, parameter
from atwood_library.interfaces.along_coordinates import accelerated, between


class TranslationalSensor(Component):
    """Measures a displacement and its first and second rate, from another one or from the ground."""

    synonyms = (
        *("PositionSensor", "Translational.Sensors.SpeedSensor", "Translational.Sensors.AccSensor"),
        *("RelPositionSensor", "Translational.Sensors.RelSpeedSensor"),
        *("Translational.Sensors.RelAccSensor", "MultiSensor", "Linear encoder", "Accelerometer"),
        *("Translational.Sensors.PositionSensor", "Translational.Sensors.MultiSensor"),
        "Translational.Components.RelativeStates",
    )

    against: str = parameter("ground", choices=("flange", "ground"), doc="What it is measured from.")
    a: Slide = connector(Slide, "The displacement that is measured from.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that is measured.")

    @observable(unit="m", doc="The displacement.", rate="speed")
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return between(self)[0]

    @observable(unit="m/s", doc="Its rate.")
    def speed(self) -> Scalar:
        """Return the rate."""
        return between(self)[1]

    @observable(unit="m/s^2", doc="Its second rate.")
    def acceleration(self) -> Scalar:
        """Return the second rate."""
        return accelerated(self)
