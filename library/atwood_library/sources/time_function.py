"""TimeFunction: any function of time."""

from __future__ import annotations

from typing import Any

from atwood import Component, Scalar, observable, parameter


class TimeFunction(Component):
    """A function of time by a formula, in text, by sympy, or as a Python function in plain arithmetic, and its rates.

    ``TimeFunction(function="0.2*sin(3*t)*exp(-t)")``. Its `value` is connected to an input and takes the input's unit;
    the rates are derived exactly, where a controller or a drive needs them.
    """

    synonyms = (
        *("RealExpression", "Formula", "Expression of time", "Exponentials", "ExpSine"),
        *("Sources.Constant", "SawTooth", "Trapezoid", "LogFrequencySweep"),
        *("SineVariableFrequencyAndAmplitude", "Sinc"),
    )

    function: Any = parameter(0.0, unit="any", function_of={"t": "s"}, doc="The function.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        return self.function(self.time)

    @observable(unit="any", doc="Rate of the value.")
    def rate(self) -> Scalar:
        """Return the first derivative."""
        return self.function.derivative("t")(self.time)

    @observable(unit="any", doc="Second rate of the value.")
    def second_rate(self) -> Scalar:
        """Return the second derivative."""
        return self.function.derivative("t").derivative("t")(self.time)
