"""One-sided laws: what cannot be passed, and dry friction.

A gap that must not be negative comes with a force that must not be negative, and one of both is zero (Signorini's
law). What slides is held back by a force of the size of its limit, and what sticks by any force within it (Coulomb's
law); see F. Pfeiffer and C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), chapters 5 to 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from atwood.arguments import DOC, NAME, TEXT, each, either, number, one_of, takes
from atwood.errors import DeclarationError, suggestion
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.field_functions import discrete_state
from atwood.model.declare.laws import NAMES, REACTION, SPACES, Law, ObservableLaw, ObservableOptions
from atwood.model.values.units import ALONG, parse_si_unit

if TYPE_CHECKING:
    from atwood.model.declare.component import Component


class Told(NamedTuple):
    """What is told of a gap that closes or opens: the name of the event, its target, and what has happened in words."""

    law: str
    target: str
    message: str

    def target_in(self, values: Mapping[str, Any]) -> str:
        """Return the target for some values of the parameters, one of which may say it."""
        return str(values.get(self.target, self.target))


IMPACT_LAWS = "newton", "poisson"


@dataclass(frozen=True)
class UnilateralOptions:
    """See `unilateral`."""

    reactions: tuple[str, ...]
    unit: str
    restitution: str | float
    impact_law: str
    level: str
    adhesion: str
    stiffness: str
    given: tuple[str, ...]
    closes: Told | None
    opens: Told | None
    starts: str
    doc: str
    modes: tuple[str, ...]
    spaces: tuple[str, ...]

    def is_closed_at_start(self, values: Mapping[str, Any]) -> bool:
        """Return whether a start is to close it, by the parameters of the part."""
        return bool(self.starts and self.closes and values.get(self.starts) == self.closes.target)

    def is_poisson(self, values: Mapping[str, Any]) -> bool:
        """Return whether its law of impact is Poisson's, by the parameters of the part."""
        law = values.get(self.impact_law, self.impact_law)
        if law not in IMPACT_LAWS:
            raise DeclarationError(
                f"a law of impact is {' or '.join(map(repr, IMPACT_LAWS))}, or a choice parameter of both, not {law!r}",
                advice=suggestion(str(law), [*values, *IMPACT_LAWS]),
            )
        return bool(law == "poisson")


@dataclass(frozen=True)
class FrictionOptions:
    """See `dry_friction`."""

    reactions: tuple[str, ...]
    unit: str
    limit: str
    static_limit: str
    at: str
    doc: str
    modes: tuple[str, ...]
    spaces: tuple[str, ...]


def value_names(contact: Law) -> tuple[str, ...]:
    """Return the names of what a one-sided law returns: its own, numbered where it has two values."""
    count = len(contact.options.reactions)
    return (contact.name,) if count == 1 else tuple(f"{contact.name}_{i + 1}" for i in range(count))


def state_names(contact: Law) -> tuple[str, ...]:
    """Return the names of the discrete states of a one-sided law: its state, then the directions of a slip."""
    directions = value_names(contact) if contact.kind == "friction" else ()
    return (f"{contact.name}_state", *(f"{name}_direction" for name in directions))


