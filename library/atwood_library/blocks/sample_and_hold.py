"""SampleAndHold: a signal taken at sample times and held between them."""

from __future__ import annotations

from atwood import Component, Number, Scalar, discrete_state, parameter, signal, update


class SampleAndHold(Component):
    """A signal that is taken at sample times and held until the next."""

    synonyms = ("ZeroOrderHold", "Sampler", "Discrete.Sampler", "TriggeredSampler")

    period: Number = parameter(0.1, unit="s", doc="Sample time.", symbol="T")
    start: Number = parameter(0.0, unit="any", doc="Value before the first sample.", symbol="y_0")
    u: Number = signal(0.0, unit="any", doc="What is taken.")
    y: Scalar = discrete_state(start, unit="any", doc="What is held.")

    @update(every="period", sets="y", pure=True)
    def take(self) -> float:
        """Return the input."""
        return self.u
