"""The record of a run, and the same run made once more to look between its samples.

Samples change nothing in a run, and runs are deterministic: so the states between the samples of a run, which nobody
kept, are found by making it again.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError
from atwood.forms.assembly import Assembly
from atwood.integrators.protocol import Statistics
from atwood.lazy_dataclasses import dataclass, replace
from atwood.simulation.dynamics.orientation_coordinates import (
    CoordinateSwitch,
)
from atwood.simulation.events.modes import EventProbe, EventRecord, ToldLater
from atwood.simulation.initialization.start import Start
from atwood.simulation.problem.options import RunOptions, Samples
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.choice import Choice, describe_choices
from atwood.simulation.run.recorder import SegmentRecord, Stretch
from atwood.simulation.run.session import KeptSession

if TYPE_CHECKING:
    from atwood.simulation.run.moments import Ahead, Passed
    from atwood.simulation.singular.crossing import SingularCrossing


@dataclass(frozen=True, eq=False)
class Run:
    """What a run produced.

    Attributes
    ----------
    assembly
        The scene as it was assembled at the start.
    stretches
        What the solver did from stop to stop; none where time was used up before the start was recorded.
    told
        Events, in order; those of jumps are made when somebody asks for `events`.
    statistics
        What the solver did.
    status
        ``"finished"``, ``"stopped"`` by an event, or ``"step_limit"``, ``"time_limit"``, ``"interrupted"``,
        ``"failed"``.
    message
        Why it ended, in words.
    start
        The start; None where time was used up before it was found.
    options
        What was asked for.
    choices
        What solved it and why, one after the other.
    coordinate_switches
        When which orientation went on in other coordinates, since these came near to where they are singular.
    again
        Makes the same run with other options, and with samples in between that change nothing.
    timings
        What each stage took, s; see `atwood.stages`.
    """

    assembly: Assembly
    stretches: tuple[Stretch, ...]
    told: tuple[EventRecord | ToldLater, ...]
    statistics: Statistics
    status: str
    message: str
    start: Start | None
    options: RunOptions
    choices: tuple[Choice, ...]
    coordinate_switches: tuple[CoordinateSwitch, ...] = ()
    again: Callable[[RunOptions, FloatArray], Run] | None = None
    timings: Mapping[str, float] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        # Whoever watched the run is not there where it is read, nor are functions that it was watched for.
        texts = tuple(one for one in self.options.conditions if isinstance(one.given, str))
        options = replace(self.options, progress=None, on_step=None, conditions=texts)
        again = self.again if len(texts) == len(self.options.conditions) else None
        made = {"segments": self.segments, "events": self.events, "stretches": (), "told": ()}
        return {**vars(self), **made, "options": options, "again": again}

    @cached_property
    def segments(self) -> tuple[SegmentRecord, ...]:
        """The stretches between changes of mode; none where time was used up before the start was recorded."""
        shown = as_asked(self.stretches, self.options.outputs)
        return tuple(record for one in shown for record in one.records())

    @cached_property
    def events(self) -> tuple[EventRecord, ...]:
        """Events in the order of time."""
        found = tuple(one for some in self.told for one in (some.events if isinstance(some, ToldLater) else (some,)))
        if self.start is None or not any(one.kind == "rests" for one in found):
            return found
        from atwood.simulation.contacts.event_records import with_doubts

        found = tuple(sorted(found, key=lambda one: one.time))  # a rest is told ahead of its time
        return with_doubts(found, 100.0 * self.options.relative_tolerance * (self.options.t_end - self.start.time))

    @property
    def singular_crossings(self) -> tuple[SingularCrossing, ...]:
        """Singular positions that it passed through, or came too close to, in order."""
        return tuple(one for segment in self.segments for one in segment.singular_crossings if one.is_told)

    @property
    def solver(self) -> str:
        """What solved it, at last: a key of `METHODS`; empty where it ended before one was chosen."""
        return self.choices[-1].solver if self.choices else ""

    @property
    def why(self) -> str:
        """What solved it and why, as a sentence."""
        return describe_choices(self.choices)


def as_asked(stretches: Sequence[Stretch], outputs: int | FloatArray) -> tuple[Stretch, ...]:
    """Return stretches that show just the times that were asked for, if these were given.

    At an event the state after it is shown. Where no time that was asked for is reached, the last state is.
    """
    if isinstance(outputs, (int, np.integer)) or not stretches:
        return tuple(stretches)
    time, before = (np.concatenate([getattr(one, name) for one in stretches]) for name in ("time", "shown"))
    ends = np.cumsum([0, *(len(one.time) for one in stretches)]).tolist()
    starts = np.concatenate([first + one.starts for first, one in zip(ends, stretches, strict=False)])
    place = np.minimum(outputs.searchsorted(time), len(outputs) - 1)
    shown = outputs[place] == time
    if len(starts) > 1:
        later = np.append(np.minimum.accumulate(time[starts][::-1])[::-1][1:], np.inf)
        shown &= time < np.repeat(later, np.diff([*starts, len(time)]))
    if not shown.any():
        shown[-1] = True
    return tuple(
        one if np.array_equal(shown[first:last], before[first:last]) else replace(one, shown=shown[first:last])
        for one, (first, last) in zip(stretches, pairwise(ends), strict=True)
    )


def run_out_of_time(assembly: Assembly, start: Start | None, options: RunOptions) -> Run:
    """Return a run whose time was used up before its start was recorded."""
    message = f"the limit of {options.max_seconds:g} s was used up before the start was found"
    return Run(assembly, (), (), Statistics(), "time_limit", message, start, options, ())


@dataclass(frozen=True, eq=False)
class Segment:
    """What one stretch is to be.

    Attributes
    ----------
    plan, probe
        The scene in its mode, and what is watched.
    options
        What the run was asked for.
    choice
        What solves it, at first.
    samples
        Samples, of which the last is its end.
    first_shown
        Whether the start is an output.
    spent
        What the run has cost before.
    kept
        The session of an explicit method that the run has opened before.
    ahead
        Moments that it may pass by itself.
    """

    plan: SceneProblem
    probe: EventProbe
    options: RunOptions
    choice: Choice
    samples: Samples
    first_shown: bool
    spent: Statistics
    kept: KeptSession
    ahead: Ahead | None = None

    @property
    def end(self) -> float:
        """Where it ends if nothing happens before."""
        return float(self.samples.times[-1])


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a stretch ended.

    Attributes
    ----------
    t
        When.
    status, message
        Why: ``"finished"``, ``"event"``, or as in `atwood.simulation.run.run_record.Run`.
    statistics
        What it cost.
    event
        The event that ended it.
    choices
        What solved it, one after the other.
    error
        What went wrong, where that names a part.
    noted
        Events on the way that change nothing.
    together
        Further events at the end that change states.
    handed
        What the next stretch in this mode is to know of the events.
    sides
        Numbers of the relations of what moves that change at its end.
    held
        The discrete states at its end, if it has some.
    passed
        The moments that it went through, if there are any.
    begun
        Since when the last set of contacts and the last piece have held, s, where it went through time events.
    late
        How long after its zero an event was seen, s, and the rates of the state there; None where that is not known.
    closed
        The scene with what holds, time and state where steps have closed contacts while all were open; once for each
        set.
    """

    t: float
    status: str
    message: str
    statistics: Statistics
    choices: tuple[Choice, ...]
    event: EventRecord | None = None
    error: SolveError | None = None
    noted: tuple[EventRecord | ToldLater, ...] = ()
    together: tuple[EventRecord, ...] = ()
    handed: tuple[int, ...] = ()
    sides: tuple[int, ...] = ()
    held: tuple[float, ...] | None = None
    passed: Passed | None = None
    begun: float | None = None
    late: tuple[float, FloatArray] | None = None
    closed: tuple[tuple[Assembly, float, FloatArray], ...] = ()


