"""The spanning forest of a mechanism: how positions and orientations are computed, one body after another.

In the reduced form, bodies hang on joints wherever these save coordinates; the joints that are left over close the
loops. In the dae form every body is on its own, and every joint is a constraint. Nobody chooses where a loop is cut:
bodies are attached greedily, the cheapest way first, and a body waits while a cheaper way to attach it may turn up.
"""

from __future__ import annotations

import heapq
import itertools
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import field
from typing import Literal

from atwood.expr import Expression
from atwood.lazy_dataclasses import dataclass
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Space
from atwood.topology.bodies import Bodies, reads_position
from atwood.topology.graph import Joint, MechanismGraph, connected_groups, unit_of
from atwood.topology.orientation_coordinates import Orientation, OrientationCoordinates, coordinates_of


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of the mechanism.

    Attributes
    ----------
    name
        Its path, such as ``rod1.angle``.
    unit
        ``"m"`` or ``"rad"``.
    """

    name: str
    unit: str


@dataclass(frozen=True)
class Attachment:
    """How a body gets its position.

    Attributes
    ----------
    body
        The body.
    joint
        The joint it hangs on; None if it is free, with coordinates of its own.
    node
        The node of the body that the joint, or the coordinates, place.
    parent
        The node on the other side of the joint.
    backwards
        Whether the joint is walked from b to a.
    coordinates
        Numbers of the coordinates that are used, in the forest's list: those of the joint, or of the position.
    speeds
        Numbers of their speeds.
    orientation
        In space: numbers of the coordinates of its orientation, if the body has one of its own.
    spin
        Numbers of the speeds that belong to the orientation.
    turns_with_joint
        In space: whether the joint also gives the orientation.
    """

    body: int
    joint: Joint | None
    node: int
    parent: int
    backwards: bool
    coordinates: tuple[int, ...]
    speeds: tuple[int, ...] = ()
    orientation: tuple[int, ...] = ()
    spin: tuple[int, ...] = ()
    turns_with_joint: bool = False


@dataclass(frozen=True)
class OrientationStep:
    """How a body gets its orientation: from a coordinate, or from another body through a joint that locks.

    Attributes
    ----------
    body
        The body.
    coordinate
        Number of the coordinate; None if it is locked to another body.
    joint
        The joint that locks it.
    parent
        The other body.
    """

    body: int
    coordinate: int | None
    joint: Joint | None = None
    parent: int = 0


@dataclass(frozen=True)
class SpanningForest:
    """How the configuration is computed.

    Attributes
    ----------
    form
        ``"reduced"`` or ``"dae"``.
    coordinates
        The coordinates, in the order in which they are met.
    speeds
        The speeds; as many as coordinates, except of orientations in space.
    orientation_coordinates
        The coordinates that stand for an orientation together.
    attachments
        The bodies, in an order in which they can be placed.
    orientations
        The bodies that have an orientation, in an order in which it can be computed.
    solved
        Constraints, as (part, law, number), that hold whatever the coordinates are.
    loops
        How many independent loops the joints make.
    loop_joints
        Joints that no body hangs on.
    counted
        Numbers of coordinates, and of their speeds, that only count the turns of a joint, by its coordinate's symbol.
    """

    form: Literal["reduced", "dae"]
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Coordinate, ...]
    orientation_coordinates: tuple[OrientationCoordinates, ...]
    attachments: tuple[Attachment, ...]
    orientations: tuple[OrientationStep, ...]
    solved: frozenset[tuple[str, str, int]]
    loops: int
    loop_joints: tuple[Joint, ...]
    counted: Mapping[Expression, tuple[int, int]] = field(default_factory=dict)


def grow_spanning_forest(
    form: Literal["reduced", "dae"],
    graph: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    space: Space,
    orientation: Orientation,
) -> SpanningForest:
    """Decide how every body is placed and turned."""
    grower = _Grower(graph, bodies, locals_, space, orientation)
    joints = [joint for joint in graph.joints if not joint.is_rigid and _between(joint, bodies)]
    if form == "reduced":
        grower.attach_by_joints(joints)
    grower.attach_free()
    locked = grower.turn(joints, use_locks=form == "reduced")
    solved = set(bodies.idle)
    hung = {id(one.joint) for one in grower.attachments if one.joint is not None}
    users: dict[Expression, list[Joint]] = defaultdict(list)  # joints of a part that have a coordinate in common
    for joint in joints:
        for symbol in joint.local.coordinates:
            users[symbol].append(joint)
    for joint in joints:
        local = locals_[joint.part]
        for constraint in local.constraints:
            if constraint.law.name not in joint.local.law.options.solves:
                continue
            by_position = reads_position(local, constraint)
            chosen = hung if by_position else locked
            sharing = [one for symbol in joint.local.coordinates for one in users[symbol]]
            if all(id(one) in chosen for one in (joint, *sharing)):
                solved.add((joint.part, constraint.law.name, constraint.index))
    counted = grower.count_turns(solved)
    pairs = [(bodies.body_of[joint.a], bodies.body_of[joint.b]) for joint in joints]
    numbers = range(len(bodies.bodies))
    loops = len(pairs) - len(numbers) + len(connected_groups(numbers, pairs))
    loop_joints = tuple(joint for joint in joints if id(joint) not in hung) if form == "reduced" else ()
    return SpanningForest(
        form,
        tuple(grower.coordinates),
        tuple(grower.speeds),
        tuple(grower.orientation_coordinates),
        tuple(grower.attachments),
        tuple(grower.orientations),
        frozenset(solved),
        loops,
        loop_joints,
        counted,
    )


def _between(joint: Joint, bodies: Bodies) -> bool:
    return bodies.body_of[joint.a] != bodies.body_of[joint.b]


class _Grower:
    """Collects attachments, orientations and coordinates while a forest grows."""

    def __init__(
        self,
        graph: MechanismGraph,
        bodies: Bodies,
        locals_: Mapping[str, LocalPart],
        space: Space,
        orientation: Orientation,
    ) -> None:
        self.graph, self.bodies, self.locals, self.space = graph, bodies, locals_, space
        self.orientation = orientation
        self.coordinates: list[Coordinate] = []
        self.speeds: list[Coordinate] = []
        self.orientation_coordinates: list[OrientationCoordinates] = []
        self.attachments: list[Attachment] = []
        self.orientations: list[OrientationStep] = []
        self.placed: dict[int, int] = {0: 0}  # body -> depth
        # Coordinates of joints that bodies hang on; joints of one part may share them.
        self.told: dict[Expression, tuple[int, int]] = {}

    def attach_by_joints(self, joints: list[Joint]) -> None:
        """Hang bodies on joints, the cheapest way first."""
        at: dict[int, list[tuple[Joint, bool]]] = {}
        for joint in joints:
            at.setdefault(self.bodies.body_of[joint.a], []).append((joint, False))
            at.setdefault(self.bodies.body_of[joint.b], []).append((joint, True))
        cheapest = {body: min(self._cost(j, body) for j, _ in around) for body, around in at.items()}
        frontier: list[tuple[tuple[int, int, int, int], Joint, bool]] = []  # a heap; ways that became cheaper are twice
        telling: dict[Expression, list[tuple[int, Joint, bool]]] = {}
        numbers = itertools.count()

        def offer(number: int, joint: Joint, backwards: bool) -> None:
            parent, child = self._ends(joint, backwards)
            if child not in self.placed and self._usable(joint):
                cost = self._cost(joint, child)
                if cost <= self._freedom(child):
                    key = cost - cheapest[child], self.placed[parent], number, next(numbers)
                    heapq.heappush(frontier, (key, joint, backwards))

        def reach(body: int) -> None:
            for joint, backwards in at.get(body, ()):
                way = next(numbers), joint, backwards
                for symbol in {*joint.moves, *joint.turns}:
                    telling.setdefault(symbol, []).append(way)
                offer(*way)

        reach(0)
        waiting = (body.index for body in self.bodies.bodies if not body.is_fixed and body.index in at)
        while True:
            while frontier:
                _, joint, backwards = heapq.heappop(frontier)
                _, child = self._ends(joint, backwards)
                if child not in self.placed:
                    told = len(self.told)
                    self._hang(joint, backwards)
                    for symbol in itertools.islice(reversed(self.told), len(self.told) - told):
                        for way in telling.get(symbol, ()):
                            offer(*way)
                    reach(child)
            body = next((body for body in waiting if body not in self.placed), None)
            if body is None:
                return
            self._free(body)
            reach(body)

    def _ends(self, joint: Joint, backwards: bool) -> tuple[int, int]:
        a, b = self.bodies.body_of[joint.a], self.bodies.body_of[joint.b]
        return (b, a) if backwards else (a, b)

    def _usable(self, joint: Joint) -> bool:
        """Return whether a displacement in the axes of a can be computed."""
        if joint.local.placement.axes == "world" or not self.space.has_rotation:
            return True
        body = self.bodies.body_of[joint.a]
        return body == 0 or body in self.bodies.oriented

    def _cost(self, joint: Joint, child: int) -> int:
        """Return how many speeds it takes to hang a body on a joint; in a plane, orientations are counted apart."""
        if not self.space.is_spatial:
            return len(set(joint.moves).difference(self.told))
        own = (
            len({*joint.moves, *joint.turns}.difference(self.told))
            if child in self.bodies.oriented
            else len(joint.moves)
        )
        return own + (3 if child in self.bodies.oriented and not joint.says_rotation else 0)

    def _freedom(self, child: int) -> int:
        """Return how many speeds a free body has, orientations in a plane not counted."""
        dimension = len(self.space.basis)
        return dimension + 3 if self.space.is_spatial and child in self.bodies.oriented else dimension

    def _hang(self, joint: Joint, backwards: bool) -> None:
        parent, child = self._ends(joint, backwards)
        in_space, oriented = self.space.is_spatial, child in self.bodies.oriented
        follows = in_space and oriented and joint.says_rotation and (parent == 0 or parent in self.bodies.oriented)
        numbers = []
        for symbol in joint.local.coordinates if follows else joint.moves:
            if symbol in joint.turns and not in_space:
                continue
            if symbol not in self.told:
                self.told[symbol] = self._coordinate(symbol.name, unit_of(self.locals[joint.part], symbol.name))
            numbers.append(self.told[symbol])
        orientation, spin = self._orientation_coordinates(child) if in_space and oriented and not follows else ((), ())
        node, other = (joint.a, joint.b) if backwards else (joint.b, joint.a)
        coordinates, speeds = tuple(q for q, _ in numbers), tuple(u for _, u in numbers)
        self.attachments.append(
            Attachment(child, joint, node, other, backwards, coordinates, speeds, orientation, spin, follows)
        )
        self.placed[child] = self.placed[parent] + 1

    def _coordinate(self, name: str, unit: str) -> tuple[int, int]:
        """Add a coordinate and its speed; return their numbers."""
        self.coordinates.append(Coordinate(name, unit))
        self.speeds.append(Coordinate(f"{name}'", f"{unit}/s"))
        return len(self.coordinates) - 1, len(self.speeds) - 1

    def _orientation_coordinates(self, index: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Add an orientation and the angular velocity in body axes; return the numbers of coordinates and speeds."""
        body, kind = self.bodies.bodies[index].name, self.orientation.kind
        first, start = len(self.coordinates), len(self.speeds)
        self.coordinates += [Coordinate(name, unit) for name, unit in coordinates_of(kind, body)]
        self.speeds += [Coordinate(f"{body}.spin.{axis}", "rad/s") for axis in "xyz"]
        orientation, spin = tuple(range(first, len(self.coordinates))), tuple(range(start, start + 3))
        self.orientation_coordinates.append(
            OrientationCoordinates(kind, orientation, spin, body, int(body in self.orientation.turned))
        )
        return orientation, spin

    def attach_free(self) -> None:
        """Give every body that is left coordinates of its own."""
        for body in self.bodies.bodies:
            if body.index not in self.placed:
                self._free(body.index)

    def _free(self, index: int) -> None:
        body = self.bodies.bodies[index]
        numbers = [self._coordinate(f"{body.name}.position.{axis}", "m") for axis in self._axis_labels()]
        orientation, spin = (
            self._orientation_coordinates(index)
            if self.space.is_spatial and index in self.bodies.oriented
            else ((), ())
        )
        coordinates, speeds = tuple(q for q, _ in numbers), tuple(u for _, u in numbers)
        self.attachments.append(Attachment(index, None, body.root, 0, False, coordinates, speeds, orientation, spin))
        self.placed[index] = 1

    def _axis_labels(self) -> tuple[str, ...]:
        if self.space.is_line and len(self.space.reported_axes) == 1:
            return ("xyz"[self.space.reported_axes[0]],)
        return self.space.axis_names

    def turn(self, joints: list[Joint], use_locks: bool) -> set[int]:
        """Give orientations to the bodies that need one; return which joints' locks hold by construction."""
        if not self.space.has_rotation:
            return {id(joint) for joint in joints if joint.locks}
        if self.space.is_spatial:
            return {id(one.joint) for one in self.attachments if one.joint is not None and one.turns_with_joint}
        known = {0}
        locked: set[int] = set()
        lock_joints = [joint for joint in joints if joint.locks]

        def spread(wanted: frozenset[int] | None) -> None:
            progress = True
            while progress:
                progress = False
                for joint in lock_joints:
                    a, b = self.bodies.body_of[joint.a], self.bodies.body_of[joint.b]
                    if (a in known) == (b in known):
                        continue
                    child, parent = (b, a) if a in known else (a, b)
                    if wanted is not None and child not in wanted:
                        continue
                    known.add(child)
                    locked.add(id(joint))
                    self.orientations.append(OrientationStep(child, None, joint, parent))
                    progress = True

        oriented = self.bodies.oriented
        if use_locks:
            spread(oriented)
        for index in [one.body for one in self.attachments]:
            if index in oriented and index not in known:
                number, _ = self._coordinate(f"{self.bodies.bodies[index].name}.angle", "rad")
                self.orientations.append(OrientationStep(index, number))
                known.add(index)
                if use_locks:
                    spread(oriented)
        # Bodies that need no orientation still have one for those who ask, where a lock tells it.
        spread(None)
        return locked

    def count_turns(self, solved: set[tuple[str, str, int]]) -> dict[Expression, tuple[int, int]]:
        """Give coordinates to joints whose turns count and that nothing hangs on; add what needs none to solved."""
        counted: dict[Expression, tuple[int, int]] = {}
        wanted = {
            symbol
            for local in self.locals.values()
            if local.borrowed and not local.is_idle(solved)
            for symbol in local.formulas
        }
        wanted.update(symbol for local in self.locals.values() for symbol in local.turns)
        for path, local in self.locals.items():
            for one in local.constraints:
                if one.counts is None:
                    continue
                if one.counts in self.told or one.counts not in wanted:
                    solved.add((path, one.law.name, one.index))
                else:
                    counted[one.counts] = self._coordinate(one.counts.name, unit_of(local, one.counts.name))
        return counted
