"""Surfaces of bodies, outlines of parts and curves of joints, as small flat faces and lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import FloatArray, IndexArray
from atwood.expr import Expression, depends_on
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.declare.component import Binding, bind
from atwood.model.local.parts import LocalJoint, LocalPart
from atwood.model.values.outline import Outline

_SHARP = np.cos(np.radians(35.0))
"""Faces that meet at a larger angle than this have an edge between them; smaller ones belong to a curved surface."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of faces with four corners.

    Attributes
    ----------
    vertices
        m, shape (vertices, 3).
    faces
        Corners of each face, counter-clockwise as seen from outside, shape (faces, 4); a triangle repeats one of them.
    marked
        Faces that are a little darker, so that one sees the body turn; shape (faces,).
    """

    vertices: FloatArray
    faces: IndexArray
    marked: NDArray[np.bool_]

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the faces, outwards; zero for a face without area."""
        a, b, c, d = (self.vertices[self.faces[:, i]] for i in range(4))
        raw = np.cross(c - a, d - b)
        size = np.linalg.norm(raw, axis=1, keepdims=True)
        return np.asarray(np.divide(raw, size, out=np.zeros_like(raw), where=size > 0.0))

    @cached_property
    def edges(self) -> tuple[IndexArray, IndexArray, NDArray[np.bool_]]:
        """Ends of each edge, the two faces that meet there, and whether they meet at an angle."""
        sides = np.sort(np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        used = np.flatnonzero(sides[:, 0] != sides[:, 1])
        _, first, which, counts = np.unique(
            sides[used] @ (len(self.vertices), 1), return_index=True, return_inverse=True, return_counts=True
        )
        twice = np.flatnonzero(counts == 2)
        twice = twice[np.argsort(first[twice])]
        starts, members = np.cumsum(counts) - counts, np.argsort(which, kind="stable")
        faces = used[members[starts[twice, None] + np.arange(2)]] // 4
        ends = sides[used[first[twice]]]
        bends = np.einsum("ij,ij->i", self.normals[faces[:, 0]], self.normals[faces[:, 1]])
        has_length = np.any(self.vertices[ends[:, 0]] != self.vertices[ends[:, 1]], axis=1)
        return ends[has_length], faces[has_length], bends[has_length] < _SHARP

    @cached_property
    def planes(self) -> tuple[FloatArray, FloatArray] | None:
        """The planes that a convex surface lies between: outward unit normals, and distances from the origin, m.

        None for a surface that is not convex, or not closed: its directed areas do not add up to zero.
        """
        a, b, c, d = (self.vertices[self.faces[:, i]] for i in range(4))
        areas, has_area = np.cross(c - a, d - b), np.any(self.normals, axis=1)
        if np.linalg.norm(areas.sum(axis=0)) >= 1e-9 * np.abs(areas).sum():
            return None
        normals, first = self.normals[has_area], self.vertices[self.faces[has_area, 0]]
        distances, size = np.sum(normals * first, axis=1), float(np.max(np.ptp(self.vertices, axis=0)))
        alike = np.round(np.column_stack([normals, distances / size]), 9)
        _, once = np.unique(alike, axis=0, return_index=True)
        normals, distances = normals[once], distances[once]
        return (normals, distances) if np.max(self.vertices @ normals.T - distances) < 1e-9 * size else None

    def border(self, faces: NDArray[np.bool_]) -> IndexArray:
        """Return the ends of the edges between some faces and the others."""
        ends, sides, _ = self.edges
        return ends[faces[sides[:, 0]] ^ faces[sides[:, 1]]]

    def placed(self, origin: ArrayLike, axes: ArrayLike) -> Mesh:
        """Return the same surface elsewhere."""
        turn = np.asarray(axes, dtype=float)
        moved = Mesh(np.asarray(origin, dtype=float) + self.vertices @ turn.T, self.faces, self.marked)
        # Neither the edges nor how faces meet depend on where it is, nor whether it is convex.
        moved.__dict__.update(normals=self.normals @ turn.T, edges=self.edges)
        planes = self.planes
        if planes is not None:
            normals = planes[0] @ turn.T
            planes = normals, planes[1] + normals @ np.asarray(origin, dtype=float)
        moved.__dict__["planes"] = planes
        return moved


def frame_along(direction: ArrayLike, near: ArrayLike = (1.0, 0.0, 0.0)) -> FloatArray:
    """Return a rotation matrix whose last column is along a direction, and the first as near to another as can be."""
    z = np.asarray(direction, dtype=float)
    z = z / np.linalg.norm(z)
    x = np.asarray(near, dtype=float)
    x = x - (x @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = np.eye(3)[int(np.argmin(np.abs(z)))]
        x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def box(sides: Sequence[float], cells: int = 4) -> Mesh:
    """Return a box about the origin."""
    half = 0.5 * np.asarray(sides, dtype=float)
    counts = np.maximum(1, np.round(cells * half / np.max(half)).astype(int))
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = (one.reshape(-1, 1) for one in np.indices((counts[u], counts[v])))
        for end in (0, counts[axis]):
            corners = np.full((i.size, 4, 3), end)
            corners[..., u], corners[..., v] = i + np.array([0, 1, 1, 0]), j + np.array([0, 0, 1, 1])
            faces.append(corners if end else corners[:, ::-1])
    places, numbers = np.unique(np.concatenate(faces).reshape(-1, 3), axis=0, return_inverse=True)
    made = numbers.reshape(-1, 4).astype(np.intp)
    return Mesh((2.0 * places / counts - 1.0) * half, made, np.zeros(len(made), dtype=bool))


def revolved(profile: ArrayLike, around: int = 36, marks: bool = False, closed: bool = False) -> Mesh:
    """Return the surface that a line makes when it is turned about z."""
    line = np.asarray(profile, dtype=float)
    angles = 2.0 * np.pi * np.arange(around) / around
    cosines, sines = np.cos(angles), np.sin(angles)
    vertices = np.stack(
        [np.outer(line[:, 0], cosines), np.outer(line[:, 0], sines), np.repeat(line[:, 1:], around, axis=1)], axis=-1
    ).reshape(-1, 3)
    rows = len(line) if closed else len(line) - 1
    i, j = np.meshgrid(np.arange(rows), np.arange(around), indexing="ij")
    after, beside = (i + 1) % len(line), (j + 1) % around
    faces = np.stack([i * around + j, i * around + beside, after * around + beside, after * around + j], axis=-1)
    quarter = (j * 4 // around) % 2 == 0
    marked = quarter if marks else np.zeros_like(quarter, dtype=bool)
    return Mesh(vertices, faces.reshape(-1, 4).astype(np.intp), marked.reshape(-1))


def cylinder(radius: float, height: float, around: int = 36, marks: bool = False) -> Mesh:
    """Return a cylinder about the origin, along z."""
    lengths = np.linspace(-0.5 * height, 0.5 * height, 1 + max(1, min(12, round(height / (2.0 * radius)))))
    widths = np.array([0.0, 0.35, 0.65, 0.86, 1.0]) * radius
    profile = [(w, lengths[0]) for w in widths] + [(radius, z) for z in lengths[1:]]
    profile += [(w, lengths[-1]) for w in widths[::-1][1:]]
    return revolved(profile, around, marks)


def ring(radius: float, thickness: float, around: int = 64, corners: int = 14) -> Mesh:
    """Return a ring about the origin, whose axis is z."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    profile = np.stack([radius + thickness * np.cos(angles), thickness * np.sin(angles)], axis=-1)
    return revolved(profile, around, closed=True)


def joint_curve(mechanism: Mechanism, path: str, joint: LocalJoint) -> FloatArray | None:
    """Return the curve on which a joint moves its second node, from the first one, m, shape (points, 3).

    None where it moves it on a straight line, not at all, or with several coordinates.
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
    return depends_on(expressions, [symbol])


def joint_shift(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], values: Mapping[Expression, float]
) -> FloatArray:
    """Return the displacement of a joint for some values of its coordinates; others are zero."""
    known = {**dict.fromkeys((*joint.coordinates, *mechanism.relations.roots), 0.0), **values}
    for axes in joint.axes:  # whichever way they are turned, the step along a coordinate is the same
        known.update((c, float(i == k)) for i, axis in enumerate(axes) for k, c in enumerate(axis))
    return mechanism.values_at_start(shift, known)


def joint_step(
    mechanism: Mechanism, joint: LocalJoint, shift: Sequence[Expression], one: Expression, value: float
) -> FloatArray:
    """Return by how much a joint's displacement changes when one of its coordinates goes from zero to a value."""
    ends = [joint_shift(mechanism, joint, shift, {one: place}) for place in (value, 0.0)]
    return np.asarray(ends[0] - ends[1])


_PARTS = 8
"""Into about so many parts the longest side is divided, since a painter sorts small faces better."""

_THIN = 0.01
"""What has no thickness is drawn so thick, relative to its largest side."""


def outline_of(local: LocalPart) -> Outline | None:
    """Return what a part looks like, with the numbers of its scene; None if it does not say."""
    part = local.part
    found: Outline | None = bind(part.component, Binding(values=part.values)).outline()
    return found


def outline_mesh(outline: Outline, around: int = 40) -> Mesh:
    """Return the surface of an outline, in the axes of the part's frame."""
    made = _own_mesh(outline, around)
    return made if outline.axes is None else made.placed(np.zeros(3), outline.axes)


def _own_mesh(outline: Outline, around: int) -> Mesh:
    if outline.kind == "box":
        return box(outline.sides, cells=_PARTS - 3)
    if outline.kind == "mesh":
        triangles = np.asarray(outline.triangles, dtype=np.intp)
        faces = np.column_stack([triangles, triangles[:, 2]])
        return Mesh(np.asarray(outline.vertices, dtype=float), faces, np.zeros(len(faces), dtype=bool))
    line = _with_thickness(np.asarray(outline.profile, dtype=float), outline.is_ring)
    made = revolved(_divided(line, outline.is_ring), around=around, marks=True, closed=outline.is_ring)
    # z of the surface along the axis, x and y along the next two: a right-handed turn.
    turn = np.eye(3)[:, [(outline.axis + 1) % 3, (outline.axis + 2) % 3, outline.axis]]
    return made.placed(np.zeros(3), turn)


def _with_thickness(line: FloatArray, is_ring: bool) -> FloatArray:
    """Return a line that encloses something: of a plate without thickness, or a wall without it, with a little."""
    widths, heights = np.ptp(line, axis=0)
    least = _THIN * max(float(np.max(line[:, 0])), float(heights))
    line = line.copy()
    if heights < least:
        line[:, 1] = 0.5 * least * np.array([-1.0 if i < (len(line) + 1) // 2 else 1.0 for i in range(len(line))])
    if widths < least and is_ring:
        line[[0, -1], 0] -= least
    elif 0.0 < widths < least:
        line[:, 0] *= least / widths
    return line


def _divided(line: FloatArray, is_ring: bool) -> FloatArray:
    """Return a line in pieces that are not much longer than a part of its longest side."""
    whole = np.concatenate([line, line[:1]]) if is_ring else line
    longest = float(np.max(np.ptp(whole, axis=0)))
    found = []
    for one, other in pairwise(whole):
        count = max(1, int(np.ceil(_PARTS * float(np.linalg.norm(other - one)) / (1.5 * longest))))
        found += [one + (other - one) * k / count for k in range(count)]
    return np.array(found if is_ring else [*found, whole[-1]])
