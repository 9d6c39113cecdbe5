"""Dormand and Prince's explicit method of order 8(5,3), in Python and NumPy: the reference for the compiled one.

E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, Springer 1993: the
method and its error estimate in section II.10, the dense output of order 7 in sections II.6 and II.10, the choice of
steps in section II.4.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt

import numpy as np

from atwood.errors import KernelEvaluationError
from atwood.integrators.dop853.tableau import DENSE, ERROR_3, ERROR_5, NODES, STAGES
from atwood.integrators.event_location import ROUNDING, State
from atwood.integrators.explicit_problem import (
    CALM,
    EDGE,
    STIFF,
    Counts,
    ExplicitProblem,
    Outcome,
    absolute_tolerances,
    first_step,
    no_interpolation,
    sample_one_by_one,
)
from atwood.integrators.protocol import FloatArray, SolverOptions

__all__ = ["APART", "GROWTH", "ORDER", "RETREAT", "SAFETY", "SHRINKAGE", "ReferenceStepper", "estimate"]

ORDER = 8
SAFETY = 0.9
GROWTH, SHRINKAGE = 6.0, 3.0
"""A step is at most so many times longer or shorter than the one before."""

APART = 0.01
"""The square of the estimate of fifth order is not taken to be larger by its likeness than this times the third's.

