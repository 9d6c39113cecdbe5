"""Spins without inertia: a slender body may turn about its own line, and no law notices.

Such a spin is held: the component of the angular velocity along the line is zero. This constraint needs no force, so
that all the rest moves as it would without it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.expr import Expression, Scalar, depends_on, evaluate, is_zero, jacobian, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.inertia import RigidMass, add_masses
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, derivation_of, place_of_largest
from atwood.mechanics.kinematics.motion import Movement
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets
from atwood.model.declare.laws import ConstraintOptions, Law
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalPart
from atwood.model.values.rotation import FREE, Rotation, as_rotation, from_axes
from atwood.model.values.space import Vector, cross, dot, norm
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


_Layouts = Mapping[int, tuple[dict[int, Vector], dict[int, NodeTurn]]]
"""Offset and turn of each node of each body, in the axes of the body."""


@dataclass(frozen=True)
class _Slender:
    """A body whose spin may be without inertia.

    Attributes
    ----------
    mass
        Its inertia.
    touched
        Nodes at which something acts, with their offsets in the axes of the body.
    """

    mass: RigidMass
    touched: tuple[tuple[int, Vector], ...]


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
        speed = speeds[chosen]
        value = -substitute([rate], {speed: graph.zero})[0] / even[chosen]
        solved = dict(zip(solved, substitute(list(solved.values()), {speed: value}), strict=True))
        solved[speed] = value
    return solved


def hold_idle_spins(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism in which spins without inertia, on which nothing acts, are held."""
    if not mechanism.space.is_spatial:
        return mechanism
    oriented = [index for index in sorted(mechanism.bodies.oriented) if index]
    if not oriented:
        return mechanism
    derivation = derivation_of(mechanism)
    layouts = {body.index: body_offsets(body, mechanism.space) for body in mechanism.bodies.bodies}
    masses = add_masses(mechanism.graph, mechanism.bodies, mechanism.locals_, layouts, mechanism.space).bodies
    held: dict[int, tuple[_Slender, _How]] = {}
    for index, nodes in _free_to_spin(mechanism).items():
        if index in masses:
            slender = _Slender(masses[index], tuple((node, layouts[index][0][node]) for node in nodes))
            how = decide(derivation, partial(_axis, slender))
            if how is not None:
                held[index] = slender, how
    others = {index: _Slender(masses[index], ()) for index in oriented if index in masses and index not in held}
    if others:
        shared = decide(derivation, partial(_sharing, others, layouts))
        held |= {index: (others[index], how) for index, how in shared}
    locals_, axes = dict(mechanism.locals_), dict(mechanism.idle_spins)
    for index, (slender, how) in held.items():
        path, name = _frame_of(mechanism, index, slender.mass)
        turn = layouts[index][1][mechanism.graph.node_of[path, name]]
        axis = axes[index] = _direction(slender, how)
        locals_[path] = _held(mechanism, locals_[path], locals_[path].connectors[name], axis, turn)
    if not held and not derivation.decided:
        return mechanism
    return replace(mechanism, locals_=locals_, idle_spins=axes, decisions=tuple(derivation.decided))


def _sharing(slender: Mapping[int, _Slender], layouts: _Layouts, mechanism: Mechanism) -> tuple[tuple[int, _How], ...]:
    """Return bodies whose spin is to be held though joints read how they are turned, with how their axes are found."""
    hows = {index: _axis(one, mechanism) for index, one in slender.items()}
    found = {index: how for index, how in hows.items() if how is not None}
    if not found:
        return ()

    known, axes = mechanism.known_at_start(), {}
    for index, how in found.items():
        one = slender[index]
        offsets, turns = layouts[index]
        axes[index] = Axis(
            _numbers(mechanism, _direction(one, how), known),
            _numbers(mechanism, one.mass.center, known),
            {node: _numbers(mechanism, offset, known) for node, offset in offsets.items()},
            {node: _matrix(mechanism, turn, known) for node, turn in turns.items()},
        )
    return tuple((index, found[index]) for index in spinning_together(mechanism, axes, known))


