"""Laws: what a component contributes to mechanics.

A law is a method of a component, marked by one of the decorators here. It is written in plain arithmetic with Atwood's
functions, and never sees the graph or the solver. Newton's equations are put together from all laws.
"""

from __future__ import annotations

import functools
import keyword
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Generic, Literal, Self, TypeVar, overload

from atwood.arguments import (
    CALLBACK,
    DOC,
    FLAG,
    NAME,
    TEXT,
    Kind as ArgumentKind,
    Refused,
    check,
    each,
    either,
    number,
    one_of,
    optional,
    takes,
    whole,
)
from atwood.errors import DeclarationError
from atwood.expr import Expression
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import Quantity, Reading
from atwood.model.values.letters import OWN_LETTERS
from atwood.model.values.units import parse_si_unit

if TYPE_CHECKING:
    from atwood.model.declare.component import Component

F = TypeVar("F", bound=Callable[..., Any])


Kind = Literal[
    "potential",
    "dissipation",
    "force",
    "inertia",
    "lagrangian",
    "constraint",
    "joint",
    "observable",
    "event",
    "derivative",
    "update",
    "unilateral",
    "friction",
]


@dataclass(frozen=True)
class Law:
    """A marked method of a component; `options` is one of the `...Options` below, or None."""

    kind: Kind
    name: str
    options: Any = None

    def holds_in(self, space: str) -> bool:
        """Return whether the law has a meaning in a space."""
        return self.options is None or space in getattr(self.options, "spaces", (space,))

    def acts_in(self, mode: str) -> bool:
        """Return whether the law acts while its component is in a mode."""
        modes = getattr(self.options, "modes", ())
        return not modes or mode in modes


@dataclass(frozen=True)
class ActingOptions:
    """In which modes a potential, a Rayleigh function or loads act; in all when empty."""

    modes: tuple[str, ...]


@dataclass(frozen=True)
class ConstraintOptions:
    """See `constraint`."""

    reactions: tuple[str, ...]
    unit: str
    sign: float
    doc: str
    modes: tuple[str, ...]
    spaces: tuple[str, ...]


@dataclass(frozen=True)
class JointOptions:
    """See `joint`."""

    a: str
    b: str
    coordinates: tuple[str, ...]
    solves: tuple[str, ...]
    spaces: tuple[str, ...]
    rigid: bool
    reaction_doc: str
    modes: tuple[str, ...]


@dataclass(frozen=True)
class ObservableOptions:
    """See `observable`."""

    unit: str
    doc: str
    periodic: bool
    rate: str
    spaces: tuple[str, ...]
    pole: str = ""
    symbol: tuple[str, ...] = ()


@dataclass(frozen=True)
class EventOptions:
    """See `event`."""

    modes: tuple[str, ...]
    direction: int
    target: str
    message: str
    unit: str
    impact: bool
    spaces: tuple[str, ...] = ("line", "plane", "space")


@dataclass(frozen=True)
class DerivativeOptions:
    """See `derivative`."""

    states: tuple[str, ...]
    modes: tuple[str, ...]


@dataclass(frozen=True)
class UpdateOptions:
    """See `update`."""

    sets: tuple[str, ...]
    every: str | float | None
    offset: str | float
    at: str
    when: str
    reads: tuple[str, ...] | None
    pure: bool


def mark(function: F, law: Law) -> F:
    """Mark a method as a law, unless it is one already."""
    before = getattr(function, "_atwood_law", None)
    if before is not None:
        advice = "Give each law a method of its own."
        raise DeclarationError(f"it is marked as {before.kind} and as {law.kind}", where=law.name, advice=advice)
    function._atwood_law = law  # type: ignore[attr-defined]
    return function


def _reaction(value: Any) -> str:
    if not all(word.isidentifier() and not keyword.iskeyword(word) for word in NAME.read(value).split(".")):
        raise Refused
    return str(value)


REACTION = ArgumentKind("a name of letters, digits and _", _reaction)


def scalars(value: Any) -> list[Any]:
    """Return what a law gave as a list of scalars."""
    return list(value) if isinstance(value, Iterable) else [value]


