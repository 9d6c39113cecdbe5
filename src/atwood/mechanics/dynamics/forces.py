"""Forces on nodes and bodies: derivatives of potentials and Rayleigh functions, loads, constraint forces.

Each is found on the local symbols of a part, and then put where the part is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from atwood.errors import TopologyError
from atwood.expr import Expression, Graph, Scalar, depends_on, is_zero, jvp, read_by, substitute, vjp
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.kinematics.orientation import NodeTurn, node_axes, spin_in_world, torque_components
from atwood.mechanics.kinematics.positions import Kinematics, Placements
from atwood.model.local.parts import LocalConstraint, LocalPart
from atwood.model.values.rotation import Axes, from_axes
from atwood.model.values.space import Space, Vector, cross, dot
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph


@dataclass
class Forces:
    """Sums of forces on nodes and torques on bodies, along the free components.

    Attributes
    ----------
    on_nodes
        Force components by node, N.
    on_bodies
        Torque components by body, N m: counter-clockwise in a plane, in the axes of the body in space.
    at_nodes
        The same torques by the node at which they act.
    on_joints
        Generalized forces on joint coordinates, by their symbols.
    """

    graph: Graph
    on_nodes: dict[int, list[Expression]] = field(default_factory=dict)
    on_bodies: dict[int, list[Expression]] = field(default_factory=dict)
    at_nodes: dict[int, list[Expression]] = field(default_factory=dict)
    on_joints: dict[Expression, Expression] = field(default_factory=dict)

    def push(self, node: int, components: Sequence[Scalar]) -> None:
        """Add a force on a node."""
        held = self.on_nodes.get(node)
        new = [self.graph.convert(c) for c in components]
        self.on_nodes[node] = new if held is None else [a + b for a, b in zip(held, new, strict=True)]

    def push_joint(self, symbol: Expression, force: Expression) -> None:
        """Add a generalized force on a joint coordinate."""
        held = self.on_joints.get(symbol)
        self.on_joints[symbol] = force if held is None else held + force

    def twist(self, body: int, torque: Sequence[Scalar], node: int | None = None) -> None:
        """Add a torque on a body, at a node of it."""
        new = [self.graph.convert(c) for c in torque]
        for sums, key in ((self.on_bodies, body), (self.at_nodes, node)):
            if key is not None:
                held = sums.get(key)
                sums[key] = new if held is None else [a + b for a, b in zip(held, new, strict=True)]


@dataclass(frozen=True)
class Site:
    """Where parts are: what the local symbols of each part stand for.

    Attributes
    ----------
    graph
        Where expressions live.
    mechanism, bodies, space
        The mechanism.
    node_turns
        How each node is turned from its body.
    placed
        What the symbols of parts stand for, by path, as they were last placed: many laws of a part ask for it.
    """

    graph: Graph
    mechanism: MechanismGraph
    bodies: Bodies
    space: Space
    node_turns: Mapping[int, NodeTurn]
    placed: dict[str, tuple[LocalPart, Kinematics, dict[Expression, Expression]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def node(self, path: str, connector: str) -> int:
        """Return the node of a connector."""
        return self.mechanism.node_of[(path, connector)]

    def body(self, path: str, connector: str) -> int:
        """Return the body of a connector."""
        return self.bodies.body_of[self.node(path, connector)]


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """A part in place: where it is, how it moves, and what its local symbols stand for."""

    site: Site
    local: LocalPart
    kinematics: Kinematics
    mapping: Mapping[Expression, Expression]

    def put(self, values: Sequence[Expression]) -> list[Expression]:
        """Return expressions of local symbols where the part is."""
        return substitute(values, self.mapping)


def place_part(
    site: Site, local: LocalPart, kinematics: Kinematics, signals: Mapping[Expression, Expression] | None = None
) -> PlacedPart:
    """Return a part in place, with what its linked inputs stand for."""
    known = site.placed.get(local.part.path)
    if known is not None and known[0] is local and known[1] is kinematics:
        found = known[2]
    else:
        found = _stand_for(site, local, kinematics)
        site.placed[local.part.path] = local, kinematics, found
    return PlacedPart(site, local, kinematics, {**found, **(signals or {})})


def _stand_for(site: Site, local: LocalPart, kinematics: Kinematics) -> dict[Expression, Expression]:
    """Return what the symbols of connectors and joint coordinates of a part stand for."""
    path = local.part.path
    found: dict[Expression, Expression] = {}
    for name, symbols in local.connectors.items():
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        found.update(zip(symbols.position, kinematics.placements.positions[node], strict=True))
        found.update(zip(symbols.velocity, kinematics.velocities[node], strict=True))
        placements = kinematics.placements
        if symbols.angle is not None and symbols.angular_speed is not None and body in placements.angles:
            found[symbols.angle] = site.graph.convert(placements.angles[body] + site.node_turns[node])
            if body in kinematics.angular_velocities:
                found[symbols.angular_speed] = kinematics.angular_velocities[body][0]
        if symbols.axes is not None and symbols.angular_velocity is not None and body in placements.axes:
            axes = node_axes(None, placements.axes[body], site.node_turns[node])
            assert axes is not None
            found.update(zip(symbols.orientation, (site.graph.convert(c) for v in axes for c in v), strict=True))
            if body in kinematics.angular_velocities:
                spin_W = spin_in_world(kinematics.angular_velocities[body], placements.axes[body])
                found.update(zip(symbols.spin, (site.graph.convert(c) for c in spin_W), strict=True))
    for symbol in local.formulas:
        if symbol in kinematics.placements.joint_coordinates:
            found[symbol] = kinematics.placements.joint_coordinates[symbol]
        if symbol in kinematics.joint_rates:
            found[rate_symbol(symbol)] = kinematics.joint_rates[symbol]
    return found


def rate_symbol(coordinate: Expression) -> Expression:
    """Return the symbol of the rate of a joint coordinate."""
    return coordinate.graph.symbol(f"{coordinate.name}'")


def in_joint_coordinates(
    local: LocalPart, kinematics: Kinematics, functions: Sequence[Expression]
) -> tuple[list[Expression], list[Expression]]:
    """Return functions with the coordinates of joints that bodies hang on in place of their formulas.

    So a spring on a joint sees the coordinate itself, which counts its turns, and acts on that coordinate alone.
    """
    formulas: dict[Expression, Expression] = {}
    hung = [symbol for symbol in local.formulas if symbol in kinematics.joint_rates]
    for symbol in hung:
        formula, rate = local.formulas[symbol]
        formulas[formula] = symbol
        if rate is not None:
            formulas[rate] = rate_symbol(symbol)
    return (substitute(list(functions), formulas) if formulas else list(functions)), hung


def in_coordinates(local: LocalPart, one: LocalConstraint, placements: Placements) -> LocalConstraint:
    """Return a constraint with joint coordinates, where they are the mechanism's, in place of their formulas."""
    known = [symbol for symbol in local.formulas if symbol in placements.joint_coordinates]
    if not known or one.counts is not None:
        return one
    (value,) = substitute([one.value], {local.formulas[symbol][0]: symbol for symbol in known})
    return one if value is one.value else replace(one, value=value)


