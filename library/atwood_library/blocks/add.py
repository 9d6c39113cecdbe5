"""Add: the weighted sum of two signals."""

from __future__ import annotations

from atwood import Component, Number, Scalar, observable, parameter, signal


class Add(Component):
    """The weighted sum of two signals, ``y = weight_1 u_1 + weight_2 u_2``; with weights 1 and -1 their difference."""

    synonyms = ("Math.Add", "Math.Feedback", "Sum", "Summing point", "Math.Add3", "Math.MultiSum")

    weight_1: Number = parameter(1.0, unit="any", doc="Weight of the first.")
    weight_2: Number = parameter(1.0, unit="any", doc="Weight of the second.")
    u_1: Number = signal(0.0, unit="any", doc="The first.")
    u_2: Number = signal(0.0, unit="any", doc="The second.")

    @observable(unit="any", doc="The sum.")
    def y(self) -> Scalar:
        """Return the sum."""
        return self.weight_1 * self.u_1 + self.weight_2 * self.u_2
