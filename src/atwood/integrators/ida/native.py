"""SUNDIALS IDA without Python in the loop: the shared libraries driven directly.

Where a problem brings compiled functions, no Python runs between outputs.  Where it has Python functions only, they
are called back from C; the answers are the same.

IDA goes on by itself to the next output, but only for a moment at a time, so that limits and Ctrl-C have their turn.
With events or a `~atwood.integrators.protocol.Budget.poll` it takes one step at a time.  Outputs are read from its
interpolant and never change the steps.
"""

from __future__ import annotations

import time
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from math import inf

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.event_location import EventLocator, Root
from atwood.integrators.ida.callbacks import Record, explain
from atwood.integrators.ida.library import library
from atwood.integrators.ida.memory import (
    ONE_STEP,
    REASONS,
    ROOT_RETURN,
    STOPPED_BY_WEIGHTS,
    TO_TIME,
    TOO_LONG,
    TOO_MUCH_WORK,
    Counts,
)
from atwood.integrators.ida.setup import IdaTuning, prepare
from atwood.integrators.ida.states import checked_state, is_finite
from atwood.integrators.ida.watchdog import FIRST_CHUNK, Watchdog, first_chunk, hardly_moves, other_first_steps
from atwood.integrators.protocol import (
    Budget,
    ImplicitProblem,
    SolverOptions,
    State,
    Statistics,
    Status,
    StepMonitor,
    StepResult,
    choose_linear_solver,
)
from atwood.integrators.session import SteppingSession, copied
from atwood.interrupts import InterruptLater
from atwood.lazy_dataclasses import replace

NO_EVENT_VALUE = -10
"""IDA's flag when the event functions did not return 0."""

EVENT_REASONS = {NO_EVENT_VALUE: "an event function has no value"}


