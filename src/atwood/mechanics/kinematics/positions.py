"""Positions, velocities and accelerations of nodes and of other points of bodies, as expressions of the coordinates.

One recursion gives positions and orientations; velocities and accelerations are its forward derivatives. A joint that
leaves every rotation free may say its displacement in terms of the axes of its frames: the centre of a disc that rolls
is the higher, the more upright the disc is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

from atwood.errors import UnsupportedError
from atwood.expr import Expression, Graph, Scalar, affine_coefficients, depends_on, jvp, live, substitute
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.orientation import NodeTurn, node_axes, rotate
from atwood.model.local.parts import LocalJoint
from atwood.model.values.rotation import Axes, from_axes
from atwood.model.values.space import Space, Vector, cross
from atwood.topology.bodies import Bodies, Body
from atwood.topology.graph import WORLD, Joint
from atwood.topology.spanning_forest import Attachment, SpanningForest

Components = tuple[Expression, ...]


@dataclass(frozen=True)
class BodyShape:
    """Where the nodes of a body are in its own axes, and how they are turned; of parameters only.

    Attributes
    ----------
    offsets
        Position of each node, in the axes of the body.
    turns
        Rotation of each node from the body: an angle in the plane, rad; in space its axes in those of the body.
    reference
        The point that a free body's coordinates are taken at: its centre of mass, or its root.
    """

    offsets: Mapping[int, Vector]
    turns: Mapping[int, NodeTurn]
    reference: Vector


@dataclass(frozen=True)
class Placements:
    """Positions and orientations as expressions of coordinates and time.

    Attributes
    ----------
    positions
        Free position components of each node.
    angles
        In a plane: angle of each body that has an orientation.
    references
        Free position components of the reference point of each body.
    joint_coordinates
        Value of each joint coordinate symbol of a joint that a body hangs on, or whose turns are counted.
    axes, quaternions
        In space: axes of each body that has an orientation, in world axes; and its quaternion, scalar part first.
    """

    positions: Mapping[int, Components]
    angles: Mapping[int, Expression]
    references: Mapping[int, Components]
    joint_coordinates: Mapping[Expression, Expression]
    axes: Mapping[int, Axes] = field(default_factory=dict)
    quaternions: Mapping[int, Components] = field(default_factory=dict)


@dataclass(frozen=True)
class Kinematics:
    """Placements with their first and second time derivatives.

    Attributes
    ----------
    placements
        Positions and orientations.
    velocities, accelerations
        Of the nodes.
    angular_velocities, angular_accelerations
        Of the bodies that have an orientation: one component in a plane, counter-clockwise; three in space, in the
        axes of the body.
    reference_velocities, reference_accelerations
        Of the reference points.
    joint_rates, joint_accelerations
        Derivatives of each joint coordinate of a joint that a body hangs on, or whose turns are counted; in a plane
        only of those that other parts take hold of.
    """

    placements: Placements
    velocities: Mapping[int, Components]
    accelerations: Mapping[int, Components]
    angular_velocities: Mapping[int, Components]
    angular_accelerations: Mapping[int, Components]
    reference_velocities: Mapping[int, Components]
    reference_accelerations: Mapping[int, Components]
    joint_rates: Mapping[Expression, Expression] = field(default_factory=dict)
    joint_accelerations: Mapping[Expression, Expression] = field(default_factory=dict)


def shapes(
    bodies: Bodies,
    layouts: Mapping[int, tuple[Mapping[int, Vector], Mapping[int, NodeTurn]]],
    references: Mapping[int, Vector],
) -> dict[int, BodyShape]:
    """Return the shape of every body."""
    found = {}
    for body in bodies.bodies:
        offsets, turns = layouts[body.index]
        found[body.index] = BodyShape(offsets, turns, references.get(body.index, offsets[body.root]))
    return found


def place(
    graph: Graph,
    bodies: Bodies,
    forest: SpanningForest,
    shape_of: Mapping[int, BodyShape],
    coordinates: Sequence[Expression],
    space: Space,
    origin: Components,
) -> Placements:
    """Compute where every node is, walking the forest from the world outwards."""
    angles: dict[int, Expression] = {0: graph.constant(0.0)}
    for turn in forest.orientations:
        if turn.coordinate is not None:
            angles[turn.body] = coordinates[turn.coordinate]
        elif turn.joint is not None:
            angles[turn.body] = _locked_angle(graph, turn.joint, turn.body, bodies, shape_of, angles)
    positions: dict[int, Components] = {}
    references: dict[int, Components] = {}
    known: dict[Expression, Expression] = {}
    for node, offset in shape_of[0].offsets.items():
        positions[node] = _shift(graph, origin, offset, None, space)
    references[0] = positions[WORLD]
    for attachment in forest.attachments:
        body, shape = bodies.bodies[attachment.body], shape_of[attachment.body]
        own = [coordinates[i] for i in attachment.coordinates]
        if attachment.joint is None:
            references[body.index] = tuple(o + c for o, c in zip(origin, own, strict=True))
            arm = shape.offsets[body.root] - shape.reference
            start = _shift(graph, references[body.index], arm, angles.get(body.index), space)
        else:
            start = _across_joint(graph, attachment, own, bodies, shape_of, angles, positions, known, space)
        _spread(graph, body, shape, attachment.node, start, angles, space, positions)
        if attachment.joint is not None:
            arm = shape.reference - shape.offsets[attachment.node]
            references[body.index] = _shift(graph, start, arm, angles.get(body.index), space)
    return Placements(positions, angles, references, known)


def _locked_angle(
    graph: Graph,
    joint: Joint,
    child: int,
    bodies: Bodies,
    shape_of: Mapping[int, BodyShape],
    angles: Mapping[int, Expression],
) -> Expression:
    a, b = bodies.body_of[joint.a], bodies.body_of[joint.b]
    rotation = joint.local.placement.rotation
    turn_a, turn_b = shape_of[a].turns[joint.a], shape_of[b].turns[joint.b]
    if child == b:
        return graph.convert(angles[a] + turn_a + rotation - turn_b)
    return graph.convert(angles[b] + turn_b - rotation - turn_a)


def _shift(graph: Graph, start: Components, arm: Vector, angle: Expression | None, space: Space) -> Components:
    if angle is not None and space.has_rotation:
        arm = rotate(arm, angle)
    return tuple(graph.convert(p + d) for p, d in zip(start, space.components(arm), strict=True))


def _spread(
    graph: Graph,
    body: Body,
    shape: BodyShape,
    node: int,
    start: Components,
    angles: Mapping[int, Expression],
    space: Space,
    positions: dict[int, Components],
) -> None:
    """Place all nodes of a body from one of them."""
    angle = angles.get(body.index)
    for other in body.nodes:
        arm = shape.offsets[other] - shape.offsets[node]
        positions[other] = start if other == node else _shift(graph, start, arm, angle, space)


def _across_joint(
    graph: Graph,
    attachment: Attachment,
    own: Sequence[Expression],
    bodies: Bodies,
    shape_of: Mapping[int, BodyShape],
    angles: Mapping[int, Expression],
    positions: Mapping[int, Components],
    known: dict[Expression, Expression],
    space: Space,
) -> Components:
    joint = attachment.joint
    assert joint is not None
    a, b = bodies.body_of[joint.a], bodies.body_of[joint.b]
    angle_a = angles[a] + shape_of[a].turns[joint.a] if a in angles else None
    values = iter(own)
    for symbol in joint.moves:
        if symbol in joint.turns and b not in angles:
            raise UnsupportedError(
                "a coordinate of it turns b, and its constraints keep b from turning",
                where=joint.label,
                advice="Mend the placement's rotation or the constraint: they differ by very little.",
            )
        if symbol in joint.turns:
            angle_b = angles[b] + shape_of[b].turns[joint.b]
            known[symbol] = graph.convert(_turned_by(joint, symbol, angle_b - angle_a))
        else:
            known[symbol] = next(values)
    placement = joint.local.placement
    shift = Vector(*substitute([graph.convert(c) for c in placement.displacement], known))
    if placement.axes == "a" and angle_a is not None and space.has_rotation:
        shift = rotate(shift, angle_a)
    step = space.components(shift)
    start = positions[attachment.parent]
    if attachment.backwards:
        return tuple(graph.convert(p - d) for p, d in zip(start, step, strict=True))
    return tuple(graph.convert(p + d) for p, d in zip(start, step, strict=True))


def _turned_by(joint: Joint, symbol: Expression, angle: Scalar) -> Scalar:
    """Return the joint coordinate for which a joint in a plane turns b against a by an angle."""
    rotation: Any = joint.local.placement.rotation
    if rotation is symbol:
        return angle
    parameters = [node for node in live([rotation]) if node.is_parametric]
    found = affine_coefficients(rotation, [symbol], parameters)
    if found is None:
        raise UnsupportedError(
            "in a plane, a coordinate that both moves and turns b has to turn it evenly: by a constant times its value",
            where=joint.label,
            advice="Take the angle itself as the coordinate, and let the displacement follow from it.",
        )
    (slope,), rest = found
    return (angle - rest) / slope


def differentiate(
    placements: Placements,
    time: Expression,
    coordinates: Sequence[Expression],
    speeds: Sequence[Expression],
    accelerations: Sequence[Expression],
) -> Kinematics:
    """Return the placements with their time derivatives: two forward sweeps over the position program."""
    nodes, bodies, references = placements.positions, placements.angles, placements.references
    flat = [c for p in nodes.values() for c in p] + list(bodies.values()) + [c for p in references.values() for c in p]
    first: dict[Expression, Expression | float] = {time: 1.0, **dict(zip(coordinates, speeds, strict=True))}
    rates = jvp(flat, first)
    second = jvp(rates, {**first, **dict(zip(speeds, accelerations, strict=True))})

    def split(values: list[Expression]) -> tuple[dict[int, Components], dict[int, Components], dict[int, Components]]:
        it = iter(values)
        return (
            {i: tuple(next(it) for _ in p) for i, p in nodes.items()},
            {i: (next(it),) for i in bodies},
            {i: tuple(next(it) for _ in p) for i, p in references.items()},
        )

    v, w, rv = split(rates)
    a, aw, ra = split(second)
    return Kinematics(placements, v, a, w, aw, rv, ra)


def lifted_accelerations(
    placements: Placements,
    origin: Components,
    pull: Sequence[Scalar],
    time: Expression,
    coordinates: Sequence[Expression],
    speeds: Sequence[Expression],
    accelerations: Sequence[Expression],
) -> tuple[dict[int, Components], dict[int, Components]]:
    """Return the accelerations less that of free fall, of nodes and of reference points.

    Weight is the same as the world's origin accelerating against it; so it is added once, where the recursion begins,
    and not for every mass (Featherstone, Rigid Body Dynamics Algorithms, section 5.3).
    """
    graph = time.graph
    drift = [graph.symbol(f"rate of {o.name}") for o in origin]
    flat = [c for group in (placements.positions, placements.references) for p in group.values() for c in p]
    first: dict[Expression, Expression | float] = {time: 1.0, **dict(zip(coordinates, speeds, strict=True))}
    rates = jvp(flat, {**first, **dict(zip(origin, drift, strict=True))})
    rising = {d: graph.convert(-g) for d, g in zip(drift, pull, strict=True)}
    second = jvp(rates, {**first, **dict(zip(speeds, accelerations, strict=True)), **rising})
    values = iter(substitute(second, dict.fromkeys([*origin, *drift], 0.0)))
    nodes = {i: tuple(next(values) for _ in p) for i, p in placements.positions.items()}
    return nodes, {i: tuple(next(values) for _ in p) for i, p in placements.references.items()}


Turned = tuple[Axes, Vector, Vector]
"""Axes of a frame, its angular velocity and its angular acceleration, all in world axes."""


def reads_axes(joint: LocalJoint) -> bool:
    """Return whether a joint's displacement depends on how its frames are turned."""
    symbols = [component for axes in joint.axes for axis in axes for component in axis]
    shift = [s for s in joint.placement.displacement if isinstance(s, Expression)]
    return bool(symbols) and depends_on(shift, symbols)


