"""Positions at the start: the configuration near the guesses that fulfils the constraints and what is fixed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.errors import KernelEvaluationError, StartError
from atwood.forms.assembly import Assembly
from atwood.mechanics.equations import Equations
from atwood.solve.start_errors import explain_positions
from atwood.solve.start_system import MET, System, counted, newton
from atwood.solve.start_targets import Level, said
from atwood.solve.turning import Turning, resting_place, roughly_turned, turning_of

__all__ = ["solve_positions"]

FloatArray = NDArray[np.float64]


def solve_positions(
    assembly: Assembly, equations: Equations, level: Level, scales: FloatArray, t: float
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]]:
    """Return coordinates that fulfil constraints and what is fixed; which nothing determines, and what repeats others.

    Parameters
    ----------
    assembly, equations
        The scene.
    level
        What is said of positions.
    scales
        Size of a displacement along each speed.
    t
        Time of the start, s.

    Raises
    ------
    StartError
        If a loop cannot close, or what is fixed contradicts itself or the constraints.
    """
    rough = [*level.guessed, *level.fixed]
    turning = turning_of(assembly, "reduced")
    q, is_direct = said(equations.coordinates, rough, resting_place(equations))
    q = _turned(equations, turning, q)
    if not is_direct:
        q = _brought_near(System(assembly, equations, rough, False), equations, scales, t, q)
    system = System(assembly, equations, level.fixed, True)
    q, missing, matrix = newton(system, scales, t, q)
    if missing.size and not float(np.max(np.abs(missing))) <= MET:
        explain_positions(assembly, equations, level, scales, t, q, missing)
    tangent = None if turning.is_plain else turning.tangent(t, q)
    for chart in equations.charts:  # what turns at all has no orientation, whichever coordinate shows it here
        assert tangent is not None
        tangent[list(chart.coordinates)] = np.max(np.abs(tangent[list(chart.coordinates)]), axis=0)
    names = [one.name for one in equations.names]
    return q, *counted(names, tangent, level.fixed, system.constraints, matrix)


def _brought_near(system: System, equations: Equations, scales: FloatArray, t: float, q: FloatArray) -> FloatArray:
    """Return a configuration near what is said of it; orientations begin elsewhere where they do not get there."""
    try:
        near, missing, _ = newton(system, scales, t, q, iterations=20)
        if not equations.charts or float(np.max(np.abs(missing), initial=0.0)) <= MET:
            return near
    except KernelEvaluationError:
        if not equations.charts:
            raise
    turned = roughly_turned(equations, lambda trial: _far_off(system, t, trial), q)
    return newton(system, scales, t, turned, iterations=20)[0]


def _far_off(system: System, t: float, q: FloatArray) -> float:
    """Return how far a configuration is from what is asked for; infinite where that has no value."""
    try:
        missing, matrix = system.at(t, q, np.zeros(system.speeds))
    except KernelEvaluationError:
        return np.inf
    rows = np.max(np.abs(matrix), axis=1, initial=0.0)
    return float(np.sum((missing / np.where(rows > 0.0, rows, 1.0)) ** 2))


def _turned(equations: Equations, turning: Turning, q: FloatArray) -> FloatArray:
    """Return rough coordinates whose orientations mean something."""
    for chart in equations.charts:
        if not np.any(q[list(chart.coordinates)]):
            raise StartError("coordinates of an orientation that are all zero mean nothing", where=chart.body)
    return turning.normalized(q)
