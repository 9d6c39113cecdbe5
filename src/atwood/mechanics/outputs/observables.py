"""What can be read of a scene: every quantity of every component, by its path, as an expression of the state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.expr import Expression, Scalar, jvp, live, substitute, vjp
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.carried_inertia import CarriedInertia
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import in_joint_coordinates, local_map, rate_symbol
from atwood.mechanics.dynamics.inertia import tensor_of, turned_tensor
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import NodeTurn, node_axes, spin_in_world
from atwood.mechanics.kinematics.positions import body_point_of
from atwood.model.declare.component import Binding
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.declare.contributions import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import from_axes, to_axes
from atwood.model.values.space import FIXED_AXES
from atwood.model.values.vector import Vector, dot


@dataclass(frozen=True)
class Observable:
    """A scalar quantity of a component.

    Attributes
    ----------
    path
        Its dotted path, such as ``rod1.tension``.
    unit
        SI unit.
    doc
        One line of meaning.
    periodic
        Whether it comes out within one turn and must be unwrapped.
    value
        The expression, of time, coordinates, speeds, accelerations and reactions.
    rate
        Path of its rate, for a periodic one; empty if none is said.
    sharing
        Of two angles that share a value at a pole: their paths, and that of the sign with which the second is added.
    """

    path: str
    unit: str
    doc: str
    periodic: bool
    value: Expression
    rate: str = ""
    sharing: tuple[str, ...] = ()


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
        for law in local.part.component.laws("constraint"):
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
                full = f"{path}.{name}"
                symbol = graph.symbol(f"reaction:{full}")
                found.append(Reaction(full, options.unit, options.doc, symbol, (path, law.name, index), options.sign))
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


def take(
    mechanism: Mechanism,
    found: dict[str, Observable],
    path: str,
    value: Scalar | Vector,
    unit: str,
    doc: str,
    periodic: bool,
    rate: str = "",
) -> None:
    """Add a quantity to those found, component by component if it is a vector."""
    graph = mechanism.table.graph
    if isinstance(value, Vector):
        for axis in mechanism.space.reported(value, unit):
            name = f"{path}.{'xyz'[axis]}"
            found[name] = Observable(name, unit, doc, periodic, graph.convert(value[axis]))
    else:
        expression = graph.convert(value)
        found[path] = Observable(path, unit, doc, periodic and not _counts_turns(expression), expression, rate)


def _counts_turns(angle: Expression) -> bool:
    """Return whether an angle counts its turns by itself: it is a sum of coordinates, each with its own turns."""
    return all(node.is_parametric or node.is_symbol or node.operation in _SUMS for node in live([angle]))


_SUMS = frozenset(("add", "sub", "neg"))


def make_binding(
    mechanism: Mechanism,
    equations: Equations,
    local: LocalPart,
    reactions: Mapping[str, Expression],
    known: Mapping[str, Expression],
    energies: Mapping[str, Any],
    signals: Mapping[Expression, Expression],
) -> Binding:
    """Return what the laws of a part read when they may read everything."""
    path, site, kinematics, space = local.part.path, equations.site, equations.kinematics, mechanism.space
    motions = {}
    mapping = local_map(site, local, kinematics) if local.borrowed else {}
    for name, one in local.part.component.connectors().items():
        if isinstance(one, JointCoordinate):
            motions[name] = _joint_reference_in_place(equations, local, local.binding.motions.get(name), mapping)
            continue
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        motion = Motion(
            position=space.vector(world_position(mechanism, kinematics.placements, node)),
            velocity=space.vector(kinematics.velocities[node]),
            acceleration=space.vector(kinematics.accelerations[node]),
        )
        if isinstance(one, Frame):
            motion = _turned(mechanism, equations, motion, node, body)
        carried = CarriedInertia(mechanism.graph, mechanism.bodies, mechanism.locals_, space, path, name)
        motions[name] = replace(motion, body=carried)
    values = dict(local.binding.values)
    for name, symbol in local.signal_symbols.items():
        values[name] = signals[symbol]
    return Binding(
        values=values,
        motions=motions,
        time=mechanism.time,
        space=space.name,
        line=space.line,
        line_signs=local.binding.line_signs,
        known=known,
        reactions=reactions,
        energies=energies,
    )


def _joint_reference_in_place(
    equations: Equations, local: LocalPart, joint_reference: Motion | None, mapping: Mapping[Expression, Expression]
) -> Motion:
    """Return a joint coordinate that a part takes hold of, in terms of the state; nothing at the joint itself."""
    if joint_reference is None:
        return Motion()
    found = [joint_reference.value, *(() if joint_reference.rate is None else (joint_reference.rate,))]
    value, *rates = substitute(in_joint_coordinates(local, equations.kinematics, found)[0], mapping)
    if not rates:
        return Motion(value=value)
    course: dict[Expression, Expression | float] = {equations.time: 1.0}
    course.update(zip(equations.coordinates, equations.rates, strict=True))
    course.update(zip(equations.speeds, equations.accelerations, strict=True))
    return Motion(value=value, rate=rates[0], second_rate=lambda: jvp(rates, course)[0])


def _turned(mechanism: Mechanism, equations: Equations, motion: Motion, node: int, body: int) -> Motion:
    kinematics = equations.kinematics
    if not mechanism.space.has_rotation:
        still = Vector(0.0, 0.0, 0.0)
        return Motion(motion.position, motion.velocity, motion.acceleration, FIXED_AXES, 0.0, still, still)
    placements = kinematics.placements
    turn, angle = equations.site.node_turns[node], placements.angles.get(body)
    axes = node_axes(angle, placements.axes.get(body), turn)
    if axes is None:
        return motion
    body_axes = placements.axes.get(body)
    return Motion(
        motion.position,
        motion.velocity,
        motion.acceleration,
        axes,
        None if angle is None else angle + turn,
        spin_in_world(kinematics.angular_velocities[body], body_axes),
        spin_in_world(kinematics.angular_accelerations[body], body_axes),
        to_axes(turn, Vector(*kinematics.angular_velocities[body])) if isinstance(turn, tuple) else None,
    )


def part_energies(
    mechanism: Mechanism, equations: Equations, path: str, signals: Mapping[Expression, Expression]
) -> tuple[Expression, Expression]:
    """Return kinetic and potential energy of one part, its weight included."""
    graph, local, kinematics = mechanism.table.graph, mechanism.locals_[path], equations.kinematics
    site, space = equations.site, mechanism.space
    mapping = {**local_map(site, local, kinematics), **signals}
    kinetic: Scalar = graph.constant(0.0)
    potential: Scalar = graph.constant(0.0)
    pull = space.components(mechanism.gravity)
    for one in local.point_inertias:
        nodes = [site.node(path, p.name) for p in one.points]
        places = [world_position(mechanism, kinematics.placements, node) for node in nodes]
        for i, a in enumerate(nodes):
            for j, b in enumerate(nodes):
                for k, g in enumerate(pull):
                    va, vb = kinematics.velocities[a][k], kinematics.velocities[b][k]
                    kinetic = kinetic + 0.5 * (one.masses[i][j] * (va * vb))
                    potential = potential - one.masses[i][j] * (g * places[i][k])
    for body in local.body_inertias:
        node = site.node(path, body.frame.name)
        index = site.bodies.body_of[node]
        turn = site.node_turns[node]
        arm = body_point_of(kinematics, index, turn, body.center_of_mass, space)
        place = world_position(mechanism, kinematics.placements, node)
        for k, g in enumerate(pull):
            v = kinematics.velocities[node][k] + arm.velocity[k]
            kinetic = kinetic + 0.5 * (body.mass * (v * v))
            potential = potential - body.mass * (g * (place[k] + arm.position[k]))
        kinetic = kinetic + _energy_of_turning(path, body, turn, kinematics.angular_velocities.get(index, ()))
    for value in in_joint_coordinates(local, kinematics, local.potentials)[0]:
        potential = potential + substitute([value], mapping)[0]
    functions, hung = in_joint_coordinates(local, kinematics, local.lagrangians)
    for value in functions:
        rates = [*local.velocities, *(rate_symbol(symbol) for symbol in hung)]
        momenta = vjp([value], [graph.constant(1.0)], rates)
        still = substitute([value], dict.fromkeys(rates, graph.zero))[0]
        energy = sum((p * v for p, v in zip(momenta, rates, strict=True)), still - value)
        kinetic = kinetic + substitute([energy], mapping)[0]
        potential = potential - substitute([still], mapping)[0]
    return graph.convert(kinetic), graph.convert(potential)


def _energy_of_turning(path: str, body: BodyInertia, turn: NodeTurn, spin: Sequence[Expression]) -> Scalar:
    """Return ``1/2 omega . J omega`` (Goldstein, section 5.3)."""
    if len(spin) == 3:
        omega = Vector(*spin)
        return 0.5 * dot(omega, from_axes(turned_tensor(tensor_of(path, body), turn), omega))
    return 0.5 * (body.moment * (spin[0] * spin[0])) if spin else 0.0


def energies(mechanism: Mechanism, equations: Equations) -> tuple[Expression, Expression]:
    """Return kinetic and potential energy of the scene."""
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
    parts = [part_energies(mechanism, equations, path, signals) for path in mechanism.locals_]
    return add_up([k for k, _ in parts]), add_up([v for _, v in parts])


def add_up(values: Sequence[Expression]) -> Expression:
    """Return a sum."""
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total
