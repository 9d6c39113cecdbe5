"""Surfaces of simple bodies as small flat faces, which a painter can put in order by their distance."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import FloatArray, IndexArray
from atwood.late import dataclass

__all__ = ["Mesh", "box", "cylinder", "frame_along", "revolved", "ring"]


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
        found: FloatArray = np.divide(raw, size, out=np.zeros_like(raw), where=size > 0.0)
        return found

    @cached_property
    def edges(self) -> tuple[IndexArray, IndexArray, NDArray[np.bool_]]:
        """Ends of each edge, the two faces that meet there, and whether they meet at an angle."""
        sides: dict[tuple[int, int], list[int]] = {}
        for number, face in enumerate(self.faces.tolist()):
            for one, other in zip(face, (*face[1:], face[0]), strict=True):
                if one != other:
                    sides.setdefault((min(one, other), max(one, other)), []).append(number)
        pairs = [(ends, faces) for ends, faces in sides.items() if len(faces) == 2]
        ends = np.array([one for one, _ in pairs], dtype=np.intp).reshape(-1, 2)
        faces = np.array([one for _, one in pairs], dtype=np.intp).reshape(-1, 2)
        bends = np.einsum("ij,ij->i", self.normals[faces[:, 0]], self.normals[faces[:, 1]])
        has_length = np.any(self.vertices[ends[:, 0]] != self.vertices[ends[:, 1]], axis=1)
        return ends[has_length], faces[has_length], bends[has_length] < _SHARP

    def placed(self, origin: ArrayLike, axes: ArrayLike) -> Mesh:
        """Return the same surface elsewhere.

        Parameters
        ----------
        origin
            Where its origin goes, m.
        axes
            Where its axes go: the columns of a rotation matrix.
        """
        turn = np.asarray(axes, dtype=float)
        moved = Mesh(np.asarray(origin, dtype=float) + self.vertices @ turn.T, self.faces, self.marked)
        # Neither the edges nor how faces meet depend on where it is.
        moved.__dict__.update(normals=self.normals @ turn.T, edges=self.edges)
        return moved


def frame_along(direction: ArrayLike, near: ArrayLike = (1.0, 0.0, 0.0)) -> FloatArray:
    """Return a rotation matrix whose last column is along a direction, and the first as near to another as can be.

    Parameters
    ----------
    direction
        Any vector but zero.
    near
        Where the first column would best point.
    """
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
    """Return a box about the origin.

    Parameters
    ----------
    sides
        Its sides along x, y and z, m.
    cells
        Into how many faces its longest side is divided; others in proportion.
    """
    half = 0.5 * np.asarray(sides, dtype=float)
    counts = np.maximum(1, np.round(cells * half / np.max(half)).astype(int))
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    known: dict[tuple[int, int, int], int] = {}

    def corner(place: tuple[int, int, int]) -> int:
        if place not in known:
            known[place] = len(vertices)
            vertices.append((2.0 * np.array(place) / counts - 1.0) * half)
        return known[place]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, counts[axis]):
            for i in range(counts[u]):
                for j in range(counts[v]):
                    square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    if end == 0:
                        square.reverse()
                    places = []
                    for p, q in square:
                        place = [0, 0, 0]
                        place[axis], place[u], place[v] = int(end), p, q
                        places.append((place[0], place[1], place[2]))
                    faces.append([corner(place) for place in places])
    return Mesh(np.array(vertices), np.array(faces, dtype=np.intp), np.zeros(len(faces), dtype=bool))


def revolved(profile: ArrayLike, around: int = 36, marks: bool = False, closed: bool = False) -> Mesh:
    """Return the surface that a line makes when it is turned about z.

    Parameters
    ----------
    profile
        Distance from the axis and height of each of its points, m, shape (points, 2); counter-clockwise about what is
        inside, as seen with the axis on the left, that is upwards on the outside.
    around
        Into how many parts the circle is divided; a multiple of four where there are marks.
    marks
        Whether to mark every other quarter.
    closed
        Whether the line ends where it begins, as that of a ring.
    """
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
    """Return a cylinder about the origin, along z.

    Parameters
    ----------
    radius, height
        m.
    around, marks
        See `revolved`.
    """
    lengths = np.linspace(-0.5 * height, 0.5 * height, 1 + max(1, min(12, round(height / (2.0 * radius)))))
    widths = np.array([0.0, 0.35, 0.65, 0.86, 1.0]) * radius
    profile = [(w, lengths[0]) for w in widths] + [(radius, z) for z in lengths[1:]]
    profile += [(w, lengths[-1]) for w in widths[::-1][1:]]
    return revolved(profile, around, marks)


def ring(radius: float, thickness: float, around: int = 64, corners: int = 14) -> Mesh:
    """Return a ring about the origin, whose axis is z.

    Parameters
    ----------
    radius
        Of its middle line, m.
    thickness
        Radius of its round section, m.
    around, corners
        Into how many parts the two circles are divided.
    """
    angles = 2.0 * np.pi * np.arange(corners) / corners
    profile = np.stack([radius + thickness * np.cos(angles), thickness * np.sin(angles)], axis=-1)
    return revolved(profile, around, closed=True)