class ContactLaw(ObservableLaw[Any]):
    """A one-sided law in a class body: within a law its method, elsewhere the quantity that it returns."""

    def __init__(self, function: Callable[[Any], Any], contact: Law, unit: str) -> None:
        self.unit, self.says = unit, (function.__doc__ or contact.options.doc).strip().partition("\n")[0]
        law = Law("observable", contact.name, self._seen(unit, self.says, contact))
        super().__init__(_where_given(function, contact), law)
        self.contact = contact

    @staticmethod
    def _seen(unit: str, doc: str, contact: Law) -> ObservableOptions:
        return ObservableOptions(unit, doc, False, "", contact.options.spaces)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its values: numbered where there are two."""
        return value_names(self.contact)

    def beside(self) -> dict[str, Any]:
        """Return what a class gets besides: its reactions and values as quantities, and its states."""
        options, name = self.contact.options, self.contact.name
        found: dict[str, Any] = {}
        for reaction in options.reactions:
            law = Law("observable", reaction, self._seen(options.unit, options.doc, self.contact))
            found[reaction] = ObservableLaw(_says(_reaction_of(reaction), options.doc), law)
        if len(self.names) > 1:
            for i, one in enumerate(self.names):
                law = Law("observable", one, self._seen(self.unit, self.says, self.contact))
                found[one] = ObservableLaw(_says(_element(name, i), self.says), law)
        if self.contact.kind == "unilateral":
            return {**found, f"{name}_state": discrete_state(doc=f"1 where {name} is closed, else 0.")}
        found[f"{name}_state"] = discrete_state(doc="0 where nothing rubs, 1 where it slips, 2 where it sticks.")
        says = f"Direction of {name}; 0 where it does not slip."
        return {**found, **{f"{one}_direction": discrete_state(doc=says) for one in self.names}}


def _where_given(function: Callable[[Any], Any], contact: Law) -> Callable[[Any], Any]:
    names = getattr(contact.options, "given", ())

    @wraps(function)
    def value(component: Component) -> Any:
        return function(component) if all(is_given(component, name) for name in names) else None

    return value if names else function


def is_given(component: Component, name: str) -> bool:
    """Return whether a parameter has a value, or a method says so."""
    found = getattr(component, name)
    return bool(found()) if callable(found) else found is not None


def _says(read: Callable[[Component], Any], doc: str) -> Callable[[Component], Any]:
    read.__doc__ = doc
    return read


def _reaction_of(name: str) -> Callable[[Component], Any]:
    return lambda component: component.reaction(name)


def _element(name: str, number: int) -> Callable[[Component], Any]:
    return lambda component: getattr(component, name)()[number]


def _along(unit: str, rate: str) -> str:
    parse_si_unit(unit)
    if unit not in ALONG:
        raise DeclarationError(
            f"a reaction is in {' or '.join(ALONG)}, and {unit!r} is neither", advice=suggestion(unit, ALONG)
        )
    return ALONG[unit] + rate


_TOLD = each(TEXT, "a name, a target and a message", single=False)


@takes(
    DeclarationError,
    reaction=REACTION,
    unit=TEXT,
    doc=DOC,
    restitution=either(NAME, number("a number from 0 to 1", least=0.0, most=1.0)),
    impact_law=NAME,
    level=one_of(("position", "velocity")),
    adhesion=TEXT,
    stiffness=TEXT,
    given=NAMES,
    closes=_TOLD,
    opens=_TOLD,
    starts=TEXT,
    modes=NAMES,
    spaces=SPACES,
)
def unilateral(
    *,
    reaction: str,
    unit: str = "N",
    doc: str,
    restitution: str | float = 0.0,
    impact_law: str = "newton",
    level: Literal["position", "velocity"] = "position",
    adhesion: str = "",
    stiffness: str = "",
    given: Sequence[str] = (),
    closes: Sequence[str] = (),
    opens: Sequence[str] = (),
    starts: str = "",
    modes: Sequence[str] = (),
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[Callable[[Any], Any]], ContactLaw]:
    """Mark a method that returns a gap: what never becomes negative, a distance, or a speed as that of a freewheel.

    Where the gap is zero a force keeps it so, which only pushes; where it opens there is none. Where it closes with a
    speed, velocities jump. The gap, the force and `<name>_state` are quantities of the component.

    Parameters
    ----------
    reaction
        Name of the quantity that the force along the gap is reported as; it is never negative.
    unit
        Unit of the reaction: ``"N"`` for a gap in m, ``"N*m"`` for one in rad; in m/s and rad/s at velocities.
    doc
        One line of what the reaction is.
    restitution
        Share of the approach with which a gap opens again after an impact, a number or the name of a parameter.
    impact_law
        What restitution is a share of: of the speed of approach (``"newton"``), or of the impulse until it has ended
        (``"poisson"``); or the name of a choice parameter that says which of both.
    level
        What the method reads: positions, angles and time, or also velocities, in which it is affine then.
    adhesion
        Name of a method, or a parameter, that gives how much a gap bears that is pulled open; it then lets go.
    stiffness
        Name of the parameter that says how gaps of which more are closed than are needed share a load: as springs of
        these stiffnesses do, however stiff, which hold the slips at them, too. Nothing gives way. None is rigid.
    given
        Parameters without which there is no gap: it is not there where one of them is None. Methods that read
        parameters alone say by True or False whether it is there.
    closes, opens
        What is told where it closes and opens, if not that a gap does: the name of the event, its target and its
        message. A target is a word; that of `opens` may be ``"stop"``, which ends the run, or the name of a choice
        parameter that says which.
    starts
        Name of the choice parameter that says whether the gap starts closed: where its value is the target of
        `closes`. The start is then one in which it is, and stays so; it may open at once.
    modes, spaces
        The modes of the component and the spaces in which it holds; all modes when empty.
    """
    share = str(restitution) if isinstance(restitution, str) else float(restitution)
    many = tuple(modes), tuple(spaces)
    own = tuple(given), _told(closes), _told(opens), starts
    if own[1] is not None and own[1].target == "stop":
        raise DeclarationError(
            "a gap that closes ends no run", advice="Ask for it with until=, or declare an @event of the gap."
        )
    options = UnilateralOptions((reaction,), unit, share, impact_law, level, adhesion, stiffness, *own, doc, *many)
    along = _along(unit, "/s" if level == "velocity" else "")
    return lambda function: ContactLaw(function, Law("unilateral", function.__name__, options), along)


def _told(given: Sequence[str]) -> Told | None:
    if len(given) not in (0, 3):
        raise DeclarationError(
            f"what is told of a gap is a name, a target and a message, and {tuple(given)!r} is not",
            advice="Write closes=('comes_taut', 'taut', 'the rope has come taut').",
        )
    return Told(*given) if given else None


@takes(
    DeclarationError,
    reaction=each(REACTION, "one or two names of letters, digits and _", 1),
    unit=TEXT,
    doc=DOC,
    limit=NAME,
    static_limit=TEXT,
    at=TEXT,
    modes=NAMES,
    spaces=SPACES,
)
def dry_friction(
    *,
    reaction: str | Sequence[str],
    limit: str,
    unit: str = "N",
    doc: str,
    static_limit: str = "",
    at: str = "",
    modes: Sequence[str] = (),
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[Callable[[Any], Any]], ContactLaw]:
    """Mark a method that returns a slip: a speed, or two, that dry friction takes away, and then holds at zero.

    Where it goes on, a force of the size of the limit acts against it. Where it is zero, it stays so as long as a force
    within the limit can hold it. The slip, the force and `<name>_state` are quantities of the component.

    Parameters
    ----------
    reaction
        Name of the quantity that the force along the slip is reported as; two where the method returns two speeds, in
        directions that are square to each other: the size of both together is limited then (a cone).
    limit
        Name of a method, or a parameter, that gives the largest force: from positions, velocities, states, inputs,
        time and reactions of the component. Where it is zero or less nothing rubs. It may read `<name>_direction`, the
        sign of the slip, and of a slip at rest, where it may be tried either way.
    unit
        Unit of the reaction: ``"N"`` for a slip in m/s, ``"N*m"`` for one in rad/s.
    doc
        One line of what the reaction is.
    static_limit
        The same while it sticks; the limit when empty.
    at
        Name of the gap that must be closed for it to act; it acts always when empty.
    modes, spaces
        The modes of the component and the spaces in which it holds; all modes when empty.
    """
    names = (reaction,) if isinstance(reaction, str) else tuple(reaction)
    if len(names) > 2:
        raise DeclarationError(f"a slip has one direction or two, not {len(names)}", advice="Declare several slips.")
    options = FrictionOptions(names, unit, limit, static_limit, at, doc, tuple(modes), tuple(spaces))
    return lambda function: ContactLaw(function, Law("friction", function.__name__, options), _along(unit, "/s"))
