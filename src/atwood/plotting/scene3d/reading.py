"""Bodies and joints of a scene in space along a run, found from laws and not from names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Literal

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Scalar, depends_on, is_zero
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.model.declare.law_results import BodyInertia
from atwood.model.local.parts import LocalJoint, LocalPart
from atwood.model.values.outline import Outline
from atwood.model.values.rotation import FreeRotation, Rotation, as_rotation
from atwood.numerics.newton import largest
from atwood.numerics.rank import decompose
from atwood.plotting.shapes.meshes import (
    depends,
    holds_distance,
    joint_curve,
    joint_shift,
    joint_step,
    outline_of,
)
from atwood.result.result import Result
from atwood.result.segment_quantities import shown_values

JoiningKind = Literal["hinge", "ball", "cross", "slide", "plane", "curve"]
TieKind = Literal["rod", "rope", "spring", "damper"]

_STRAIGHT = 1e-6
"""Of the way that is seen: what leaves a straight line by less is on it, as runs are known to their tolerance."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a body is along a run.

    Attributes
    ----------
    origin
        Place of its root node, m, shape (times, 3).
    axes
        Its axes in world axes as the columns of matrices, shape (times, 3, 3).
    """

    origin: FloatArray
    axes: FloatArray

    def at(self, moment: int) -> tuple[FloatArray, FloatArray]:
        """Return place and axes at one output time."""
        return self.origin[moment], self.axes[moment]

    def place(self, point: FloatArray) -> FloatArray:
        """Return where a point of the body is along the run, m, shape (times, 3)."""
        return np.asarray(self.origin + self.axes @ point)


@dataclass(frozen=True, eq=False)
class Joining:
    """What a joint looks like.

    Attributes
    ----------
    part
        Its path.
    kind
        What it lets move.
    nodes
        Nodes a and b.
    axes
        Its axes: in body a of the first; of a ``cross`` the second in body b.
    turns
        Whether a ``slide`` turns about its axis too.
    reach
        Of a ``slide``, how far it goes along its axis in the run, m; of a ``plane``, between which heights
        over it node b is, m.
    curve
        Of a ``curve``, its points from node a in the axes of body a, m, shape (points, 3).
    """

    part: str
    kind: JoiningKind
    nodes: tuple[int, int]
    axes: tuple[FloatArray, ...] = ()
    turns: bool = False
    reach: tuple[float, float] = (0.0, 0.0)
    curve: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Lump:
    """Mass of one part: of a rigid body, or of a point.

    Attributes
    ----------
    part
        Its path.
    body, node
        Where it belongs.
    mass
        kg.
    center
        Its centre of mass in the axes of the body, m.
    axes
        Its frame in the axes of the body, as columns.
    tensor
        Inertia about the centre of mass in the axes of the body, kg m^2; zero for a point.
    outline
        What it looks like; None if the part does not say.
    origin
        Its node in the axes of the body, about which the outline is, m.
    """

    part: str
    body: int
    node: int
    mass: float
    center: FloatArray
    axes: FloatArray
    tensor: FloatArray
    outline: Outline | None = None
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Tie:
    """What goes from one node to another.

    Attributes
    ----------
    part
        Its path.
    kind
        How it is drawn.
    nodes
        Its nodes in order.
    """

    part: str
    kind: TieKind
    nodes: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Reading:
    """What there is to draw of a scene in space along a run.

    Attributes
    ----------
    time
        Times, s.
    body_of
        Body of each node; 0 is the world.
    offsets, turns
        Place and axes of each node in the axes of its body, m.
    poses
        Where each body is.
    steps
        Pairs of nodes that a part holds rigidly apart.
    joinings, lumps, ties
        What the parts are.
    grounds
        Nodes that are fixed in the world by a part.
    is_heavy
        Whether there is gravity.
    """

    time: FloatArray
    body_of: Mapping[int, int]
    offsets: Mapping[int, FloatArray]
    turns: Mapping[int, FloatArray]
    poses: Mapping[int, Pose]
    steps: tuple[tuple[int, int], ...]
    joinings: tuple[Joining, ...] = ()
    lumps: tuple[Lump, ...] = ()
    ties: tuple[Tie, ...] = ()
    grounds: tuple[int, ...] = ()
    is_heavy: bool = False

    def place(self, node: int) -> FloatArray:
        """Return where a node is along the run, m, shape (times, 3)."""
        return self.poses[self.body_of[node]].place(self.offsets[node])

    @cached_property
    def used(self) -> tuple[int, ...]:
        """Nodes of what is drawn."""
        several = [*(one.nodes for one in self.joinings), *(one.nodes for one in self.ties), *self.steps, self.grounds]
        found = {node for nodes in several for node in nodes} | {one.node for one in self.lumps}
        return tuple(sorted(found))


def read_scene(result: Result) -> Reading:
    """Return what there is to draw of a scene in space."""
    mechanism = result.assembly.mechanism
    offsets, turns = _layouts(mechanism)
    poses = _poses(result)
    bare = Reading(result.time, mechanism.bodies.body_of, offsets, turns, poses, _steps(mechanism))
    joinings: list[Joining] = []
    lumps: list[Lump] = []
    ties: list[Tie] = []
    grounds: list[int] = []
    for path, local in mechanism.locals_.items():
        nodes = {name: mechanism.graph.node_of[path, name] for name in local.connectors}
        joinings += [one for joint in local.joints for one in read_joint(bare, mechanism, path, joint, nodes)]
        lumps += _lumps(bare, mechanism, path, local, nodes)
        followed = _followed(bare, path, local, nodes)
        joinings += followed
        ties += [] if followed or _is_unseen(local) else _ties(path, local, nodes)
        options = [joint.law.options for joint in local.joints]
        if any(one.rigid and one.a == "world" for one in options):
            grounds += nodes.values()
    return replace(
        bare,
        joinings=tuple(joinings),
        lumps=tuple(lumps),
        ties=tuple(ties),
        grounds=tuple(dict.fromkeys(grounds)),
        is_heavy=not is_zero(mechanism.gravity.z),
    )


def _is_unseen(local: LocalPart) -> bool:
    outline = outline_of(local)
    return outline is not None and outline.kind == "nothing"


def _followed(reading: Reading, path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Joining]:
    """Return, as a curve, the way of a connector as seen from the first one, where the part's outline is that."""
    outline = outline_of(local)
    if outline is None or outline.kind != "path":
        return []
    first, other = next(iter(nodes.values())), nodes[outline.frame]
    return [Joining(path, "curve", (first, other), curve=seen_from(reading, first, other))]


