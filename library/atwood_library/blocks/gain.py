"""Gain: a multiple of a signal."""

from __future__ import annotations

from atwood import Component, Number, Scalar, observable, parameter, signal


class Gain(Component):
    """A multiple of a signal, ``y = gain u + offset``."""

    synonyms = ("Math.Gain", "P controller", "Proportional controller")

    gain: Number = parameter(1.0, unit="any", doc="What it is multiplied by.", symbol="K")
    offset: Number = parameter(0.0, unit="any", doc="What is added.")
    u: Number = signal(0.0, unit="any", doc="What is multiplied.")

    @observable(unit="any", doc="The multiple.")
    def y(self) -> Scalar:
        """Return the multiple."""
        return self.gain * self.u + self.offset
