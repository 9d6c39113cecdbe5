"""FirstOrder: a low-pass filter of first order."""

from __future__ import annotations

from atwood import Component, Number, Scalar, derivative, parameter, signal, state


class FirstOrder(Component):
    """A low-pass filter of first order, ``time_constant y' = gain u - y``: a lag."""

    synonyms = ("Continuous.FirstOrder", "Lag", "PT1", "Low-pass filter")

    gain: Number = parameter(1.0, unit="any", doc="What is left of a constant input.", symbol="K")
    time_constant: Number = parameter(1.0, unit="s", above=0.0, doc="In which a step comes to 63 %.", symbol="T")
    start: Number = parameter(0.0, unit="any", doc="Value at the start.", symbol="y_0")
    u: Number = signal(0.0, unit="any", doc="What it follows.")
    y: Scalar = state(start, unit="any", doc="What follows.")

    @derivative("y")
    def rate(self) -> Scalar:
        """Return the rate."""
        return (self.gain * self.u - self.y) / self.time_constant
