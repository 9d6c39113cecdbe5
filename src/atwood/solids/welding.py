"""Which corners of loose triangles are the same vertex."""

from __future__ import annotations

from itertools import product

import numpy as np

from atwood.arrays import FloatArray, IntArray

__all__ = ["weld"]


def weld(points: FloatArray, distance: float) -> tuple[FloatArray, IntArray]:
    """Make one vertex out of points that coincide.

    Parameters
    ----------
    points
        Shape (n, 3).
    distance
        Points whose coordinates differ by no more than this are one vertex, and so are chains of such points; zero
        for points that are equal. Points further apart than four times this are never joined directly.

    Returns
    -------
    vertices : ndarray, shape (k, 3)
        For each vertex the first of its points.
    numbers : ndarray, shape (n,)
        The vertex of each point.
    """
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
