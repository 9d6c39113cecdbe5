"""ServoController: a cascade of position and speed control, as drives have it."""

from __future__ import annotations

from atwood import Component, Number, Scalar, derivative, observable, parameter, signal, state


class ServoController(Component):
    """A proportional position controller around a proportional-integral speed controller, as drives have it.

    ``y = gain (e + x) + feed_forward`` with the error of the speed ``e = position_gain (set_point - measurement) +
    set_rate - measured_rate`` and ``integral_time x' = e`` (Siciliano et al., Robotics, section 8.3). Without integral
    time it is a spring of stiffness ``gain position_gain`` with a damper, so that a load F leaves an error of
    ``F/(gain position_gain)``.
    """

    synonyms = ("Cascade controller", "Position controller", "Axis controller", "AxisControlBus", "PD controller")

    position_gain: Number = parameter(
        10.0, unit="1/s", minimum=0.0, doc="Wanted speed for a unit of position error.", symbol="K_p"
    )
    gain: Number = parameter(1.0, unit="any", minimum=0.0, doc="Command for a unit of speed error.", symbol="K")
    integral_time: Number | None = parameter(
        None,
        unit="s",
        above=0.0,
        doc="Time of the speed's integral part; none for no such part.",
        symbol="T_i",
    )
    set_point: Number = signal(0.0, unit="any", doc="What the measurement is to become.")
    set_rate: Number = signal(0.0, unit="any", doc="Rate of the set point.")
    measurement: Number = signal(0.0, unit="any", doc="The measurement.")
    measured_rate: Number = signal(0.0, unit="any", doc="Its rate.")
    feed_forward: Number = signal(0.0, unit="any", doc="What is added to the command.")
    integral: Scalar = state(0.0, unit="any", doc="Integral of the speed error over the integral time.")

    @derivative("integral")
    def rate(self) -> Scalar:
        """Return the rate."""
        return self.speed_error() / self.integral_time if self.integral_time is not None else 0.0

    def speed_error(self) -> Scalar:
        """Return by how much the speed is behind what the position error asks for."""
        return self.position_gain * self.error() + self.set_rate - self.measured_rate

    @observable(unit="any", doc="Set point less measurement.")
    def error(self) -> Scalar:
        """Return the error."""
        return self.set_point - self.measurement

    @observable(unit="any", doc="The command.")
    def y(self) -> Scalar:
        """Return the command."""
        return self.gain * (self.speed_error() + self.integral) + self.feed_forward
