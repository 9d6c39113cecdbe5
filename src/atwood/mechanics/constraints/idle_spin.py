"""Spins without inertia: a slender body may turn about its own line, and nothing acts on that.

A slender rod that hangs on balls has no moment of inertia about its axis. If all that touches it does so at points of
that axis, and nothing reads how it is turned, its spin is in no equation. Then it is held: the component of the angular
velocity along the axis is zero. This constraint needs no force, so that all the rest moves as it would without it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Scalar, depends_on, evaluate, is_zero, jacobian, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.inertia import RigidMass, add_masses
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, derivation_of, place_of_largest
from atwood.mechanics.kinematics.motion import Movement
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets
from atwood.model.declare.law import ConstraintOptions, Law
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalPart
from atwood.model.values.rotation import from_axes
from atwood.model.values.vector import Vector, cross, dot, norm

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
    from atwood.mechanics.constraints.shared_spin import Axis, spinning_together  # few scenes have such bodies

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
