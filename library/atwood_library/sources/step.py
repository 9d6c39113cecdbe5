"""Step: a function of time that jumps once."""

from __future__ import annotations

from atwood import Component, Number, Scalar, observable, parameter, select


class Step(Component):
    """A function of time that jumps once, from `offset` by `height` at `start_time`.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("Sources.Step", "Heaviside function", "BooleanStep")

    height: Number = parameter(1.0, unit="any", doc="By how much it jumps, in the unit of the input.")
    offset: Number = parameter(0.0, unit="any", doc="Value before, in the unit of the input.")
    start_time: Number = parameter(0.0, unit="s", doc="When it jumps.", symbol="t_0")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        return self.offset + select(self.time < self.start_time, 0.0, self.height)
