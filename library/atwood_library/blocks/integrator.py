"""Integrator: the integral of a signal."""

from __future__ import annotations

from atwood import Component, Number, Scalar, derivative, parameter, signal, state


class Integrator(Component):
    """The integral of a signal over time, ``y' = gain u``."""

    synonyms = ("Continuous.Integrator", "I controller", "LimIntegrator")

    gain: Number = parameter(1.0, unit="any", doc="What the rate is of the input.", symbol="K")
    start: Number = parameter(0.0, unit="any", doc="Value at the start.", symbol="y_0")
    u: Number = signal(0.0, unit="any", doc="What is integrated.")
    y: Scalar = state(start, unit="any", doc="The integral.")

    @derivative("y")
    def rate(self) -> Scalar:
        """Return the rate."""
        return self.gain * self.u
