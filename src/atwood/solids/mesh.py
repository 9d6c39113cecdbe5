"""Closed triangle meshes: made from loose triangles, checked, turned outward, and integrated exactly.

A mesh bounds a body if every edge belongs to exactly two triangles that run along it in opposite directions. Triangles
run counter-clockwise as seen from outside. A mesh may have several shells: bodies side by side, and cavities.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from atwood.arguments import FILE, instance, number, optional, show, takes
from atwood.arrays import FloatArray, IntArray
from atwood.errors import ParameterError
from atwood.lazy_dataclasses import dataclass
from atwood.solids.properties import MassProperties
from atwood.solids.stl import read_stl

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


def weld(points: FloatArray, distance: float) -> tuple[FloatArray, IntArray]:
    """Make one vertex out of points that coincide."""
    # Adding zero makes one of plus and minus zero.
    exact, numbers = _first_rows(points + 0.0)
    if distance <= 0:
        return exact, numbers
    labels = _clusters(exact, distance)
    kept, inverse = np.unique(labels, return_inverse=True)
    return exact[kept], inverse.reshape(-1)[numbers]


def _first_rows(points: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the distinct rows in the order they first appear, and the number of each row among them."""
    distinct, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    position = np.empty_like(order)
    position[order] = np.arange(len(order))
    return distinct[order], position[inverse.reshape(-1)]


def _clusters(points: FloatArray, distance: float) -> IntArray:
    """Return for each point the lowest number in its cluster.

    Of the eight grids of cells of twice the distance, shifted by half a cell along some of the axes, at least one holds
    any two points that are within the distance in the same cell.
    """
    cell = 2 * distance
    scaled = (points - np.min(points, axis=0)) / cell
    groups = []
    for shift in product((0.0, 0.5), repeat=3):
        _, inverse = np.unique(np.floor(scaled + shift).astype(np.int64), axis=0, return_inverse=True)
        groups.append(inverse.reshape(-1))
    labels = np.arange(len(points))
    while True:
        before = labels
        for group in groups:
            lowest = np.full(int(np.max(group)) + 1, len(points))
            np.minimum.at(lowest, group, labels)
            labels = lowest[group]
        if np.array_equal(labels, before):
            return labels


_PROBES = 7
"""How many triangles of a shell are asked on which side of the other shells they are."""

_WORK, _FEWEST, _MOST = 1_000_000, 8, 256
"""So many triangles are looked at from all points together; and the number of points."""

_INSIDE = 1e-5
"""How far inside of a triangle a point is asked about, relative to the triangle's size."""


def signed_volume(vertices: FloatArray, triangles: IntArray) -> float:
    """Return the volume a closed mesh encloses: negative where its triangles face inward."""
    middle = (np.min(vertices, axis=0) + np.max(vertices, axis=0)) / 2
    a, b, c = (vertices[triangles[:, corner]] - middle for corner in range(3))
    return float(np.sum(np.einsum("ij,ij->i", a, np.cross(b, c)))) / 6


