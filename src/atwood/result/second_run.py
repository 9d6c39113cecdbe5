"""A second solution of a run, independent of it and more accurate, from which its error is estimated.

Two solutions whose tolerances are far apart differ by the error of the less accurate one (Hairer, Norsett and Wanner,
Solving ODEs I, section II.4). A run in maximal coordinates has its second solution in generalized ones, which are
solved by other methods, and mostly at a fraction of the cost.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.shared import Shared
from atwood.late import replace
from atwood.simulation.events.sampling import refuse_updates
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.made import Run
from atwood.simulation.run.run import run
from atwood.simulation.run.tolerances import LEAST

__all__ = ["TIGHTER", "second_run"]

TIGHTER = 30.0
"""The tolerance of the second solution is so many times less: two steps of ten cost too much, one tells too little."""

_LEAST = {"ida": 1e-13, "ida-sundae": 1e-13}
"""Tolerances below this a method cannot be asked for; else the least that there is."""

_PATIENCE, _SECONDS = 20.0, 30.0
"""The second run may take so many times as long as the first, and so many seconds at least."""


def second_run(first: Run, times: FloatArray) -> Run:
    """Solve a scene once more, more accurately.

    Parameters
    ----------
    first
        The run.
    times
        Output times, s.

    Raises
    ------
    UsageError
        If there cannot be a second solution.
    """
    where = first.assembly.flat.name
    if first.start is None or not first.segments:
        raise UsageError("there is nothing in the run, and so no error", where=where)
    refuse_updates(first.assembly)
    found, failure = None, ""
    for assembly, options in _attempts(first, times):
        try:
            found = run(assembly, first.start, options, assembly.other_mode)
        except AtwoodError as error:
            failure = error.message
            continue
        if found.status in (first.status, "stopped", "finished"):
            return found
        failure = found.message
    raise UsageError(f"no second solution could be found: {failure}", where=where, advice="Try another rtol.")


def _attempts(first: Run, times: FloatArray) -> list[tuple[Assembly, RunOptions]]:
    """Return in which coordinates and how to solve a scene once more, the best way first."""
    options, solver = first.options, first.solver
    seconds = max(_SECONDS, _PATIENCE * first.statistics.seconds)
    base = replace(
        options,
        outputs=np.asarray(times),
        progress=None,
        on_step=None,
        max_steps=None,
        max_step=None,
        order=None,
        step=None,
        solver="auto",
        absolute_tolerance=None,
        max_seconds=seconds if options.max_seconds is None else max(options.max_seconds, seconds),
    )
    rtol = 1e-11 if solver == "gauss" else options.relative_tolerance
    tighter = replace(base, relative_tolerance=max(rtol / TIGHTER, _LEAST.get(solver, LEAST)))
    found = []
    if first.assembly.form == "dae":
        found.append((_reduced(first.assembly), tighter))
    found.append((first.assembly, tighter))
    # Where nothing tighter can be solved, a looser solution says no more than how large the error is at most.
    found.append((first.assembly, replace(base, relative_tolerance=min(TIGHTER * rtol, 1e-2))))
    return found


def _reduced(assembly: Assembly) -> Assembly:
    """Return the same scene in generalized coordinates."""
    return replace(assembly, form="reduced", level="", shared=Shared(), given_relations=None, held=None)
