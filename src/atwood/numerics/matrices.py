"""Matrices of small scenes as arrays, of large ones by their entries; the same questions asked of both.

What touches what in a mechanism is local, so that a matrix of thousands of rows has a handful of entries in each.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from atwood.arrays import FloatArray

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
    from atwood.numerics.sparse import csr_of

    return csr_of(rows, columns, entries, shape)


def to_array(matrix: Matrix) -> FloatArray:
    """Return a matrix as an array, whatever its size."""
    found: FloatArray = matrix if is_full(matrix) else matrix.toarray()
    return found


def or_one(sizes: FloatArray) -> FloatArray:
    """Return sizes to divide by: one in place of those that are zero."""
    return np.where(sizes > 0.0, sizes, 1.0)


def scaled(matrix: Matrix, columns: FloatArray, rows: FloatArray | None = None) -> Matrix:
    """Return a matrix with each column multiplied by one number, and each row divided by another."""
    if is_full(matrix):
        wide = matrix * columns
        return wide if rows is None else wide / rows[:, None]
    from atwood.numerics.sparse import csr_scaled

    return csr_scaled(matrix, columns, rows)
