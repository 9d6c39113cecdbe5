"""Kinematics in space: positions, velocities and accelerations of every node, from the world outwards.

Angular velocities and accelerations are carried along in the axes of each body, linear ones in world axes
(Featherstone, Rigid Body Dynamics Algorithms, section 5.3, with this choice of axes). An arm of a body is
differentiated in the body's own axes, where it is constant, and turned into the world once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TypeAlias

from atwood.expr import Expression, Graph, Scalar, jvp, substitute
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.orientation import (
    Quaternion,
    node_quaternions,
    orientation_axes,
    orientation_quaternion,
    quaternion_product,
    rotation_quaternion,
)
from atwood.mechanics.kinematics.positions import (
    BodyShape,
    Components,
    Kinematics,
    Placements,
    Turned,
    displaced,
    reads_axes,
)
from atwood.model.values.rotation import (
    IDENTITY,
    Axes,
    Rotation,
    Turn,
    as_rotation,
    compose,
    from_axes,
    spin_rate_through,
    spin_through,
    to_axes,
    transposed,
)
from atwood.model.values.space import Vector, cross
from atwood.topology.bodies import Bodies, Body
from atwood.topology.graph import Joint
from atwood.topology.spanning_forest import Attachment, SpanningForest

_STILL = Vector(0.0, 0.0, 0.0)

Swing: TypeAlias = tuple[Vector, Vector, Vector]
"""An arm with its first and second derivatives."""


@dataclass(frozen=True)
class Course:
    """How coordinates go on in time.

    Attributes
    ----------
    values
        Each coordinate of the forest as an expression of the coordinates that are left.
    spins, spin_rates
        Each speed of the forest and its derivative; only those of orientations are read.
    first
        Directions of the first time derivative: time, and each coordinate that is left with its rate.
    second
        Further directions of the second: each speed with its acceleration.
    """

    values: Sequence[Expression]
    spins: Sequence[Expression]
    spin_rates: Sequence[Expression]
    first: Mapping[Expression, Expression | float]
    second: Mapping[Expression, Expression | float]

    def differentiated(self, values: Sequence[Expression]) -> tuple[list[Expression], list[Expression]]:
        """Return the first and second time derivatives of some values."""
        if not values:
            return [], []
        rates = jvp(list(values), self.first)
        return rates, jvp(rates, self.both)

    @cached_property
    def both(self) -> Mapping[Expression, Expression | float]:
        """Directions of the second time derivative."""
        return {**self.first, **self.second}


@dataclass(frozen=True)
class _BodyRotation:
    """Axes of a body in world axes; its angular velocity and acceleration along them; its quaternion."""

    axes: Axes
    spin: Vector
    spin_rate: Vector
    quaternion: Quaternion


@dataclass(frozen=True)
class _State:
    """Position, velocity, acceleration, and acceleration less that of free fall, in world axes."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    lifted: Vector

    def moved(self, arm: Swing, forwards: bool) -> _State:
        """Return the state at the end of an arm, or, backwards, at its beginning."""
        position, velocity, acceleration = arm
        if forwards:
            return _State(
                self.position + position,
                self.velocity + velocity,
                self.acceleration + acceleration,
                self.lifted + acceleration,
            )
        return _State(
            self.position - position,
            self.velocity - velocity,
            self.acceleration - acceleration,
            self.lifted - acceleration,
        )


