"""State-space models: controllable and observable parts, zeros, gains, frequency responses."""

from __future__ import annotations

import numpy as np

from atwood.arrays import ComplexArray, FloatArray
from atwood.numerics.rank import decompose, rank, span

__all__ = ["Matrices", "frequency_response", "minimal_realization", "static_gain", "transmission_zeros"]


Matrices = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""A, B, C, D."""

_LOST = 1e-10
"""How far matrices of a model, which come without errors, may be off, relative to what is in them."""


def minimal_realization(model: Matrices) -> Matrices:
    """Return the part of a model that inputs reach and outputs see.

    Kalman's decomposition by orthogonal staircases (Van Dooren, IEEE Trans. Automatic Control 26, 1981).
    """
    a, b, c, d = balanced(model)
    reached = _reached(a, b)
    a, b, c = reached.T @ a @ reached, reached.T @ b, c @ reached
    seen = _reached(a.T, c.T)
    return seen.T @ a @ seen, seen.T @ b, c @ seen, d


def balanced(model: Matrices) -> Matrices:
    """Return the same model in states of like size."""
    a, b, c, d = model
    if not len(a):
        return model
    from scipy.linalg import matrix_balance

    _, (scale, _) = matrix_balance(a, permute=False, separate=True)
    return a * scale / scale[:, None], b / scale[:, None], c * scale, d


def _reached(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return an orthonormal basis, as columns, of what inputs reach."""
    n = len(a)
    basis = np.zeros((n, 0))
    new, size = b, max(float(np.linalg.norm(a)), 1e-300)
    while basis.shape[1] < n and new.size:
        left = new - basis @ (basis.T @ new)
        columns = np.linalg.norm(new, axis=0)
        left = left / np.where(columns > 0.0, columns, 1.0)
        found = span(left, _LOST)
        if not found.shape[1]:
            break
        found = np.linalg.qr(found - basis @ (basis.T @ found))[0]
        basis = np.hstack([basis, found])
        new = a @ found
        new = np.where(np.linalg.norm(new, axis=0) > _LOST * size, new, 0.0)
    return basis


def transmission_zeros(model: Matrices) -> ComplexArray:
    """Return the finite zeros of a model with as many outputs as inputs.

    They are the generalized eigenvalues of ``[[A, B], [C, D]]`` and ``[[I, 0], [0, 0]]`` (Rosenbrock, 1970). Infinite
    ones are split off before: each step leaves a smaller pencil with the same finite eigenvalues.
    """
    a, b, c, d = minimal_realization(model)
    while len(a):
        at_once = decompose(d, _LOST * max(float(np.linalg.norm(d, 2)), float(np.linalg.norm(c))))
        if at_once.rank == len(d):
            return np.asarray(np.linalg.eigvals(a - b @ np.linalg.solve(d, c)), dtype=complex)
        # Outputs that no input reaches at once hold C x = 0: what stays on it is a smaller model (Silverman).
        c, d = at_once.left.T @ c, at_once.left.T @ d
        held = decompose(c[at_once.rank :], _LOST * float(np.linalg.norm(c)))
        if held.rank < len(d) - at_once.rank:
            return np.zeros(0, dtype=complex)  # outputs depend on each other: every number would be a zero
        stay, leave = held.null_space, held.row_space
        c = np.vstack([c[: at_once.rank] @ stay, leave.T @ a @ stay])
        d = np.vstack([d[: at_once.rank], leave.T @ b])
        a, b = stay.T @ a @ stay, stay.T @ b
    return np.zeros(0, dtype=complex)


def static_gain(model: Matrices) -> FloatArray | None:
    """Return ``D - C A^-1 B`` of the minimal realization; None if that has an integrator."""
    a, b, c, d = minimal_realization(model)
    if not len(a):
        return d
    if rank(a, _LOST * float(np.linalg.norm(a, 2))) < len(a):
        return None
    return np.asarray(d - c @ np.linalg.solve(a, b))


def frequency_response(model: Matrices, omega: FloatArray) -> ComplexArray:
    """Return ``C (i omega - A)^-1 B + D``, shape (frequencies, outputs, inputs)."""
    a, b, c, d = balanced(model)
    shifted = 1j * omega[:, None, None] * np.eye(len(a)) - a
    return np.asarray(c @ np.linalg.solve(shifted, np.broadcast_to(b.astype(complex), (len(omega), *b.shape))) + d)
