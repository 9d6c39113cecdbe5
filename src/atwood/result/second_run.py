"""A second solution of a run, independent of it and more accurate, from which its error is estimated.

Two solutions whose tolerances are far apart differ by the error of the less accurate one (Hairer, Norsett and Wanner,
Solving ODEs I, section II.4). A run in maximal coordinates has its second solution in generalized ones, which are
solved by other methods, and mostly at a fraction of the cost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.shared import Shared
from atwood.integrators.methods import AUTO, METHODS
from atwood.late import replace
from atwood.simulation.events.sampling import refuse_updates
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.made import Run
from atwood.simulation.run.run import run

if TYPE_CHECKING:
    from atwood.result.accuracy import Accuracy

__all__ = ["TIGHTER", "longest_step", "second_run"]

TIGHTER = 30.0
"""The tolerance of the second solution is so many times less: two steps of ten cost too much, one tells too little."""

_STEPS = 97.0
"""The least number of steps of a second solution; it divides no usual number of outputs."""

_OTHER = 0.6
"""Where the longest step of the run was given, that of the second solution is this share, so that both differ."""

_SHORTER = (1.0, 8.0, 64.0)
"""So many times shorter are the longest steps of one second solution after the other, until one is to be believed."""

_PATIENCE, _SECONDS = 20.0, 30.0
"""The second run may take so many times as long as the first, and so many seconds at least."""


def second_run(first: Run, times: FloatArray, accuracy: Callable[[Run], Accuracy]) -> Run:
    """Solve a scene once more, more accurately, and with other steps.

    Parameters
    ----------
    first
        The run.
    times
        Output times, s.
    accuracy
        What a second run tells of the first one. Where that is nothing to be believed, steps are shortened.

    Raises
    ------
    UsageError
        If there cannot be a second solution.
    """
    where = first.assembly.flat.name
    if first.start is None or not first.segments:
        raise UsageError("there is nothing in the run, and so no error", where=where)
    refuse_updates(first.assembly)
    last, failure = None, ""
    for assembly, ways in _attempts(first, times):
        for options in ways:
            try:
                found = run(assembly, first.start, options, assembly.other_mode)
            except AtwoodError as error:
                failure = error.message
                break
            if found.status not in (first.status, "stopped", "finished"):
                failure = found.message
                break
            last = found
            if accuracy(found).is_known:
                return found
    if last is not None:
        return last
    raise UsageError(f"no second solution could be found: {failure}", where=where, advice="Try another rtol.")


def _attempts(first: Run, times: FloatArray) -> Iterator[tuple[Assembly, list[RunOptions]]]:
    """Yield in which coordinates to solve a scene once more, and with which steps, the best way first."""
    options, method = first.options, METHODS[first.solver]
    seconds = max(_SECONDS, _PATIENCE * first.statistics.seconds)
    base = replace(
        options,
        outputs=np.asarray(times),
        progress=None,
        on_step=None,
        max_steps=None,
        order=None,
        step=None,
        solver=AUTO,
        absolute_tolerance=None,
        max_seconds=seconds if options.max_seconds is None else max(options.max_seconds, seconds),
    )
    rtol = method.judged_tolerance or options.relative_tolerance
    tighter = replace(base, relative_tolerance=max(rtol / TIGHTER, method.least_tolerance))
    ways = [replace(tighter, max_step=longest_step(first, shorter)) for shorter in _SHORTER]
    if first.assembly.form == "dae":
        yield _reduced(first.assembly), ways
    yield first.assembly, ways
    # Where nothing tighter can be solved, a looser solution says no more than how large the error is at most.
    looser = replace(base, relative_tolerance=min(TIGHTER * rtol, 1e-2), max_step=longest_step(first, 1.0))
    yield first.assembly, [looser]


def longest_step(first: Run, shorter: float = 1.0) -> float:
    """Return the longest step of a second solution, s.

    Parameters
    ----------
    first
        The run that is judged.
    shorter
        So many times shorter, where steps were too long before.
    """
    assert first.start is not None
    step = (first.options.t_end - first.start.time) / _STEPS
    own = first.options.max_step
    return (step if own is None else min(step, _OTHER * own)) / shorter


def _reduced(assembly: Assembly) -> Assembly:
    """Return the same scene in generalized coordinates."""
    return replace(assembly, form="reduced", level="", shared=Shared(), given_relations=None, held=None)
