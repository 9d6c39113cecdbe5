"""Closed triangle meshes: made from loose triangles, checked, and turned outward.

A mesh bounds a body if every edge belongs to exactly two triangles that run along it in opposite directions. Triangles
run counter-clockwise as seen from outside. A mesh may have several shells: bodies side by side, and cavities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from atwood.arguments import show
from atwood.arrays import FloatArray, IntArray
from atwood.errors import ParameterError
from atwood.late import dataclass
from atwood.solids.shells import check_overlap, check_shells, signed_volume, split_shells
from atwood.solids.welding import weld

__all__ = ["TriangleMesh", "closed_mesh"]


_WELD = 1e-6
"""Vertices that are this close, relative to the size of the mesh, are one, where exact equality leaves the mesh open.
STL holds single precision, so that a corner written twice with different rounding is 1e-7 apart."""

_FLAT = 1e-12
"""A mesh whose volume is less than this part of its box's diagonal cubed encloses nothing but rounding."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A closed triangle mesh whose triangles face outward. Made by `closed_mesh`, which checks that.

    Parameters
    ----------
    vertices
        Shape (n, 3), in m.
    triangles
        Numbers of vertices, shape (m, 3), counter-clockwise as seen from outside.
    notes
        What was put right on the way: triangles dropped or turned round, vertices made one.
    """

    vertices: FloatArray
    triangles: IntArray
    notes: tuple[str, ...] = ()

    @property
    def volume(self) -> float:
        """The enclosed volume in m^3."""
        return signed_volume(self.vertices, self.triangles)


def closed_mesh(corners: ArrayLike, *, tolerance: float = _WELD, where: str = "") -> TriangleMesh:
    """Make a closed mesh from loose triangles.

    Corners that are equal become one vertex. Where that leaves open edges, corners closer than the tolerance become
    one too. Triangles that collapse thereby are dropped, and a mesh that faces inward is turned round; both leave a
    note. Whether the mesh cuts through itself is looked at in up to 256 places.

    Parameters
    ----------
    corners
        The corners of the triangles, shape (m, 3, 3): triangle, corner, coordinate; in m.
    tolerance
        Distance below which corners are one, relative to the diagonal of the mesh's box.
    where
        What the mesh is called in errors: a file, a path.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    ParameterError
        If the mesh is not closed (with the number of open edges and the place of the first), has edges where more than
        two triangles meet or where neighbours face opposite ways, encloses no volume, has a shell that faces the
        wrong way, or cuts through itself.
    """
    soup = _soup(corners, where)
    if not 0 <= tolerance < 0.1:
        raise ParameterError(
            f"the tolerance is {tolerance}", where=where, advice="It is a small part of the mesh's size."
        )
    diagonal = float(np.linalg.norm(np.ptp(soup.reshape(-1, 3), axis=0)))
    notes: list[str] = []
    vertices, triangles = _weld(soup, 0.0, notes)
    if tolerance > 0 and not _is_closed(triangles):
        found: list[str] = []
        merged_vertices, merged = _weld(soup, tolerance * diagonal, found)
        if len(merged_vertices) < len(vertices):
            found.append(
                f"{len(vertices) - len(merged_vertices)} corners within {tolerance * diagonal:.3g} m were made one"
            )
            vertices, triangles, notes = merged_vertices, merged, found
    if not len(triangles):
        raise ParameterError("the mesh has no triangle with three corners", where=where, advice="Check the file.")
    _check_edges(vertices, triangles, where)
    volume = signed_volume(vertices, triangles)
    if abs(volume) <= _FLAT * diagonal**3:
        raise ParameterError(
            f"the mesh encloses no volume ({abs(volume):.3g} m^3)", where=where, advice="Check that it is not flat."
        )
    if volume < 0:
        triangles = triangles[:, ::-1].copy()
        notes.append("the triangles faced inward and were turned round")
    check_shells(vertices, triangles, split_shells(triangles), where)
    check_overlap(vertices, triangles, where)
    for array in (vertices, triangles):
        array.setflags(write=False)
    return TriangleMesh(vertices, triangles, tuple(notes))


def _soup(corners: ArrayLike, where: str) -> FloatArray:
    """Return loose triangles as an array of finite numbers."""
    try:
        soup = np.asarray(corners, dtype=float)
    except Exception:  # whatever it is, it is no table of numbers
        advice = "Give triangle, corner, coordinate: (m, 3, 3)."
        raise ParameterError(f"the corners of the mesh are {show(corners)}", where=where, advice=advice) from None
    if soup.ndim != 3 or soup.shape[1:] != (3, 3):
        raise ParameterError(
            f"the triangles have shape {soup.shape}",
            where=where,
            advice="Give triangle, corner, coordinate: (m, 3, 3).",
        )
    if not len(soup):
        raise ParameterError("the mesh has no triangles", where=where, advice="Check the file.")
    bad = ~np.all(np.isfinite(soup), axis=(1, 2))
    if np.any(bad):
        first = int(np.argmax(bad))
        raise ParameterError(
            f"{int(np.sum(bad))} triangles have corners that are not finite; the first is number {first + 1}",
            where=where,
            advice="Export the mesh again.",
        )
    return soup


def _weld(soup: FloatArray, distance: float, notes: list[str]) -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles, without those that have collapsed."""
    vertices, numbers = weld(soup.reshape(-1, 3), distance)
    triangles = numbers.reshape(-1, 3)
    whole = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    if not np.all(whole):
        notes.append(f"{int(np.sum(~whole))} triangles with two equal corners were dropped")
    return vertices, triangles[whole]


def _edges(triangles: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the edges (lower vertex first), how many triangles use each, and the sum of their directions."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, inverse, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    direction = np.zeros(len(edges), dtype=np.int64)
    np.add.at(direction, inverse.reshape(-1), np.where(directed[:, 0] < directed[:, 1], 1, -1))
    return edges, uses, direction


def _is_closed(triangles: IntArray) -> bool:
    """Return whether every edge is shared by two triangles in opposite directions."""
    _, uses, direction = _edges(triangles)
    return bool(np.all(uses == 2) and np.all(direction == 0))


def _check_edges(vertices: FloatArray, triangles: IntArray, where: str) -> None:
    """Raise an error where the mesh does not bound a body."""
    edges, uses, direction = _edges(triangles)
    for wrong, problem, advice in (
        (
            uses == 1,
            "the mesh is not closed: {} belong to one triangle only",
            "Close the holes where the mesh was made, or merge corners with a larger tolerance.",
        ),
        (
            uses > 2,
            "the mesh does not bound one body: {} belong to more than two triangles",
            "Remove doubled faces and walls inside; bodies that touch along an edge need meshes of their own.",
        ),
        (
            direction != 0,
            "the triangles do not all face the same way: at {} neighbours face opposite ways",
            "Make the normals consistent where the mesh was made.",
        ),
    ):
        count = int(np.sum(wrong))
        if count:
            a, b = vertices[edges[int(np.argmax(wrong))]]
            raise ParameterError(
                f"{problem.format('1 edge' if count == 1 else f'{count} edges')}; "
                f"the first runs from {_place(a)} to {_place(b)}".replace("1 edge belong ", "1 edge belongs "),
                where=where,
                advice=advice,
            )


def _place(point: FloatArray) -> str:
    """Return a position as a reader would write it."""
    return f"({', '.join(f'{value:.6g}' for value in point)}) m"
