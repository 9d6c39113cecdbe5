"""Times at which a law switches by the clock: where conditions on time alone change their truth.

A solver that chooses its own steps can pass over a pulse without seeing it. So these times are found beforehand, and
a run stops and starts at each of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.expr import Expression, depends_on, live
from atwood.forms.assembly import Assembly

__all__ = ["find_breaks", "switches_by_clock"]

FloatArray = NDArray[np.float64]

_GRID = 20_000
"""A condition that changes twice within this share of a run can be missed."""


def find_breaks(assembly: Assembly, start: float, end: float) -> FloatArray:
    """Return the times in between at which something switches by the clock, in order, shape (number, 2).

    Each is a last time before and a first time after, some units of rounding apart: whether a condition holds at the
    very time of its switching depends on how it is written.

    Parameters
    ----------
    assembly
        The scene.
    start, end
        The run, s.
    """
    if not switches_by_clock(assembly):
        return np.zeros((0, 2))
    equations = assembly.equations
    n, m = len(equations.coordinates), len(equations.speeds)
    idle = (np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(len(assembly.reactions)))
    program = assembly.known_program("switches", "switches", lambda: _conditions(assembly))
    kernel = assembly.kernel(program, vectorized=True)

    def signs(times: FloatArray) -> FloatArray:
        values: FloatArray = kernel(times[None, :], *idle)[0]
        return (values > 0.0).astype(float)

    grid = np.linspace(start, end, _GRID + 1)
    states = signs(grid)
    rows, columns = np.nonzero(np.diff(states, axis=1))
    if not len(rows):
        return np.zeros((0, 2))
    low, high, before = grid[columns], grid[columns + 1], states[rows, columns]
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = signs(middle)[rows, np.arange(len(rows))] == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    near = 1e-12 * max(abs(start), abs(end))
    found = np.unique(high)
    found = found[np.concatenate([[True], np.diff(found) > near])]
    found = found[(found > start + near) & (found < end - near)]
    rounding = 4.0 * np.spacing(np.abs(found))
    return np.stack([found - rounding, found + rounding], axis=1)


def switches_by_clock(assembly: Assembly) -> bool:
    """Return whether any law can switch by the clock."""
    program = assembly.known_program("switches", "switches", lambda: _conditions(assembly))
    return bool(program.results)


def _conditions(assembly: Assembly) -> list[Expression]:
    """Return what changes its sign where a law switches by the clock."""
    equations = assembly.equations
    moving = {*equations.coordinates, *equations.speeds, *equations.accelerations, *equations.multipliers}
    values = [*equations.rows, *equations.constraint_rows, *(one.second for one in equations.constraints)]
    found: dict[Expression, None] = {}
    for node in live(values):
        if node.operation in ("less", "less_equal", "minimum", "maximum"):
            difference = node.arguments[0] - node.arguments[1]
        elif node.operation in ("sign", "absolute"):
            difference = node.arguments[0]
        else:
            continue
        if depends_on(difference, [equations.time]) and not depends_on(difference, moving):
            found[difference] = None
    return list(found)
