"""Components checked once a process, when a scene with one of them is first assembled: names, and joints."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice
from typing import Any
from weakref import WeakKeyDictionary

from atwood.consistency.joints import Unknown, wrong_joint, wrong_rates
from atwood.consistency.trials import Trial, contradiction_at, make_trial
from atwood.errors import DeclarationError, suggestion
from atwood.model.declare.component import Component
from atwood.model.declare.laws import Law
from atwood.model.local.flatten import Part
from atwood.model.values.space import Space

TRIALS, ATTEMPTS = 2, 6
"""At how many random states laws are compared, and at how many that is tried, since laws may have no value at some."""

_sound: WeakKeyDictionary[type[Component], set[Hashable]] = WeakKeyDictionary()
"""For each class, in which spaces and with which choices no contradiction was found."""


def check_components(parts: Mapping[str, Part], space: Space) -> None:
    """Refuse parts with names in their declarations that name nothing, or with laws that contradict each other.

    Joints are held against the constraints that they solve, observables against joint coordinates of their name and
    against their rates, at random states, in all modes.
    """
    _refuse(parts, lambda part: "names", lambda part: wrong_names(part.component, part.path))
    _refuse(parts, lambda part: _shape_of(part, space), lambda part: contradictions(part, space))


def _refuse(
    parts: Mapping[str, Part],
    key_of: Callable[[Part], Hashable],
    look: Callable[[Part], Iterable[DeclarationError]],
) -> None:
    for part in parts.values():
        known = _sound.setdefault(type(part.component), set())
        key = key_of(part)
        if key not in known:
            for error in look(part):
                raise error
            known.add(key)


def _shape_of(part: Part, space: Space) -> Hashable:
    """Return what decides which terms there are in a part's laws: choices and counts, and which numbers are 0 or 1.

    What has a factor too many, or a power, is right where that is one.
    """
    line = () if space.line is None else tuple(space.line)
    shape: list[Hashable] = [space.name, line]
    for name, value in part.values.items():
        if line and isinstance(value, tuple) and part.component.parameter_specs()[name].direction:
            shape.append(value)  # what points along the line, and what does not
        elif isinstance(value, tuple) and not part.component.parameter_specs()[name].array:
            shape.append(tuple(map(_special, value)))
        else:
            shape.append(_special(value))
    return tuple(shape)


def _special(value: Hashable) -> Hashable:
    """Return a value; of floating-point numbers only those that hide terms."""
    return value if not isinstance(value, float) or value in (0.0, 1.0, -1.0) else None


def contradictions(part: Part, space: Space) -> Iterator[DeclarationError]:
    """Yield what is contradictory in the laws of a part."""
    component = part.component
    joints = [law for law in component.laws("joint") if law.holds_in(space.name)]
    for law in joints:
        for mode in law.options.modes or component.modes or ("",):
            if not law.options.rigid:
                yield from _at_some(part, space, partial(wrong_joint, law=law, mode=mode))
    joint = _that_tells_all(component, joints, space)
    held = any(law.holds_in(space.name) for law in component.laws("constraint"))
    if joint is not None or not held:
        yield from _at_some(part, space, partial(wrong_rates, joint=joint))


def _that_tells_all(component: Component, joints: list[Law], space: Space) -> Law | None:
    """Return the joint that solves every constraint, so that what moves along it may move so."""
    held = {law.name for law in component.laws("constraint") if law.holds_in(space.name)}
    return joints[0] if len(joints) == 1 and held <= set(joints[0].options.solves) else None


def _at_some(
    part: Part, space: Space, look: Callable[[Trial], Iterable[DeclarationError]]
) -> Iterator[DeclarationError]:
    """Yield what is found at the first state where something is, of some at which laws have values."""

    def found() -> Iterator[list[DeclarationError]]:
        for seed in range(ATTEMPTS):
            try:
                yield list(look(make_trial(part, space, seed)))
            except Unknown:
                continue

    for errors in islice(found(), TRIALS):
        if errors:
            yield from errors
            return


SPACES = ("line", "plane", "space")


def wrong_names(component: Component, where: str) -> Iterator[DeclarationError]:
    """Yield an error for each name in a component's declarations that names nothing."""
    cls = type(component)
    yield from _wrong_settings(component, where)
    for law in cls._laws.values():
        for message, advice in _in_law(component, law):
            at = contradiction_at(cls, law.name)
            yield DeclarationError(f"{message}{at}", where=f"{where}.{law.name}", advice=advice)
    yield from _doubled(cls, where)


def _wrong_settings(component: Component, where: str) -> Iterator[DeclarationError]:
    """Yield errors in what holds for the class as a whole."""
    cls, parameters = type(component), component.parameter_specs()
    for message, advice in _unknown("a space", cls.spaces, SPACES):
        yield DeclarationError(f"its spaces name {message}", where=where, advice=advice)
    if cls.mode_parameter:
        spec = parameters.get(cls.mode_parameter)
        if spec is None:
            yield DeclarationError(
                f"its mode_parameter {cls.mode_parameter!r} is none of its parameters",
                where=where,
                advice=suggestion(cls.mode_parameter, parameters),
            )
        else:
            for message, advice in _unknown("a mode", spec.choices, cls.modes):
                yield DeclarationError(f"its mode_parameter {spec.name!r} offers {message}", where=where, advice=advice)
    coordinates = {name for law in cls.laws("joint") for name in law.options.coordinates}
    for end in component.connector_specs().values():
        full = f"{where}.{end.name}"
        if end.of and end.of not in coordinates:
            yield DeclarationError(
                f"it is of {end.of!r}, which is no coordinate of its joint",
                where=full,
                advice=suggestion(end.of, coordinates),
            )
        for choice, words in end.when.items():
            known = parameters[choice].choices if choice in parameters else ()
            for message, advice in _unknown(f"a value of {choice!r}", words, known):
                yield DeclarationError(f"its when names {message}", where=full, advice=advice)