The error is the product of two embedded estimates. Each has its zeros along a motion: where that of fifth order comes
near to one, a step that errs by ten tolerances looks good, above all with few unknowns and where steps are tried again
until one looks good. But the ratio of both, which grows as the square of the step, changes slowly from step to step. So
the estimate is taken to be no smaller than the ratio in the step before makes it.
"""

RETREAT = 0.25
"""The share of a step that is tried where a step had no finite value."""

_WEIGHTS = np.zeros((16, 16))
for _row, _weights in enumerate(STAGES, 1):
    _WEIGHTS[_row, list(_weights)] = list(_weights.values())
_LAST = np.zeros((4, 16))
for _row, _weights in enumerate(DENSE):
    _LAST[_row, list(_weights)] = list(_weights.values())
_ERRORS = np.zeros((2, 12))
for _row, _weights in enumerate((ERROR_5, ERROR_3)):
    _ERRORS[_row, list(_weights)] = list(_weights.values())


def estimate(h: float, fifth: float, third: float, size: int) -> float:
    """Return the error of a step, in units of what is allowed, from both embedded estimates.

    Parameters
    ----------
    h
        The step.
    fifth, third
        The sums of the squares of the two estimates for a step of 1.
    size
        The number of unknowns.
    """
    both = fifth + 0.01 * third
    return h * fifth / sqrt(both * size) if both > 0.0 else (0.0 if both == 0.0 else both)


class ReferenceStepper:
    """The state of a run; see `~atwood.integrators.explicit_problem.Stepper`.

    Parameters
    ----------
    problem
        The equations.
    options
        The accuracy.
    """

    def __init__(self, problem: ExplicitProblem, options: SolverOptions) -> None:
        self._rates, self._size, self._options = problem.rates, problem.size, options
        self._project, self._guard = problem.project, problem.guard
        self._absolute = absolute_tolerances(options, problem.size)
        self._longest = options.max_step or inf
        self._counts = Counts()
        self._slopes = np.zeros((16, problem.size))
        self._t = self._t_old = self._h = self._next = 0.0
        self._y = self._y_old = np.zeros(problem.size)
        self._polynomial: FloatArray | None = None
        self._last = self._y
        self._edgy = self._calm = 0
        self._likeness = self._tried = 0.0
        self._heeds = False

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""
        return self._counts

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow."""
        self._longest = min(longest, self._options.max_step or inf)

    def heed_stiffness(self) -> None:
        """Let `run` and `sample` come back with `Outcome.NOTICED` whenever the problem seems stiff."""
        self._heeds = True

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._t = self._t_old = t
        self._h = self._likeness = 0.0
        self._y = self._y_old = y.copy()
        slope = self._slope(t, self._y)
        self._slopes[12] = slope
        if not np.isfinite(slope).all():
            return False
        self._next = first_step(self._slope, self._options, self._absolute, t, self._y, slope, ORDER)
        return True

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        return self._t, self._y.copy(), self._slopes[12].copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        last = self._counts.steps + steps
        with np.errstate(all="ignore"):
            while self._t < t_stop:
                if self._counts.steps >= last:
                    return Outcome.USED_UP
                stiff = self._counts.stiff
                if not self._step():
                    return Outcome.TOO_SMALL
                if self._heeds and self._counts.stiff > stiff:
                    return Outcome.NOTICED
        return Outcome.REACHED

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if t == self._t:
            return self.state()
        with np.errstate(all="ignore"):
            if self._polynomial is None:
                self._polynomial = self._interpolant()
            x = (t - self._t_old) / self._h
            y = np.zeros(self._size)
            for power, row in enumerate(self._polynomial[::-1]):
                y = (y + row) * (x if power % 2 == 0 else 1.0 - x)
            y += self._y_old
            slope = self._slope(t, y)
        if not (np.isfinite(y).all() and np.isfinite(slope).all()):
            raise no_interpolation(t)
        return t, y, slope

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        return sample_one_by_one(self, times, steps)

    def _slope(self, t: float, y: FloatArray) -> FloatArray:
        self._counts.evaluations += 1
        try:
            slope = np.asarray(self._rates(t, y), dtype=np.float64)
        except (KernelEvaluationError, ArithmeticError):
            slope = np.full(self._size, np.nan)
        if not isfinite(slope.dot(slope)) and not np.isfinite(slope).all():
            self._counts.undefined += 1
        return slope

    def _step(self) -> bool:
        """Take one step that is good enough; return False if no step that moves the time is."""
        k, t, y = self._slopes, self._t, self._y
        k[0] = k[12]
        self._polynomial = None
        h, rejected = self._next, False
        while True:
            h = min(h, self._longest)
            if not 0.1 * h > ROUNDING * abs(t) or h < 1e-300:
                k[12] = k[0]
                return False
            error, new = self._attempt(h)
            if error <= 1.0:
                new = self._held(t + h, new)
                slope = self._slope(t + h, new)
                if np.isfinite(slope).all() and self._passes(t + h, new, slope):
                    break
                error = np.nan
            h *= 1.0 / min(SHRINKAGE, _root(error) / SAFETY) if isfinite(error) else RETREAT
            rejected = True
            self._counts.failures += 1
        k[12], self._likeness = slope, self._tried
        self._watch_stability(h, new)
        following = h / min(max(_root(error) / SAFETY, 1.0 / GROWTH), SHRINKAGE)
        self._next = min(h, following) if rejected else following
        self._t_old, self._t, self._h = t, t + h, h
        self._y_old, self._y = y, new
        self._counts.steps += 1
        return True

    def _passes(self, t: float, new: FloatArray, slope: FloatArray) -> bool:
        guard = self._guard
        return guard is None or guard.passes(self._t, self._y, self._slopes[0], t, new, slope)

    def _held(self, t: float, y: FloatArray) -> FloatArray:
        """Return values at the end of a step on the constraints; nan where these cannot be met."""
        if self._project is None:
            return y
        try:
            return np.asarray(self._project(t, y), dtype=np.float64)
        except (KernelEvaluationError, ArithmeticError):
            return np.full(self._size, np.nan)

    def _attempt(self, h: float) -> tuple[float, FloatArray]:
        """Try a step; return its error in units of what is allowed, nan where it has no value, and the new values."""
        k, t, y = self._slopes, self._t, self._y
        for stage in range(1, 12):
            self._last = y + h * (_WEIGHTS[stage, :stage] @ k[:stage])
            k[stage] = self._slope(t + NODES[stage] * h, self._last)
            if not np.isfinite(k[stage]).all():
                return np.nan, y
        new = y + h * (_WEIGHTS[12, :12] @ k[:12])
        scale = self._absolute + self._options.relative_tolerance * np.maximum(np.abs(y), np.abs(new))
        fifth, third = np.sum((_ERRORS @ k[:12] / scale) ** 2, axis=1)
        likely = max(fifth, third * min(h**4 * self._likeness, APART))
        self._tried = fifth / (third * h**4) if third * h**4 > 0.0 else 0.0
        return estimate(h, float(likely), float(third), self._size), new

    def _watch_stability(self, h: float, new: FloatArray) -> None:
        """Estimate the fastest decay from two slopes at the end of a step, and count steps at the edge of stability."""
        slopes, values = self._slopes[12] - self._slopes[11], new - self._last
        apart = float(values.dot(values))
        if apart > 0.0 and h * sqrt(float(slopes.dot(slopes)) / apart) > EDGE:
            self._edgy, self._calm = self._edgy + 1, 0
            if self._edgy == STIFF:
                self._counts.stiff += 1
                self._edgy = 0
        else:
            self._calm += 1
            if self._calm == CALM:
                self._edgy = 0

    def _interpolant(self) -> FloatArray:
        """Return the coefficients of the dense output of the last step."""
        k, h = self._slopes, self._h
        for stage in range(13, 16):
            y = self._y_old + h * (_WEIGHTS[stage, :stage] @ k[:stage])
            k[stage] = self._slope(self._t_old + NODES[stage] * h, y)
        step = self._y - self._y_old
        first = np.array([step, h * k[0] - step, 2.0 * step - h * (k[0] + k[12])])
        return np.concatenate([first, h * (_LAST @ k)])


def _root(error: float) -> float:
    """Return the eighth root."""
    return sqrt(sqrt(sqrt(error)))