def _acting(kind: Kind, function: F | None, modes: Sequence[str]) -> F | Callable[[F], F]:
    """Mark a method by itself, or return what marks one with options."""
    options = ActingOptions(check(NAMES, modes, "modes", kind, DeclarationError))
    if function is not None:
        check(CALLBACK, function, "function", kind, DeclarationError)
    if function is None:
        return lambda method: mark(method, Law(kind, method.__name__, options))
    return mark(function, Law(kind, function.__name__, options))


@overload
def potential(function: F) -> F: ...
@overload
def potential(*, modes: Sequence[str] = ()) -> Callable[[F], F]: ...
def potential(function: F | None = None, *, modes: Sequence[str] = ()) -> F | Callable[[F], F]:
    """Mark a method that returns a potential energy, J, from positions, angles and time.

    Parameters
    ----------
    function
        The method, where the mark has no options.
    modes
        The modes of the component in which it acts; all when empty. Energy that is there when such a mode is entered,
        or left, counts as work that was put in, or taken out, at that moment.
    """
    return _acting("potential", function, modes)


@overload
def dissipation(function: F) -> F: ...
@overload
def dissipation(*, modes: Sequence[str] = ()) -> Callable[[F], F]: ...
def dissipation(function: F | None = None, *, modes: Sequence[str] = ()) -> F | Callable[[F], F]:
    """Mark a method that returns a Rayleigh function, W: half the dissipated power, from velocities.

    The force on each connector is minus the derivative with respect to its velocity (Goldstein, section 1.5).

    Parameters
    ----------
    function
        The method, where the mark has no options.
    modes
        The modes of the component in which it acts; all when empty.
    """
    return _acting("dissipation", function, modes)


@overload
def force(function: F) -> F: ...
@overload
def force(*, modes: Sequence[str] = ()) -> Callable[[F], F]: ...
def force(function: F | None = None, *, modes: Sequence[str] = ()) -> F | Callable[[F], F]:
    """Mark a method that returns the loads it puts on its connectors, an iterable of `Load`.

    Parameters
    ----------
    function
        The method, where the mark has no options.
    modes
        The modes of the component in which they act; all when empty.
    """
    return _acting("force", function, modes)


def inertia(function: F) -> F:
    """Mark a method that returns an iterable of `PointInertia` and `BodyInertia`; it reads parameters and time.

    Mass that changes with time comes, or goes, with the velocity that the body has where it is: it exerts no force, and
    ``m(t) a = F`` holds for what is there (a leaking bucket). The thrust of mass that leaves with another velocity is a
    `force` of its own. What depends on positions or joint coordinates is a `lagrangian`.
    """
    check(CALLBACK, function, "function", "inertia", DeclarationError)
    return mark(function, Law("inertia", function.__name__))


def lagrangian(function: F) -> F:
    """Mark a method that returns a Lagrangian, J, from positions, velocities, orientations, their rates and time.

    It acts by ``dL/dq - d/dt dL/dq'`` on whatever its connectors are joined to (Goldstein, section 1.4), so that
    inertia may depend on coordinates, and terms may be linear in velocities. It has to be smooth. It has no weight
    besides the potential energy that is in it. Its energy is ``p q' - L`` (Goldstein, section 2.7): potential energy is
    minus its value without velocities, kinetic energy the rest.
    """
    check(CALLBACK, function, "function", "lagrangian", DeclarationError)
    return mark(function, Law("lagrangian", function.__name__, ActingOptions(())))


SPACES = each(one_of(("line", "plane", "space")), "some of 'line', 'plane' and 'space'", 1)
NAMES = each(NAME, "names, as texts")


@takes(
    DeclarationError,
    reaction=each(REACTION, "a name of letters, digits and _, or several", 1),
    unit=TEXT,
    doc=DOC,
    sign=number(),
    modes=NAMES,
    spaces=SPACES,
)
def constraint(
    *,
    reaction: str | Sequence[str],
    unit: str = "N",
    doc: str,
    sign: float = 1.0,
    modes: Sequence[str] = (),
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[F], F]:
    """Mark a method that returns what must stay zero: one scalar, a `Vector`, or a sequence of scalars.

    Parameters
    ----------
    reaction
        Name of the quantity that the multiplier is reported as; one for each scalar (``"force"`` for a vector gives
        ``force.x``, ``force.y``, ``force.z``).
    unit
        Unit of the reaction.
    doc
        One line of what the reaction is, with its sign.
    sign
        The reaction is `sign` times the multiplier. With +1 it is the generalized force along the residual.
    modes
        The modes of the component in which the constraint acts; all when empty.
    spaces
        The spaces in which it acts.
    """
    parse_si_unit(unit)
    names = (reaction,) if isinstance(reaction, str) else tuple(reaction)
    options = ConstraintOptions(names, unit, sign, doc, tuple(modes), tuple(spaces))
    return lambda function: mark(function, Law("constraint", function.__name__, options))


