"""Spins without inertia: a slender body may turn about its own line, and no law notices.

Held at zero are all combinations of such spins that change nothing of what parts do. The rule is proved in
`docs/decisions.md`, "Spins without inertia".
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.expr import Expression, Scalar, depends_on, evaluate, is_zero, jacobian, live, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.constraints.elimination import solved_with
from atwood.mechanics.constraints.pfaffian import SWITCHING
from atwood.mechanics.dynamics.inertia import RigidMass, add_masses
from atwood.mechanics.kinematics.mechanism import (
    Derivation,
    Mechanism,
    decide,
    derivation_of,
    discrete_states_of,
    place_of_largest,
)
from atwood.mechanics.kinematics.motion import Movement
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets
from atwood.model.declare.laws import ConstraintOptions, Law
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalPart
from atwood.model.values.rotation import FREE, Rotation, as_rotation, from_axes
from atwood.model.values.space import Vector, cross, dot, norm
from atwood.numerics.newton import largest
from atwood.numerics.rank import null_space

IDLE_SPIN = Law(
    "constraint",
    "idle_spin",
    ConstraintOptions(("idle_spin",), "N*m", 1.0, "Torque about its axis, which is zero.", (), ("space",)),
)
"""Holds a spin that has no inertia."""

_NOTHING = 1e-14
"""Relative to the largest moment: a moment of inertia that is rounding."""

_ON_AXIS = 1e-12
"""Relative to the size of the body: how far off its axis a point may be that is on it but for rounding."""

_NONE = 1e-9
"""Relative to the terms that cancel: a change that is rounding."""

_TYPED = 1e-6
"""Directions are typed with as few digits: what they hold by less they do not hold."""

_PLACES = 2
"""Laws are tried at so many random places; one without switches that changes with a spin does so nearly everywhere."""

_Layout = tuple[dict[int, Vector], dict[int, NodeTurn]]
"""Offset and turn of each node of a body, in the axes of the body."""

_How = tuple[int, int]
"""How an axis is computed: two columns of the inertia tensor, which it is square to; or -1 and the node it leads to."""


def idle_speeds(derivation: Derivation, state: Movement) -> dict[Expression, Expression] | None:
    """Return, for each spin that is held, one speed in terms of the others; None if one has no constant coefficient."""
    graph, speeds = derivation.table.graph, list(state.speeds)
    solved: dict[Expression, Expression] = {}
    for index, axis in derivation.idle_spins.items():
        (rate,) = substitute([graph.convert(dot(axis, Vector(*state.kinematics.angular_velocities[index])))], solved)
        slopes = jacobian([rate], speeds)
        even = {c: e for c, e in zip(slopes.columns, slopes.entries, strict=True) if e.is_parametric}
        if not even:
            return None
        columns = sorted(even)
        chosen = columns[decide(derivation, partial(place_of_largest, tuple(even[c] for c in columns)))]
        solved = solved_with(solved, rate, speeds[chosen], even[chosen])
    return solved


def hold_idle_spins(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism in which spins without inertia that no law notices are held at zero."""
    oriented = [index for index in sorted(mechanism.bodies.oriented) if index]
    if not mechanism.space.is_spatial or not oriented:
        return mechanism
    layouts = {body.index: body_offsets(body, mechanism.space) for body in mechanism.bodies.bodies}
    masses = add_masses(mechanism.graph, mechanism.bodies, mechanism.locals_, layouts, mechanism.space).bodies
    masses = {index: masses[index] for index in oriented if index in masses}
    if not masses:
        return mechanism
    derivation = derivation_of(mechanism)
    locals_, axes = dict(mechanism.locals_), dict(mechanism.idle_spins)
    for index, how in decide(derivation, partial(_unnoticed, masses, layouts)):
        path, name = _frame_of(mechanism, index, masses[index])
        turn = layouts[index][1][mechanism.graph.node_of[path, name]]
        axis = axes[index] = _direction(masses[index], layouts[index], how)
        locals_[path] = _held(mechanism, locals_[path], locals_[path].connectors[name], axis, turn)
    return replace(mechanism, locals_=locals_, idle_spins=axes, decisions=tuple(derivation.decided))