def part_forces(part: PlacedPart, forces: Forces) -> None:
    """Add the forces of a part's potentials, Rayleigh functions, Lagrangians and loads."""
    site, local, kinematics = part.site, part.local, part.kinematics
    if local.stand_ins:
        values, _ = in_joint_coordinates(local, kinematics, list(local.stand_ins.values()))
        part = replace(part, mapping={**part.mapping, **dict(zip(local.stand_ins, part.put(values), strict=True))})
    _add_gradient(part, local.potentials, forces, of_velocities=False)
    _add_gradient(part, local.dissipations, forces, of_velocities=True)
    if local.lagrangians:
        _add_lagrangians(part, forces)
    path = local.part.path
    for load in local.loads:
        components = [site.graph.convert(c) for c in (*site.space.components(load.force), *load.torque)]
        *force, x, y, z = part.put(in_joint_coordinates(local, kinematics, components)[0])
        forces.push(site.node(path, load.at.name), force)
        if any(not is_zero(c) for c in load.torque):
            body = site.body(path, load.at.name)
            if site.space.has_rotation and body not in site.bodies.oriented and body != 0:
                raise TopologyError("a torque acts on a part that cannot rotate", where=path)
            torque = torque_components(Vector(x, y, z), kinematics.placements.axes.get(body), site.space)
            forces.twist(body, torque, site.node(path, load.at.name))


