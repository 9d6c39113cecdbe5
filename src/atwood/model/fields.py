"""What a component declares in its class body: parameters and signals.

A field is a descriptor.  Read on a component it gives the value; inside a law it gives the number, expression or
sympy term that the law is being evaluated on.  Read in the class body of a model it can be passed on to a part,
also within arithmetic: ``Rod(length=length / 2)``.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

from atwood.errors import DeclarationError, ParameterError
from atwood.model.units import Unit, parse_quantity, parse_unit

if TYPE_CHECKING:
    from atwood.model.component import Component

__all__ = ["MISSING", "Deferred", "ParameterSpec", "SignalSpec", "parameter", "signal"]


class _Missing:
    def __repr__(self) -> str:
        return "<required>"


MISSING: Any = _Missing()
"""The default of a parameter that has none."""


class Deferred:
    """A value that is worked out from the parameters of the model that encloses a part.

    Parameters
    ----------
    evaluate
        Gives the value for a component, the enclosing model.
    """

    def __init__(self, evaluate: Callable[[Component], Any]) -> None:
        self._evaluate = evaluate

    def value_in(self, model: Component) -> Any:
        """Return the value within an enclosing model."""
        return self._evaluate(model)

    def _combine(self, function: Callable[[Any, Any], Any], other: Any, swapped: bool = False) -> Deferred:
        def evaluate(model: Component) -> Any:
            right = other.value_in(model) if isinstance(other, Deferred) else other
            left = self.value_in(model)
            return function(right, left) if swapped else function(left, right)

        return Deferred(evaluate)

    def __add__(self, other: Any) -> Deferred:
        return self._combine(operator.add, other)

    def __radd__(self, other: Any) -> Deferred:
        return self._combine(operator.add, other, swapped=True)

    def __sub__(self, other: Any) -> Deferred:
        return self._combine(operator.sub, other)

    def __rsub__(self, other: Any) -> Deferred:
        return self._combine(operator.sub, other, swapped=True)

    def __mul__(self, other: Any) -> Deferred:
        return self._combine(operator.mul, other)

    def __rmul__(self, other: Any) -> Deferred:
        return self._combine(operator.mul, other, swapped=True)

    def __truediv__(self, other: Any) -> Deferred:
        return self._combine(operator.truediv, other)

    def __rtruediv__(self, other: Any) -> Deferred:
        return self._combine(operator.truediv, other, swapped=True)

    def __pow__(self, other: Any) -> Deferred:
        return self._combine(operator.pow, other)

    def __neg__(self) -> Deferred:
        return Deferred(lambda model: -self.value_in(model))


class ParameterSpec(Deferred):
    """The declaration of a parameter: unit, default, bounds and meaning.

    See `parameter` for the meaning of the attributes.
    """

    def __init__(
        self,
        default: Any,
        unit: str,
        doc: str,
        *,
        minimum: float | None = None,
        above: float | None = None,
        maximum: float | None = None,
        size: int | None = None,
        integer: bool = False,
        choices: tuple[str, ...] = (),
        structural: bool = False,
    ) -> None:
        super().__init__(lambda model: getattr(model, self.name))
        self.name = ""
        self.default = default
        self.unit: Unit = parse_unit(unit)
        self.doc = doc
        self.minimum, self.above, self.maximum = minimum, above, maximum
        self.size, self.integer, self.choices = size, integer, choices
        self.structural = structural or integer or bool(choices)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, instance: Component | None, owner: type) -> Any:
        return self if instance is None else instance._value(self.name)

    def with_default(self, default: Any) -> ParameterSpec:
        """Return the same declaration with another default."""
        copy = ParameterSpec(
            default,
            self.unit.text,
            self.doc,
            minimum=self.minimum,
            above=self.above,
            maximum=self.maximum,
            size=self.size,
            integer=self.integer,
            choices=self.choices,
            structural=self.structural,
        )
        copy.name = self.name
        return copy

    def check(self, value: Any, where: str) -> Any:
        """Return a value in its own type and SI unit, or refuse it.

        Raises
        ------
        ParameterError
            If it is not finite, of the wrong type or dimension, or out of bounds.
        """
        if isinstance(value, Deferred):
            self._check_deferred(value, where)
            return value
        if value is None and self.default is None:
            return None
        if self.choices:
            if value not in self.choices:
                raise ParameterError(
                    f"{value!r} is not one of its values", where=where, advice=f"Choose from {', '.join(self.choices)}."
                )
            return value
        if self.size is not None:
            return self._check_vector(value, where)
        return self._check_number(value, where)

    def _check_deferred(self, value: Deferred, where: str) -> None:
        if isinstance(value, ParameterSpec) and not value.unit.has_dimension_of(self.unit):
            raise ParameterError(
                f"it is bound to {value.name!r}, which is in {value.unit.text} and not in {self.unit.text}", where=where
            )

    def _check_vector(self, value: Any, where: str) -> tuple[float, ...]:
        if isinstance(value, str):
            value = [part for part in value.strip("()[] ").split(",") if part.strip()]
        if not hasattr(value, "__len__") or len(value) != self.size:
            raise ParameterError(f"{value!r} is not {self.size} numbers", where=where)
        return tuple(self._check_number(part, where) for part in value)

    def _check_number(self, value: Any, where: str) -> float | int:
        if isinstance(value, str):
            value = parse_quantity(value, self.unit, where)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            try:
                value = float(value) if not isinstance(value, bool) else None
            except (TypeError, ValueError):
                value = None
            if value is None:
                raise ParameterError("it needs a number", where=where, advice=f"Give one in {self.unit.text}.")
        if not math.isfinite(value):
            raise ParameterError(f"{value} is not a finite number", where=where, advice=f"Give it in {self.unit.text}.")
        if self.integer and value != int(value):
            raise ParameterError(f"{value} is not a whole number", where=where)
        self._check_bounds(value, where)
        return int(value) if self.integer else float(value)

    def _check_bounds(self, value: float, where: str) -> None:
        unit = "" if self.unit.text == "1" else f" {self.unit.text}"
        if self.minimum is not None and value < self.minimum:
            raise ParameterError(f"{value:g}{unit} is too small", where=where, advice=f"At least {self.minimum:g}{unit}.")
        if self.above is not None and value <= self.above:
            raise ParameterError(f"{value:g}{unit} is too small", where=where, advice=f"More than {self.above:g}{unit}.")
        if self.maximum is not None and value > self.maximum:
            raise ParameterError(f"{value:g}{unit} is too large", where=where, advice=f"At most {self.maximum:g}{unit}.")


class SignalSpec:
    """The declaration of an input: a quantity that is given from outside, as a function of time.

    See `signal` for the meaning of the attributes.
    """

    def __init__(self, default: Any, unit: str, doc: str) -> None:
        self.name = ""
        self.default = default
        self.unit: Unit = parse_unit(unit)
        self.doc = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, instance: Component | None, owner: type) -> Any:
        return self if instance is None else instance._value(self.name)

    def check(self, value: Any, where: str) -> Any:
        """Return a value that can drive this input: a number, or a function of time."""
        if callable(value) or isinstance(value, Deferred):
            return value
        return ParameterSpec(0.0, self.unit.text, self.doc).check(value, where)


def parameter(
    default: Any = MISSING,
    *,
    unit: str = "1",
    doc: str,
    minimum: float | None = None,
    above: float | None = None,
    maximum: float | None = None,
    size: int | None = None,
    integer: bool = False,
    choices: Sequence[str] = (),
    structural: bool = False,
) -> Any:
    """Declare a parameter in the class body of a component.

    Parameters
    ----------
    default
        The value when none is given; without one, the parameter is required. None makes it optional.
    unit
        SI unit, checked against the unit of what is given (``Rod(length="30 cm")``).
    doc
        One line of meaning.
    minimum, maximum
        The smallest and the largest value allowed.
    above
        A bound that the value must exceed.
    size
        The number of components, for a parameter that is a vector.
    integer
        Whether it is a count.
    choices
        The words it can be, for a parameter that is a choice.
    structural
        Whether its value shapes the mechanism, as a direction does. Counts and choices always do; every other
        parameter is a number that can change without anything being derived again.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit cannot be read.
    """
    if not doc.strip():
        raise DeclarationError("a parameter needs one line of meaning", advice="Give doc='...'.")
    return ParameterSpec(
        default,
        unit,
        doc,
        minimum=minimum,
        above=above,
        maximum=maximum,
        size=size,
        integer=integer,
        choices=tuple(choices),
        structural=structural,
    )


def signal(default: Any = 0.0, *, unit: str = "1", doc: str, init: Literal[True] = True) -> Any:
    """Declare an input in the class body of a component.

    Its value is a number, a function of time written in plain arithmetic with Atwood's functions, or the output of
    another component (``scene.connect(sensor.output("length"), force.input("value"))``).

    Parameters
    ----------
    default
        The value when nothing is given or connected.
    unit
        SI unit.
    doc
        One line of meaning.
    """
    if not doc.strip():
        raise DeclarationError("an input needs one line of meaning", advice="Give doc='...'.")
    return SignalSpec(default, unit, doc)
