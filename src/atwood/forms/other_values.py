"""A structure with other values: what of it may change while equations, programs and machine code stay.

Parameters are arguments of every program. So another mass, another length or another start needs no new equations,
programs or kernels, as long as everything that shapes them stays: parts, connections, counts, choices, directions,
exact zeros, functions of time, signs of lengths on a line, and what was decided by the size of numbers. Constants of
integration are found anew, from the scene as it is before its start decides on them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from atwood.errors import StartError, UsageError, suggestion, suggestion_in_parts
from atwood.expr import Expression
from atwood.forms.caches import Key, Shared
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.constraints.values import holds_velocities
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Decision, Mechanism, check_closures, started_at
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.mechanics.read import find_line_signs
from atwood.model.compose.composite import Model
from atwood.model.compose.scene import Scene
from atwood.model.local.bound import variation_names
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Vector

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly
    from atwood.mechanics.outputs.observables import Observable

REDUCED: Key[Equations] = Key("equations in generalized coordinates")
REGULAR: Key[Equations] = Key("the same with quaternions")
MAXIMAL: Key[Equations] = Key("equations in maximal coordinates")


@dataclass(frozen=True)
class Slot:
    """Where in a scene a number stands.

    Attributes
    ----------
    part
        Path of the part; empty for the scene's gravity.
    name
        Its parameter or input.
    axis
        Which component, for a parameter with several, or which parameter that a function takes by name; None for a
        single number.
    """

    part: str
    name: str
    axis: int | str | None = None

    @property
    def path(self) -> str:
        """The path of the number, as a reader writes it."""
        place = f"{self.part}.{self.name}" if self.part else self.name
        return place if self.axis is None else f"{place}[{self.axis}]"

    def read(self, flat: FlatScene) -> Any:
        """Return the value that a scene has there."""
        if not self.part:
            return flat.gravity
        part = flat.parts[self.part]
        value = part.values[self.name] if self.name in part.values else part.signals[self.name]
        if isinstance(self.axis, str):
            return value.letters[self.axis]
        return value if self.axis is None or value is None else value[self.axis]


def find_slots(flat: FlatScene) -> Iterator[tuple[str, Slot]]:
    """Yield the name of the symbol that each value of a scene would have, and where it stands."""
    yield "gravity", Slot("", "gravity")
    for path, part in flat.parts.items():
        for name, spec in part.component.parameter_specs().items():
            if spec.size is None or part.values[name] is None:
                yield f"{path}.{name}", Slot(path, name)
                for letter in getattr(part.values[name], "letters", ()):
                    yield f"{path}.{name}.{letter}", Slot(path, name, letter)
                continue
            for axis in range(spec.size):
                label = "xyz"[axis] if spec.size == 3 else str(axis)
                yield f"{path}.{name}.{label}", Slot(path, name, axis)
        for name in part.signals:
            yield f"{path}.{name}", Slot(path, name)
            for letter in getattr(part.signals[name], "letters", ()):
                yield f"{path}.{name}.{letter}", Slot(path, name, letter)


@dataclass(frozen=True)
class _Shape:
    """Which values of a scene are arguments of its programs, by symbol, and which have shaped them."""

    free: tuple[tuple[Expression, Slot], ...]
    fixed: tuple[Slot, ...]


_SHAPE: Key[_Shape | None] = Key("which values are arguments")
_OFFSETS: Key[dict[int, Mapping[int, Vector]]] = Key("offsets of nodes in their bodies")


def _varied(flat: FlatScene) -> set[str]:
    """Return the names of the parameters that stand for variations of inputs, and are always zero."""
    return {name for part, signal in flat.varied for name in variation_names(f"{part}.{signal}")}


def _find_shape(flat: FlatScene, mechanism: Mechanism) -> _Shape | None:
    varied = _varied(flat)
    known = {symbol.name: symbol for symbol in mechanism.table.values if symbol.name not in varied}
    slots = dict(find_slots(flat))
    if not set(known) <= set(slots):
        return None
    fixed = tuple(slot for name, slot in slots.items() if name not in known)
    return _Shape(tuple((symbol, slots[name]) for name, symbol in known.items()), fixed)


def with_values_of(
    flat: FlatScene, mechanism: Mechanism, shared: Shared, other: FlatScene
) -> tuple[Mechanism | None, str]:
    """Return a mechanism with the values of another scene, if these do not change its structure."""
    reason = _changed_parts(flat, other)
    shape = shared.get(_SHAPE, lambda: _find_shape(flat, mechanism))
    if reason or shape is None:
        return None, reason or "not every number can be traced to its place"
    for slot in shape.fixed:
        steps = [one.parts[slot.part].steps.get(slot.name) if slot.part else None for one in (flat, other)]
        if all(steps) and steps[0] != steps[1]:
            return None, f"{slot.path} is a function that gives something else now"
        before, now = slot.read(flat), slot.read(other)
        if not all(steps) and (any(steps) or not _is_same(before, now)):
            return None, f"{slot.path} was {_shown(before)} and is {_shown(now)}"
    values: dict[Expression, float] = {}
    for symbol, slot in shape.free:
        value = slot.read(other)
        if not isinstance(value, (int, float)) or value == 0.0:
            return None, f"{slot.path} was a number other than zero and is {_shown(value)}"
        values[symbol] = float(value)
    varied = _varied(flat)
    values |= {symbol: 0.0 for symbol in mechanism.table.values if symbol.name in varied}
    moved = _moved(mechanism, other, values)
    check_closures(moved)
    if values != mechanism.table.values and not decided_alike(moved, shared):
        return None, DECIDED
    if mechanism.line_signs is not None and _line_signs(moved, other, shared) != mechanism.line_signs:
        return None, "on the line, parts start on other sides of each other"
    return moved, ""


DECIDED = "other coordinates are eliminated with these values"


def decisions_of(mechanism: Mechanism, shared: Shared) -> list[Decision]:
    """Return what was decided by the size of numbers: of the mechanism, and of the equations that have been made."""
    made = (shared.known(key) for key in (REDUCED, REGULAR, MAXIMAL))
    return [*mechanism.decisions, *(one for equations in made if equations for one in equations.decisions)]


def decided_alike(mechanism: Mechanism, shared: Shared) -> bool:
    """Return whether all that was decided by the size of numbers comes out with these as it did."""
    return all(one.how(mechanism) == one.outcome for one in decisions_of(mechanism, shared))


def _changed_parts(flat: FlatScene, other: FlatScene) -> str:
    """Return what differs in parts and connections, in words; empty if nothing does."""
    if list(flat.parts) != list(other.parts):
        return "it has other parts"
    for path, part in flat.parts.items():
        if type(part.component) is not type(other.parts[path].component):
            return f"{path} is another component"
    if flat.contact_states != other.contact_states:
        return "other gaps are closed, or other slips stick"
    if (flat.connections, flat.links, flat.varied) != (other.connections, other.links, other.varied):
        return "it has other connections"
    if [tuple(one) for one in flat.space.basis] != [tuple(one) for one in other.space.basis]:
        return "it lives in another space"
    if flat.gravity_direction != other.gravity_direction or flat.gravity_potential != other.gravity_potential:
        return "gravity is another one"
    return ""


def _is_same(before: Any, now: Any) -> bool:
    return before is now or (type(before) is type(now) and bool(before == now))


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _moved(mechanism: Mechanism, other: FlatScene, values: Mapping[Expression, float]) -> Mechanism:
    """Return a mechanism with other numbers in its places."""
    locals_ = {path: _local(local, other.parts[path]) for path, local in mechanism.locals_.items()}
    return replace(mechanism, table=replace(mechanism.table, values=dict(values)), locals_=locals_)


def _local(local: LocalPart, now: Part) -> LocalPart:
    """Return a part with other numbers; its component, whose laws were read, stays."""
    part = local.part
    if part.values == now.values and part.signals == now.signals:
        return local
    return replace(local, part=replace(part, values=now.values, signals=now.signals))


def _line_signs(mechanism: Mechanism, flat: FlatScene, shared: Shared) -> Mapping[tuple[str, str, str], float]:
    bodies, space = mechanism.bodies, mechanism.space
    offsets = shared.get(_OFFSETS, lambda: {body.index: body_offsets(body, space)[0] for body in bodies.bodies})
    return find_line_signs(flat, mechanism.graph, bodies, mechanism.locals_, offsets, mechanism.table.values, space)


_STARTING: Key[Shared] = Key("what the scene shares as its start is found")


def starting(assembly: Assembly) -> Assembly:
    """Return a scene as its start is found: with constraints on velocities as they are, which no start decides."""
    mechanism = assembly.mechanism
    if mechanism.places is None:
        return assembly
    shared = assembly.shared.get(_STARTING, lambda: _beside(assembly.shared))
    values = {symbol: value for symbol, value in mechanism.table.values.items() if symbol not in mechanism.constants}
    table = replace(mechanism.table, values=values)
    before = replace(mechanism, table=table, places=None, constants={})
    return replace(assembly, mechanism=before, source=None, why_new="", shared=shared)


def with_constants_of_start(assembly: Assembly) -> Assembly:
    """Return a scene with what its start makes of its constraints on velocities: some are integrals with a constant.

    Where parts have modes, another mode could begin with other constants, and everything stays as it is.
    """
    if assembly.modes or assembly.source is None or not holds_velocities(assembly.mechanism):
        return assembly
    places, shared = assembly.source.find_places(assembly), _beside(assembly.shared)
    shared.get(_STARTING, lambda: assembly.shared)
    made = replace(assembly, mechanism=replace(assembly.mechanism, places=places), shared=shared)
    constants = {**made.reduced.constants, **made.maximal.constants}
    return replace(made, mechanism=started_at(replace(made.mechanism, constants=constants), places))


def _beside(shared: Shared) -> Shared:
    """Return what other equations on the same graph share, which only one thread at a time may add to."""
    made = Shared()
    made.lock = shared.lock
    return made


def moved_to(assembly: Assembly, flat: FlatScene) -> tuple[Mechanism | None, str]:
    """Return the mechanism with the values of another scene; None, and why, if its structure is another."""
    before = starting(assembly)
    with assembly.shared.lock:
        # What was decided by the size of numbers is known only when the equations are.
        if before is assembly:
            _ = assembly.reduced
        else:
            _ = before.regular, before.maximal, assembly.reduced, assembly.maximal
        mechanism, reason = with_values_of(before.flat, before.mechanism, before.shared, flat)
    if mechanism is None or before is assembly:
        return mechanism, reason
    own = assembly.mechanism
    places = own.places
    if own.constants:
        if assembly.source is None:
            return None, "the start gives constants of integration"
        there = replace(before, flat=flat, mechanism=mechanism, given_relations=None)
        places = assembly.source.find_places(there)
    assert places is not None
    values = {**own.table.values, **mechanism.table.values}
    made = replace(own, table=replace(own.table, values=values), locals_=mechanism.locals_)
    made = started_at(made, places)
    if places == own.places and made.table.values == own.table.values:
        return made, ""  # at the same place with the same numbers everything was decided already
    with assembly.shared.lock:
        return (made, "") if decided_alike(made, assembly.shared) else (None, DECIDED)


Places = Mapping[str, Mapping[Expression, float]]
"""Where a scene starts, by form and by the symbols of its coordinates."""


@dataclass(frozen=True, eq=False)
class Source:
    """Where an assembly comes from.

    Attributes
    ----------
    find_places
        Finds where a scene starts. Constants of integration have their values from there, and so do equations with
        such constants; starts are found with equations, in rooms above this one.
    scene
        A copy of the scene, which nobody else changes; None if there were only its leaves.
    """

    find_places: Callable[[Assembly], Places]
    scene: Model | None = None

    def changed(self, values: Mapping[str, Any], start: Mapping[str, Any], guess: Mapping[str, Any]) -> Model:
        """Return a copy of the scene with other values."""
        if self.scene is None:
            raise UsageError(
                "it was assembled from leaves, so that its scene is not known", advice="Assemble the scene itself."
            )
        scene = self.scene.copy()
        change_scene(scene, values, start, guess)
        return scene


def change_scene(scene: Model, values: Mapping[str, Any], start: Mapping[str, Any], guess: Mapping[str, Any]) -> None:
    """Give a scene other values; see `Source.changed`."""
    for path, value in values.items():
        scene.set(path, value)
    if not isinstance(scene, Scene):
        if start or guess:
            raise UsageError("this is a model and no scene, and has no start of its own", where=type(scene).__name__)
        return
    for target, given in ((scene.start, start), (scene.guess, guess)):
        for path, value in given.items():
            if value is not None:
                target[path] = value
            elif path in target:
                del target[path]
            else:
                raise UsageError("the scene has no such start value", where=path, advice=suggestion(path, target))


def no_start_quantity(path: str, known: Mapping[str, Observable]) -> StartError:
    """Return the error that says that a start value is of nothing."""
    if re.match(r"(lambda|mu)\b", path):
        return StartError(
            "a multiplier follows from positions and speeds and cannot be prescribed at the start",
            where=path,
            advice="Give coordinates, positions and velocities.",
        )
    message = "there is no such quantity to start with"
    choices = [name for name, one in known.items() if one.unit in _POSITIONS_AND_SPEEDS]
    parts = [name for name in choices if name.rpartition(".")[0] == path]
    if f"{path}.x" in parts:
        return StartError(
            message, where=path, advice=f"It is a vector: give {' and '.join(parts)}, each with a number."
        )
    return StartError(message, where=path, advice=suggestion_in_parts(path, choices, "can start with"))


_POSITIONS_AND_SPEEDS = ("1", "m", "rad", "m/s", "rad/s")