def displaced(
    graph: Graph,
    joint: LocalJoint,
    ends: Sequence[Turned],
    moves: Mapping[Expression, tuple[Expression, Expression, Expression]],
) -> tuple[Vector, Vector, Vector]:
    """Return the displacement of a joint and its first two time derivatives, in the axes that it is given in."""
    first: dict[Expression, Expression | float] = {}
    more: dict[Expression, Expression | float] = {}
    known: dict[Expression, Expression] = {}
    for symbol, (value, rate, second) in moves.items():
        going, changing = graph.symbol(f"{symbol.name}'"), graph.symbol(f"{symbol.name}''")
        first[symbol], more[going] = going, changing
        known.update({symbol: value, going: rate, changing: second})
    for end, (axes, (turned, spin, spin_rate)) in enumerate(zip(joint.axes, ends, strict=True)):
        w, alpha = (Vector(*(graph.symbol(f"{joint.law.name} {kind}{end}.{c}") for c in "xyz")) for kind in "wa")
        more.update(zip(w, alpha, strict=True))
        for local, actual in zip(axes, turned, strict=True):
            first.update(zip(local, cross(w, local), strict=True))
            known.update(zip(local, (graph.convert(c) for c in actual), strict=True))
        known.update(zip((*w, *alpha), (graph.convert(c) for c in (*spin, *spin_rate)), strict=True))
    shift = [graph.convert(value) for value in joint.placement.displacement]
    rates = jvp(shift, first)
    seconds = jvp(rates, {**first, **more})
    placed = substitute([*shift, *rates, *seconds], known)
    return Vector(*placed[0:3]), Vector(*placed[3:6]), Vector(*placed[6:9])