def _add_gradient(part: PlacedPart, given: Sequence[Expression], forces: Forces, of_velocities: bool) -> None:
    """Add minus the derivatives of functions."""
    functions, hung = in_joint_coordinates(part.local, part.kinematics, given)
    down = part.site.graph.constant(-1.0)
    for function in functions:
        for symbol in hung:
            moved = rate_symbol(symbol) if of_velocities else symbol
            (gradient,) = vjp([function], [down], [moved])
            if not gradient.is_zero:
                forces.push_joint(symbol, part.put([gradient])[0])
        for name, gradients, torques in local_gradients(part.local, function, down, of_velocities):
            _push_mapped(part, name, gradients, torques, forces)


def _add_lagrangians(part: PlacedPart, forces: Forces) -> None:
    """Add the forces ``dL/dq - d/dt dL/dq'`` of Lagrangians.

    In space, where angular velocities are no rates of coordinates, the torque is ``tau + omega x p - p'``, in which tau
    is that of the derivatives by the axes and p the derivative by the angular velocity (the equations of Poincare).
    """
    local = part.local
    functions, hung = in_joint_coordinates(local, part.kinematics, local.lagrangians)
    graph, one = part.site.graph, part.site.graph.constant(1.0)
    along, placed = rates_of_symbols(part)
    part = replace(part, mapping={**part.mapping, **placed})
    for function in functions:
        for symbol in hung:
            gradient, momentum = vjp([function], [one], [symbol, rate_symbol(symbol)])
            force = gradient - jvp([momentum], along)[0]
            if not force.is_zero:
                forces.push_joint(symbol, part.put([force])[0])
        momenta = iter(vjp([function], [one], local.velocities))
        for name, gradients, torques in local_gradients(local, function, one):
            symbols = local.connectors[name]
            linear, angular = [next(momenta) for _ in symbols.velocity], [next(momenta) for _ in symbols.spin]
            gradients = [s - r for s, r in zip(gradients, jvp(linear, along), strict=True)]
            rates = jvp(angular, along) if angular else []
            if symbols.axes is not None and symbols.angular_velocity is not None:
                turned = cross(symbols.angular_velocity, Vector(*angular)) - Vector(*rates)
                rates = [-one for one in _along(symbols.axes, [graph.convert(c) for c in turned])]
            torques = [s - r for s, r in zip(torques, rates, strict=True)]
            _push_mapped(part, name, gradients, torques, forces)


RatesOfSymbols = tuple[dict[Expression, Expression | float], dict[Expression, Expression]]


def rates_of_symbols(part: PlacedPart) -> RatesOfSymbols:
    """Return the time derivative of each local symbol, with symbols for accelerations, and what these stand for."""
    site, local, kinematics = part.site, part.local, part.kinematics
    graph, path = site.graph, local.part.path
    along: dict[Expression, Expression | float] = {graph.convert(local.binding.time): 1.0}
    placed: dict[Expression, Expression] = {}
    for name, symbols in local.connectors.items():
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        rates = [graph.symbol(f"{symbol.name}'") for symbol in (*symbols.velocity, *symbols.spin)]
        spin_rates: Sequence[Scalar] = kinematics.angular_accelerations.get(body, (0.0,) * len(symbols.spin))
        if symbols.axes is not None and body in kinematics.placements.axes:
            spin_rates = tuple(spin_in_world(spin_rates, kinematics.placements.axes[body]))
        along.update(symbols.rates)
        along.update(zip((*symbols.velocity, *symbols.spin), rates, strict=True))
        found = (*kinematics.accelerations[node], *spin_rates)
        placed.update((rate, graph.convert(value)) for rate, value in zip(rates, found, strict=False))
    for symbol in local.formulas:
        if symbol in kinematics.joint_rates:
            rate, second = rate_symbol(symbol), graph.symbol(f"{symbol.name}''")
            along[symbol], along[rate] = rate, second
            placed[second] = kinematics.joint_accelerations[symbol]
    return along, placed