class _Walk:
    """What is known while the forest is walked from the world outwards."""

    def __init__(
        self, graph: Graph, bodies: Bodies, forest: SpanningForest, shape_of: Mapping[int, BodyShape], course: Course
    ) -> None:
        self.graph, self.bodies, self.forest, self.shape_of, self.course = graph, bodies, forest, shape_of, course
        self.body_rotations: dict[int, _BodyRotation] = {
            0: _BodyRotation(IDENTITY, _STILL, _STILL, (1.0, 0.0, 0.0, 0.0))
        }
        self.nodes: dict[int, _State] = {}
        self.references: dict[int, _State] = {}
        self.known: dict[Expression, Expression] = {}
        self.orientation_coordinates = {
            orientation.coordinates: orientation for orientation in forest.orientation_coordinates
        }

    def lay_world(self, origin: _State) -> None:
        """Place what is fixed, from where positions are counted."""
        shape = self.shape_of[0]
        for node, offset in shape.offsets.items():
            self.nodes[node] = origin.moved(self.arm(0, offset), True)
        self.references[0] = origin.moved(self.arm(0, shape.reference), True)

    def spread(self, body: Body, node: int, state: _State) -> None:
        """Place all nodes of a body, and its reference point, from one of its nodes."""
        shape = self.shape_of[body.index]
        for other in body.nodes:
            arm = shape.offsets[other] - shape.offsets[node]
            self.nodes[other] = state if other == node else state.moved(self.arm(body.index, arm), True)
        self.references[body.index] = state.moved(self.arm(body.index, shape.reference - shape.offsets[node]), True)

    def arm(self, body: int, arm: Vector, rate: Vector = _STILL, second: Vector = _STILL) -> Swing:
        """Return an arm given in the axes of a body, and its derivatives, in world axes.

        With d the arm: ``R d``, ``R (d' + omega x d)``, ``R (d'' + 2 omega x d' + alpha x d + omega x (omega x d))``.
        """
        body_rotation = self.body_rotations.get(body)
        if body_rotation is None:
            return arm, rate, second
        w, alpha = body_rotation.spin, body_rotation.spin_rate
        swing = Vector(
            arm.x * -(w.y * w.y + w.z * w.z) + arm.y * (w.x * w.y - alpha.z) + arm.z * (w.x * w.z + alpha.y),
            arm.x * (w.x * w.y + alpha.z) + arm.y * -(w.x * w.x + w.z * w.z) + arm.z * (w.y * w.z - alpha.x),
            arm.x * (w.x * w.z - alpha.y) + arm.y * (w.y * w.z + alpha.x) + arm.z * -(w.x * w.x + w.y * w.y),
        )
        velocity = cross(w, arm) + rate
        acceleration = swing + second + cross(w, rate) * 2.0
        return (
            self.in_world(body_rotation.axes, arm),
            self.in_world(body_rotation.axes, velocity),
            self.in_world(body_rotation.axes, acceleration),
        )

    def in_world(self, axes: Axes, vector: Vector) -> Vector:
        """Return a vector of some axes in world axes, as expressions."""
        return Vector(*(self.graph.convert(c) for c in from_axes(axes, vector)))

    def read_coordinates(self, joint: Joint, attachment: Attachment) -> None:
        """Take note of what the joint's coordinates stand for."""
        symbols = joint.local.coordinates if attachment.turns_with_joint else joint.moves
        for symbol, number in zip(symbols, attachment.coordinates, strict=True):
            self.known[symbol] = self.course.values[number]

    def placed(self, values: Sequence[Scalar]) -> list[Expression]:
        """Return expressions of joint coordinates in terms of the mechanism's."""
        return substitute([self.graph.convert(value) for value in values], self.known)

    def turn(self, attachment: Attachment) -> None:
        """Work out how a body is turned, from its own coordinates or across its joint."""
        joint, child = attachment.joint, attachment.body
        if attachment.orientation:
            orientation = self.orientation_coordinates[attachment.orientation]
            values = [self.course.values[i] for i in orientation.coordinates]
            spin = Vector(*(self.course.spins[i] for i in attachment.spin))
            spin_rate = Vector(*(self.course.spin_rates[i] for i in attachment.spin))
            axes, quaternion = orientation_axes(orientation, values), orientation_quaternion(orientation, values)
            self.body_rotations[child] = _BodyRotation(axes, spin, spin_rate, quaternion)
        elif joint is not None and attachment.turns_with_joint:
            rotation = as_rotation(joint.local.placement.rotation)
            near, far = (joint.b, joint.a) if attachment.backwards else (joint.a, joint.b)
            rotation = rotation.inverse() if attachment.backwards else rotation
            self.body_rotations[child] = self._across(rotation, near, far, child)

    def _across(self, rotation: Rotation, near: int, far: int, child: int) -> _BodyRotation:
        parent = self.body_rotations[self.bodies.body_of[near]]
        near_turn = self.shape_of[self.bodies.body_of[near]].turns[near]
        far_turn = self.shape_of[child].turns[far]
        assert isinstance(near_turn, tuple)
        assert isinstance(far_turn, tuple)
        axes = compose(parent.axes, near_turn)
        spin, spin_rate = to_axes(near_turn, parent.spin), to_axes(near_turn, parent.spin_rate)
        angles = self.placed([one.angle for one in rotation.turns])
        rates, seconds = self.course.differentiated(angles)
        turns = []
        for one, angle, rate, second in zip(rotation.turns, angles, rates, seconds, strict=True):
            turn = Turn(one.axis, angle)
            turns.append(turn)
            axes = compose(axes, turn.axes())
            spin_rate = spin_rate_through(turn, rate, second, spin, spin_rate)
            spin = spin_through(turn, rate, spin)
        return _BodyRotation(
            compose(axes, transposed(far_turn)),
            from_axes(far_turn, spin),
            from_axes(far_turn, spin_rate),
            self._quaternion_across(parent, near, Rotation(tuple(turns)), far),
        )

    def _quaternion_across(self, parent: _BodyRotation, near: int, rotation: Rotation, far: int) -> Quaternion:
        near_body, far_body = (self.bodies.bodies[self.bodies.body_of[node]] for node in (near, far))
        w, x, y, z = node_quaternions(far_body)[far]
        at_near = quaternion_product(parent.quaternion, node_quaternions(near_body)[near])
        return quaternion_product(quaternion_product(at_near, rotation_quaternion(rotation)), (w, -x, -y, -z))

    def shifts(self, joint: Joint) -> tuple[Vector, Vector, Vector]:
        """Return the displacement of a joint and its derivatives, in the axes that it is given in."""
        if reads_axes(joint.local):
            symbols = [symbol for symbol in joint.local.coordinates if symbol in self.known]
            values = [self.known[symbol] for symbol in symbols]
            swings = zip(values, *self.course.differentiated(values), strict=True)
            ends = [self.turned_at(node) for node in (joint.a, joint.b)]
            return displaced(self.graph, joint.local, ends, dict(zip(symbols, swings, strict=True)))
        shift = self.placed(list(joint.local.placement.displacement))
        rate, second = (Vector(*values) for values in self.course.differentiated(shift))
        return Vector(*shift), rate, second

    def turned_at(self, node: int) -> Turned:
        """Return how the frame of a node is turned and goes on turning, in world axes."""
        body = self.bodies.body_of[node]
        body_rotation, turn = self.body_rotations[body], self.shape_of[body].turns[node]
        assert isinstance(turn, tuple)
        spin, spin_rate = (
            self.in_world(body_rotation.axes, one) for one in (body_rotation.spin, body_rotation.spin_rate)
        )
        return compose(body_rotation.axes, turn), spin, spin_rate

    def across_joint(self, attachment: Attachment, joint: Joint) -> _State:
        """Return the state of the child's node from that of the parent's."""
        placement = joint.local.placement
        parts = self.shifts(joint)
        body = self.bodies.body_of[joint.a]
        if placement.axes == "a":
            turn = self.shape_of[body].turns[joint.a]
            assert isinstance(turn, tuple)
            along = [from_axes(turn, part) for part in parts]
            arm = self.arm(body, along[0], along[1], along[2])
        else:
            arm = parts
        return self.nodes[attachment.parent].moved(arm, not attachment.backwards)

    def free(self, attachment: Attachment, pull: Vector) -> _State:
        """Return the state of the reference point of a free body."""
        values = [self.course.values[i] for i in attachment.coordinates]
        rates, seconds = self.course.differentiated(values)
        acceleration = Vector(*seconds)
        return _State(Vector(*values), Vector(*rates), acceleration, acceleration - pull)


