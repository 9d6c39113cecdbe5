"""A scene as bodies and joints, and what is decided about it by the size of numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import TopologyError
from atwood.expr import Expression, Scalar, evaluate
from atwood.expr.core.relations import TimeRelations, values_just_after
from atwood.lazy_dataclasses import dataclass, names_of, replace
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets, plain, rotate
from atwood.model.local.bound import ParameterTable
from atwood.model.local.parts import DiscreteState, LocalPart, declared_starts
from atwood.model.values.rotation import as_rotation, compose
from atwood.model.values.space import Space, Vector, as_vector
from atwood.tolerances import tolerances
from atwood.topology.bodies import Bodies
from atwood.topology.graph import WORLD, Joint, MechanismGraph

if TYPE_CHECKING:
    from atwood.mechanics.kinematics.positions import Placements


T = TypeVar("T")

Connector = tuple[str, str]
"""A connector, as (part, name)."""


@dataclass(frozen=True)
class Decision:
    """What was decided by the size of numbers, which other values of parameters may decide otherwise.

    Attributes
    ----------
    how
        Decides it, for a mechanism with any values of its parameters.
    outcome
        How it came out.
    """

    how: Callable[[Mechanism], object]
    outcome: object


@dataclass(frozen=True)
class Constant:
    """What the value of a constant of integration is read from.

    Attributes
    ----------
    form
        In which form's coordinates it is said.
    expression
        What it is the value of where the scene starts.
    """

    form: str
    expression: Expression


@dataclass(frozen=True)
class Mechanism:
    """A scene as bodies and joints on local symbols, before a form is chosen.

    Attributes
    ----------
    table
        The parameters.
    gravity
        Acceleration of free fall, m/s^2, a symbol or zero.
    locals_, graph, bodies
        Parts, nodes and bodies.
    links
        For each linked input, the output that feeds it.
    line_signs
        On a line, the signs of lengths as the start values tell them; None elsewhere, and where they were given.
    decisions
        What was decided by the size of numbers when the laws were read; equations have decisions of their own.
    places
        Where the scene starts, by form and by the symbols of its coordinates; None where nothing depends on it: then
        constraints on velocities stay what they are.
    constants
        Further parameters, whose values the start gives, of both forms. One may depend on those before it.
    t_start
        When it starts, s.
    idle_spins
        The axis, in the axes of the body, of each body that has no inertia about it; see `idle_spin`.
    origin
        The fixed connector, as (part, name), that positions are counted from; None for the world's own origin.
    """

    table: ParameterTable
    gravity: Vector
    locals_: Mapping[str, LocalPart]
    graph: MechanismGraph
    bodies: Bodies
    links: Mapping[tuple[str, str], tuple[str, str]]
    line_signs: Mapping[tuple[str, str, str], float] | None = None
    decisions: tuple[Decision, ...] = ()
    places: Mapping[str, Mapping[Expression, float]] | None = None
    constants: Mapping[Expression, Constant] = field(default_factory=dict)
    t_start: float = 0.0
    idle_spins: Mapping[int, Vector] = field(default_factory=dict)
    origin: Connector | None = None

    @property
    def time(self) -> Expression:
        """The symbol of time."""
        return self.table.time

    @property
    def space(self) -> Space:
        """What the scene lives in."""
        return self.table.space

    def known_at_start(self) -> dict[Expression, float]:
        """Return the values of parameters, of discrete states, of time and of relations of it at the start of a run."""
        values, relations = self.table.values, self.relations.found
        after = values_just_after(relations, values, self.t_start)
        symbols = (one.symbol for one in relations)
        parts = {path: local.part for path, local in self.locals_.items() if local.discrete_states}
        starts = declared_starts(parts, self.t_start, is_discrete=True)
        held = {one.symbol: starts[one.path] for one in discrete_states_of(self)} if parts else {}
        return {**values, **held, self.time: self.t_start, **dict(zip(symbols, after, strict=True))}

    def value_at_start(self, given: Scalar) -> float:
        """Return the value of an expression of what is known at the start."""
        return float(self.values_at_start([given])[0])

    def values_at_start(self, given: Iterable[Scalar], also: Mapping[Expression, float] | None = None) -> FloatArray:
        """Return the values of expressions of what is known at the start, and of further symbols with these values."""
        convert = self.table.graph.convert
        values = evaluate([convert(one) for one in given], {**self.known_at_start(), **(also or {})})
        return np.array(values, dtype=float)

    @property
    def relations(self) -> TimeRelations:
        """The relations of functions of time alone in its laws."""
        found = self.table.graph.relations
        assert found is not None
        return found

    @property
    def can_read_multipliers(self) -> bool:
        """Whether forces read reactions: of their own part, or perhaps through inputs that are linked to one."""
        feeding = (self.locals_[source] for source, _ in self.links.values())
        return any(one.reads for one in self.locals_.values()) or any(one.binding.reactions for one in feeding)


def discrete_states_of(mechanism: Mechanism) -> tuple[DiscreteState, ...]:
    """Return the states of all parts that change at moments only, in the order of the parts."""
    return tuple(one for local in mechanism.locals_.values() for one in local.discrete_states)


@dataclass(frozen=True)
class Derivation(Mechanism):
    """A mechanism while something is derived from it. Its table is its own, to which constants of the start are added.

    Attributes
    ----------
    decided
        What has been decided by the size of numbers.
    found
        The constants of the start that have been found.
    """

    decided: list[Decision] = field(default_factory=list)
    found: dict[Expression, Constant] = field(default_factory=dict)


def derivation_of(mechanism: Mechanism) -> Derivation:
    """Return a mechanism as a derivation in which nothing has been decided."""
    own = {name: getattr(mechanism, name) for name in names_of(Mechanism)}
    own["table"] = replace(mechanism.table, values=dict(mechanism.table.values))
    return Derivation(**own)


def decide(derivation: Derivation, how: Callable[[Mechanism], T]) -> T:
    """Decide something by the size of numbers, and note it: other values may decide it otherwise."""
    outcome = how(derivation)
    derivation.decided.append(Decision(how, outcome))
    return outcome


def place_of_largest(values: Sequence[Expression], mechanism: Mechanism) -> int:
    """Return which of some values is the largest at the start, to be decided by."""
    return int(np.argmax(np.abs(mechanism.values_at_start(values))))


def from_start(derivation: Derivation, name: str, form: str, value: Expression) -> Expression:
    """Return a parameter that has the value of an expression where the scene starts, whichever start that is."""
    symbol = derivation.table.graph.parameter(name)
    derivation.found[symbol] = constant = Constant(form, value)
    derivation.table.values[symbol] = _at_start(derivation, constant)
    return symbol


def _at_start(mechanism: Mechanism, constant: Constant) -> float:
    assert mechanism.places is not None
    return evaluate([constant.expression], {**mechanism.table.values, **mechanism.places[constant.form]})[0]


def started_at(mechanism: Mechanism, places: Mapping[str, Mapping[Expression, float]]) -> Mechanism:
    """Return a mechanism with the constants of another start."""
    made = replace(mechanism, places=places, table=replace(mechanism.table, values=dict(mechanism.table.values)))
    for symbol, constant in mechanism.constants.items():
        made.table.values[symbol] = _at_start(made, constant)
    return made


def extent(mechanism: Mechanism) -> float:
    """Return the extent of a mechanism, m: the largest length that a law of what moves reads; 0 if none is.

    Of a vector that is its magnitude, which does not depend on how the scene is turned.
    """
    found = ((mechanism.locals_[path].part.values[name], unsaid) for path, name, unsaid in sizing_parameters(mechanism))
    values = (value for value, unsaid in found if value != unsaid)
    return max((math.hypot(*one) if isinstance(one, tuple) else abs(one) for one in values), default=0.0)


def sizing_parameters(mechanism: Mechanism) -> Iterator[tuple[str, str, float]]:
    """Yield the part and the name of each parameter that is a length of what moves, and no place in the world.

    Lengths that no law reads say nothing, unless an output of their part is linked to an input.
    With them goes the value that says nothing: of a unit of length its default, else zero.
    """
    sources = {path for path, _ in mechanism.links.values()}
    for path, local in mechanism.locals_.items():
        specs, values = local.part.component.parameter_specs(), local.part.values
        lengths = [n for n, one in specs.items() if one.unit.exponents == (0, 1, 0, 0) and not one.place]
        read = [name for name in lengths if values[name] is not None and (path in sources or name not in local.unread)]
        if read and {mechanism.bodies.body_of[mechanism.graph.node_of[path, name]] for name in local.connectors} != {0}:
            for name in read:  # where the ground is says nothing about the size of what moves
                yield path, name, specs[name].default if specs[name].unit_length else 0.0


def check_closures(mechanism: Mechanism) -> None:
    """Check that rigid joints between parts of one body agree."""
    bodies, space = mechanism.bodies, mechanism.space
    for joint in bodies.closures:
        body = bodies.bodies[bodies.body_of[joint.a]]
        offsets, turns = body_offsets(body, space)
        placement = joint.local.placement
        from_a = placement.displacement
        if placement.axes == "a" and space.has_rotation:
            from_a = rotate(from_a, turns[joint.a])
        gap = offsets[joint.b] - offsets[joint.a] - from_a
        graph = mechanism.table.graph
        misses = [*gap, *_turns_missed(joint, turns[joint.a], turns[joint.b], space)]
        numbers = evaluate([graph.convert(m) for m in misses], mechanism.table.values)
        turned = max((abs(m) for m in numbers[3:]), default=0.0)
        if (
            not all(abs(m) <= tolerances.CLOSED * (extent(mechanism) or 1.0) for m in numbers[:3])
            or not turned <= tolerances.CLOSED
        ):
            kind = "fixed parts contradict each other" if body.is_fixed else "rigid parts do not fit together"
            raise TopologyError(
                f"{kind}: the error is {', '.join(f'{m:g}' for m in numbers[:3])} m and {turned:g} rad",
                where=joint.label,
                advice="Two rigid connections prescribe different positions for the same point; remove or change one.",
            )


def _turns_missed(joint: Joint, turn_a: NodeTurn, turn_b: NodeTurn, space: Space) -> list[Scalar]:
    """Return by what angles, while they are small, a rigid joint's end is turned from where it should be."""
    if not space.has_rotation:
        return []
    rotation = joint.local.placement.rotation
    if isinstance(turn_a, tuple) and isinstance(turn_b, tuple):
        wanted = compose(turn_a, as_rotation(0.0 if rotation is None else rotation).axes())
        return [component for mine, theirs in zip(turn_b, wanted, strict=True) for component in mine - theirs]
    angle: Any = 0.0 if rotation is None else rotation
    return [plain(turn_b) - plain(turn_a) - angle]


