"""PID: a controller with set-point weights, limited output and anti-windup."""

from __future__ import annotations

from atwood import (
    Component,
    Number,
    ParameterError,
    Scalar,
    derivative,
    is_zero,
    maximum,
    minimum,
    observable,
    parameter,
    signal,
    state,
)


class PID(Component):
    """A proportional-integral-derivative controller whose output is limited and whose integral then stops growing.

    ``v = gain (b s - m + x + d)``, in which s is the set point and m the measurement; ``integral_time x' = s - m +
    (y - v)/(gain anti_windup)`` with y the limited v, by back calculation; d is the derivative of ``c s - m`` times the
    derivative time, filtered with that time over `filter_ratio` (Astrom and Hagglund, Advanced PID Control, chapter 3).
    """

    synonyms = ("LimPID", "Continuous.PID", "PID controller", "Anti-windup")

    gain: Number = parameter(1.0, unit="any", above=0.0, doc="Gain.", symbol="K")
    integral_time: Number = parameter(0.5, unit="s", above=0.0, doc="Time of the integral part.", symbol="T_i")
    derivative_time: Number = parameter(0.1, unit="s", minimum=0.0, doc="Time of the derivative part.", symbol="T_d")
    filter_ratio: Number = parameter(10.0, above=0.0, doc="Derivative time over the time of its filter.")
    set_point_weight: Number = parameter(1.0, doc="Share b of the set point in the proportional part.")
    derivative_weight: Number = parameter(0.0, doc="Share c of the set point in the derivative part.")
    output_minimum: Number | None = parameter(None, unit="any", doc="Least command; none for no limit.")
    output_maximum: Number | None = parameter(None, unit="any", doc="Greatest command; none for no limit.")
    anti_windup: Number = parameter(0.9, above=0.0, doc="What is cut off changes the integral by this part of itself.")
    set_point: Number = signal(0.0, unit="any", doc="What the measurement is to become.")
    measurement: Number = signal(0.0, unit="any", doc="The measurement.")
    feed_forward: Number = signal(0.0, unit="any", doc="What is added to the command.")
    integral: Scalar = state(0.0, unit="any", doc="Integral part, over the gain.")
    filtered: Scalar = state(0.0, unit="any", doc="What the derivative part is the derivative of, filtered.")

    def check_values(self) -> None:
        """Refuse limits the wrong way round."""
        low, high = self.output_minimum, self.output_maximum
        if low is not None and high is not None and not low < high:
            raise ParameterError(
                f"the least command {low:g} is not below the greatest, {high:g}", where=f"{self.path}.output_minimum"
            )

    def wanted(self) -> Scalar:
        """Return the command before it is limited."""
        proportional = self.set_point_weight * self.set_point - self.measurement
        return self.gain * (proportional + self.integral + self.derivative_part()) + self.feed_forward

    def follows(self) -> Scalar:
        """Return by how much the filtered value is behind."""
        return self.derivative_weight * self.set_point - self.measurement - self.filtered

    def derivative_part(self) -> Scalar:
        """Return the filtered derivative."""
        return 0.0 if is_zero(self.derivative_time) else self.filter_ratio * self.follows()

    @derivative("integral", "filtered")
    def rates(self) -> tuple[Scalar, Scalar]:
        """Return the rates."""
        error = self.set_point - self.measurement
        cut = (self.y() - self.wanted()) / (self.gain * self.anti_windup)
        time = self.derivative_time
        rate = 0.0 if is_zero(time) else self.filter_ratio * self.follows() / time
        return (error + cut) / self.integral_time, rate

    @observable(unit="any", doc="The command.")
    def y(self) -> Scalar:
        """Return the command."""
        value = self.wanted()
        if self.output_maximum is not None:
            value = minimum(value, self.output_maximum)
        return value if self.output_minimum is None else maximum(value, self.output_minimum)
