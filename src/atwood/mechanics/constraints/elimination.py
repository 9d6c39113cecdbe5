"""Constraints on positions that are linear are eliminated, and those that nothing can change are checked.

In a plane, two locks between the same two bodies hold them alike if the angles at which their frames are mounted differ
by a whole turn: 200 degrees on one side and -160 degrees on the other are one direction. Angles in a plane are numbers,
though, and would contradict each other; so whole turns are taken off first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.rounding import ROUGHNESS, RoughProgram, roughly
from atwood.errors import TopologyError
from atwood.expr import Expression, affine_coefficients, depends_on, evaluate, live, substitute
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.constraints.values import Values
from atwood.mechanics.dynamics.inertia import Masses
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, extent
from atwood.model.local.parts import LocalConstraint, LocalPart
from atwood.tolerances import tolerances
from atwood.topology.spanning_forest import SpanningForest


def check_held(
    mechanism: Mechanism,
    masses: Masses,
    forest: SpanningForest,
    q: Sequence[Expression],
    values: Values,
    on_velocities: Sequence[tuple[str, LocalConstraint]],
) -> None:
    """Refuse a body that has no mass and that no joint or constraint holds."""
    weightless = _weightless(mechanism, masses, forest)
    pulled = {
        mechanism.bodies.body_of[mechanism.graph.node_of[path, name]]
        for path, local in mechanism.locals_.items()
        if local.potentials or local.dissipations or _reacts(local)
        for name in local.connectors
    }
    for one in forest.attachments:
        if one.joint is not None or not weightless.issuperset(one.coordinates):
            continue
        own = [q[number] for number in one.coordinates]
        if one.body in pulled:
            continue
        if not on_velocities and not depends_on([value for _, _, value in values], own):
            raise TopologyError(
                "the body is free to move and has no mass: any force would accelerate it without bound",
                where=mechanism.bodies.bodies[one.body].name,
                advice="Connect it to something that has a mass or holds it, give it a mass, or remove it.",
            )


def _reacts(local: LocalPart) -> bool:
    """Return whether a load of a part changes with where its connectors are, or how they move."""
    read = [s for one in local.connectors.values() for s in (*one.position, *one.velocity, *one.orientation, *one.spin)]
    found = (component for one in local.loads for component in (*one.force, *one.torque))
    return any(isinstance(one, Expression) and depends_on(one, read) for one in found)


class _Solved:
    """Marks a constraint that elimination has used up."""


SOLVED: Expression = _Solved()  # type: ignore[assignment]


def eliminate_linear(
    derivation: Derivation,
    masses: Masses,
    forest: SpanningForest,
    q: Sequence[Expression],
    values: Values,
    before: Mapping[Expression, Expression] | None = None,
) -> dict[Expression, Expression]:
    """Solve linear constraints for one coordinate each; mark them in `values`.

    Coordinates of what has no mass go first, then those that were met last, so that the names that a reader expects
    stay. What was eliminated before is given by `before`.
    """
    parameters = derivation.table.values
    weightless = _weightless(derivation, masses, forest)
    orientation_coordinates = {
        number for orientation in forest.orientation_coordinates for number in orientation.coordinates
    }
    curved = {s for number, s in enumerate(q) if number in orientation_coordinates}
    numbers = {s: number for number, s in enumerate(q)}
    solution = dict(before or {})
    for number, (path, constraint, original) in enumerate(values):
        value = substitute([original], solution)[0]
        read = {node for node in live([value]) if node in numbers}
        if not read.isdisjoint(curved):
            continue
        free = sorted((s for s in read if s not in solution), key=numbers.__getitem__)
        affine = affine_coefficients(value, free, parameters)
        if affine is None:
            continue
        coefficients, remainder = affine
        light = [numbers[symbol] in weightless for symbol in free]
        index = decide(derivation, partial(_pivot, list(coefficients), light))
        if index is None:
            continue
        pivot = coefficients[index]
        total = remainder
        for i, coefficient in enumerate(coefficients):
            if i != index:
                total = total + coefficient * free[i]
        expression = -total / pivot
        solution = {s: substitute([e], {free[index]: expression})[0] for s, e in solution.items()}
        solution[free[index]] = derivation.table.graph.convert(expression)
        values[number] = (path, constraint, SOLVED)
    return solution


def solved_with(
    solved: dict[Expression, Expression], row: Expression, symbol: Expression, slope: Expression
) -> dict[Expression, Expression]:
    """Return what is solved with a symbol more: that in which a row, which stays zero, is linear with a slope."""
    value = -substitute([row], {symbol: row.graph.zero})[0] / slope
    return {**dict(zip(solved, substitute(list(solved.values()), {symbol: value}), strict=True)), symbol: value}


def _pivot(coefficients: list[Expression], light: list[bool], mechanism: Mechanism) -> int | None:
    """Return which coordinate to solve a linear constraint for: a weightless one, or the last; None if there is none.

    What is smaller than a tenth of the largest coefficient is not divided by, nor what is nothing but rounding, as the
    product of two directions at a right angle.
    """
    if not coefficients:
        return None
    numbers = np.array(evaluate(coefficients, mechanism.table.values))
    sizes = np.where(rounds_to_zero(coefficients, mechanism.table.values), 0.0, np.abs(numbers)).tolist()
    largest = max(sizes, default=0.0)
    if largest == 0.0:
        return None
    return max((i for i, size in enumerate(sizes) if size >= 0.1 * largest), key=lambda i: (light[i], i))


def _weightless(mechanism: Mechanism, masses: Masses, forest: SpanningForest) -> set[int]:
    """Return the numbers of the coordinates that only place a body without mass."""
    nodes = {node for one in masses.coupled for node in one.nodes}
    nodes |= {mechanism.graph.node_of[path, one.frame.name] for path, one in masses.varying}
    moving = {path: local for path, local in mechanism.locals_.items() if local.lagrangians}
    nodes |= {mechanism.graph.node_of[path, name] for path, local in moving.items() for name in local.connectors}
    massive = {mechanism.bodies.body_of[node] for node in nodes} | set(masses.bodies)
    heavy = {number for one in forest.attachments if one.body in massive for number in one.coordinates}
    return {number for one in forest.attachments for number in one.coordinates} - heavy


Prescribed = tuple[tuple[tuple[str, str, int], Expression], ...]


def drop_closed(derivation: Derivation, q: Sequence[Expression], values: Values) -> tuple[Values, Prescribed]:
    """Take out the constraints that no coordinate can change; return the rest, and those that depend on time.

    Those that do not are checked here; functions of time are checked when it is known for which times.
    """
    kept: Values = []
    prescribed, moving = [], frozenset(q)
    for path, constraint, value in values:
        if depends_on(value, moving):
            kept.append((path, constraint, value))
            continue
        if depends_on(value, derivation.relations.roots):
            prescribed.append(((path, constraint.law.name, constraint.index), value))
            continue
        is_length = str(constraint.law.options.unit) == "N"  # what is missed, times the reaction, is an energy
        decide(derivation, partial(_check_closed, f"{path}.{constraint.law.name}", value, is_length))
    return kept, tuple(prescribed)


def _check_closed(where: str, value: Expression, is_length: bool, mechanism: Mechanism) -> None:
    """Refuse a constraint between what is fixed that does not hold."""
    (miss,) = evaluate([value], mechanism.table.values)
    size = (extent(mechanism) or 1.0) if is_length else 1.0
    if not abs(miss) <= tolerances.CLOSED * size:
        raise TopologyError(
            f"the constraint cannot be satisfied: everything it joins is fixed, and its error is {miss:g}",
            where=where,
            advice="Two fixed parts contradict each other, or a length does not fit between them: change a length "
            "or a position.",
        )


@dataclass(frozen=True, eq=False)
class RoughPlace:
    """Values at which it is asked whether expressions vanish, and the same as rounding may have made them.

    Attributes
    ----------
    values
        The values.
    rows, near
        The row of each symbol, and its values with their last digits changed, shape (symbols, ways).
    """

    values: Mapping[Expression, float]
    rows: Mapping[Expression, int]
    near: FloatArray


def rough_place(values: Mapping[Expression, float]) -> RoughPlace:
    """Return a place at which many expressions are looked at."""
    at = np.array(list(values.values()))
    return RoughPlace(values, {one: k for k, one in enumerate(values)}, at[:, None] * roughly(len(at)))


def rounds_to_zero(
    expressions: Sequence[Expression],
    parameters: Mapping[Expression, float],
    *places: Mapping[Expression, float] | RoughPlace,
) -> NDArray[np.bool_]:
    """Return which expressions are no larger than what rounding could have made of them, at all of some places."""
    if all(one.is_constant for one in expressions):
        return np.array([one.is_zero for one in expressions], dtype=bool)
    nodes, found = live(expressions), np.ones(len(expressions), dtype=bool)
    every = [one if isinstance(one, RoughPlace) else rough_place(one) for one in places or [{}]]
    read = [node for node in nodes if node.is_symbol]
    own, moving = ([one for one in read if one in known] for known in (parameters, every[0].rows))
    held, program = np.array([parameters[one] for one in own]), RoughProgram((own, moving), list(expressions), nodes)
    for where in every:
        ways = program(held, where.near[[where.rows[one] for one in moving]])
        known = {**{one: parameters[one] for one in own}, **{one: where.values[one] for one in moving}}
        numbers = np.abs(evaluate(expressions, known, nodes))
        spread = np.maximum(np.ptp(ways, axis=1), ROUGHNESS * numbers)  # not finite next to a place without a value
        found &= (numbers <= tolerances.CERTAIN * spread) & np.isfinite(spread)
        if not found.any():
            break
    return found


_Place = tuple[Expression | None, Expression]
"""An angle, or none in the world, and by how much another one is ahead of it."""


def without_whole_turns(derivation: Derivation, angles: Sequence[Expression], values: Values) -> Values:
    """Take whole turns off the constraints that hold two angles at a difference that follows from others before."""
    zero = derivation.table.graph.constant(0.0)
    places: dict[Expression | None, _Place] = {angle: (angle, zero) for angle in [None, *angles]}
    kept: Values = []
    for path, constraint, value in values:
        ends = _ends(derivation, [node for node in live([value]) if node in places], value)
        if ends is not None:
            ahead, behind, difference = ends
            (first, shift), (second, other) = places[ahead], places[behind]
            # From "ahead - behind + difference = 0"
            miss = shift - other + difference
            if first is second:
                value = value - 2.0 * math.pi * decide(derivation, partial(_turns, miss))
            else:
                lost, held, offset = (first, second, -miss) if first is not None else (second, first, miss)
                places = {
                    one: (held, offset + by) if root is lost else (root, by) for one, (root, by) in places.items()
                }
        kept.append((path, constraint, value))
    return kept


def _ends(
    mechanism: Mechanism, angles: Sequence[Expression], value: Expression
) -> tuple[Expression | None, Expression | None, Expression] | None:
    """Return the two angles whose difference is held, and what is added to it; None if it is no such constraint."""
    affine = affine_coefficients(value, angles, mechanism.table.values)
    if affine is None or not (affine[1].is_parametric or affine[1].is_constant):
        return None
    found: dict[float, Expression] = {}
    for angle, coefficient in zip(angles, affine[0], strict=True):
        if not coefficient.is_zero:
            if not coefficient.is_constant or abs(coefficient.value) != 1.0 or coefficient.value in found:
                return None
            found[coefficient.value] = angle
    return found.get(1.0), found.get(-1.0), affine[1]


def _turns(miss: Expression, mechanism: Mechanism) -> int:
    turns = evaluate([miss], mechanism.table.values)[0] / (2.0 * math.pi)
    return round(turns) if math.isfinite(turns) else 0  # what has no finite value is refused where it is checked