def _layouts(mechanism: Mechanism) -> tuple[dict[int, FloatArray], dict[int, FloatArray]]:
    """Return place and axes of each node in its body, as numbers."""
    offsets: dict[int, FloatArray] = {}
    turns: dict[int, FloatArray] = {}
    for body in mechanism.bodies.bodies:
        places, axes = body_offsets(body, mechanism.space)
        for node, place in places.items():
            turn = axes[node]
            assert isinstance(turn, tuple)
            offsets[node] = mechanism.values_at_start(place)
            turns[node] = np.column_stack([mechanism.values_at_start(axis) for axis in turn])
    return offsets, turns


def _steps(mechanism: Mechanism) -> tuple[tuple[int, int], ...]:
    steps = [step for body in mechanism.bodies.bodies for step in body.steps]
    return tuple((one.parent, one.child) for one in steps if one.joint.local.law.options.a != "world")


def _poses(result: Result) -> dict[int, Pose]:
    """Return where every body is at the output times; what has no orientation is drawn unturned."""
    pieces: list[dict[int, FloatArray]] = []
    for segment in result.run.segments:
        assembly, mechanism = segment.assembly, segment.assembly.mechanism
        placements, quantities = assembly.own_equations.kinematics.placements, list[Scalar]()
        for body in mechanism.bodies.bodies:
            axes = placements.axes.get(body.index, np.eye(3).tolist())
            quantities += [*world_position(mechanism, placements, body.root), *(c for axis in axes for c in axis)]
        shown = shown_values(segment, "poses", quantities).reshape(len(mechanism.bodies.bodies), 12, -1)
        pieces.append({body.index: shown[i] for i, body in enumerate(mechanism.bodies.bodies)})
    poses = {}
    for index in pieces[0]:
        whole = np.concatenate([piece[index] for piece in pieces], axis=1).T
        # Row by row an axis each; as columns they turn what is in the body into the world.
        poses[index] = Pose(whole[:, :3].copy(), whole[:, 3:].reshape(-1, 3, 3).transpose(0, 2, 1).copy())
    return poses


