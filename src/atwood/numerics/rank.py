"""The rank of a matrix that is known to within errors, its independent rows, and the spaces that follow from it.

By singular values: what is added to a matrix moves none of them by more than its own 2-norm (H. Weyl, Math. Annalen
71, 1912; G. W. Stewart and J. Sun, *Matrix Perturbation Theory*, 1990, corollary IV.4.10). So a singular value above
the error of the whole matrix is there in truth, and one below may be nothing; `significant` decides.

Row by row: each row of a Jacobian comes with its error, which is how far rounding can take it
(`atwood.simulation.dynamics.rounding`), and is independent of others if more is left of it than the errors of all
together account for. So a row that is nothing but rounding counts as zero, whatever its size, and a row that is small
but known well does not. Nothing is compared with a number that would depend on where a scene stands, how it is turned,
or in what units it is.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Sequence
from math import sqrt
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import BoolArray, FloatArray, IntArray
from atwood.clock import within_time
from atwood.codegen.rounding import ROUGHNESS
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import Matrix, is_best_full, is_full, least_squares, or_one, scaled, to_array
from atwood.numerics.sparse import csr_blocks, csr_made_of, csr_row_sizes, rows_are_independent
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


def least_inertia(mass: FloatArray) -> float:
    """Return the least eigenvalue of a mass matrix in units of its diagonal; zero where that is not all positive."""
    own = np.diag(mass)
    if not (np.isfinite(mass).all() and np.all(own > 0.0)):
        return 0.0
    return float(np.min(np.linalg.eigvalsh(mass / np.sqrt(own[:, None] * own)), initial=1.0))


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


_LEVEL = 0.03
"""Of rows that are independent of those chosen, the first is chosen of which this share of the largest is left.

In declared order those that are dropped come last, as one expects; but a row that hardly changes would make the
multipliers of all that follow inaccurate.
"""

_POOR, _SETTLED = 3.0, 1.5
"""A choice of rows is poor where another takes one of it more often; exchanges go on until none does by so much."""

_ALIKE = 0.99
"""Exchanges that are as good as the best up to this are alike, as they are in symmetric scenes: the last is made, so
that rounding has no say in it."""

_LOOK = 1e-4
"""While more than this share of the largest row is left, errors of the chosen rows cannot matter."""


def row_sizes(jacobian: Matrix, scales: FloatArray) -> FloatArray:
    """Return the largest entry of each row after its columns are scaled, shape (rows,)."""
    if is_full(jacobian):
        return np.asarray(np.abs(jacobian * scales).max(axis=1, initial=0.0))
    return csr_row_sizes(jacobian, scales)


def row_scales(jacobian: Matrix, scales: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the size of each row: how much it changes when a coordinate changes by its scale, if that is known."""
    return trusted_sizes(row_sizes(jacobian, scales), errors)


