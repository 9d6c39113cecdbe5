"""The shells of a closed mesh: which triangles hang together, and whether each shell faces the right way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.errors import ParameterError

__all__ = ["check_shells", "signed_volume", "split_shells", "winding_number"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PROBES = 7
"""How many triangles of a shell are asked on which side of the other shells they are."""


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
