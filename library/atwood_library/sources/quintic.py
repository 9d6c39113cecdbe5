"""Quintic: a polynomial of fifth degree between two moments with given place, rate and second rate."""

from __future__ import annotations

from atwood import Component, Number, Scalar, maximum, minimum, observable, parameter


class Quintic(Component):
    """The polynomial of fifth degree that has given values, rates and second rates at two moments.

    Before and after them it goes on at the rate there. Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("Quintic trajectory", "Fifth-degree polynomial", "Hermite interpolation")

    start_time: Number = parameter(0.0, unit="s", doc="When it begins.", symbol="t_0")
    duration: Number = parameter(1.0, unit="s", above=0.0, doc="How long it takes.", symbol="T")
    start_value: Number = parameter(0.0, unit="any", doc="Value at its start, in the unit of the input.")
    end_value: Number = parameter(1.0, unit="any", doc="Value at its end.")
    start_rate: Number = parameter(0.0, unit="any", doc="Rate at its start.")
    end_rate: Number = parameter(0.0, unit="any", doc="Rate at its end.")
    start_acceleration: Number = parameter(0.0, unit="any", doc="Second rate at its start.")
    end_acceleration: Number = parameter(0.0, unit="any", doc="Second rate at its end.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value: Hermite's polynomials of fifth degree in the share s of the duration."""
        h = self.duration
        since = self.time - self.start_time
        s = minimum(maximum(since / h, 0.0), 1.0)
        beyond = minimum(since, 0.0) * self.start_rate + maximum(since - h, 0.0) * self.end_rate
        s3, r = s * s * s, 1.0 - s
        place = self.start_value + (self.end_value - self.start_value) * s3 * (10.0 + s * (6.0 * s - 15.0))
        rates = self.start_rate * s * (1.0 - s * s * (6.0 - s * (8.0 - 3.0 * s)))
        rates = rates + self.end_rate * s3 * (-4.0 + s * (7.0 - 3.0 * s))
        seconds = self.start_acceleration * s * s * r * r * r + self.end_acceleration * s3 * r * r
        return place + h * rates + 0.5 * h * h * seconds + beyond
