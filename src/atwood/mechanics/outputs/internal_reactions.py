"""Reactions inside a body: what passes through a rigid joint.

The joint is cut in thought; what is exerted on the far side is its inertia less all other forces on it (Newton and
Euler for a part of a rigid body).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from atwood.expr import Expression, InputGroup, OutputGroup, Program, Scalar
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations, push_body
from atwood.mechanics.dynamics.forces import Forces, constraint_forces, in_coordinates, local_map, part_forces
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.orientation import spin_in_world
from atwood.mechanics.outputs.observables import Reaction
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Space
from atwood.model.values.vector import Vector, cross
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
    groups = (
        InputGroup("t", (equations.time,)),
        InputGroup("q", equations.coordinates),
        InputGroup("u", equations.speeds),
        InputGroup("a", equations.accelerations),
        InputGroup("multipliers", equations.multipliers),
    )
    program = Program("reactions inside bodies", groups, tuple(parameters), (OutputGroup("r", tuple(expressions)),))
    return InternalReactions(program, rows)


def _counted(torque_W: Vector, axis: int, space: Space) -> Scalar:
    """Return a component of a torque as it is reported: counter-clockwise in a plane, in world axes in space."""
    return torque_W[axis] if space.is_spatial else -torque_W.y


def _all_forces(mechanism: Mechanism, equations: Equations) -> Forces:
    """Return inertia less all other forces, with the sign reversed, node by node."""
    site, kinematics = equations.site, equations.kinematics
    signals = resolve_signals(mechanism, site, kinematics)
    forces = Forces(equations.graph)
    multipliers = multipliers_by_part(equations)
    for path, local in mechanism.locals_.items():
        mapping = {**local_map(site, local, kinematics), **signals}
        part_forces(site, local, kinematics, mapping, forces)
        add_reactions(equations, local, multipliers, mapping, forces)
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
    equations: Equations,
    local: LocalPart,
    multipliers: Mapping[str, Mapping[tuple[str, int], Expression]],
    mapping: Mapping[Expression, Expression],
    forces: Forces,
) -> None:
    """Add the forces of a part's constraints."""
    own = multipliers.get(local.part.path, {})
    for constraint in local.constraints:
        multiplier = own.get((constraint.law.name, constraint.index))
        if multiplier is not None:
            held = in_coordinates(local, constraint, equations.kinematics.placements)
            constraint_forces(equations.site, local, held.value, multiplier, mapping, forces)


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
