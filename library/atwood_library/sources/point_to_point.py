"""PointToPoint: from rest to rest with a largest speed and a largest acceleration."""

from __future__ import annotations

from atwood import Component, Number, Scalar, absolute, maximum, minimum, observable, parameter, select, sign, sqrt


class PointToPoint(Component):
    """The fastest way from rest to rest with a largest speed and a largest acceleration: a trapezoid of speed.

    Short ways never reach the largest speed. Its `value` is connected to an input, such as that of a drive, and takes
    the input's unit.
    """

    synonyms = ("KinematicPTP", "KinematicPTP2", "Trapezoidal speed profile", "Bang-bang trajectory")

    travel: Number = parameter(1.0, unit="any", doc="How far it goes, in the unit of the input.", symbol="s")
    largest_rate: Number = parameter(1.0, unit="any", above=0.0, doc="Largest rate.")
    largest_acceleration: Number = parameter(1.0, unit="any", above=0.0, doc="Largest second rate.")
    start_time: Number = parameter(0.0, unit="s", doc="When it begins.", symbol="t_0")
    offset: Number = parameter(0.0, unit="any", doc="Where it begins, in the unit of the input.")

    def times(self) -> tuple[Scalar, Scalar]:
        """Return for how long it speeds up, and when it begins to slow down."""
        way, v, a = absolute(self.travel), self.largest_rate, self.largest_acceleration
        reaches = way * a > v * v
        up = select(reaches, v / a, sqrt(maximum(way, 0.0) / a))
        return up, select(reaches, way / v, up)

    def phases(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return for how long it has sped up, gone on and slowed down."""
        up, slow = self.times()
        t = self.time - self.start_time
        first, between = minimum(maximum(t, 0.0), up), minimum(maximum(t - up, 0.0), slow - up)
        return first, between, minimum(maximum(t - slow, 0.0), up)

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value: the integral of a rate that rises, stays and falls."""
        up, _ = self.times()
        first, between, last = self.phases()
        a = self.largest_acceleration * sign(self.travel)
        return self.offset + a * (0.5 * first * first + up * between + up * last - 0.5 * last * last)

    @observable(unit="any", doc="Rate of the value.")
    def rate(self) -> Scalar:
        """Return the rate, which the last phase takes back."""
        first, _, last = self.phases()
        return self.largest_acceleration * sign(self.travel) * (first - last)
