"""A segment of a run, and how it ended."""

from __future__ import annotations

from atwood.errors import SolveError
from atwood.integrators.protocol import Statistics
from atwood.late import dataclass
from atwood.simulation.events.modes import EventProbe, EventRecord
from atwood.simulation.problem.options import RunOptions, Samples
from atwood.simulation.problem.problem import Plan
from atwood.simulation.run.choice import Choice
from atwood.simulation.run.session import KeptSession

__all__ = ["Outcome", "Segment", "shortest_mode"]


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
    """

    plan: Plan
    probe: EventProbe
    options: RunOptions
    choice: Choice
    samples: Samples
    first_shown: bool
    spent: Statistics
    kept: KeptSession

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
        Why: ``"finished"``, ``"event"``, or as in `atwood.simulation.run.made.Run`.
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
    """

    t: float
    status: str
    message: str
    statistics: Statistics
    choices: tuple[Choice, ...]
    event: EventRecord | None = None
    error: SolveError | None = None
    noted: tuple[EventRecord, ...] = ()
    together: tuple[EventRecord, ...] = ()
    handed: tuple[int, ...] = ()
    sides: tuple[int, ...] = ()


def shortest_mode(plan: Plan, options: RunOptions, began: float) -> float:
    """Return a time within which only errors, and margins of events, change a mode and change it back, s.

    Parameters
    ----------
    plan
        The scene in its mode.
    options
        What the run was asked for.
    began
        When it began, s.
    """
    margin = min(20.0 * options.relative_tolerance, 1e-5) * plan.scales.time
    return max(1e-9 * (options.t_end - began), margin)
