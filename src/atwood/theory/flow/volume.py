"""Volumes of phase space: of coordinates and their momenta, along a motion.

The volume element of a scene with mass matrix M whose deviations meet holonomic constraints is, in displacements s and
speeds u, ``det(T^T M T) ds du`` with T a basis of the directions that the constraints leave free: Liouville's measure
``dq dp`` in minimal coordinates, whichever these are (Arnold, Mathematical Methods of Classical Mechanics, sections 16
and 38). In bases that are orthonormal with respect to M it is the plain volume.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.numerics.rank import null_space
from atwood.numerics.solutions import least_norm
from atwood.theory.flow.field import VariationalEquations

__all__ = ["log_volumes"]


def log_volumes(equations: VariationalEquations, propagators: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the logarithm of the factor by which each step changes volumes of phase space, shape (steps,).

    Parameters
    ----------
    equations
        The variational equations at the edges of the steps.
    propagators
        What the steps do.
    sizes
        Of displacements along each speed.
    """
    into, back = _free_deviations(equations, sizes)
    return np.asarray(np.linalg.slogdet(back[1:] @ propagators @ into[:-1])[1])


def _free_deviations(equations: VariationalEquations, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return bases of the deviations that meet the constraints, as columns, and their left inverses.

    With T orthonormal with respect to M, they are ``ds = T x`` and ``du = T y - G^+ d(G u)/ds T x``.
    """
    jacobian, mass = equations.by_displacement, equations.mass
    count, rows, n = jacobian.shape
    free = n - rows
    basis = np.broadcast_to(np.diag(sizes), mass.shape)
    if rows:
        scaled = jacobian * sizes
        basis = null_space(scaled / np.linalg.norm(scaled, axis=2, keepdims=True), rank=rows) * sizes[:, None]
    triangle = np.linalg.cholesky(np.swapaxes(basis, 1, 2) @ mass @ basis)
    across = np.linalg.solve(triangle, np.swapaxes(basis, 1, 2))
    into, back = np.zeros((count, 2 * n, 2 * free)), np.zeros((count, 2 * free, 2 * n))
    for one, other in ((slice(n), slice(free)), (slice(n, None), slice(free, None))):
        into[:, one, other], back[:, other, one] = np.swapaxes(across, 1, 2), across @ mass
    if rows:
        follow = least_norm(equations.rate_by_speed * sizes, equations.rate_by_displacement)
        into[:, n:, :free] = -(follow * sizes[:, None]) @ into[:, :n, :free]
    return into, back
