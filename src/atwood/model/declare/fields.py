"""Fields of a component's class body: parameters, alone and in rows, and signals.

A field is a descriptor.  Read on a component it gives the value; inside a law it gives the number, expression or
sympy term that the law is being evaluated on.  Read in the class body of a model it can be passed on to a part,
also within arithmetic: ``Rod(length=length / 2)``.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Self

from atwood.arguments import real, show
from atwood.errors import AtwoodError, ParameterError, near_matches, suggestion
from atwood.model.declare.function_values import by_name_only, is_sympy, make_function
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.declare.time_functions import check_function
from atwood.model.values.units import Unit, parse_quantity, parse_si_unit

if TYPE_CHECKING:
    from atwood.model.declare.component import Component


class _Missing:
    def __repr__(self) -> str:
        return "<required>"


MISSING: Any = _Missing()
"""The default of a parameter that has none."""


class FieldReference(ParameterExpression):
    """The value of a parameter or an input of the model that encloses a part, by name.

    Parameters
    ----------
    name
        The name of the field.
    """

    def __init__(self, name: str, kind: str = "field", unit: Unit | None = None) -> None:
        super().__init__(kind, (), unit)
        self.name = name

    def __repr__(self) -> str:
        return self.name or "a field"

    def value_in(self, model: Component) -> Any:
        """Return the value of this field on the model that encloses a part."""
        parameters, signals = model.parameter_specs(), model.signal_specs()
        if self.name not in parameters and self.name not in signals:
            raise ParameterError(
                f"it is bound to {self.name!r}, which the {type(model).__name__} around it does not have",
                where=model.path or type(model).__name__,
                advice=suggestion(self.name, [*parameters, *signals]),
            )
        return model._value(self.name)


class Field(FieldReference):
    """A declared value of a component; see `parameter` and `signal`."""

    unit: Unit
    default: Any
    symbol: tuple[str, ...] = ()

    def __init__(self, kind: str, default: Any, unit: str, doc: str) -> None:
        super().__init__("", kind, parse_si_unit(unit))
        self.default = default
        self.doc = doc

    def with_symbol(self, symbol: str | Sequence[str]) -> Self:
        """Give the declaration its letter in formulas, or one for each component."""
        self.symbol = tuple(symbol)
        return self

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, instance: Component | None, owner: type) -> Any:
        return self if instance is None else instance._value(self.name)

    def with_default(self, default: Any) -> Self:
        """Return the same declaration with another default."""
        twin = copy.copy(self)
        twin.default = default
        return twin

    def check(self, value: Any, where: str) -> Any:
        """Return a value in its own type and SI unit, or refuse it."""
        raise NotImplementedError

    def _check_expression(self, value: ParameterExpression, where: str) -> ParameterExpression:
        if value.unit is not None and not value.unit.has_dimension_of(self.unit):
            raise ParameterError(
                f"it is bound to {value!r}, which is {value.unit.as_asked} and not {self.unit.as_asked}", where=where
            )
        return value


LARGEST_ANGLE = 1e9
"""rad. Floating-point numbers near it are 1e-7 rad apart; far beyond it a sine has no digit left."""

_LARGEST = 1e100

_SLANT = 1e-13
"""Components of a unit vector that are no larger are what rounding left: some hundred roundings of the machine's."""


def too_large_an_angle(angle: float, where: str, error: type[AtwoodError] = ParameterError) -> AtwoodError:
    """Return the error that says that an angle, rad, has lost too many of its digits."""
    return error(
        f"an angle of {angle:g} rad is known to {math.ulp(angle):.0g} rad only",
        where=where,
        advice=f"Give at most {LARGEST_ANGLE:g} rad, or what whole turns leave of it.",
    )


_AXES = {
    sign + name: tuple(size if name == axis else 0.0 for axis in "xyz")
    for sign, size in (("", 1.0), ("+", 1.0), ("-", -1.0))
    for name in "xyz"
}