def _lumps(reading: Reading, mechanism: Mechanism, path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Lump]:
    found, outline = [], outline_of(local)
    if outline is not None and outline.kind in ("path", "nothing"):
        return []
    for one in local.point_inertias:
        if len(one.points) == 1:
            node = nodes[one.points[0].name]
            mass = mechanism.value_at_start(one.masses[0][0])
            found.append(_lump(reading, path, node, mass, np.zeros(3), np.zeros((3, 3))))
    for body in local.body_inertias:
        center = mechanism.values_at_start(body.center_of_mass)
        mass = mechanism.value_at_start(body.mass)
        lump = _lump(reading, path, nodes[body.frame.name], mass, center, _tensor(mechanism, body))
        found.append(replace(lump, outline=outline, origin=reading.offsets[lump.node]))
    if outline is not None and not local.body_inertias:
        lump = _lump(reading, path, nodes[outline.frame or next(iter(nodes))], 0.0, np.zeros(3), np.zeros((3, 3)))
        found.append(replace(lump, outline=outline, origin=reading.offsets[lump.node]))
    return [one for one in found if one.mass > 0.0 or one.outline is not None]


def _tensor(mechanism: Mechanism, body: BodyInertia) -> FloatArray:
    if body.tensor is None:
        return np.zeros((3, 3))
    return mechanism.values_at_start([entry for row in body.tensor for entry in row]).reshape(3, 3)


def _lump(reading: Reading, path: str, node: int, mass: float, center: FloatArray, tensor: FloatArray) -> Lump:
    turn = reading.turns[node]
    place = reading.offsets[node] + turn @ center
    return Lump(path, reading.body_of[node], node, mass, place, turn, turn @ tensor @ turn.T)


def _ties(path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Tie]:
    """Return what a part that only pulls or pushes between its nodes looks like."""
    ends = tuple(dict.fromkeys(nodes.values()))
    if local.joints or (local.contacts and not local.may_hold) or len(ends) < 2:
        return []
    if local.may_hold:
        return [Tie(path, "rope", ends)]
    if any(holds_distance(local, one.value) for one in local.constraints):
        return [Tie(path, "rope" if local.part.component.modes else "rod", ends)]
    kinds: list[TieKind] = []
    symbols = [symbol for one in local.connectors.values() for symbol in one.position]
    if depends_on(local.potentials, symbols):
        kinds.append("spring")
    if depends_on(local.dissipations, symbols):
        kinds.append("damper")
    return [Tie(path, kind, ends) for kind in kinds]


def read_joint(
    reading: Reading, mechanism: Mechanism, path: str, joint: LocalJoint, nodes: Mapping[str, int]
) -> list[Joining]:
    """Return what a joint looks like; nothing where it holds nothing, or holds rigidly."""
    options, placement = joint.law.options, joint.placement
    if options.rigid or options.a == "world" or _is_idle(mechanism, path, joint):
        return []
    a, b = nodes[options.a], nodes[options.b]
    turn = reading.turns[a] if placement.axes == "a" else np.eye(3)
    shift = [mechanism.table.graph.convert(c) for c in placement.displacement]
    axes = _turning_axes(mechanism, placement.rotation)
    if all(c.is_zero for c in shift):
        return _meeting(reading, path, (a, b), axes, isinstance(placement.rotation, FreeRotation))
    moving = [c for c in joint.coordinates if depends(shift, c)]
    if len(moving) == 2:
        if not _is_flat(mechanism, joint, shift, moving):
            return _sheet(mechanism, path, joint, (a, b), turn)
        first, second = (joint_step(mechanism, joint, shift, one, 1.0) for one in moving)
        normal = turn @ np.cross(first, second)
        normal /= np.linalg.norm(normal)
        return [Joining(path, "plane", (a, b), (normal,), reach=_heights(reading, (a, b), normal))]
    if len(moving) > 2:
        return []
    if len(moving) == 1:
        points = joint_curve(mechanism, path, joint)
        if points is not None:
            return [Joining(path, "curve", (a, b), curve=points @ turn.T)]
        one = joint_step(mechanism, joint, shift, moving[0], 1.0)
        axis = turn @ one
    else:
        axis = _seen_axis(reading, a, b)
    if not np.any(axis):
        return []
    axis = axis / np.linalg.norm(axis)
    along = seen_from(reading, a, b) @ axis
    return [Joining(path, "slide", (a, b), (axis,), bool(axes), (float(along.min()), float(along.max())))]