@takes(
    DeclarationError,
    a=NAME,
    b=NAME,
    coordinates=NAMES,
    solves=NAMES,
    spaces=SPACES,
    rigid=FLAG,
    reaction=TEXT,
    modes=NAMES,
)
def joint(
    a: str,
    b: str,
    *,
    coordinates: Sequence[str] = (),
    solves: Sequence[str] = (),
    spaces: Sequence[str] = ("plane",),
    rigid: bool = False,
    reaction: str = "",
    modes: Sequence[str] = (),
) -> Callable[[F], F]:
    """Mark a method that returns the `Placement` of connector b seen from connector a, for given joint coordinates.

    A joint is a constraint together with coordinates that solve it.

    Parameters
    ----------
    a, b
        Names of two connectors; ``"world"`` for a joint to the world itself.
    coordinates
        Names of the joint coordinates, which are the arguments of the method, in this order. Each is also an
        observable of the component.
    solves
        Names of the constraints that hold whatever the coordinates are.
    spaces
        The spaces in which this description holds.
    rigid
        Whether a and b belong to one body; then there are no coordinates and no constraint.
    reaction
        For a rigid joint: one line of what its force and torque are reported as; empty to report none.
    modes
        The modes of the component in which it holds; all when empty.
    """
    options = JointOptions(a, b, tuple(coordinates), tuple(solves), tuple(spaces), rigid, reaction, tuple(modes))
    return lambda function: mark(function, Law("joint", function.__name__, options))


@takes(DeclarationError, unit=TEXT, doc=DOC, periodic=FLAG, rate=TEXT, spaces=SPACES, pole=TEXT, symbol=OWN_LETTERS)
def observable(
    *,
    unit: str,
    doc: str,
    periodic: bool = False,
    rate: str = "",
    spaces: Sequence[str] = ("line", "plane", "space"),
    pole: str = "",
    symbol: str | Sequence[str] = (),
) -> Callable[[Callable[[Any], Reading]], ObservableLaw[Reading]]:
    """Mark a method that returns a quantity to report: a scalar or a `Vector`.

    Parameters
    ----------
    unit
        SI unit.
    doc
        One line of meaning.
    periodic
        Whether it is an angle that comes out within one turn; it is then unwrapped along a run.
    rate
        Name of the observable that is its rate, by which the turns of a periodic one are counted.
    spaces
        The spaces in which it has a meaning.
    pole
        Of two periodic angles of which at a pole only the sum or the difference has a value: the name of the
        observable that is there the sign of the second in it, and elsewhere zero. Along a run the other stays.
    symbol
        The letter in formulas of the coordinate that has its name; of a vector one for all components, or one for each.
    """
    parse_si_unit(unit)

    def decorate(function: Callable[[Any], Reading]) -> ObservableLaw[Reading]:
        name, options = (
            function.__name__,
            ObservableOptions(unit, doc, periodic, rate, tuple(spaces), pole, tuple(symbol)),
        )

        @functools.wraps(function)
        def read(self: Any) -> Any:
            known = self._known_observable(name)
            return function(self) if known is None else known

        return ObservableLaw(read, Law("observable", name, options))

    return decorate