def _matrix(mechanism: Mechanism, turn: NodeTurn, known: Mapping[Expression, float]) -> FloatArray:
    """Return the axes of a frame as the columns of a matrix."""
    assert isinstance(turn, tuple)
    return np.array([_numbers(mechanism, axis, known) for axis in turn]).T


def _free_to_spin(mechanism: Mechanism) -> dict[int, list[int]]:
    """Return bodies whose orientation no law reads and on which no torque acts, with the nodes where something acts."""
    node_of, body_of = mechanism.graph.node_of, mechanism.bodies.body_of
    free: dict[int, list[int]] = {index: [] for index in sorted(mechanism.bodies.oriented) if index}
    for path, local in mechanism.locals_.items():
        nodes = {name: node_of[path, name] for name in local.connectors}
        if not any(body_of[node] in free for node in nodes.values()):
            continue
        for body in (one for one in local.varying if one in local.body_inertias):
            free.pop(body_of[nodes[body.frame.name]], None)
        read = _read(local)
        twisted = {load.at.name for load in local.loads if not all(is_zero(c) for c in load.torque)}
        acted = {load.at.name for load in local.loads}
        acted |= {p.name for one in local.point_inertias if len(one.points) > 1 for p in one.points}
        for name, node in nodes.items():
            one = local.connectors[name]
            index = body_of[node]
            if index not in free:
                continue
            if name in twisted or _depends(read, (*one.orientation, *one.spin)):
                del free[index]
            elif name in acted or _depends(read, (*one.position, *one.velocity)):
                free[index].append(node)
    return free


def _read(local: LocalPart) -> list[Expression]:
    """Return all that acts in a part, besides inertia and what is rigid."""
    found: list[Scalar] = [*local.potentials, *local.dissipations, *local.lagrangians]
    found += [component for load in local.loads for component in (*load.force, *load.torque)]
    found += [one.value for one in local.constraints if one.law is not IDLE_SPIN]
    return [one for one in found if isinstance(one, Expression)]


def _depends(values: list[Expression], symbols: tuple[Expression, ...]) -> bool:
    return any(depends_on(value, list(symbols)) for value in values)


_How = tuple[int, int]
"""Two columns of the inertia tensor whose cross product is along the axis; or -1 and the number of a touched node."""


def _axis(slender: _Slender, mechanism: Mechanism) -> _How | None:
    """Return how the line of a body is found about which it has no inertia; None if there is none.

    A body all of whose mass is at one point has any line through it.
    """
    known = mechanism.known_at_start()
    tensor = np.array([_numbers(mechanism, column, known) for column in _columns(slender.mass)])
    center = _numbers(mechanism, slender.mass.center, known)
    (mass,) = evaluate([mechanism.table.graph.convert(slender.mass.mass)], known)
    arms = [_numbers(mechanism, offset, known) - center for _, offset in slender.touched]
    lengths = [float(np.linalg.norm(arm)) for arm in arms]
    size = max(lengths, default=0.0)
    largest = float(np.max(np.abs(tensor), initial=0.0))
    if not mass > 0.0 or not np.all(np.isfinite(tensor)):
        return None
    how: _How
    if largest <= _NOTHING * mass * size**2:
        if not size > 0.0:
            return None
        how = (-1, int(np.argmax(lengths)))
        axis = arms[how[1]] / size
    else:
        moments, directions = np.linalg.eigh(tensor)
        if not (abs(moments[0]) <= _NOTHING * moments[2] and moments[1] > _NOTHING * moments[2]):
            return None
        axis = directions[:, 0]
        pairs = [(i, j) for i in range(3) for j in range(i)]
        how = max(pairs, key=lambda pair: float(np.linalg.norm(np.cross(tensor[pair[0]], tensor[pair[1]]))))
    off = max((float(np.linalg.norm(np.cross(axis, arm))) for arm in arms), default=0.0)
    return how if off <= _ON_AXIS * size else None


