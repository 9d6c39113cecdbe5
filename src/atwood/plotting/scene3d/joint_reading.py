"""What a joint in space looks like, from where it can put its second node and how it can turn it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.local.parts import LocalJoint
from atwood.model.values.rotation import FreeRotation, Rotation, as_rotation
from atwood.plotting.scene3d.reading import Joining, Reading
from atwood.plotting.shapes.curves import depends, joint_curve, joint_shift, joint_step, numbers

__all__ = ["read_joint", "seen_from"]


def read_joint(
    reading: Reading, mechanism: Mechanism, path: str, joint: LocalJoint, nodes: Mapping[str, int]
) -> list[Joining]:
    """Return what a joint looks like; nothing where it holds nothing, or holds rigidly.

    Parameters
    ----------
    reading
        Where everything is.
    mechanism
        The scene.
    path, joint
        The part and its law.
    nodes
        Node of each of its connectors.
    """
    options, placement = joint.law.options, joint.placement
    if options.rigid or options.a == "world" or _is_idle(mechanism, path, joint):
        return []
    a, b = nodes[options.a], nodes[options.b]
    turn = reading.turns[a] if placement.axes == "a" else np.eye(3)
    shift = [mechanism.table.graph.convert(c) for c in placement.displacement]
    axes = _turning_axes(mechanism, placement.rotation)
    if all(c.is_zero for c in shift):
        return _meeting(reading, path, (a, b), axes, isinstance(placement.rotation, FreeRotation))
    moving = [c for c in joint.coordinates if depends(shift, c)]
    if len(moving) == 2:
        if not _is_flat(mechanism, joint, shift, moving):
            return _sheet(mechanism, path, joint, (a, b), turn)
        first, second = (joint_step(mechanism, joint, shift, one, 1.0) for one in moving)
        normal = turn @ np.cross(first, second)
        normal /= np.linalg.norm(normal)
        return [Joining(path, "plane", (a, b), (normal,), reach=_heights(reading, (a, b), normal))]
    if len(moving) > 2:
        return []
    if len(moving) == 1:
        points = joint_curve(mechanism, path, joint)
        if points is not None:
            return [Joining(path, "curve", (a, b), curve=points @ turn.T)]
        one = joint_step(mechanism, joint, shift, moving[0], 1.0)
        axis = turn @ one
    else:
        axis = _seen_axis(reading, a, b)
    if not np.any(axis):
        return []
    axis = axis / np.linalg.norm(axis)
    along = seen_from(reading, a, b) @ axis
    return [Joining(path, "slide", (a, b), (axis,), bool(axes), (float(along.min()), float(along.max())))]


def _is_idle(mechanism: Mechanism, path: str, joint: LocalJoint) -> bool:
    """Return whether nothing is joined to the end that a joint places beside that of another, as a mere marker."""
    own = mechanism.locals_[path].joints
    if not any(one is not joint and set(one.coordinates) & set(joint.coordinates) for one in own):
        return False
    members = mechanism.graph.nodes[mechanism.graph.node_of[path, joint.law.options.b]].members
    return len(members) == 1


def _is_flat(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], moving: Sequence[Expression]
) -> bool:
    """Return whether a joint moves its end in a plane, evenly with two coordinates."""
    places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 3.0]]
    origin, one, two, far = (
        joint_shift(mechanism, joint, shift, dict(zip(moving, place, strict=True))) for place in places
    )
    return bool(np.allclose(far - origin, 2.0 * (one - origin) + 3.0 * (two - origin), rtol=1e-9, atol=1e-12))


def _sheet(
    mechanism: Mechanism, path: str, joint: LocalJoint, nodes: tuple[int, int], turn: FloatArray
) -> list[Joining]:
    """Return lines on a curved surface, along either of its coordinates."""
    shift = [mechanism.table.graph.convert(c) for c in joint.placement.displacement]
    first, second = [c for c in joint.coordinates if depends(shift, c)]
    steps, lines = np.linspace(-np.pi, np.pi, 49), np.linspace(-np.pi, np.pi, 9)
    found = []
    for along, across in ((first, second), (second, first)):
        for held in lines:
            points = np.array([joint_shift(mechanism, joint, shift, {along: step, across: held}) for step in steps])
            if np.all(np.isfinite(points)):
                found.append(Joining(path, "curve", nodes, curve=points @ turn.T))
    return found


def _heights(reading: Reading, nodes: tuple[int, int], normal: FloatArray) -> tuple[float, float]:
    """Return the lowest and the highest place over a plane of what moves on it, as the centre of what rolls, m."""
    heights = seen_from(reading, *nodes) @ normal
    return float(heights.min()), float(heights.max())


def _turning_axes(mechanism: Mechanism, rotation: object) -> list[FloatArray]:
    """Return the axes of the turns of a joint, one after another."""
    if rotation is None or isinstance(rotation, FreeRotation):
        return []
    assert isinstance(rotation, (int, float, Expression, Rotation))
    turns = as_rotation(rotation).turns
    return [numbers(mechanism, tuple(one.axis)) for one in turns]


def _meeting(
    reading: Reading, path: str, nodes: tuple[int, int], axes: Sequence[FloatArray], is_free: bool
) -> list[Joining]:
    """Return a joint whose two nodes stay at one place."""
    a, b = nodes
    if is_free or len(axes) > 2:
        return [Joining(path, "ball", nodes)]
    if len(axes) == 2:
        return [Joining(path, "cross", nodes, (reading.turns[a] @ axes[0], reading.turns[b] @ axes[1]))]
    return [Joining(path, "hinge", nodes, (reading.turns[a] @ axis,)) for axis in axes]


def seen_from(reading: Reading, a: int, b: int) -> FloatArray:
    """Return the way from node a to node b in the axes of the body of a, m, shape (times, 3)."""
    pose = reading.poses[reading.body_of[a]]
    found: FloatArray = np.einsum("tji,tj->ti", pose.axes, reading.place(b) - reading.place(a))
    return found


def _seen_axis(reading: Reading, a: int, b: int) -> FloatArray:
    """Return the direction in which node b moves as seen from node a, where it stays on a straight line; else zero."""
    seen = seen_from(reading, a, b)
    spread = seen - seen.mean(axis=0)
    sizes, axes = np.linalg.svd(spread, full_matrices=False)[1:]
    straight = sizes[0] > 0.0 and (len(sizes) < 2 or sizes[1] <= 1e-6 * sizes[0])
    found: FloatArray = axes[0] if straight else np.zeros(3)
    return found