@dataclass(frozen=True)
class BodyPoint:
    """An arm that a body carries, along the free components in world axes.

    Attributes
    ----------
    position
        The arm, m.
    velocity, acceleration
        Of its end against its beginning.
    """

    position: tuple[Scalar, ...]
    velocity: tuple[Scalar, ...]
    acceleration: tuple[Scalar, ...]


def body_point_of(kinematics: Kinematics, body: int, turn: NodeTurn, vector: Vector, space: Space) -> BodyPoint:
    """Return an arm that is given in the axes of a node."""
    placements = kinematics.placements
    spin = kinematics.angular_velocities.get(body, ())
    spin_rate = kinematics.angular_accelerations.get(body, ())
    if space.is_spatial:
        return _arm_in_space(kinematics, body, turn, vector, spin, spin_rate)
    axes = node_axes(placements.angles.get(body), None, turn)
    arm = space.components(vector if axes is None else from_axes(axes, vector))
    still = (0.0,) * len(arm)
    if space.is_line or not spin:
        return BodyPoint(arm, still, still)
    w, alpha = spin[0], spin_rate[0]
    velocity = (-w * arm[1], w * arm[0])
    acceleration = (-alpha * arm[1] - w * w * arm[0], alpha * arm[0] - w * w * arm[1])
    return BodyPoint(arm, velocity, acceleration)


def _arm_in_space(
    kinematics: Kinematics, body: int, turn: NodeTurn, vector: Vector, spin: Components, spin_rate: Components
) -> BodyPoint:
    axes = kinematics.placements.axes.get(body)
    if axes is None:
        return BodyPoint(tuple(vector), (0.0,) * 3, (0.0,) * 3)
    arm = rotate(vector, turn)
    w, alpha = Vector(*spin), Vector(*spin_rate)
    velocity = cross(w, arm)
    acceleration = cross(alpha, arm) + cross(w, velocity)
    return BodyPoint(*(tuple(from_axes(axes, one)) for one in (arm, velocity, acceleration)))
