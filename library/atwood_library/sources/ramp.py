"""Ramp: a function of time that rises evenly."""

from __future__ import annotations

from atwood import Component, Number, ParameterError, Scalar, maximum, minimum, observable, parameter


class Ramp(Component):
    """A function of time that rises evenly, ``offset + slope t``, perhaps from a time on and for a while only.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("ContinuousClock", "Linear function of time", "Sources.Ramp", "Sources.Clock")

    slope: Number = parameter(1.0, unit="any", doc="Rise in a second, in the unit of the input.")
    offset: Number = parameter(0.0, unit="any", doc="Value where it begins to rise, in the unit of the input.")
    start_time: Number | None = parameter(None, unit="s", doc="When it begins to rise; none if always.", symbol="t_0")
    duration: Number | None = parameter(
        None, unit="s", minimum=0.0, doc="For how long it rises; none if for ever.", symbol="T"
    )

    def check_values(self) -> None:
        """Refuse an end without a beginning."""
        if self.duration is not None and self.start_time is None:
            raise ParameterError("it is given, and no start_time", where=f"{self.path}.duration", advice="Give both.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        if self.start_time is None:
            return self.offset + self.slope * self.time
        since = maximum(self.time - self.start_time, 0.0)
        return self.offset + self.slope * (since if self.duration is None else minimum(since, self.duration))
