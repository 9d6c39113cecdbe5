"""MinimumJerk: from rest to rest, as smoothly as it goes."""

from __future__ import annotations

from atwood import Component, Number, Scalar, maximum, minimum, observable, parameter


class MinimumJerk(Component):
    """A way from rest to rest whose jerk, squared and integrated, is least: ``10 s^3 - 15 s^4 + 6 s^5``.

    (Flash and Hogan, J. Neuroscience 5, 1985.) Here s is the share of the duration that has passed. Its `value` is
    connected to an input, such as that of a drive, and takes the input's unit.
    """

    synonyms = ("Minimum-jerk trajectory", "Smooth step", "Quintic rest-to-rest polynomial")

    travel: Number = parameter(1.0, unit="any", doc="How far it goes, in the unit of the input.", symbol="s")
    duration: Number = parameter(1.0, unit="s", above=0.0, doc="How long it takes.", symbol="T")
    start_time: Number = parameter(0.0, unit="s", doc="When it begins.", symbol="t_0")
    offset: Number = parameter(0.0, unit="any", doc="Where it begins, in the unit of the input.")

    def share(self) -> Scalar:
        """Return the share of the duration that has passed."""
        return minimum(maximum((self.time - self.start_time) / self.duration, 0.0), 1.0)

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        s = self.share()
        return self.offset + self.travel * s * s * s * (10.0 + s * (6.0 * s - 15.0))

    @observable(unit="any", doc="Rate of the value.")
    def rate(self) -> Scalar:
        """Return the rate."""
        s = self.share()
        return 30.0 * self.travel / self.duration * s * s * (1.0 + s * (s - 2.0))
