"""SignalFunction: any function of signals."""

from __future__ import annotations

from typing import Any

from atwood import Component, Number, Scalar, observable, parameter, signal


class SignalFunction(Component):
    """A function of up to three signals and of time, ``y = f(u_1, u_2, u_3, t)``, by a formula.

    ``SignalFunction(function="u_1*u_2")`` is a product, ``"abs(u_1)"`` a rectifier, ``"maximum(u_1, u_2)"`` the larger
    one. The formula is given in text, by sympy, or as a Python function in plain arithmetic.
    """

    synonyms = (
        *("Math.Product", "Math.Division", "Math.Abs", "Math.Sign", "Math.Sqrt", "Math.Sin", "Math.Cos", "Math.Tan"),
        *("Math.Asin", "Math.Acos", "Math.Atan", "Math.Atan2", "Math.Exp", "Math.Log", "Math.Power", "Math.Max"),
        *("Math.Min", "Math.LinearDependency", "Multiplier", "Formula of signals", "Logical.Switch"),
    )

    function: Any = parameter(
        0.0,
        unit="any",
        function_of={"u_1": "any", "u_2": "any", "u_3": "any", "t": "s"},
        doc="The function.",
    )
    u_1: Number = signal(0.0, unit="any", doc="First signal.")
    u_2: Number = signal(0.0, unit="any", doc="Second signal.")
    u_3: Number = signal(0.0, unit="any", doc="Third signal.")

    @observable(unit="any", doc="The value.")
    def y(self) -> Scalar:
        """Return the value."""
        return self.function(self.u_1, self.u_2, self.u_3, self.time)
