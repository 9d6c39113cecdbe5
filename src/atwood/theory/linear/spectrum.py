"""Eigenvalues of linear models, zero ones told exactly.

A coordinate that nothing depends on gives a zero eigenvalue, together with its conserved momentum a double one, which
rounding would make a pair of size 1e-8 that spoils its neighbours. So what a matrix takes to zero is split off first,
step by step (the staircase form; Golub and Wilkinson, SIAM Review 18, 1976); the rest is left to the QR method.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import ComplexArray, FloatArray
from atwood.late import dataclass
from atwood.numerics.rank import decompose, null_space
from atwood.numerics.solutions import least_squares

__all__ = ["Spectrum", "find_spectrum", "rounding"]


_ROUNDING = 1e-14
"""Relative to the largest singular value after balancing: what is less is rounding of the decomposition itself."""

_SWEEPS, _FACTOR = 3, 4.0
"""So often every state is scaled, each time by this at most."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of a matrix.

    Attributes
    ----------
    zeros
        How many are zero.
    others
        The others, sorted by real part, then imaginary part, largest first.
    vectors
        A column for each of these.
    """

    zeros: int
    others: ComplexArray
    vectors: ComplexArray

    @property
    def values(self) -> ComplexArray:
        """All eigenvalues, zeros last."""
        return np.concatenate([self.others, np.zeros(self.zeros, dtype=complex)])


def find_spectrum(matrix: FloatArray, error: FloatArray, sizes: FloatArray) -> Spectrum:
    """Return the eigenvalues of a matrix.

    Parameters
    ----------
    matrix
        Shape (n, n).
    error
        How far its entries may be off.
    sizes
        What is large for each state.
    """
    n = len(matrix)
    if n == 0:
        return Spectrum(0, np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex))
    # Entries that are nothing but rounding say nothing of how large states are beside each other.
    certain = np.where(np.abs(matrix) > error, matrix, 0.0)
    scale = sizes * _scale(certain * sizes / sizes[:, None])
    balanced = certain * scale[None, :] / scale[:, None]
    zeros, basis, left = _split(balanced, rounding(balanced, error * scale[None, :] / scale[:, None]))
    values, own = np.linalg.eig(left)
    chosen = np.lexsort((-values.imag, -values.real))
    vectors = _lifted(balanced, basis, values[chosen], own[:, chosen])
    return Spectrum(zeros, values[chosen], scale[:, None] * vectors)


def rounding(matrix: FloatArray, error: FloatArray) -> float:
    """Return how far a matrix may be off: its entries, and its decomposition."""
    return max(_ROUNDING * float(np.linalg.norm(matrix, 2)), float(np.linalg.norm(error)))


def _scale(matrix: FloatArray) -> FloatArray:
    """Return sizes of states with which rows and columns are alike, as far as a few steps lead.

    Osborne's iteration (J. ACM 7, 1960). It does not end where states do not act on each other both ways, as where
    coordinates are cyclic; what it has reached by then is good enough.
    """
    scale, sizes = np.ones(len(matrix)), np.abs(matrix)
    np.fill_diagonal(sizes, 0.0)
    for _ in range(_SWEEPS):
        for i in range(len(matrix)):
            row, column = float(np.sum(sizes[i] * scale)) / scale[i], float(np.sum(sizes[:, i] / scale)) * scale[i]
            if row > 0.0 and column > 0.0:
                scale[i] *= np.clip(np.sqrt(row / column), 1.0 / _FACTOR, _FACTOR)
    return np.asarray(scale / np.exp(np.mean(np.log(scale))))


def _split(matrix: FloatArray, bound: float) -> tuple[int, FloatArray, FloatArray]:
    """Return how many eigenvalues are zero, a basis of what is left, and the matrix on it."""
    basis, left, zeros = np.eye(len(matrix)), matrix, 0
    while len(left):
        found = decompose(left, bound)
        if found.rank == len(left):
            break
        zeros += len(left) - found.rank
        # On the quotient by what goes to zero: the rest of an orthonormal basis.
        keep = found.row_space
        basis, left = basis @ keep, keep.T @ left @ keep
    return zeros, basis, left


def _lifted(matrix: FloatArray, basis: FloatArray, values: ComplexArray, own: ComplexArray) -> ComplexArray:
    """Return eigenvectors of the whole matrix from those on the quotient."""
    found = np.empty((len(matrix), len(values)), dtype=complex)
    rest = null_space(basis.T, rank=basis.shape[1]) if len(values) else np.zeros((len(matrix), 0))
    for k, value in enumerate(values):
        # (A - lambda) v = 0 with v = basis y + what was split off; A is not singular there at lambda != 0.
        v = basis @ own[:, k]
        if rest.shape[1]:
            shifted = matrix - value * np.eye(len(matrix))
            v = v - rest @ least_squares(shifted @ rest, shifted @ v)
        found[:, k] = v / np.linalg.norm(v)
    return found
