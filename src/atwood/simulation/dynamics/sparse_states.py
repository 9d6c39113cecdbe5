"""The balance of forces of a large scene at many states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError
from atwood.forms.balance_program import BalanceProgram
from atwood.numerics.sparse import csr_least_norm, csr_of, solve_bordered
from atwood.numerics.sparse_batch import Augmented, Borders, Normal, Pattern

_CHUNK = 8_000_000
"""Numbers that are worked on at once."""


class States:
    """Solutions of a balance of forces at many states.

    Parameters
    ----------
    program
        The balance of forces.
    kept
        Numbers of independent constraints.
    """

    def __init__(self, program: BalanceProgram, kept: tuple[int, ...]) -> None:
        self._program, self._kept = program, np.asarray(kept, dtype=np.intp)
        n, m = program.speeds, program.constraints
        mass = Pattern(program.mass_rows, program.mass_columns, (n, n))
        jacobian = Pattern(program.jacobian_rows, program.jacobian_columns, (m, n))
        held, self._which = jacobian.chosen(kept)
        self._borders = Borders(mass, held)
        self._augmented: Augmented | None = None
        self._normal = Normal(jacobian, kept) if len(kept) < m else None

    def solve(
        self, t: FloatArray, values: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Return accelerations and the multipliers of the independent constraints, each of shape (number, states)."""
        mass, bias, gamma, jacobian = values
        program, kept = self._program, self._kept
        found_a, found_l = np.zeros((program.speeds, len(t))), np.zeros((len(kept), len(t)))
        good = np.zeros(len(t), dtype=bool)
        step = max(1, _CHUNK // (8 * (len(mass) + len(jacobian)) + 1))
        for first in range(0, len(t), step):
            part = slice(first, first + step)
            found_a[:, part], found_l[:, part], good[part] = self._borders.solve(
                mass[:, part], jacobian[self._which, part], bias[:, part], gamma[kept, part]
            )
        bad = np.flatnonzero(~good)
        if len(bad):
            self._again(slice(None) if len(bad) == len(t) else bad, values, (found_a, found_l, good))
        for i in np.flatnonzero(~good):
            n, m = program.speeds, program.constraints
            full_mass = csr_of(program.mass_rows, program.mass_columns, mass[:, i], (n, n))
            full_jacobian = csr_of(program.jacobian_rows, program.jacobian_columns, jacobian[:, i], (m, n))
            solved = solve_bordered(full_mass, full_jacobian[kept], bias[:, i], gamma[kept, i])
            if solved is None:
                raise SolveError(
                    f"at t = {t[i]:.6g} the forces do not determine the accelerations",
                    advice="The mechanism passes a singular position exactly, or something without mass is free.",
                )
            found_a[:, i], found_l[:, i] = solved
        return found_a, found_l

    def _again(
        self,
        which: slice | NDArray[np.intp],
        values: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
        found: tuple[FloatArray, FloatArray, NDArray[np.bool_]],
    ) -> None:
        """Solve for some states where something has no mass of its own."""
        if self._augmented is None:
            self._augmented = Augmented(self._borders.mass, self._borders.jacobian)
        mass, bias, gamma, jacobian = (one[:, which] for one in values)
        a, multipliers, good = found
        a[:, which], multipliers[:, which], good[which] = self._augmented.solve(
            mass, jacobian[self._which], bias, gamma[self._kept]
        )

    def least_size(self, jacobian: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return the multipliers of all constraints of least size with the force of some of the independent ones."""
        if self._normal is None:
            return multipliers
        m, states = self._program.constraints, jacobian.shape[1]
        found = np.empty((m, states))
        step = max(1, _CHUNK // (self._normal.volume + (m - len(self._kept)) * (m + 2 * len(self._kept))))
        for first in range(0, states, step):
            part = slice(first, first + step)
            found[:, part] = self._normal.least_size(jacobian[:, part], multipliers[:, part])
        bad = np.flatnonzero(~np.all(np.isfinite(found), axis=0))
        if len(bad):
            for i in bad:
                full = csr_of(
                    self._program.jacobian_rows,
                    self._program.jacobian_columns,
                    jacobian[:, i],
                    (m, self._program.speeds),
                )
                found[:, i] = csr_least_norm(full.T, full[self._kept].T @ multipliers[:, i])
        return found