@dataclass(frozen=True)
class _Effect:
    """Nodes at which a part acts: those whose orientation counts, and those of which the place alone counts."""

    turning: frozenset[int]
    placing: frozenset[int]


def _effect(mechanism: Mechanism, path: str, local: LocalPart, bodies: Collection[int]) -> _Effect:
    """Return where a part acts on bodies, as its laws depend on their symbols."""
    turning, placing = set(), set()
    on = {name: mechanism.graph.node_of[path, name] for name in local.connectors}
    on = {name: node for name, node in on.items() if mechanism.bodies.body_of[node] in bodies}
    if on:
        read = [one for one in _values(local) if isinstance(one, Expression)]
        twisted = {load.at.name for load in local.loads if not all(is_zero(c) for c in load.torque)}
        twisted |= {one.frame.name for one in local.varying if one in local.body_inertias}
        pulled = {load.at.name for load in local.loads} | {name for name, _ in _spread(local)}
        for name, node in on.items():
            one = local.connectors[name]
            if name in twisted or _depends(read, (*one.orientation, *one.spin)):
                turning.add(node)
            elif name in pulled or _depends(read, (*one.position, *one.velocity)):
                placing.add(node)
    return _Effect(frozenset(turning), frozenset(placing))


def _values(local: LocalPart) -> list[Scalar]:
    """Return all by which a part acts on others, besides inertia and what is rigid."""
    return [
        *local.potentials,
        *local.dissipations,
        *local.lagrangians,
        *(component for load in local.loads for component in load.components),
        *(one.value for one in local.constraints if one.law is not IDLE_SPIN),
        *(one.rate for one in local.states),
    ]


def _spread(local: LocalPart) -> Iterator[tuple[str, LocalConnector]]:
    """Yield the connectors between which a part's mass is spread."""
    for one in local.point_inertias:
        if len(one.points) > 1:
            yield from ((point.name, local.connectors[point.name]) for point in one.points)


def _depends(values: Sequence[Expression], symbols: tuple[Expression, ...]) -> bool:
    return depends_on(values, list(symbols))


@dataclass(frozen=True, eq=False)
class _Line:
    """The line about which a body has no inertia, in the axes of the body.

    Attributes
    ----------
    how
        How its direction is computed.
    direction, point
        Its direction, of size one, and a point of it.
    offsets, turns
        Where nodes of the body are, and the axes of their frames, as columns.
    off
        Nodes that are not on it, among those at which something acts.
    """

    how: _How
    direction: FloatArray
    point: FloatArray
    offsets: Mapping[int, FloatArray]
    turns: Mapping[int, FloatArray]
    off: frozenset[int]


def _unnoticed(
    masses: Mapping[int, RigidMass], layouts: Mapping[int, _Layout], mechanism: Mechanism
) -> tuple[tuple[int, _How], ...]:
    """Return bodies that must not spin so that no spin is left that no law notices, with how their axes are found."""
    known, body_of = mechanism.known_at_start(), mechanism.bodies.body_of
    slender = [body for body, mass in masses.items() if _is_slender(mechanism, mass, layouts[body], known)]
    if not slender:
        return ()
    effects = {path: _effect(mechanism, path, local, slender) for path, local in mechanism.locals_.items()}
    acted: dict[int, set[int]] = {body: set() for body in slender}
    for effect in effects.values():
        for node in effect.turning | effect.placing:
            acted[body_of[node]].add(node)
    found = {body: _line(mechanism, masses[body], layouts[body], sorted(acted[body]), known) for body in slender}
    lines = {body: line for body, line in found.items() if line is not None}
    bodies = list(lines)
    spins = each = np.eye(len(bodies))  # columns: combinations of spins that no law notices
    for path in sorted(effects, key=lambda path: not mechanism.locals_[path].joints):  # hinges tell at once
        off = {body_of[node] for node in effects[path].turning}
        off |= {body for body, line in lines.items() if not line.off.isdisjoint(effects[path].placing)}
        open_ = [i for i, body in enumerate(bodies) if body in off and largest(spins[i]) > _NONE]
        if open_:
            rows = _noticed(mechanism, path, {bodies[i]: lines[bodies[i]] for i in open_}, known) @ each[open_]
            spins = spins @ null_space(rows @ spins, _TYPED * max(largest(rows), 1.0))
    return tuple((body, lines[body].how) for body in _holding_all(bodies, spins))


