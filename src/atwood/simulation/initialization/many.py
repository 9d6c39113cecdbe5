"""Speeds at the start of many runs at once, one row each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.mechanics.dynamics.equations import Equations
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales
from atwood.simulation.initialization.system import Conditions
from atwood.tolerances import tolerances

__all__ = ["meet_speeds", "size_rows"]


def size_rows(equations: Equations, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the size of each coordinate, and of a displacement along each speed, one row for each extent."""
    found = []
    for unit in (coordinate_scales(equations, 0.0), motion_scales(equations, 0.0)):  # zero for lengths, else one
        found.append(np.where(unit[None, :] == 0.0, lengths[:, None], unit[None, :]))
    return found[0], found[1]


def meet_speeds(
    assembly: Assembly,
    conditions: Conditions,
    parameters: FloatArray,
    t: float,
    q: FloatArray,
    u: FloatArray,
    sizes: FloatArray,
    wanted: FloatArray,
) -> NDArray[np.bool_]:
    """Move speeds to the nearest ones that meet conditions, as `find_start` does.

    Parameters
    ----------
    assembly
        The scene, in the reduced form and without constraints.
    conditions
        What is to be met.
    parameters
        Values of the parameters, shape (parameters,) or (parameters, runs).
    t
        Time of the start, s.
    q, u
        States, shape (runs, number); the speeds are changed in place.
    sizes
        Size of a displacement along each speed, shape (runs, number).
    wanted
        What each condition is to be, shape (conditions, runs).

    Returns
    -------
    array
        Which runs meet their conditions.
    """
    runs, (count, n) = len(q), conditions.shape
    if not count:
        return np.ones(runs, dtype=bool)
    kernel = assembly.compiled(conditions.program, vectorized=True).bind(parameters)
    matrix = np.zeros((runs, count, n))

    def look() -> FloatArray:
        values, jacobian = kernel(np.array([[t]]), q.T, u.T)
        matrix[:, conditions.rows, conditions.columns] = jacobian.T
        residual: FloatArray = (values - wanted).T
        return residual

    residual = look()
    for _ in range(3):  # linear: the second pass takes out rounding
        moving = np.any(residual != 0.0, axis=1) & np.all(np.isfinite(matrix), axis=(1, 2))
        if not np.any(moving):
            break
        rows = np.max(np.abs(matrix[moving] * sizes[moving, None, :]), axis=2)
        rows[rows == 0.0] = 1.0
        scaled = matrix[moving] * sizes[moving, None, :] / rows[:, :, None]
        step = np.linalg.pinv(scaled, rcond=tolerances.RANK) @ (residual[moving] / rows)[:, :, None]
        u[moving] -= sizes[moving] * step[:, :, 0]
        residual = look()
    own = np.einsum("rij,rj->ri", np.abs(matrix), np.abs(u)) + np.abs(wanted).T
    share = np.abs(residual) / np.where(own > 0.0, own, 1.0)
    met: NDArray[np.bool_] = np.all(share <= tolerances.MET_SPEEDS, axis=1)
    return met
