"""TransferFunction: a linear system by its polynomials."""

from __future__ import annotations

from typing import Any

from atwood import Component, Number, ParameterError, Scalar, derivative, observable, parameter, signal, state


class TransferFunction(Component):
    """A linear system, ``Y(s)/U(s) = numerator(s)/denominator(s)``, with coefficients of falling powers.

    Its states are those of the controller canonical form: each is the rate of the next, and with a constant input the
    last one is the input over the last coefficient of the denominator.
    """

    synonyms = (
        *("Continuous.TransferFunction", "Laplace transform", "Rational function", "Derivative"),
        *("CriticalDamping", "LowpassButterworth", "Continuous.Filter", "PadeDelay"),
    )

    numerator: Any = parameter((1.0,), array=True, doc="Coefficients of the numerator, of falling powers of s.")
    denominator: Any = parameter((1.0, 1.0), array=True, doc="Coefficients of the denominator, of falling powers of s.")
    u: Number = signal(0.0, unit="any", doc="Input.")
    x: Any = state(0.0, unit="any", count=lambda known: len(known["denominator"]) - 1, doc="States.")

    def check_values(self) -> None:
        """Refuse polynomials that make no system."""
        for name in ("numerator", "denominator"):
            if isinstance(getattr(self, name)[0], tuple):
                raise ParameterError("it has rows, and is to be one row of coefficients", where=f"{self.path}.{name}")
        if self.denominator[0] == 0.0:
            raise ParameterError(
                "its first coefficient is zero", where=f"{self.path}.denominator", advice="Leave it out."
            )
        if len(self.numerator) > len(self.denominator):
            raise ParameterError(
                "its degree is above that of the denominator, so that the output would be a derivative of the input",
                where=f"{self.path}.numerator",
                advice="Add a factor that filters to the denominator.",
            )

    @derivative("x")
    def rates(self) -> list[Scalar]:
        """Return the rates."""
        first, *others = self.denominator
        fed = self.u - sum((a * x for a, x in zip(others, self.x, strict=True)), 0.0)
        return [fed / first, *self.x[:-1]][: len(self.x)]

    @observable(unit="any", doc="Output.")
    def y(self) -> Scalar:
        """Return the output."""
        first, *others = self.denominator
        padded = (0.0,) * (len(self.denominator) - len(self.numerator)) + tuple(self.numerator)
        through = padded[0] / first
        shares = [b - through * a for a, b in zip(others, padded[1:], strict=True)]
        return through * self.u + sum((c * x for c, x in zip(shares, self.x, strict=True)), 0.0)