class NativeSession(SteppingSession):
    """A run in progress.

    Its memory is freed by `close`, at the end of a ``with`` block, or when nobody refers to it any more.

    Parameters
    ----------
    problem
        The equations.
    options
        Accuracy and means.
    t, y, yp
        Consistent start values.
    budget
        Limits of the session.
    tuning
        What only this driver can set.

    Raises
    ------
    ~atwood.integrators.ida.library.SundialsMissing
        If the libraries cannot be used; `available` tells beforehand.
    """

    _problem: ImplicitProblem

    def __init__(
        self,
        problem: ImplicitProblem,
        options: SolverOptions,
        t: float,
        y: FloatArray,
        yp: FloatArray,
        budget: Budget | None = None,
        tuning: IdaTuning | None = None,
    ) -> None:
        self._record = Record()
        state = checked_state(problem.size, t, y, yp)
        linear_solver = choose_linear_solver(problem, options, has_fixed=library().has_fixed_solvers)
        self._native = None if problem.native is None else problem.native(linear_solver)
        self._memory = prepare(
            problem, options, tuning or IdaTuning(), linear_solver, self._native, self._record, state
        )
        watched = None if self._native is None else self._native.watched
        self._reader = None if watched is None else self._memory.reader()  # then nothing of a search runs in Python
        super().__init__(problem, options.horizon, budget)
        self._horizon = options.horizon
        self._given_step = options.first_step or 0.0
        self._stop_time = None if tuning is None else tuning.stop_time
        self._guard = self._memory.library.sparse_guard if linear_solver == "sparse" else nullcontext()
        # Whether IDA itself can tell in which steps something happens.
        self._finds_events = self._native is not None and self._native.events != 0
        self._by_steps = self.budget.poll is not None or (self._locator is not None and not self._finds_events)
        self._look_out: Callable[..., tuple[int, float]] | None = None
        self._fill: Callable[..., tuple[int, float, int]] | None = None
        self._noticed_flag: int | None = None
        self._spend: Callable[[float], None] | None = None
        self._paused_flag, self._goes_on = 0, False
        self._due: Callable[[], float] = lambda: inf
        self._earlier = Statistics(error_test_failures=0, convergence_failures=0)
        self._pending: StepResult | None = None
        self._watchdog = Watchdog(FIRST_CHUNK if self._record.calls_python else first_chunk(problem.size))
        self._begin(state)

    def _new_locator(self, horizon: float, signs: tuple[int, ...] | None) -> EventLocator | None:
        if self._native is None or self._reader is None:
            return super()._new_locator(horizon, signs)
        return EventLocator(self._problem, horizon, signs, self._native.watched, self._reader.interpolation)

    def __enter__(self) -> NativeSession:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free IDA's memory; the statistics stay."""
        if not self._memory.is_closed:
            self._earlier += self._since_start()
            self._memory.close()

    @property
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its restarts."""
        sums = self._earlier if self._memory.is_closed else self._earlier + self._since_start()
        counted = self._native.undefined_values if self._native is not None else None
        return replace(
            sums,
            event_evaluations=self._locator.evaluations if self._locator else 0,
            undefined_values=self._record.undefined if counted is None else counted(),
            reinitializations=self._starts - 1,
            seconds=self._seconds,
        )

    def set_monitor(self, monitor: StepMonitor) -> bool:
        """Let IDA look at the motion on its way; it cannot where single steps are taken."""
        if self._by_steps:
            return False
        self._look_out, self._fill = self._memory.set_monitor(monitor), self._memory.fill(monitor)
        self._goes_on = self._locator is None and not self._record.calls_python
        self._noticed_flag, self._paused_flag, self._due = monitor.noticed, monitor.paused, monitor.due
        self._spend = monitor.spend
        return True

    @property
    def counts(self) -> Counts:
        """What IDA has counted since its last start, with the order and the size of the last step."""
        self._check_open()
        return self._memory.counts()

    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another consistent state, after an event, a change of mode, or a projection."""
        self._check_open()
        self._restart(checked_state(self._size, t, y, yp))

    def advance(self, t_out: float) -> StepResult:
        """Go on to exactly a time, or stop earlier at an event, a limit or a failure; see `Session.advance`."""
        self._check_open()
        if self._pending is not None:
            pending, self._pending = self._pending, None
            return pending
        if self._stop_time is not None and self._stop_time < t_out < inf:
            raise UsageError(f"cannot advance past t = {self._stop_time:.9g}, where the run must stop")
        return super().advance(t_out)

    def _run(self, t_out: float) -> StepResult:
        if not self._record.calls_python and (self._locator is None or self._finds_events):
            return super()._run(t_out)
        try:
            with np.errstate(all="ignore"), InterruptLater(self._record):
                end = super()._run(t_out)
                self._record.raise_again()
                return end
        except KeyboardInterrupt:
            self._record.interrupted = False
            raise

    def _check_open(self) -> None:
        if self._memory.is_closed:
            raise UsageError("this session has been closed")

    def _restart(self, state: State) -> None:
        self._earlier += self._since_start()
        self._memory.y[:], self._memory.yp[:] = state[1:]
        self._memory.begin_again(state[0])
        self._begin(state)

    def _begin(self, state: State) -> None:
        """Set all that belongs to a start of IDA."""
        if self._stop_time is not None:
            self._memory.call("IDASetStopTime", self._stop_time)
        if self._reader is not None:
            self._reader.hold(state)
        if self._locator is not None:
            self._locator.restart(state)
        if self._native is not None and self._native.restart_events is not None:
            self._native.restart_events(state[0])
        if self._problem.begin is not None:
            self._problem.begin(*state)
        self._here = state
        self._newest: State | None = state  # the end of the last step, where IDA has just taken a single one
        self._reached = state[0]
        self._is_first = True
        self._behind = False  # whether IDA last handed out a time before the end of its last step
        self._root = None
        self._searched = state[0]
        self._looks_on = False  # whether IDA itself looks at what is left of its last step when it goes on
        self._watchdog.mark, self._watchdog.lap = (state[0], 0), (state[0], 0, 0)
        self._stale = False
        self._pending = None  # what ended the last reading, for the next advance
        self._starts += 1

    def _since_start(self) -> Statistics:
        counts = self._memory.counts()
        return Statistics(
            steps=counts.steps,
            residual_evaluations=counts.residuals,
            jacobian_evaluations=counts.jacobians,
            error_test_failures=counts.error_failures,
            convergence_failures=counts.solve_failures,
        )

    def _find_root(self, t_out: float = inf) -> Root | None:
        is_known = self._looks_on and not self._searched < t_out <= self._reached
        if self._reader is not None and not is_known:
            self._reader.hold(self._newest)
        return None if is_known else super()._find_root(t_out)

    def _arrive(self, t_out: float) -> StepResult | None:
        is_there = t_out <= self._reached and not self._due() <= t_out
        if not is_there:
            self._here = self._end_of_step() if self._by_steps else self._here
            return None
        if t_out > self._here[0]:
            state = self._interpolate(t_out)
            if not is_finite(state[1], state[2]):
                return self._failed("the solution is no longer finite")
            self._here = state
        return StepResult(*copied(self._here), Status.REACHED, self._no_events)

    def _interpolate(self, t: float) -> State:
        if self._newest is not None and t == self._newest[0]:
            return self._newest
        flag = self._memory.interpolate(t)
        if flag != 0:
            raise KernelEvaluationError(f"no interpolated value at t = {t:.9g} (IDA flag {flag})")
        return t, self._memory.y.copy(), self._memory.yp.copy()

    def _end_of_step(self) -> State:
        if self._newest is None:
            self._newest = self._interpolate(self._reached)
        return self._newest

    def read_on(self, times: Sequence[float], first: int, past: int) -> FloatArray:
        """Read, or let IDA itself go on and fill a table where nothing is to be looked for."""
        self._check_open()
        if past <= first or self._stale or self._pending is not None:
            return np.empty((0, self._size))
        if self._fill is None and self._locator is None and not (self._by_steps or self._record.calls_python):
            self._fill_alone()
        if self._goes_on and not self._is_first and self.budget.is_unlimited:
            return self._filled(np.array(times[first:past], dtype=float))
        known = self._reached if self._locator is None else min(self._searched, self._reached)
        root = None if self._root is None else self._root.state
        limit = min(self._due(), *(one[0] for one in (self._newest, root) if one is not None), inf)
        past = min(bisect_right(times, known, first, past), bisect_left(times, limit, first, past))
        if past <= first:
            return np.empty((0, self._size))
        began = time.perf_counter()
        try:
            return self._table(times[first:past])
        finally:
            self._seconds += time.perf_counter() - began

    def _fill_alone(self) -> None:
        """Let tables be filled where nobody looks at the motion."""
        from atwood.codegen.sundials.step_monitor import NOTICED, PAUSED, table_filler

        code = table_filler().code.addresses["fill"]
        self._fill = self._memory.fill(StepMonitor(0, code, NOTICED, PAUSED, self._size, self._due))
        self._goes_on, self._paused_flag = True, PAUSED

    def _table(self, times: Sequence[float]) -> FloatArray:
        """Return the solution at times within the last step; none if it is not finite, which an advance says."""
        rows, yp = self._memory.interpolate_each(times)
        if not is_finite(rows.ravel(), yp):
            return rows[:0]
        self._here = times[-1], rows[-1].copy(), yp
        return rows

    def _filled(self, times: FloatArray) -> FloatArray:
        """Let IDA go on through times by itself; what ended that is told by the next advance."""
        fill, before, table = self._fill, self._here, np.empty((len(times), self._size))
        assert fill is not None
        allowed, filled = self._allow(), 0
        began = time.perf_counter()
        self._opened = self._opened or began
        try:
            with self._guard:
                flag, t, filled = fill(times, table, filled, allowed)
                while flag == STOPPED_BY_WEIGHTS and self._attend(t):
                    flag, t, filled = fill(times, table, filled, allowed)
            rows = table[:filled]
            if filled:
                self._here = float(times[filled - 1]), rows[-1].copy(), before[2]
            if flag in (0, self._paused_flag):
                self._read(filled)
                self._pending = self._judge_lap(self._reached)
            else:
                self._pending = self._passed(flag, t)
            bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
            if len(bad):
                rows, self._stale = rows[: bad[0]], True
                self._here = (float(times[bad[0] - 1]), rows[-1].copy(), before[2]) if len(rows) else before
                self._pending = self._stopped(Status.FAILED, "the solution is no longer finite")
            return rows
        except BaseException:
            self._stale = True
            raise
        finally:
            spent = time.perf_counter() - began
            self._seconds += spent
            self._learn(spent, filled < len(times))

    def _read(self, filled: int) -> None:
        """Take up that all that was filled has been read, the last of it from the last step."""
        self._reached, self._newest, self._behind = self._memory.time(), None, True
        if filled and self._memory.interpolate(self._here[0]) == 0:
            self._here = (*self._here[:2], self._memory.yp.copy())

    def _count_steps(self) -> int:
        return self._earlier.steps + self._memory.steps()

    def _step(self, t_out: float) -> StepResult | None:
        return self._single_step() if self._by_steps or self._is_first else self._stride(t_out)

    def _single_step(self) -> StepResult | None:
        """Take one internal step, and return an answer only if that failed."""
        before = self._reached
        flag, t = self._first_step() if self._is_first else self._solve(before + self._horizon, ONE_STEP)
        while self._behind and flag >= 0 and t <= before:
            # IDA first hands out what it has not yet handed out of the step that it has already taken.
            self._behind = flag == ROOT_RETURN
            flag, t = self._solve(before + self._horizon, ONE_STEP)
        failure = self._judge(flag, t)
        if failure is None:
            self._behind = flag == ROOT_RETURN
            self._reached = self._memory.time() if self._behind else t
            self._newest = None if self._behind else (t, self._memory.y.copy(), self._memory.yp.copy())
        return failure

    def _first_step(self) -> tuple[int, float]:
        """Take the first step; others where IDA, which makes it shorter by 4 ten times at most, gives up."""
        state = self._here
        for first in (0.0, *other_first_steps(state[0], self._horizon)):
            if first:
                self._memory.call("IDASetInitStep", first)
                self._restart(state)
                self._starts -= 1  # which nobody asked for
            flag, t = self._solve(state[0] + self._horizon, ONE_STEP)
            if flag not in TOO_LONG and (first or not hardly_moves(state[0], self._memory.time())):
                break
        self._memory.call("IDASetInitStep", self._given_step)
        return flag, t

    def _stride(self, t_out: float) -> StepResult | None:
        """Take steps until a time is passed or a moment is over, and return an answer only if that failed."""
        self._allow()
        began = time.perf_counter()
        flag, t = self._solve(t_out, TO_TIME)
        self._learn(time.perf_counter() - began, flag == TOO_MUCH_WORK)
        return self._passed(flag, t)

    def _learn(self, seconds: float, is_used_up: bool) -> None:
        """Learn how long steps take, and see whether looks are to be taken by faster code."""
        self._watchdog.learn(seconds, is_used_up)
        if self._spend is not None:
            self._spend(seconds)

    def _allow(self) -> int:
        """Tell IDA how many steps it may take; return that."""
        pace, allowed = self._watchdog, self._watchdog.chunk
        if self.budget.max_steps is not None:
            allowed = min(allowed, self.budget.max_steps - self._count_steps())
        if allowed != pace.allowed:
            self._memory.call("IDASetMaxNumSteps", allowed)
            pace.allowed = allowed
        return allowed

    def _passed(self, flag: int, t: float) -> StepResult | None:
        """Take up where IDA has gone to by itself, and return an answer only if that failed, or somebody is to look."""
        self._newest, self._behind = None, True
        if flag >= 0:
            self._reached = self._memory.time()
            if flag == self._noticed_flag:
                if not is_finite(self._memory.y, self._memory.yp):
                    return self._failed("the solution is no longer finite")
                self._here = t, self._memory.y.copy(), self._memory.yp.copy()
            if self._locator is not None:
                # IDA has looked for events: up to where it was sent, or not up to the end of a step that has one.
                begin = self._memory.begin_of_step()
                self._searched = max(self._searched, begin if flag == ROOT_RETURN else t)
                self._looks_on = flag != ROOT_RETURN
            if flag == self._noticed_flag:
                return StepResult(*copied(self._here), Status.NOTICED, self._no_events)
            return self._judge_lap(self._reached)
        failure = self._judge(0 if flag == TOO_MUCH_WORK else flag, t)
        if failure is None:
            self._reached = self._searched = t
            self._here = t, self._memory.y.copy(), self._memory.yp.copy()
        return failure

    def _solve(self, t_out: float, task: int) -> tuple[int, float]:
        with self._guard:
            flag, t = self._go_on(t_out, task)
            while (flag == STOPPED_BY_WEIGHTS and self._attend(t)) or (flag == NO_EVENT_VALUE and self._noticed()):
                if flag == NO_EVENT_VALUE and task == TO_TIME:
                    flag = ROOT_RETURN
                    break
                flag, t = self._go_on(t_out, task)
        self._is_first = False
        return flag, t

    def _go_on(self, t_out: float, task: int) -> tuple[int, float]:
        if self._look_out is None or task != TO_TIME:
            return self._memory.solve(t_out, task)
        return self._look_out(t_out, self._watchdog.allowed)

    def _noticed(self) -> bool:
        """Tell whether the functions of events only said that something may have happened within a step."""
        native = self._native
        return native is not None and native.has_noticed is not None and native.has_noticed()

    def _attend(self, t: float) -> bool:
        """Let compiled functions that asked for it be looked at; return whether IDA can go on."""
        native = self._native
        if native is None or native.attend is None or native.last_rate is None:
            return False
        changed = native.attend(t, self._memory.y)
        if changed:
            self._memory.renew_factors(t, native.last_rate(), native.user_data)
        return changed is not None

    def _judge(self, flag: int, t: float) -> StepResult | None:
        """Return an answer if IDA has failed, or does not get on, after it went to a time."""
        finite = is_finite(self._memory.y, self._memory.yp)
        if flag < 0:
            self._stale = True
            if finite and t > self._here[0]:
                self._here = t, self._memory.y.copy(), self._memory.yp.copy()
            self._record.raise_again()
            if self._native is not None:
                explain(self._problem, self._record, [(self._here[0], *self._memory.last_tried()), *self._ahead()])
            return self._stopped(
                Status.FAILED, REASONS.get(flag) or EVENT_REASONS.get(flag, f"IDA stopped with flag {flag}")
            )
        if not finite:
            return self._failed("the solution is no longer finite")
        if self._watchdog.stalls(t, self._memory.steps()):
            self._stale = True
            if self._native is not None:
                explain(self._problem, self._record, self._ahead())
            return self._stopped(Status.FAILED, "the steps became too small to move the time", self._watchdog.mark[0])
        return self._judge_lap(t)

    def _judge_lap(self, t: float) -> StepResult | None:
        """Return an answer if the run would not end; tell IDA how much steps must grow, where that changes."""
        is_endless, growth = self._watchdog.judge_lap(t, self._memory.steps(), self._repeated, self._horizon)
        if growth is not None:
            self._memory.call("IDASetEtaFixedStepBounds", 1.0, growth)
        if not is_endless:
            return None
        return self._failed("rounding keeps the steps so short that the run would not end")

    def _repeated(self) -> int:
        counts = self._memory.counts()
        return counts.error_failures + counts.solve_failures

    def _ahead(self) -> list[State]:
        """Return states a little ahead on the tangent, where a wall that ended the run may be found."""
        t, y, yp = self._here
        return [(t + h, y + h * yp, yp) for h in (1e-9 * self._horizon, 1e-6 * self._horizon)]

    def _stopped(self, status: Status, reason: str, since: float = inf) -> StepResult:
        """Return where the run ended, with a complaint that came after the last good step, or since a time."""
        ended, record = super()._stopped(status, reason), self._record
        if status is not Status.FAILED or not record.complaint or record.time < min(ended.t, since):
            return ended
        return replace(ended, message=f"{ended.message}; {record.complaint}", equation=record.equation)


open_session = NativeSession
"""Starts a run with SUNDIALS' own IDA."""
