"""Components are checked once, when a scene with one of them is first assembled in a process."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice
from weakref import WeakKeyDictionary

from atwood.consistency.draws import make_trial
from atwood.consistency.joints import Unknown, wrong_joint, wrong_rates
from atwood.consistency.names import wrong_names
from atwood.consistency.trials import Trial
from atwood.errors import DeclarationError
from atwood.model.declare.component import Component
from atwood.model.declare.law import Law
from atwood.model.local.flatten import Part
from atwood.model.values.space import Space

__all__ = ["check_laws", "check_names", "contradictions"]

TRIALS, ATTEMPTS = 2, 6
"""At how many random states laws are compared, and at how many that is tried, since laws may have no value at some."""

_sound: WeakKeyDictionary[type[Component], set[Hashable]] = WeakKeyDictionary()
"""For each class, in which spaces and with which choices no contradiction was found."""


def check_names(parts: Mapping[str, Part]) -> None:
    """Refuse parts with names in their declarations that name nothing.

    Parameters
    ----------
    parts
        The leaves of a scene.

    Raises
    ------
    DeclarationError
        With the path of the part, and the file and line of the law.
    """
    _refuse(parts, lambda part: "names", lambda part: wrong_names(part.component, part.path))


def check_laws(parts: Mapping[str, Part], space: Space) -> None:
    """Refuse parts whose laws contradict each other.

    Joints are held against the constraints that they solve, observables against joint coordinates of their name and
    against their rates, at random states, in all modes.

    Parameters
    ----------
    parts
        The leaves of a scene, whose parameters are known to mean something in its space.
    space
        What it lives in.

    Raises
    ------
    DeclarationError
        With the path of the part, and the file and line of the law.
    """
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
    """Yield what is contradictory in the laws of a part.

    Parameters
    ----------
    part
        The part.
    space
        What it lives in.
    """
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