def _is_slender(mechanism: Mechanism, mass: RigidMass, layout: _Layout, known: Mapping[Expression, float]) -> bool:
    """Return whether a body may have no inertia about a line."""
    *tensor, center = _numbers(mechanism, (*_columns(mass), mass.center), known)
    (total,) = evaluate([mechanism.table.graph.convert(mass.mass)], known)
    if not total > 0.0 or not np.all(np.isfinite(tensor)):
        return False
    moments = np.linalg.eigvalsh(tensor)
    reach = np.linalg.norm(_numbers(mechanism, tuple(layout[0].values()), known) - center, axis=1).max()
    return bool(abs(moments[0]) <= _NOTHING * max(moments[2], total * reach**2))


def _line(
    mechanism: Mechanism, mass: RigidMass, layout: _Layout, acted: Sequence[int], known: Mapping[Expression, float]
) -> _Line | None:
    """Return the line about which a slender body has no inertia; None if there is none.

    A body all of whose mass is at one point has any line through it: that to the farthest node at which something acts.
    """
    *tensor, center = _numbers(mechanism, (*_columns(mass), mass.center), known)
    (total,) = evaluate([mechanism.table.graph.convert(mass.mass)], known)
    offsets = dict(zip(layout[0], _numbers(mechanism, tuple(layout[0].values()), known), strict=True))
    lengths = [float(np.linalg.norm(offsets[node] - center)) for node in acted]
    size = max(lengths, default=0.0)
    how: _How
    if largest(np.array(tensor)) <= _NOTHING * total * size**2:
        if not size > 0.0:
            return None
        how = (-1, acted[int(np.argmax(lengths))])
        direction = (offsets[how[1]] - center) / size
    else:
        moments, directions = np.linalg.eigh(tensor)
        if not (abs(moments[0]) <= _NOTHING * moments[2] and moments[1] > _NOTHING * moments[2]):
            return None
        direction = directions[:, 0]
        pairs = [(i, j) for i in range(3) for j in range(i)]
        how = max(pairs, key=lambda pair: float(np.linalg.norm(np.cross(tensor[pair[0]], tensor[pair[1]]))))
    far = np.linalg.norm(np.cross(direction, np.reshape([offsets[node] - center for node in acted], (-1, 3))), axis=1)
    off = {node for node, distance in zip(acted, far, strict=True) if distance > _ON_AXIS * size}
    turns = {node: _numbers(mechanism, turn, known).T for node, turn in layout[1].items() if isinstance(turn, tuple)}
    return _Line(how, direction, center, offsets, turns, frozenset(off))


def _columns(mass: RigidMass) -> tuple[Vector, Vector, Vector]:
    assert isinstance(mass.moment, tuple)
    return mass.moment


def _numbers(mechanism: Mechanism, vectors: Sequence[Vector], known: Mapping[Expression, float]) -> FloatArray:
    """Return vectors as the rows of a matrix."""
    components = [mechanism.table.graph.convert(component) for vector in vectors for component in vector]
    return np.reshape(evaluate(components, known), (-1, 3))


def _direction(mass: RigidMass, layout: _Layout, how: _How) -> Vector:
    """Return the axis, in the axes of the body; its size is one."""
    columns = _columns(mass)
    first, second = how
    if first < 0:
        arm = layout[0][second] - mass.center
    else:
        along = [i for i, column in enumerate(columns) if all(is_zero(component) for component in column)]
        if along:
            return Vector(*(1.0 if i == along[0] else 0.0 for i in range(3)))
        arm = cross(columns[first], columns[second])
    size = norm(arm)
    return Vector(arm.x / size, arm.y / size, arm.z / size)


