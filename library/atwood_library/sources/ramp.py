"""Ramp: a function of time that rises evenly."""

from __future__ import annotations

from atwood import Component, Scalar, observable, parameter


class Ramp(Component):
    """A function of time that rises evenly, ``offset + slope t``.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("ContinuousClock", "Linear function of time")

    slope: float = parameter(1.0, unit="any", doc="Rise in a second, in the unit of the input.")
    offset: float = parameter(0.0, unit="any", doc="Value at time zero, in the unit of the input.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        return self.offset + self.slope * self.time
