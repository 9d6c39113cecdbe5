"""A run in progress, whatever method makes it: what all sessions can be asked, and what they share."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.event_location import EventLocator, Root
from atwood.integrators.jumps import JumpLog
from atwood.integrators.protocol import (
    Budget,
    ExplicitProblem,
    ImplicitProblem,
    Nearest,
    State,
    Statistics,
    Status,
    StepMonitor,
    StepResult,
)

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData

_T = TypeVar("_T")


class Session(ABC):
    """A run in progress.

    The state of the run lives here.  `advance` goes to exactly the time asked for, or stops earlier for a reason that
    its status names; in every case it hands back a state that is part of the solution.
    """

    solves_loops = False
    """Whether it integrates independent coordinates alone and hands out all."""

    budget: Budget
    _here: State  # what was handed out last
    _no_events: tuple[int, ...]

    @abstractmethod
    def advance(self, t_out: float) -> StepResult:
        """Go on to exactly a time, or stop earlier at an event, a limit or a failure."""

    @abstractmethod
    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another consistent state, after an event, a change of mode, or a projection.

        An event that the session has just reported at this time, and whose value is still about zero, does not
        happen again.  Explicit methods find the rates by themselves.
        """

    def nearest(self, t: FloatArray, y: FloatArray, sizes: FloatArray) -> Nearest | None:
        """Take states, one row each, onto the constraints as steps are; None where none can be taken so."""
        return None

    @property
    @abstractmethod
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its restarts."""

    @property
    def here(self) -> StepResult:
        """The state that was handed out last."""
        return StepResult(*copied(self._here), Status.REACHED, self._no_events)

    @property
    @abstractmethod
    def handed_on(self) -> tuple[int, ...]:
        """What a start from here is to know of the events; see `EventLocator.handed_on`."""

    def sample(self, times: FloatArray) -> tuple[FloatArray, FloatArray, StepResult]:
        """Integrate until an event; return values and rates at the times that were reached, and how it ended."""
        ended, values, rates = self.here, list[FloatArray](), list[FloatArray]()
        for t in times:
            ended = self.advance(float(t))
            if ended.status is not Status.REACHED:
                break
            values.append(ended.y)
            rates.append(ended.yp)
        shape = len(values), len(ended.y)
        return np.reshape(values, shape), np.reshape(rates, shape), ended

    def read_on(self, times: Sequence[float], first: int, past: int) -> FloatArray:
        """Return the solution at times that lie within the last step, as far as nothing can stop the run before them.

        It is what single advances would give, without their looks at what cannot have changed.
        """
        return np.empty((0, len(self._here[1])))

    def take_jumps(self) -> JumpLog | None:
        """Return the jumps that were made without stopping since this was last asked; None where there are none."""
        return None

    @property
    def watched(self) -> EventData | None:
        """The events as machine code, of the unknowns that are handed out; None where they are not."""
        return None

    def set_monitor(self, monitor: StepMonitor) -> bool:
        """Let the motion be looked at, and end with `Status.NOTICED` where something is seen; return whether it can."""
        return False

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        return


class SteppingSession(Session):
    """A run in progress by steps of a method, of which each leaves an interpolant behind.

    Parameters
    ----------
    problem
        The equations.
    horizon
        A typical length of the run, s.
    budget
        Limits of the session.
    """

    _problem: ImplicitProblem | ExplicitProblem
    _reached: float  # up to where the solution is known
    _searched: float  # up to where no event has happened for certain
    _root: Root | None  # the next event, where it is known
    _stale: bool  # whether the method starts anew where it goes on

    def __init__(self, problem: ImplicitProblem | ExplicitProblem, horizon: float, budget: Budget | None) -> None:
        self._size, self._problem = problem.size, problem
        self._no_events = (0,) * problem.event_count
        self._begin_count(horizon, budget)

    def _begin_count(self, horizon: float, budget: Budget | None, signs: tuple[int, ...] | None = None) -> None:
        """Begin a run that has cost nothing so far, and knows those signs of events that it is handed."""
        self.budget = budget or Budget()
        self._opened, self._seconds, self._starts = 0.0, 0.0, 0
        self._locator = self._new_locator(horizon, signs)

    def _new_locator(self, horizon: float, signs: tuple[int, ...] | None) -> EventLocator | None:
        """Return what finds events in a new run; None where there are none."""
        problem = self._problem
        return None if problem.events is None else EventLocator(problem, horizon, signs)

    @property
    def handed_on(self) -> tuple[int, ...]:
        """What a start from here is to know of the events; see `EventLocator.handed_on`."""
        return () if self._locator is None else self._locator.handed_on(self._here[0], self._root)

    def advance(self, t_out: float) -> StepResult:
        """Go on to exactly a time, or stop earlier at an event, a limit or a failure."""
        if not self._here[0] <= t_out < inf:
            raise UsageError(f"cannot advance from t = {self._here[0]:.9g} to t = {t_out:.9g}")
        return self._timed(lambda: self._run(float(t_out)))

    def _timed(self, go: Callable[[], _T]) -> _T | StepResult:
        """Return what a way on gives, or why it ended; it then goes on from the state that was handed out last."""
        began = time.perf_counter()
        self._opened = self._opened or began
        try:
            return go()
        except KeyboardInterrupt:
            self._stale = True
            return self._stopped(Status.INTERRUPTED, "interrupted")
        except KernelEvaluationError as error:
            return self._failed(str(error))
        except BaseException:
            self._stale = True
            raise
        finally:
            self._seconds += time.perf_counter() - began

    def _run(self, t_out: float) -> StepResult:
        """Go on to a time, or as far as nothing stops it."""
        if self._stale:
            self.reinitialize(*self._here)
        while True:
            root = self._find_root(t_out)
            if root is not None and root.state[0] <= t_out:
                self._root, self._here = None, root.state
                return StepResult(*copied(root.state), Status.EVENT, root.events)
            ended = self._arrive(t_out) or self._limit() or self._step(t_out)
            if ended is not None:
                return ended

    def _find_root(self, t_out: float = inf) -> Root | None:
        """Return the first root in the part of the last step that has not been handed out."""
        locator, end = self._locator, self._reached
        if locator is not None and self._root is None and self._searched < end:
            self._root = locator.search(self._searched, end, self._interpolate)
            self._searched = self._root.state[0] if self._root else end
        return self._root

    @abstractmethod
    def _interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""

    @abstractmethod
    def _arrive(self, t_out: float) -> StepResult | None:
        """Return the state at a time that has been reached; otherwise stand at the end of the last step."""

    @abstractmethod
    def _step(self, t_out: float) -> StepResult | None:
        """Take a step, or several towards a time, and return an answer only if that ended the run."""

    @abstractmethod
    def _count_steps(self) -> int:
        """Return how many steps were taken so far, over all restarts."""

    def _limit(self) -> StepResult | None:
        """Return the end of a run that has used up a limit."""
        budget = self.budget
        if budget.poll is not None:
            budget.poll(self._here[0])
        if budget.max_steps is not None and self._count_steps() >= budget.max_steps:
            return self._stopped(Status.STEP_LIMIT, f"the limit of {budget.max_steps} steps was used up")
        if budget.wall_seconds is not None and time.perf_counter() - self._opened >= budget.wall_seconds:
            return self._stopped(Status.TIME_LIMIT, f"the limit of {budget.wall_seconds:g} s was used up")
        return None

    def _failed(self, reason: str) -> StepResult:
        """Return that the run cannot go on; the method starts anew where it does all the same."""
        self._stale = True
        return self._stopped(Status.FAILED, reason)

    def _stopped(self, status: Status, reason: str) -> StepResult:
        """Return where the run ended, and why."""
        return StepResult(*copied(self._here), status, self._no_events, f"{reason} (at t = {self._here[0]:.9g})")


def copied(state: State) -> State:
    """Return a state whose arrays the caller may keep and change."""
    t, y, yp = state
    return t, y.copy(), yp.copy()
