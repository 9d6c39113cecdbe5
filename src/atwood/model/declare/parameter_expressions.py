"""Values that are worked out later, from the parameters of an enclosing model: ``Rod(length=length / 2)``."""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from atwood.errors import DeclarationError, ParameterError
from atwood.model.values.units import Exponents, Unit, unit_of

if TYPE_CHECKING:
    from atwood.model.declare.component import Component


OPERATIONS: Mapping[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": lambda a, b: (float(a) if isinstance(a, int) else a) ** b,  # whole numbers would grow without end
    "neg": operator.neg,
}
"""What a deferred value can be made with."""


class ParameterExpression:
    """A value that is worked out from the parameters of the model that encloses a part.

    Parameters
    ----------
    operation
        One of `OPERATIONS`.
    arguments
        Numbers and deferred values.
    unit
        The unit of the result; None where it is not known.
    """

    def __init__(self, operation: str, arguments: tuple[Any, ...], unit: Unit | None) -> None:
        self.operation = operation
        self.arguments = arguments
        self.unit = unit

    def value_in(self, model: Component) -> Any:
        """Return the value within an enclosing model; deferred again if that is only declared so far."""
        values = [one.value_in(model) if isinstance(one, ParameterExpression) else one for one in self.arguments]
        return OPERATIONS[self.operation](*values)

    def worked_out(self, model: Component, where: str) -> Any:
        """Return the same."""
        try:
            return self.value_in(model)
        except (ArithmeticError, TypeError) as error:
            raise ParameterError(f"its value {self!r} cannot be worked out ({error})", where=where) from None

    def __repr__(self) -> str:
        return f"{self.operation}({', '.join(map(repr, self.arguments))})"

    def __array__(self, *_: object, **__: object) -> Any:
        raise DeclarationError(
            f"{self!r} has no value in a class body",
            advice="Only + - * / and ** work there; work the rest out in a method build(self).",
        )

    def __add__(self, other: Any) -> ParameterExpression:
        return combine("add", self, other)

    def __radd__(self, other: Any) -> ParameterExpression:
        return combine("add", other, self)

    def __sub__(self, other: Any) -> ParameterExpression:
        return combine("sub", self, other)

    def __rsub__(self, other: Any) -> ParameterExpression:
        return combine("sub", other, self)

    def __mul__(self, other: Any) -> ParameterExpression:
        return combine("mul", self, other)

    def __rmul__(self, other: Any) -> ParameterExpression:
        return combine("mul", other, self)

    def __truediv__(self, other: Any) -> ParameterExpression:
        return combine("div", self, other)

    def __rtruediv__(self, other: Any) -> ParameterExpression:
        return combine("div", other, self)

    def __pow__(self, other: Any) -> ParameterExpression:
        return combine("pow", self, other)

    def __rpow__(self, other: Any) -> ParameterExpression:
        return combine("pow", other, self)

    def __neg__(self) -> ParameterExpression:
        return combine("neg", self)


def combine(operation: str, *operands: Any) -> ParameterExpression:
    """Return an operation on deferred values and numbers."""
    for operand in operands:
        if isinstance(operand, ParameterExpression):
            _check_is_number(operand)
        elif isinstance(operand, bool) or not isinstance(operand, numbers.Real) or not math.isfinite(operand):
            raise DeclarationError(
                f"{operand!r} cannot be combined with a parameter in a class body", advice="Use a plain finite number."
            )
    return ParameterExpression(operation, tuple(operands), _result_unit(operation, operands))


def _check_is_number(operand: ParameterExpression) -> None:
    vector, word = getattr(operand, "size", None), getattr(operand, "choices", None)
    if vector is not None or word or operand.operation == "signal":
        raise DeclarationError(
            f"there is no arithmetic with {operand!r} in a class body, since it is no single number",
            advice="Work it out in a method build(self).",
        )


def _result_unit(operation: str, operands: tuple[Any, ...]) -> Unit | None:
    """Return the unit of a result; a plain number takes the unit it needs in a sum, and has none in a product."""
    units = [one.unit if isinstance(one, ParameterExpression) else None for one in operands]
    if any(isinstance(one, ParameterExpression) and (one.unit is None or one.unit.text == "any") for one in operands):
        return None
    if operation == "neg":
        return units[0]
    if operation in ("add", "sub"):
        known = [unit for unit in units if unit is not None]
        if len(known) == 2 and not known[0].has_dimension_of(known[1]):
            raise DeclarationError(
                f"{operands[0]!r} is in {known[0].text} and {operands[1]!r} in {known[1].text}",
                advice="Only values in one unit can be added or subtracted.",
            )
        return known[0]
    a, b = (unit.exponents if unit is not None else (0, 0, 0, 0) for unit in units)
    if operation == "pow":
        return _power_unit(a, b, operands[1])
    factor = 1 if operation == "mul" else -1
    return unit_of((a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2], a[3] + factor * b[3]))


def _power_unit(base: Exponents, power_unit: Exponents, power: Any) -> Unit | None:
    if any(power_unit):
        raise DeclarationError(f"the power {power!r} has a unit")
    if not any(base):
        return unit_of(base)
    if isinstance(power, ParameterExpression):
        return None
    m, l, t, i = (exponent * power for exponent in base)
    if any(exponent != int(exponent) for exponent in (m, l, t, i)):
        return None
    return unit_of((int(m), int(l), int(t), int(i)))
