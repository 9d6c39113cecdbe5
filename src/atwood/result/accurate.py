"""Runs whose motion is as accurate as was asked for: tolerances are chosen, and the error is estimated each time."""

from __future__ import annotations

import warnings
from collections.abc import Callable

from atwood.errors import SolveError
from atwood.late import replace
from atwood.result.result import Result
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.made import Run

__all__ = ["accurate_run"]

_FIRST_BY_IDA = 0.03
"""The first tolerance, relative to the error that was asked for: errors of IDA add up more than those of others."""

_SHARE = 0.3
"""The next tolerance aims at so much of what was asked for, as if errors were proportional to it."""

_MOST = 1e-3
"""The next tolerance is smaller by this at most."""

_LEAST, _RUNS = 3e-15, 6
"""Tolerances below are rounding; and so many runs at most."""


def accurate_run(
    solve: Callable[[RunOptions], Run], options: RunOptions, accuracy: float, by_ida: bool
) -> tuple[Run, Run | None]:
    """Solve a scene so that the error of its motion, by a second solution, is below a limit.

    Parameters
    ----------
    solve
        Runs the scene with options.
    options
        What else was asked for.
    accuracy
        The limit: of positions relative to the extent of the scene, and of angles, rad.
    by_ida
        Whether IDA will solve it.

    Returns
    -------
    tuple
        The run with the loosest of the tolerances that were tried which meets it; else the most accurate one, with a
        warning that says what was reached and until when. And the second solution.
    """
    rtol = min(1e-2, accuracy * (_FIRST_BY_IDA if by_ida else 1.0))
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
            return run, None
        if best is None or result.accuracy.reached < best.accuracy.reached:
            best = result
        if result.accuracy.is_met or run.status not in ("finished", "stopped"):
            return run, result.second.run
        if rtol <= _LEAST:
            break
        rtol *= min(0.1, max(_MOST, _SHARE * accuracy / result.accuracy.reached))
    assert best is not None
    said = f" (with smaller tolerances: {failure})" if failure else ""
    warnings.warn(f"{best.assembly.flat.name}: {best.accuracy.describe()}{said}", stacklevel=4)
    return best.run, best.second.run
