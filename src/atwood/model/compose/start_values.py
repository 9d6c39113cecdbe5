"""Start values by path, checked when they are given."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from typing import Any

from atwood.arguments import show
from atwood.errors import AtwoodError, StartError
from atwood.model.declare.fields import ParameterSpec
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.values.units import parse_unit, split_quantity
from atwood.showing import fitted

__all__ = ["StartValues"]

_NUMBER = ParameterSpec(0.0, "1", "A start value.")

_NOTHING = 1e-100
"""Values of starts below this are zero: nothing divides by them, and other numbers of any unit are larger."""


class StartValues(MutableMapping[str, Any]):
    """Start values by path: numbers in SI units, text with a unit, or parameters of the scene.

    Parameters
    ----------
    values
        The values to begin with.
    where
        What an error names before the path of the value.

    Raises
    ------
    StartError
        If a path is no text, or a value is not a finite number.
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, Any] | None = None, where: str = "") -> None:
        given = {} if values is None else values
        if not isinstance(given, Mapping):
            raise StartError(
                f"{show(given)} does not say values by path", where=where, advice="Write {'rod.angle': 0.5}."
            )
        self._values: dict[str, Any] = {key: _checked(key, value, where) for key, value in given.items()}

    def __getitem__(self, path: str) -> Any:
        return self._values[path]

    def __setitem__(self, path: str, value: Any) -> None:
        self._values[path] = _checked(path, value, "")

    def __delitem__(self, path: str) -> None:
        del self._values[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return fitted(repr(self._values))


def _checked(path: Any, value: Any, where: str) -> Any:
    """Return a start value as it is kept: a float, text that reads as a quantity, or a deferred value."""
    if not isinstance(path, str) or not path.strip():
        raise StartError(f"{show(path)} is no path", where=where, advice="Write paths like 'rod.angle'.")
    full = f"{where}.{path}" if where else path
    if isinstance(value, ParameterExpression):
        return value
    if isinstance(value, (list, tuple)):
        advice = f"Give its components, {path}.x and so on, each with a number."
        raise StartError("a start value is one number", where=full, advice=advice)
    number = value
    if isinstance(value, str):
        split = split_quantity(value)
        if split is None:
            raise StartError(f"{value!r} is not a number", where=full, advice="Write text like '30 deg' or '5 cm'.")
        number, unit_text = split
        try:
            parse_unit(unit_text)
        except AtwoodError as error:
            raise StartError(error.message, where=full, advice=error.advice) from None
    if not isinstance(value, str) and isinstance(number, (int, float)) and abs(number) < _NOTHING:
        number = 0.0  # what rounding has left of a state of another run; its square is no number, and it says no more
    try:
        checked = _NUMBER.check(number, full)
    except AtwoodError as error:
        raise StartError(error.message, where=full, advice="Give a number in SI units, or text with a unit.") from None
    return value if isinstance(value, str) else checked
