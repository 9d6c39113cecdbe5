"""Bodies: nodes that are rigidly joined, and which of them need an orientation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from atwood.expr import Expression, Scalar, depends_on, is_zero
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.laws import Kind
from atwood.model.local.parts import LocalConstraint, LocalPart
from atwood.topology.graph import WORLD, Joint, MechanismGraph

Key = tuple[str, str, int]
"""A scalar constraint: (part, law, number within the law)."""


@dataclass(frozen=True)
class RigidStep:
    """A rigid joint walked from one node of a body to another; backwards from b to a."""

    joint: Joint
    parent: int
    child: int
    backwards: bool


@dataclass(frozen=True)
class Body:
    """Nodes that move as one.

    Attributes
    ----------
    index
        Its number; 0 is what is fixed in the world.
    name
        Path of its leading part, or of its first connector.
    root
        The node that its own axes belong to.
    nodes
        All its nodes.
    steps
        How every node is reached from the root through rigid joints.
    """

    index: int
    name: str
    root: int
    nodes: tuple[int, ...]
    steps: tuple[RigidStep, ...]

    @property
    def is_fixed(self) -> bool:
        """Whether it is part of the world."""
        return self.index == 0


@dataclass(frozen=True)
class Bodies:
    """All bodies of a scene.

    Attributes
    ----------
    bodies
        By index; the first is fixed in the world.
    body_of
        Body of each node.
    closures
        Rigid joints between nodes of one body that are already rigidly joined.
    oriented
        Bodies whose orientation something depends on.
    idle
        Constraints, as (part, law, number), that only say how a body without need of an orientation is turned.
    """

    bodies: tuple[Body, ...]
    body_of: Mapping[int, int]
    closures: tuple[Joint, ...]
    oriented: frozenset[int]
    idle: frozenset[Key]


def find_bodies(graph: MechanismGraph, locals_: Mapping[str, LocalPart]) -> Bodies:
    """Merge what is rigidly joined, and find out which bodies need an orientation."""
    rigid: dict[int, list[RigidStep]] = {node.index: [] for node in graph.nodes}
    for joint in graph.joints:
        if joint.is_rigid:
            rigid[joint.a].append(RigidStep(joint, joint.a, joint.b, False))
            rigid[joint.b].append(RigidStep(joint, joint.b, joint.a, True))
    bodies: list[Body] = []
    body_of: dict[int, int] = {}
    used: set[int] = set()
    for node in graph.nodes:
        if node.index in body_of:
            continue
        steps: list[RigidStep] = []
        members = [node.index]
        body_of[node.index] = len(bodies)
        for current in members:  # grows while it is walked
            for step in rigid[current]:
                if step.child not in body_of:
                    body_of[step.child] = len(bodies)
                    members.append(step.child)
                    steps.append(step)
                    used.add(id(step.joint))
        name = "world" if node.index == WORLD else _lead(members, graph, locals_)
        bodies.append(Body(len(bodies), name, node.index, tuple(members), tuple(steps)))
    closures = tuple(joint for joint in graph.joints if joint.is_rigid and id(joint) not in used)
    oriented, idle = _orientations(bodies, body_of, graph, locals_)
    return Bodies(tuple(bodies), body_of, closures, oriented, idle)


def _lead(members: list[int], graph: MechanismGraph, locals_: Mapping[str, LocalPart]) -> str:
    """Return the name of a body: its first rigid body, else its first mass, else its first connector."""
    paths = list(dict.fromkeys(path for index in members for path, _ in graph.nodes[index].members))
    for path in paths:
        if locals_[path].body_inertias:
            return path
    single = [path for path in paths if any(len(one.points) == 1 for one in locals_[path].point_inertias)]
    for path in single:
        if not all(is_zero(one.masses[0][0]) for one in locals_[path].point_inertias):
            return path
    return single[0] if single else graph.nodes[members[0]].name


def _orientations(
    bodies: list[Body], body_of: Mapping[int, int], graph: MechanismGraph, locals_: Mapping[str, LocalPart]
) -> tuple[frozenset[int], frozenset[Key]]:
    needed: set[int] = set()
    locks: list[tuple[list[Key], set[int]]] = []
    for path, local in locals_.items():

        def body(name: str, path: str = path) -> int:
            return body_of[graph.node_of[(path, name)]]

        for one in local.body_inertias:
            tensor = [one.moment] if one.tensor is None else [entry for row in one.tensor for entry in row]
            if not all(is_zero(c) for c in (*tensor, *one.center_of_mass)):
                needed.add(body(one.frame.name))
        plain: list[Scalar] = [*local.potentials, *local.dissipations, *local.lagrangians]
        for load in local.loads:
            plain += [*load.force, *load.torque]
            if any(not is_zero(c) for c in load.torque):
                needed.add(body(load.at.name))
        for name in [*_angles_read(local, plain), *_measured(local)]:
            needed.add(body(name))
        for law in dict.fromkeys(one.law.name for one in local.constraints if one.counts is None):
            rows = [constraint for constraint in local.constraints if constraint.law.name == law]
            turned = {body(name) for name in _angles_read(local, [one.value for one in rows])} - {0}
            if any(reads_position(local, one) for one in rows):
                needed |= turned
            else:
                locks.append(([(path, law, one.index) for one in rows], turned))
    for one_body in bodies:
        if any(not all(is_zero(c) for c in step.joint.local.placement.displacement) for step in one_body.steps):
            needed.add(one_body.index)
    return _peel(needed, locks)


def _peel(needed: set[int], locks: list[tuple[list[Key], set[int]]]) -> tuple[frozenset[int], frozenset[Key]]:
    """Drop, one after another, locks at whose end hangs a body that needs no orientation."""
    left = [(keys, turned) for keys, turned in locks if turned]
    idle: set[Key] = set()
    while True:
        counts: dict[int, int] = {}
        for _, turned in left:
            for body in turned:
                counts[body] = counts.get(body, 0) + 1
        loose = [one for one in left if any(body not in needed and counts[body] == 1 for body in one[1])]
        if not loose:
            break
        idle |= set(loose[0][0])
        left.remove(loose[0])
    for _, turned in left:
        needed |= turned
    return frozenset(needed - {0}), frozenset(idle)


def _measured(local: LocalPart) -> list[str]:
    """Return, in space, the frames of a part that only measures: what it is to measure must be known."""
    kinds: tuple[Kind, ...] = (
        "potential",
        "dissipation",
        "force",
        "inertia",
        "lagrangian",
        "constraint",
        "joint",
        "event",
    )
    component = local.part.component
    if any(component.laws(kind) for kind in kinds):
        return []
    return [name for name, symbols in local.connectors.items() if symbols.axes is not None]


def _angles_read(local: LocalPart, values: list[Scalar]) -> Iterator[str]:
    for name, symbols in local.connectors.items():
        wanted = [*symbols.orientation, *symbols.spin]
        if wanted and any(isinstance(value, Expression) and depends_on(value, wanted) for value in values):
            yield name


def reads_position(local: LocalPart, constraint: LocalConstraint) -> bool:
    """Return whether a constraint depends on a position or a velocity, and not on orientations alone."""
    return any(
        depends_on(constraint.value, [*symbols.position, *symbols.velocity]) for symbols in local.connectors.values()
    )
