"""Steps over a motion that are as long as its variational equations allow, and what they do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError
from atwood.late import dataclass
from atwood.theory.flow.propagators import POINTS, node_times, propagators

__all__ = ["Steps", "find_steps"]

_HALVINGS = 16
"""A step is halved at most so often."""

_ROUNDING = 1e-13
"""Relative: what one step does is known no better."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps one after another.

    Attributes
    ----------
    edges
        Where they begin and end, s, shape (steps + 1,).
    propagators
        What they do to deviations, shape (steps, m, m).
    """

    edges: FloatArray
    propagators: FloatArray


def find_steps(
    field: Callable[[FloatArray], FloatArray], edges: FloatArray, sizes: FloatArray, tolerance: float, where: str
) -> Steps:
    """Choose steps so that each does the same, within a tolerance, as two of half its length.

    Parameters
    ----------
    field
        Gives the matrices of the equations at times, shape (times, m, m).
    edges
        Steps to begin with, s; each is halved until it is short enough.
    sizes
        What a deviation is compared with, shape (m,).
    tolerance
        Relative to what a step does.
    where
        The scene, for the error.

    Raises
    ------
    SolveError
        If steps become too short.
    """

    def taken(pieces: FloatArray) -> FloatArray:
        matrices = field(node_times(pieces).ravel())
        size = matrices.shape[-1]
        return propagators(matrices.reshape(len(pieces), POINTS, size, size), np.diff(pieces, axis=1)[:, 0])

    pending = np.stack([edges[:-1], edges[1:]], axis=1)
    whole = taken(pending)
    begun, done = [np.zeros(0)], [whole[:0]]
    for _ in range(_HALVINGS):
        middle = np.mean(pending, axis=1, keepdims=True)
        pieces = np.stack([np.hstack([pending[:, :1], middle]), np.hstack([middle, pending[:, 1:]])], axis=1)
        halves = taken(pieces.reshape(-1, 2)).reshape(len(pending), 2, *whole.shape[1:])
        composed = halves[:, 1] @ halves[:, 0]
        scaled = composed / sizes[:, None] * sizes
        missed = np.max(np.abs((composed - whole) / sizes[:, None] * sizes), axis=(1, 2))
        fine = missed <= max(tolerance, _ROUNDING) * np.max(np.abs(scaled), axis=(1, 2))
        begun.append(pending[fine, 0])
        done.append(composed[fine])
        if np.all(fine):
            break
        pending, whole = pieces[~fine].reshape(-1, 2), halves[~fine].reshape(-1, *whole.shape[1:])
    else:
        raise SolveError(
            f"neighbouring motions move too fast beside this one at t = {pending[0, 0]:.9g} s",
            where=where,
            advice="Let the motion end before, or ask for a larger rtol.",
        )
    order = np.argsort(np.concatenate(begun))
    return Steps(np.append(np.concatenate(begun)[order], edges[-1]), np.concatenate(done)[order])
