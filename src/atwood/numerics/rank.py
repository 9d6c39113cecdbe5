"""The rank of a matrix that is known to within errors, and the spaces that follow from it.

What is added to a matrix moves no singular value by more than its own 2-norm (H. Weyl, Math. Annalen 71, 1912; G. W.
Stewart and J. Sun, *Matrix Perturbation Theory*, 1990, corollary IV.4.10). So a singular value above the error of the
whole matrix is there in truth, and one below may be nothing. All decisions by singular values are made here, in
`significant`; decisions row by row, with propagated rounding, are in `atwood.numerics.independence`.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from atwood.arrays import BoolArray, FloatArray, IntArray
from atwood.clock import within_time
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import or_one
from atwood.tolerances import tolerances

Errors: TypeAlias = float | FloatArray | None
"""How far a matrix may be off: a number bounds the 2-norm of all that may be wrong in it, an array the length of what
may be wrong in each row, or each entry. None for a matrix that is known to rounding alone: `tolerances.RANK` of it."""


@dataclass(frozen=True, eq=False)
class Decomposition:
    """The singular value decomposition of a matrix, with its rank decided.

    Attributes
    ----------
    left, values, right
        ``matrix = left[:, :k] @ diag(values) @ right[:k]``, values in descending order.
    rank
        How many of the values are no error.
    """

    left: FloatArray
    values: FloatArray
    right: FloatArray
    rank: int

    @property
    def null_space(self) -> FloatArray:
        """Orthonormal columns that the matrix takes to zero."""
        return self.right[self.rank :].T

    @property
    def row_space(self) -> FloatArray:
        """Orthonormal columns that are combinations of its rows."""
        return self.right[: self.rank].T

    @property
    def range(self) -> FloatArray:
        """Orthonormal columns that are combinations of its columns."""
        return self.left[:, : self.rank]

    @property
    def left_null_space(self) -> FloatArray:
        """Orthonormal columns, as many as combinations of its rows are zero."""
        return self.left[:, self.rank :]


def significant(values: FloatArray, errors: Errors = None) -> BoolArray:
    """Return which singular values are there in truth; of stacks of matrices, for each."""
    if errors is None:
        return np.asarray(values > tolerances.RANK * values[..., :1])
    return np.asarray(values > (float(np.linalg.norm(errors)) if isinstance(errors, np.ndarray) else errors))


def decompose(
    matrix: FloatArray, errors: Errors = None, rank: int | None = None, is_whole: bool = True
) -> Decomposition:
    """Return the singular value decomposition of a matrix, with its rank."""
    left, values, right = within_time(lambda: np.linalg.svd(matrix, full_matrices=is_whole))
    return Decomposition(left, values, right, int(np.sum(significant(values, errors))) if rank is None else rank)


def singular_values(matrix: FloatArray) -> FloatArray:
    """Return the singular values of a matrix, or of each of a stack, the largest first."""
    return np.asarray(np.linalg.svd(matrix, compute_uv=False))


def rank(matrix: FloatArray, errors: Errors = None) -> int:
    """Return the rank of a matrix; see `decompose`."""
    return int(ranks(matrix, errors))


def ranks(matrices: FloatArray, errors: Errors = None) -> IntArray:
    """Return the rank of each of a stack of matrices; see `decompose`."""
    return np.asarray(np.sum(significant(singular_values(matrices), errors), axis=-1))


def null_space(matrix: FloatArray, errors: Errors = None, rank: int | None = None) -> FloatArray:
    """Return an orthonormal basis, as columns, of what a matrix takes to zero; see `decompose`.

    Of a stack of matrices, whose rank must be given, a stack of bases.
    """
    if matrix.ndim > 2:
        return np.swapaxes(np.linalg.svd(matrix)[2][..., rank:, :], -1, -2)
    return decompose(matrix, errors, rank).null_space


def span(matrix: FloatArray, errors: Errors = None) -> FloatArray:
    """Return an orthonormal basis, as columns, of what the columns of a matrix span; see `decompose`."""
    return decompose(matrix, errors, is_whole=False).range


def is_clear(rows: FloatArray) -> bool:
    """Return whether rows of size one are independent beyond doubt, so that no place near by need be asked."""
    return bool(singular_values(rows)[-1:].sum() > tolerances.CLEAR)


def lost_rank(values: FloatArray, away: float) -> int:
    """Return how many of some rows follow from the others at a singular position."""
    return int(np.sum(values < tolerances.SINGULAR * away))


def open_directions(matrix: FloatArray, errors: Errors = 0.0) -> FloatArray:
    """Return orthonormal directions, one row each, along which independent rows do not change."""
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    found = decompose(matrix / or_one(sizes), errors, None if errors else len(matrix))
    return found.null_space.T
