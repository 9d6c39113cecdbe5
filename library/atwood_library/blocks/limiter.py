"""Limiter: a signal within two bounds."""

from __future__ import annotations

from atwood import Component, Number, ParameterError, Scalar, maximum, minimum, observable, parameter, signal


class Limiter(Component):
    """A signal that is cut off at two bounds."""

    synonyms = ("Nonlinear.Limiter", "Saturation", "Clamp", "VariableLimiter")

    lower: Number = parameter(-1.0, unit="any", doc="Least value.")
    upper: Number = parameter(1.0, unit="any", doc="Greatest value.")
    u: Number = signal(0.0, unit="any", doc="What is cut off.")

    def check_values(self) -> None:
        """Refuse bounds the wrong way round."""
        if not self.lower <= self.upper:
            raise ParameterError(
                f"the least value {self.lower:g} is above the greatest, {self.upper:g}", where=f"{self.path}.lower"
            )

    @observable(unit="any", doc="What is left.")
    def y(self) -> Scalar:
        """Return what is left."""
        return minimum(maximum(self.u, self.lower), self.upper)
