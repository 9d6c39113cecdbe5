"""Sine: a harmonic function of time."""

from __future__ import annotations

from atwood import Component, Number, Scalar, observable, parameter, sin


class Sine(Component):
    """A harmonic function of time, ``offset + amplitude sin(angular_frequency t + phase)``.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("Sinusoid", "Cosine", "Sources.Sine")

    amplitude: Number = parameter(1.0, unit="any", doc="Amplitude, in the unit of the input.")
    angular_frequency: Number = parameter(1.0, unit="rad/s", doc="Angular frequency.")
    phase: Number = parameter(0.0, unit="rad", doc="Phase at time zero.")
    offset: Number = parameter(0.0, unit="any", doc="Mean value, in the unit of the input.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        return self.offset + self.amplitude * sin(self.angular_frequency * self.time + self.phase)