def _frame_of(mechanism: Mechanism, index: int, mass: RigidMass) -> tuple[str, str]:
    """Return a part of a body and its frame there: the first with inertia, if it has a frame."""

    def frames() -> Iterator[tuple[str, str]]:
        for path in (*mass.parts, *mechanism.locals_):
            local = mechanism.locals_[path]
            for name, one in local.connectors.items():
                if one.axes is not None and mechanism.bodies.body_of[mechanism.graph.node_of[path, name]] == index:
                    yield path, name

    return next(frames())


def _held(mechanism: Mechanism, local: LocalPart, connector: LocalConnector, axis: Vector, turn: NodeTurn) -> LocalPart:
    """Return a part that holds the spin of its body about an axis, which is given in the axes of the body."""
    assert connector.axes is not None
    assert connector.angular_velocity is not None
    assert isinstance(turn, tuple)
    own = Vector(*(dot(one, axis) for one in turn))  # in the axes of the frame
    rate = dot(connector.angular_velocity, from_axes(connector.axes, own))
    value = mechanism.table.graph.convert(rate)
    held = LocalConstraint(IDLE_SPIN, 0, value, "idle_spin", 1.0)
    return replace(local, constraints=(*local.constraints, held))


def _holding_all(bodies: Sequence[int], ways: FloatArray) -> list[int]:
    """Return as many bodies as there are ways to spin together, whose spins determine the others."""
    chosen: list[int] = []
    rest = ways.copy()
    for _ in range(ways.shape[1]):
        largest = int(np.argmax(np.linalg.norm(rest, axis=1) > 0.5 * np.linalg.norm(rest, axis=1).max()))
        row = rest[largest] / np.linalg.norm(rest[largest])
        chosen.append(bodies[largest])
        rest = rest - np.outer(rest @ row, row)
    return sorted(chosen)


def _noticed(
    mechanism: Mechanism, path: str, lines: Mapping[int, _Line], known: Mapping[Expression, float]
) -> FloatArray:
    """Return rows, a column a body, that are zero for combinations of spins that a part does not notice."""
    local = mechanism.locals_[path]
    each, bodies = np.eye(len(lines)), list(lines)
    across = _across_hinge(mechanism, path, local, lines, known)
    is_across = np.array([body in across for body in bodies])
    along = {body: line for body, line in lines.items() if body not in across}
    if along:
        try:
            rows = _changes(mechanism, path, local, along, known)
        except (AtwoodError, KeyError, ArithmeticError):  # it reads what has no number yet
            return each
        return np.vstack([each[is_across], rows @ each[~is_across]])
    return each


def _across_hinge(
    mechanism: Mechanism, path: str, local: LocalPart, lines: Mapping[int, _Line], known: Mapping[Expression, float]
) -> set[int]:
    """Return bodies that a hinge across their line keeps from spinning, whatever its other body does."""
    node_of, body_of, graph = mechanism.graph.node_of, mechanism.bodies.body_of, mechanism.table.graph
    found: set[int] = set()
    for joint in local.joints:
        rotation = joint.placement.rotation
        if isinstance(rotation, Rotation) and len(rotation.turns) == 1:
            hinge = np.array(evaluate([graph.convert(c) for c in rotation.turns[0].axis], known))
            for name in (joint.law.options.a, joint.law.options.b):
                node = node_of.get((path, name), -1)  # the world is none
                line = lines.get(body_of[node]) if node >= 0 else None
                if line is not None:
                    off = np.cross(line.turns[node] @ hinge, line.direction)
                    found |= {body_of[node]} if np.linalg.norm(off) > _TYPED * np.linalg.norm(hinge) else set()
    return found


