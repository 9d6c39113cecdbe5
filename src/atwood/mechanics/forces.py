"""Forces on nodes and bodies: derivatives of potentials and Rayleigh functions, loads, constraint forces.

Each is found on the local symbols of a part, and then put where the part is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from atwood.errors import TopologyError
from atwood.expr import Expression, Graph, Scalar, substitute, vjp
from atwood.mechanics.kinematics import Kinematics
from atwood.model.local import LocalPart
from atwood.model.space import Space
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph

__all__ = ["Forces", "Site", "constraint_forces", "local_map", "part_forces"]


@dataclass
class Forces:
    """Sums of forces on nodes and torques on bodies, along the free components.

    Attributes
    ----------
    on_nodes
        Force components by node, N.
    on_bodies
        Torque by body, counter-clockwise, N m.
    at_nodes
        The same torques by the node at which they act.
    """

    graph: Graph
    on_nodes: dict[int, list[Expression]] = field(default_factory=dict)
    on_bodies: dict[int, Expression] = field(default_factory=dict)
    at_nodes: dict[int, Expression] = field(default_factory=dict)

    def push(self, node: int, components: Sequence[Scalar]) -> None:
        """Add a force on a node."""
        held = self.on_nodes.get(node)
        new = [self.graph.convert(c) for c in components]
        self.on_nodes[node] = new if held is None else [a + b for a, b in zip(held, new, strict=True)]

    def twist(self, body: int, torque: Scalar, node: int | None = None) -> None:
        """Add a torque on a body, at a node of it."""
        new = self.graph.convert(torque)
        self.on_bodies[body] = self.on_bodies[body] + new if body in self.on_bodies else new
        if node is not None:
            self.at_nodes[node] = self.at_nodes[node] + new if node in self.at_nodes else new


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
        Rotation of each node from its body.
    """

    graph: Graph
    mechanism: MechanismGraph
    bodies: Bodies
    space: Space
    node_turns: Mapping[int, Scalar]

    def node(self, path: str, connector: str) -> int:
        """Return the node of a connector."""
        return self.mechanism.node_of[(path, connector)]

    def body(self, path: str, connector: str) -> int:
        """Return the body of a connector."""
        return self.bodies.body_of[self.node(path, connector)]


def local_map(site: Site, local: LocalPart, kinematics: Kinematics) -> dict[Expression, Expression]:
    """Return what the local symbols of a part stand for."""
    path = local.part.path
    found: dict[Expression, Expression] = {}
    for name, symbols in local.connectors.items():
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        found.update(zip(symbols.position, kinematics.placements.positions[node], strict=True))
        found.update(zip(symbols.velocity, kinematics.velocities[node], strict=True))
        if symbols.angle is not None and symbols.angular_speed is not None and body in kinematics.placements.angles:
            found[symbols.angle] = site.graph.convert(kinematics.placements.angles[body] + site.node_turns[node])
            found[symbols.angular_speed] = kinematics.angular_speeds[body]
    return found


def part_forces(site: Site, local: LocalPart, mapping: Mapping[Expression, Expression], forces: Forces) -> None:
    """Add the forces of a part's potentials, Rayleigh functions and loads."""
    _add_gradient(site, local, local.potentials, mapping, forces, of_velocities=False)
    _add_gradient(site, local, local.dissipations, mapping, forces, of_velocities=True)
    path = local.part.path
    for load in local.loads:
        force = substitute([site.graph.convert(c) for c in site.space.components(load.force)], mapping)
        forces.push(site.node(path, load.at.name), force)
        torque = site.graph.convert(-load.torque.y)
        if not torque.is_zero:
            body = site.body(path, load.at.name)
            if site.space.has_rotation and body not in site.bodies.oriented and body != 0:
                raise TopologyError("it puts a torque on something that cannot turn", where=path)
            forces.twist(body, substitute([torque], mapping)[0], site.node(path, load.at.name))


def _add_gradient(
    site: Site,
    local: LocalPart,
    functions: Iterable[Expression],
    mapping: Mapping[Expression, Expression],
    forces: Forces,
    of_velocities: bool,
) -> None:
    for function in functions:
        for name, slopes, turning in _slopes(local, function, site.graph.constant(-1.0), of_velocities):
            _push_mapped(site, local, name, slopes, turning, mapping, forces)


def _slopes(
    local: LocalPart, function: Expression, factor: Expression, of_velocities: bool = False
) -> list[tuple[str, list[Expression], Expression | None]]:
    """Return, for each connector, the derivatives of a function times a factor: one reverse sweep."""
    wanted: list[Expression] = []
    for symbols in local.connectors.values():
        wanted += symbols.velocity if of_velocities else symbols.position
        angle = symbols.angular_speed if of_velocities else symbols.angle
        if angle is not None:
            wanted.append(angle)
    slopes = iter(vjp([function], [factor], wanted))
    found: list[tuple[str, list[Expression], Expression | None]] = []
    for name, symbols in local.connectors.items():
        components = [next(slopes) for _ in symbols.position]
        found.append((name, components, next(slopes) if symbols.angle is not None else None))
    return found


def _push_mapped(
    site: Site,
    local: LocalPart,
    name: str,
    slopes: list[Expression],
    turning: Expression | None,
    mapping: Mapping[Expression, Expression],
    forces: Forces,
) -> None:
    path = local.part.path
    if not all(slope.is_zero for slope in slopes):
        forces.push(site.node(path, name), substitute(slopes, mapping))
    if turning is not None and not turning.is_zero:
        forces.twist(site.body(path, name), substitute([turning], mapping)[0], site.node(path, name))


def constraint_forces(
    site: Site,
    local: LocalPart,
    value: Expression,
    multiplier: Expression,
    mapping: Mapping[Expression, Expression],
    forces: Forces,
) -> None:
    """Add the forces of a constraint: its multiplier times its derivatives (Goldstein, section 2.4)."""
    # The derivatives first, and then times the multiplier: so both sets of multipliers and the rate share them.
    for name, slopes, turning in _slopes(local, value, site.graph.constant(1.0)):
        pushes = [slope * multiplier for slope in slopes]
        _push_mapped(site, local, name, pushes, None if turning is None else turning * multiplier, mapping, forces)
