"""Matrices as arrays where scenes are small, by their entries where they are large, and solutions of their systems.

What touches what in a mechanism is local, so that a matrix of thousands of rows has a handful of entries in each. A
system need not be square: its solution is the shortest, or the best.
"""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import ComplexArray, FloatArray
from atwood.numerics.sparse import csr_least_norm, csr_of, csr_scaled
from atwood.tolerances import tolerances

Matrix: TypeAlias = Any
"""An array of shape (rows, columns), or for large scenes a `scipy.sparse.csr_array`."""

LARGEST_FULL = 240
"""Matrices with more rows or columns are kept by their entries; below, arrays are as fast and need no more imports."""

LARGEST_FULL_OF_MANY = 16
"""The same for matrices at many states at once: work on entries is then done for all states together.

For the balance of forces of 400 states of chains of 10, 20, 40 and 100 links, arrays take 7, 6, 16 and 72 times as
long.
"""

_DENSE, _DENSE_OF_MANY = 0.1, 0.3
"""Share of entries above which nothing is gained by leaving out zeros."""


def is_full(matrix: Matrix) -> bool:
    """Return whether a matrix is a plain array."""
    return isinstance(matrix, np.ndarray)


def is_best_full(shape: tuple[int, int], entries: int, many: bool = False) -> bool:
    """Return whether a matrix is better kept as an array: because it is small, or because it is full anyhow."""
    largest, dense = (LARGEST_FULL_OF_MANY, _DENSE_OF_MANY) if many else (LARGEST_FULL, _DENSE)
    return max(shape) <= largest or entries > dense * shape[0] * shape[1]


def from_entries(rows: Any, columns: Any, entries: Any, shape: tuple[int, int], full: bool | None = None) -> Matrix:
    """Return the matrix with the given entries, each place at most once."""
    if is_best_full(shape, len(entries)) if full is None else full:
        made = np.zeros(shape)
        made[rows, columns] = entries
        return made
    return csr_of(rows, columns, entries, shape)


def to_array(matrix: Matrix) -> FloatArray:
    """Return a matrix as an array, whatever its size."""
    return np.asarray(matrix if is_full(matrix) else matrix.toarray())


def or_one(sizes: FloatArray) -> FloatArray:
    """Return sizes to divide by: one in place of those that are zero."""
    return np.where(sizes > 0.0, sizes, 1.0)


def scaled(matrix: Matrix, columns: FloatArray, rows: FloatArray | None = None) -> Matrix:
    """Return a matrix with each column multiplied by one number, and each row divided by another."""
    if is_full(matrix):
        wide = matrix * columns
        return wide if rows is None else wide / rows[:, None]
    return csr_scaled(matrix, columns, rows)


_Numbers = TypeVar("_Numbers", FloatArray, ComplexArray)

_UNCLEAR = 1e-4
"""Where a place misses what is to be met by more, all directions help; what rounding makes of them is little then."""

_FLAT = 1e-3
"""Columns are scaled alike down to this share of the largest: one in which only rounding is stays as small as it is."""


def least_norm(
    matrix: Matrix, right: FloatArray, unit: float = 0.0, miss: float = 0.0, errors: float | None = None
) -> FloatArray:
    """Return the shortest solution of a linear system, or the best where there is none.

    Directions whose singular values are errors of the matrix are not followed (G. Golub and C. Van Loan, *Matrix
    Computations*, section 5.5.3).
    """
    least = tolerances.RANK if errors is None else errors
    if not is_full(matrix):
        is_nothing = unit and np.abs(matrix.data).max(initial=0.0) < least * unit
        return np.zeros(matrix.shape[1]) if is_nothing else csr_least_norm(matrix, right)
    if matrix.ndim > 2:
        return np.asarray(np.linalg.pinv(matrix, rcond=least) @ right, dtype=float)
    _check_finite(matrix, right)
    if unit and np.abs(matrix).max(initial=0.0) < least * unit:
        return np.zeros(matrix.shape[1])
    least = max(least, miss if miss < _UNCLEAR else 0.0)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=least)[0], dtype=float)


def least_squares(matrix: _Numbers, right: _Numbers) -> _Numbers:
    """Return what solves a linear system best, where columns are independent by construction and no rank is asked."""
    _check_finite(matrix, right)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def solve_even(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of a square system, with rows and columns scaled alike so that singular means singular."""
    if not matrix.size:
        return np.zeros(right.shape)
    size = or_one(np.sqrt(np.maximum(np.max(np.abs(matrix), axis=-1), np.max(np.abs(matrix), axis=-2))))
    columns = right if right.ndim == matrix.ndim else right[..., None]
    found = np.linalg.solve(matrix / size[..., :, None] / size[..., None, :], columns / size[..., None])
    return np.asarray((found / size[..., None]).reshape(right.shape))


def _check_finite(*arrays: _Numbers) -> None:
    """Refuse what some machines' libraries would work on for ever."""
    if not all(np.isfinite(one).all() for one in arrays):
        raise np.linalg.LinAlgError("a linear system has entries that are not finite")


def least_size(jacobian: FloatArray, kept: NDArray[np.intp], multipliers: FloatArray) -> FloatArray:
    """Return the multipliers of all rows of least size that have the force of some of the independent ones.

    What other rows are made of, ``G_r = W G_k``, gives all that exert no force: no small number has to be called zero.
    """
    others = np.setdiff1d(np.arange(jacobian.shape[1]), kept)
    found = np.zeros(jacobian.shape[:2])
    if not len(kept):
        return found
    columns = np.max(np.abs(jacobian[:, kept]), axis=1)
    columns = np.maximum(columns, _FLAT * np.max(columns, axis=1, keepdims=True))
    even = jacobian / or_one(columns)[:, None, :]
    rows = np.max(np.abs(even[:, kept]), axis=2)[:, :, None]
    weights = even[:, others] @ np.linalg.pinv(even[:, kept] / rows) / np.swapaxes(rows, 1, 2)
    found[:, kept] = multipliers
    without_force = np.zeros((*found.shape, len(others)))
    without_force[:, kept], without_force[:, others] = -np.swapaxes(weights, 1, 2), np.eye(len(others))
    basis = np.linalg.qr(without_force)[0]
    return np.asarray(found - (basis @ (np.swapaxes(basis, 1, 2) @ found[:, :, None]))[:, :, 0])