def make_gravity(table: ParameterTable, value: float, direction: tuple[float, float, float]) -> Vector:
    """Return the acceleration of free fall as a vector."""
    pull = table.scalar("gravity", value)
    along: Vector = as_vector(direction) * pull
    return along


# -- where positions are counted from ---------------------------------------------------------------------------------
#
# A place far away takes digits from every length that is a difference of positions: at a million sizes from the origin
# a closed loop is known to 1e-10 of its size, and no tolerance below that can be met. So positions are counted from a
# fixed node near by. Laws read positions in the world; differences of two do not contain the place any more
# (`expr.core.arithmetic`).

_FAR = 10.0
"""Places farther from the origin than so many times the mechanism's extent cost more than a digit."""


def find_origin(mechanism: Mechanism) -> Connector | None:
    """Return the fixed connector that positions are counted from; None for the world's origin, if that is near."""
    nodes = _attached(mechanism)
    size = extent(mechanism)
    if not nodes or nodes[0] == WORLD or size == 0.0:
        return None
    offsets = body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0]
    graph = mechanism.table.graph
    flat = [graph.convert(c) for node in nodes for c in mechanism.space.components(offsets[node])]
    if all(one.is_zero for one in flat):
        return None
    values, n = evaluate(flat, mechanism.table.values), len(mechanism.space.basis)
    nearest = min(math.hypot(*values[i : i + n]) for i in range(0, len(values), n))
    return mechanism.graph.nodes[nodes[0]].members[0] if nearest > _FAR * size else None


