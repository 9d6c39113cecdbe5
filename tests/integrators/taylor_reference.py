"""The Taylor-series method in Python and NumPy: the reference for the compiled one; see `problem` beside it.

The state is kept with what its additions rounded off (D. E. Knuth, The Art of Computer Programming, volume 2, section
4.2.2, theorem B), so that rounding does not add up over many steps; and steps are those between two times that are
exact.
"""

from __future__ import annotations

from itertools import pairwise
from math import inf, ldexp, log2, sqrt
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.python.backend import compile_program
from atwood.errors import KernelEvaluationError
from atwood.integrators.protocol import SolverOptions, State, StepGuard, absolute_tolerances
from atwood.integrators.stepper import Counts, Outcome
from atwood.integrators.taylor.stepper import (
    DEFECT,
    FLOOR,
    PARTS,
    RETREAT,
    RETRIES,
    SMALLER,
    WATCHED,
    TaylorProblem,
    choose_order,
    logarithm,
    share_of_radius,
)

from .embedded_reference import StepperInPython


def power_of_two(value: float) -> float:
    """Return a power of two, good enough for a step."""
    whole = int(value // 1.0)
    part = value - whole
    return ldexp(1.0 + part * (0.6602 + 0.3398 * part), whole)


class ReferenceStepper(StepperInPython):
    """The state of a run; see `~atwood.integrators.protocol.Stepper`.

    Parameters
    ----------
    problem
        The recurrences.
    options
        The accuracy.
    order
        The order of the method; None takes the one that suits the tolerance.
    guard
        What judges steps besides their error.
    """

    def __init__(
        self,
        problem: TaylorProblem,
        options: SolverOptions,
        order: int | None = None,
        guard: StepGuard | None = None,
    ) -> None:
        programs = problem.programs
        self._size = len(programs.start.inputs[1].symbols)
        self._order = choose_order(options) if order is None else order
        self._start = compile_program(programs.start).bind(problem.parameters)
        self._recurrence = compile_program(programs.order)
        self._floors = absolute_tolerances(options, self._size) / options.relative_tolerance
        self._share = log2(share_of_radius(self._order, options.relative_tolerance))
        self._allowed = DEFECT * options.relative_tolerance + FLOOR
        self._longest, self._stop_time, self._reach = options.max_step or inf, problem.stop_time, problem.reach
        self._horizon, self._first = options.horizon, options.first_step
        self._counts, self._guard = Counts(), guard
        p, n = self._order, self._size
        self._series = np.zeros((p + 1, n))
        self._left, self._right = np.zeros((p + 1, programs.pairs)), np.zeros((p + 1, programs.pairs))
        self._squares = np.zeros((p + 1, programs.squares))
        self._t = self._t_old = 0.0
        self._y = self._y_low = self._rates = np.zeros(n)
        self._known: list[float] = []
        self._unit, self._last = 1.0, 0.0

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts; an evaluation is one of the rates."""
        return self._counts

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._last = 0.0
        self._t = self._t_old = t
        self._y, self._y_low = y.copy(), np.zeros(self._size)
        found = self._evaluate(t, self._y)
        if found is None:
            return False
        self._rates, self._known = found
        self._series[0], self._series[1:] = y, 0.0
        with np.errstate(all="ignore"):
            steepest = float(np.max(np.abs(self._rates) / (self._floors + np.abs(y))))
        self._unit = min(self._horizon, self._longest, 1.0 / steepest if steepest > 0.0 else inf)
        return True

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        return self._t, self._y.copy(), self._rates.copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        last = self._counts.steps + steps
        with np.errstate(all="ignore"):
            while self._t < t_stop:
                if self._counts.steps >= last:
                    return Outcome.USED_UP
                if not self._step():
                    return Outcome.TOO_SMALL
        return Outcome.REACHED

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if t == self._t:
            return self.state()
        with np.errstate(all="ignore"):
            y = self._series[0] + self._moved((t - self._t_old) / self._unit)
            found = self._evaluate(t, y)
        if found is None or not np.isfinite(y).all():
            raise self._no_interpolation(t)
        return t, y, found[0]

    # -- one step -------------------------------------------------------------------------------------------------

    def _step(self) -> bool:
        """Take a step; return False if it would have to be too small to move the time."""
        if not self._expand():
            return False
        h = min(self._choose(), self._longest)
        while True:
            t = min(self._t + h, self._stop_time)
            h = t - self._t
            is_rest = t == self._stop_time and h > 0.0  # however short it is
            if not is_rest and not (h > 10.0 * 2.0**-52 * abs(self._t) and h >= 1e-300):
                return False
            share = h / self._unit
            y, y_low = _add(self._y, self._y_low, self._moved(share))
            found = self._evaluate(t, y)
            if found is not None and self._fits(share, h, y, found[0]) and self._passes(h):
                break
            self._counts.failures += 1
            h *= RETREAT
        self._t_old, self._t = self._t, t
        self._y, self._y_low = y, y_low
        self._rates, self._known = found
        self._counts.steps += 1
        self._last = h
        return True

    def _passes(self, h: float) -> bool:
        """Return whether what judges steps finds nothing in any part of one."""
        if self._guard is None:
            return True
        powers = np.arange(self._order + 1)
        times, rows = h * np.linspace(0.0, 1.0, PARTS + 1), []
        for share in times / self._unit:
            slope = powers[1:] * share ** powers[:-1]
            rows.append((share**powers @ self._series, slope @ self._series[1:] / self._unit))
        ends = [(self._t + float(since), *row) for since, row in zip(times, rows, strict=True)]
        return all(self._guard.passes(*one, *other) for one, other in pairwise(ends))

    def _evaluate(self, t: float, y: FloatArray) -> tuple[FloatArray, list[float]] | None:
        """Return the rates and the values that recurrences need; None where one is not finite."""
        self._counts.evaluations += 1
        try:
            rates, known = self._start([t], y)
        except (KernelEvaluationError, ArithmeticError):
            self._counts.undefined += 1
            return None
        if not (np.isfinite(rates).all() and np.isfinite(known).all()):
            self._counts.undefined += 1
            return None
        return np.array(rates), known

    def _expand(self) -> bool:
        """Find the coefficients at the state; return False where one is not finite."""
        unit = self._last or self._unit
        for _ in range(RETRIES):
            self._unit = unit
            if self._fill():
                return True
            self._counts.undefined += 1
            unit *= SMALLER
        return False

    def _fill(self) -> bool:
        x, unit = self._series, self._unit
        x[0], x[1] = self._y, unit * self._rates
        try:
            kernel = self._recurrence.bind(self._known)
            for k in range(1, self._order):
                backwards = slice(k - 1, 0, -1)
                pairs = np.sum(self._left[1:k] * self._right[backwards], axis=0)
                squares = np.sum(self._squares[1:k] * self._squares[backwards], axis=0)
                numbers = [float(k), 1.0 / k, unit / (k + 1), unit if k == 1 else 0.0]
                found = kernel(pairs, squares, numbers, x[k])
                self._left[k], self._right[k], self._squares[k], x[k + 1] = found
        except (KernelEvaluationError, ArithmeticError):
            return False
        return bool(np.isfinite(x).all())

    def _choose(self) -> float:
        """Return the step that the last coefficients allow."""
        if self._first is not None:
            first, self._first = self._first, None
            return first
        sizes = 1.0 / (self._floors + np.abs(self._y))

        def largest(k: int) -> float:
            return float(np.max(np.abs(self._series[k]) * sizes))

        steepest = max(logarithm(largest(k)) / k for k in range(self._order, self._order - WATCHED, -1))
        share = power_of_two(self._share - steepest)
        if self._reach < inf:
            share = min(share, float(np.divide(self._reach, largest(1))), sqrt(np.divide(self._reach, largest(2))))
        return self._unit * share

    def _moved(self, share: float) -> FloatArray:
        """Return how far the polynomial goes in a share of the unit of time."""
        total: FloatArray = self._series[self._order] * share
        for row in self._series[self._order - 1 : 0 : -1]:
            total = (total + row) * share
        return total

    def _fits(self, share: float, h: float, y: FloatArray, rates: FloatArray) -> bool:
        """Return whether the derivative of the polynomial is the rates."""
        p = self._order
        slope = p * self._series[p]
        for k in range(p - 1, 0, -1):
            slope = slope * share + k * self._series[k]
        apart = np.abs(slope / self._unit - rates) * (h / p)
        sizes = self._floors + np.maximum(np.abs(self._y), np.abs(y))
        return bool(np.all(apart <= self._allowed * sizes))


def _add(high: Any, low: Any, more: Any) -> tuple[Any, Any]:
    """Return a number, kept with what it leaves out, and something more, in the same way."""
    total = high + more
    part = total - high
    low = low + ((high - (total - part)) + (more - part))
    new = total + low
    return new, low - (new - total)
