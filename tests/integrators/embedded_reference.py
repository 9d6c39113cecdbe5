"""Embedded pairs in Python and NumPy: the reference for the compiled ones.

E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, Springer 1993: the
method and its error estimate in section II.10, the dense output of order 7 in sections II.6 and II.10, the choice of
steps in section II.4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite, sqrt

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.integrators.embedded.steps import APART, GROWTH, RETREAT, SAFETY, SHRINKAGE
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.event_location import ROUNDING
from atwood.integrators.protocol import ExplicitProblem, SolverOptions, State, absolute_tolerances
from atwood.integrators.stepper import CALM, STIFF, Counts, Outcome, Stepper


def matrix(rows: Sequence[Mapping[int, float]], width: int) -> FloatArray:
    """Return rows of weights as a matrix."""
    found = np.zeros((len(rows), width))
    for row, weights in zip(found, rows, strict=True):
        row[list(weights)] = list(weights.values())
    return found


def first_step(
    rates: Callable[[float, FloatArray], FloatArray],
    options: SolverOptions,
    absolute: FloatArray,
    t: float,
    y: FloatArray,
    yp: FloatArray,
    order: int,
) -> float:
    """Return a first step from the size of the first two derivatives.

    Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.4.

    Parameters
    ----------
    rates
        The right-hand side.
    options, absolute
        The accuracy that is asked for.
    t, y, yp
        The start.
    order
        The order of the method.
    """
    longest = min(options.horizon, options.max_step or np.inf)
    if options.first_step is not None:
        return min(options.first_step, options.max_step or np.inf)
    weights = 1.0 / np.maximum(absolute, 1e-6 * options.relative_tolerance * np.abs(y))

    def size(values: FloatArray) -> float:
        scaled = values * weights
        return sqrt(float(scaled.dot(scaled)) / len(scaled))

    with np.errstate(all="ignore"):
        d0, d1 = size(y), size(yp)
        told = 1e4 * ROUNDING * abs(t)
        moves, whole = d1 * longest > 1.0, max(d0, 1.0)
        h0 = min(max(min(0.01 * whole, 100.0) / d1 if moves else 1e-6 * longest, told), longest)
        reach = max(whole / d1, told) if moves else 100.0 * h0
        change = size(rates(t + h0, y + h0 * yp) - yp) / h0
        d2 = max(change, d1 * ROUNDING / h0)
    if not 0.0 < d2 < np.inf:
        return h0
    span = max(d1 / d2, 1.0 / sqrt(d2))
    h1 = span * float((0.01 / (d2 * span * span)) ** (int(256 / order) / 256))
    return min(reach, max(h1, told), longest)


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


class StepperInPython(Stepper):
    """A stepper that takes its steps in Python."""

    _fields = {}

    def interpolation(self) -> None:
        """Return that no compiled code reads its steps."""

    def sample(self, times: FloatArray, steps: int, y: FloatArray, yp: FloatArray) -> tuple[int, Outcome]:
        """Take steps, and write values and rates at as many times, one row each, as are reached; return these."""
        last = self.counts.steps + steps
        for filled, t in enumerate(times):
            outcome = self.run(float(t), last - self.counts.steps)
            if outcome is not Outcome.REACHED:
                return filled, outcome
            _, y[filled], yp[filled] = self.interpolate(float(t))
        return len(times), Outcome.REACHED


class ReferenceStepper(StepperInPython):
    """The state of a run; see `atwood.integrators.protocol.Stepper`.

    Parameters
    ----------
    problem
        The equations.
    options
        The accuracy.
    pair
        The method.
    """

    def __init__(self, problem: ExplicitProblem, options: SolverOptions, pair: Tableau) -> None:
        stages = len(pair.nodes)
        self._pair, self._end = pair, pair.end
        self._weights, self._dense = matrix(({}, *pair.stages), stages), matrix(pair.dense, stages)
        self._errors = matrix(pair.errors, pair.end + 1)
        self._rates, self._size, self._options = problem.rates, problem.size, options
        self._project, self._guard = problem.project, problem.guard
        self._absolute = absolute_tolerances(options, problem.size)
        self._longest = options.max_step or inf
        self._counts = Counts()
        self._slopes = np.zeros((stages, problem.size))
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

    def watch_stiffness(self) -> None:
        """Let `run` and `sample` come back with `Outcome.NOTICED` whenever the problem seems stiff."""
        self._heeds = True

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._t = self._t_old = t
        self._h = self._likeness = 0.0
        self._y = self._y_old = y.copy()
        slope = self._slope(t, self._y)
        self._slopes[self._end] = slope
        if not np.isfinite(slope).all():
            return False
        self._next = first_step(self._slope, self._options, self._absolute, t, self._y, slope, self._pair.order)
        return True

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        return self._t, self._y.copy(), self._slopes[self._end].copy()

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
            for power in reversed(range(len(self._polynomial))):
                y = (y + self._polynomial[power]) * (1.0 - x if power % 2 else x)
            y += self._y_old
            slope = self._slope(t, y)
        if not (np.isfinite(y).all() and np.isfinite(slope).all()):
            raise self._no_interpolation(t)
        return t, y, slope

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
        k, t, y, end = self._slopes, self._t, self._y, self._end
        k[0] = k[end]
        self._polynomial = None
        h, rejected = self._next, False
        while True:
            h = min(h, self._longest)
            if not 0.1 * h > ROUNDING * abs(t) or h < 1e-300:
                k[end] = k[0]
                return False
            error, new = self._attempt(h)
            if error <= 1.0:
                new = new if self._pair.judges_end else self._held(t + h, new)
                slope = k[end].copy() if self._pair.judges_end else self._slope(t + h, new)
                if np.isfinite(slope).all() and self._passes(t + h, new, slope):
                    break
                error = np.nan
            h *= 1.0 / min(SHRINKAGE, self._root(error) / SAFETY) if isfinite(error) else RETREAT
            rejected = True
            self._counts.failures += 1
        k[end], self._likeness = slope, self._tried
        self._watch_stability(h, new)
        following = h / min(max(self._root(error) / SAFETY, 1.0 / GROWTH), SHRINKAGE)
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
        k, t, y, end = self._slopes, self._t, self._y, self._end
        for stage in range(1, end):
            self._last = y + h * (self._weights[stage, :stage] @ k[:stage])
            k[stage] = self._slope(t + self._pair.nodes[stage] * h, self._last)
            if not np.isfinite(k[stage]).all():
                return np.nan, y
        new = y + h * (self._weights[end, :end] @ k[:end])
        if self._pair.judges_end:
            new = self._held(t + h, new)
            k[end] = self._slope(t + h, new)
        scale = self._absolute + self._options.relative_tolerance * np.maximum(np.abs(y), np.abs(new))
        slopes = k[: end + 1] if self._pair.judges_end else np.vstack([k[:end], np.zeros_like(y)])
        squares = np.sum((self._errors @ slopes / scale) ** 2, axis=1)
        if len(squares) == 1:
            return h * sqrt(float(squares[0]) / self._size), new
        fifth, third = squares
        likely = max(fifth, third * min(h**4 * self._likeness, APART))
        self._tried = fifth / (third * h**4) if third * h**4 > 0.0 else 0.0
        return estimate(h, float(likely), float(third), self._size), new

    def _watch_stability(self, h: float, new: FloatArray) -> None:
        """Estimate the fastest decay from two slopes at the end of a step, and count steps at the edge of stability."""
        slopes, values = self._slopes[self._end] - self._slopes[self._end - 1], new - self._last
        apart = float(values.dot(values))
        if apart > 0.0 and h * sqrt(float(slopes.dot(slopes)) / apart) > self._pair.edge:
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
        k, h, end = self._slopes, self._h, self._end
        for stage in range(end + 1, len(k)):
            y = self._y_old + h * (self._weights[stage, :stage] @ k[:stage])
            k[stage] = self._slope(self._t_old + self._pair.nodes[stage] * h, y)
        step = self._y - self._y_old
        first = np.array([step, h * k[0] - step, 2.0 * step - h * (k[0] + k[end])])
        return np.concatenate([first, h * (self._dense @ k)])

    def _root(self, error: float) -> float:
        """Return the root of the method's order, whose inverse the compiled steps know to eight binary digits."""
        share = int(256 / self._pair.order) / 256
        return float(error**share)
