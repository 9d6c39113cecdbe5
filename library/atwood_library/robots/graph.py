"""A scene as links and joints, from its root on: what files of robots can say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from atwood import Component, Scene, UsageError
from atwood_library.interfaces.solid import Solid
from atwood_library.joints.drive import Drive
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.gear import Gear
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.planar import Planar
from atwood_library.joints.rack_and_pinion import RackAndPinion
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.joints.slide_gear import SlideGear
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.weld import Weld
from atwood_library.parts.appearance import Appearance
from atwood_library.parts.ground import Ground

__all__ = ["IDENTITY", "JOINTS", "Branch", "Graph", "Pose", "constant", "graph_of", "inverse", "pose_of", "turn_about"]

Pose = tuple[Any, Any]
"""Rotation, shape (3, 3), and position, m, of a frame in another one."""

IDENTITY: Pose = (np.eye(3), np.zeros(3))
JOINTS = Pivot, Slider, Spherical, Planar, FreeJoint, Weld, Drive, RotaryDrive
GEARS = Gear, SlideGear, RackAndPinion


@dataclass(frozen=True)
class Branch:
    """A joint with what hangs on it.

    Attributes
    ----------
    joint
        Name of the part.
    pose
        Where it is on the link that carries it.
    parent, child
        The nodes that it joins.
    reversed
        Whether the scene has them the other way round.
    """

    joint: str
    pose: Pose
    parent: int
    child: int
    reversed: bool


@dataclass(frozen=True)
class Graph:
    """The nodes of a scene, where frames meet, and its joints as a tree.

    Attributes
    ----------
    scene
        The scene.
    root
        The node that is on the ground, or the first one.
    grounded
        Name of the ground; None if the root moves freely.
    node
        Node of a connector by its path.
    bodies
        Names of the bodies of a node.
    branches
        Joints from the root on.
    others
        Names of the other parts.
    """

    scene: Scene
    root: int
    grounded: str | None
    node: dict[str, int]
    bodies: dict[int, list[str]]
    branches: list[Branch] = field(default_factory=list)
    others: list[str] = field(default_factory=list)

    def of(self, *classes: type[Any]) -> Iterator[tuple[str, Any]]:
        """Yield the other parts of some classes, with their names."""
        yield from ((name, self.scene[name]) for name in self.others if type(self.scene[name]) in classes)

    def at(self, name: str, connector: str) -> str:
        """Return the joint whose shaft or carriage a connector of a part holds."""
        node = self.node.get(f"{name}.{connector}", -1)
        for path, one in self.node.items():
            part, _, held = path.rpartition(".")
            if one == node and held in ("shaft", "carriage") and isinstance(self.scene.parts.get(part), JOINTS):
                return part
        raise UsageError("it holds the coordinate of no joint", where=f"{name}.{connector}")


def graph_of(scene: Any, where: str) -> Graph:
    """Return the links and joints of a scene.

    Raises
    ------
    UsageError
        If the scene is not in space, its joints close a loop, or something hangs on nothing.
    """
    if not isinstance(scene, Scene) or scene.space != "space":
        raise UsageError("only scenes in space are written", where=where, advice="Give a Scene(space='space').")
    node = _nodes(scene)
    bodies: dict[int, list[str]] = {}
    for name, part in scene.parts.items():
        if isinstance(part, Solid):
            held = [path for path in node if path.rpartition(".")[0] == name and path != f"{name}.frame"]
            if held:
                raise UsageError("a body is written with its frame alone, and this is connected", where=held[0])
            bodies.setdefault(node.setdefault(f"{name}.frame", len(node) + len(scene.connected)), []).append(name)
    grounds = [name for name, part in scene.parts.items() if type(part) is Ground]
    if len(grounds) > 1 or not bodies:
        said = f"there are {len(grounds)} grounds" if grounds else "there is no body"
        raise UsageError(said, where=where, advice="A robot has bodies, and stands on one ground or moves freely.")
    grounded = grounds[0] if grounds else None
    root = node.get(f"{grounded}.frame", -1) if grounded else next(iter(bodies))
    graph = Graph(scene, root, grounded, node, bodies)
    used = _grow(graph)
    used.update(grounds, *bodies.values())
    graph.others.extend(name for name in scene.parts if name not in used)
    reached = {root, *(one.child for one in graph.branches)}
    lost = [name for one, names in bodies.items() if one not in reached for name in names]
    lost += [name for name in graph.others if type(scene[name]) in JOINTS]
    lost += [name for name, _ in graph.of(Appearance) if node.get(f"{name}.a", -1) not in reached]
    if lost:
        raise UsageError("it hangs on nothing that is written", where=lost[0])
    return graph


def _nodes(scene: Scene) -> dict[str, int]:
    """Return a number by the path of each connector that is connected: those that meet have the same."""
    node: dict[str, int] = {}
    for count, (a, b) in enumerate(scene.connected):
        one, other = node.setdefault(a, 2 * count), node.setdefault(b, 2 * count + 1)
        node.update({path: one for path, held in node.items() if held == other})
    return node


def _grow(graph: Graph) -> set[str]:
    """Add the joints from the root on; return them, and the welds that say where they are."""
    ends: dict[int, list[tuple[str, str]]] = {}
    for name, part in graph.scene.parts.items():
        if type(part) in JOINTS:
            for end in "ab":
                ends.setdefault(graph.node.get(f"{name}.{end}", -2), []).append((name, end))
    reached, used, stack = {graph.root}, set[str](), [graph.root]
    while stack:
        parent = stack.pop()
        for name, end in ends.get(parent, ()):
            if name in used:
                continue
            used.add(name)
            child, pose, reverse = graph.node.get(f"{name}.{'b' if end == 'a' else 'a'}", -2), IDENTITY, end == "b"
            after = [one for one in ends.get(child, ()) if one[0] not in used]
            held = [path for path, one in graph.node.items() if one == child]
            here: Any = graph.scene[name]
            if type(here) is Weld and child not in graph.bodies and len(held) == 2 and len(after) == 1:
                following, near = after[0]
                if type(graph.scene[following]) is not Weld:  # the weld says where the joint is
                    pose = inverse(pose_of(here)) if reverse else pose_of(here)
                    name, reverse = following, near == "b"
                    child = graph.node.get(f"{name}.{'b' if near == 'a' else 'a'}", -2)
                    used.add(name)
            if child in reached:
                raise UsageError("it closes a loop, and a robot's file says a tree", where=name)
            reached.add(child)
            graph.branches.append(Branch(name, pose, parent, child, reverse))
            stack.append(child)
    return used


def constant(part: Component, name: str) -> float:
    """Return the number that a parameter or a signal is, or refuse what is none."""
    value = getattr(part, name)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name} is no number, and a robot's file has only such", where=part.path) from None


def turn_about(axis: Any, angle: float) -> Any:
    """Return the matrix of a rotation about an axis, by Rodrigues' formula."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def pose_of(part: Any) -> Pose:
    """Return how frame b of a weld, or of a drive that stays, is placed in frame a."""
    if isinstance(part, RotaryDrive):
        return turn_about(tuple(part.axis), constant(part, "rotation")), np.zeros(3)
    if isinstance(part, Drive):
        return np.eye(3), np.array(tuple(part.axis)) * constant(part, "motion")
    place = np.array(tuple(part.displacement), dtype=float)
    if part.turned_by == "angle":
        return turn_about(tuple(part.axis), float(part.angle)), place
    if part.turned_by == "two axes":
        x, y = np.array(tuple(part.x_axis)), np.array(tuple(part.y_axis))
        y = y - (y @ x) * x
        y = y / np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)]), place
    turned = np.eye(3)
    for letter, angle in zip(part.convention, tuple(part.angles), strict=True):
        turned = turned @ turn_about(np.eye(3)["xyz".index(letter)], float(angle))
    return turned, place


def inverse(pose: Pose) -> Pose:
    """Return the pose of the other frame in the first."""
    return pose[0].T, -pose[0].T @ pose[1]
