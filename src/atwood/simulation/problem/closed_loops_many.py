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
from atwood.simulation.problem.closed_loops import AGREES, ASIDE, CLEAR, TURN

__all__ = ["ManyBranches"]


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
        values, found = self._branches(t, q, parameters)
        if not np.any(found):
            return values, found
        free = list(self.form.loops.independent)
        y = np.concatenate([q[:, free], u[:, free]], axis=1)
        equations = self.assembly.reduced
        sizes, moving_sizes = coordinate_scales(equations, lengths), motion_scales(equations, lengths)
        with np.errstate(all="ignore"):
            places, _ = self.states(np.full(len(y), t), y, values)
            found &= np.all(np.abs(places.T - q) / sizes <= AGREES, axis=1)
            found &= self._hold(t, y, values, sizes, moving_sizes, time) & self._are_clear(t, y, values)
        return values, found

    def _branches(self, t: float, q: FloatArray, parameters: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return parameters and branches, and where conditions for these hold."""
        with np.errstate(all="ignore"):
            branches, conditions = self._call(self.form.branches, parameters, np.full(len(q), t), q.T)
        known, found = len(self.assembly.parameters), np.ones(len(q), dtype=bool)
        values = np.empty((len(q), known + len(self.form.loops.branches)))
        values[:, :known], values[:, known:] = parameters, branches.T
        if len(conditions):
            found &= np.all(conditions > 0.0, axis=0)
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

    def _are_clear(self, t: float, y: FloatArray, values: FloatArray) -> NDArray[np.bool_]:
        """Return where no dead centre is met in a whole turn of the independent angle."""
        count, runs = len(self.form.loops.margins), len(y)
        if not count:
            return np.zeros(runs, dtype=bool)
        turn = np.linspace(0.0, 2.0 * np.pi, TURN + 1)
        angles = (y[:, :1] + turn[None, :]).ravel()
        own, speeds = np.repeat(values, len(turn), axis=0), np.repeat(y[:, 1], len(turn))
        ahead, _ = self._call(self.form.watched, own, np.full(len(angles), t), angles[None, :], speeds[None, :])
        margins = ahead[:count].reshape(count, runs, len(turn))
        least = np.min(margins, axis=(0, 2))
        steepest = np.max(np.abs(np.diff(margins, axis=2)), axis=(0, 2))
        clear: NDArray[np.bool_] = (least > CLEAR) & (least > steepest)
        return clear

    def _call(self, program: Program, values: FloatArray, t: FloatArray, *groups: FloatArray) -> tuple[FloatArray, ...]:
        kernel = self.assembly.compiled(program, vectorized=True).bind(values.T)
        return tuple(np.asarray(one) for one in kernel(t[None, :], *groups))
