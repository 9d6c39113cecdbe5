"""How far two solutions of a scene are apart: errors of quantities, and of the motion as a whole.

The error of a run: estimated from a second solution, bounded by the balance of energy, made as small as asked.

Two solutions whose tolerances are far apart differ by the error of the less accurate one (Hairer, Norsett and Wanner,
Solving ODEs I, section II.4). A run in maximal coordinates has its second solution in generalized ones, which are
solved by other methods, and mostly at a fraction of the cost.

Where a solver steps over a law that acts briefly, its own estimates see nothing, and neither does a second run that
steps over it, too. The balance of energy does, as soon as one sample meets the law: a state that is right to a share of
the scene's sizes has an energy that is right to as large a share of what these sizes are worth. So a drift that is
larger bears witness to an error of the state. The reverse does not hold: many errors leave the energy as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Shared
from atwood.integrators.methods import AUTO, METHODS
from atwood.lazy_dataclasses import dataclass, replace
from atwood.result.energy import EnergyLedger, accounts, energy_near
from atwood.result.result import Result
from atwood.result.segment_quantities import quantities_of
from atwood.result.work import find_ledger, ledger_of_samples
from atwood.simulation.events.sampling import refuse_updates
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run import run
from atwood.simulation.run.run_record import Run

_LOST = 0.1
"""Errors beyond this share of the scene's size are no longer those of the same motion."""

_SURE = 3.0
"""So many times the distance of two solutions is told: the second has an error, too, at times one as large."""

_DOUBT = 100.0
"""So many tolerances of a second solution its balance of energy may be off before it is not believed."""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """How right a run is, as far as a second, more accurate solution and the balance of energy tell.

    The second solution is more accurate and takes other steps, at most a hundredth of the run each. It is believed
    where its energy balances as far as its tolerance lets one expect, or no worse than that of the run and by no more
    than the two are apart; otherwise the scene is solved with an eighth of these steps, and an eighth again. Where no
    solution is to be believed, the error is not known, and `reached` is infinite.

    What is guaranteed: no solution is compared with whose energy drifts, at any sample, by more than its tolerance or
    the error that is told accounts for; see `atwood.EnergyLedger`. What is not: the distance of two solutions is an
    estimate of the error, so three times this distance is told. A law that both solutions step over is not seen where
    it leaves the energy at all samples as it is, such as a short pulse that a function in Python gives to a body at
    rest. Errors that keep the energy, as those of the time along a periodic motion, are told by the distance alone.

    Attributes
    ----------
    asked
        The largest error that was asked for; None if none was.
    reached
        Three times the estimated error of positions, relative to the extent of the scene, of angles, rad, and of
        quantities with nominal sizes, relative to these: the largest over all outputs. Infinite where it is not known.
    path
        Which quantity it is of.
    until
        Until when the error is within what was asked, or, where nothing was asked, within a tenth of the scene's size:
        beyond, neighbouring motions have parted, and the run tells little of the motion; s.
    events
        Estimated errors of the times of events, s; nan where the second solution has no such event.
    how
        What the second solution is.
    """

    asked: float | None
    reached: float
    path: str
    until: float
    events: FloatArray
    how: str

    @property
    def is_known(self) -> bool:
        """Whether there is a second solution that is to be believed."""
        return math.isfinite(self.reached)

    @property
    def is_met(self) -> bool:
        """Whether the error is within what was asked."""
        return self.asked is None or self.reached <= self.asked

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        events = [None if np.isnan(one) else float(one) for one in self.events]
        reached = self.reached if self.is_known else None
        own = {"asked": self.asked, "reached": reached, "path": self.path, "until": self.until}
        return {**own, "events": events, "how": self.how}

    def describe(self) -> str:
        """Return it in a sentence."""
        if not self.is_known:
            return f"the error is not known (compared with {self.how})"
        found = f"error {self.reached:.1e} at most, of {self.path}" if self.path else "nothing has an error"
        if self.asked is not None and not self.is_met:
            found += f"; {self.asked:g} was asked for, and holds until t = {self.until:.6g} s"
        elif self.reached > _LOST:
            found += f"; it tells little of the motion after t = {self.until:.6g} s"
        return f"{found} (estimated by {self.how})"


def compared_paths(assembly: Assembly) -> list[str]:
    """Return the positions of all bodies with mass, the coordinates that are angles, and, in space, axes of bodies.

    A frame without a body of its own, as that of a `Rotor`, has a coordinate in a plane that is no quantity: those of
    the joints are compared then.
    Axes that differ by less than they are long differ by the angle between two orientations, in radians; coordinates
    of orientations differ where nothing does.
    """
    known = assembly.observables
    owners = [path for path, local in assembly.mechanism.locals_.items() if local.point_inertias or local.body_inertias]
    paths = [f"{owner}.position.{axis}" for owner in owners for axis in "xyz"]
    paths += [one.name for one in assembly.reduced.names]
    if any(one.name not in known and one.unit in ("m", "rad") for one in assembly.reduced.names):
        joints = [joint for local in assembly.mechanism.locals_.values() for joint in local.joints]
        paths += [one.name for joint in joints for one in joint.coordinates]
    found = [path for path in dict.fromkeys(paths) if path in known and known[path].unit in ("m", "rad")]
    if assembly.mechanism.space.is_spatial:
        axes = [f"{owner}.{axis}_axis.{part}" for owner in owners for axis in "xyz" for part in "xyz"]
        found += [path for path in axes if path in known]
    return found


