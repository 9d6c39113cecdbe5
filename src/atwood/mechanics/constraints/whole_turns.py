"""Whole turns between angles that constraints hold twice over, in a plane.

Two locks between the same two bodies hold them alike if the angles at which their frames are mounted differ by a whole
turn: 200 degrees on one side and -160 degrees on the other are one direction. Angles in a plane are numbers, though,
and would contradict each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from atwood.expr import Expression, affine_coefficients, evaluate, live
from atwood.mechanics.constraints.values import Values
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide

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
