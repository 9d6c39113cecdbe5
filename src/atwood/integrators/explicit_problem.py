"""What an explicit method is given, and what takes its steps.

An explicit method integrates ``y' = f(t, y)``.  A *stepper* holds the state and takes steps; everything else, such as
output times, events and limits, is the session's, which is the same for all steppers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.compiled_functions import Lookout, StepGuard
from atwood.integrators.event_location import State
from atwood.integrators.protocol import SolverOptions, Values
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData


MET = 1e-8
"""A step of Newton's method that moves nothing by more of its size leaves misses of the square of that: rounding."""

STEPS = 6
"""So many of these are tried; at the end of a step that is good enough one or two are needed."""

STIFF, CALM = 15, 6
"""So many steps at the edge of stability, with fewer than so many others in a row between, are a stiff problem."""


@dataclass(frozen=True, eq=False)
class CompiledRates:
    """The address of a compiled right-hand side, for one session.

    Parameters
    ----------
    function
        ``int (double t, const double *y, double *yp, void *data)``, which returns 0, or another number where a value is
        not finite.
    data
        Its last argument.
    keep
        Whatever must live as long as the addresses are used.
    project, project_data
        The address of ``int (double t, double *y, void *data)``, which takes values onto the constraints and returns
        0, or another number where it cannot, and its last argument; 0 where there are no constraints.
    """

    function: int
    data: int = 0
    keep: object = None
    project: int = 0
    project_data: int = 0


@dataclass(frozen=True, eq=False)
class ExplicitProblem:
    """The equations ``y' = f(t, y)`` of one mode.

    The functions get arrays that are only valid during the call and must not be written to.  A function that has no
    value at a state raises `~atwood.errors.KernelEvaluationError` (or an arithmetic error), or returns values that
    are not finite: a smaller step is then tried.

    Parameters
    ----------
    size
        The number of unknowns.
    rates
        ``rates(t, y)``: the derivatives.
    events
        ``events(t, y, yp)``: one value per event, which happens where its value passes through zero.
    event_count
        The number of events.
    event_directions
        For each event +1 (rising values only), -1 (falling values only) or 0 (both).  Empty: all 0.
    event_rough
        Numbers of the events whose exact time does not matter: they happen at the end of a step.
    event_signs
        The sign that each event had before the start, 0 where it is not known, or
        `~atwood.integrators.protocol.JUST_HAPPENED`.  Empty: all 0.
    compiled
        ``compiled()``: a compiled form of `rates`.  Each session asks once, and must not share it with another one.
    compiled_events
        The same for `events`, if there is one: bound to values, and to no other session.
    project
        ``project(t, y)``: the values nearest to these that meet the constraints, with which steps end; None where there
        are none.
    guard
        What judges steps besides their error; None where there is nothing to be missed.
    """

    size: int
    rates: Callable[[float, FloatArray], Values]
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None
    event_count: int = 0
    event_directions: tuple[int, ...] = ()
    event_rough: tuple[int, ...] = ()
    event_signs: tuple[int, ...] = ()
    compiled: Callable[[], CompiledRates] | None = None
    compiled_events: EventData | None = None
    project: Callable[[float, FloatArray], Values] | None = None
    guard: StepGuard | None = None

    def __post_init__(self) -> None:
        if self.size < 1:
            raise UsageError("a problem needs at least one unknown")
        if (self.events is None) != (self.event_count == 0):
            raise UsageError("give both the event function and the number of events, or neither")
        if self.event_directions and len(self.event_directions) != self.event_count:
            raise UsageError(f"{self.event_count} events need as many directions")
        if not set(self.event_directions) <= {-1, 0, 1}:
            raise UsageError("an event direction is -1, 0 or +1")


class Outcome(IntEnum):
    """Why a stepper came back; `NOTICED` where it was asked to watch something."""

    REACHED = 0
    USED_UP = 1
    TOO_SMALL = 2
    NOTICED = 5


@dataclass
class Counts:
    """What a stepper has done.

    Attributes
    ----------
    steps, failures
        Steps that were kept, and steps whose error was too large or that had no value.
    evaluations, undefined
        Calls of the right-hand side, and those of them that gave no finite value.
    stiff
        How often stability, not accuracy, seemed to keep steps short: `STIFF` steps with few others between.
    """

    steps: int = 0
    failures: int = 0
    evaluations: int = 0
    undefined: int = 0
    stiff: int = 0


class Stepper(ABC):
    """Takes the steps of an explicit method; one that can do more than these says so by its answers."""

    @abstractmethod
    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""

    @abstractmethod
    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""

    @abstractmethod
    def state(self) -> State:
        """Return time, values and rates at the end of the last step, which the caller may keep."""

    @abstractmethod
    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""

    @property
    @abstractmethod
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        last = self.counts.steps + steps
        size = len(self.state()[1])
        y, yp = np.empty((2, len(times), size))
        for filled, t in enumerate(times):
            outcome = self.run(float(t), last - self.counts.steps)
            if outcome is not Outcome.REACHED:
                return y[:filled], yp[:filled], outcome
            _, y[filled], yp[filled] = self.interpolate(float(t))
        return y, yp, Outcome.REACHED

    def watch(self, events: EventData) -> bool:
        """Come back with `Outcome.NOTICED` after a step in which an event may have happened; return whether it can."""
        return False

    def expect(self, signs: FloatArray) -> None:
        """Learn which sign each event has; where it is zero, every step is noticed."""
        return

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        raise NotImplementedError

    def heed_stiffness(self) -> None:
        """Come back with `Outcome.NOTICED` whenever the problem seems stiff, where that can be told."""
        return

    def look_out(self, lookout: Lookout) -> bool:
        """Let the motion be looked at, and come back where something is seen; return whether it can."""
        return False

    def has_seen(self) -> bool:
        """Return whether something was seen since this was last asked."""
        return False

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        return

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        raise UsageError("only compiled steps can be begun again")


def no_interpolation(t: float) -> KernelEvaluationError:
    """Return the error of a step within which there is no value."""
    return KernelEvaluationError(f"the right-hand side has no value within a step, at t = {t:.9g}")


LOOSEST = 1e-3
"""The largest relative tolerance that steps are chosen by: longer steps gain energy unseen, until chains fly apart."""


_TINY = float(np.finfo(float).tiny)


def absolute_tolerances(options: SolverOptions, size: int) -> FloatArray:
    """Return the absolute tolerance of each unknown; nothing is divided by zero where it is zero."""
    if isinstance(options.absolute_tolerances, float):
        return np.full(size, max(options.absolute_tolerances, _TINY))
    try:
        given = np.asarray(options.absolute_tolerances, dtype=np.float64)
        return np.maximum(given if given.shape == (size,) else np.broadcast_to(given, (size,)), _TINY)
    except ValueError:
        raise UsageError(f"give one absolute tolerance, or one for each of the {size} unknowns") from None