def _columns(mass: RigidMass) -> tuple[Vector, Vector, Vector]:
    assert isinstance(mass.moment, tuple)
    return mass.moment


def _numbers(mechanism: Mechanism, vector: Vector, known: Mapping[Expression, float]) -> FloatArray:
    return np.array(evaluate([mechanism.table.graph.convert(component) for component in vector], known))


def _direction(slender: _Slender, how: _How) -> Vector:
    """Return the axis, in the axes of the body; its size is one."""
    columns = _columns(slender.mass)
    first, second = how
    if first < 0:
        arm = slender.touched[second][1] - slender.mass.center
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


_NONE = 1e-9
"""Relative to the terms that cancel: a change that is rounding."""

_TYPED = 1e-6
"""Directions are typed with as few digits: what they hold by less they do not hold."""

_PLACES = 2
"""At so many places at random laws are asked; a law that changes with a spin does so nearly everywhere."""


@dataclass(frozen=True, eq=False)
class Axis:
    """The line about which a body has no inertia, in the axes of the body.

    Attributes
    ----------
    direction, point
        Its direction, of size one, and a point of it.
    offsets, turns
        Where nodes of the body are, and the axes of their frames.
    """

    direction: FloatArray
    point: FloatArray
    offsets: Mapping[int, FloatArray]
    turns: Mapping[int, FloatArray]


def spinning_together(mechanism: Mechanism, axes: Mapping[int, Axis], known: Mapping[Expression, float]) -> list[int]:
    """Return bodies whose spins are to be held, so that no spin without inertia is left free."""
    crossed = _across_hinges(mechanism, axes, known)
    axes = {body: one for body, one in axes.items() if body not in crossed}
    bodies = sorted(axes)
    ways = np.eye(len(bodies))  # columns: spins of the bodies that no law notices
    node_of, body_of = mechanism.graph.node_of, mechanism.bodies.body_of
    for path, local in mechanism.locals_.items():
        on = {name: body_of[node_of[path, name]] for name in local.connectors}
        touched = {body for body in on.values() if body in axes}
        if not ways.shape[1]:
            break
        if not touched:
            continue
        rows = _noticed(mechanism, path, local, axes, bodies, known)
        ways = _left(ways, rows if rows is not None else _each(bodies, touched))
    return _holding_all(bodies, ways)


def _across_hinges(mechanism: Mechanism, axes: Mapping[int, Axis], known: Mapping[Expression, float]) -> set[int]:
    """Return bodies that a hinge across their axis keeps from spinning, whatever its other body does."""
    node_of, body_of = mechanism.graph.node_of, mechanism.bodies.body_of
    found: set[int] = set()
    for path, local in mechanism.locals_.items():
        for joint in local.joints:
            rotation = joint.placement.rotation
            names = (joint.law.options.a, joint.law.options.b)
            ends = [node_of[path, name] for name in names if name in local.connectors]  # the world is none
            if not isinstance(rotation, Rotation) or len(rotation.turns) != 1:
                continue
            open_ends = [node for node in ends if body_of[node] in axes and body_of[node] not in found]
            if not open_ends:
                continue
            graph = mechanism.table.graph
            hinge = np.array(evaluate([graph.convert(c) for c in rotation.turns[0].axis], known))
            for node in open_ends:
                one = axes[body_of[node]]
                across = np.cross(one.turns[node] @ hinge, one.direction)
                if np.linalg.norm(across) > _TYPED * np.linalg.norm(hinge):
                    found.add(body_of[node])
    return found


def _each(bodies: Sequence[int], touched: set[int]) -> FloatArray:
    """Return the rows of a part that notices each spin by itself."""
    return np.array([[float(body == one) for body in bodies] for one in sorted(touched)])


def _left(ways: FloatArray, rows: FloatArray) -> FloatArray:
    """Return a basis of the ways in which rows are zero."""
    return np.asarray(ways @ null_space(rows @ ways, _TYPED * float(np.abs(rows).max(initial=1.0))))


