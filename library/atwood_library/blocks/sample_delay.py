"""SampleDelay: a signal some samples later."""

from __future__ import annotations

from typing import Any

from atwood import Component, Number, Scalar, discrete_state, parameter, signal, update


class SampleDelay(Component):
    """A signal that is taken at sample times and put out some samples later."""

    synonyms = ("UnitDelay", "Discrete.UnitDelay", "Delay", "Dead time")

    period: Number = parameter(0.1, unit="s", doc="Sample time.", symbol="T")
    samples: int = parameter(1, integer=True, minimum=1, doc="By how many samples it is late.")
    start: Number = parameter(0.0, unit="any", doc="Value before there is any.", symbol="y_0")
    u: Number = signal(0.0, unit="any", doc="What is taken.")
    stored: Any = discrete_state(start, unit="any", count="samples", doc="What has been taken, the last first.")
    y: Scalar = discrete_state(start, unit="any", doc="What is put out.")

    @update(every="period", sets="y", reads=(), pure=True)
    def put_out(self) -> float:
        """Return what was taken so many samples before."""
        value: float = self.stored[-1]
        return value

    @update(every="period", sets="stored", pure=True)
    def take(self) -> list[float]:
        """Return what is stored from now on."""
        return [self.u, *self.stored[:-1]]