def move_in_space(
    graph: Graph,
    bodies: Bodies,
    forest: SpanningForest,
    shape_of: Mapping[int, BodyShape],
    course: Course,
    pull: Vector,
) -> tuple[Kinematics, tuple[dict[int, Components], dict[int, Components]]]:
    """Compute how every node moves, walking the forest from the world outwards."""
    walk = _Walk(graph, bodies, forest, shape_of, course)
    walk.lay_world(_State(_STILL, _STILL, _STILL, -pull))
    for attachment in forest.attachments:
        body, joint = bodies.bodies[attachment.body], attachment.joint
        if joint is not None:
            walk.read_coordinates(joint, attachment)
        walk.turn(attachment)
        if joint is not None:
            start = walk.across_joint(attachment, joint)
        else:
            shape = shape_of[body.index]
            center = walk.free(attachment, pull)
            arm = walk.arm(body.index, shape.offsets[body.root] - shape.reference)
            start = center.moved(arm, True)
        walk.spread(body, attachment.node, start)
        if joint is None:
            walk.references[body.index] = center
    for symbol, (number, _) in forest.counted.items():
        walk.known[symbol] = course.values[number]
    return _gathered(walk)


def _gathered(walk: _Walk) -> tuple[Kinematics, tuple[dict[int, Components], dict[int, Components]]]:
    convert = walk.graph.convert

    def components(vector: Vector) -> Components:
        return tuple(convert(c) for c in vector)

    def all_of(states: Mapping[int, _State], part: str) -> dict[int, Components]:
        return {i: components(getattr(one, part)) for i, one in states.items()}

    def axes_of(axes: Axes) -> Axes:
        x, y, z = (Vector(*components(axis)) for axis in axes)
        return x, y, z

    joint_rates, joint_accelerations = walk.course.differentiated(list(walk.known.values()))
    placements = Placements(
        all_of(walk.nodes, "position"),
        {},
        all_of(walk.references, "position"),
        walk.known,
        {i: axes_of(one.axes) for i, one in walk.body_rotations.items()},
        {i: tuple(convert(c) for c in one.quaternion) for i, one in walk.body_rotations.items()},
    )
    kinematics = Kinematics(
        placements,
        all_of(walk.nodes, "velocity"),
        all_of(walk.nodes, "acceleration"),
        {i: components(one.spin) for i, one in walk.body_rotations.items()},
        {i: components(one.spin_rate) for i, one in walk.body_rotations.items()},
        all_of(walk.references, "velocity"),
        all_of(walk.references, "acceleration"),
        dict(zip(walk.known, joint_rates, strict=True)),
        dict(zip(walk.known, joint_accelerations, strict=True)),
    )
    return kinematics, (all_of(walk.nodes, "lifted"), all_of(walk.references, "lifted"))