@takes(
    DeclarationError,
    target=TEXT,
    message=DOC,
    unit=TEXT,
    modes=NAMES,
    direction=whole("-1, 0 or +1", -1, 1),
    impact=FLAG,
    spaces=SPACES,
)
def event(
    *,
    target: str = "",
    message: str,
    unit: str = "1",
    modes: Sequence[str] = (),
    direction: int = 0,
    impact: bool = False,
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[F], F]:
    """Mark a method whose zero crossing changes the mode of the component, ends the run, or is noted.

    Parameters
    ----------
    target
        The mode to go to, ``"stop"``, or the name of a choice parameter that says which of these; empty for an event
        that is noted, and calls the updates that name it.
    message
        What has happened, in words.
    unit
        SI unit of the value, which says what is small.
    modes
        The modes in which it is watched; all when empty.
    direction
        +1 to see crossings upwards only, -1 downwards only, 0 both.
    impact
        Whether velocities jump: they are made consistent with the new mode by a plastic impact.
    spaces
        The spaces in which it is watched.
    """
    parse_si_unit(unit)
    options = EventOptions(tuple(modes), direction, target, message, unit, impact, tuple(spaces))
    return lambda function: mark(function, Law("event", function.__name__, options))


def derivative(*states: str, modes: Sequence[str] = ()) -> Callable[[F], F]:
    """Mark a method that returns the rates of states, each in its unit a second.

    It may read parameters, inputs, connectors with their velocities, states and time.

    Parameters
    ----------
    *states
        Names of the states; the method returns one scalar for each number in them, in this order.
    modes
        The modes of the component in which it holds; all when empty. In others these states stay as they are.
    """
    names = check(each(NAME, "the name of a state, or several", 1), states, "states", "derivative", DeclarationError)
    options = DerivativeOptions(tuple(names), tuple(check(NAMES, modes, "modes", "derivative", DeclarationError)))
    return lambda function: mark(function, Law("derivative", function.__name__, options))


_MOMENT = either(NAME, number())


@takes(
    DeclarationError,
    sets=each(NAME, "the name of a state, or several", 1),
    every=optional(_MOMENT),
    offset=_MOMENT,
    at=TEXT,
    when=TEXT,
    reads=optional(NAMES),
    pure=FLAG,
)
def update(
    *,
    sets: str | Sequence[str],
    every: str | float | None = None,
    offset: str | float = 0.0,
    at: str = "",
    when: str = "",
    reads: Sequence[str] | None = None,
    pure: bool = False,
) -> Callable[[F], F]:
    """Mark a method that is called at moments, on numbers, and returns new values of states.

    It is plain Python: parameters, inputs, states and the time are floats, and whatever Python can do with them may
    be done. At one moment, a method that reads an input comes after those that set what feeds it.

    Parameters
    ----------
    sets
        Names of the states, continuous or discrete, that it gives new values: one number for each of theirs, in order.
    every
        Its sample time, s: a number, or the name of a parameter.
    offset
        When it is called first, after the start of the run, s: a number, or the name of a parameter.
    at
        In place of a sample time, the name of an event of the component, just after which it is called.
    when
        In place of both, the name of a method that returns the times, s, from parameters that are numbers.
    reads
        The inputs that it reads; all when None. A method that passes on only what was stored before reads none, ``()``,
        and comes first.
    pure
        Whether it remembers nothing but states, so that a scene can be solved twice, as an estimated error needs.
    """
    names = (sets,) if isinstance(sets, str) else tuple(sets)
    options = UpdateOptions(names, every, offset, at, when, None if reads is None else tuple(reads), pure)
    return lambda function: mark(function, Law("update", function.__name__, options))


class ObservableLaw(Generic[Reading]):
    """An observable in a class body: within a law it is a method, elsewhere it names its `Quantity`."""

    def __init__(self, read: Any, law: Law) -> None:
        self._read = read
        self._atwood_law = law
        self.__doc__ = read.__doc__
        self.__name__ = law.name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: Component, owner: type) -> Quantity[Reading]: ...
    def __get__(self, instance: Component | None, owner: type) -> Any:
        if instance is None:
            return self
        if instance._bound is not None:
            return self._read.__get__(instance, owner)
        options = self._atwood_law.options
        return Quantity(instance, self._atwood_law.name, options.unit, options.doc)


def numbers_in(given: Any) -> Iterator[Any]:
    """Yield the numbers, or expressions, in what an update returned, however it is nested."""
    if hasattr(given, "tolist"):  # an array of numpy
        given = given.tolist()
    if isinstance(given, Iterable) and not isinstance(given, (str, Expression)):
        for one in given:
            yield from numbers_in(one)
    else:
        yield given
