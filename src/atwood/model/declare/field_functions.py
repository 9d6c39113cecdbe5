"""The functions by which a class declares its parameters, its inputs, and its continuous and discrete states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from atwood.arguments import (
    ANYTHING,
    BY_PATH,
    CALLBACK,
    DOC,
    FLAG,
    NAME,
    TEXT,
    each,
    either,
    number,
    optional,
    takes,
    whole,
)
from atwood.errors import DeclarationError, ParameterError
from atwood.model.declare.connectors import Quantity
from atwood.model.declare.fields import MISSING, Field, FieldReference, ParameterSpec, SignalSpec
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.values.letters import OWN_LETTERS

if TYPE_CHECKING:
    from atwood.model.declare.component import Component


Number: TypeAlias = float | Any
"""What a parameter or an input is annotated with: it is read as a number, and given as one, as text with a unit, as an
expression of the parameters of the model around it, or, an input, as a function of time. Type checkers let anything be
assigned, and see a float where it is read."""

Triple: TypeAlias = tuple[float, float, float] | Any
"""The same for three numbers: a place, or a direction, which may be given as ``"z"``."""


_BOUND = optional(number())


@takes(
    DeclarationError,
    default=ANYTHING,
    unit=TEXT,
    doc=DOC,
    minimum=_BOUND,
    above=_BOUND,
    maximum=_BOUND,
    size=optional(whole("a whole number of components, at least 1", 1, 1000)),
    integer=FLAG,
    choices=each(NAME, "a list of words", single=False),
    structural=FLAG,
    direction=FLAG,
    turning=FLAG,
    place=FLAG,
    unit_length=FLAG,
    text=FLAG,
    function_of=optional(BY_PATH),
    array=either(FLAG, CALLBACK),
    symbol=OWN_LETTERS,
)
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
    direction: bool = False,
    turning: bool = False,
    place: bool = False,
    unit_length: bool = False,
    text: bool = False,
    function_of: Mapping[str, str] | None = None,
    array: Callable[[Any, str], Any] | bool = False,
    symbol: str | Sequence[str] = (),
) -> Any:
    """Declare a parameter in the class body of a component.

    Parameters
    ----------
    default
        The value when none is given; without one, the parameter is required. None makes it optional. It can be
        worked out from parameters declared before it.
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
    direction
        Whether it is a direction: three numbers, not all zero, of which a unit vector is made, or an axis such as
        ``"z"`` or ``"-x"``. Components that are nothing but rounding, as of ``(cos(pi/2), 0, 1)``, are zero.
    turning
        Whether it is a direction about which something turns; in a plane it can only be the plane's normal.
    place
        Whether it says where something is in the world, as a position or one coordinate of it. It then says nothing of
        how large the scene is, by which tolerances are measured: a scene that is moved runs as before.
    unit_length
        Whether it is a unit of length in which a function is written. Left at its default it says nothing of how large
        the scene is: lengths are then in the function alone, and start values tell the size.
    text
        Whether it is text, as the path of a file is.
    function_of
        For a parameter that is a function: the names of its arguments with their units, ``{"x": "m", "t": "s"}``. It is
        given as a number, a formula (``"0.5*x**2"``), or a function in plain arithmetic of some of these arguments, and
        a law calls it with all of them. With ``size=3`` its value is a vector. It shapes the mechanism.
    array
        Whether it is numbers in a row, or in rows and columns, as tuples; a NumPy array and a data frame will do. A
        function of a value and the path of the parameter may turn anything else that is given into numbers.
    symbol
        Its letter in formulas, such as ``"m"``, ``"l_0"`` or ``"theta"``; of a vector one for all components, or one
        for each. What has the same letter elsewhere is told apart by an index. That of a model goes to whatever it is
        passed on to, which is then one letter.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, the unit is no SI unit, or a place or a unit of length is not in
        metres.
    """
    if (place or unit_length) and unit.strip() != "m":
        what = "a place in the world" if place else "a unit of length"
        raise DeclarationError(f"{what} is in metres, not in {unit}", advice='Give unit="m".')
    return ParameterSpec(
        default,
        unit,
        doc,
        minimum=minimum,
        above=above,
        maximum=maximum,
        size=3 if direction or turning else size,
        integer=integer,
        choices=tuple(choices),
        structural=structural,
        direction=direction or turning,
        turning=turning,
        place=place,
        unit_length=unit_length,
        text=text,
        function_of=function_of,
        array=array,
    ).with_symbol(symbol)


@takes(DeclarationError, default=ANYTHING, unit=TEXT, doc=DOC, init=ANYTHING)
def signal(default: Any = 0.0, *, unit: str = "1", doc: str, init: Literal[True] = True) -> Any:
    """Declare an input in the class body of a component.

    Its value is a number, a function of time written in plain arithmetic with Atwood's functions, or the output of
    another component (``scene.connect(sensor.output("length"), force.input("value"))``). In the class body of a
    model it can be passed on to the input of a part.

    Parameters
    ----------
    default
        The value when nothing is given or connected.
    unit
        SI unit.
    doc
        One line of meaning.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit is no SI unit.
    """
    return SignalSpec(default, unit, doc)


Count = str | Callable[[Mapping[str, Any]], int] | None


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
        """Return a start value in its SI unit, or refuse it; one for each element where there are several."""
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
    symbol=OWN_LETTERS,
    init=ANYTHING,
)
def state(
    start: Any = 0.0,
    *,
    unit: str = "1",
    doc: str,
    nominal: float | None = None,
    count: Count = None,
    symbol: str | Sequence[str] = (),
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
    symbol
        Its letter in formulas.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit is no SI unit.
    """
    return StateSpec(start, unit, doc, nominal, count, is_discrete=False).with_symbol(symbol)


@takes(
    DeclarationError,
    start=ANYTHING,
    unit=TEXT,
    doc=DOC,
    count=optional(either(NAME, CALLBACK)),
    symbol=OWN_LETTERS,
    init=ANYTHING,
)
def discrete_state(
    start: Any = 0.0,
    *,
    unit: str = "1",
    doc: str,
    count: Count = None,
    symbol: str | Sequence[str] = (),
    init: Literal[False] = False,
) -> Any:
    """Declare a state that changes at moments only; laws marked `update` say when, and to what.

    Between two moments it is held, as what a computer puts out is.

    Parameters
    ----------
    start
        Its value before the first update, as for `state`; or a function of the parameters by name, and the time of
        the start, that returns one number for each of it.
    unit, doc, count, symbol
        As for `state`.

    Raises
    ------
    DeclarationError
        If there is no line of meaning, or the unit is no SI unit.
    """
    return StateSpec(start, unit, doc, None, count, is_discrete=True).with_symbol(symbol)
