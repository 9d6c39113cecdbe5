"""The error of a run: estimated from a second solution, bounded by the balance of energy, made as small as asked.

Two solutions whose tolerances are far apart differ by the error of the less accurate one (Hairer, Norsett and Wanner,
Solving ODEs I, section II.4). A run in maximal coordinates has its second solution in generalized ones, which are
solved by other methods, and mostly at a fraction of the cost.

Where a solver steps over a law that acts briefly, its own estimates see nothing, and neither does a second run that
steps over it, too. The balance of energy does, as soon as one sample meets the law: a state that is right to a share of
the scene's sizes has an energy that is right to as large a share of what these sizes are worth. So a drift that is
larger bears witness to an error of the state. The reverse does not hold: many errors leave the energy as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Shared
from atwood.integrators.methods import AUTO, METHODS
from atwood.lazy_dataclasses import replace
from atwood.result.energy import EnergyLedger, account, energy_near
from atwood.result.result import Result
from atwood.result.segment_quantities import SegmentQuantities
from atwood.result.work import find_ledger, ledger_of_samples
from atwood.simulation.events.sampling import refuse_updates
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.made import Run
from atwood.simulation.run.run import run

if TYPE_CHECKING:
    from atwood.result.accuracy import Accuracy


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
    """Solve a scene once more, more accurately, and with other steps."""
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
    """Return the longest step of a second solution, s."""
    assert first.start is not None
    step = (first.options.t_end - first.start.time) / _STEPS
    own = first.options.max_step
    return (step if own is None else min(step, _OTHER * own)) / shorter


def _reduced(assembly: Assembly) -> Assembly:
    """Return the same scene in generalized coordinates."""
    return replace(assembly, form="reduced", level="", shared=Shared(), given_relations=None, held=None)


_SHARE = 0.3
"""The next tolerance aims at so much of what was asked for, as if errors were proportional to it."""

_MOST = 1e-3
"""The next tolerance is smaller by this at most."""

_LEAST, _RUNS = 3e-15, 6
"""Tolerances below are rounding; and so many runs at most."""


def accurate_run(
    solve: Callable[[RunOptions], Run], options: RunOptions, accuracy: float, solver: str
) -> tuple[Run, Run | None, str]:
    """Solve a scene so that the error of its motion, by a second solution, is below a limit."""
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


_NEAR = 1e-6
"""By such a share of their sizes states are moved to see what the energy makes of it."""


def needed_error(run: Run, doubt: float) -> float:
    """Return the error of the state of a run that the drift of its energy needs at least, at any sample.

    It is a share of the sizes of coordinates and speeds; zero where rounding, and the error of the work as an integral,
    account for the drift, and where there is no balance.
    """
    every = np.ones(sum(len(one.time) for one in run.segments), dtype=bool)
    with np.errstate(all="ignore"):
        try:
            pieces = [account(SegmentQuantities(one)) for one in run.segments]
            worth = max(energy_near(one, _NEAR) for one in run.segments) / _NEAR
            found = _beyond(ledger_of_samples(pieces, every)) / worth
            if found > doubt and any(one.power is not None for one in pieces):
                found = _beyond(find_ledger(run, pieces, every)) / worth
        except (AtwoodError, ArithmeticError, ValueError):  # laws without a value where they are asked
            return 0.0
    return found if np.isfinite(found) else 0.0


def _beyond(ledger: EnergyLedger) -> float:
    """Return by how much a balance drifts beyond what is known of it, J."""
    balance = ledger.total - ledger.work
    return float(np.maximum(0.0, np.max(np.abs(balance - balance[0])) - ledger.uncertainty))