def local_gradients(
    local: LocalPart, function: Expression, factor: Expression, of_velocities: bool = False
) -> list[tuple[str, list[Expression], list[Expression]]]:
    """Return each connector's force and torque: derivatives of a function times a factor, in one reverse sweep."""
    wanted: list[Expression] = []
    for symbols in local.connectors.values():
        wanted += [*symbols.velocity, *symbols.spin] if of_velocities else [*symbols.position, *symbols.orientation]
    gradients = iter(vjp([function], [factor], wanted))
    found = []
    for name, symbols in local.connectors.items():
        force = [next(gradients) for _ in symbols.position]
        torques = [next(gradients) for _ in (symbols.spin if of_velocities else symbols.orientation)]
        if symbols.axes is not None:
            torques = _torque_of_axes(symbols.axes, torques) if not of_velocities else _along(symbols.axes, torques)
        found.append((name, force, torques))
    return found


def _torque_of_axes(axes: Axes, gradients: Sequence[Expression]) -> list[Expression]:
    """Return the torque along the axes of a frame from derivatives with respect to the components of its axes.

    Turning by a small angle about x moves y along z and z against y; so its virtual work is ``g_y . z - g_z . y``.
    """
    x, y, z = axes
    gx, gy, gz = (Vector(*gradients[3 * i : 3 * i + 3]) for i in range(3))
    return [dot(gy, z) - dot(gz, y), dot(gz, x) - dot(gx, z), dot(gx, y) - dot(gy, x)]


def _along(axes: Axes, gradients: Sequence[Expression]) -> list[Expression]:
    """Return the components of a torque in world axes along the axes of a frame."""
    return [dot(axis, Vector(*gradients)) for axis in axes]


def _push_mapped(
    part: PlacedPart, name: str, gradients: list[Expression], torques: list[Expression], forces: Forces
) -> None:
    """Add a force and a torque of local symbols at a connector."""
    site, path = part.site, part.local.part.path
    node = site.node(path, name)
    if not all(gradient.is_zero for gradient in gradients):
        forces.push(node, part.put(gradients))
    if not all(gradient.is_zero for gradient in torques):
        forces.twist(site.body(path, name), in_body(site, node, part.put(torques)), node)


def in_body(site: Site, node: int, torque: Sequence[Expression]) -> list[Scalar]:
    """Return torque components of a node as those of its body."""
    turn = site.node_turns[node]
    return list(from_axes(turn, Vector(*torque))) if isinstance(turn, tuple) else list(torque)


def constraint_forces(part: PlacedPart, value: Expression, multiplier: Expression, forces: Forces) -> None:
    """Add the forces of a constraint: its multiplier times its derivatives (Goldstein, section 2.4)."""
    # The derivatives first, and then times the multiplier: so both sets of multipliers and the rate share them.
    of_velocities = is_on_velocities(part.local, value)
    for name, gradients, torques in local_gradients(part.local, value, part.site.graph.constant(1.0), of_velocities):
        pushes, twists = ([gradient * multiplier for gradient in one] for one in (gradients, torques))
        _push_mapped(part, name, pushes, twists, forces)
    for symbol, gradient in joint_gradients(part.local, value):
        forces.push_joint(symbol, part.put([gradient * multiplier])[0])


def joint_gradients(local: LocalPart, value: Expression) -> list[tuple[Expression, Expression]]:
    """Return the derivatives of a function with respect to the joint coordinates that it depends on."""
    if not local.formulas or not depends_on(value, list(local.formulas)):
        return []
    read = read_by([value], local.formulas)
    return list(zip(read, vjp([value], [value.graph.constant(1.0)], read), strict=True))


def is_on_velocities(local: LocalPart, value: Expression) -> bool:
    """Return whether a constraint is one on velocities, and not on positions."""
    return depends_on(value, local.velocities)