def trusted_sizes(sizes: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the size of each row from its largest entry, of shape (..., rows); see `row_scales`."""
    rows = np.maximum(sizes, tolerances.TRUSTED * errors)
    return or_one(rows)


def certain(errors: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return what is not rounding alone if it is exceeded."""
    return tolerances.CERTAIN * _at_least(errors, sizes)


def _at_least(errors: FloatArray, sizes: FloatArray) -> FloatArray:
    return np.maximum(errors, ROUGHNESS * sizes)  # what is exact now is not known to be so


def independent_rows(
    matrix: Matrix, errors: FloatArray, most: int | None = None, first: NDArray[np.bool_] | None = None
) -> list[int]:
    """Return the numbers of independent rows, as many as there are, and rather the first than the last ones."""
    errors = _at_least(errors, row_sizes(matrix, np.ones(matrix.shape[1])))
    if not is_full(matrix):
        if most is None:
            return _of_blocks(matrix, errors, first)
        matrix = to_array(matrix)
    # In these units a row of the size of the terms that it was computed from has size one.
    units = np.where(errors > 0.0, errors / ROUGHNESS, 1.0)
    most = min(matrix.shape) if most is None else min(*matrix.shape, most)
    return _chosen(matrix / units[:, None], errors / units, most, first)


def _of_blocks(matrix: Matrix, errors: FloatArray, first: NDArray[np.bool_] | None) -> list[int]:
    """Return the independent rows of a large matrix: those of each part of it that shares no unknown with others."""
    if _is_clear(matrix, errors):
        return list(range(matrix.shape[0]))
    blocks = csr_blocks(matrix)
    alone = np.array([block[0] for block in blocks if len(block) == 1], dtype=np.intp)
    lengths = np.sqrt((matrix * matrix).sum(axis=1))
    kept = alone[lengths[alone] > tolerances.CERTAIN * errors[alone]].tolist()
    for block in blocks:
        if len(block) == 1:
            continue
        rows = matrix[block]
        part, own = rows[:, np.unique(rows.indices)], None if first is None else first[block]
        is_small = is_best_full(part.shape, part.nnz) or len(blocks) == 1
        found = independent_rows(part.toarray() if is_small else part, errors[block], first=own)
        kept += block[found].tolist()
    return sorted(kept)


def _chosen(rows: FloatArray, errors: FloatArray, most: int, first: NDArray[np.bool_] | None) -> list[int]:
    """Return the rows that Gram and Schmidt's method keeps, each time one of those of which most is left."""
    left = rows.copy()
    sizes = _lengths(left)
    chosen: list[int] = []
    basis = np.empty((most, rows.shape[1]))
    is_open, is_first = np.ones(len(rows), dtype=bool), np.zeros(len(rows), dtype=bool) if first is None else first
    while len(chosen) < most:
        bounds = tolerances.CERTAIN * errors
        largest = float(sizes.max(where=is_open, initial=0.0))
        if chosen and largest < _LOOK:
            weights = least_squares(rows[chosen].T, rows.T)
            bounds = tolerances.CERTAIN * np.sqrt(errors**2 + errors[chosen] ** 2 @ weights**2)
        is_open &= sizes > bounds
        if not is_open.any():
            break
        before = is_open & is_first
        among = before if before.any() else is_open
        i = int((among & (sizes >= _LEVEL * sizes.max(where=among, initial=0.0))).argmax())
        direction = left[i] / sizes[i]
        known = basis[: len(chosen)]
        direction = direction - (known @ direction) @ known  # once more, against rounding
        direction /= sqrt(direction.dot(direction))
        basis[len(chosen)] = direction
        chosen.append(i)
        is_open[i] = False
        left -= (left @ direction)[:, None] * direction
        sizes = _lengths(left)
    return sorted(chosen)


def _lengths(rows: FloatArray) -> FloatArray:
    """Return the length of each row; NumPy's own function takes longer than that for few."""
    return np.asarray(np.sqrt((rows * rows).sum(axis=1)))


def review_rows(
    matrix: Matrix, errors: FloatArray, kept: Sequence[int], first: NDArray[np.bool_] | None = None
) -> list[int]:
    """Return a better choice of independent rows if a choice has become poor, else the same one.

    A choice is good if what the other rows are made of takes no row of it many times, each measured by the terms that
    it is computed from: exchanging two rows multiplies the volume of the choice by that number.
    """
    chosen = list(kept)
    others = [i for i in range(matrix.shape[0]) if i not in set(chosen)]
    units = np.where(errors > 0.0, errors / ROUGHNESS, 1.0)
    rows, bound = scaled(matrix, np.ones(matrix.shape[1]), units), _POOR
    for _ in range(10 * len(chosen)):
        if not others:
            break
        made_of = _made_of(rows[chosen], rows[others])
        left = to_array(rows[others]) - made_of @ to_array(rows[chosen])
        if not np.max(np.abs(left), initial=0.0) <= _LOOK:  # the choice itself is not independent here
            return independent_rows(matrix, errors, len(kept), first)
        weights = np.abs(made_of)
        if first is not None:
            weights[np.outer(~first[others], first[chosen])] = 0.0
        alike = np.argwhere(weights >= _ALIKE * weights.max(initial=0.0))
        this, that = alike[-1]
        if weights[this, that] <= bound:
            break
        others[int(this)], chosen[int(that)], bound = chosen[int(that)], others[int(this)], _SETTLED
    return sorted(chosen)


def _made_of(kept: Matrix, others: Matrix) -> FloatArray:
    """Return how often each kept row is in others, shape (others, kept)."""
    if is_full(kept):
        return np.asarray(least_squares(kept.T, others.T).T)
    return csr_made_of(kept, others)


def _is_clear(matrix: Matrix, errors: FloatArray) -> bool:
    """Return whether it is certain, for a large matrix, that no row depends on others."""
    sizes = row_sizes(matrix, np.ones(matrix.shape[1]))
    return bool(np.all(sizes > errors / _LOOK)) and rows_are_independent(matrix, tolerances.CLEAR)


def independent_by_groups(matrix: Any, groups: NDArray[np.intp]) -> bool:
    """Return whether groups of rows can be taken away, one after another, that are independent of all that is left.

    Such a group has columns in which no other row has entries, and its rows are independent in these. Where loops are
    left the answer is no, whatever their rows are.
    """
    rows_of: dict[int, list[int]] = defaultdict(list)
    for row, group in enumerate(groups.tolist()):
        rows_of[group].append(row)
    starts, indices, entries = matrix.indptr.tolist(), matrix.indices.tolist(), matrix.data.tolist()
    columns_of = {
        group: {column for row in rows for column in indices[starts[row] : starts[row + 1]]}
        for group, rows in rows_of.items()
    }
    users: dict[int, set[int]] = defaultdict(set)
    for group, columns in columns_of.items():
        for column in columns:
            users[column].add(group)
    waiting, gone = deque(rows_of), set[int]()
    while waiting:
        group = waiting.popleft()
        if group in gone:
            continue
        alone = {column: k for k, column in enumerate(c for c in columns_of[group] if len(users[c]) == 1)}
        block = np.zeros((len(rows_of[group]), len(alone)))
        if block.shape[0] > block.shape[1]:
            continue
        for i, row in enumerate(rows_of[group]):
            for k in range(starts[row], starts[row + 1]):
                if indices[k] in alone:
                    block[i, alone[indices[k]]] = entries[k]
        if not is_clear(block):
            continue
        gone.add(group)
        for column in columns_of[group]:
            users[column].discard(group)
            if len(users[column]) == 1:
                waiting.extend(users[column])
    return len(gone) == len(rows_of)
