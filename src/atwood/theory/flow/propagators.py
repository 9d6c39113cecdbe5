"""What linear equations ``z' = A(t) z`` do over single steps, by collocation at the points of Gauss and Legendre.

With s points the order is 2 s (Hairer, Norsett and Wanner, Solving ODEs I, theorem II.7.8).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from atwood.arrays import FloatArray
from atwood.integrators.gauss.tableau import tableau

__all__ = ["POINTS", "node_times", "propagators"]

POINTS = 6
"""In each step."""

_ENTRIES = 4_000_000
"""So many numbers of the equations of steps are held at a time."""


@cache
def _method() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the points c in a step from 0 to 1, the matrix a and the weights b of the method."""
    found = tableau(2 * POINTS)
    weights = np.array(found.weights)
    return np.array(found.nodes), np.array(found.shares) * weights, weights


def node_times(edges: FloatArray) -> FloatArray:
    """Return the times at which steps want to know A, shape (steps, points).

    Parameters
    ----------
    edges
        Starts and ends of the steps: step k goes from ``edges[k, 0]`` to ``edges[k, 1]``; s.
    """
    points, _, _ = _method()
    return edges[:, :1] + np.diff(edges, axis=1) * points


def propagators(matrices: FloatArray, steps: FloatArray) -> FloatArray:
    """Return what steps do: z at the end of each from z at its start, shape (steps, m, m).

    Parameters
    ----------
    matrices
        A at the points of each step, shape (steps, points, m, m).
    steps
        Their lengths, s.
    """
    _, a, b = _method()
    count, points, size, _ = matrices.shape
    found = np.empty((count, size, size))
    block = max(1, _ENTRIES // (points * size) ** 2)
    for first in range(0, count, block):
        own, length = matrices[first : first + block], steps[first : first + block]
        # K_i = A_i (1 + h sum_j a_ij K_j)
        whole = -(length[:, None, None, None, None] * a[:, None, :, None] * own[:, :, :, None, :])
        whole = whole.reshape(len(own), points * size, points * size)
        whole[:, range(points * size), range(points * size)] += 1.0
        rates = np.linalg.solve(whole, own.reshape(len(own), points * size, size)).reshape(own.shape)
        found[first : first + block] = np.eye(size) + length[:, None, None] * np.einsum("j,kjab->kab", b, rates)
    return found