def split_shells(triangles: IntArray) -> list[IntArray]:
    """Return the numbers of the triangles of each shell: what hangs together by edges."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort(np.sort(directed, axis=1).T)
    left, right = owner[order[0::2]], owner[order[1::2]]
    labels = np.arange(len(triangles))
    while True:
        before = labels.copy()
        lowest = np.minimum(labels[left], labels[right])
        np.minimum.at(labels, left, lowest)
        np.minimum.at(labels, right, lowest)
        labels = labels[labels]  # jump along chains, so that long meshes need few rounds
        if np.array_equal(labels, before):
            break
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def check_shells(vertices: FloatArray, triangles: IntArray, shells: list[IntArray], where: str) -> None:
    """Check that shells face outward where they bound a body and inward where they bound a cavity.

    A shell that faces outward must lie where the others enclose nothing; one that faces inward must lie inside exactly
    one body.
    """
    if len(shells) == 1:
        return
    for shell in shells:
        others = np.setdiff1d(np.arange(len(triangles)), shell, assume_unique=True)
        probes = shell[:: max(1, len(shell) // _PROBES)][:_PROBES]
        points = np.mean(vertices[triangles[probes]], axis=1)
        depth = round(float(np.median([winding_number(vertices, triangles[others], point) for point in points])))
        outward = signed_volume(vertices, triangles[shell]) > 0
        if depth == (0 if outward else 1):
            continue
        place = ", ".join(f"{value:.6g}" for value in np.mean(vertices[triangles[shell]], axis=(0, 1)))
        faces = "outward" if outward else "inward"
        lies = {0: "outside all others", 1: "inside another one"}.get(depth, f"inside {depth} others")
        raise ParameterError(
            f"a shell around ({place}) m faces {faces} although it lies {lies}",
            where=where,
            advice="Bodies must face outward and cavities inward; bodies that overlap must be joined first.",
        )


def check_overlap(vertices: FloatArray, triangles: IntArray, where: str) -> None:
    """Check that just inside of a triangle the mesh encloses a point once: elsewhere its volume counts twice, or not.

    Points are spread evenly over the triangles, several on each of a small mesh and on some of a large one: where only
    a small share of the surface lies inside another part, it can be missed.
    """
    count = int(np.clip(_WORK // len(triangles), _FEWEST, _MOST))
    number = np.arange(count)
    chosen = number % len(triangles) if count > len(triangles) else number * len(triangles) // count
    corners = vertices[triangles[chosen]]
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(sides[:, 0], sides[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    around = np.sum(np.linalg.norm(sides, axis=2), axis=1)
    points = np.einsum("ij,ijk->ik", _within_triangles(number), corners)
    wrong = []
    for point, normal, area, length in zip(points, normals, areas, around, strict=True):
        if area > 1e-6 * length**2:  # what is all but a line has no clear inside
            inside = point - normal / area * (_INSIDE * area / length)
            if round(winding_number(vertices, triangles, inside)) != 1:
                wrong.append(point)
    if wrong:
        place = ", ".join(f"{value:.6g}" for value in wrong[0])
        raise ParameterError(
            f"the mesh cuts through itself: of {count} points on its surface {len(wrong)} lie inside another part of "
            f"it, such as ({place}) m",
            where=where,
            advice="Join what overlaps into one body where the mesh was made.",
        )


def _within_triangles(number: IntArray) -> FloatArray:
    """Return weights of the corners for points that fill a triangle evenly, and keep away from its edges.

    The sequence of M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018), folded into a half.
    """
    pair = np.mod(0.5 + np.outer(number, [0.7548776662466927, 0.5698402909980532]), 1.0)
    pair = np.where(np.sum(pair, axis=1, keepdims=True) > 1.0, 1.0 - pair, pair)
    weights = np.column_stack([pair, 1.0 - np.sum(pair, axis=1)])
    return 0.1 / 3.0 + 0.9 * weights


def winding_number(vertices: FloatArray, triangles: IntArray, point: FloatArray) -> float:
    """Return how often closed shells go round a point: the sum of the solid angles over 4 pi.

    The solid angle of a triangle is from A. van Oosterom and J. Strackee, "The solid angle of a plane triangle", IEEE
    Trans. Biomed. Eng. 30 (1983) 125.
    """
    a, b, c = (vertices[triangles[:, corner]] - point for corner in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    base = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(np.sum(np.arctan2(volume, base))) / (2 * np.pi)


_SIZE = optional(number("a positive number", above=0.0))
_MESH = instance("a mesh, as closed_mesh makes it", TriangleMesh)


@takes(ParameterError, mesh=_MESH, density=_SIZE, mass=_SIZE)
def mesh_solid(mesh: TriangleMesh, *, density: float | None = None, mass: float | None = None) -> MassProperties:
    """Return the mass properties of the homogeneous body that a closed mesh bounds, in the frame of its vertices.

    Parameters
    ----------
    mesh
        From `closed_mesh`.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.

    Notes
    -----
    The integrals of 1, x and x x^T over the body are sums over the tetrahedra between each triangle (a, b, c) and a
    fixed point taken as origin: with d = a . (b x c), they are d/6, d/24 s and d/120 (s s^T + a a^T + b b^T + c c^T),
    where s = a + b + c. They are exact, and equal those over faces by the divergence theorem of B. Mirtich, "Fast and
    accurate computation of polyhedral mass properties", J. Graphics Tools 1 (1996) 31, and D. Eberly, "Polyhedral mass
    properties (revisited)" (2002). The fixed point is the middle of the mesh, so that a body far from its origin loses
    no digits.
    """
    if (density is None) == (mass is None):
        found = "neither is given" if mass is None else "both are given"
        raise ParameterError(f"a mesh needs a density or a mass, and {found}", advice="Give density= or mass=.")
    middle = (np.min(mesh.vertices, axis=0) + np.max(mesh.vertices, axis=0)) / 2
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] - middle for corner in range(3))
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    sums = a + b + c
    volume = float(np.sum(six_volumes)) / 6
    centre = np.einsum("i,ij->j", six_volumes, sums) / 24 / volume
    squares = sum(np.einsum("i,ij,ik->jk", six_volumes, side, side) for side in (sums, a, b, c)) / 120
    about_centre = squares - volume * np.outer(centre, centre)
    inertia = np.trace(about_centre) * np.eye(3) - about_centre
    scale = (mass or 0.0) / volume if density is None else density
    return MassProperties(scale * volume, middle + centre, scale * (inertia + inertia.T) / 2)


@takes(
    ParameterError,
    path=FILE,
    density=_SIZE,
    mass=_SIZE,
    scale=number("a positive number", above=0.0),
    tolerance=number("a number from 0 to 1", least=0.0, most=1.0),
)
def stl_solid(
    path: str | Path,
    *,
    density: float | None = None,
    mass: float | None = None,
    scale: float = 1.0,
    tolerance: float = 1e-6,
) -> MassProperties:
    """Return the mass properties of the homogeneous body in an STL file, in the frame of the file.

    Parameters
    ----------
    path
        An ASCII or binary STL file.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.
    scale
        Metres per unit of the file, which does not say its unit: 1e-3 for a drawing in millimetres.
    tolerance
        Distance below which corners are one, relative to the size of the mesh (see `closed_mesh`).

    Raises
    ------
    ParameterError
        If the file cannot be read or its mesh is not closed.
    """
    mesh = closed_mesh(read_stl(path) * scale, tolerance=tolerance, where=str(path))
    return mesh_solid(mesh, density=density, mass=mass)