def _holding_all(bodies: Sequence[int], ways: FloatArray) -> list[int]:
    """Return as many bodies as there are ways to spin, whose spins determine the others."""
    chosen: list[int] = []
    rest = ways.copy()
    for _ in range(ways.shape[1]):
        largest = int(np.argmax(np.linalg.norm(rest, axis=1) > 0.5 * np.linalg.norm(rest, axis=1).max()))
        row = rest[largest] / np.linalg.norm(rest[largest])
        chosen.append(bodies[largest])
        rest = rest - np.outer(rest @ row, row)
    return sorted(chosen)


def _noticed(
    mechanism: Mechanism,
    path: str,
    local: LocalPart,
    axes: Mapping[int, Axis],
    bodies: Sequence[int],
    known: Mapping[Expression, float],
) -> FloatArray | None:
    """Return rows that are zero for spins that a part does not notice; None if that cannot be told."""
    if any(source == path for source, _ in mechanism.links.values()) or local.lagrangians or local.varying:
        return None
    loads = [one for load in local.loads for one in (*load.force, *load.torque)]
    given = [*local.potentials, *local.dissipations, *loads, *(one.value for one in local.constraints)]
    values = [one for one in given if isinstance(one, Expression) and not one.is_parametric]
    rows: list[FloatArray] = []
    for place in places_of(mechanism, path, local, axes, known, _PLACES):
        try:
            rows += [*_changes(local, values, place, bodies), *_powers(local, place, bodies)]
        except (AtwoodError, KeyError, ArithmeticError):  # it reads what this knows nothing of
            return None
    return np.array(rows) if rows else np.zeros((0, len(bodies)))


def _changes(
    local: LocalPart, values: Sequence[Expression], place: Place, bodies: Sequence[int]
) -> Iterator[FloatArray]:
    """Yield by how much each value changes with each body's spin, as an angle and as a rate, relative to its terms."""
    ends = local.connectors.values()
    symbols = [symbol for one in ends for symbol in (*one.position, *one.orientation, *one.velocity, *one.spin)]
    found = jacobian(list(values), symbols)
    slopes = np.zeros((len(values), len(symbols)))
    slopes[list(found.rows), list(found.columns)] = evaluate(found.entries, place.numbers)
    if not np.all(np.isfinite(slopes)):
        raise ArithmeticError  # a law without a value there says nothing
    sizes = np.abs(slopes) @ place.sizes(local)
    for is_rate in (False, True):
        moves = np.array([place.moves(local, body, is_rate) for body in bodies]).T  # (symbols, bodies)
        for row, size in zip(slopes @ moves, sizes, strict=True):
            if np.any(np.abs(row) > _NONE * size):
                yield row / size


def _powers(local: LocalPart, place: Place, bodies: Sequence[int]) -> Iterator[FloatArray]:
    """Yield the power of loads in each body's spin, and how it moves masses that are spread between nodes."""
    zero = next(iter(place.numbers)).graph.zero
    for load in local.loads:
        row = np.zeros(len(bodies))
        size = 0.0
        for i, body in enumerate(bodies):
            velocity, spin = place.motion(load.at.name, body)
            parts = [*load.force, *load.torque]
            numbers = np.array(evaluate([zero.graph.convert(one) for one in parts], place.numbers))
            row[i] = numbers @ np.concatenate([velocity, spin])
            size = max(size, float(np.linalg.norm(numbers)))
        if np.any(np.abs(row) > _NONE * size):
            yield row / size
    for one in local.point_inertias:
        for point in one.points if len(one.points) > 1 else ():
            moved = np.array([place.motion(point.name, body)[0] for body in bodies]).T
            yield from (row for row in moved if np.any(np.abs(row) > _NONE * place.size))


