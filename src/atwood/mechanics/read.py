"""From a scene taken apart into leaves to its mechanism: the laws of all parts, and the joints and bodies they make.

On a line, lengths are signed once and for all by which of their ends starts further along.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from atwood.consistency.check import check_components
from atwood.expr import Expression, Graph, evaluate
from atwood.expr.core.relations import TimeRelations
from atwood.lazy_dataclasses import replace
from atwood.mechanics.constraints.massless_spins import hold_idle_spins
from atwood.mechanics.dynamics.inertia import check_tensors, inertia_asked_for
from atwood.mechanics.kinematics.mechanism import (
    Connector,
    Mechanism,
    check_closures,
    decided_near,
    find_origin,
    make_gravity,
    origin_at,
)
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.model.declare.law_results import Carried
from atwood.model.local.bound import ParameterTable, check_directions
from atwood.model.local.flatten import FlatScene
from atwood.model.local.laws import localize
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Space, Vector, dot
from atwood.topology.bodies import Bodies, find_bodies
from atwood.topology.graph import MechanismGraph, build_graph

LineSigns = Mapping[tuple[str, str, str], float]
"""On a line, the sign of each length: of (part, one connector, the other)."""


def read_mechanism(
    flat: FlatScene,
    modes: Mapping[str, str],
    known_line_signs: LineSigns | None = None,
    origin: Connector | Literal["near"] | None = "near",
) -> Mechanism:
    """Read the laws of all parts and find nodes, joints and bodies."""
    table, space = _empty_table(flat), flat.space
    check_directions(flat.parts, space)
    check_components(flat.parts, space)
    found = _read_laws(flat, modes, table, known_line_signs)
    line_signs = known_line_signs if space.is_line else None
    if space.is_line and not known_line_signs:  # lengths are signed by where their ends are, which bodies say
        line_signs = _find_line_signs(flat, table, found)
        found = _read_laws(flat, modes, table, line_signs)
    carried: Mapping[tuple[str, str], Carried] | None = None
    if any(local.asks for local in found.locals_.values()):  # laws that read the inertia of the body they are on
        carried = inertia_asked_for(found.network, found.bodies, found.locals_, space)
        found = _read_laws(flat, modes, table, line_signs, carried)
    gravity = make_gravity(table, flat.gravity, flat.gravity_direction)
    told = None if known_line_signs else line_signs
    mechanism = Mechanism(table, gravity, *found, flat.links, told, t_start=flat.t_start)
    at = find_origin(mechanism) if origin == "near" else origin
    if at is not None:  # laws are read once more, since they read positions in the world
        table = replace(table, origin=origin_at(mechanism, at))
        table.graph.origin = table.origin
        found = _read_laws(flat, modes, table, line_signs, carried)
        mechanism = Mechanism(table, gravity, *found, flat.links, told, t_start=flat.t_start, origin=at)
    mechanism = decided_near(mechanism)
    check_closures(mechanism)
    check_tensors(mechanism.locals_, table.values, space)
    return hold_idle_spins(mechanism)


class _Reading(NamedTuple):
    """The laws of all parts on symbols of their own, and the nodes and bodies that they make."""

    locals_: Mapping[str, LocalPart]
    network: MechanismGraph
    bodies: Bodies


def _empty_table(flat: FlatScene) -> ParameterTable:
    """Return a table without parameters, on a graph that notes relations of time."""
    table = ParameterTable(Graph(), flat.space)
    table.graph.relations = TimeRelations(table.time)
    return table


def _read_laws(
    flat: FlatScene,
    modes: Mapping[str, str],
    table: ParameterTable,
    line_signs: LineSigns | None = None,
    carried: Mapping[tuple[str, str], Carried] | None = None,
) -> _Reading:
    """Read all laws, with the signs of lengths and the inertia that they may ask for."""
    assert table.graph.relations is not None
    with table.graph.relations.reading():
        locals_ = localize(flat, table, modes, line_signs, carried)
    network = build_graph(flat, locals_)
    return _Reading(locals_, network, find_bodies(network, locals_))


def _find_line_signs(flat: FlatScene, table: ParameterTable, found: _Reading) -> LineSigns:
    """Return the signs of lengths on a line, as far as start values tell."""
    locals_, network, bodies = found
    offsets = {body.index: body_offsets(body, table.space)[0] for body in bodies.bodies}
    return find_line_signs(flat, network, bodies, locals_, offsets, table.values, table.space)


def find_line_signs(
    flat: FlatScene,
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    offsets: Mapping[int, Mapping[int, Vector]],
    parameters: Mapping[Expression, float],
    space: Space,
) -> dict[tuple[str, str, str], float]:
    """Return, for pairs of connectors of each part, the sign of the second's start position minus the first's."""
    assert space.line is not None
    places = {node: _number(offset, space.line, parameters) for node, offset in offsets[0].items()}
    for path, value in {**flat.guess, **flat.start}.items():
        _note(path, value, mechanism, bodies, locals_, offsets, parameters, space.line, places)
    found: dict[tuple[str, str, str], float] = {}
    for path, local in locals_.items():
        names = list(local.connectors)
        for a in names:
            for b in names:
                p, q = (places.get(mechanism.node_of[(path, name)]) for name in (a, b))
                if p is not None and q is not None and p != q:
                    found[path, a, b] = 1.0 if q > p else -1.0
    return found


def _number(vector: Vector, line: Vector, parameters: Mapping[Expression, float]) -> float:
    along = dot(vector, line)
    return evaluate([along], parameters)[0] if isinstance(along, Expression) else float(along)


def _note(
    path: str,
    value: float,
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    offsets: Mapping[int, Mapping[int, Vector]],
    parameters: Mapping[Expression, float],
    line: Vector,
    places: dict[int, float],
) -> None:
    """Take up a start value that says where the first connector of a part is, and with it the rest of its body."""
    for quantity, component in (("position.x", line.x), ("position.y", line.y), ("position.z", line.z)):
        owner, matched, _ = path.rpartition(f".{quantity}")
        if matched and owner in locals_ and component != 0.0:
            place = value / component
            break
    else:
        owner, matched, _ = path.rpartition(".displacement")
        if not matched or owner not in locals_:
            return
        place = value
    local = locals_[owner]
    if not local.connectors:
        return
    node = mechanism.node_of[(owner, next(iter(local.connectors)))]
    body = bodies.body_of[node]
    for other, offset in offsets[body].items():
        places.setdefault(other, place + _number(offset - offsets[body][node], line, parameters))
