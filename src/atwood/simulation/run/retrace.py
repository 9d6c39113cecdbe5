"""The same run once more, to look at what it did between its samples.

Samples change nothing in a run, and runs are deterministic: so the states between the samples of a run, which nobody
kept, are found by making it again.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.late import replace
from atwood.simulation.run.made import Run

__all__ = ["run_again", "times_of_steps"]

_SAME = 1e-9
"""Of the scene's sizes: projections of many states at once round as their number has it, and the solver not at all."""

_WHOLE = ("finished", "stopped", "failed")
"""How a run ends by itself; otherwise it is made again with as many steps as it came to."""


def times_of_steps(run: Run) -> FloatArray:
    """Return the times between which the solver of a run took one step, in order; they cost as much as the run."""
    times: list[float] = []
    _repeat(run, np.zeros(0), times.append)
    return np.unique(times)


def run_again(run: Run, between: FloatArray) -> Run | None:
    """Return the same run with more samples, or None if it comes out otherwise.

    Parameters
    ----------
    run
        A run.
    between
        Times of the samples that come on top.
    """
    found = _repeat(run, between, None)
    if found is None or len(found.segments) != len(run.segments):
        return None
    for one, other in zip(run.segments, found.segments, strict=True):
        places = np.minimum(np.searchsorted(other.time, one.time), len(other.time) - 1)
        if not np.array_equal(other.time[places], one.time):
            return None
        apart = np.abs(other.coordinates[:, places] - one.coordinates) / one.plan.coordinate_sizes[:, None]
        if not np.max(apart, initial=0.0) < _SAME:
            return None
    return found


def _repeat(run: Run, between: FloatArray, on_step: Callable[[float], object] | None) -> Run | None:
    if run.again is None:
        return None
    limit = run.options.max_steps if run.status in _WHOLE else run.statistics.steps
    options = replace(run.options, progress=None, max_steps=limit, on_step=on_step)
    try:
        with warnings.catch_warnings():  # they have been said before
            warnings.simplefilter("ignore")
            return run.again(options, between)
    except AtwoodError as error:
        found: Run | None = getattr(error, "run", None)
        return found
