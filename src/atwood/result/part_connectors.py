"""From powers at nodes to work at connectors: rigid joints pass on what they are given, and models are sums."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from itertools import pairwise

from atwood.arrays import FloatArray
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.outputs.part_power import Flow
from atwood.model.declare.connectors import JointCoordinate
from atwood.model.local.flatten import FlatScene
from atwood.model.local.joint_coordinates import find_joint_coordinate_uses
from atwood.topology.bodies import Body
from atwood.topology.graph import WORLD, Joint, connected_groups

Ends = tuple[str, str]
"""Path of a part and the name of one of its connectors."""

_Add = Callable[[str, str, FloatArray], None]


class Connectors:
    """Who meets whom in one mode of a scene.

    Parameters
    ----------
    mechanism
        The mechanism in this mode.
    flat
        The scene.
    """

    def __init__(self, mechanism: Mechanism, flat: FlatScene) -> None:
        self._mechanism, self._flat = mechanism, flat

    @cached_property
    def ends(self) -> list[Ends]:
        """All connectors of all parts."""
        return [(path, name) for path, part in self._flat.parts.items() for name in part.component.connectors()]

    @cached_property
    def _own(self) -> dict[tuple[str, int], str]:
        """The first connector of a part at a node."""
        found: dict[tuple[str, int], str] = {}
        for path, name in self.ends:
            node = self._mechanism.graph.node_of.get((path, name))
            if node is not None:
                found.setdefault((path, node), name)
        return found

    @cached_property
    def _shafts(self) -> dict[tuple[str, str], tuple[str, str]]:
        """For a part and a coordinate of a joint that it takes hold of: its connector, and the one of the joint."""
        found: dict[tuple[str, str], tuple[str, str]] = {}
        for path, several in find_joint_coordinate_uses(self._flat).items():
            for use in several:
                specs = self._flat.parts[use.joint].component.connector_specs().values()
                offered = next(s.name for s in specs if issubclass(s.kind, JointCoordinate) and s.of == use.coordinate)
                found[path, f"{use.joint}.{use.coordinate}"] = use.connector, offered
        return found

    def work(self, flows: Mapping[Flow, FloatArray]) -> dict[Ends, FloatArray]:
        """Return what comes in through each connector, from what each part takes in at nodes and joint coordinates."""
        found: dict[Ends, FloatArray] = {}
        at_nodes: dict[int, FloatArray] = {}

        def add(part: str, name: str, value: FloatArray) -> None:
            held = found.get((part, name))
            found[part, name] = value if held is None else held + value

        for flow, value in flows.items():
            if flow.kind == "coordinate":
                self._through_coordinate(flow, value, add)
            elif flow.kind == "node" and flow.place != WORLD:
                node = int(flow.place)
                at_nodes[node] = at_nodes.get(node, 0.0) + value
                own = self._own.get((flow.part, node))
                if own is not None:
                    add(flow.part, own, value)
                else:
                    self._through_joint(flow.part, node, value, add)
        for body in self._mechanism.bodies.bodies:
            for step in reversed(body.steps):
                if step.child in at_nodes:
                    passed = -at_nodes[step.child]
                    for node, value in ((step.child, passed), (step.parent, -passed)):
                        end = self._own.get((step.joint.part, node))
                        if end is not None:
                            add(step.joint.part, end, value)
                    at_nodes[step.parent] = at_nodes.get(step.parent, 0.0) - passed
        return found

    def _through_coordinate(self, flow: Flow, value: FloatArray, add: _Add) -> None:
        """Take up the power at a joint's coordinate, which passes between its shaft and those who take hold of it."""
        joint = str(flow.place).rpartition(".")[0]
        for (path, coordinate), (connector, offered) in self._shafts.items():
            if coordinate == flow.place and path == flow.part:
                add(path, connector, value)
                return
            if coordinate == flow.place and joint == flow.part:
                add(joint, offered, value)
                return

    def _through_joint(self, part: str, node: int, value: FloatArray, add: _Add) -> None:
        """Take up the power of a part at a frame of a joint that it takes hold of: it passes through that joint."""
        local = self._mechanism.locals_[part]
        for full, (joint, name) in local.borrowed.items():
            if self._mechanism.graph.node_of[part, full] == node:
                shafts = (
                    ends for (path, c), ends in self._shafts.items() if path == part and c.startswith(f"{joint}.")
                )
                connector, offered = next(shafts)
                add(part, connector, value)
                add(joint, offered, -value)
                add(joint, name, value)
                return

    @cached_property
    def _groups(self) -> list[tuple[list[str], list[Ends]]]:
        """Connectors that meet: all their paths, and those of parts."""
        owners = {f"{path}.{name}": (path, name) for path, name in self.ends}
        names = dict.fromkeys(owners)
        names |= dict.fromkeys(end for pair in self._flat.connections for end in pair)
        groups = connected_groups(names, self._flat.connections)
        return [(group, [owners[one] for one in group if one in owners]) for group in groups]

    def of_model(self, model: str) -> dict[str, list[Ends]]:
        """Return the connectors of a model's parts where others are connected, by the name of the model's own."""
        prefix, found = f"{model}.", dict[str, list[Ends]]()
        for names, ends in self._groups:
            inside = [end for end in ends if end[0].startswith(prefix)]
            if inside and len(inside) < len(ends):
                own = (one.removeprefix(prefix) for one in names if one.startswith(prefix))
                name = next((one for one in own if "." not in one), None)
                found[name or ".".join(inside[0]).removeprefix(prefix)] = inside
        return found

    @cached_property
    def in_parallel(self) -> frozenset[str]:
        """Parts whose rigid joints share a load with others."""
        bodies, found = self._mechanism.bodies, set[str]()
        for joint in bodies.closures:
            body = bodies.bodies[bodies.body_of[joint.a]]
            found |= {joint.part, *_way(body, joint)}
        return frozenset(found)


def _way(body: Body, joint: Joint) -> Iterable[str]:
    """Return the parts whose rigid joints lead from one end of a joint to the other."""
    from networkx import Graph, shortest_path

    graph: Graph[int] = Graph()
    graph.add_nodes_from((joint.a, joint.b))
    for step in body.steps:
        graph.add_edge(step.child, step.parent, part=step.joint.part)
    return (graph.edges[ends]["part"] for ends in pairwise(shortest_path(graph, joint.a, joint.b)))