@dataclass(frozen=True, eq=False)
class Place:
    """Where the connectors of a part are and how they move, in numbers.

    Attributes
    ----------
    numbers
        The values of all symbols of its laws.
    lines
        For each connector on a body that may spin: the body, the axis in the world, and the arm from it in the world.
    size
        A length, m.
    """

    numbers: Mapping[Expression, float]
    lines: Mapping[str, tuple[int, FloatArray, FloatArray]]
    size: float

    def motion(self, name: str, body: int) -> tuple[FloatArray, FloatArray]:
        """Return velocity and angular velocity of a connector when a body spins by one radian a second."""
        own, axis, arm = self.lines.get(name, (-1, np.zeros(3), np.zeros(3)))
        return (np.cross(axis, arm), axis) if own == body else (np.zeros(3), np.zeros(3))

    def sizes(self, local: LocalPart) -> list[float]:
        """Return how large a change of each symbol of all connectors would be ordinary."""
        found: list[float] = []
        for one in local.connectors.values():
            found += [self.size] * 3 + [1.0] * len(one.orientation) + [self.size] * 3 + [1.0] * len(one.spin)
        return found

    def moves(self, local: LocalPart, body: int, is_rate: bool) -> list[float]:
        """Return how the symbols of all connectors change when a body spins: places alone, or rates alone."""
        found: list[float] = []
        for name, one in local.connectors.items():
            velocity, spin = self.motion(name, body)
            axes = [np.array([self.numbers[c] for c in axis]) for axis in one.axes or ()]
            turned = [float(c) for axis in axes for c in np.cross(spin, axis)]
            places = [*velocity.tolist(), *turned]
            rates = [*velocity.tolist(), *spin.tolist()[: len(one.spin)]]
            found += [0.0] * len(places) + rates if is_rate else places + [0.0] * len(rates)
        return found


def places_of(
    mechanism: Mechanism,
    path: str,
    local: LocalPart,
    axes: Mapping[int, Axis],
    known: Mapping[Expression, float],
    count: int,
) -> Iterator[Place]:
    """Yield places of a part, at random but as its joints allow."""
    chance = np.random.default_rng(1)
    size = (
        max((float(np.linalg.norm(arm)) for one in axes.values() for arm in one.offsets.values()), default=1.0) or 1.0
    )
    for _ in range(count):
        positions = {name: size * chance.normal(size=3) for name in local.connectors}
        frames = {name: np.linalg.qr(chance.normal(size=(3, 3)))[0] for name in local.connectors}
        frames = {name: one * np.sign(np.linalg.det(one)) for name, one in frames.items()}
        _join(local, positions, frames, {**known, **_coordinates(local, chance, size)})
        numbers = dict(known)
        for name, one in local.connectors.items():
            numbers |= dict(zip(one.position, positions[name].tolist(), strict=True))
            numbers |= dict(zip(one.velocity, (size * chance.normal(size=3)).tolist(), strict=True))
            numbers |= dict(zip(one.orientation, frames[name].T.ravel().tolist(), strict=one.axes is not None))
            numbers |= dict(zip(one.spin, chance.normal(size=len(one.spin)).tolist(), strict=True))
        yield Place(numbers, _lines(mechanism, path, local, axes, frames), size)


def _coordinates(local: LocalPart, chance: np.random.Generator, size: float) -> dict[Expression, float]:
    symbols = [symbol for joint in local.joints for symbol in joint.coordinates]
    return dict(zip(symbols, (size * chance.normal(size=len(symbols))).tolist(), strict=True))


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


def _lines(
    mechanism: Mechanism, path: str, local: LocalPart, axes: Mapping[int, Axis], frames: Mapping[str, FloatArray]
) -> dict[str, tuple[int, FloatArray, FloatArray]]:
    node_of, body_of = mechanism.graph.node_of, mechanism.bodies.body_of
    found = {}
    for name, connector in local.connectors.items():
        node = node_of[path, name]
        body = body_of[node]
        if body not in axes:
            continue
        one = axes[body]
        # Where only a point is on the body, it may be turned in any way.
        to_world = frames[name] @ one.turns[node].T if connector.axes is not None else frames[name]
        found[name] = body, to_world @ one.direction, to_world @ (one.offsets[node] - one.point)
    return found
