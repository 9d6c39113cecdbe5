"""Spins without inertia that joints leave free: of a slender body along its guide, or of the two halves of a leg.

A bar that slides along itself in a cylindrical joint, or turns about itself in a hinge, is turned by nothing, though
the laws of the joint read how it is turned. They do not change when it spins, which is tried in numbers, where the
joint puts its ends. Bodies that a slide keeps from turning against each other can only spin together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.expr import Expression, evaluate, jacobian
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.constraints.spin_places import Place, places_of
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import Rotation
from atwood.numerics.rank import null_space

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
    return _held(bodies, ways)


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


def _held(bodies: Sequence[int], ways: FloatArray) -> list[int]:
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
