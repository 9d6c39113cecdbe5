"""SecondOrder: a low-pass filter of second order."""

from __future__ import annotations

from atwood import Component, Number, Scalar, derivative, parameter, signal, state


class SecondOrder(Component):
    """A low-pass filter of second order, ``y'' + 2 damping w y' + w^2 y = gain w^2 u``.

    With a damping of ``1/sqrt(2)`` it is a Butterworth filter, with ``sqrt(3)/2`` one of Bessel.
    """

    synonyms = ("Continuous.SecondOrder", "PT2", "Low-pass filter", "Butterworth filter")

    gain: Number = parameter(1.0, unit="any", doc="What is left of a constant input.", symbol="K")
    angular_frequency: Number = parameter(1.0, unit="rad/s", above=0.0, doc="Angular frequency w.")
    damping: Number = parameter(0.7071067811865476, minimum=0.0, doc="Damping ratio.")
    start: Number = parameter(0.0, unit="any", doc="Value at the start.", symbol="y_0")
    u: Number = signal(0.0, unit="any", doc="What it follows.")
    y: Scalar = state(start, unit="any", doc="What follows.")
    rate: Scalar = state(0.0, unit="any", doc="Rate of what follows, in its unit a second.")

    @derivative("y", "rate")
    def rates(self) -> tuple[Scalar, Scalar]:
        """Return the rates."""
        w = self.angular_frequency
        return self.rate, w * (w * (self.gain * self.u - self.y) - 2.0 * self.damping * self.rate)
