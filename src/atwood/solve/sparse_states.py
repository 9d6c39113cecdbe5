"""The balance of forces of a large scene at many states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.errors import SolveError
from atwood.forms.program import BalanceProgram
from atwood.solve.sparse_batch import Pattern, solve_borders

__all__ = ["solve_states"]

FloatArray = NDArray[np.float64]

_CHUNK = 8_000_000
"""Numbers that are worked on at once."""


def solve_states(
    program: BalanceProgram,
    t: FloatArray,
    values: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    kept: NDArray[np.intp],
) -> tuple[FloatArray, FloatArray]:
    """Return accelerations and multipliers, each of shape (number, states).

    Parameters
    ----------
    program
        The balance of forces.
    t
        Times, s.
    values
        What it gives at these states: mass, bias, gamma and slope, each of shape (number, states).
    kept
        Numbers of independent constraints.

    Raises
    ------
    SolveError
        If the forces do not determine the accelerations at a state.
    """
    mass, bias, gamma, slope = values
    n, m = program.speeds, program.constraints
    at = Pattern(program.mass_rows, program.mass_columns, (n, n))
    held, which = Pattern(program.slope_rows, program.slope_columns, (m, n)).chosen(kept.tolist())
    found_a, found_l = np.zeros((n, len(t))), np.zeros((m, len(t)))
    good = np.zeros(len(t), dtype=bool)
    step = max(1, _CHUNK // (8 * (len(mass) + len(slope)) + 1))
    for first in range(0, len(t), step):
        part = slice(first, first + step)
        found_a[:, part], some, good[part] = solve_borders(
            (at, mass[:, part]), (held, slope[which, part]), bias[:, part], gamma[kept, part]
        )
        found_l[kept, part] = some
    is_redundant = len(kept) < m
    if is_redundant or not good.all():
        from atwood.solve.sparse import csr_least_norm, csr_of, solve_bordered
    for i in np.flatnonzero(~good | is_redundant):
        full_mass = csr_of(program.mass_rows, program.mass_columns, mass[:, i], (n, n))
        full_slope = csr_of(program.slope_rows, program.slope_columns, slope[:, i], (m, n))
        if not good[i]:
            solved = solve_bordered(full_mass, full_slope[kept], bias[:, i], gamma[kept, i])
            if solved is None:
                raise SolveError(
                    f"at t = {t[i]:.6g} the forces do not determine the accelerations",
                    advice="The mechanism passes a singular position exactly, or something without mass is free.",
                )
            found_a[:, i], found_l[kept, i] = solved
        if is_redundant:
            found_l[:, i] = csr_least_norm(full_slope.T, full_mass @ found_a[:, i] + bias[:, i])
    return found_a, found_l
