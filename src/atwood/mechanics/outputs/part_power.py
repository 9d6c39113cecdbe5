"""Energies and powers part by part: what each part has, takes in at its connectors, is given, and dissipates.

A part exerts the force F on whatever is connected at a node that moves with v, and so takes in the power ``-F . v``
there; its inertia is one of these forces (d'Alembert; Goldstein, section 1.4). What comes in through all of its
connectors is the rate of its energy, but for what its laws add or remove. Kinetic energy is ``1/2 w . M w`` with masses
that are constant; loads, dampers, and potentials that change with time have powers and no potential.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Literal

from atwood.expr import Expression, InputGroup, OutputGroup, Program, Scalar, depends_on, jvp, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import Forces, PlacedPart, in_joint_coordinates, part_forces, place_part
from atwood.mechanics.dynamics.inertia import tensor_of, turned_tensor
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.positions import body_point_of
from atwood.mechanics.outputs.reactions import add_inertia, add_reactions, multipliers_by_part
from atwood.mechanics.outputs.totals import part_energies
from atwood.model.local.contacts import powers
from atwood.model.local.moving_mass import inertial_energy
from atwood.model.local.parts import LocalPart


@dataclass(frozen=True)
class Flow:
    """What a row of a program is.

    Attributes
    ----------
    kind
        Power that a part takes in at a node, or at the coordinate of a joint; that its loads and whatever changes with
        time supply; that its dampers dissipate.
    part
        Path of the part.
    place
        Number of the node; path of the coordinate; else empty.
    """

    kind: Literal["node", "coordinate", "supplied", "dissipated"]
    part: str
    place: int | str = ""


@dataclass(frozen=True)
class PartPowers:
    """Program of (t, q, u, a, multipliers), in maximal coordinates, with a row for each flow, W.

    That of impulses has those of gaps and slips as an input of their own.
    """

    program: Program
    flows: tuple[Flow, ...]


def part_energy_program(mechanism: Mechanism, equations: Equations, parameters: Collection[Expression]) -> Program:
    """Return the program of (t, q, u) that gives kinetic and potential energy of each part in turn, J."""
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
    values = [x for path in mechanism.locals_ for x in part_energies(mechanism, equations, path, signals)]
    return Program("energies by part", equations.inputs[:3], tuple(parameters), (OutputGroup("e", tuple(values)),))


def part_powers(
    mechanism: Mechanism, equations: Equations, parameters: Collection[Expression], of_impulses: bool = False
) -> PartPowers:
    """Return the program of all powers, part by part."""
    signals = resolve_signals(mechanism, equations.site, equations.kinematics)
    multipliers = multipliers_by_part(equations)
    found: dict[Flow, Expression] = {}
    for path, local in mechanism.locals_.items():
        part = place_part(equations.site, local, equations.kinematics, signals)
        laws, loaded, damped = _by_kind(local)
        total = Forces(equations.graph)
        add_inertia(mechanism, equations, path, total)
        add_reactions(part, multipliers, total)
        if of_impulses:
            struck = {one.stand_in: one.multiplier for one in local.contacts}
            laws = replace(laws, potentials=(), dissipations=powers(local.contacts), stand_ins=struck)
            part_forces(replace(part, local=laws), total)
        else:
            part_forces(replace(part, local=laws), total)
            for flow, some, sign in ((Flow("supplied", path), loaded, 1.0), (Flow("dissipated", path), damped, -1.0)):
                alone = Forces(equations.graph)
                part_forces(replace(part, local=some), alone)
                for power in _given_at(equations, path, alone).values():
                    _add(found, flow, power * sign)
                part_forces(replace(part, local=some), total)
            _add(found, Flow("supplied", path), _explicit_rate(mechanism, equations, part, signals))
        for flow, power in _given_at(equations, path, total).items():
            _add(found, flow, -power)
    kept = {flow: value for flow, value in found.items() if not value.is_zero}
    inputs, values = equations.inputs, list(kept.values())
    if of_impulses:
        inputs = (*inputs, InputGroup("impulses of contacts", equations.contact_multipliers[::2]))
    else:
        values = substitute(values, dict(equations.contact_forces))
    outputs = (OutputGroup("p", tuple(values)),)
    return PartPowers(Program("powers by part", inputs, tuple(parameters), outputs), tuple(kept))


def _add(found: dict[Flow, Expression], flow: Flow, power: Expression) -> None:
    held = found.get(flow)
    found[flow] = power if held is None else held + power


def _by_kind(local: LocalPart) -> tuple[LocalPart, LocalPart, LocalPart]:
    """Return a part with its potentials and Lagrangians alone, with its loads alone, and with its dampers alone."""
    loads: list[Expression] = []
    dampers: list[Expression] = []
    given = [one for one in local.stand_ins if one not in {contact.stand_in for contact in local.contacts}]
    for value in local.dissipations:  # loads on joint coordinates are among them; friction dissipates
        (loads if depends_on(value, given) else dampers).append(value)
    none = replace(local, potentials=(), lagrangians=(), dissipations=(), loads=())
    return (
        replace(none, potentials=local.potentials, lagrangians=local.lagrangians),
        replace(none, dissipations=tuple(loads), loads=local.loads),
        replace(none, dissipations=tuple(dampers)),
    )


def _given_at(equations: Equations, path: str, forces: Forces) -> dict[Flow, Expression]:
    """Return the power that forces of a part give to each node and joint coordinate."""
    kinematics, found = equations.kinematics, dict[Flow, Expression]()
    for node, force in forces.on_nodes.items():
        for f, v in zip(force, kinematics.velocities[node], strict=True):
            _add(found, Flow("node", path, node), f * v)
    for node, torque in forces.at_nodes.items():
        spin: Sequence[Expression] = kinematics.angular_velocities.get(equations.site.bodies.body_of[node], ())
        for c, w in zip(torque, spin, strict=False):
            _add(found, Flow("node", path, node), c * w)
    for symbol, force_on_joint in forces.on_joints.items():
        _add(found, Flow("coordinate", path, symbol.name), force_on_joint * kinematics.joint_rates[symbol])
    return found


def _explicit_rate(
    mechanism: Mechanism, equations: Equations, part: PlacedPart, signals: Mapping[Expression, Expression]
) -> Expression:
    """Return how fast the energy of a part changes while nothing moves, W: with time, linked inputs and states."""
    graph, local = equations.graph, part.local
    placed, total = _changing(mechanism, equations, local), graph.constant(0.0)
    if not placed:
        return total
    course = equations.course
    directions: dict[Expression, Expression | float] = {mechanism.time: 1.0}
    directions.update((one.symbol, course[one.symbol]) for one in local.states if one.symbol in course)
    for symbol in local.signal_symbols.values():
        if symbol in signals and depends_on(graph.convert(sum(placed)), [symbol]):
            directions[symbol] = jvp([signals[symbol]], course)[0]
    for slope in jvp(placed, directions):
        total = total + part.put([slope])[0]
    return total


def _changing(mechanism: Mechanism, equations: Equations, local: LocalPart) -> list[Expression]:
    """Return the energies of a part that may change with time while nothing moves."""
    energies = [*local.potentials, *(-value for value in local.lagrangians)]
    inertial = (inertial_energy(one, mechanism.gravity, mechanism.space.name) for one in local.varying)
    energies += map(equations.graph.convert, inertial)
    return in_joint_coordinates(local, equations.kinematics, energies)[0]


def applied_power(mechanism: Mechanism, equations: Equations) -> Expression:
    """Return the power, W, that loads, dampers and what changes with time put into the scene.

    What changes with time: potentials, Lagrangians, and mass, which takes its energy along.

    Constraints that move with time (drives) are left out: their power is minus their multiplier times the explicit
    time derivative of the constraint.
    """
    graph, kinematics = equations.graph, equations.kinematics
    signals = resolve_signals(mechanism, equations.site, kinematics, equations.read)
    forces = Forces(graph)
    total = graph.constant(0.0)
    for local in mechanism.locals_.values():
        part = place_part(equations.site, local, kinematics, signals)
        part_forces(replace(part, local=replace(local, potentials=(), lagrangians=())), forces)
        placed = _changing(mechanism, equations, local)
        for slope in jvp(placed, {mechanism.time: 1.0}) if placed else ():
            total = total + part.put([slope])[0]
    for node, force in forces.on_nodes.items():
        for f, v in zip(force, kinematics.velocities[node], strict=True):
            total = total + f * v
    for body, torque in forces.on_bodies.items():
        for c, w in zip(torque, kinematics.angular_velocities.get(body, ()), strict=False):
            total = total + c * w
    for symbol, force_on_joint in forces.on_joints.items():
        total = total + force_on_joint * kinematics.joint_rates[symbol]
    return total


def switched_energy(mechanism: Mechanism, equations: Equations) -> Expression:
    """Return the energy, J, of the potentials that act in some modes only, which comes and goes with these."""
    kinematics = equations.kinematics
    signals = resolve_signals(mechanism, equations.site, kinematics, equations.read)
    total = equations.graph.constant(0.0)
    for local in mechanism.locals_.values():
        part = place_part(equations.site, local, kinematics, signals)
        for value in in_joint_coordinates(local, kinematics, local.switched)[0]:
            total = total + part.put([value])[0]
    return total


@dataclass(frozen=True, eq=False)
class MovingMass:
    """Velocities that share a matrix of masses.

    Attributes
    ----------
    part
        Whose they are.
    axis
        Number of the world axis that they are along; -1 for the angular velocity in the axes of a body.
    velocities
        Components, m/s or rad/s.
    masses
        The matrix M, row by row, kg or kg m^2.
    """

    part: str
    axis: int
    velocities: Sequence[Expression]
    masses: Sequence[Sequence[Expression]]


def moving_masses(mechanism: Mechanism, equations: Equations) -> list[MovingMass]:
    """Return all that has kinetic energy, as material points and rigid bodies."""
    graph, kinematics, site = mechanism.table.graph, equations.kinematics, equations.site
    axes = range(len(mechanism.space.components(mechanism.gravity)))
    found: list[MovingMass] = []

    def add(part: str, axis: int, velocities: Sequence[Scalar], masses: Sequence[Sequence[Scalar]]) -> None:
        rows = [[graph.convert(m) for m in row] for row in masses]
        found.append(MovingMass(part, axis, [graph.convert(v) for v in velocities], rows))

    for path, local in mechanism.locals_.items():
        for one in local.point_inertias:
            nodes = [site.node(path, point.name) for point in one.points]
            for k in axes:
                add(path, k, [kinematics.velocities[node][k] for node in nodes], one.masses)
        for body in local.body_inertias:
            node = site.node(path, body.frame.name)
            index, turn = site.bodies.body_of[node], site.node_turns[node]
            arm = body_point_of(kinematics, index, turn, body.center_of_mass, mechanism.space)
            for k in axes:
                add(path, k, [kinematics.velocities[node][k] + arm.velocity[k]], [[body.mass]])
            spin = kinematics.angular_velocities.get(index, ())
            if len(spin) == 3:
                add(path, -1, spin, [tuple(column) for column in turned_tensor(tensor_of(path, body), turn)])
            elif spin:
                add(path, -1, spin, [[body.moment]])
    return found
