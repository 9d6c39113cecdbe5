"""How a run is made: its end, tolerances, outputs, limits and solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atwood.errors import UsageError

__all__ = ["SOLVERS", "RunOptions", "sample_times"]

FloatArray = NDArray[np.float64]

SOLVERS = {
    "ida": "SUNDIALS IDA",
    "ida-sundae": "SUNDIALS IDA through scikit-sundae",
    "explicit": "Dormand-Prince 8(5,3)",
    "taylor": "Taylor series",
}
"""What can solve a scene, and what it is called."""


@dataclass(frozen=True)
class RunOptions:
    """How a run is made.

    Attributes
    ----------
    t_end
        Time of the end, s.
    relative_tolerance
        Error allowed in a step; absolute tolerances are this share of the scene's sizes.
    outputs
        Number of output times, evenly spread, or the times themselves.
    max_steps, max_seconds
        Limits of the run.
    progress
        Called with the time reached.
    max_order, max_step
        Limits for the method.
    samples
        A run is sampled at least so often, for work and for angles that count turns, whatever is shown of it; more
        often if functions of time change faster, unless this is 1.
    solver
        A key of `SOLVERS`, or ``"auto"``; see `atwood.solve.choice`.
    structure
        Whether it may be that nothing can move.
    """

    t_end: float
    relative_tolerance: float = 1e-8
    outputs: int | FloatArray = 201
    max_steps: int | None = None
    max_seconds: float | None = None
    progress: Callable[[float], object] | None = None
    max_order: int = 5
    max_step: float | None = None
    solver: str = "auto"
    samples: int = 400
    structure: bool = False

    def out_of_time(self, t: float) -> str:
        """Return what is said of a run that its limit of time ended, at a time of its own."""
        return f"the limit of {self.max_seconds:g} s was used up (at t = {t:.9g})"

    def out_of_steps(self, t: float) -> str:
        """Return the same of its limit of steps."""
        return f"the limit of {self.max_steps} steps was used up (at t = {t:.9g})"


def sample_times(t: float, options: RunOptions, at_least: int = 0) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return all sample times with the start, and which of them are outputs.

    Parameters
    ----------
    t
        Time of the start, s.
    options
        How the run is made.
    at_least
        As many samples are taken anyway.
    """
    if isinstance(options.outputs, (int, np.integer)):
        asked = np.linspace(t, options.t_end, int(options.outputs))
    else:
        asked = options.outputs
        if asked[0] < t or asked[-1] > options.t_end:
            raise UsageError(
                f"outputs go from {asked[0]:g} to {asked[-1]:g} s",
                advice=f"Give times between {t:g} and {options.t_end:g}.",
            )
    filling = np.linspace(t, options.t_end, max(options.samples, at_least) + 1)
    near = 1e-9 * (options.t_end - t)
    next_asked = np.minimum(np.searchsorted(asked, filling), len(asked) - 1)
    distance = np.minimum(np.abs(asked[next_asked] - filling), np.abs(asked[np.maximum(next_asked - 1, 0)] - filling))
    filling = filling[distance > near]
    times = np.concatenate([asked, filling])
    shown = np.concatenate([np.ones(len(asked), dtype=bool), np.zeros(len(filling), dtype=bool)])
    order = np.argsort(times)
    return times[order], shown[order]
