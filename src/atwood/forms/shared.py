"""What assemblies of one structure have in common, and whether other values keep the structure.

Parameters are arguments of every program. So another mass, another length or another start needs no new equations,
programs or kernels, as long as everything that shapes them stays: parts, connections, counts, choices, directions,
exact zeros, functions of time, signs of lengths on a line, and what was decided by the size of numbers.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
from typing import Any, TypeVar

from atwood.expr import Expression
from atwood.forms.kept import Key
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Decision, Mechanism, check_closures
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.model.local.bound import variation_names
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.parts import LocalPart
from atwood.model.values.vector import Vector
from atwood.stages import stage
from atwood.topology.line_signs import find_line_signs

REDUCED: Key[Equations] = Key("equations in generalized coordinates")
REGULAR: Key[Equations] = Key("the same with quaternions")
MAXIMAL: Key[Equations] = Key("equations in maximal coordinates")

T = TypeVar("T")


class Shared:
    """What is made once for all assemblies of one structure, when it is first asked for; any thread may ask.

    Parameters
    ----------
    family
        What the other modes of the scene share with it; its own if not given.

    Attributes
    ----------
    lock
        Held while something is made: the expressions of one structure live in one graph.
    """

    def __init__(self, family: Shared | None = None) -> None:
        self.family = family or self
        self._made: dict[Hashable, Any] = {}
        self.lock = threading.RLock()

    def __repr__(self) -> str:
        return f"<Shared: {len(self._made)} of equations, programs and the like>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Shared, ()  # what was made belongs to the process; who shared it does so again

    def get(self, key: Key[T], make: Callable[[], T], *about: Hashable) -> T:
        """Return what was made under a key, making it if it is not there."""
        place = (key, *about) if about else key
        try:
            found: T = self._made[place]
        except KeyError:
            with self.lock, stage("equations"):
                if place not in self._made:
                    self._made[place] = make()
                found = self._made[place]
        return found

    def known(self, key: Key[T]) -> T | None:
        """Return what was made under a key; None if nothing was."""
        found: T | None = self._made.get(key)
        return found


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
        Which component, for a parameter with several; None for a single number.
    """

    part: str
    name: str
    axis: int | None = None

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
        return value if self.axis is None or value is None else value[self.axis]


def find_slots(flat: FlatScene) -> Iterator[tuple[str, Slot]]:
    """Yield the name of the symbol that each value of a scene would have, and where it stands."""
    yield "gravity", Slot("", "gravity")
    for path, part in flat.parts.items():
        for name, spec in part.component.parameter_specs().items():
            if spec.size is None or part.values[name] is None:
                yield f"{path}.{name}", Slot(path, name)
                continue
            for axis in range(spec.size):
                label = "xyz"[axis] if spec.size == 3 else str(axis)
                yield f"{path}.{name}.{label}", Slot(path, name, axis)
        for name in part.signals:
            yield f"{path}.{name}", Slot(path, name)


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
        before, now = slot.read(flat), slot.read(other)
        if not _is_same(before, now):
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
    if (flat.connections, flat.links, flat.varied) != (other.connections, other.links, other.varied):
        return "it has other connections"
    if (flat.space, flat.line_axis) != (other.space, other.line_axis):
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
