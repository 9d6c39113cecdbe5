"""Runs with an explicit method: output times, events and limits around a stepper.

Steps are chosen by their error alone.  What lies between two steps is read from the dense output, so that output
times and events never change the solution, but for events at which it starts anew.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, StartError, UsageError
from atwood.integrators.event_location import FOUND, ROUNDING, EventLocator, Root
from atwood.integrators.jumps import JumpLog
from atwood.integrators.protocol import (
    Budget,
    ExplicitProblem,
    Handed,
    Nearest,
    SolverOptions,
    State,
    Statistics,
    Status,
    StepMonitor,
    StepResult,
    paced,
)
from atwood.integrators.session import SteppingSession, copied
from atwood.integrators.stepper import Outcome, Stepper

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.moments import Changes, Moments

FIRST_CHUNK, LARGEST_CHUNK = 4000, 100_000
"""So many steps are taken before limits are looked at: at first, for one unknown, and at most."""

_MOMENT = 0.02
"""Steps are taken for about so long, in seconds, before limits are looked at and Ctrl-C is heard."""

_NO_STEP = 16.0
"""What is as near to a time, in roundings of it, is there: an event may come so late before it that no step is left."""

_STALLED = 50
"""So many steps in a row that do not move the time beyond rounding are a failure."""


OnStiff = Callable[[float, FloatArray], bool]


class ExplicitSession(SteppingSession):
    """A run in progress.

    Parameters
    ----------
    problem
        The equations.
    options
        Accuracy; `max_order` and `linear_solver` mean nothing here, and a first step that is estimated from
        derivatives is bounded by the horizon itself.
    stepper
        What takes the steps.
    t, y
        Start values.
    budget
        Limits of the session.
    on_stiff
        Asked, with time and values, whenever stability has kept steps short for a while, whether to leave the rest to
        an implicit method: the run then ends there with `Status.STIFF`.
    end
        The last time that will be asked for; events behind it are not looked for.
    """

    _problem: ExplicitProblem
    _compiled: EventLocator | None

    def __init__(
        self,
        problem: ExplicitProblem,
        options: SolverOptions,
        stepper: Stepper,
        t: float,
        y: FloatArray,
        budget: Budget | None = None,
        on_stiff: OnStiff | None = None,
        end: float = inf,
    ) -> None:
        self._stepper, self._compiled = stepper, None
        events = problem.compiled_events
        self._notices = events is not None and stepper.watch(events)  # whether the stepper looks for events by itself
        super().__init__(problem, options.horizon, budget)
        if on_stiff is not None:
            stepper.watch_stiffness()
        self._is_watched, self._jumps = False, problem.jumps
        self._chunk = max(1, FIRST_CHUNK // problem.size)
        self._begin(t, y, on_stiff, end)

    def _begin(self, t: float, y: FloatArray, on_stiff: OnStiff | None, end: float) -> None:
        """Start a run that has cost nothing so far."""
        self._spend: Callable[[float], None] | None = None
        self._end = end
        self._on_stiff, self._judged, self._is_left = on_stiff, 0, False
        self._leaps = self._is_handed = False
        self.reinitialize(t, y)
        if self._compiled is not None and self._jumps is not None:
            self._jumps.begin(t)
            self._leaps = self._stepper.leap(self._compiled, self._jumps, end)

    def change_at(self, times: FloatArray, relations: FloatArray, place: int, end: float) -> bool:
        """Go on beyond times at which parameters change, up to another end; return whether it can, as by jumps.

        `relations` are those from a place on, before the first of the times and from each of them on.
        """
        if not self._leaps or self._jumps is None or not self._jumps.change_at(times, relations, place):
            return False
        assert self._compiled is not None
        self._end = end
        self._compiled.change_at(float(times[0]))
        return self._stepper.leap(self._compiled, self._jumps, end)

    def take_jumps(self) -> JumpLog | None:
        """Return the jumps since this was last asked; None where there are none."""
        made = None if self._jumps is None else self._jumps.take()
        if made is None or not len(made.time):
            return None
        self._starts += len(made.time)
        return made

    @property
    def watched(self) -> EventData | None:
        """The events as machine code, of the unknowns that are handed out; None where they are not."""
        return self._problem.compiled_events

    @property
    def handed_on(self) -> tuple[int, ...]:
        """What a start from here is to know of the events; see `EventLocator.handed_on`."""
        if self._is_waiting:
            assert self._compiled is not None
            return self._compiled.handed_on(self._here[0], self._compiled.found(FOUND))
        return super().handed_on

    @property
    def _is_waiting(self) -> bool:
        """Whether an event is located that nobody has seen to yet."""
        return self._compiled is not None and self._stepper.waits

    def _find_root(self, t_out: float = inf) -> Root | None:
        """Return the first root in the part of the last step that has not been handed out; jumps before are made."""
        if self._locator is None:
            return None
        located = self._compiled
        while located is not None and self._stepper.waits:
            if t_out < located.last:
                return None
            self._take(t_out, 0)
        code = self._stepper.take_event() if self._root is None else None
        if located is not None and code is not None:
            self._root = located.found(code)
            self._searched = self._reached if self._root is None else self._root.state[0]
        known, searched = self._root, self._searched
        root = super()._find_root(t_out)
        if known is None and root is not None and self._ends_at(root):
            assert self._locator is not None
            self._locator.forget_search()
            self._root, self._searched = None, searched
            self._newest = self._stepper.state()
            self._reached = min(self._newest[0], self._end)
            root = super()._find_root(t_out)
        return root

    def _ends_at(self, root: Root) -> bool:
        """Take the last step anew to just behind a root at which all starts anew, where that finds it better."""
        is_one = any(root.events[i] for i in self._problem.event_anew)
        return is_one and self._stepper.shorten(root.state[0])

    def begin_again(
        self,
        t: float,
        y: FloatArray,
        horizon: float,
        budget: Budget | None,
        on_stiff: OnStiff | None,
        end: float,
        absolute: FloatArray | None = None,
        signs: tuple[int, ...] | None = None,
    ) -> None:
        """Make another run, with the same method: all is as in a new session, and is counted from zero.

        What the rates and events depend on besides time and values may have changed before. For compiled steps, and for
        sessions that were opened to leave stiff problems to others or not, as this run does.
        """
        self._stepper.renew(horizon, absolute)
        self._begin_count(horizon, budget, signs)
        self._begin(t, y, on_stiff, end)

    def take_over(self, handed: Handed) -> None:
        """Go on behind a step that was taken side by side with those of other runs, in which an event may be.

        It has just begun again where they did.
        """
        events, began = self._problem.compiled_events, self._here[0]
        assert events is not None
        assert self._compiled is not None
        self._is_handed = True
        self._stepper.take_over(handed)
        events.take_over(*handed.looked)
        self._searched = self._stepper.begin_of_step()
        if self._searched > began:
            self._compiled.settle()
        self._newest = self._stepper.state()
        self._reached = min(self._newest[0], self._end)

    def _new_locator(self, horizon: float, signs: tuple[int, ...] | None) -> EventLocator | None:
        """Return what finds events in a new run: routines where events and what is between two steps are compiled."""
        problem, events = self._problem, self._problem.compiled_events
        if self._compiled is not None:
            self._compiled.begin(horizon, signs)
        elif events is not None and (read := self._stepper.interpolation()) is not None:
            self._compiled = EventLocator(problem, horizon, signs, events, read)
        return self._compiled or super()._new_locator(horizon, signs)

    def nearest(self, t: FloatArray, y: FloatArray, sizes: FloatArray) -> Nearest | None:
        """Take states, one row each, onto the constraints as steps are; None where none can be taken so."""
        return self._stepper.nearest(t, y, sizes)

    def nearest_open(self, t: FloatArray, y: FloatArray, sizes: FloatArray) -> Nearest | None:
        """Take states onto the constraints alone, whatever contacts there were; None where none can be taken so."""
        return None if self._jumps is None else self._jumps.while_open(lambda: self.nearest(t, y, sizes))

    def through(self, changes: Changes) -> Moments | None:
        """Return a way through moments at which parameters change, from the start on; None where there is none."""
        plain = self._locator is None and self._jumps is None and self.budget.poll is None
        return self._stepper.through(changes) if plain and self.budget.max_steps is None else None

    def pass_moments(self, moments: Moments, ask: Callable[[int, FloatArray, FloatArray], bool], most: int) -> int:
        """Go on through moments for a while; see `Moments.advance`."""
        began = time.perf_counter()
        try:
            return moments.advance(ask, most)
        finally:
            self._seconds += time.perf_counter() - began

    def set_monitor(self, monitor: StepMonitor) -> bool:
        """Let the motion be looked at, and end with `Status.NOTICED` where something is seen; return whether it can."""
        self._is_watched, self._spend = self._stepper.set_monitor(monitor), monitor.spend
        self._leaps = self._leaps and not self._is_watched
        return self._is_watched

    @property
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its restarts."""
        counts, locator = self._stepper.counts, self._locator
        return Statistics(
            steps=counts.steps,
            residual_evaluations=counts.evaluations,
            event_evaluations=locator.evaluations if locator else 0,
            undefined_values=counts.undefined,
            reinitializations=self._starts - 1,
            seconds=self._seconds,
            error_test_failures=counts.failures,
            convergence_failures=0,
        )

    @property
    def seems_stiff(self) -> bool:
        """Whether stability, and not accuracy, has kept steps short: an implicit method would take far fewer."""
        return self._stepper.counts.stiff > 0

    def stop_at(self, end: float) -> None:
        """Let no step go beyond a time, of a method that would."""
        self._stepper.stop_at(end)

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        self._stepper.limit_steps(longest)

    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another state; its rates follow from it."""
        values = np.array(y, dtype=np.float64)
        if values.shape != (self._size,):
            raise UsageError(f"the state has {self._size} unknowns, but was given values of shape {values.shape}")
        # The square is not finite either where values are very large; then each is looked at.
        if not (isfinite(t) and (isfinite(values.dot(values)) or np.isfinite(values).all())):
            raise StartError(f"the start values at t = {t} are not all finite numbers")
        if not self._stepper.start(float(t), values):
            raise StartError(f"the right-hand side has no finite value at the start, t = {t:.9g}")
        self._here = self._newest = self._stepper.state()
        self._reached = min(self._here[0], self._end)
        if self._locator is not None:
            self._locator.restart(self._here)
        self._root = None
        self._searched = self._here[0]
        self._stalled = 0
        self._stale = self._sees = False
        self._starts += 1

    def sample(self, times: FloatArray) -> tuple[FloatArray, FloatArray, StepResult]:
        """Go on through many times at once, as far as nothing stops it."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        if not (len(times) and self._here[0] <= times[0] and times[-1] < inf and (times[1:] >= times[:-1]).all()):
            raise UsageError(f"cannot sample from t = {self._here[0]:.9g} at these times: they must rise from there")
        values, rates = np.empty((len(times), self._size)), np.empty((len(times), self._size))
        filled, stopped = 0, None
        looks_itself = self._locator is None or self._notices
        if looks_itself and self.budget.poll is None and not self._stale:
            filled, stopped = self._sample_quickly(times, values, rates)
        if stopped is not None or filled == len(times):
            return values[:filled], rates[:filled], stopped or self.here
        ended = self.here
        while filled < len(times):
            ended = self.advance(float(times[filled]))
            if ended.status is not Status.REACHED:
                break
            values[filled], rates[filled] = ended.y, ended.yp
            filled += 1
            filled += 0 if self._leaps else self._read_on(times[filled:], values[filled:], rates[filled:])
        return values[:filled], rates[:filled], self.here if filled == len(times) else ended

    def _sample_quickly(
        self, times: FloatArray, values: FloatArray, rates: FloatArray
    ) -> tuple[int, StepResult | None]:
        """Let the stepper go through times as long as no limit is near, and nothing happens."""
        filled = 0

        def fill() -> None:
            nonlocal filled
            while filled < len(times) and (self._is_waiting or self._find_root() is None):
                is_ahead = times[-1] > self._newest[0]
                if is_ahead and self._limit() is not None:
                    break
                if is_ahead and self._locator is not None and self._locator.is_settling and not self._leaps:
                    outcome = self._take(float(times[-1]), 1)
                else:
                    count, outcome = self._fill(times[filled:], values[filled:], rates[filled:])
                    filled += count
                if outcome is Outcome.TOO_SMALL or self._sees:
                    break
            if self._is_handed and self._root is not None:  # no clock is looked at there
                filled += self._read_on(times[filled:], values[filled:], rates[filled:])

        stopped = self._timed(fill)
        return filled, stopped

    def _read_on(self, times: FloatArray, values: FloatArray, rates: FloatArray) -> int:
        """Fill tables within the last step as far as nothing happens for certain; return how many times are there."""
        last = self._newest[0] if self._locator is None else min(self._newest[0], self._searched)
        count = 0 if self._sees else int(times.searchsorted(last if self._root is None else self._root.state[0]))
        if count:
            try:
                self._stepper.sample(times[:count], 0, values, rates)
            except KernelEvaluationError:  # they are read one by one as far as there are values
                return 0
            self._here = float(times[count - 1]), values[count - 1].copy(), rates[count - 1].copy()
        return count

    def _fill(self, times: FloatArray, values: FloatArray, rates: FloatArray) -> tuple[int, Outcome]:
        """Let the stepper fill tables for a moment; return how many times it reached."""
        looked = time.perf_counter()
        self._tell_signs()
        count, outcome = self._stepper.sample(times, self._allowed(), values, rates)
        self._learn(time.perf_counter() - looked, outcome)
        self._take_up(outcome)
        if count:
            self._here = (float(times[count - 1]), values[count - 1].copy(), rates[count - 1].copy())
        self._pass_jumps()
        return count, outcome

    def _take(self, t_out: float, steps: int) -> Outcome:
        """Let the stepper take steps."""
        looked = time.perf_counter()
        self._tell_signs()
        outcome = self._stepper.run(t_out, steps)
        self._learn(time.perf_counter() - looked, outcome)
        self._take_up(outcome)
        self._pass_jumps()
        return outcome

    def _pass_jumps(self) -> None:
        """Stand behind the last jump: a run that is stopped ends no earlier."""
        if self._leaps and self._jumps is not None:
            t, y = self._jumps.last
            if t > self._here[0]:
                rates = self._jumps.rates(t, y)
                self._here = t, y, np.array(self._problem.rates(t, y)) if rates is None else rates

    def _tell_signs(self) -> None:
        if self._notices and self._locator is not None:
            self._stepper.expect(self._locator.signs)

    def _take_up(self, outcome: Outcome) -> None:
        """Take up where the stepper came to, and up to where nothing has happened for certain."""
        before = self._newest[0]
        self._newest = self._stepper.state()
        self._reached = min(self._newest[0], self._end)
        self._sees = self._sees or (self._is_watched and self._stepper.has_noticed())
        if self._locator is None or self._leaps:
            self._searched = self._newest[0]
        elif self._notices and self._newest[0] > before and not self._locator.is_settling:
            last = self._newest[0] if outcome is not Outcome.NOTICED else self._stepper.begin_of_step()
            self._searched = max(self._searched, last)

    def _interpolate(self, t: float) -> State:
        return self._stepper.interpolate(t)

    def _arrive(self, t_out: float) -> StepResult | None:
        status, newest = Status.NOTICED if self._sees else Status.REACHED, self._newest[0]
        is_there = self._sees or t_out <= newest
        self._here = self._newest if t_out >= newest or not is_there else self._stepper.interpolate(t_out)
        self._sees = False
        if is_there and self._leaps and self._compiled is not None:
            self._compiled.tell(self._here[0])
        return StepResult(*copied(self._here), status, self._no_events) if is_there else None

    def _count_steps(self) -> int:
        return self._stepper.counts.steps

    def _allowed(self) -> int:
        """Return how many steps may be taken before the next look at limits and events."""
        locator = self._locator
        settles = locator is not None and locator.is_settling and not self._leaps
        if self.budget.poll is not None or (locator is not None and not self._notices) or settles:
            return 1
        if self.budget.max_steps is None:
            return self._chunk
        return max(0, min(self._chunk, self.budget.max_steps - self._stepper.counts.steps))

    def _learn(self, seconds: float, outcome: Outcome) -> None:
        """Come closer to a chunk that takes a moment; see whether looks are to be taken by faster code."""
        if self._spend is not None:
            self._spend(seconds)
        self._chunk = paced(self._chunk, seconds, outcome is Outcome.USED_UP, _MOMENT, LARGEST_CHUNK)

    def _step(self, t_out: float) -> StepResult | None:
        """Take steps, and return an answer only if that failed."""
        before, steps = self._newest[0], self._stepper.counts.steps
        outcome = self._take(t_out, self._allowed())
        if outcome is Outcome.TOO_SMALL:
            self._here = self._newest
            if (
                0.0 <= t_out - self._newest[0] <= _NO_STEP * ROUNDING * abs(t_out)
                and not self._stepper.counts.undefined
            ):
                return StepResult(t_out, *copied(self._here)[1:], Status.REACHED, self._no_events)
            self._stale = True
            reason = "the steps became too small to move the time"
            if self._stepper.counts.undefined:
                reason += ": the right-hand side has no finite value beyond, or the solution grows without bound"
            return self._stopped(Status.FAILED, reason)
        taken = self._stepper.counts.steps - steps
        if self._newest[0] - before > 4 * ROUNDING * abs(before) * taken:
            self._stalled = 0
        else:
            self._stalled += taken
        if self._stalled >= _STALLED:
            self._here, self._stale = self._newest, True
            return self._stopped(Status.FAILED, "the steps became too small to move the time")
        return None

    def _leaves(self) -> bool:
        """Tell whether the rest is to be left to an implicit method."""
        stiff = self._stepper.counts.stiff
        if self._on_stiff is not None and stiff > self._judged:
            self._judged = stiff
            self._is_left = self._on_stiff(*self._newest[:2])
        return self._is_left

    def _limit(self) -> StepResult | None:
        """Return the end of a run that is to be left to an implicit method, or has used up a limit."""
        if self._on_stiff is not None and self._leaves():
            return self._stopped(Status.STIFF, "steps are kept short by stability alone")
        return super()._limit()
