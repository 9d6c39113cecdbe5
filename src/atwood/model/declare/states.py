"""States that a component declares beside its motion: continuous ones, and ones that change at moments only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from atwood.arguments import ANYTHING, CALLBACK, DOC, NAME, TEXT, either, number, optional, takes
from atwood.errors import DeclarationError, ParameterError
from atwood.model.declare.fields import Field, FieldReference, ParameterSpec
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.declare.quantities import Quantity

if TYPE_CHECKING:
    from atwood.model.declare.component import Component

Count = str | Callable[[Mapping[str, Any]], int] | None

__all__ = ["StateSpec", "discrete_state", "state"]


class StateSpec(Field):
    """The declaration of a state: unit, start and meaning.

    See `state` and `discrete_state` for the meaning of the attributes.
    """

    def __init__(
        self,
        start: Any,
        unit: str,
        doc: str,
        nominal: float | None,
        count: Count,
        is_discrete: bool,
    ) -> None:
        super().__init__("state", start, unit, doc)
        self.nominal, self.count, self.is_discrete = nominal, count, is_discrete

    def __get__(self, instance: Component | None, owner: type) -> Any:
        if instance is None:
            return self
        if instance._bound is not None:
            return instance._bound.values[self.name]
        return Quantity(instance, self.name, self.unit.text, self.doc)

    def check(self, value: Any, where: str) -> Any:
        """Return a start value in its SI unit, or refuse it; one of its own for each element where there are several.

        Raises
        ------
        ParameterError
            If it is no finite number in the right unit.
        """
        if callable(value):
            return value
        if isinstance(value, FieldReference) and value.operation == "parameter":
            return self._check_expression(value, where)
        if isinstance(value, ParameterExpression):
            raise ParameterError(
                f"a start is a number or a parameter, not {value!r}", where=where, advice="Declare a parameter for it."
            )
        return ParameterSpec(0.0, self.unit.text, self.doc).check(value, where)

    def size(self, values: Any) -> int | None:
        """Return how many numbers it is, where it is an array, for given values of the parameters."""
        if self.count is None:
            return None
        return self.count(values) if callable(self.count) else int(values[self.count])

    def names(self, values: Any) -> list[str]:
        """Return the name of each of its numbers."""
        size = self.size(values)
        return [self.name] if size is None else [f"{self.name}[{i}]" for i in range(size)]

    def starts(self, values: Any, t: float) -> list[float]:
        """Return the start value of each of its numbers, for given values of the parameters and a time, s."""
        size = self.size(values)
        if callable(self.default):
            return [float(one) for one in self.default(values, t)]
        start = values[self.default.name] if isinstance(self.default, FieldReference) else self.default
        return [float(start)] * (1 if size is None else size)


_NOMINAL = optional(number("a number above 0", above=0.0))


@takes(
    DeclarationError,
    start=ANYTHING,
    unit=TEXT,
    doc=DOC,
    nominal=_NOMINAL,
    count=optional(either(NAME, CALLBACK)),
    init=ANYTHING,
)
def state(
    start: Any = 0.0,
    *,
    unit: str = "1",
    doc: str,
    nominal: float | None = None,
    count: Count = None,
    init: Literal[False] = False,
) -> Any:
    """Declare a continuous state in the class body of a component; a law marked `derivative` says its rate.

    Inside a law it is read by its name. It is reported like an observable, may be connected to inputs like one, and
    ``scene.start["filter.level"]`` gives it another start.

    Parameters
    ----------
    start
        Its value at the start: a number, or a parameter declared before it.
    unit
        SI unit.
    doc
        One line of meaning.
    nominal
        A usual size of it, in its unit, which says what is small; 1, or the size of the scene for a length.
    count
        Name of the integer parameter that says how many numbers it is, or a function of the parameters by name that
        does; then it is read as a tuple.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit is no SI unit.
    """
    return StateSpec(start, unit, doc, nominal, count, is_discrete=False)


@takes(DeclarationError, start=ANYTHING, unit=TEXT, doc=DOC, count=optional(either(NAME, CALLBACK)), init=ANYTHING)
def discrete_state(
    start: Any = 0.0,
    *,
    unit: str = "1",
    doc: str,
    count: Count = None,
    init: Literal[False] = False,
) -> Any:
    """Declare a state that changes at moments only; laws marked `update` say when, and to what.

    Between two moments it is held, as what a computer puts out is.

    Parameters
    ----------
    start
        Its value before the first update, as for `state`; or a function of the parameters by name, and the time of
        the start, that returns one number for each of it.
    unit, doc, count
        As for `state`.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit is no SI unit.
    """
    return StateSpec(start, unit, doc, None, count, is_discrete=True)
