"""Components to be looked at: with the values that they have, and with others within their bounds."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping
from typing import Any

from atwood.errors import AtwoodError, UsageError
from atwood.late import dataclass
from atwood.model.declare.component import Component
from atwood.model.declare.fields import MISSING, ParameterSpec
from atwood.model.local.flatten import Part

__all__ = ["Sample", "as_part", "in_space", "samples_of"]


@dataclass(frozen=True)
class Sample:
    """A component with some values; one is `full` if nothing is left out that could be given."""

    component: Component
    full: bool


def samples_of(given: Component | type[Component]) -> Iterator[Sample]:
    """Yield a component as it is given, with other numbers, and with each value of each choice.

    Parameters
    ----------
    given
        A component; of a class, one with its defaults.

    Raises
    ------
    UsageError
        If a class needs a text, such as the path of a file, which nobody can guess.
    """
    cls = given if isinstance(given, type) else type(given)
    specs, base = cls.parameter_specs(), _base(given)
    yield Sample(cls(**base), full=False)
    yield from _made(cls, {**base, **_others(specs, base, random.Random(1), all_of_them=False)}, full=False)
    for words in ({}, *({name: word} for name, word in _other_words(specs, base))):
        yield from _full(cls, {**base, **words})


def _base(given: Component | type[Component]) -> dict[str, Any]:
    """Return the values of a component, or of a class those that it cannot do without."""
    cls = given if isinstance(given, type) else type(given)
    base = {} if isinstance(given, type) else dict(given._settings)
    for name, spec in cls.parameter_specs().items():
        if spec.default is MISSING and name not in base:
            if spec.text:
                raise UsageError(
                    f"its parameter {name!r} is a text that cannot be guessed",
                    where=cls.__name__,
                    advice=f"Check an object instead: atwood.check({cls.__name__}({name}=...)).",
                )
            base[name] = spec.choices[0] if spec.choices else 1.5 if spec.size is None else (1.5,) * spec.size
    counted = {spec.count for spec in cls.connector_specs().values() if spec.count} - set(base)
    return {**base, **dict.fromkeys(counted, 2)}


def _other_words(specs: Mapping[str, ParameterSpec], base: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name, spec in specs.items():
        yield from ((name, word) for word in spec.choices if word != base.get(name, spec.default))


def _full(cls: type[Component], base: Mapping[str, Any]) -> Iterator[Sample]:
    """Yield a component with all that can be given; where that does not go together, with one of them at a time."""
    specs = cls.parameter_specs()
    others = _others(specs, base, random.Random(2), all_of_them=True)
    made = list(_made(cls, {**base, **others}, full=True))
    optional = [name for name in others if base.get(name, specs[name].default) is None]
    few = _others(specs, base, random.Random(2), all_of_them=False)
    for name in optional if not made else ():
        for numbers in (others, {**few, name: others[name]}):
            found = list(_made(cls, {**base, **numbers, **dict.fromkeys(set(optional) - {name})}, full=True))
            made += found
            if found:
                break
    yield from made


def _made(cls: type[Component], values: Mapping[str, Any], full: bool) -> Iterator[Sample]:
    """Yield a component with some values, if these go together; else with its directions left alone."""
    directions = {name for name, spec in cls.parameter_specs().items() if spec.direction}
    for chosen in (values, {name: value for name, value in values.items() if name not in directions}):
        try:
            made = cls(**chosen)
            made.check_values()
        except AtwoodError:
            continue
        yield Sample(made, full)
        return


def in_space(component: Component, space: str) -> Component:
    """Return a component with its directions in the plane, or along one line."""
    changed: dict[str, Any] = {}
    along: Any = None
    for name, spec in component.parameter_specs().items():
        value = component.parameters()[name]
        if not spec.direction or spec.turning or value is None or space == "space":
            continue
        if space == "plane" and value[1] != 0.0:
            changed[name] = (value[0], 0.0, value[2]) if value[0] or value[2] else (0.6, 0.0, 0.8)
        elif space == "line":
            along = along or value
            changed[name] = along
    if not changed:
        return component
    try:
        made = type(component)(**{**component._settings, **changed})
        made.check_values()
    except AtwoodError:
        return component
    return made


def _others(
    specs: Mapping[str, ParameterSpec], base: Mapping[str, Any], draw: random.Random, all_of_them: bool
) -> dict[str, Any]:
    """Return other numbers within the bounds; of all parameters, or only of those that are not zero or left out."""
    found: dict[str, Any] = {}
    for name, spec in specs.items():
        value = base.get(name, spec.default)
        if spec.integer or spec.choices or spec.text or spec.turning or spec.array:
            continue
        if spec.direction:
            raw = [draw.uniform(0.2, 1.0) for _ in range(3)]
            found[name] = tuple(raw) if all_of_them else value
        elif spec.size is not None and isinstance(value, tuple):
            found[name] = tuple(_number(spec, one, draw, all_of_them) for one in value)
        elif value is not None or all_of_them:
            found[name] = _number(spec, value or 0.0, draw, all_of_them)
    return found


def _number(spec: ParameterSpec, value: Any, draw: random.Random, also_zero: bool) -> Any:
    if not isinstance(value, (int, float)) or (value == 0.0 and not also_zero):
        return value
    number = value * draw.uniform(0.8, 1.25) if value else draw.uniform(0.3, 0.9)
    if spec.maximum is not None and number > spec.maximum:
        number = spec.maximum
    if spec.minimum is not None and number < spec.minimum:
        number = spec.minimum
    if spec.above is not None and number <= spec.above:
        number = spec.above + abs(number or 1.0)
    return number if math.isfinite(number) else value


def as_part(component: Component) -> Part:
    """Return a component as a leaf by itself, under the name of its class."""
    signals = {name: component._value(name) for name in component.signal_specs()}
    return Part(type(component).__name__, component, component.parameters(), signals)
