"""One stretch of a run: from a state in one mode to a time, an event, a limit or a failure."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.clock import TimeIsUp, check_time, more_time, time_left
from atwood.errors import AtwoodError, SolveError, StartError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import kept_touching
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.methods import AUTO, Method
from atwood.integrators.protocol import NOTHING, Budget, Statistics, Status, StepResult
from atwood.integrators.session import Session
from atwood.lazy_dataclasses import replace
from atwood.mechanics.outputs.event_functions import CONTACT
from atwood.simulation.dynamics.numerical_failure import (
    find_undefined_value,
    is_numerical,
    numerical_failure,
    states_ahead,
)
from atwood.simulation.dynamics.orientation_coordinates import (
    COORDINATE_SWITCH,
)
from atwood.simulation.dynamics.redundancy import RankFinding
from atwood.simulation.events.modes import EventRecord, ToldLater, seen_late, without_margin
from atwood.simulation.events.sides import SIDE
from atwood.simulation.events.time_events import MOMENT, Schedule
from atwood.simulation.problem.explicit_scene import project_quickly
from atwood.simulation.problem.preparation import pack_state
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import once, project_safely
from atwood.simulation.run.choice import dead_centre, stiffness_of, turned_stiff
from atwood.simulation.run.recorder import Recorder
from atwood.simulation.run.run_record import Outcome, Segment
from atwood.simulation.run.session import SolverRequest, open_session
from atwood.simulation.run.stall_diagnosis import explain_stuck, too_tight

if TYPE_CHECKING:
    from atwood.integrators.set_jumps import SetLog
    from atwood.simulation.singular.crossing import SingularCrossing
    from atwood.simulation.singular.monitor import SingularityMonitor


_BLOCKS = 50
"""Progress is told about so many times."""

_PACKED: Key[dict[tuple[Hashable, ...], tuple[FloatArray, FloatArray]]] = Key("starts of implicit methods")

_Jumps = tuple[FloatArray, FloatArray]
"""Times, and states before and after."""

_PARTS = 5
"""So often it is seen to that coordinates of orientations keep their size."""


def run_segment(segment: Segment, recorder: Recorder, t: float, q: FloatArray, u: FloatArray) -> Outcome:
    """Integrate in one mode until a time, an event or a limit of the run."""
    plan = segment.plan
    n = plan.program.coordinates
    with more_time():  # so that there is its start, whatever comes
        y, yp = _first_state(segment, t, q, u)
        recorder.take(t, y, segment.first_shown)
    already = segment.probe.broken_at_start(t) if segment.choice.method.looks_for_events else None
    if already is not None:
        return Outcome(t, "event", "", Statistics(), (segment.choice,), already)
    if t >= segment.end:  # what has changed at the end of the run is shown
        return Outcome(t, "finished", "", Statistics(), (segment.choice,))
    if n == 0:
        return _follow_time(segment, recorder, t)
    return _Runner(segment, recorder).run(t, y, yp)


def _follow_time(segment: Segment, recorder: Recorder, t: float) -> Outcome:
    """Go through a mode in which nothing is free to move: its state is a function of time, its events still happen."""
    nothing, last, options = np.zeros(0), t, segment.options
    noted: list[EventRecord] = []

    def ended(t: float, status: str, message: str = "", event: EventRecord | None = None) -> Outcome:
        return Outcome(t, status, message, Statistics(), (segment.choice,), event, noted=tuple(noted))

    try:
        for moment, show in zip(segment.samples.times, segment.samples.shown, strict=True):
            check_time()
            event = segment.probe.between(last, float(moment))
            while event is not None and not event.target:
                noted.append(event)
                recorder.take(event.time, nothing, True)
                event = segment.probe.between(event.time, float(moment))
            if event is not None:
                recorder.take(event.time, nothing, True)
                return ended(event.time, "event", event=event)
            last = float(moment)
            recorder.take(last, nothing, bool(show))
            if options.progress is not None:
                options.progress(last)
    except TimeIsUp:
        last = recorder.close()
        return ended(last, "time_limit", options.out_of_time(last))
    return ended(last, "finished")


def _first_state(segment: Segment, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the start of a segment for a solver; explicit methods work out the rates themselves."""
    if not len(q):
        return np.zeros(0), np.zeros(0)
    method = segment.choice.method
    if method.is_implicit:
        segment.plan.keep_better(t, q)
    return _state_for(method, segment.plan, t, q, u)


