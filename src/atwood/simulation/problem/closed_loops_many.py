"""Branches of closed loops at many positions at once: which formulas of one choice of coordinates lead to, and clearly.

What is asked of each position is what `atwood.simulation.problem.closed_loops.on_branch` asks of one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.loops.closed_form import ClosedForm
from atwood.late import dataclass
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales

__all__ = ["AGREES", "ASIDE", "CLEAR", "ManyBranches"]

CLEAR = 0.003
"""A choice of which so much is left in a whole turn meets no dead centre."""

TURN = 144
"""In so many positions of a whole turn it is seen whether there is a dead centre."""

AGREES = 1e-7
"""Formulas that miss a position by more, in units of the scene's sizes, are not those of its branch."""

ASIDE = 0.05
"""By so many of their sizes independent coordinates are moved to see whether formulas are right near by, too."""


@dataclass(frozen=True, eq=False)
class ManyBranches:
    """Closed loops solved with one choice of one independent angle, with no direction whose half turns are counted.

    Attributes
    ----------
    form
        Its programs.
    assembly
        The scene.
    """

    form: ClosedForm
    assembly: Assembly

    def states(self, t: FloatArray, y: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return all coordinates and speeds, each of shape (number, samples).

        Parameters
        ----------
        t, y
            Times, and independent coordinates and speeds, of shape (samples,) and (samples, number).
        values
            Of parameters and branches, shape (samples, number).
        """
        n = len(self.form.loops.independent)
        q, u = self._call(self.form.states, values, t, y[:, :n].T, y[:, n:].T)
        return q, u

    def values(
        self, t: float, q: FloatArray, u: FloatArray, parameters: FloatArray, lengths: FloatArray, time: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return parameters and branches of admissible states, and which of them lead there and meet no dead centre.

        Parameters
        ----------
        t, q, u
            The time, and coordinates and speeds, of shape (runs, number).
        parameters
            Their values, shape (runs, number).
        lengths, time
            Extent of the scene, m, and time in which something happens, s, of each run.
        """
        values, found = self.branches(np.full(len(q), t), q, parameters)
        if not np.any(found):
            return values, found
        free = list(self.form.loops.independent)
        y = np.concatenate([q[:, free], u[:, free]], axis=1)
        equations = self.assembly.reduced
        sizes, moving_sizes = coordinate_scales(equations, lengths), motion_scales(equations, lengths)
        with np.errstate(all="ignore"):
            places, _ = self.states(np.full(len(y), t), y, values)
            found &= np.all(np.abs(places.T - q) / sizes <= AGREES, axis=1)
            found &= self._hold(t, y, values, sizes, moving_sizes, time)
            least, steepest = self.least(t, y, values)
            found &= least > steepest
        return values, found

    def branches(self, t: FloatArray, q: FloatArray, parameters: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return parameters and branches of admissible positions, and to which of these formulas may lead.

        Parameters
        ----------
        t, q
            Times and coordinates, of shape (runs,) and (runs, number).
        parameters
            Their values, shape (runs, number).
        """
        with np.errstate(all="ignore"):
            branches, conditions = self._call(self.form.branches, parameters, t, q.T)
        values = np.concatenate([parameters, np.reshape(branches, (-1, len(q))).T], axis=1)
        found: NDArray[np.bool_] = np.isfinite(values).all(axis=1) & np.all(
            np.reshape(conditions, (-1, len(q))) > 0.0, axis=0
        )
        return values, found

    def _hold(
        self, t: float, y: FloatArray, values: FloatArray, sizes: FloatArray, moving: FloatArray, time: FloatArray
    ) -> NDArray[np.bool_]:
        """Return where all constraints hold wherever formulas lead to near by."""
        program = self.assembly.balance("reduced")
        holds = np.ones(len(y), dtype=bool)
        known = len(self.assembly.parameters)
        times = np.full(len(y), t)
        for i, k in enumerate(self.form.loops.independent):
            for side in (ASIDE, -ASIDE):
                aside = y.copy()
                aside[:, i] += side * sizes[:, k]
                q, u = self.states(times, aside, values)
                value, entries, explicit = self._call(program.constraints_alone, values[:, :known], times, q, u)
                rows = np.zeros((len(y), program.constraints, program.speeds))
                rows[:, program.jacobian_rows, program.jacobian_columns] = entries.T
                rates = np.einsum("rij,rj->ri", rows, u.T) + explicit.T
                size = np.max(np.abs(rows * moving[:, None, :]), axis=2)
                is_there = np.all(np.isfinite(q), axis=0) & np.all(np.isfinite(u), axis=0)
                good = np.all(np.abs(value.T) <= AGREES * size, axis=1)
                good &= np.all(np.abs(rates) * time[:, None] <= AGREES * size, axis=1)
                holds &= good | ~is_there
        return holds

    def least(self, t: float, y: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what is left of the distance from a dead centre in a whole turn of the only independent coordinate.

        The second is the most by which it changes from one position that was looked at to the next. Both are zero where
        a dead centre is met, a loop does not close, or no angle turns.

        Parameters
        ----------
        t, y
            The time, and independent coordinates and speeds, of shape (runs, number).
        values
            Of parameters and branches, shape (runs, number).
        """
        loops, runs = self.form.loops, len(y)
        count, names = len(loops.margins), self.assembly.reduced.names
        if not count or len(loops.independent) > 1 or names[loops.independent[0]].unit != "rad":
            return np.zeros(runs), np.zeros(runs)
        turn = np.linspace(0.0, 2.0 * np.pi, TURN + 1)
        angles = (y[:, :1] + turn[None, :]).ravel()
        own, speeds = np.repeat(values, len(turn), axis=0), np.repeat(y[:, 1], len(turn))
        with np.errstate(all="ignore"):
            ahead, _ = self._call(self.form.watched, own, np.full(len(angles), t), angles[None, :], speeds[None, :])
            margins = ahead[:count].reshape(count, runs, len(turn))
            least = np.min(margins, axis=(0, 2))
            steepest = np.max(np.abs(np.diff(margins, axis=2)), axis=(0, 2))
        is_met = ~(least > CLEAR)  # also where the loop does not close
        return np.where(is_met, 0.0, least), np.where(is_met, 0.0, steepest)

    def _call(self, program: Program, values: FloatArray, t: FloatArray, *groups: FloatArray) -> tuple[FloatArray, ...]:
        kernel = self.assembly.compiled(program, vectorized=True).bind(values.T)
        return tuple(np.asarray(one) for one in kernel(t[None, :], *groups))
