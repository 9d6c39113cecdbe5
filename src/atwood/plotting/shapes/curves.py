"""Curves that joints let points move on, as lines of places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Scalar, depends_on, evaluate
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.local.parts import LocalJoint, LocalPart

__all__ = ["depends", "holds_distance", "joint_curve", "joint_shift", "joint_step", "numbers"]


def numbers(
    mechanism: Mechanism, given: Sequence[Scalar], also: Mapping[Expression, float] | None = None
) -> FloatArray:
    """Return the values of expressions of parameters, and of further symbols with the values given."""
    graph = mechanism.table.graph
    values = {**mechanism.known_at_start(), **(also or {})}
    return np.array(evaluate([graph.convert(one) for one in given], values), dtype=float)


def joint_curve(mechanism: Mechanism, path: str, joint: LocalJoint) -> FloatArray | None:
    """Return the curve on which a joint moves its second node, from the first one, m, shape (points, 3).

    None where it moves it on a straight line, not at all, or with several coordinates.

    Parameters
    ----------
    mechanism
        The scene.
    path, joint
        The part and its law.
    """
    shift = [mechanism.table.graph.convert(c) for c in joint.placement.displacement]
    moving = [c for c in joint.coordinates if depends(shift, c)]
    if len(moving) != 1:
        return None
    one, two = (joint_step(mechanism, joint, shift, moving[0], size) for size in (1.0, 2.0))
    if np.allclose(two, 2.0 * one, rtol=1e-9, atol=0.0):
        return None
    places = np.linspace(*_ends(mechanism, path), 73)
    return np.array([joint_shift(mechanism, joint, shift, {moving[0]: place}) for place in places])


def holds_distance(local: LocalPart, value: Expression) -> bool:
    """Return whether a constraint holds points apart: it reads the places of two connectors at least, and no more."""
    several = local.connectors.values()
    others = [symbol for one in several for symbol in (*one.velocity, *one.orientation, *one.spin)]
    reads = [depends_on(value, list(one.position)) for one in several]
    return sum(reads) > 1 and not depends_on(value, others)


def _ends(mechanism: Mechanism, path: str) -> tuple[float, float]:
    """Return between which values of its coordinate a curve is drawn: its ends, or once round."""
    values = mechanism.locals_[path].part.values
    low, high = values.get("lower_end"), values.get("upper_end")
    if isinstance(low, float) and isinstance(high, float):
        return low, high
    if isinstance(low, float):
        return low, low + 2.0 * np.pi
    return (high - 2.0 * np.pi, high) if isinstance(high, float) else (-np.pi, np.pi)


def depends(expressions: Sequence[Expression], symbol: Expression) -> bool:
    """Return whether one of some expressions depends on a symbol."""
    return any(depends_on(one, [symbol]) for one in expressions)


def joint_shift(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], values: Mapping[Expression, float]
) -> FloatArray:
    """Return the displacement of a joint for some values of its coordinates; others are zero."""
    known = {**dict.fromkeys((*joint.coordinates, *mechanism.relations.roots), 0.0), **values}
    for axes in joint.axes:  # whichever way they are turned, the step along a coordinate is the same
        known.update((c, float(i == k)) for i, axis in enumerate(axes) for k, c in enumerate(axis))
    return numbers(mechanism, shift, known)


def joint_step(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], one: Expression, value: float
) -> FloatArray:
    """Return by how much a joint's displacement changes when one of its coordinates goes from zero to a value."""
    ends = [joint_shift(mechanism, joint, shift, {one: place}) for place in (value, 0.0)]
    found: FloatArray = ends[0] - ends[1]
    return found
