"""Energies, momenta and inertia of a part, and of several parts together, about the world's origin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from operator import add

from atwood.expr import Expression, Scalar, jvp, substitute, vjp
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import in_joint_coordinates, place_part, rate_symbol
from atwood.mechanics.dynamics.inertia import tensor_of, turned_tensor
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import NodeTurn
from atwood.mechanics.kinematics.positions import body_point_of
from atwood.model.declare.law_results import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import Axes, from_axes
from atwood.model.values.space import ZERO, Vector, cross, dot


@dataclass(frozen=True)
class Totals:
    """What parts have together; sums of material points, about the origin of the world (Goldstein, section 1.2).

    Attributes
    ----------
    mass
        kg.
    first_moment
        Mass times the position of the centre of mass, kg m.
    momentum
        kg m/s.
    angular_momentum
        kg m^2/s.
    moments, products
        Entries xx, yy, zz and xy, xz, yz of the inertia tensor in world axes, kg m^2.
    """

    mass: Scalar = 0.0
    first_moment: Vector = ZERO
    momentum: Vector = ZERO
    angular_momentum: Vector = ZERO
    moments: Vector = ZERO
    products: Vector = ZERO

    def __add__(self, other: Totals) -> Totals:
        return Totals(
            self.mass + other.mass,
            self.first_moment + other.first_moment,
            self.momentum + other.momentum,
            self.angular_momentum + other.angular_momentum,
            self.moments + other.moments,
            self.products + other.products,
        )


def part_totals(mechanism: Mechanism, equations: Equations, path: str) -> Totals:
    """Return what one part has; what is only said by a Lagrangian has none of it."""
    local, kinematics, space = mechanism.locals_[path], equations.kinematics, mechanism.space
    total = Totals()
    for one in local.point_inertias:
        nodes = [equations.site.node(path, point.name) for point in one.points]
        places = [space.vector(world_position(mechanism, kinematics.placements, node)) for node in nodes]
        moving = [space.vector(kinematics.velocities[node]) for node in nodes]
        for i, r in enumerate(places):
            for j, (s, v) in enumerate(zip(places, moving, strict=True)):
                total += of_mass(one.masses[i][j], r, s, v)
    for body in local.body_inertias:
        total += _of_body(mechanism, equations, local, body)
    return total


def of_mass(mass: Scalar, r: Vector, s: Vector, velocity: Vector) -> Totals:
    """Return what a mass has at r that moves with a velocity, and has its second arm at s."""
    momentum = velocity * mass
    square = dot(r, s)
    moments = Vector(square - r.x * s.x, square - r.y * s.y, square - r.z * s.z) * mass
    products = Vector(r.x * s.y + r.y * s.x, r.x * s.z + r.z * s.x, r.y * s.z + r.z * s.y) * (-0.5 * mass)
    return Totals(mass, r * mass, momentum, cross(r, momentum), moments, products)


def _of_body(mechanism: Mechanism, equations: Equations, local: LocalPart, body: BodyInertia) -> Totals:
    """Return what a rigid body has: as a point at its centre of mass, and by its turning."""
    kinematics, space = equations.kinematics, mechanism.space
    node = equations.site.node(local.part.path, body.frame.name)
    index, turn = equations.site.bodies.body_of[node], equations.site.node_turns[node]
    arm = body_point_of(kinematics, index, turn, body.center_of_mass, space)
    place = space.vector(world_position(mechanism, kinematics.placements, node)) + space.vector(arm.position)
    whole = of_mass(body.mass, place, place, space.vector(kinematics.velocities[node]) + space.vector(arm.velocity))
    spin = kinematics.angular_velocities.get(index, ())
    if space.is_spatial:
        tensor = turned_tensor(tensor_of(local.part.path, body), turn)
        axes = kinematics.placements.axes.get(index)
        own = from_axes(tensor, Vector(*spin)) if spin else ZERO
        x, y, z = tensor if axes is None else _in_world(tensor, axes)
        turned = Totals(
            angular_momentum=own if axes is None else from_axes(axes, own),
            moments=Vector(x.x, y.y, z.z),
            products=Vector(y.x, z.x, z.y),
        )
    else:
        rate = spin[0] if spin else 0.0
        moments = Vector(0.0, body.moment, 0.0)
        turned = Totals(angular_momentum=Vector(0.0, -1.0 * (body.moment * rate), 0.0), moments=moments)
    return whole + turned


def _in_world(tensor: Axes, axes: Axes) -> Axes:
    """Return the columns in world axes of a tensor whose columns are in the axes of a body: ``R J R^T``."""
    columns = [from_axes(axes, column) for column in tensor]
    rows = [Vector(axes[0][i], axes[1][i], axes[2][i]) for i in range(3)]
    x, y, z = (columns[0] * row.x + columns[1] * row.y + columns[2] * row.z for row in rows)
    return x, y, z


def energy_rate(equations: Equations, energy: Expression) -> Expression:
    """Return how fast an energy changes along the motion, W."""
    moving: dict[Expression, Expression | float] = {equations.time: 1.0}
    moving |= zip(equations.coordinates, equations.rates, strict=True)
    moving |= zip(equations.speeds, equations.accelerations, strict=True)
    return jvp([energy], moving)[0]


def add_totals(parts: Sequence[Totals]) -> Totals:
    """Return what several parts have together."""
    total = Totals()
    for part in parts:
        total += part
    return total


def part_energies(
    mechanism: Mechanism, equations: Equations, path: str, signals: Mapping[Expression, Expression]
) -> tuple[Expression, Expression]:
    """Return kinetic and potential energy of one part, its weight included."""
    graph, local, kinematics = mechanism.table.graph, mechanism.locals_[path], equations.kinematics
    site, space = equations.site, mechanism.space
    part = place_part(site, local, kinematics, signals)
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
        potential = potential + part.put([value])[0]
    functions, hung = in_joint_coordinates(local, kinematics, local.lagrangians)
    for value in functions:
        rates = [*local.velocities, *(rate_symbol(symbol) for symbol in hung)]
        momenta = vjp([value], [graph.constant(1.0)], rates)
        still = substitute([value], dict.fromkeys(rates, graph.zero))[0]
        energy = sum((p * v for p, v in zip(momenta, rates, strict=True)), still - value)
        kinetic = kinetic + part.put([energy])[0]
        potential = potential - part.put([still])[0]
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
    return reduce(add, values)
