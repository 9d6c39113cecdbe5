"""Least values under equations and bounds, by a primal-dual interior-point method with sparse second derivatives.

A. Waechter and L. T. Biegler, Mathematical Programming 106, 2006: the barrier problem, the rule for its parameter, the
filter of the line search (R. Fletcher and S. Leyffer, 2002) and second-order corrections. The matrix is made convex
along each step by the test of N.-Y. Chiang and V. M. Zavala, Computational Optimization and Applications 64, 2016,
which needs no inertia.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass

_FRACTION = 0.99
"""Share of the way to a bound that a step may take."""

_SHORTEST = 1e-10
"""Shorter shares of a step are not tried."""

_TINY = 1e-12
"""What keeps a matrix regular whose equations depend on each other; the solution is refined without it."""

_STEPS = 500
"""More steps are not taken."""


class Problem(Protocol):
    """``f(x)`` is to be least where ``c(x) = 0`` and ``lower <= x <= upper``."""

    lower: FloatArray
    upper: FloatArray

    def values(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return f and c."""

    def slopes(self, x: FloatArray) -> tuple[FloatArray, Any]:
        """Return the gradient of f and the sparse Jacobian of c."""

    def bends(self, x: FloatArray, multipliers: FloatArray) -> Any:
        """Return the sparse second derivatives of ``f + multipliers . c``."""


@dataclass(frozen=True, eq=False)
class Found:
    """Where a method came to.

    Attributes
    ----------
    x, multipliers
        The point, and the multipliers of the equations.
    steps
        How many were taken.
    miss
        The largest of what the conditions of a least value miss.
    message
        Why it ended, where it did not come there; else empty.
    """

    x: FloatArray
    multipliers: FloatArray
    steps: int
    miss: float
    message: str


