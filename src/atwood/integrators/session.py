"""A run in progress, whatever method makes it: what all sessions can be asked, and what they share."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import inf
from typing import TypeVar

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.event_location import EventLocator, Root
from atwood.integrators.protocol import Budget, Lookout, State, Statistics, Status, StepResult

_T = TypeVar("_T")


class Session(ABC):
    """A run in progress.

    The state of the run lives here.  `advance` goes to exactly the time asked for, or stops earlier for a reason that
    its status names; in every case it hands back a state that is part of the solution.
    """

    solves_loops = False
    """Whether it integrates independent coordinates alone and hands out all."""

    budget: Budget
    _here: State
    _no_events: tuple[int, ...]
    _locator: EventLocator | None
    _root: Root | None
    _opened: float
    _seconds: float
    _stale: bool

    def advance(self, t_out: float) -> StepResult:
        """Go on to exactly a time, or stop earlier at an event, a limit or a failure."""
        if not self._here[0] <= t_out < inf:
            raise UsageError(f"cannot advance from t = {self._here[0]:.9g} to t = {t_out:.9g}")
        return self._taken(lambda: self._run(float(t_out)))

    @abstractmethod
    def _run(self, t_out: float) -> StepResult:
        """Go on to a time, or as far as nothing stops it."""

    def _taken(self, go: Callable[[], _T]) -> _T | StepResult:
        """Return what a way on gives, or why it ended; it then goes on from the state that was handed out last."""
        began = time.perf_counter()
        self._opened = self._opened or began
        try:
            return go()
        except KeyboardInterrupt:
            self._stale = True
            return self._stopped(Status.INTERRUPTED, "interrupted")
        except KernelEvaluationError as error:
            self._stale = True
            return self._stopped(Status.FAILED, str(error))
        except BaseException:
            self._stale = True
            raise
        finally:
            self._seconds += time.perf_counter() - began

    @abstractmethod
    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another consistent state, after an event, a change of mode, or a projection.

        An event that the session has just reported at this time, and whose value is still about zero, does not
        happen again.  Explicit methods find the rates by themselves.
        """

    @property
    @abstractmethod
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its restarts."""

    @property
    def here(self) -> StepResult:
        """The state that was handed out last."""
        return StepResult(*copied(self._here), Status.REACHED, self._no_events)

    @property
    def handed_on(self) -> tuple[int, ...]:
        """What a start from here is to know of the events; see `EventLocator.handed_on`."""
        return () if self._locator is None else self._locator.handed_on(self._here[0], self._root)

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

    def look_out(self, lookout: Lookout) -> bool:
        """Let the motion be looked at, and end with `Status.NOTICED` where something is seen; return whether it can."""
        return False

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        return

    def _exceeded(self, steps: Callable[[], int]) -> StepResult | None:
        """Return the end of a run that has used up a limit."""
        budget = self.budget
        if budget.poll is not None:
            budget.poll(self._here[0])
        if budget.max_steps is not None and steps() >= budget.max_steps:
            return self._stopped(Status.STEP_LIMIT, f"the limit of {budget.max_steps} steps was used up")
        if budget.wall_seconds is not None and time.perf_counter() - self._opened >= budget.wall_seconds:
            return self._stopped(Status.TIME_LIMIT, f"the limit of {budget.wall_seconds:g} s was used up")
        return None

    def _stopped(self, status: Status, reason: str) -> StepResult:
        """Return where the run ended, and why."""
        return StepResult(*copied(self._here), status, self._no_events, f"{reason} (at t = {self._here[0]:.9g})")


def copied(state: State) -> State:
    """Return a state whose arrays the caller may keep and change."""
    t, y, yp = state
    return t, y.copy(), yp.copy()
