"""Places and speeds at the start of many runs at once, one row each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.rank import ranks
from atwood.simulation.initialization.system import Conditions
from atwood.tolerances import tolerances

_ITERATIONS = 60
"""So many steps are tried."""


def meet_positions(
    assembly: Assembly,
    conditions: Conditions,
    parameters: FloatArray,
    t: float,
    q: FloatArray,
    sizes: FloatArray,
    wanted: FloatArray,
) -> NDArray[np.bool_]:
    """Move coordinates to the nearest place that meets constraints and what is fixed, as `find_start` does.

    The steps are those of `atwood.simulation.initialization.system.nearest`; runs for which one of them does not lessen
    what is missing are left to it.
    """
    runs, (count, n) = len(q), conditions.shape
    if not count:
        return np.ones(runs, dtype=bool)
    code = assembly.compiled(conditions.program, vectorized=True)
    still = np.zeros((n, runs))

    def look(places: FloatArray, which: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        own = parameters if parameters.ndim == 1 else parameters[:, which]
        values, jacobian = code.bind(own)(np.array([[t]]), places.T, still[:, : len(which)])
        matrix = np.zeros((len(which), count, n))
        matrix[:, conditions.rows, conditions.columns] = jacobian.T
        return (values - wanted[:, which]).T, matrix * sizes[which, None, :]

    met, active = np.zeros(runs, dtype=bool), np.arange(runs)
    residual, matrix = look(q, active)
    for _ in range(_ITERATIONS):
        rows = or_one(np.max(np.abs(matrix), axis=2))
        size = np.max(np.abs(residual / rows), axis=1)
        met[active[size < tolerances.MET]] = True
        going = (size >= 1e-15) & np.isfinite(size) & np.all(np.isfinite(matrix), axis=(1, 2))
        active, residual, matrix, rows, size = (one[going] for one in (active, residual, matrix, rows, size))
        if not len(active):
            break
        step, is_known = _least_steps(matrix / rows[:, :, None], residual / rows)
        longest = np.max(np.abs(step), axis=1)
        step *= np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))[:, None]
        trial = q[active] - sizes[active] * step
        residual, matrix = look(trial, active)
        better = np.max(np.abs(residual / rows), axis=1) < size
        better &= is_known
        q[active[better]] = trial[better]
        active, residual, matrix = active[better], residual[better], matrix[better]
    return met


def _least_steps(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the shortest solutions of ``matrix x = right``, and which are known: those of independent rows."""
    known: NDArray[np.bool_] = np.ones(len(matrix), dtype=np.bool_)
    across = np.swapaxes(matrix, 1, 2)
    try:
        if matrix.shape[1] == matrix.shape[2]:
            found: FloatArray = np.asarray(np.linalg.solve(matrix, right[:, :, None]), dtype=np.float64)
        else:
            found = np.asarray(across @ np.linalg.solve(matrix @ across, right[:, :, None]), dtype=np.float64)
    except np.linalg.LinAlgError:  # rows of one run depend on each other
        found = least_norm(matrix, right[:, :, None])
        known[:] = ranks(matrix) == matrix.shape[1]
    return found[:, :, 0], known


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
    """Move speeds to the nearest ones that meet conditions, as `find_start` does."""
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
        scaled = matrix[moving] * sizes[moving, None, :]
        rows = or_one(np.max(np.abs(scaled), axis=2))
        step = least_norm(scaled / rows[:, :, None], (residual[moving] / rows)[:, :, None])
        u[moving] -= sizes[moving] * step[:, :, 0]
        residual = look()
    own = np.einsum("rij,rj->ri", np.abs(matrix), np.abs(u)) + np.abs(wanted).T
    share = np.abs(residual) / or_one(own)
    met: NDArray[np.bool_] = np.all(share <= tolerances.MET_SPEEDS, axis=1)
    return met