def _changes(
    mechanism: Mechanism, path: str, local: LocalPart, lines: Mapping[int, _Line], known: Mapping[Expression, float]
) -> FloatArray:
    """Return by how much all that a part does changes with each spin, at some places, relative to its terms.

    A load does what its force and its moment about a point of the line do. Both must stay as they are where the body
    has turned and where it turns, and there must be no moment about the line. Which branch a law takes may change with
    the place, so what it chooses between, and by, is looked at as well.
    """
    if any(source == path for source, _ in mechanism.links.values()) or local.lagrangians or local.varying:
        raise ArithmeticError  # what it passes on may be anything
    graph, bodies = mechanism.table.graph, list(lines)
    loads = [(load, Vector(*(graph.symbol(f"line:{path}.{load.at.name}.{c}") for c in "xyz"))) for load in local.loads]
    moments = [
        cross(Vector(*local.connectors[load.at.name].position) - line, load.force) + load.torque for load, line in loads
    ]
    positions = [symbol for _, one in _spread(local) for symbol in one.position]
    given = [graph.convert(one) for one in (*_values(local), *positions, *(c for one in moments for c in one))]
    acting = [one for one in given if not one.is_parametric]
    chosen = [one for node in live(acting) if node.operation in SWITCHING for one in node.arguments]
    values = [*acting, *(one for one in chosen if not one.is_parametric)]
    symbols = [symbol for one in local.connectors.values() for symbol in _symbols(one)]
    found = jacobian(values, symbols)
    slopes = np.zeros((len(values), len(symbols)))
    rows = [np.zeros((0, len(bodies)))]
    for place in _places(mechanism, path, local, lines, known):
        numbers = dict(place.numbers)
        for load, line in loads:
            numbers |= dict(zip(line, place.points[load.at.name].tolist(), strict=True))
        slopes[list(found.rows), list(found.columns)] = evaluate(found.entries, numbers)
        if not np.all(np.isfinite(slopes[: len(acting)])):
            raise ArithmeticError  # a law without a value there says nothing
        for is_rate in (False, True):
            moved = np.array([place.moved(local, body, is_rate) for body in bodies]).T  # (symbols, bodies)
            sizes = np.abs(slopes) @ np.array(place.sizes(local))
            rows.append(_counting(slopes @ moved, sizes))
        for (load, _), moment in zip(loads, moments, strict=True):
            size = float(np.linalg.norm(evaluate([graph.convert(c) for c in load.components], numbers)))
            torque = np.array(evaluate([graph.convert(c) for c in moment], numbers))
            power = [torque @ place.spin(load.at.name, body) for body in bodies]
            rows.append(_counting(np.array([power]), np.array([size])))
    return np.vstack(rows)


