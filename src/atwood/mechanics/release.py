"""Reactions inside a body: what passes through a rigid joint.

The joint is cut in thought; what is exerted on the far side is its inertia less all other forces on it (Newton and
Euler for a part of a rigid body).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from atwood.expr import Expression, InputGroup, OutputGroup, Program, Scalar
from atwood.mechanics.build import Mechanism, resolve_signals
from atwood.mechanics.equations import Equations
from atwood.mechanics.forces import Forces, constraint_forces, local_map, part_forces
from atwood.mechanics.kinematics import arm_of
from atwood.mechanics.observables import Reaction
from atwood.model.vector import Vector
from atwood.topology.bodies import Body
from atwood.topology.graph import Joint

__all__ = ["Release", "release_program"]


@dataclass(frozen=True)
class Release:
    """Program of (t, q, u, a, multipliers) with reactions inside bodies, and the row of each by its path."""

    program: Program
    rows: Mapping[str, int]


def release_program(
    mechanism: Mechanism, equations: Equations, reactions: Sequence[Reaction], parameters: Collection[Expression]
) -> Release | None:
    """Return the program of all reactions inside bodies; None if no component reports one.

    Parameters
    ----------
    mechanism, equations
        The mechanism, and its equations in maximal coordinates.
    reactions
        What `list_reactions` gave.
    parameters
        The symbols of parameters.
    """
    wanted = [reaction for reaction in reactions if reaction.axis >= 0]
    if not wanted:
        return None
    loads = _all_forces(mechanism, equations)
    expressions: list[Expression] = []
    rows: dict[str, int] = {}
    cache: dict[tuple[str, str, int], tuple[list[Scalar], Scalar] | None] = {}
    for reaction in wanted:
        if reaction.key not in cache:
            cache[reaction.key] = _through(mechanism, equations, loads, reaction)
        passed = cache[reaction.key]
        if passed is None:
            continue
        force, torque = passed
        value = torque if reaction.axis == 3 else mechanism.space.vector(tuple(force))[reaction.axis]
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
    return Release(program, rows)


def _all_forces(mechanism: Mechanism, equations: Equations) -> Forces:
    """Return inertia less all other forces, with the sign reversed, node by node."""
    graph, kinematics, site = equations.graph, equations.kinematics, equations.site
    signals = resolve_signals(mechanism, site, kinematics)
    forces = Forces(graph)
    by_part: dict[str, list[tuple[str, int, Expression]]] = {}
    for one in equations.constraints:
        by_part.setdefault(one.key[0], []).append((one.key[1], one.key[2], one.multiplier))
    pull = mechanism.space.components(mechanism.gravity)
    for path, local in mechanism.locals_.items():
        mapping = {**local_map(site, local, kinematics), **signals}
        part_forces(site, local, mapping, forces)
        for constraint in local.constraints:
            for law, index, multiplier in by_part.get(path, ()):
                if (law, index) == (constraint.law.name, constraint.index):
                    constraint_forces(site, local, constraint.value, multiplier, mapping, forces)
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
            _push_body(mechanism, equations, forces, node, body.mass, body.center_of_mass, body.moment)
    return forces


def _push_body(
    mechanism: Mechanism,
    equations: Equations,
    forces: Forces,
    node: int,
    mass: Scalar,
    center: Vector,
    moment: Scalar,
) -> None:
    """Add the inertial force of a rigid body, taken to its frame's node."""
    kinematics, space = equations.kinematics, mechanism.space
    index = equations.site.bodies.body_of[node]
    arm = arm_of(kinematics.placements, index, equations.site.node_turns[node], center, space)
    pull = space.components(mechanism.gravity)
    acceleration = list(kinematics.accelerations[node])
    turning: Scalar = 0.0
    if space.name == "plane" and index in kinematics.angular_speeds:
        w, turning = kinematics.angular_speeds[index], kinematics.angular_accelerations[index]
        acceleration = [
            acceleration[0] - turning * arm[1] - w * w * arm[0],
            acceleration[1] + turning * arm[0] - w * w * arm[1],
        ]
    force = [-mass * (a - g) for a, g in zip(acceleration, pull, strict=True)]
    forces.push(node, force)
    if space.name == "plane":
        forces.twist(index, arm[0] * force[1] - arm[1] * force[0] - moment * turning, node)


def _through(
    mechanism: Mechanism, equations: Equations, forces: Forces, reaction: Reaction
) -> tuple[list[Scalar], Scalar] | None:
    """Return the force and torque that a rigid joint exerts on its b side; None where it is not unique."""
    part, law, _ = reaction.key
    joint = next(j for j in mechanism.graph.joints if j.part == part and j.local.law.name == law)
    body = mechanism.bodies.bodies[mechanism.bodies.body_of[joint.b]]
    far = _far_side(body, joint)
    if far is None:
        return None
    zero = equations.graph.constant(0.0)
    total: list[Scalar] = [zero for _ in mechanism.space.basis]
    torque: Scalar = zero
    positions = equations.kinematics.placements.positions
    for node in far:
        push = forces.on_nodes.get(node)
        if push is not None:
            total = [t - f for t, f in zip(total, push, strict=True)]
            if mechanism.space.name == "plane":
                arm = [p - o for p, o in zip(positions[node], positions[joint.b], strict=True)]
                torque = torque - (arm[0] * push[1] - arm[1] * push[0])
        torque = torque - forces.at_nodes.get(node, zero)
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
