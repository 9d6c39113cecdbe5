"""How often a run must be sampled so that no drive or input changes unseen between two samples.

The work of drives and inputs is integrated after a run, through its samples. A motion may be slow although what drives
it is fast, so that neither outputs nor steps say how many samples that takes; the functions of time themselves do.
"""

from __future__ import annotations

import numpy as np

from atwood.expr import Expression, live
from atwood.expr.analysis import dependents
from atwood.forms.assembly import Assembly
from atwood.solve.breaks import Schedule, find_schedule
from atwood.solve.driver import FloatArray

__all__ = ["samples_needed"]

_GRID = 20_000
"""No function of time is looked at more closely than this share of a run."""

_STRIDES = (50, 20, 10, 4, 2)
"""Distances of samples that are tried, in grid points: 400 samples to 10,000."""

_SEEN = 1e-9
"""Relative to its range: a function that samples give by so little less is seen by them."""

_GAIN = 0.02
"""At a jump or a kink what is missed falls with the distance of samples at best, and closer ones are no help."""

_MIDDLE = np.array([-5.0, 49.0, -245.0, 1225.0, 1225.0, -245.0, 49.0, -5.0]) / 2048.0
"""Weights of the polynomial through eight neighbours, half-way between the middle two."""


def samples_needed(assembly: Assembly, start: float, end: float, schedule: Schedule | None = None) -> int:
    """Return how many samples show all functions of time in a scene; 0 if it has none.

    Parameters
    ----------
    assembly
        The scene.
    start, end
        The run, s.
    schedule
        The time events of the run; found if not given.
    """
    schedule = schedule or find_schedule(assembly, start, end)
    program = assembly.known_program("functions of time", "functions of time", lambda: _functions(assembly))
    if not program.results:
        return 0
    n, m = len(assembly.equations.coordinates), len(assembly.equations.speeds)
    idle = (np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(len(assembly.reactions)))
    grid = np.linspace(start, end, _GRID + 1)
    with np.errstate(all="ignore"):
        values = schedule.rows(assembly, grid).kernel(program, vectorized=True)(grid[None, :], *idle)[0]
    rows = (np.broadcast_to(row, grid.shape) for row in values)
    return max(_GRID // _stride(row) for row in rows)


def _functions(assembly: Assembly) -> list[Expression]:
    """Return what depends on time alone and is used by something that does not."""
    equations = assembly.equations
    moving = {*equations.coordinates, *equations.speeds, *equations.accelerations, *equations.multipliers}
    values = [*equations.rows, *equations.constraint_rows, *(one.second for one in equations.constraints)]
    nodes = live(values)
    with_time = dependents(nodes, assembly.mechanism.relations.roots)
    with_motion = dependents(nodes, moving)
    found: dict[Expression, None] = {}
    for node in nodes:
        if node.index in with_motion:
            for one in node.arguments:
                if one.index in with_time and one.index not in with_motion and not one.is_symbol:
                    found[one] = None
    return list(found)


def _stride(values: FloatArray) -> int:
    """Return the largest distance of samples that shows a function, or the usual one where closer ones do not help."""
    if not np.isfinite(values).all():
        return _STRIDES[0]
    values = values - np.mean(values)
    # A power is a product of two such functions, and changes twice as fast.
    both = [(one, _SEEN * float(np.ptp(one))) for one in (values, values * values)]
    missed = [
        max(_missed(one, stride) / allowed if allowed > 0.0 else 0.0 for one, allowed in both) for stride in _STRIDES
    ]
    seen = 0  # from the finest on: what changes once from sample to sample seems not to change at all
    while seen < len(missed) and missed[-1 - seen] <= 1.0:
        seen += 1
    if seen:
        return _STRIDES[len(_STRIDES) - seen]
    return _STRIDES[-1] if missed[-1] < _GAIN * max(missed) else _STRIDES[0]


def _missed(values: FloatArray, stride: int) -> float:
    """Return by how much the polynomial through samples misses what lies half-way between them."""
    known, middles = values[::stride], values[stride // 2 :: stride]
    windows = np.lib.stride_tricks.sliding_window_view(known, 8)
    return float(np.max(np.abs(windows @ _MIDDLE - middles[3 : 3 + len(windows)])))
