"""The graph of connections: nodes where connectors meet, joints between them, and connected components."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

from atwood.errors import ConnectError, DeclarationError, suggestion
from atwood.expr import Expression, depends_on
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import Frame, JointCoordinate
from atwood.model.local.flatten import FlatScene
from atwood.model.local.parts import LocalJoint, LocalPart
from atwood.model.values.rotation import FREE, Rotation

if TYPE_CHECKING:
    import networkx as nx


WORLD = 0
"""Index of the node that is the world itself."""


@dataclass(frozen=True)
class Node:
    """Connectors that meet: they share a position and, the frames among them, an orientation.

    Attributes
    ----------
    index
        Its number; 0 is the world.
    name
        Path of its first connector.
    members
        Its connectors as (part path, connector name).
    """

    index: int
    name: str
    members: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Joint:
    """A joint law between two nodes.

    Attributes
    ----------
    part
        Path of the part that declares it.
    a, b
        The nodes it joins.
    local
        The law on local symbols.
    moves
        Its coordinates that shift b against a.
    turns
        Its coordinates that turn b against a.
    """

    part: str
    a: int
    b: int
    local: LocalJoint
    moves: tuple[Expression, ...]
    turns: tuple[Expression, ...]

    @property
    def is_rigid(self) -> bool:
        """Whether both nodes belong to one body."""
        return bool(self.local.law.options.rigid)

    @property
    def locks(self) -> bool:
        """Whether it prescribes the rotation of b against a, as a constant or a function of time."""
        return self.says_rotation and not self.turns

    @property
    def says_rotation(self) -> bool:
        """Whether its coordinates, and time, tell the rotation of b against a."""
        return self.local.placement.rotation is not None and self.local.placement.rotation is not FREE

    @property
    def label(self) -> str:
        """The path of the joint law, for messages."""
        return f"{self.part}.{self.local.law.name}"


@dataclass(frozen=True)
class MechanismGraph:
    """The scene as the user said it.

    Attributes
    ----------
    nodes
        By index; the first is the world.
    node_of
        Node of each connector (part path, connector name).
    joints
        All joint laws.
    """

    nodes: tuple[Node, ...]
    node_of: Mapping[tuple[str, str], int]
    joints: tuple[Joint, ...]

    @cached_property
    def network(self) -> nx.MultiGraph[int]:
        """The same as a networkx multigraph: nodes by index, an edge with its ``joint`` for each joint."""
        import networkx as nx

        made: nx.MultiGraph[int] = nx.MultiGraph()
        made.add_nodes_from((node.index, {"name": node.name}) for node in self.nodes)
        made.add_edges_from((joint.a, joint.b, {"joint": joint}) for joint in self.joints)
        return made


def build_graph(flat: FlatScene, locals_: Mapping[str, LocalPart]) -> MechanismGraph:
    """Return who meets whom."""
    nodes, node_of = _nodes(flat)
    for path, local in locals_.items():
        node_of.update({(path, full): node_of[end] for full, end in local.borrowed.items()})
    joints = tuple(_joint(path, joint, node_of) for path, local in locals_.items() for joint in local.joints)
    return MechanismGraph(nodes, node_of, joints)


def _nodes(flat: FlatScene) -> tuple[tuple[Node, ...], dict[tuple[str, str], int]]:
    owners: dict[str, tuple[str, str]] = {}
    frames: set[str] = set()
    meeting: dict[str, None] = {}
    joint_references: set[str] = set()
    for path, part in flat.parts.items():
        for name, one in part.component.connectors().items():
            full = f"{path}.{name}"
            if isinstance(one, JointCoordinate):
                joint_references.add(full)
                continue
            owners[full] = (path, name)
            meeting[full] = None
            if isinstance(one, Frame):
                frames.add(full)
    connections = [pair for pair in flat.connections if joint_references.isdisjoint(pair)]
    for a, b in connections:
        for end in (a, b):
            # A connector of a nested model is no leaf's: it only passes the connection on.
            if end not in owners and end.rpartition(".")[0] in flat.parts:
                raise ConnectError("there is no such connector", where=end, advice=suggestion(end, owners))
        meeting |= {a: None, b: None}
    met = connected_groups(meeting, connections)
    _check_frames(met, connections, frames, set(owners) - frames)
    nodes = [Node(WORLD, "world", ())]
    node_of: dict[tuple[str, str], int] = {}
    order = {name: i for i, name in enumerate(owners)}
    groups = [[name for name in group if name in owners] for group in met]
    for group in sorted((sorted(g, key=order.__getitem__) for g in groups if g), key=lambda g: order[g[0]]):
        node = Node(len(nodes), group[0], tuple(owners[name] for name in group))
        nodes.append(node)
        node_of.update({owners[name]: node.index for name in group})
    return tuple(nodes), node_of


def _check_frames(
    met: Sequence[Sequence[str]], connections: Iterable[tuple[str, str]], frames: set[str], points: set[str]
) -> None:
    """Refuse frames that meet through a point only: it does not say whether they are welded or hinged."""
    rigid = [name for group in met for name in group if name not in points]
    direct = [pair for pair in connections if points.isdisjoint(pair)]
    class_of = {name: i for i, group in enumerate(connected_groups(rigid, direct)) for name in group}
    for group in met:
        found: dict[int, str] = {}
        for name in sorted(frames.intersection(group)):
            found.setdefault(class_of[name], name)
        if len(found) > 1:
            first, second = list(found.values())[:2]
            raise ConnectError(
                f"the frames {first} and {second} are connected through a point only, which does not determine "
                "their relative orientation",
                where=first,
                advice="Connect them to each other to weld them, or put a Pivot between them to hinge them.",
            )


def _joint(path: str, joint: LocalJoint, node_of: Mapping[tuple[str, str], int]) -> Joint:
    options, placement = joint.law.options, joint.placement
    ends = []
    for name in (options.a, options.b):
        if name != "world" and (path, name) not in node_of:
            raise DeclarationError(
                f"the joint names a connector {name!r} that does not exist", where=f"{path}.{joint.law.name}"
            )
        ends.append(WORLD if name == "world" else node_of[(path, name)])
    if ends[0] == ends[1]:
        raise ConnectError(
            f"its connectors {options.a!r} and {options.b!r} are joined to each other",
            where=path,
            advice="Connect them to different parts.",
        )
    shifts = list(placement.displacement)
    moves = tuple(q for q in joint.coordinates if any(isinstance(s, Expression) and depends_on(s, [q]) for s in shifts))
    rotation = placement.rotation
    found = [one.angle for one in rotation.turns] if isinstance(rotation, Rotation) else [rotation]
    angles = [angle for angle in found if isinstance(angle, Expression)]
    turns = tuple(q for q in joint.coordinates if any(depends_on(angle, [q]) for angle in angles))
    return Joint(path, ends[0], ends[1], joint, moves, turns)


def unit_of(local: LocalPart, path: str) -> str:
    """Return the unit of a joint coordinate, by its path: it is an observable of its part."""
    name = path.rpartition(".")[2]
    for law in local.part.component.laws("observable"):
        if law.name == name:
            return str(law.options.unit)
    raise DeclarationError(f"the joint coordinate {name!r} is not an observable of the part", where=local.part.path)


T = TypeVar("T", bound=Hashable)


def connected_groups(members: Iterable[T], pairs: Iterable[tuple[T, T]]) -> list[list[T]]:
    """Return groups whose members are connected by pairs, directly or through others."""
    above: dict[T, T] = {member: member for member in members}

    def root(member: T) -> T:
        top = member
        while above[top] != top:
            top = above[top]
        while above[member] != top:  # so that the way is short next time
            above[member], member = top, above[member]
        return top

    size = dict.fromkeys(above, 1)
    for a, b in pairs:
        low, high = sorted((root(a), root(b)), key=size.__getitem__)
        if low != high:
            above[low] = high
            size[high] += size[low]
    groups: dict[T, list[T]] = {}
    for member in above:
        groups.setdefault(root(member), []).append(member)
    return list(groups.values())