def goes_on(outcome: Outcome, end: float) -> bool:
    """Return whether a run goes on behind a stretch."""
    if outcome.event is not None:
        return outcome.event.target != "stop"
    return outcome.status == "finished" and outcome.t < end


def shortest_mode(plan: SceneProblem, options: RunOptions, began: float) -> float:
    """Return a time within which only errors, and margins of events, change a mode and change it back, s."""
    margin = min(20.0 * options.relative_tolerance, 1e-5) * plan.scales.time
    return max(1e-9 * (options.t_end - began), margin)


_SAME = 1e-9
"""Of the scene's sizes: projections of many states at once round as their number has it, and the solver not at all."""

_MOMENT = 1e-12
"""Of the time: so much later or earlier is an event of IDA that is looked for between other samples."""

_WHOLE = ("finished", "stopped", "failed")
"""How a run ends by itself; otherwise it is made again with as many steps as it came to."""


def times_of_steps(run: Run) -> FloatArray:
    """Return the times between which the solver of a run took one step, in order; they cost as much as the run."""
    times: list[float] = []
    _repeat(run, np.zeros(0), times.append)
    return np.unique(times)


def run_again(run: Run, between: FloatArray) -> Run | None:
    """Return the same run with more samples, or None if it comes out otherwise."""
    found = _repeat(run, between, None)
    if found is None or len(found.segments) != len(run.segments):
        return None
    for one, other in zip(run.segments, found.segments, strict=True):
        places = places_among(one.time, other.time)
        if not np.all(np.abs(other.time[places] - one.time) <= _MOMENT * np.max(np.abs(one.time))):
            return None
        apart = np.abs(other.coordinates[:, places] - one.coordinates) / one.plan.coordinate_sizes[:, None]
        if not np.max(apart, initial=0.0) < _SAME:
            return None
    return found


def places_among(time: FloatArray, more: FloatArray) -> NDArray[np.intp]:
    """Return where the samples of a stretch stand among those of the same stretch with more."""
    moment = _MOMENT * np.max(np.abs(time))
    return np.asarray(np.minimum(np.searchsorted(more, time - moment), len(more) - 1))


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
