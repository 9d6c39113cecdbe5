"""The shells of a closed mesh: which triangles hang together, and whether each shell faces the right way."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray, IntArray
from atwood.errors import ParameterError

__all__ = ["check_overlap", "check_shells", "signed_volume", "split_shells", "winding_number"]


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
    """Return the numbers of the triangles of each shell: what hangs together by edges.

    Parameters
    ----------
    triangles
        Shape (m, 3), every edge shared by exactly two triangles.
    """
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

    Raises
    ------
    ParameterError
        If a shell faces the wrong way or bodies overlap, with the place of the shell.
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

    Raises
    ------
    ParameterError
        If the mesh cuts through itself, with a place.
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
