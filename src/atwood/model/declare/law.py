"""What a law of a component is: its kind, and what was said of it."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Iterable
from typing import Any, Literal, TypeVar

from atwood.arguments import NAME, Kind as ArgumentKind, Refused
from atwood.errors import DeclarationError
from atwood.lazy_dataclasses import dataclass

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
