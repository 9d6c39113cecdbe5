"""Reactions that components report: multipliers of constraints, and what passes through a rigid joint inside a body.

The rigid joint is cut in thought; what is exerted on the far side is its inertia less all other forces on it (Newton
and Euler for a part of a rigid body).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from atwood.expr import Expression, OutputGroup, Program, Scalar
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations, push_body
from atwood.mechanics.dynamics.forces import (
    Forces,
    PlacedPart,
    constraint_forces,
    in_coordinates,
    part_forces,
    place_part,
)
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.orientation import spin_in_world
from atwood.model.values.space import Space, Vector, cross
from atwood.topology.bodies import Body
from atwood.topology.graph import Joint


@dataclass(frozen=True)
class InternalReactions:
    """Program of (t, q, u, a, multipliers) with reactions inside bodies, and the row of each by its path."""

    program: Program
    rows: Mapping[str, int]


def internal_reaction_program(
    mechanism: Mechanism, equations: Equations, reactions: Sequence[Reaction], parameters: Collection[Expression]
) -> InternalReactions | None:
    """Return the program of all reactions inside bodies; None if no component reports one."""
    wanted = [reaction for reaction in reactions if reaction.axis >= 0]
    if not wanted:
        return None
    loads = _all_forces(mechanism, equations)
    expressions: list[Expression] = []
    rows: dict[str, int] = {}
    cache: dict[tuple[str, str, int], tuple[Vector, Vector] | None] = {}
    for reaction in wanted:
        if reaction.key not in cache:
            cache[reaction.key] = _through(mechanism, equations, loads, reaction)
        passed = cache[reaction.key]
        if passed is None:
            continue
        force, torque = passed
        value = force[reaction.axis] if reaction.axis < 3 else _counted(torque, reaction.axis - 3, mechanism.space)
        rows[reaction.path] = len(expressions)
        expressions.append(equations.graph.convert(value))
    outputs = (OutputGroup("r", tuple(expressions)),)
    return InternalReactions(Program("reactions inside bodies", equations.inputs, tuple(parameters), outputs), rows)


def _counted(torque_W: Vector, axis: int, space: Space) -> Scalar:
    """Return a component of a torque as it is reported: counter-clockwise in a plane, in world axes in space."""
    return torque_W[axis] if space.is_spatial else -torque_W.y


def _all_forces(mechanism: Mechanism, equations: Equations) -> Forces:
    """Return inertia less all other forces, with the sign reversed, node by node."""
    site, kinematics = equations.site, equations.kinematics
    signals = resolve_signals(mechanism, site, kinematics, equations.contact_forces)
    forces = Forces(equations.graph)
    multipliers = multipliers_by_part(equations)
    for path, local in mechanism.locals_.items():
        part = place_part(site, local, kinematics, signals)
        part_forces(part, forces)
        add_reactions(part, multipliers, forces)
        add_inertia(mechanism, equations, path, forces)
    return forces


def multipliers_by_part(equations: Equations) -> dict[str, dict[tuple[str, int], Expression]]:
    """Return the multipliers of each part by law and number."""
    found: dict[str, dict[tuple[str, int], Expression]] = {}
    for one in equations.constraints:
        part, law, number = one.key
        found.setdefault(part, {})[law, number] = one.multiplier
    return found


def add_reactions(
    part: PlacedPart, multipliers: Mapping[str, Mapping[tuple[str, int], Expression]], forces: Forces
) -> None:
    """Add the forces of a part's constraints."""
    own = multipliers.get(part.local.part.path, {})
    for constraint in part.local.constraints:
        multiplier = own.get((constraint.law.name, constraint.index))
        if multiplier is not None:
            held = in_coordinates(part.local, constraint, part.kinematics.placements)
            constraint_forces(part, held.value, multiplier, forces)


def add_inertia(mechanism: Mechanism, equations: Equations, path: str, forces: Forces) -> None:
    """Add the inertia and the weight of a part, with the sign of forces that it exerts."""
    graph, kinematics, site = equations.graph, equations.kinematics, equations.site
    local, pull = mechanism.locals_[path], mechanism.space.components(mechanism.gravity)
    for inertia in local.point_inertias:
        nodes = [site.node(path, p.name) for p in inertia.points]
        for i, node in enumerate(nodes):
            push = [graph.constant(0.0) for _ in pull]
            for j, other in enumerate(nodes):
                lifted = zip(kinematics.accelerations[other], pull, strict=True)
                push = [p - inertia.masses[i][j] * (a - g) for p, (a, g) in zip(push, lifted, strict=True)]
            forces.push(node, push)
    for body in local.body_inertias:
        node = site.node(path, body.frame.name)
        push_body(site, kinematics, forces, path, body, (kinematics.accelerations[node], pull))


