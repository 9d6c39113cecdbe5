"""A run that has been made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.integrators.protocol import Statistics
from atwood.late import dataclass, replace
from atwood.simulation.dynamics.orientation_coordinates import (
    CoordinateSwitch,
)
from atwood.simulation.events.modes import EventRecord
from atwood.simulation.initialization.start import Start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.choice import Choice, describe_choices
from atwood.simulation.run.record import SegmentRecord

if TYPE_CHECKING:
    from atwood.simulation.singular.crossing import SingularCrossing

__all__ = ["Run", "as_asked", "run_out_of_time"]


@dataclass(frozen=True, eq=False)
class Run:
    """What a run produced.

    Attributes
    ----------
    assembly
        The scene as it was assembled at the start.
    segments
        The stretches between changes of mode; none where time was used up before the start was recorded.
    events
        Events, in order.
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
    segments: tuple[SegmentRecord, ...]
    events: tuple[EventRecord, ...]
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
        return {**vars(self), "options": options, "again": again}

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


def as_asked(segments: Sequence[SegmentRecord], outputs: int | FloatArray) -> tuple[SegmentRecord, ...]:
    """Return segments that show just the times that were asked for, if these were given.

    At an event the state after it is shown. Where no time that was asked for is reached, the last state is.
    """
    if isinstance(outputs, (int, np.integer)):
        return tuple(segments)
    made: list[SegmentRecord] = []
    later = np.inf
    for one in reversed(segments):
        place = np.minimum(np.searchsorted(outputs, one.time), len(outputs) - 1)
        shown = (outputs[place] == one.time) & (one.time < later)
        later = min(later, float(one.time[0])) if len(one.time) else later
        made.append(replace(one, shown=shown))
    if made and not any(one.shown.any() for one in made):
        made[0].shown[-1] = True
    return tuple(reversed(made))


def run_out_of_time(assembly: Assembly, start: Start | None, options: RunOptions) -> Run:
    """Return a run whose time was used up before its start was recorded.

    Parameters
    ----------
    assembly, start, options
        As of `atwood.simulation.run.run.run`; no start where it was not found.
    """
    message = f"the limit of {options.max_seconds:g} s was used up before the start was found"
    return Run(assembly, (), (), Statistics(), "time_limit", message, start, options, ())
