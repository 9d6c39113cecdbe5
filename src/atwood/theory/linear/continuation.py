"""Branches of solutions of ``r(x, p) = 0``: followed by arc length, with folds and branch points.

Pseudo-arclength continuation (Keller, in Applications of Bifurcation Theory, 1977; Allgower and Georg, Numerical
Continuation Methods, 1990, chapters 2 and 8): a tangent predicts, Newton's method corrects across it. Where the
determinant of the equations with the tangent changes its sign another branch crosses, along the null vector there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.numerics.matrices import or_one
from atwood.numerics.newton import Missing, largest, newton
from atwood.numerics.rank import decompose
from atwood.tolerances import tolerances

_FIRST, _LARGEST, _SMALLEST = 1e-2, 5e-2, 1e-7
"""Arc length of steps, where every unknown and the parameter's range have size one."""

_MOST_STEPS = 2000

_NEARLY = 100.0
"""Times `tolerances.MET`: what is a solution where rounding leaves no better."""

_FAR = 0.5
"""A step of Newton's method that is longer leads to another branch."""

_STEPS = 12

_ASIDE = 1e-3
"""How far from a branch point a branch that crosses is looked for."""


class _Nowhere(ArithmeticError):
    """There are no residuals at a point, or it is too far away."""


class Residual(NamedTuple):
    """Residuals at a point, with their derivatives by the unknowns and by the parameter."""

    value: FloatArray
    by_x: FloatArray
    by_p: FloatArray


@dataclass(frozen=True, eq=False)
class Problem:
    """What is solved, in unknowns of size one.

    Attributes
    ----------
    at
        Residuals at (x, p); None where there are none. Their derivatives by the parameter may be given, from near by.
    low, high
        Range of the parameter, of length one.
    """

    at: Callable[[FloatArray, float, FloatArray | None], Residual | None]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Curve:
    """A branch.

    Attributes
    ----------
    x, p
        Its points, shape (points, unknowns) and (points,).
    folds
        Points at which the parameter turns back, as (x, p).
    crossings
        Points at which another branch crosses, as (x, p).
    """

    x: FloatArray
    p: FloatArray
    folds: tuple[tuple[FloatArray, float], ...]
    crossings: tuple[tuple[FloatArray, float], ...]


@dataclass(frozen=True, eq=False)
class _Point:
    x: FloatArray
    p: float
    tangent: FloatArray
    determinant: float


def follow(problem: Problem, x: FloatArray, p: float, direction: FloatArray) -> Curve:
    """Return the branch from a solution in one direction, to the end of the parameter's range."""
    now = _point(problem, x, p, direction)
    if now is None:
        return Curve(x[None], np.array([p]), (), ())
    points, folds, crossings = [now], [], []
    step = _FIRST
    for _ in range(_MOST_STEPS):
        later = _step(problem, now, step)
        if later is None or float(later.tangent @ now.tangent) < 0.9:
            step *= 0.5
            if step < _SMALLEST:
                break
            continue
        if later.tangent[-1] * now.tangent[-1] < 0.0:
            folds += _located(problem, now, step, lambda point: point.tangent[-1])
        if later.determinant * now.determinant < 0.0:
            crossings += _located(problem, now, step, lambda point: point.determinant)
        if not problem.low <= later.p <= problem.high:
            edge = problem.low if later.p < problem.low else problem.high
            points += _at_edge(problem, now, later, edge)
            break
        points.append(later)
        closed = len(points) > 10 and np.linalg.norm(_whole(later) - _whole(points[0])) < 0.5 * step
        now, step = later, min(1.4 * step, _LARGEST)
        if closed:
            break
    return Curve(
        np.array([one.x for one in points]), np.array([one.p for one in points]), tuple(folds), tuple(crossings)
    )


def branch_directions(problem: Problem, x: FloatArray, p: float) -> list[tuple[FloatArray, float, FloatArray]]:
    """Return points beside a branch point on the branch that crosses there, with directions away from it."""
    found: list[tuple[FloatArray, float, FloatArray]] = []
    residual = problem.at(x, p, None)
    if residual is None:
        return found
    along = np.append(decompose(residual.by_x).right[-1], 0.0)
    for sign in (1.0, -1.0):
        start = np.append(x, p) + sign * _ASIDE * along
        solved = _corrected(problem, start, sign * along)
        if solved is not None:
            found.append((solved[:-1], float(solved[-1]), sign * along))
    return found


def _whole(point: _Point) -> FloatArray:
    return np.append(point.x, point.p)


def _point(problem: Problem, x: FloatArray, p: float, direction: FloatArray) -> _Point | None:
    """Return a solution with its unit tangent in a direction."""
    residual = problem.at(x, p, None)
    if residual is None:
        return None
    matrix = np.hstack([residual.by_x, residual.by_p[:, None]])
    tangent = decompose(matrix).right[-1]
    tangent = tangent if float(tangent @ direction) >= 0.0 else -tangent
    sign, size = np.linalg.slogdet(np.vstack([matrix / or_one(np.max(np.abs(matrix), axis=1, keepdims=True)), tangent]))
    return _Point(x, p, tangent, float(sign * np.exp(size / (len(x) + 1))))


def _step(problem: Problem, now: _Point, length: float) -> _Point | None:
    solved = _corrected(problem, _whole(now) + length * now.tangent, now.tangent)
    return None if solved is None else _point(problem, solved[:-1], float(solved[-1]), now.tangent)


def _corrected(problem: Problem, guess: FloatArray, across: FloatArray) -> FloatArray | None:
    """Return the solution in the plane through a guess across a direction; None if Newton's method finds none."""
    by_p: FloatArray | None = None

    def look(whole: FloatArray) -> Missing:
        nonlocal by_p
        residual = problem.at(whole[:-1], float(whole[-1]), by_p)
        if residual is None:
            raise _Nowhere
        by_p = residual.by_p  # which changes little over a step
        matrix = np.vstack([np.hstack([residual.by_x, residual.by_p[:, None]]), across])
        rows = or_one(np.max(np.abs(matrix), axis=1))
        return Missing(np.append(residual.value, across @ (whole - guess)), rows, lambda: matrix)

    def moved(whole: FloatArray, step: FloatArray) -> FloatArray:
        if largest(step) > _FAR:
            raise _Nowhere
        return whole + step

    try:
        found, left = newton(look, moved, guess, np.ones(len(guess)), steps=_STEPS, met=tolerances.MET)
    except _Nowhere:
        return None
    return found if left.miss <= _NEARLY * tolerances.MET else None


def _located(
    problem: Problem, now: _Point, step: float, value: Callable[[_Point], float]
) -> list[tuple[FloatArray, float]]:
    """Return where along a step a function of the point is zero."""

    def at(length: float) -> float:
        point = now if length == 0.0 else _step(problem, now, length)
        return np.nan if point is None else value(point)

    try:
        length = scipy.optimize.brentq(at, 0.0, step, xtol=1e-13, rtol=1e-13)
    except (ValueError, RuntimeError):
        return []
    point = _step(problem, now, float(length)) or now
    return [(point.x, point.p)]


def _at_edge(problem: Problem, now: _Point, later: _Point, edge: float) -> list[_Point]:
    """Return the solution at the end of the parameter's range."""
    share = (edge - now.p) / (later.p - now.p)
    guess = np.append(now.x + share * (later.x - now.x), edge)
    across = np.zeros(len(guess))
    across[-1] = 1.0
    solved = _corrected(problem, guess, across)
    point = None if solved is None else _point(problem, solved[:-1], edge, now.tangent)
    return [] if point is None else [point]
