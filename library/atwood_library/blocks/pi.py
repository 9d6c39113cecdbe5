"""PI: a proportional-integral controller."""

from __future__ import annotations

from atwood import Component, Number, Scalar, derivative, observable, parameter, signal, state


class PI(Component):
    """A proportional-integral controller, ``y = gain (u + x)`` with ``integral_time x' = u``."""

    synonyms = ("Continuous.PI", "PI controller", "Proportional-integral controller")

    gain: Number = parameter(1.0, unit="any", doc="Gain.", symbol="K")
    integral_time: Number = parameter(
        1.0, unit="s", above=0.0, doc="Time in which a step is integrated to its height.", symbol="T_i"
    )
    u: Number = signal(0.0, unit="any", doc="What is to become zero, as set point less measurement.")
    integral: Scalar = state(0.0, unit="any", doc="Integral of the input over the integral time.")

    @derivative("integral")
    def rate(self) -> Scalar:
        """Return the rate."""
        return self.u / self.integral_time

    @observable(unit="any", doc="The command.")
    def y(self) -> Scalar:
        """Return the command."""
        return self.gain * (self.u + self.integral)