def _state_for(
    method: Method, plan: SceneProblem, t: float, q: FloatArray, u: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return a state for a method: with multipliers and rates for implicit ones alone."""
    if not method.is_implicit:
        return np.concatenate([q, u]), np.zeros(0)
    if plan.not_compilable:  # functions in Python are asked again
        return pack_state(plan, t, q, u)
    about = t, q.tobytes(), u.tobytes(), plan.finding.kept, plan.program.extra
    y, yp = plan.assembly.kept.recall(_PACKED, lambda: pack_state(plan, t, q, u), *about)
    return y.copy(), yp.copy()


class _Runner:
    """The way through one stretch, with whatever solves it."""

    def __init__(self, segment: Segment, recorder: Recorder) -> None:
        self.segment, self.recorder = segment, recorder
        self.choices = [segment.choice]
        self.before = NOTHING
        self.session: Session | None = None
        self.monitor: SingularityMonitor | None = None
        self.request: SolverRequest | None = None
        self.opened: StepResult | None = None
        self.noted: list[EventRecord | ToldLater] = []
        self.jumped: list[_Jumps] = []
        self.closed: dict[tuple[float, ...], tuple[Assembly, float, FloatArray]] = {}

    @property
    def pieces(self) -> Schedule | None:
        """The time events that steps pass by themselves; None where they pass none."""
        return self.recorder.pieces

    @property
    def method(self) -> Method:
        """What solves it at present."""
        return self.choices[-1].method

    def run(self, t: float, y: FloatArray, yp: FloatArray) -> Outcome:
        """Go from sample to sample; change the solver where the scene turns out stiff."""
        self.began, done = t, 0
        try:
            session = self._open(t, y, yp)
            if self.segment.ahead is not None:
                self._change_on_the_way(session)
                passed = self._pass_moments(session, y)
                if passed is not None:
                    return passed
                session = self.session or session
            while True:
                if not self.method.is_implicit and (self.monitor is None or self.monitor.next == np.inf):
                    done, step_result = self._sample_watched(session, done)
                    session = self.session or session
                else:
                    done, step_result = self._advance(session, done)
                    session = self.session or session
                if step_result is not None and step_result.status is Status.STIFF:
                    session = self._open(*self._change_solver(step_result))
                elif step_result is None or not self._notes(step_result):
                    break
            return self._outcome(step_result)
        except KeyboardInterrupt:  # from the progress function, or between two steps; what is there already is kept
            t = self.recorder.close()
            return self._ended(t, "interrupted", f"interrupted (at t = {t:.9g})")
        except TimeIsUp:
            return self._out_of_time()
        except SolveError as error:  # from a state that cannot be projected
            return self._failed(error)
        except (ValueError, ArithmeticError) as error:
            if not is_numerical(error):
                raise
            return self._failed(self._numerical_failure(error, (t, y)))

    def _change_on_the_way(self, session: Session) -> None:
        """Go on to the end of the run where the time events ahead are passed by steps that change sets of contacts."""
        segment = self.segment
        if segment.ahead is not None and segment.plan.assembly.own_equations.contacts:
            from atwood.simulation.run.moments import change_on_the_way

            if change_on_the_way(session, segment.ahead, segment.plan):
                self.recorder.pieces = segment.ahead.schedule
                self.segment = replace(segment, samples=segment.ahead.samples)

    def _pass_moments(self, session: Session, y: FloatArray) -> Outcome | None:
        """Go on through the moments ahead; None where the session has begun anew, or there are none to pass."""
        segment = self.segment
        if segment.ahead is None or self.monitor is not None or segment.probe.event_functions:
            return None
        filling = segment.kept.filling_of(session)
        if filling is None:
            return None
        assert isinstance(session, ExplicitSession)
        from atwood.simulation.run.moments import pass_moments

        given = y, segment.first_shown, segment.options.progress
        passed = pass_moments(session, filling, self.recorder, segment.ahead, *given)
        if passed is None:
            self._open(self.began, y, np.zeros(0))
            return None
        return replace(self._ended(passed.t, "finished", ""), held=passed.held, passed=passed)

    def _failed(self, error: SolveError) -> Outcome:
        return replace(self._ended(self.recorder.end, "failed", error.message), error=error)

    def _numerical_failure(self, error: Exception, start: tuple[float, FloatArray]) -> SolveError:
        """Return the error of numbers that could not be worked with, at the last state that was recorded."""
        plan = self.segment.plan
        t, (q, u) = start[0], plan.program.split(start[1])
        if not self.recorder.is_empty:
            with suppress(AtwoodError, ValueError, ArithmeticError):  # samples that cannot be projected either
                t, q, u, _ = self.recorder.last()
        failure = numerical_failure(plan.assembly, t, q, u, error)
        failure.__cause__ = error
        return failure

    def _out_of_time(self) -> Outcome:
        t = max(self.recorder.close(), self.began)
        return self._ended(t, "time_limit", self.segment.options.out_of_time(t))

    def _ended(self, t: float, status: str, message: str) -> Outcome:
        return Outcome(
            t,
            status,
            message,
            self._cost(),
            tuple(self.choices),
            noted=tuple(self.noted),
            handed=self._handed_on() if t < self.segment.options.t_end else (),
            held=self.segment.plan.assembly.held,
            begun=None if self.pieces is None else self.began,
            closed=tuple(self.closed.values()),
        )

    def _handed_on(self) -> tuple[int, ...]:
        """Return what a start from here is to know of the events."""
        return () if self.session is None else self.session.handed_on

    def _cost(self) -> Statistics:
        cost = self.before if self.session is None else self.before + self.session.statistics
        if self.monitor is None:
            return cost
        spent = self.monitor.seconds
        return replace(cost, seconds=cost.seconds + spent, monitor_seconds=cost.monitor_seconds + spent)

    def _outcome(self, step_result: StepResult | None) -> Outcome:
        """Record where a solver stopped early, if it did."""
        if step_result is None:
            self.recorder.settle()
            return self._ended(self.segment.end, "finished", "")
        if _is_change(step_result):  # that of the next piece, which steps have left
            self.recorder.rewind(step_result.t)
            self.recorder.take(step_result.t, step_result.y, False)
            self.recorder.settle()
            return self._ended(step_result.t, "finished", "")
        if step_result.status is Status.EVENT:
            at_event = self._at_event()
            step_result = without_margin(*at_event, step_result, self.began)
            self.recorder.rewind(step_result.t)
            event, *together = self.segment.probe.changing(step_result)
            end = self.segment.end
            if end - step_result.t <= MOMENT * np.spacing(abs(end)):  # no step is left
                step_result = replace(step_result, t=end)
            if event.target not in (COORDINATE_SWITCH, SIDE):
                self.recorder.take(step_result.t, step_result.y, True)
            elif step_result.t > self.recorder.end:
                segment = self.segment
                self.recorder.take(
                    step_result.t,
                    step_result.y,
                    bool(np.any(segment.samples.shown[segment.samples.times == step_result.t])),
                )
            sides = self.segment.probe.changed_sides(step_result)
            late = None
            if event.target in CONTACT:
                late = seen_late(*at_event, step_result, self.began), step_result.yp
            ended = self._ended(step_result.t, "event", "")
            return replace(ended, event=event, together=tuple(together), sides=sides, late=late)
        if step_result.t > self.recorder.end:
            self.recorder.take(step_result.t, step_result.y, True)
        if step_result.status is Status.TIME_LIMIT:
            return self._out_of_time()
        message = step_result.message
        if step_result.status is Status.STEP_LIMIT:
            message = self.segment.options.out_of_steps(step_result.t)
        ended = self._ended(step_result.t, step_result.status.value, message)
        return ended if step_result.status is not Status.FAILED else replace(ended, error=self._explain(step_result))

    def _at_event(self) -> tuple[Callable[[float, FloatArray], FloatArray], FloatArray]:
        """Return the values of events, as steps see them if these are compiled, and what is added to each."""
        probe, split = self.segment.probe, self.segment.plan.program.split
        watched = None if self.session is None else self.session.watched
        if watched is None:
            return (lambda t, y: probe.values(t, *split(y))), probe.shift
        values = watched.function()
        return (lambda t, y: values(t, y, y)), watched.arrays[1].copy()

    def _notes(self, step_result: StepResult) -> bool:
        """After an event that changes nothing, note it: the solver then goes on as if nothing had happened."""
        if step_result.status is not Status.EVENT or _is_change(step_result):
            return False
        noted = self.segment.probe.noted(step_result)
        self.noted += noted
        if self.segment.probe.changing(step_result):
            return False
        if noted:
            self.recorder.take(step_result.t, step_result.y, True)
        return True

    def _explain(self, step_result: StepResult) -> SolveError | None:
        """Return an error that names what has no value, or a singular position; None where it is neither."""
        program, assembly, options = self.segment.plan.program, self.segment.plan.assembly, self.segment.options
        now, rates = program.split(step_result.y), program.split(step_result.yp)
        states = states_ahead(step_result.t, now, rates, options.t_end - self.segment.choice.time)
        found = find_undefined_value(assembly, *states)
        if found is None:
            stuck = None if self.monitor is None else self.monitor.explain(step_result.message)
            tight = (
                None
                if stuck or self.request is None
                else too_tight(self.request, self.method, step_result, self.opened)
            )
            return stuck or tight or explain_stuck(self.segment.plan, step_result)
        return SolveError(
            f"{found.describe()}, so that the run cannot go on: {step_result.message}",
            where=found.part,
            advice="A law is evaluated where it has no value: look at its formula, and at what the scene does before "
            "(the error's `run`).",
        )

    def _open(self, t: float, y: FloatArray, yp: FloatArray) -> Session:
        segment, choice = self.segment, self.choices[-1]
        options, spent = segment.options, segment.spent.steps + self.before.steps
        request = SolverRequest(
            segment.plan,
            segment.probe,
            options,
            segment.end,
            Budget(
                max_steps=None if options.max_steps is None else max(0, options.max_steps - spent),
                wall_seconds=None if options.max_seconds is None else max(0.0, time_left()),
                poll=_both(segment.plan.poll(choice.method), options.on_step),
            ),
            segment.kept,
        )
        if choice.method.is_implicit:
            self.request, self.opened = request, StepResult(t, y, yp, Status.REACHED)
        on_stiff = self._is_stiff if options.solver == AUTO else None
        try:
            self.session = open_session(
                request, choice.method, t, y, yp, on_stiff, self._on_dead_centre, choice.keeps_constraints
            )
        except StartError:
            if not choice.method.is_implicit:
                pack_state(segment.plan, t, *segment.plan.program.split(y))  # says what has no value, if it can
            raise
        self.recorder.nearest, self.recorder.by_formulas = self.session.nearest, self.session.solves_loops
        self._watch(self.session)
        return self.session

    def _watch(self, session: Session) -> None:
        """Look out for singular positions where constraints stay."""
        self.monitor, segment = None, self.segment
        if session.solves_loops or not (self.method.is_implicit or segment.plan.balance.constraints):
            return
        from atwood.simulation.singular.monitor import singularity_monitor_of

        monitor = singularity_monitor_of(segment.plan, segment.options.relative_tolerance, segment.end, session.here)
        self.monitor = monitor
        if monitor is not None and not (self.method.is_implicit or session.budget.poll or segment.probe.directions):
            monitor.pass_in_steps(segment.end, segment.kept.rates_of(session))
        looks = None if monitor is None else monitor.step_monitor
        if monitor is not None and (looks is None or not session.set_monitor(looks)):
            monitor.look_in_python()

    def _is_stiff(self, t: float, y: FloatArray) -> bool:
        if self.session is not None and (made := self._take_jumps(self.session)) is not None:
            self.jumped.append(made)  # the plan is that of the present set
        plan = self.segment.plan
        found = stiffness_of(plan, self.segment.options, t, *plan.program.split(y), goes_on=True)
        if found is None or not found.is_stiff:
            return False
        self.choices.append(turned_stiff(t, found))
        return True

    def _on_dead_centre(self, t: float, y: FloatArray) -> None:
        """Go on with constraints where every choice of formulas comes to a dead centre."""
        plan = self.segment.plan
        self.choices.append(dead_centre(plan, self.segment.options, t, *plan.program.split(y)))

    def _change_solver(self, step_result: StepResult) -> tuple[float, FloatArray, FloatArray]:
        """Return the state from which another solver goes on."""
        self.recorder.settle()  # another one's states have other unknowns
        self.segment.probe.handed = self._handed_on()
        self.before, self.session = self._cost(), None
        self.choices[-1] = replace(self.choices[-1], time=step_result.t)
        segment, plan = self.segment, self.segment.plan
        if self.pieces is not None and (limit := self.pieces.next(self.began, segment.end)) < segment.end:
            self.segment = replace(segment, samples=segment.samples.until(-np.inf, limit).without_last_shown())
        return step_result.t, *self._packed(step_result.t, *plan.program.split(step_result.y))

    def _sample(self, session: Session, done: int) -> tuple[int, StepResult | None]:
        """Let an explicit method fill tables; return how many samples are done, and why it stopped early."""
        segment, progress = self.segment, self.segment.options.progress
        kinematic_map = segment.plan.balance.kinematic_map
        samples, turns = segment.samples, kinematic_map.has_homogeneous
        ends = samples.ends_of_blocks(_BLOCKS if progress is not None else 1)
        looks = samples.ends_of_blocks(_PARTS) if turns else ends
        while done < len(samples.times):
            times = samples.times[done : ends[ends.searchsorted(done, side="right")]]
            if turns and segment.plan.assembly.own_equations.contacts:  # what jumps has happened
                times = times[: looks[looks.searchsorted(done, side="right")] - done]
            y, _, step_result = session.sample(times)
            self._take_passed()
            strayed = self._strayed(y, looks[(looks > done) & (looks <= done + len(y))] - done) if turns else None
            if strayed is not None:  # what comes behind is done again
                y, step_result = y[: strayed + 1], session.here
            count = len(y)
            jumps = self._all_jumps(session)
            shows = jumps is None or self._shows(jumps)
            self.recorder.take_many(times[:count], y, segment.samples.shown[done : done + count], jumps, shows)
            done += count
            if step_result.status is not Status.REACHED:
                return done, step_result
            if strayed is not None:
                q, u = segment.plan.program.split(y[-1])
                session.reinitialize(float(times[strayed]), np.concatenate([kinematic_map.normalized(q), u]))
                if self.monitor is not None:
                    self.monitor.restart(session.here)
            if progress is not None:
                progress(float(times[-1]))
        return done, None

    def _take_passed(self) -> None:
        """Take singular crossings that steps have made by themselves into the record."""
        passed = [] if self.monitor is None else self.monitor.take_passed()
        if passed:
            restarts = Statistics(reinitializations=len(passed), error_test_failures=0, convergence_failures=0)
            self.before = self.before + restarts
            self.recorder.take_passed(passed)

    def _shows(self, jumps: _Jumps) -> NDArray[np.bool_]:
        """Return whether states before and after jumps are outputs: those before time events are none."""
        is_any = isinstance(self.segment.options.outputs, (int, np.integer))  # or just the times that were asked for
        times, shows = jumps[0], np.empty((len(jumps[0]), 2), dtype=bool)
        shows[:] = is_any
        if self.pieces is not None:
            moments = self.pieces.times
            after = moments.searchsorted(times).clip(max=len(moments) - 1)
            for i in (moments[after] == times).nonzero()[0].tolist():
                shows[i] = False, self.segment.samples.shows(float(times[i]))
        return shows.ravel()

    def _strayed(self, y: FloatArray, ends: NDArray[np.intp]) -> int | None:
        """Return the first of some rows in which coordinates of an orientation need another size; None if none does."""
        plan = self.segment.plan
        needs = plan.balance.kinematic_map.needs_normalization(plan.program.split(y[ends - 1].T)[0])
        return int(ends[needs.argmax()]) - 1 if needs.any() else None

    def _all_jumps(self, session: Session) -> _Jumps | None:
        """Return the jumps since the last states were recorded."""
        made, last = self.jumped, self._take_jumps(session)
        if not made:
            return last
        self.jumped, made = [], made if last is None else [*made, last]
        return np.concatenate([one[0] for one in made]), np.concatenate([one[1] for one in made])

    def _take_jumps(self, session: Session) -> _Jumps | None:
        """Return times and states of the jumps since this was last asked, and note what is told of them."""
        if not self.method.looks_for_events:
            from atwood.integrators.time_stepping.session import TimeSteppingSession  # few runs step over events

            assert isinstance(session, TimeSteppingSession)
            changes = session.take_changes()
            self.noted += [event for one in changes for event in one.told]
            self.recorder.take_changes(lambda: changes)
            self.recorder.loss_until = session.loss_until if session.has_losses else None
            later = [one for one in changes if one.time > self.began]
            return (np.array([one.time for one in later]), np.array([one.states for one in later])) if later else None
        log = session.take_jumps()
        if log is None:
            return None
        from atwood.integrators.set_jumps import SetLog

        if isinstance(log, SetLog):
            self._take_sets(session, log)
        else:
            from atwood.simulation.contacts.bounces import noted_bounces

            self.noted.append(noted_bounces(log, self.segment.plan, self.segment.probe))
        return log.time, log.states

    def _take_sets(self, session: Session, log: SetLog) -> None:
        """Take up the changes of a set of contacts, and go on with the last of them."""
        from atwood.simulation.contacts.compiled import held_after, not_touching, noted_sets, told_sets

        segment, assembly = self.segment, self.segment.plan.assembly
        changes = once(partial(told_sets, log, assembly))
        self.noted.append(noted_sets(log, assembly, changes))
        self.recorder.take_changes(changes)
        assert isinstance(session, ExplicitSession)
        self.recorder.nearest = session.nearest_open  # what holds now did not before
        for one in log.closings(not_touching(assembly)):
            held = held_after(one, assembly)
            self.closed.setdefault(held, (self._in_piece(assembly.with_held(held), one.time), one.time, one.states[1]))
        [last] = log.changes(slice(-1, None))
        assembly = self._in_piece(assembly.with_held(held_after(last, assembly)), last.time)
        plan = segment.plan.in_piece(kept_touching(assembly))
        q, u = plan.program.split(last.states[1])
        probe = segment.probe.at(plan, last.time, q, u)
        self.segment, self.began = replace(segment, plan=plan, probe=probe), last.time

    def _in_piece(self, assembly: Assembly, t: float) -> Assembly:
        """Return the scene in the piece of a time, where steps pass time events by themselves."""
        return assembly if self.pieces is None else self.pieces.applied(assembly, self.pieces.piece(t))

    def _sample_watched(self, session: Session, done: int) -> tuple[int, StepResult | None]:
        """Let an explicit method fill tables, with looks at the motion where constraints stay."""
        while True:
            crossing = None if self.monitor is None else self.monitor.ahead_of_start()
            if crossing is not None:
                self._sample_until(session, done, crossing)  # it may begin at an output
                done, stopped = self._pass_over(session, crossing)
                if stopped is not None:
                    return done, stopped
            done, step_result = self._sample(session, done)
            monitor = self.monitor
            if monitor is None:
                return done, step_result
            here, at_end = step_result or session.here, step_result is None
            noticed = here.status is Status.NOTICED
            turned = self._turned(here) if noticed else None
            crossing = monitor.look(here, noticed, at_end or turned is not None)
            if crossing is not None:
                self._sample_until(session, done, crossing)
                done, stopped = self._pass_over(session, crossing)
                if stopped is not None:
                    return done, stopped
                continue
            self._note_crossings(monitor)
            if turned is not None:
                session = self._keep(turned, here)
            elif not noticed:
                return done, step_result

    def _sample_until(self, session: Session, done: int, crossing: SingularCrossing) -> None:
        """Take outputs up to where a path begins: the last step may have been looked at beyond those that are taken."""
        assert crossing.path is not None
        samples = self.segment.samples
        first = int(np.searchsorted(samples.times, crossing.path.start, side="right"))
        while done < first:
            y, _, step_result = session.sample(samples.times[done:first])
            self.recorder.take_many(samples.times[done : done + len(y)], y, samples.shown[done : done + len(y)])
            done += len(y)
            if step_result.status is not Status.NOTICED:
                return

    def _note_crossings(self, monitor: SingularityMonitor) -> None:
        """Take crossings that the solver made by itself into the record."""
        if monitor.agreed:
            self.recorder.note(monitor.agreed)
            for one in monitor.agreed:
                if one.path is None:
                    warnings.warn(one.describe(), stacklevel=2)
            monitor.agreed.clear()

    def _advance(self, session: Session, done: int) -> tuple[int, StepResult | None]:
        """Go from sample to sample; return how many are done, and why it stopped early."""
        segment, recorder, progress = self.segment, self.recorder, self.segment.options.progress
        samples = segment.samples
        times, shown, extra = (x.tolist() for x in (samples.times, samples.shown, samples.between))
        plan, told = segment.plan, -np.inf
        repairs, ends = self._repairs, samples.ends_of_blocks(_PARTS)
        while done < len(times):
            moment, monitor = times[done], self.monitor
            look = np.inf if monitor is None else monitor.next
            target = min(moment, look)
            crossing = None if monitor is None else monitor.ahead_of_start()
            if crossing is not None:
                done, stopped = self._pass_over(session, crossing)
                if stopped is not None:
                    return done, stopped
                continue
            step_result = session.advance(target)
            if step_result.status is Status.FAILED and self._repartitioned(session, step_result):
                step_result = session.advance(target)
            noticed = step_result.status is Status.NOTICED
            between = target < moment or noticed
            looks = noticed or look == target < moment
            turned = self._turned(step_result) if looks or monitor is None else None
            at_end = (moment >= segment.end and not noticed) or turned is not None
            crossing = None if monitor is None else monitor.look(step_result, looks, at_end)
            if crossing is not None:
                done, stopped = self._pass_over(session, crossing)
                if stopped is not None:
                    return done, stopped
                continue
            if monitor is not None:
                self._note_crossings(monitor)
            if step_result.status not in (Status.REACHED, Status.NOTICED):
                return done, step_result
            if turned is not None:
                session = self._keep(turned, step_result)
            if between:
                continue
            recorder.take(step_result.t, step_result.y, shown[done])
            first, done = done, done + 1
            if not extra[first]:
                if plan.reviews_outputs:
                    plan.review_partitioning(step_result.t, step_result.y[: plan.program.coordinates])
                if repairs:
                    self._repair(session, step_result)
            if self._reads_on():  # up to the last, at which a monitor looks
                last = ends[ends.searchsorted(done, side="right")] if repairs and done < len(times) else len(times)
                rows = session.read_on(times, done, int(last) - 1)
                recorder.take_all(times[done : done + len(rows)], rows, shown[done : done + len(rows)])
                done += len(rows)
            if progress is not None:
                for moment in times[first:done]:
                    if moment > told:
                        told = moment
                        progress(moment)
        return done, None

    def _reads_on(self) -> bool:
        """Return whether nothing is looked at, or put right, from one output to the next within a step."""
        plan, monitor = self.segment.plan, self.monitor
        looks = plan.finding.redundant if monitor is None else monitor.next < np.inf
        return not (looks or plan.reviews_outputs or plan.program.level == "index1-projected")

    @property
    def _repairs(self) -> bool:
        """Whether the state may have to be put right at an output."""
        plan = self.segment.plan
        return plan.program.level == "index1-projected" or plan.balance.kinematic_map.has_homogeneous

    def _pass_over(self, session: Session, crossing: SingularCrossing) -> tuple[int, StepResult | None]:
        """Take a singular crossing into the record and go on behind it, unless something happens on its way."""
        segment, plan, path = self.segment, self.segment.plan, crossing.path
        assert path is not None
        times = segment.samples.times
        from atwood.simulation.singular.crossing import events_on

        root = events_on(path, plan, segment.probe)
        end = path.end if root is None else min(path.end, root.state[0])
        first, done = (int(np.searchsorted(times, one, side="right")) for one in (path.start, end))
        self.recorder.pass_over(crossing, times[first:done], segment.samples.shown[first:done])
        if root is not None and root.state[0] <= segment.end:
            return done, StepResult(*root.state, Status.EVENT, root.events)
        if done < len(times):
            q, u, _ = (one[:, 0] for one in path.at(np.array([path.end])))
            rates = segment.kept.rates_of(session)
            q, u = project_quickly(plan, path.end, q, u, rates) or project_safely(plan, path.end, q, u)
            if self.method.is_implicit:
                plan.review_partitioning(path.end, q)
            session.reinitialize(path.end, *self._packed(path.end, q, u))
            assert self.monitor is not None
            self.monitor.restart(session.here, is_behind=True)
        return done, None

    def _repartitioned(self, session: Session, step_result: StepResult) -> bool:
        """After a failure, go on with other dependent coordinates if those were a poor choice."""
        plan = self.segment.plan
        q, u = (part.copy() for part in plan.program.split(step_result.y))
        if not self.method.is_implicit or not plan.review_partitioning(step_result.t, q):
            return False
        q, u = plan.balance.project(step_result.t, q, u, plan.sizes)
        session.reinitialize(step_result.t, *pack_state(plan, step_result.t, q, u))
        return True

    def _turned(self, step_result: StepResult) -> RankFinding | None:
        """Return which constraints are better kept from here on, if those that are have become a poor choice."""
        plan = self.segment.plan
        q, _ = plan.program.split(step_result.y)
        is_there = step_result.status in (Status.REACHED, Status.NOTICED)
        return plan.better_kept(step_result.t, q) if is_there else None

    def _keep(self, finding: RankFinding, step_result: StepResult) -> Session:
        """Go on with other constraints kept, from the same state."""
        plan = self.segment.plan
        q, u = (part.copy() for part in plan.program.split(step_result.y))
        if plan.is_projected:
            q, u = project_safely(plan, step_result.t, q, u)
        self.segment.probe.handed = self._handed_on()
        self.before, self.session = self._cost(), None
        plan.keep(finding, step_result.t, q)
        return self._open(step_result.t, *self._packed(step_result.t, q, u))

    def _packed(self, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return a state for the present solver."""
        return _state_for(self.method, self.segment.plan, t, q, u)

    def _repair(self, session: Session, step_result: StepResult) -> None:
        """Go on from the recorded state where the solver's own has strayed.

        At index 1 with projection that is where the drift outgrows the error of the steps; for any orientation, where
        the size of its coordinates is no longer near one.
        """
        plan = self.segment.plan
        needs_normalization = plan.balance.kinematic_map.needs_normalization(plan.program.split(step_result.y)[0])
        if plan.program.level != "index1-projected" and not needs_normalization:
            return
        _, q, u, misses = self.recorder.last()
        drift = float(np.max(misses()[:, -1] * [1.0, plan.scales.time]))  # of places, and of speeds
        if needs_normalization or drift > 100.0 * self.segment.options.relative_tolerance:
            session.reinitialize(step_result.t, *pack_state(plan, step_result.t, q, u))


def _is_change(step_result: StepResult) -> bool:
    """Return whether nothing has passed zero at an event: parameters change."""
    return step_result.status is Status.EVENT and not any(step_result.events)


def _both(
    one: Callable[[float], object] | None, other: Callable[[float], object] | None
) -> Callable[[float], object] | None:
    """Return what calls both functions."""
    if one is None or other is None:
        return one or other

    def call(t: float) -> None:
        one(t)
        other(t)

    return call