def _through(
    mechanism: Mechanism, equations: Equations, forces: Forces, reaction: Reaction
) -> tuple[Vector, Vector] | None:
    """Return the force and torque, in world axes, that a rigid joint exerts on its b side; None if not unique."""
    part, law, _ = reaction.key
    joint = next(j for j in mechanism.graph.joints if j.part == part and j.local.law.name == law)
    body = mechanism.bodies.bodies[mechanism.bodies.body_of[joint.b]]
    far = _far_side(body, joint)
    if far is None:
        return None
    space, positions = mechanism.space, equations.kinematics.placements.positions
    axes = equations.kinematics.placements.axes.get(body.index)
    total, torque = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    for node in far:
        push = forces.on_nodes.get(node)
        if push is not None:
            force_W = space.vector(tuple(push))
            total = total - force_W
            arm = [p - o for p, o in zip(positions[node], positions[joint.b], strict=True)]
            torque = torque - cross(space.vector(tuple(arm)), force_W)
        if node in forces.at_nodes:
            torque = torque - spin_in_world(forces.at_nodes[node], axes)
    return total, torque


def _far_side(body: Body, joint: Joint) -> list[int] | None:
    """Return the nodes that are held through a rigid joint on its b side; None if another way holds them too."""
    step = next((s for s in body.steps if s.joint is joint), None)
    if step is None:
        return None
    below = [step.child]
    for other in body.steps:
        if other.parent in below and other.child not in below:
            below.append(other.child)
    return [node for node in body.nodes if node not in below] if step.backwards else below


@dataclass(frozen=True)
class Reaction:
    """A reaction that a component reports.

    Attributes
    ----------
    path
        Its dotted path.
    unit, doc
        Unit and meaning.
    symbol
        What stands for it in the expressions of observables.
    key
        The constraint it belongs to, as (part, law, number); for a rigid joint, (part, law, -1).
    sign
        It is `sign` times the multiplier of that constraint.
    axis
        For a rigid joint: 0, 1, 2 for a force component, 3 for the torque in a plane, 3, 4, 5 for its components in
        space; -1 otherwise.
    """

    path: str
    unit: str
    doc: str
    symbol: Expression
    key: tuple[str, str, int]
    sign: float
    axis: int = -1


def list_reactions(mechanism: Mechanism) -> tuple[Reaction, ...]:
    """Return every reaction that the components report, in the order of declaration."""
    graph, found = mechanism.table.graph, []
    reported = {f".{'xyz'[i]}" for i in mechanism.space.reported_axes}
    for path, local in mechanism.locals_.items():
        held = dict.fromkeys(c.law for c in local.constraints if c.law.kind in ("unilateral", "friction"))
        gaps = {name for law in (*held, *(one.law for one in local.contacts)) for name in law.options.reactions}
        for law in (*local.part.component.laws("constraint"), *held):
            if not law.holds_in(mechanism.space.name):
                continue
            options = law.options
            names = options.reactions
            present = [c for c in local.constraints if c.law.name == law.name]
            if len(names) == 1 and len(present) == 3:
                names = tuple(f"{names[0]}.{axis}" for axis in "xyz")
            for index, name in enumerate(names):
                if any(name.endswith(f".{axis}") for axis in "xyz") and name[-2:] not in reported:
                    continue
                if law not in held and name in gaps:
                    continue
                full = f"{path}.{name}"
                symbol, sign = graph.symbol(f"reaction:{full}"), 1.0 if law in held else options.sign
                found.append(Reaction(full, options.unit, options.doc, symbol, (path, law.name, index), sign))
        for joint in local.joints:
            options = joint.law.options
            if not (options.rigid and options.reaction_doc):
                continue
            for axis in mechanism.space.reported_axes:
                full, doc = f"{path}.force.{'xyz'[axis]}", f"Force {options.reaction_doc}, in world axes."
                symbol = graph.symbol(f"reaction:{full}")
                found.append(Reaction(full, "N", doc, symbol, (path, joint.law.name, -1), 1.0, axis))
            about = "counter-clockwise" if mechanism.space.is_planar else "in world axes"
            for number, axis_name in enumerate(mechanism.space.turn_names):
                full, doc = f"{path}.torque{axis_name}", f"Torque {options.reaction_doc}, {about}."
                symbol = graph.symbol(f"reaction:{full}")
                key = (path, joint.law.name, -1)
                found.append(Reaction(full, "N*m", doc, symbol, key, 1.0, 3 + number))
    return tuple(found)