class ParameterSpec(Field):
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
        direction: bool = False,
        turning: bool = False,
        place: bool = False,
        unit_length: bool = False,
        text: bool = False,
        function_of: Mapping[str, str] | None = None,
        array: Callable[[Any, str], Any] | bool = False,
    ) -> None:
        super().__init__("parameter", default, unit, doc)
        self.array = array
        self.function_of = {name: parse_si_unit(one) for name, one in (function_of or {}).items()}
        self.results = size or 1
        size = None if function_of else size
        self.minimum, self.above, self.maximum = minimum, above, maximum
        self.size, self.integer, self.choices = size, integer, choices
        self.direction, self.turning, self.place, self.text = direction, turning, place, text
        self.unit_length = unit_length
        self.structural = structural or direction or integer or text or bool(choices or function_of or array)

    def check(self, value: Any, where: str) -> Any:
        """Return a value in its own type and SI unit, or refuse it."""
        if isinstance(value, ParameterExpression):
            if value.operation == "signal":
                raise ParameterError(f"a parameter cannot follow the input {value!r}", where=where)
            return self._check_expression(value, where)
        if value is None and self.default is None:
            return None
        if self.function_of:
            return make_function(value, tuple(self.function_of), self.results, self.unit, where)
        if self.array:
            return check_array(self.array(value, where) if callable(self.array) else value, where)
        if self.choices:
            if not isinstance(value, str) or value not in self.choices:
                advice = f"Choose from {', '.join(self.choices)}."
                if isinstance(value, str) and near_matches(value, self.choices):
                    advice = f"{suggestion(value, self.choices)} {advice}"
                raise ParameterError(f"{show(value)} is not one of its values", where=where, advice=advice)
            return value
        if self.text:
            return _check_text(value, where)
        if self.size is not None:
            return self._check_vector(value, where)
        return self._check_number(value, where)

    def _check_vector(self, value: Any, where: str) -> tuple[float, ...]:
        given = _AXES.get(value.strip(), value) if self.direction and isinstance(value, str) else value
        if isinstance(given, str):
            given = [part for part in given.strip("()[] ").split(",") if part.strip()]
        try:
            parts = [] if isinstance(given, (bytes, set, dict)) else list(given)
        except Exception:  # it is no sequence, or one of somebody else's class
            parts = []
        if len(parts) != self.size:
            or_word = ", or one of x, y, z, -x, -y, -z" if self.direction else ""
            advice = f"Give {self.size} numbers in brackets{or_word}."
            raise ParameterError(f"{show(value)} is not {self.size} numbers", where=where, advice=advice)
        numbers = tuple(self._check_number(part, where) for part in parts)
        if not self.direction:
            return numbers
        length = math.hypot(*numbers)
        if length == 0.0:
            raise ParameterError(
                "a direction cannot be zero", where=where, advice="Give three numbers, or an axis as 'z'."
            )
        unit = (number / length for number in numbers)
        return tuple(number if abs(number) > _SLANT else 0.0 for number in unit)

    def _check_number(self, value: Any, where: str) -> float | int:
        number = parse_quantity(value, self.unit, where) if isinstance(value, str) else _plain_number(value)
        if number is None:
            kind, asked = "nothing" if value is None else show(value), f"Give one {self.unit.as_asked}."
            raise ParameterError(f"it needs a number, not {kind}", where=where, advice=asked)
        if not math.isfinite(number):
            raise ParameterError(
                f"{number} is not a finite number", where=where, advice=f"Give one {self.unit.as_asked}."
            )
        if abs(number) > _LARGEST or 0.0 < abs(number) < 1.0 / _LARGEST:
            size = "large" if abs(number) > 1.0 else "small"
            advice = f"Give zero, or a size from {1.0 / _LARGEST:g} to {_LARGEST:g}: squares must still be numbers."
            raise ParameterError(f"{number:g} is too {size} to be computed with", where=where, advice=advice)
        if self.unit.text == "rad" and abs(number) > LARGEST_ANGLE:
            raise too_large_an_angle(number, where)
        if self.integer and number != int(number):
            raise ParameterError(f"{number:g} is not a whole number", where=where, advice="Give a whole number.")
        self._check_bounds(number, where)
        return int(number) if self.integer else number

    def _check_bounds(self, value: float, where: str) -> None:
        unit = "" if self.unit.text == "1" else f" {self.unit.text}"
        if self.minimum is not None and value < self.minimum:
            problem, advice = "small", f"At least {self.minimum:g}{unit}."
        elif self.above is not None and value <= self.above:
            problem, advice = "small", f"More than {self.above:g}{unit}."
        elif self.maximum is not None and value > self.maximum:
            problem, advice = "large", f"At most {self.maximum:g}{unit}."
        else:
            return
        raise ParameterError(f"{value:g}{unit} is too {problem}", where=where, advice=advice)


class SignalSpec(Field):
    """The declaration of an input: a quantity that is given from outside, as a function of time.

    See `signal` for the meaning of the attributes.
    """

    def __init__(self, default: Any, unit: str, doc: str) -> None:
        super().__init__("signal", default, unit, doc)

    def check(self, value: Any, where: str) -> Any:
        """Return a value that can drive this input, a number, a formula of t or a function of time, or refuse it."""
        if isinstance(value, ParameterExpression):
            return self._check_expression(value, where)
        if isinstance(value, str) or is_sympy(value):
            formula = make_function(value, ("t",), 1, self.unit, where)
            if formula.depends_on("t"):
                return formula
            value = formula(0.0)
        if callable(value):
            if by_name_only(value):
                return make_function(value, ("t",), 1, self.unit, where)
            check_function(value, where)
            return value
        return ParameterSpec(0.0, self.unit.text, self.doc).check(value, where)


def _check_text(value: Any, where: str) -> str:
    try:
        text = fspath(value) if isinstance(value, PathLike) else value
    except Exception:  # whatever an object of somebody's own can raise
        text = None
    if not isinstance(text, str) or not text.strip() or "\0" in text:
        raise ParameterError(f"{show(value)} is no text", where=where, advice="Give a word or a path in quotes.")
    return text


def _plain_number(value: Any) -> float | None:
    """Return anything that is one real number as a float; None for truth values and everything else."""
    try:
        return real(value)
    except Exception:  # a value of somebody else's class may raise anything
        return None


def check_array(value: Any, where: str) -> tuple[Any, ...]:
    """Return numbers as a tuple, or as a tuple of rows that are equally long."""
    plain = value.to_numpy() if hasattr(value, "to_numpy") else value
    plain = plain.tolist() if hasattr(plain, "tolist") else plain
    if not isinstance(plain, (list, tuple)) or not plain:
        raise ParameterError(
            f"{show(value)} is not numbers in a row, or in rows and columns", where=where, advice="Give a list of them."
        )
    if not isinstance(plain[0], (list, tuple)):
        return tuple(_number(one, where) for one in plain)
    found = tuple(tuple(_number(one, where) for one in row) for row in plain)
    if len({len(row) for row in found}) > 1:
        lengths = ", ".join(str(len(row)) for row in found[:5])
        raise ParameterError(
            f"its rows are not equally long: {lengths}", where=where, advice="Give rows with as many numbers each."
        )
    return found


def _number(value: Any, where: str) -> float:
    try:
        number = real(value)
    except Exception:  # a value of somebody else's class may raise anything
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"{show(value)} in it is not a finite number", where=where, advice="Give finite numbers.")
    return number