class _Search:
    """The state of the method."""

    def __init__(self, problem: Problem, x: FloatArray, barrier: float) -> None:
        self.problem, low, high = problem, problem.lower, problem.upper
        room = np.where(np.isfinite(high - low), high - low, 1.0)
        push = np.minimum(0.1 * barrier * np.maximum(1.0, np.abs(x)), 0.1 * room)
        x = np.where(np.isfinite(low), np.maximum(x, low + push), x)
        self.x = np.where(np.isfinite(high), np.minimum(x, high - push), x)
        self.below, self.above = np.isfinite(low), np.isfinite(high)
        self.barrier, self.shift = barrier, 0.0
        self.duals = self.below / self._gap(self.x)[0] * self.barrier, self.above / self._gap(self.x)[1] * self.barrier
        self.f, self.c = problem.values(self.x)
        self.multipliers = np.zeros(len(self.c))
        self.filter: list[tuple[float, float]] = []

    def _gap(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        low, high = self.problem.lower, self.problem.upper
        return np.where(self.below, x - low, 1.0), np.where(self.above, high - x, 1.0)

    def cost(self, x: FloatArray, f: float) -> float:
        """Return the barrier function."""
        low, high = self._gap(x)
        if np.any(low <= 0.0) or np.any(high <= 0.0):
            return np.inf
        return f - self.barrier * float(np.log(low[self.below]).sum() + np.log(high[self.above]).sum())

    def miss(self, gradient: FloatArray, jacobian: Any, barrier: float) -> float:
        """Return what the conditions of the barrier problem miss, scaled by the size of the multipliers."""
        low, high = self._gap(self.x)
        dual = gradient + jacobian.T @ self.multipliers - self.duals[0] + self.duals[1]
        count = max(1, len(self.multipliers) + int(self.below.sum() + self.above.sum()))
        total = np.abs(self.multipliers).sum() + self.duals[0].sum() + self.duals[1].sum()
        scale = max(100.0, float(total) / count) / 100.0
        gaps = [(self.duals[0] * low - barrier)[self.below], (self.duals[1] * high - barrier)[self.above]]
        apart = max((float(np.max(np.abs(one), initial=0.0)) for one in gaps), default=0.0)
        return max(
            float(np.max(np.abs(dual), initial=0.0)) / scale,
            float(np.max(np.abs(self.c), initial=0.0)),
            apart / scale,
        )

    def direction(self, gradient: FloatArray, jacobian: Any) -> tuple[FloatArray, FloatArray, Any] | None:
        """Return a step, new multipliers, and the factors; None where no matrix is convex along its step."""
        from scipy.sparse import block_array, diags_array
        from scipy.sparse.linalg import splu

        low, high = self._gap(self.x)
        bends = self.problem.bends(self.x, self.multipliers)
        sigma = self.duals[0] / low + self.duals[1] / high
        slope = gradient - self.barrier * (self.below / low - self.above / high)
        n, m = len(self.x), len(self.c)
        size = max(1e-8, float(np.max(np.abs(bends.diagonal()), initial=0.0)))
        shift = 0.0 if self.shift == 0.0 else max(1e-12 * size, self.shift / 3.0)
        while shift <= 1e10 * size:
            matrix = bends + diags_array(sigma + shift)
            joint = block_array([[matrix, jacobian.T], [jacobian, None]], format="csc")
            side = -np.concatenate([slope, self.c])
            try:
                factors = splu(joint - diags_array(np.append(np.zeros(n), np.full(m, _TINY)), format="csc"))
                found = factors.solve(side)
                for _ in range(2):
                    found += factors.solve(side - joint @ found)
            except RuntimeError:  # singular
                found = np.full(n + m, np.nan)
            step = found[:n]
            if np.all(np.isfinite(found)) and step @ (matrix @ step) >= 1e-10 * size * (step @ step):
                self.shift = shift
                return step, found[n:], factors
            shift = max(8.0 * shift, 1e-4 * size)
        return None

    def farthest(self, values: tuple[FloatArray, FloatArray], steps: tuple[FloatArray, FloatArray]) -> float:
        """Return the share of steps that keeps values above zero: those at lower bounds, and those at upper ones."""
        share, found = max(_FRACTION, 1.0 - self.barrier), 1.0
        for value, step, has in zip(values, steps, (self.below, self.above), strict=True):
            falls = has & (step < 0.0)
            found = min(found, float(np.min(-share * value[falls] / step[falls], initial=1.0)))
        return found

    def take(self, gradient: FloatArray, jacobian: Any) -> bool:
        """Take a step; False where none leads on."""
        made = self.direction(gradient, jacobian)
        if made is None:
            return False
        step, multipliers, factors = made
        low, high = self._gap(self.x)
        longest = self.farthest((low, high), (step, -step))
        slope = float((gradient - self.barrier * (self.below / low - self.above / high)) @ step)
        duals = (
            np.where(self.below, (self.barrier - self.duals[0] * step) / low, 0.0) - self.duals[0],
            np.where(self.above, (self.barrier + self.duals[1] * step) / high, 0.0) - self.duals[1],
        )
        share = longest
        theta, cost = float(np.abs(self.c).sum()), self.cost(self.x, self.f)
        while share > _SHORTEST:
            for x in self._tries(step, share, share == longest, factors):
                f, c = self.problem.values(x)
                if self._is_better(theta, cost, slope, share, float(np.abs(c).sum()), self.cost(x, f)):
                    self._move(x, f, c, share, multipliers, duals, theta, cost)
                    return True
            share *= 0.5
        return False

    def _tries(self, step: FloatArray, share: float, is_first: bool, factors: Any) -> Any:
        """Yield a point, and one with a second-order correction where it is the first."""
        yield self.x + share * step
        if is_first:
            _, c = self.problem.values(self.x + share * step)
            if np.all(np.isfinite(c)):
                more = factors.solve(-np.concatenate([np.zeros(len(self.x)), c]))[: len(self.x)]
                reach = self.farthest(self._gap(self.x + share * step), (more, -more))
                yield self.x + share * step + reach * more

    def _is_better(self, theta: float, cost: float, slope: float, share: float, miss: float, trial: float) -> bool:
        if not (np.isfinite(trial) and np.isfinite(miss)):
            return False
        if any(miss >= (1.0 - 1e-5) * a and trial >= b - 1e-5 * a for a, b in self.filter):
            return False
        rounding = 1e-13 * max(1.0, abs(cost))
        if theta <= 1e-4 * max(1.0, theta) and slope < 0.0 and (share * -slope) ** 2.3 > theta**1.1:
            return trial <= cost + 1e-4 * share * slope + rounding
        return miss <= (1.0 - 1e-5) * theta or trial <= cost - 1e-5 * theta + (rounding if theta < 1e-9 else 0.0)

    def _move(
        self,
        x: FloatArray,
        f: float,
        c: FloatArray,
        share: float,
        multipliers: FloatArray,
        duals: tuple[FloatArray, FloatArray],
        theta: float,
        cost: float,
    ) -> None:
        if not self.cost(x, f) <= cost - 1e-8 * theta:
            self.filter.append((theta, cost))
        self.multipliers = self.multipliers + share * (multipliers - self.multipliers)
        reach = self.farthest(self.duals, duals)
        self.x, self.f, self.c = x, f, c
        gaps = self._gap(x)
        found = []
        for one, d, gap, has in zip(self.duals, duals, gaps, (self.below, self.above), strict=True):
            near = np.clip(one + reach * d, self.barrier / (1e10 * gap), 1e10 * self.barrier / gap)
            found.append(np.where(has, near, 0.0))
        self.duals = found[0], found[1]


def least(problem: Problem, x: FloatArray, tolerance: float = 1e-10, barrier: float = 0.1) -> Found:
    """Return a point where a function is least near by, under equations and bounds.

    Parameters
    ----------
    problem
        The functions, scaled so that all of them and the unknowns are of the order of one.
    x
        Where to begin.
    tolerance
        What its conditions may miss.
    barrier
        Its parameter to begin with; small where x is near.
    """
    one = _Search(problem, x, barrier)
    message, steps, miss = "", 0, np.inf
    while True:
        gradient, jacobian = problem.slopes(one.x)
        miss = one.miss(gradient, jacobian, 0.0)
        if miss <= tolerance:
            break
        while one.barrier > 0.1 * tolerance and one.miss(gradient, jacobian, one.barrier) <= 10.0 * one.barrier:
            one.barrier = max(0.1 * tolerance, min(0.2 * one.barrier, one.barrier**1.5))
            one.filter = []
        if steps >= _STEPS:
            message = f"it takes more than {_STEPS} steps"
            break
        if not one.take(gradient, jacobian):
            if one.filter:  # what was refused before may lead on from here
                one.filter = []
                steps += 1
                continue
            message = "no step leads on"
            break
        steps += 1
    return Found(one.x, one.multipliers, steps, miss, message)
