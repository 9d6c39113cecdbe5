"""Pulse: a function of time that is on and off in turn."""

from __future__ import annotations

from atwood import Component, Number, Scalar, floor, observable, parameter, select


class Pulse(Component):
    """A function of time that is on for a share of each period, and off for the rest.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("Sources.Pulse", "Rectangular wave", "Square wave", "BooleanPulse")

    amplitude: Number = parameter(1.0, unit="any", doc="How much more it is while on, in the unit of the input.")
    offset: Number = parameter(0.0, unit="any", doc="Value while off, in the unit of the input.")
    period: Number = parameter(1.0, unit="s", above=0.0, doc="Time from one pulse to the next.", symbol="T")
    width: Number = parameter(0.5, minimum=0.0, maximum=1.0, doc="Share of the period for which it is on.")
    start_time: Number = parameter(0.0, unit="s", doc="When the first pulse begins.", symbol="t_0")
    count: int | None = parameter(None, integer=True, minimum=1, doc="Number of pulses; endless if none.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        turns = (self.time - self.start_time) / self.period
        height = select(turns - floor(turns) < self.width, self.amplitude, 0.0)
        if self.count is not None:
            height = select(turns < self.count, height, 0.0)
        return self.offset + select(self.time < self.start_time, 0.0, height)
