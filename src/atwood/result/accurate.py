"""Runs whose motion is as accurate as was asked for: tolerances are chosen, and the error is estimated each time."""

from __future__ import annotations

from collections.abc import Callable

from atwood.errors import SolveError
from atwood.integrators.methods import METHODS
from atwood.late import replace
from atwood.result.result import Result
from atwood.result.second_run import longest_step
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.made import Run

__all__ = ["accurate_run"]

_SHARE = 0.3
"""The next tolerance aims at so much of what was asked for, as if errors were proportional to it."""

_MOST = 1e-3
"""The next tolerance is smaller by this at most."""

_LEAST, _RUNS = 3e-15, 6
"""Tolerances below are rounding; and so many runs at most."""


def accurate_run(
    solve: Callable[[RunOptions], Run], options: RunOptions, accuracy: float, solver: str
) -> tuple[Run, Run | None, str]:
    """Solve a scene so that the error of its motion, by a second solution, is below a limit.

    Parameters
    ----------
    solve
        Runs the scene with options.
    options
        What else was asked for.
    accuracy
        The limit: of positions relative to the extent of the scene, and of angles, rad.
    solver
        What solves the scene at first, a key of `METHODS`.

    Returns
    -------
    tuple
        The run with the loosest of the tolerances that were tried which meets it, else the most accurate one; the
        second solution; and, where the limit is not met, what was reached and until when, in words.
    """
    rtol = min(1e-2, accuracy * METHODS[solver].first_share)
    best: Result | None = None
    failure = ""
    for _ in range(_RUNS):
        rtol = max(rtol, _LEAST)
        try:
            run = solve(replace(options, relative_tolerance=rtol, accuracy=accuracy))
        except SolveError as error:
            if best is None:
                raise
            failure = error.message
            break
        result = Result(run)
        if not run.segments:
            return run, None, ""
        if best is None or result.accuracy.reached < best.accuracy.reached:
            best = result
        if result.accuracy.is_met or run.status not in ("finished", "stopped"):
            return run, result.second.run, ""
        if rtol <= _LEAST:
            break
        factor = _SHARE * accuracy / result.accuracy.reached
        if factor < _MOST:  # something was stepped over, perhaps: from here on as by what saw it
            options = replace(options, max_step=longest_step(run))
        rtol *= min(0.1, max(_MOST, factor))
    assert best is not None
    said = f" (with smaller tolerances: {failure})" if failure else ""
    return best.run, best.second.run, f"{best.accuracy.describe()}{said}"
