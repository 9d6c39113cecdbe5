"""Samples of a component within its bounds, and the findings of a check."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping
from typing import Any, Literal

from atwood.display import data_of, fitted
from atwood.errors import AtwoodError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import Component
from atwood.model.declare.fields import MISSING, ParameterSpec
from atwood.model.local.flatten import Part


@dataclass(frozen=True)
class Sample:
    """A component with some values; one is `full` if nothing is left out that could be given."""

    component: Component
    full: bool


def samples_of(given: Component | type[Component]) -> Iterator[Sample]:
    """Yield a component as it is given, with other numbers, and with each value of each choice."""
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


@dataclass(frozen=True)
class Finding:
    """Something that a check found.

    Attributes
    ----------
    gravity
        ``"failure"`` for what is wrong; ``"note"`` for what may be meant, or could not be looked at.
    test
        Which test found it, such as ``"units"``.
    law
        The law that it is about; empty for the component as a whole.
    space
        ``"line"``, ``"plane"`` or ``"space"``, or several of them with commas; empty where it does not matter.
    message
        What was found.
    """

    gravity: Literal["failure", "note"]
    test: str
    law: str
    space: str
    message: str

    def __str__(self) -> str:
        place = ", ".join(word for word in (self.law, self.space) if word)
        return f"{self.gravity} ({self.test}{': ' if place else ''}{place}): {self.message}"


@dataclass(frozen=True)
class CheckReport:
    """What `atwood.check` found of a component.

    Attributes
    ----------
    component
        Name of its class.
    spaces
        The spaces that it says it exists in, all of which were looked at.
    tests
        How many comparisons each test made.
    findings
        What was found, failures first.
    """

    component: str
    spaces: tuple[str, ...]
    tests: Mapping[str, int]
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong; there may be notes."""
        return not self.failures

    @property
    def is_empty(self) -> bool:
        """Whether there was nothing to check."""
        return any(one.test == "content" for one in self.findings)

    @property
    def failures(self) -> tuple[Finding, ...]:
        """What is wrong."""
        return tuple(one for one in self.findings if one.gravity == "failure")

    @property
    def notes(self) -> tuple[Finding, ...]:
        """What may be meant, or could not be looked at."""
        return tuple(one for one in self.findings if one.gravity == "note")

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return data_of(self, "component", "ok", "spaces", "tests", "findings")

    def __str__(self) -> str:
        made = ", ".join(f"{name} {count}" for name, count in self.tests.items())
        said = "nothing to check" if self.is_empty else "sound" if self.ok else f"{len(self.failures)} failures"
        head = f"{self.component}: {said} ({made})"
        return "\n".join([head, *(f"  {one}" for one in self.findings)])

    def __repr__(self) -> str:
        return fitted(str(self))
