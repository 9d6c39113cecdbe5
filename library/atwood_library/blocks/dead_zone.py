"""DeadZone: nothing within two bounds, and what goes beyond them."""

from __future__ import annotations

from atwood import Component, Number, ParameterError, Scalar, maximum, minimum, observable, parameter, signal


class DeadZone(Component):
    """By how much a signal is beyond one of two bounds; zero between them."""

    synonyms = ("Nonlinear.DeadZone", "Dead band")

    lower: Number = parameter(-1.0, unit="any", doc="Lower bound.")
    upper: Number = parameter(1.0, unit="any", doc="Upper bound.")
    u: Number = signal(0.0, unit="any", doc="What is compared with them.")

    def check_values(self) -> None:
        """Refuse bounds the wrong way round."""
        if not self.lower <= self.upper:
            raise ParameterError(
                f"the lower bound {self.lower:g} is above the upper one, {self.upper:g}", where=f"{self.path}.lower"
            )

    @observable(unit="any", doc="What is beyond.")
    def y(self) -> Scalar:
        """Return what is beyond."""
        return maximum(self.u - self.upper, 0.0) + minimum(self.u - self.lower, 0.0)