def _in_law(component: Component, law: Law) -> Iterator[tuple[str, str]]:
    """Yield message and advice for each wrong name in one law."""
    cls, options = type(component), law.options
    yield from _named("a mode", getattr(options, "modes", ()), cls.modes)
    observables = [one.name for one in cls.laws("observable")]
    if law.kind == "joint":
        ends = [*component.connectors(), "world"]
        declared = {spec.name for spec in component.connector_specs().values()}
        for end in (options.a, options.b):
            if end.partition("[")[0] not in declared:  # one that is there only at times is asked for when it is
                yield from _named("a connector", (end,), ends)
        yield from _named("a constraint", options.solves, [one.name for one in cls.laws("constraint")])
        yield from _named("an observable", options.coordinates, observables)
        yield from _wrong_arguments(cls, law)
    elif law.kind == "observable":
        yield from _named("an observable", [one for one in (options.rate, options.pole) if one], observables)
    elif law.kind == "event":
        yield from _wrong_target(component, law)
    elif law.kind == "derivative":
        yield from _named("a continuous state", options.states, _states(cls, is_discrete=False))
    elif law.kind == "update":
        yield from _wrong_update(cls, law)


def _states(cls: type[Component], is_discrete: bool) -> list[str]:
    return [name for name, spec in cls.state_specs().items() if spec.is_discrete == is_discrete]


def _wrong_update(cls: type[Component], law: Law) -> Iterator[tuple[str, str]]:
    """Yield errors in what an update sets and reads, and in when it is called."""
    options = law.options
    yield from _named("a state", options.sets, cls.state_specs())
    yield from _named("an input", options.reads or (), cls.signal_specs())
    for given in (options.every, options.offset):
        yield from _named("a parameter", (given,) if isinstance(given, str) else (), cls.parameter_specs())
    yield from _named("an event", (options.at,) if options.at else (), [one.name for one in cls.laws("event")])
    yield from _named("a method", (options.when,) if options.when else (), dir(cls))
    if sum((options.every is not None, bool(options.at), bool(options.when))) != 1:
        yield (
            "it says no moment, or more than one kind",
            "Give every=, at= with the name of an event, or when= with that of a method.",
        )


def _wrong_arguments(cls: type[Component], law: Law) -> Iterator[tuple[str, str]]:
    """Yield an error if a joint's method does not take its coordinates, in their order."""
    taken = list(inspect.signature(getattr(cls, law.name)).parameters.values())[1:]
    if any(one.kind is inspect.Parameter.VAR_POSITIONAL for one in taken):
        return
    names = [one.name for one in taken]
    if len(names) != len(law.options.coordinates):
        yield (
            f"it takes {_listed(names)} and its coordinates are {_listed(law.options.coordinates)}",
            "The arguments of a joint are its coordinates, in their order.",
        )
    elif names != list(law.options.coordinates) and sorted(names) == sorted(law.options.coordinates):
        yield (
            f"its arguments {_listed(names)} are in another order than its coordinates",
            f"Write coordinates=({', '.join(repr(name) for name in names)},).",
        )


def _wrong_target(component: Component, law: Law) -> Iterator[tuple[str, str]]:
    target, known = law.options.target, ("", *type(component).modes, "stop")
    if target in known:
        return
    spec = component.parameter_specs().get(target)
    if spec is None or not spec.choices:
        choices = [one.name for one in component.parameter_specs().values() if one.choices]
        yield f"its target {target!r} is no mode, nor 'stop'", suggestion(target, [*known, *choices])
        return
    for message, advice in _unknown("a mode", spec.choices, known):
        yield f"its target {target!r} offers {message}", advice


def _doubled(cls: type[Component], where: str) -> Iterator[DeclarationError]:
    """Yield an error for each quantity that is reported twice: as an observable and as a reaction."""
    pressing = [name for law in cls.contact_laws().values() for name in law.options.reactions]
    for law in cls.laws("constraint"):
        for name in law.options.reactions:
            if name in pressing:  # where the gap is there, it is that of the gap
                continue
            for other in cls.laws("observable"):
                shared = [one for one in SPACES if other.holds_in(one) and law.holds_in(one) and one in cls.spaces]
                if name == other.name and shared:
                    yield DeclarationError(
                        f"its reaction {name!r} has the name of an observable"
                        f"{contradiction_at(cls, law.name, other.name)}",
                        where=f"{where}.{law.name}",
                        advice="Give one of them another name.",
                    )


def _named(kind: str, names: Collection[Any], known: Collection[str]) -> Iterator[tuple[str, str]]:
    for message, advice in _unknown(kind, names, known):
        yield f"it names {message}", advice


def _unknown(kind: str, names: Collection[Any], known: Collection[str]) -> Iterator[tuple[str, str]]:
    for name in names:
        if name not in known:
            advice = suggestion(str(name), known) or f"It has no {kind.partition(' ')[2]}."
            yield f"{kind} {name!r} that does not exist", advice


def _listed(names: Collection[str]) -> str:
    return ", ".join(repr(name) for name in names) or "nothing"