def difference(time: FloatArray, values: FloatArray, other_time: FloatArray, other: FloatArray) -> FloatArray:
    """Return by how much two solutions differ at the output times of the first, shape (times,).

    At an event the first has states before and after; which of them the other one has there is not known, and the
    larger error beside the event is taken.
    """
    at = np.minimum(np.searchsorted(other_time, time), len(other_time) - 1)
    twice = np.zeros(len(time), dtype=bool)
    twice[1:] = np.diff(time) == 0.0
    twice[:-1] |= twice[1:]
    found = np.where((other_time[at] == time) & ~twice, np.abs(values - other[at]), np.nan)
    known = np.flatnonzero(~np.isnan(found))
    if len(known):
        before = known[np.maximum(np.searchsorted(known, np.arange(len(time)), side="right") - 1, 0)]
        after = known[np.minimum(np.searchsorted(known, np.arange(len(time))), len(known) - 1)]
        found = np.maximum(found[before], found[after])
    return found


def estimate_accuracy(first: Run, second: Run, time: FloatArray, error: Callable[[str], FloatArray]) -> Accuracy:
    """Return how right a motion is from the errors of its positions and angles."""
    asked, known = first.options.accuracy, first.assembly.observables
    length = first.start.length if first.start is not None else 1.0
    compared = dict.fromkeys([*compared_paths(first.assembly), *first.options.nominal])
    paths = [path for path in compared if path in second.assembly.observables]
    usual = {path: length if known[path].unit == "m" else 1.0 for path in paths}
    scales = {path: first.options.nominal.get(path, size) for path, size in usual.items()}
    rtol = second.options.relative_tolerance
    limit = _LOST if asked is None else asked
    worst, path = 0.0, ""
    late = len(time)
    for one, scale in scales.items():
        found = _SURE * error(one) / scale
        largest = float(np.max(found, initial=0.0))
        if not largest <= worst:
            worst, path = largest, one
        beyond = np.flatnonzero(~(found <= limit))
        late = min(late, int(beyond[0]) if len(beyond) else late)
    summed, where = _summed(second, time, length)
    if summed > worst:
        worst, path = summed, where
    until = float(time[late - 1]) if late else float(time[0])
    form, solver = second.assembly.form, METHODS[second.solver].title
    how = f"a second solution, {form} form, {solver}, rtol {rtol:.1g}"
    needed = needed_error(second, _DOUBT * rtol)
    if needed > _DOUBT * rtol and needed > min(worst, needed_error(first, _DOUBT * rtol)):
        how = f"{how}, whose own energy drifts as if it had an error of {needed:.1e}"
        worst, path, until = math.inf, "", float(time[0])
    alike = [(a.part, a.law) == (b.part, b.law) for a, b in zip(first.events, second.events, strict=False)]
    missed = [
        abs(a.time - b.time) if same else np.nan for a, b, same in zip(first.events, second.events, alike, strict=False)
    ]
    missed += [np.nan] * (len(first.events) - len(missed))
    return Accuracy(asked, worst, path, until, np.array(missed, dtype=float), how)


def _summed(second: Run, time: FloatArray, length: float) -> tuple[float, str]:
    """Return how far bounces rise that the second solution has summed where there are outputs, and of which gap.

    Both solutions have the part at rest there. With the ratio r of the last impact, at speed v, a series that ends in
    T goes on for r T, and its next bounce, of r (1 - r) T, begins with r v.
    """
    found, path = 0.0, ""
    for number, one in enumerate(second.events):
        own = [x for x in second.events[:number] if x.struck is not None and (x.part, x.law) == (one.part, one.law)]
        if one.kind != "rests" or not own or own[-1].struck is None:
            continue
        last, gap = own[-1].struck, f"{one.part}.{one.law}"
        ratio, left = abs(last.after / last.before) if last.before else 0.0, one.time - last.time
        if not np.any((time > one.time - ratio * left) & (time < one.time)):
            continue
        height = 0.25 * ratio**2 * abs(1.0 - ratio) * abs(last.after) * left
        size = height / (length if second.assembly.observables[gap].unit == "m" else 1.0)
        if size > found:
            found, path = size, gap
    return found, path


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
            pieces = accounts(quantities_of(run.segments))
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