def _is_idle(mechanism: Mechanism, path: str, joint: LocalJoint) -> bool:
    """Return whether nothing is joined to the end that a joint places beside that of another, as a mere marker."""
    own = mechanism.locals_[path].joints
    if not any(one is not joint and set(one.coordinates) & set(joint.coordinates) for one in own):
        return False
    members = mechanism.graph.nodes[mechanism.graph.node_of[path, joint.law.options.b]].members
    return len(members) == 1


def _is_flat(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], moving: Sequence[Expression]
) -> bool:
    """Return whether a joint moves its end in a plane, evenly with two coordinates."""
    places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 3.0]]
    origin, one, two, far = (
        joint_shift(mechanism, joint, shift, dict(zip(moving, place, strict=True))) for place in places
    )
    return bool(np.allclose(far - origin, 2.0 * (one - origin) + 3.0 * (two - origin), rtol=1e-9, atol=1e-12))


def _sheet(
    mechanism: Mechanism, path: str, joint: LocalJoint, nodes: tuple[int, int], turn: FloatArray
) -> list[Joining]:
    """Return lines on a curved surface, along either of its coordinates."""
    shift = [mechanism.table.graph.convert(c) for c in joint.placement.displacement]
    first, second = [c for c in joint.coordinates if depends(shift, c)]
    steps, lines = np.linspace(-np.pi, np.pi, 49), np.linspace(-np.pi, np.pi, 9)
    found = []
    for along, across in ((first, second), (second, first)):
        for held in lines:
            points = np.array([joint_shift(mechanism, joint, shift, {along: step, across: held}) for step in steps])
            if np.all(np.isfinite(points)):
                found.append(Joining(path, "curve", nodes, curve=points @ turn.T))
    return found


def _heights(reading: Reading, nodes: tuple[int, int], normal: FloatArray) -> tuple[float, float]:
    """Return the lowest and the highest place over a plane of what moves on it, as the centre of what rolls, m."""
    heights = seen_from(reading, *nodes) @ normal
    return float(heights.min()), float(heights.max())


def _turning_axes(mechanism: Mechanism, rotation: object) -> list[FloatArray]:
    """Return the axes of the turns of a joint, one after another."""
    if rotation is None or isinstance(rotation, FreeRotation):
        return []
    assert isinstance(rotation, (int, float, Expression, Rotation))
    turns = as_rotation(rotation).turns
    return [mechanism.values_at_start(one.axis) for one in turns]


def _meeting(
    reading: Reading, path: str, nodes: tuple[int, int], axes: Sequence[FloatArray], is_free: bool
) -> list[Joining]:
    """Return a joint whose two nodes stay at one place."""
    a, b = nodes
    if is_free or len(axes) > 2:
        return [Joining(path, "ball", nodes)]
    if len(axes) == 2:
        return [Joining(path, "cross", nodes, (reading.turns[a] @ axes[0], reading.turns[b] @ axes[1]))]
    return [Joining(path, "hinge", nodes, (reading.turns[a] @ axis,)) for axis in axes]


def seen_from(reading: Reading, a: int, b: int) -> FloatArray:
    """Return the way from node a to node b in the axes of the body of a, m, shape (times, 3)."""
    pose = reading.poses[reading.body_of[a]]
    return np.asarray(np.einsum("tji,tj->ti", pose.axes, reading.place(b) - reading.place(a)))


def _seen_axis(reading: Reading, a: int, b: int) -> FloatArray:
    """Return the direction in which node b moves as seen from node a, where it stays on a straight line; else zero."""
    seen = seen_from(reading, a, b)
    spread = seen - seen.mean(axis=0)
    way = largest(spread)
    found = decompose(spread / (way or 1.0), np.full(len(spread), _STRAIGHT), is_whole=False)
    return found.right[0] if found.rank == 1 else np.zeros(3)
