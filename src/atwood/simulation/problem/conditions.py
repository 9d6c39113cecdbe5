"""Conditions that a run is asked to stop at, or to note, besides the events of its parts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from atwood.errors import AtwoodError, UsageError, near_matches, suggestion, suggestion_in_parts
from atwood.expr import Expression, cos, sin
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.outputs.event_functions import EventFunction
from atwood.model.values.units import parse_quantity, parse_unit

_CONDITIONS: Key[tuple[EventFunction, ...]] = Key("event functions of conditions")

_DIRECTIONS = {"crosses": 0, "rises above": 1, "falls below": -1}
"""What a quantity can do with a value."""

_FORM = "Write it as 'rod1.angle crosses 30 deg', with crosses, rises above or falls below."


@dataclass(frozen=True)
class Condition:
    """Something that is looked for along a run.

    Attributes
    ----------
    given
        Text such as ``"rod1.angle crosses 0"``, or a function of `Quantities` that returns what passes zero, or a
        comparison that becomes true.
    target
        ``"stop"``, or nothing where it is only noted.
    """

    given: str | Callable[[Quantities], Any]
    target: str

    @property
    def text(self) -> str:
        """What it is called."""
        given = self.given
        return " ".join(given.split()) if isinstance(given, str) else getattr(given, "__name__", "a condition")


class Quantities(Mapping[str, Expression]):
    """The quantities of a scene by path, and the `time`, as terms that a condition is written with.

    Parameters
    ----------
    assembly
        The scene.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly

    @property
    def time(self) -> Expression:
        """The time, s."""
        return self._assembly.mechanism.time

    def __getitem__(self, path: str) -> Expression:
        observables = self._assembly.observables
        if str(path) not in observables:
            raise _no_quantity(str(path), observables)
        return observables[str(path)].value

    def __iter__(self) -> Iterator[str]:
        return iter(self._assembly.observables)

    def __len__(self) -> int:
        return len(self._assembly.observables)


def _no_quantity(path: str, known: Mapping[str, Any]) -> UsageError:
    advice = suggestion_in_parts(path, known)
    return UsageError("there is no such quantity to watch", where=path, advice=advice)


def condition_functions(assembly: Assembly, conditions: Sequence[Condition]) -> tuple[EventFunction, ...]:
    """Return conditions as functions of the state of a scene, made once for each structure."""
    if not conditions:
        return ()
    return assembly.shared.get(_CONDITIONS, lambda: tuple(_functions(assembly, conditions)), tuple(conditions))


def _functions(assembly: Assembly, conditions: Sequence[Condition]) -> Iterator[EventFunction]:
    for one in conditions:
        with assembly.shared.lock:
            value, direction, unit, is_there = _read(assembly, one)
        yield EventFunction("", one.text, value, direction, one.target, one.text, unit, False, is_there)


def _read(assembly: Assembly, one: Condition) -> tuple[Expression, int, str, Expression | None]:
    """Return what passes zero, in which direction, in which unit, and what must be positive for it to count."""
    if not isinstance(one.given, str):
        return _called(assembly, one.given, one.text)
    path, how, level = _taken_apart(one.text)
    observables = assembly.observables
    if path not in observables:
        raise _no_quantity(path, observables)
    quantity = observables[path]
    if level in observables:
        value, wraps = quantity.value - observables[level].value, quantity.periodic or observables[level].periodic
    else:
        try:
            number = parse_quantity(level, parse_unit(quantity.unit), one.text)
        except AtwoodError as error:
            near = suggestion(level, observables) if near_matches(level, observables) else _FORM
            raise UsageError(error.message, where=one.text, advice=near) from None
        value, wraps = quantity.value - number, quantity.periodic
    if not wraps:
        return value, _DIRECTIONS[how], quantity.unit, None
    # An angle that comes out within one turn jumps on the far side, where the sine passes zero the other way.
    return sin(value), _DIRECTIONS[how], quantity.unit, cos(value)


def _taken_apart(text: str) -> tuple[str, str, str]:
    """Return the path, the verb and the value of a condition in words."""
    for how in _DIRECTIONS:
        found = re.match(rf"(\S+) {how} (.+)\Z", text)
        if found:
            return found[1], how, found[2]
    words = text.split()
    for count in (2, 1):
        close = near_matches(" ".join(words[1 : 1 + count]), _DIRECTIONS)
        if close:
            raise UsageError("it cannot be read", where=text, advice=f"Did you mean {close[0]!r}? {_FORM}")
    raise UsageError("it cannot be read", where=text, advice=_FORM)


def _called(
    assembly: Assembly, given: Callable[[Quantities], Any], text: str
) -> tuple[Expression, int, str, Expression | None]:
    try:
        found = given(Quantities(assembly))
    except AtwoodError:
        raise
    except Exception as error:  # whatever somebody's own function can raise
        raise UsageError(
            f"it cannot be evaluated on terms ({type(error).__name__}: {error})", where=text, advice=_PLAIN
        ) from error
    if not isinstance(found, Expression) or found.is_parametric:
        raise UsageError(f"it returns {found!r}, which no motion changes", where=text, advice=_PLAIN)
    if found.operation in ("less", "less_equal"):
        smaller, larger = found.arguments
        return larger - smaller, 1, "1", None
    return found, 0, "1", None


_PLAIN = (
    "Write it in plain arithmetic with Atwood's functions: lambda q: q['bob.position.z'] + 1.0 stops where that passes "
    "zero, lambda q: q['bob.position.z'] < -1.0 where it becomes true."
)


def conditions_of(until: Any, record: Any) -> tuple[Condition, ...]:
    """Return what a run stops at, and what it notes: conditions, or lists of these."""
    if until is None and record is None:
        return ()
    return (*(Condition(one, "stop") for one in _listed(until)), *(Condition(one, "") for one in _listed(record)))


def _listed(conditions: Any) -> list[Any]:
    """Return conditions as a list."""
    if conditions is None:
        return []
    return [conditions] if callable(conditions) or isinstance(conditions, str) else list(conditions)