def decided_near(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with the note that the place to count from was chosen by where it is."""
    if all(one.is_zero for one in _fixed_places(mechanism)):
        return mechanism
    return replace(mechanism, decisions=(*mechanism.decisions, Decision(find_origin, find_origin(mechanism))))


def origin_at(mechanism: Mechanism, connector: Connector) -> tuple[Expression, ...]:
    """Return where a fixed connector is, along the free components of the space."""
    offsets = body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0]
    place = offsets[mechanism.graph.node_of[connector]]
    return tuple(mechanism.table.graph.convert(c) for c in mechanism.space.components(place))


def world_position(mechanism: Mechanism, placements: Placements, node: int) -> tuple[Scalar, ...]:
    """Return the position of a node from the world's origin, along the free components of the space."""
    place = placements.positions[node]
    return tuple(o + p for o, p in zip(mechanism.table.origin or (0.0,) * len(place), place, strict=True))


def _fixed_places(mechanism: Mechanism) -> Iterator[Expression]:
    for place in body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0].values():
        yield from (mechanism.table.graph.convert(c) for c in mechanism.space.components(place))


def _attached(mechanism: Mechanism) -> list[int]:
    """Return the fixed nodes at which parts of something that moves begin, in order."""
    bodies, network = mechanism.bodies, mechanism.graph
    moving = {joint.a if bodies.body_of[joint.a] == 0 else joint.b for joint in network.joints if not joint.is_rigid}
    found = {node for node in moving if bodies.body_of[node] == 0}
    for path, local in mechanism.locals_.items():
        nodes = [network.node_of[path, name] for name in local.connectors]
        fixed = {node for node in nodes if bodies.body_of[node] == 0}
        if len(fixed) < len(set(nodes)):
            found |= fixed
    return sorted(found)
