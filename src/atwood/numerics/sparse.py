"""Linear algebra on the entries of large matrices; SciPy is loaded only where there are such.

Least-norm solutions come from the normal equations with a small multiple of the unit matrix added, whose influence
later passes take out again: each multiplies what is missing in a direction by ``d / (s^2 + d)``, where s is its
singular value (iterated regularisation, Engl, Hanke and Neubauer, Regularization of Inverse Problems, section 5.1).
Directions in which nothing acts keep their zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.lazy_modules import scipy

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_SHARE = 1e-10
"""What is added to the normal equations, relative to their largest diagonal entry."""

_PASSES, _ITERATIONS = 12, 40
_BLOCK = 256


def csr_of(rows: Any, columns: Any, entries: Any, shape: tuple[int, int]) -> csr_array:
    """Return the matrix with the given entries."""
    places = np.asarray(rows, dtype=np.int32), np.asarray(columns, dtype=np.int32)
    return scipy.sparse.csr_array((np.asarray(entries, dtype=float), places), shape=shape)


def csr_scaled(matrix: Any, columns: FloatArray, rows: FloatArray | None) -> csr_array:
    """Return a matrix with each column multiplied by one number, and each row divided by another."""
    wide = scipy.sparse.csr_array(matrix @ scipy.sparse.diags_array(columns))
    return wide if rows is None else scipy.sparse.csr_array(scipy.sparse.diags_array(1.0 / rows) @ wide)


def csr_row_sizes(matrix: Any, scales: FloatArray) -> FloatArray:
    """Return the largest absolute value in each row after scaling its columns."""
    wide = abs(csr_scaled(matrix, scales, None))
    return np.asarray(wide.max(axis=1).toarray().ravel() if wide.nnz else np.zeros(wide.shape[0]))


def _factorised(square: Any, share: float) -> Any:
    """Return a solver for a symmetric matrix that is positive definite once a share of its size is added."""
    diagonal = square.diagonal()
    size = float(np.max(diagonal, initial=0.0)) or 1.0
    shifted = scipy.sparse.csc_array(square + (share * size) * scipy.sparse.eye_array(square.shape[0]))
    options = {"SymmetricMode": True}
    return scipy.sparse.linalg.splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def csr_least_norm(matrix: Any, right: FloatArray) -> FloatArray:
    """Return the shortest solution of a linear system, or the best where there is none."""
    wide = matrix.shape[0] <= matrix.shape[1]
    across = matrix.T.tocsr()
    solver = _factorised(matrix @ across if wide else across @ matrix, _SHARE)
    found = np.zeros(matrix.shape[1])
    last = np.inf
    for _ in range(_PASSES):
        missing = right - matrix @ found
        gradient = across @ missing
        size = float(np.linalg.norm(gradient))
        if not size < 0.5 * last:
            break
        last = size
        found = found + (across @ solver.solve(missing) if wide else solver.solve(gradient))
        if size == 0.0:
            break
    return found


def csr_blocks(matrix: Any) -> list[NDArray[np.intp]]:
    """Return the rows of each part of a matrix that shares no unknown with the others."""
    uses: Any = scipy.sparse.csr_array(matrix != 0.0)
    both: Any = scipy.sparse.block_array([[None, uses], [uses.T, None]])
    part_of = scipy.sparse.csgraph.connected_components(both, directed=False)[1][: matrix.shape[0]]
    order = np.argsort(part_of, kind="stable")
    return np.split(order, np.nonzero(np.diff(part_of[order]))[0] + 1)


def _row_normalised(matrix: Any) -> csr_array | None:
    sizes = np.sqrt((matrix * matrix).sum(axis=1))
    return None if np.any(sizes == 0.0) else scipy.sparse.csr_array(scipy.sparse.diags_array(1.0 / sizes) @ matrix)


def rows_are_independent(matrix: Any, tolerance: float) -> bool:
    """Return whether it is certain that no row depends on others: the smallest singular value is well above zero."""
    if matrix.shape[0] > matrix.shape[1]:
        return False
    unit = _row_normalised(matrix)
    if unit is None:
        return False
    value, _ = smallest_direction(unit @ unit.T.tocsr())
    return value > max(100.0 * tolerance**2, 1e-12)


def smallest_direction(square: Any) -> tuple[float, FloatArray]:
    """Return the smallest eigenvalue of a symmetric matrix without negative ones, relative to its size, and its vector.

    By inverse iteration, which comes from above.
    """
    n = square.shape[0]
    size = float(np.max(square.diagonal(), initial=0.0)) or 1.0
    solver = _factorised(square, 1e-15)
    vector = np.cos(np.arange(n) * np.sqrt(2.0)) + 0.01  # no symmetry singles it out
    vector /= np.linalg.norm(vector)
    value = np.inf
    for _ in range(_ITERATIONS):
        vector = solver.solve(vector)
        length = float(np.linalg.norm(vector))
        if not np.isfinite(length) or length == 0.0:
            return 0.0, np.full(n, 1.0 / np.sqrt(n))
        vector /= length
        last, value = value, float(vector @ (square @ vector)) / size
        if abs(last - value) <= 1e-2 * abs(value):
            break
    return max(value, 0.0), vector


def massless_directions(mass: Any, jacobian: Any, sizes: FloatArray) -> FloatArray | None:
    """Return how much each coordinate moves in a direction that nothing gives inertia to; None if there is none."""
    weight = scipy.sparse.diags_array(sizes)
    square = weight @ mass @ weight
    square = square / (float(np.max(square.diagonal(), initial=0.0)) or 1.0)
    if jacobian.shape[0]:
        held = jacobian @ weight
        held = scipy.sparse.diags_array(1.0 / np.maximum(csr_row_sizes(jacobian, sizes), 1e-300)) @ held
        square = square + held.T @ held
    value, vector = smallest_direction(scipy.sparse.csr_array(square))
    return np.abs(vector) if value <= 1e-14 else None


def csr_made_of(kept: Any, others: Any) -> FloatArray:
    """Return how often each of some independent rows is in others, shape (others, kept)."""
    solver = _factorised(scipy.sparse.csr_array(kept @ kept.T), 1e-15)
    return np.asarray(solver.solve((kept @ others.T).toarray()).T)


def free_columns(matrix: Any) -> NDArray[np.bool_]:
    """Return which unknowns of a linear system are not determined by it.

    These have a share in its null space: ``1 - (A^+ A)_ii`` is not zero.
    """
    matrix = matrix.copy()
    matrix.eliminate_zeros()
    single = np.diff(matrix.indptr) == 1
    own = np.unique(matrix[single].indices)  # given by themselves
    found = np.zeros(matrix.shape[1], dtype=bool)
    rest = np.setdiff1d(np.arange(matrix.shape[1]), own)
    if not len(rest):
        return found
    left = scipy.sparse.csr_array(matrix[:, rest])
    left = scipy.sparse.csr_array(left[np.diff(left.indptr) > 0])
    if not left.shape[0]:
        found[rest] = True
        return found
    solver = _factorised(left @ left.T.tocsr(), 1e-13)
    for start in range(0, len(rest), _BLOCK):
        columns = left[:, start : start + _BLOCK].toarray()
        inside = np.einsum("ij,ij->j", columns, solver.solve(columns))
        found[rest[start : start + _BLOCK]] = 1.0 - inside > 1e-6
    return found


def solve_bordered(
    mass: Any, jacobian: Any, bias: FloatArray, gamma: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return a and lambda of ``M a + bias = G^T lambda``, ``G a + gamma = 0``; None where they are not determined."""
    blocks = [[mass, -jacobian.T], [jacobian, None]]
    matrix = scipy.sparse.csc_array(scipy.sparse.block_array(blocks) if jacobian.shape[0] else mass)
    right = np.concatenate([-bias, -gamma])
    large = abs(matrix)
    size = np.sqrt(np.maximum(large.max(axis=1).toarray(), large.max(axis=0).toarray()).ravel())
    size = np.where(size > 0.0, size, 1.0)
    scale = scipy.sparse.diags_array(1.0 / size)
    balanced = scipy.sparse.csc_array(scale @ matrix @ scale)
    try:
        solver = scipy.sparse.linalg.splu(balanced)
    except RuntimeError:  # a pivot is exactly zero
        return None
    found = solver.solve(right / size)
    if not np.all(np.isfinite(found)):
        return None
    found = (found + solver.solve(right / size - balanced @ found)) / size
    return found[: len(bias)], found[len(bias) :]