def _counting(rows: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the rows that are more than rounding, in units of their sizes."""
    counts = np.any(np.abs(rows) > _NONE * sizes[:, None], axis=1)
    return np.asarray(rows[counts] / sizes[counts, None])


def _symbols(one: LocalConnector) -> tuple[Expression, ...]:
    return (*one.position, *one.orientation, *one.velocity, *one.spin)


@dataclass(frozen=True, eq=False)
class _Place:
    """Where the connectors of a part are and how they move, in numbers.

    Attributes
    ----------
    numbers
        The values of all symbols of its laws.
    lines
        For each connector on a body that may spin: the body, and in the world the axis and the arm from it.
    points, turning
        In the world, for each connector: the point of its line, and its angular velocity.
    size
        A length, m.
    """

    numbers: Mapping[Expression, float]
    lines: Mapping[str, tuple[int, FloatArray, FloatArray]]
    points: Mapping[str, FloatArray]
    turning: Mapping[str, FloatArray]
    size: float

    def spin(self, name: str, body: int) -> FloatArray:
        """Return the angular velocity of a connector when a body spins by one radian a second."""
        return self.lines[name][1] if name in self.lines and self.lines[name][0] == body else np.zeros(3)

    def sizes(self, local: LocalPart) -> list[float]:
        """Return how large a change of each symbol of all connectors would be ordinary."""
        found: list[float] = []
        for one in local.connectors.values():
            found += [self.size] * 3 + [1.0] * len(one.orientation) + [self.size] * 3 + [1.0] * len(one.spin)
        return found

    def moved(self, local: LocalPart, body: int, is_rate: bool) -> list[float]:
        """Return how the symbols of all connectors change when a body has spun on, or when it begins to spin."""
        found: list[float] = []
        for name, one in local.connectors.items():
            spin = self.spin(name, body)
            arm = np.cross(spin, self.lines[name][2]) if name in self.lines else np.zeros(3)
            axes = [np.array([self.numbers[c] for c in axis]) for axis in one.axes or ()]
            turned = [float(c) for axis in axes for c in np.cross(spin, axis)]
            if is_rate:
                found += [0.0] * (3 + len(turned)) + arm.tolist() + spin.tolist()[: len(one.spin)]
            else:
                found += [*arm.tolist(), *turned, *np.cross(self.turning[name], arm).tolist()] + [0.0] * len(one.spin)
        return found


def _places(
    mechanism: Mechanism, path: str, local: LocalPart, lines: Mapping[int, _Line], known: Mapping[Expression, float]
) -> Iterator[_Place]:
    """Yield places of a part at random times, at random but as its joints allow."""
    chance = np.random.default_rng(1)
    size = (
        max((float(np.linalg.norm(arm)) for one in lines.values() for arm in one.offsets.values()), default=0.0) or 1.0
    )
    coordinates = [symbol for joint in local.joints for symbol in joint.coordinates]
    for number in range(_PLACES):
        positions = {name: size * chance.normal(size=3) for name in local.connectors}
        frames = {name: np.linalg.qr(chance.normal(size=(3, 3)))[0] for name in local.connectors}
        frames = {name: one * np.sign(np.linalg.det(one)) for name, one in frames.items()}
        turning = {name: chance.normal(size=3) for name in local.connectors}
        numbers = {**known, mechanism.time: chance.normal()}
        numbers |= {one.symbol: float(number % 2) for one in mechanism.relations.found}
        numbers |= {one.symbol: chance.normal() for one in discrete_states_of(mechanism)}
        numbers |= dict(zip(coordinates, (size * chance.normal(size=len(coordinates))).tolist(), strict=True))
        _join(local, positions, frames, numbers)
        at: dict[str, tuple[int, FloatArray, FloatArray]] = {}
        for name, one in local.connectors.items():
            numbers |= dict(zip(one.position, positions[name].tolist(), strict=True))
            numbers |= dict(zip(one.velocity, (size * chance.normal(size=3)).tolist(), strict=True))
            numbers |= dict(zip(one.orientation, frames[name].T.ravel().tolist(), strict=one.axes is not None))
            numbers |= dict(zip(one.spin, turning[name].tolist(), strict=one.axes is not None))
            node = mechanism.graph.node_of[path, name]
            line = lines.get(mechanism.bodies.body_of[node])
            if line is not None:  # where only a point is on the body, it may be turned in any way
                to_world = frames[name] @ line.turns[node].T if one.axes is not None else frames[name]
                arm = to_world @ (line.offsets[node] - line.point)
                at[name] = mechanism.bodies.body_of[node], to_world @ line.direction, arm
        points = {name: positions[name] - (at[name][2] if name in at else 0.0) for name in positions}
        yield _Place(numbers, at, points, turning, size)


def _join(
    local: LocalPart,
    positions: dict[str, FloatArray],
    frames: dict[str, FloatArray],
    known: Mapping[Expression, float],
) -> None:
    """Put the ends of joints where these have them; the columns of a frame are its axes in the world."""
    graph = next(iter(local.connectors.values())).position[0].graph
    for joint in local.joints:
        a, b, placement = joint.law.options.a, joint.law.options.b, joint.placement
        if a not in positions or b not in positions:
            continue  # the world's own
        shift = np.array(evaluate([graph.convert(c) for c in placement.displacement], known))
        positions[b] = positions[a] + (frames[a] @ shift if placement.axes == "a" else shift)
        if placement.rotation is not None and placement.rotation is not FREE:
            turned = as_rotation(placement.rotation).axes()
            columns = [evaluate([graph.convert(c) for c in axis], known) for axis in turned]
            frames[b] = frames[a] @ np.array(columns).T
