"""Matrices of small scenes as arrays, of large ones by their entries; the same questions asked of both.

What touches what in a mechanism is local, so that a matrix of thousands of rows has a handful of entries in each.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "LARGEST_FULL",
    "LARGEST_FULL_OF_MANY",
    "Matrix",
    "from_entries",
    "independent_rows",
    "is_best_full",
    "is_full",
    "least_norm",
    "row_scales",
    "scaled",
    "to_array",
]

FloatArray: TypeAlias = NDArray[np.float64]
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

_RANK = 1e-9
"""Relative size below which a direction counts as lost."""


def is_full(matrix: Matrix) -> bool:
    """Return whether a matrix is a plain array."""
    return isinstance(matrix, np.ndarray)


def is_best_full(shape: tuple[int, int], entries: int, many: bool = False) -> bool:
    """Return whether a matrix is better kept as an array: because it is small, or because it is full anyhow.

    Parameters
    ----------
    shape
        Rows and columns.
    entries
        How many are not always zero.
    many
        Whether there is one for each of many states.
    """
    largest, dense = (LARGEST_FULL_OF_MANY, _DENSE_OF_MANY) if many else (LARGEST_FULL, _DENSE)
    return max(shape) <= largest or entries > dense * shape[0] * shape[1]


def from_entries(rows: Any, columns: Any, entries: Any, shape: tuple[int, int], full: bool | None = None) -> Matrix:
    """Return the matrix with the given entries, each place at most once.

    Parameters
    ----------
    rows, columns, entries
        The entries and where they are.
    shape
        Rows and columns.
    full
        Whether it is to be an array; None for what is better.
    """
    if is_best_full(shape, len(entries)) if full is None else full:
        made = np.zeros(shape)
        made[rows, columns] = entries
        return made
    from atwood.solve.sparse import csr_of

    return csr_of(rows, columns, entries, shape)


def to_array(matrix: Matrix) -> FloatArray:
    """Return a matrix as an array, whatever its size."""
    found: FloatArray = matrix if is_full(matrix) else matrix.toarray()
    return found


def scaled(matrix: Matrix, columns: FloatArray, rows: FloatArray | None = None) -> Matrix:
    """Return a matrix with each column multiplied by one number, and each row divided by another."""
    if is_full(matrix):
        wide = matrix * columns
        return wide if rows is None else wide / rows[:, None]
    from atwood.solve.sparse import csr_scaled

    return csr_scaled(matrix, columns, rows)


def row_scales(slope: Matrix, scales: FloatArray) -> FloatArray:
    """Return the size of each constraint: how much it changes when a coordinate changes by its scale."""
    rows: FloatArray
    if is_full(slope):
        rows = np.max(np.abs(slope * scales), axis=1, initial=0.0)
    else:
        from atwood.solve.sparse import csr_row_sizes

        rows = csr_row_sizes(slope, scales)
    rows[rows == 0.0] = 1.0
    return rows


def least_norm(matrix: Matrix, right: FloatArray) -> FloatArray:
    """Return the shortest solution of a linear system, or the best where there is none."""
    if is_full(matrix):
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=_RANK)[0], dtype=float)
    from atwood.solve.sparse import csr_least_norm

    return csr_least_norm(matrix, right)


def independent_rows(matrix: Matrix, tolerance: float = 1e-7) -> list[int]:
    """Return the numbers of rows that depend on none before them (Gram-Schmidt, twice for safety)."""
    if not is_full(matrix):
        from atwood.solve.sparse import rows_are_independent

        if rows_are_independent(matrix, tolerance):
            return list(range(matrix.shape[0]))
        matrix = matrix.toarray()
    kept: list[int] = []
    basis = np.empty((min(matrix.shape), matrix.shape[1]))
    for i, row in enumerate(matrix):
        size = float(np.linalg.norm(row))
        if size == 0.0 or len(kept) == len(basis):
            continue
        known = basis[: len(kept)]
        left = row / size
        for _ in range(2):
            left = left - (known @ left) @ known
        rest = float(np.linalg.norm(left))
        if rest > tolerance:
            basis[len(kept)] = left / rest
            kept.append(i)
    return kept
