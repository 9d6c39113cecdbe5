"""Runs: from start to end through all modes, with projected outputs."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from atwood.arrays import FloatArray
from atwood.clock import GRACE, Clock, TimeIsUp
from atwood.display import listed
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key, Shared, without_collection
from atwood.forms.loose import has_touched, is_loose, kept_touching
from atwood.integrators.protocol import NOTHING
from atwood.lazy_dataclasses import replace
from atwood.mechanics.outputs.event_functions import CONTACT, UPDATE
from atwood.simulation.dynamics.numerical_failure import is_numerical, named, numerical_failure
from atwood.simulation.dynamics.orientation_coordinates import (
    COORDINATE_SWITCH,
    CoordinateSwitch,
    Reassemble,
    switch_coordinates,
    to_regular,
)
from atwood.simulation.dynamics.scales import own_length, smaller_size
from atwood.simulation.events.modes import LAST, EventProbe, EventRecord, ToldLater
from atwood.simulation.events.sampling import Updated, find_sampler
from atwood.simulation.events.sides import SIDE
from atwood.simulation.events.time_events import Schedule, find_schedule
from atwood.simulation.initialization.mobility import check_prescribed, refuse_immobile
from atwood.simulation.initialization.start import Start, settle
from atwood.simulation.problem.arguments import check_span
from atwood.simulation.problem.options import RunOptions, Samples, sample_times
from atwood.simulation.problem.preparation import problem_of_run
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import project_safely
from atwood.simulation.run.choice import Choice, check_asked, check_solver, choose
from atwood.simulation.run.recorder import Recorder, Stretch
from atwood.simulation.run.run_record import (
    Outcome,
    Run,
    Segment,
    goes_on,
    run_out_of_time,
    shortest_mode,
)
from atwood.simulation.run.segment import run_segment
from atwood.simulation.run.session import MANY_CHANGES, KeptSession
from atwood.simulation.run.sides_of_run import SidesOfRun
from atwood.simulation.run.stall_diagnosis import allowed, failed
from atwood.stages import stage
from atwood.topology.orientation_coordinates import Orientation

if TYPE_CHECKING:
    from atwood.simulation.contacts.changes import Changed
    from atwood.simulation.run.moments import Ahead, Passed

_Walk = TypeVar("_Walk", bound="Walk")

_AT_START: Key[Changed] = Key("what becomes of gaps and slips at the start")
_FIRST_EVENT: Key[list[float]] = Key("until when what touches nothing at the start is disturbed")

_ON_ENTERING: Key[dict[tuple[Hashable, ...], tuple[FloatArray, FloatArray]]] = Key("states on constraints of a mode")

_READY: Key[tuple[tuple[object, ...], Walk]] = Key("a run that is ready to go, and what it was asked for")

_ASKED_FOR = attrgetter(
    *("t_end", "relative_tolerance", "absolute_tolerance", "max_order", "max_step", "solver", "structure"),
    *("conditions", "order", "step", "accuracy", "nominal", "first_step", "impacts"),
)
"""What of its options the preparation of a run depends on, besides its samples."""

_SURELY = 1e-3
"""Of the time to the first event: so much later it has happened, whatever the end makes of the steps."""

_CHATTER, _MOST_CONTACTS = 50, 2000
"""So many changes of mode without time passing end a run, and so many of gaps and slips."""

_SIZES_TRIED = 4
"""A scene without lengths is run so often at most, each time with the size of its motion before."""

_MANY_IMPACTS = 50
"""So many impacts one after the other, while no time passes, are why a run ends."""


def run(
    assembly: Assembly, start: Start, options: RunOptions, reassemble: Reassemble, clock: Clock | None = None
) -> Run:
    """Run a scene from its start to its end."""
    check_span(start.time, options.t_end, options.max_step, options.step, options.first_step)
    check_solver(options.solver)
    check_asked(options)
    options = allowed(options)
    clock = Clock(options.max_seconds) if clock is None else clock

    for _ in range(_SIZES_TRIED):
        try:
            with clock.kept(GRACE):
                walk = _prepared(Walk, assembly, start, reassemble, options, np.zeros(0))
        except TimeIsUp:
            return run_out_of_time(assembly, start, options)
        with clock.kept():
            made = walk.go()
        size = _smaller(made, walk)  # beyond the time, which a run may just have used up
        if not size:
            break
        start = replace(start, length=size)
    return made


def _smaller(made: Run, walk: Walk) -> float:
    """Return the size with which a run is to be made again, m; 0 where it is good, or its sizes were asked for."""
    assembly, options = made.assembly, made.options
    known = [assembly.observables[path].unit for path in options.nominal if path in assembly.observables]
    is_asked = "m" in known or options.step is not None
    if is_asked or made.status not in ("finished", "stopped") or own_length(assembly):
        return 0.0
    passed = ((one.plan.assembly.own_equations.names, one.coordinates) for one in made.stretches)
    size = smaller_size(walk.start.length, passed)
    if size and not walk.sampler.is_pure:  # updates may have a memory, and are not asked twice
        path = next(path for path, one in assembly.observables.items() if one.unit == "m")
        warnings.warn(
            f"{assembly.flat.name}: without lengths it counts as {walk.start.length:.3g} m large, and moves by "
            f"{size:.3g} m, so that its errors may be as large. Give sizes, such as nominal={{{path!r}: ...}}.",
            stacklevel=5,
        )
        return 0.0
    return size


def choice_at_start(assembly: Assembly, start: Start, options: RunOptions, reassemble: Reassemble) -> Choice:
    """Return what solves a scene at first, and why; what is made for it is kept for the run. Arguments as of `run`."""
    return _prepared(Walk, assembly, start, reassemble, allowed(options), np.zeros(0)).choice


def _prepared(
    kind: type[_Walk],
    assembly: Assembly,
    start: Start,
    reassemble: Reassemble,
    options: RunOptions,
    between: FloatArray,
    known: Sequence[Updated] | None = None,
) -> _Walk:
    """Return a run that is ready to go, with samples in between that change nothing.

    Where it is made again, it is known what updates have made of its states, and nobody is asked twice. How the last
    run of an assembly began is kept for the next one that is asked for in the same way.
    """
    samples, log = sample_times(start.time, options), list[Updated]()
    again = partial(_again, assembly, start, reassemble, log)
    state = start.time, start.coordinates.tobytes(), start.speeds.tobytes(), start.length
    about = kind, samples, reassemble, *state, *_ASKED_FOR(options)
    is_plain = kind is Walk and known is None and not len(between)
    ready = assembly.kept.known(_READY) if is_plain else None
    if ready is not None and ready[0] == about:
        return cast(_Walk, ready[1].renewed(assembly, start, options, again, log))
    if assembly.own_equations.prescribed:
        schedule = find_schedule(assembly, start.time, options.t_end).at_samples(samples.times)
        check_prescribed(schedule.rows(assembly, samples.times), samples.times)
    walk = kind(assembly, start, options, reassemble, samples.with_more(between), again, log, known)
    with named(walk.assembly, walk.t, walk.q, walk.u):
        walk.prepare()
    if is_plain and walk.can_be_renewed:
        unwatched = replace(options, progress=None, on_step=None)  # whoever watches is not kept
        assembly.kept.take(_READY)
        assembly.kept.get(_READY, lambda: (about, walk.renewed(None, start, unwatched, again, [])))
    return walk


def _again(
    assembly: Assembly,
    start: Start,
    reassemble: Reassemble,
    log: Sequence[Updated],
    options: RunOptions,
    between: FloatArray,
) -> Run:
    return _prepared(Walk, assembly, start, reassemble, options, between, log).go()


def walked(assembly: Assembly, start: Start, options: RunOptions, kind: type[_Walk]) -> tuple[_Walk, Run]:
    """Make a run by a way that takes note of what happens; return both."""
    walk = begun(assembly, start, options, kind)
    return walk, walk.go()


def begun(assembly: Assembly, start: Start, options: RunOptions, kind: type[_Walk]) -> _Walk:
    """Return a run by a way of some kind, ready to go."""
    return _prepared(kind, assembly, start, assembly.other_mode, allowed(options), np.zeros(0))


def _on_entering(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a state on the constraints of a mode that is entered; a run again comes to the same."""
    if plan.not_compilable:  # functions in Python are asked again
        return project_safely(plan, t, q, u)
    about = t, q.tobytes(), u.tobytes(), plan.finding.kept, plan.sizes.tobytes(), plan.scales.time
    found = plan.assembly.kept.recall(_ON_ENTERING, lambda: project_safely(plan, t, q, u), *about)
    return found[0].copy(), found[1].copy()


class Walk:
    """The way of a run through its modes."""

    passes_moments = True
    """Whether steps may pass sample times and time events by themselves."""

    def __init__(
        self,
        assembly: Assembly,
        start: Start,
        options: RunOptions,
        reassemble: Reassemble,
        samples: Samples,
        again: Callable[[RunOptions, FloatArray], Run],
        log: list[Updated],
        known: Sequence[Updated] | None = None,
    ) -> None:
        self.start, self.options, self._other = start, options, reassemble
        self.samples, self.again = samples, again
        self._schedules: dict[Shared, Schedule] = {}
        self._plans: dict[tuple[tuple[float, ...], tuple[float, ...] | None], SceneProblem] = {}
        self._kept, self._sides = KeptSession(assembly), SidesOfRun(options)
        self.segments: list[Stretch] = []
        self.events: list[EventRecord | ToldLater] = []
        self.choices: list[Choice] = []
        self.statistics = NOTHING
        self.t = self._piece_start = start.time
        self.assembly, self.q, self.u = settle(assembly, start, reassemble)
        self.held = self.assembly.held_at_start
        self.sampler = find_sampler(self.assembly, start.time, options.t_end, samples.own)
        self._sampled, self.log, self._known = -np.inf, log, known
        self.assembly = self.first = self._in_piece(self.assembly)
        self.coordinate_switches: list[CoordinateSwitch] = []
        self.impact, self.rests, self.show = False, False, bool(samples.shown[0])
        self._handed: tuple[int, ...] = ()
        self.plan: SceneProblem | None = None
        self.ended: EventRecord | None = None
        self._sides_before: FloatArray | None = None
        """On which sides of zero conditions were where the last stretch ended."""
        self._unsettled: tuple[EventRecord, ...] | None = ()
        self._late: tuple[float, FloatArray] | None = None
        self._impacts: list[tuple[float, str]] = []
        self._told: set[tuple[float, ...]] = set()
        self.probe: EventProbe | None = None
        self.choice: Choice

    @property
    def can_be_renewed(self) -> bool:
        """Whether all that preparing it did is in its attributes: nothing was said, and nobody was asked."""
        plan, probe = self.plan, self.probe
        if plan is None or probe is None or self.ended is not None or plan.not_compilable or plan.assembly.sides:
            return False
        method = self.choice.method
        return not (method.is_implicit or method.has_equal_steps) and self.sampler.is_pure

    def renewed(
        self,
        assembly: Assembly | None,
        start: Start,
        options: RunOptions,
        again: Callable[[RunOptions, FloatArray], Run],
        log: list[Updated],
    ) -> Walk:
        """Return a run that is as ready to go as this one, which has gone nowhere; it takes the sessions of a scene."""
        assert self.plan is not None
        assert self.probe is not None
        plan = replace(self.plan, _kernels=None, _seen=None, _null_space=None)
        kept, made = KeptSession(assembly), object.__new__(Walk)
        kept.changes = self._kept.changes
        vars(made).update(
            vars(self),
            start=start,
            options=options,
            again=again,
            log=log,
            _schedules={**self._schedules},
            _plans=dict.fromkeys(self._plans, plan),
            _kept=kept,
            _sides=SidesOfRun(options),
            segments=[],
            events=[*self.events],
            choices=[],
            coordinate_switches=[],
            plan=plan,
            _impacts=[*self._impacts],
            _told={*self._told},
            probe=self.probe.of(plan),
        )
        return made

    def go(self) -> Run:
        """Go from mode to mode to the end; whatever stops it on the way takes along what came before."""
        try:
            made = self._go()
            self._kept.hand_back()
            return made
        except TimeIsUp:  # while the scene was prepared in another mode
            return self.run_so_far("time_limit", self.options.out_of_time(self.t))
        except AtwoodError as error:
            raise self._with_run(error) from error.__cause__
        except (ValueError, ArithmeticError) as error:  # between two segments
            if not is_numerical(error):
                raise
            raise self._with_run(numerical_failure(self.assembly, self.t, self.q, self.u, error)) from error

    def _with_run(self, error: AtwoodError) -> AtwoodError:
        """Return an error with what came before it."""
        if self.segments and not hasattr(error, "run"):
            error.run = self.run_so_far("failed", error.message)  # type: ignore[attr-defined]
        return error

    def _go(self) -> Run:
        chatter = 0
        while True:
            before = self.t
            recorder, outcome = self._segment()
            self.t, self._handed = outcome.t, outcome.handed
            self.events += outcome.noted
            if outcome.t < self.options.t_end or outcome.event is not None:
                self._remember(outcome.noted)
            is_short = outcome.t - before < shortest_mode(recorder.plan, self.options, self.start.time)
            chatter = chatter + 1 if is_short else 0
            if outcome.event is None:
                if outcome.status == "finished" and (outcome.t < self.options.t_end or self._due()):
                    _, self.q, self.u, _ = recorder.last()
                    self.impact, self.rests, chatter = False, False, 0
                    continue
                return self._finished_run(outcome.status, outcome.message, outcome)
            target = outcome.event.target
            self._sides.change(outcome.sides if target == SIDE else (), is_short)
            if target not in (SIDE, COORDINATE_SWITCH, *CONTACT):
                self.events += (outcome.event, *outcome.together)
            if target == "stop":
                return self._finished_run("stopped", outcome.event.describe(), outcome)
            if chatter > (_MOST_CONTACTS if target in CONTACT else _CHATTER) and target != SIDE:
                return self._finished_run("failed", self._endless(outcome.event, recorder.plan), outcome)
            is_switch = target == COORDINATE_SWITCH
            self._switch_coordinates(outcome.event, recorder) if is_switch else self._enter(outcome, recorder)
            if self.t >= self.options.t_end and target != UPDATE:
                return self._finished_run("finished", "", outcome)

    def _endless(self, event: EventRecord, plan: SceneProblem) -> str:
        """Return the sentence about changes that do not end: squeezed between surfaces that close, impacts never do."""
        last = self._impacts[-_MANY_IMPACTS:]
        lasted = self.t - last[0][0] if len(last) == _MANY_IMPACTS else math.inf
        if event.target not in CONTACT or lasted > len(last) * shortest_mode(plan, self.options, self.start.time):
            return f"{event.part} changes its mode endlessly at t = {self.t:.9g}"
        parts = listed(sorted({part for _, part in last}))
        return (
            f"impacts of {parts} follow each other ever faster at t = {self.t:.9g}, the last {_MANY_IMPACTS} of them "
            f"within {lasted:.3g} s: what they close on has no room left, and does not come to rest"
        )

    def _arrive(self, schedule: Schedule) -> bool:
        """Pass time events and updates that are due, and make ready what comes; return whether there were any."""
        has_passed = False
        if len(schedule.times):
            self.t = schedule.reached(self.t)
            has_passed = schedule.piece(self.t) != schedule.piece(self._piece_start)
        if has_passed:
            self._pass_time_event()
        if due := self._due():
            has_passed = True
            self._sampled = self.t
            self._update(due)
        is_ready = not (has_passed or self.segments) and self._unsettled is None and self.probe is not None
        if self.ended is None and not is_ready:
            self.prepare()
        return has_passed

    def _segment(self) -> tuple[Recorder, Outcome]:
        """Run one stretch in the present mode, until the next time event at most."""
        options, schedule = self.options, self._schedule(self.assembly)
        after_time_event = self._arrive(schedule)
        jumped = self._meet_conditions()
        if self.ended is not None:
            assert self.plan is not None
            recorder = Recorder(self.plan)
            if jumped:
                recorder.take(self.t, np.concatenate([self.q, self.u]), True)
                record = recorder.stretch(self.impact, after_time_event, self.rests)
                self.segments.append(self._sides.recorded(record, self.plan, self.assembly, False))
            return recorder, Outcome(self.t, "event", "", self.statistics, (self.choice,), self.ended)
        t, q, u = self.t, self.q, self.u
        assert self.plan is not None
        assert self.probe is not None
        self._kept.impacts = None if self.sampler.updates else self._impacts
        self._kept.shortest = shortest_mode(self.plan, options, self.start.time)
        contacts = bool(self.plan.assembly.own_equations.contacts)
        tries = contacts and not (self.segments or has_touched(self.plan.assembly))
        first = self._first_event() if tries else [np.inf]
        self._kept.is_undisturbed = not contacts or (tries and not first[0] < options.t_end)
        if tries and not self._kept.is_undisturbed:
            self._disturb()
        limit = min(schedule.next(t, options.t_end), self.sampler.next(t, options.t_end))
        ahead = self.samples.until(t, limit)
        if limit < options.t_end or (t < limit and self.sampler.due_at(limit)):  # the state just after it is shown
            ahead = ahead.without_last_shown()
        coming = self._moments(schedule)
        stretch = self.plan, self.probe, options, self.choice, ahead, self.show, self.statistics, self._kept
        segment = Segment(*stretch, coming)
        recorder = Recorder(self.plan)
        outcome = run_segment(segment, recorder, t, q, u)
        if (
            contacts and self._kept.is_undisturbed and goes_on(outcome, options.t_end)
        ):  # it was tried as without contacts
            self.statistics = self.statistics + outcome.statistics
            first[0] = outcome.t + _SURELY * (outcome.t - t)
            self._disturb()
            recorder = Recorder(self.plan)
            segment = replace(segment, plan=self.plan, probe=self.probe, spent=self.statistics)
            outcome = run_segment(segment, recorder, t, q, u)
        if recorder.is_empty and outcome.error is not None:  # not even the start could be projected
            raise outcome.error
        if recorder.is_empty:  # nor was there time to
            return recorder, outcome
        record = recorder.stretch(self.impact, after_time_event, self.rests)
        self.segments.append(self._sides.recorded(record, self.plan, self.assembly, bool(outcome.sides)))
        if options.conditions and self.probe is not None:
            self._sides_before = self.probe.sides_of_conditions(*recorder.last()[:3])
        self._follow(outcome)
        if contacts and outcome.error is None and options.looks_for_events:
            for assembly, t, y in outcome.closed:
                self._check_told(assembly, t, *recorder.plan.program.split(y))
            self._check_told(self.assembly, *recorder.last()[:3])
        return recorder, outcome

    def _meet_conditions(self) -> bool:
        """Tell of conditions that a jump of the state has met; return whether the run is to stop at one."""
        before, self._sides_before = self._sides_before, None
        if before is None or self.probe is None or self.ended is not None:
            return False
        told = self.probe.jumped(before, self.t, self.q, self.u)
        self.ended = next((one for one in told if one.target == "stop"), None)
        self.events += [one for one in told if one.target != "stop"]
        return self.ended is not None

    def _first_event(self) -> list[float]:
        """Return until when what touches nothing at the start is known to be disturbed; infinity where it is not."""
        options = self.options
        if options.max_steps is not None or options.conditions or options.on_step is not None:
            return [np.inf]
        steps = options.relative_tolerance, options.absolute_tolerance, options.max_step, options.first_step
        asked = options.solver, options.order, options.step, options.nominal
        state = self.t, self.q.tobytes(), self.u.tobytes()
        return self.assembly.kept.get(_FIRST_EVENT, lambda: [np.inf], *state, *steps, *asked)

    def _disturb(self) -> None:
        """Go on as where gaps and slips decide what happens."""
        assert self.plan is not None
        self._kept.is_undisturbed = False
        self.plan = self._whole(self.plan)
        if self.probe is None:
            options = self.options
            self.probe = EventProbe(self.plan, self.t, self.q, self.u, options.relative_tolerance, options.conditions)
            self.probe.follow(())

    def _follow(self, outcome: Outcome) -> None:
        """Take over what a stretch has changed and chosen."""
        assert self.plan is not None
        if outcome.passed is not None:
            self._passed(outcome.passed)
        elif outcome.held is not None and (outcome.held != self.held or outcome.begun is not None):
            # Sets of contacts have changed on the way, and perhaps the piece.
            self.held, self.assembly = outcome.held, self.assembly.with_held(outcome.held)
            self._piece_start = self._piece_start if outcome.begun is None else outcome.begun
            self.assembly = self._in_piece(self.assembly)
            self.plan, self.probe, self._plans = self.plan.in_piece(self.assembly), None, {}
        self.statistics = self.statistics + outcome.statistics
        for choice in outcome.choices:
            if not self.choices or not choice.is_like(self.choices[-1]):
                self.choices.append(choice)
        self.choice = outcome.choices[-1]
        if outcome.passed is not None and outcome.passed.error is not None:
            self.t = outcome.t
            raise outcome.passed.error

    def _moments(self, schedule: Schedule) -> Ahead | None:
        """Return the moments that steps may pass by themselves from here on; None where there are none."""
        assert self.plan is not None
        cannot = not self.t < self.options.t_end or not self.passes_moments or self.choice.method.tableau is None
        if cannot or not (len(schedule.times) or len(self.sampler.times)):
            return None
        if self.plan.assembly.own_equations.contacts and not self._kept.jumps(self.plan.assembly):
            return None
        from atwood.simulation.run.moments import Ahead, times_ahead

        times, end = times_ahead(self.plan, schedule, self.sampler, self.t, self.options), self.options.t_end
        if len(times) < 2:
            return None
        return Ahead(times, self.samples.until(self.t, end), schedule, self.sampler, self._made)

    def _passed(self, passed: Passed) -> None:
        """Take up where the run is that went through moments."""
        assert self.plan is not None
        self._piece_start, self.held = passed.begun, passed.held
        if self.held:  # before the piece, which has the discrete states of the scene as it is
            self.assembly = self.assembly.with_held(self.held)
        self.assembly = self._in_piece(self.assembly)
        self.plan, self.probe, self._plans = self.plan.in_piece(self.assembly), None, {}
        self.passes_moments = self.passes_moments and not passed.is_refused

    def _due(self) -> tuple[int, ...]:
        """Return which updates are still to be made now."""
        return self.sampler.due_at(self.t) if self.sampler.updates and self.t > self._sampled else ()

    def prepare(self) -> None:
        """Make all that is needed in the present mode, and between two time events, if it is not there."""
        with stage("preparation"), without_collection():
            self._prepare()

    def _prepare(self) -> None:
        options, plan, is_new = self.options, self.plan, self.plan is None
        if plan is None:
            plan = self._plan()
            has_states = bool(plan.assembly.own_equations.states or self.sampler.updates)
            if not self.segments and not options.structure and not has_states:
                refuse_immobile(self.assembly, len(plan.assembly.own_equations.speeds) - plan.finding.rank, self.start)
            self._plans, self.probe, self._handed = {}, None, ()
        if is_new and self.segments and plan.is_projected:  # what has no mass has the speed that the new mode holds
            self.q, self.u = _on_entering(plan, self.t, self.q, self.u)
        plan = self._settled(plan)
        t, q, u = self.t, self.q, self.u
        if self.segments:
            plan = self._whole(plan)
        if is_new:
            self.choice = choose(plan, options, t, q, u)
        sided = self._sides.on(self.assembly, plan, t, q, u)
        if sided is None:  # a relation stays where it changes
            self.plan = None
            return self._prepare()
        self.probe = self.probe if sided is plan else None
        plan = sided
        self._plans.setdefault(self._piece, plan)
        if self.probe is None:
            self.probe = EventProbe(plan, t, q, u, options.relative_tolerance, options.conditions)
        self.plan = plan
        self.probe.follow(self._handed)
        return None

    def _whole(self, plan: SceneProblem) -> SceneProblem:
        """Return a plan with the programs for all states of gaps and slips, where steps then change these."""
        asked = self.options.conditions or self.options.impacts == "one_by_one"
        if asked or not is_loose(plan.assembly) or self.choice.method.tableau is None:
            return plan
        from atwood.simulation.contacts.compiled import kept_whole

        self._kept.is_undisturbed = False
        whole = kept_whole(plan, self.t, self.q, self.u, self._kept.changes > MANY_CHANGES)
        if whole is plan or not self._kept.jumps(whole.assembly):
            return plan
        self.probe = None
        return whole

    def _settled(self, plan: SceneProblem) -> SceneProblem:
        """Return a plan with the states that gaps and slips have from now on, after impacts if there are any."""
        (triggers, late), self._unsettled, self._late = (self._unsettled, self._late), None, None
        if triggers is None or not plan.assembly.own_equations.contacts:
            return plan
        from atwood.simulation.contacts.changes import check_start
        from atwood.simulation.problem.explicit_scene import nearest_state, rates_on_constraints

        is_start = not self.segments
        if not self.options.looks_for_events:
            if is_start:
                check_start(plan.assembly, (self.t, self.q, self.u), self.start.length, plan.scales)
            return plan
        t, split, rest = self.t, plan.program.split, 0.0
        if late is not None:  # what happens does so at the zero of the event, and goes on from there
            rest, (q, u) = late[0], split(late[1])
            t, self.q, self.u = t - rest, self.q - rest * q, self.u - rest * u
        changed = self._becomes(plan, (t, self.q, self.u), triggers, is_start)
        events = list(changed.events)
        self._kept.changes += 1
        self._remember(events)
        self.ended = next((one for one in events if one.target == "stop"), None)
        told = [one for one in events if one is not self.ended]
        self.events += told if not is_start else [one for one in told if one.impact or one.kind == "opens"]
        self.impact |= any(one.impact for one in events)
        self.rests |= any(one.kind == "rests" for one in events)
        self.u, self.held = changed.speeds, changed.held
        if changed.touching and not is_start:  # what is found to be closed is so to rounding
            met = self._sides.like(self.assembly.with_held(changed.touching), plan)
            self.q, _ = nearest_state(plan.in_piece(met), t, self.q, self.u)
        self.assembly = self.assembly.with_held(self.held)
        self.probe, self._plans, self._handed = None, {}, ()
        made = plan.in_piece(self._sides.like(self.assembly, plan))
        self._check_told(made.assembly, t, self.q, self.u)
        if rest:
            q, u = split(rates_on_constraints(made, self.t, self.q, self.u))
            self.q, self.u = self.q + rest * q, self.u + rest * u
        return made

    def _check_told(self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> None:
        """Refuse places whose forces formulas do not give, once for each set that holds."""
        if assembly.held_now in self._told:
            return
        self._told.add(assembly.held_now)
        error = 10.0 * self.options.relative_tolerance if self.segments else 0.0
        about = assembly.shared, assembly.relation_values, assembly.held_now, t, q.tobytes(), u.tobytes(), error
        if about not in self._kept.told:
            from atwood.simulation.contacts.told_forces import check_told_forces

            check_told_forces(assembly, (t, q, u), self.start.length, error)
            self._kept.told.add(about)

    def _becomes(
        self,
        plan: SceneProblem,
        state: tuple[float, FloatArray, FloatArray],
        triggers: Sequence[EventRecord],
        is_start: bool,
    ) -> Changed:
        """Return what becomes of gaps and slips now, by the routine of the steps if there is one; kept at a start."""
        from atwood.simulation.contacts.changes import resolve
        from atwood.simulation.contacts.static_limits import check_static_limits

        relative, one_by_one = self.options.relative_tolerance, self.options.impacts == "one_by_one"

        def find() -> Changed:
            if is_start:
                check_static_limits(self.assembly, state, self.start.length)
            whole, found = plan.in_piece(kept_touching(plan.assembly)), None
            jumps = None if one_by_one else self._kept.sets(whole, state, None if is_start else self.choice.method)
            if jumps is not None:
                from atwood.simulation.contacts.compiled import resolved

                found = resolved(jumps, whole, state, relative, triggers, self._impacts, is_start, self.t)
            given = self.start.length, plan.scales, relative, triggers, one_by_one, self._impacts, is_start, self.t
            return found or resolve(self.assembly, state, *given)

        about = state[0], *(one.tobytes() for one in state[1:]), plan.scales, relative, one_by_one
        return self.assembly.kept.get(_AT_START, find, *about) if is_start else find()

    def _remember(self, events: Sequence[EventRecord | ToldLater]) -> None:
        """Remember the impacts among some events."""
        for one in events:
            if isinstance(one, ToldLater):
                self._impacts += one.strikes()
            elif one.kind == "impact":
                self._impacts.append((one.time, one.part))
        del self._impacts[:-LAST]

    def _plan(self) -> SceneProblem:
        assembly = self._sides.in_pieces(self.assembly, self.t, self.q, self.u)
        span = self.options.t_end - self.start.time
        plan = problem_of_run(assembly, self.t, self.q, self.u, self.start.length, span)
        if not assembly.own_equations.contacts:
            return plan
        from atwood.simulation.contacts.values import with_own_sizes

        return with_own_sizes(plan, self.t, self.q, self.u)

    def _schedule(self, assembly: Assembly) -> Schedule:
        """Return the time events of a scene in one mode."""
        if assembly.shared not in self._schedules:
            moments = np.union1d(self.samples.own, self.sampler.times) if len(self.sampler.times) else self.samples.own
            schedule = find_schedule(assembly, self.start.time, self.options.t_end).at_samples(moments)
            self._schedules[assembly.shared] = schedule
        return self._schedules[assembly.shared]

    def _in_piece(self, assembly: Assembly) -> Assembly:
        """Return a scene with the relations of functions of time that hold in the present piece of the run."""
        schedule = self._schedule(assembly)
        found = schedule.applied(assembly, schedule.piece(self._piece_start))
        is_it = found is self.assembly and found.held is not None
        return found.with_held_of(self.assembly) if self.held and not is_it else found

    @property
    def _piece(self) -> tuple[tuple[float, ...], tuple[float, ...] | None]:
        """What tells the parameters of pieces of a run apart."""
        return self.assembly.relation_values, self.assembly.held

    def _reassemble(
        self, modes: Mapping[str, str], line_signs: Mapping[tuple[str, str, str], float], orientation: Orientation
    ) -> Assembly:
        return self._in_piece(self._other(modes, line_signs, orientation))

    def _pass_time_event(self) -> None:
        """Go on with the relations of functions of time that hold after a time event."""
        self._piece_start, before, self._unsettled = self.t, self.assembly, ()
        self.assembly = self._in_piece(before)
        self.show = self.samples.shows(self.t)
        self._jump(before, show_both=True)
        if self.plan is not None:
            self.probe = None
            known = self._plans.get(self._piece)
            self.plan = self.plan.in_piece(self._sides.like(self.assembly, self.plan)) if known is None else known
            self.assembly = self.assembly if self.plan.assembly.sides else self.plan.assembly
            self.plan.review_partitioning(self.t, self.q)

    def _update(self, due: Sequence[int]) -> None:
        """Go on with what updates make of the state."""
        self.take(self._made(due, self.assembly, self.t, self.q, self.u))

    def take(self, made: Updated) -> None:
        """Go on with other discrete states."""
        before, self._unsettled = self.assembly, ()
        self.q, self.held = made.coordinates, made.held
        self.assembly = before.with_held(self.held) if self.held else before
        self.show = True  # as after any event: values that are held jump
        self._jump(before)
        if self.plan is not None:
            self.probe, self._plans = None, {}
            self.plan = self.plan.in_piece(self._sides.like(self.assembly, self.plan))

    def _made(self, due: Sequence[int], assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> Updated:
        """Return what updates make of a state, or have made of it before."""
        if self.sampler.is_pure:
            return self.sampler.call(due, assembly, t, q, u)
        known = self._known or ()
        made = known[len(self.log)] if len(self.log) < len(known) else self.sampler.call(due, assembly, t, q, u)
        self.log.append(made)
        return made

    def _jump(self, before: Assembly, show_both: bool = False) -> None:
        """Go on where prescribed motions switch: velocities may jump, and one-sided constraints let go."""
        from atwood.simulation.events.impacts_in_time import jumped

        state, now = (self.t, self.q, self.u), self.assembly
        self.assembly, self.q, self.u, events = jumped(before, now, state, self.start.length, self._reassemble)
        if any(one.target for one in events):
            show_both = True
            self.ended = next((one for one in events if one.target == "stop"), None)
            self.plan = self.plan if self.ended else None
        self.events += [] if self.ended else events
        self.impact |= any(one.impact for one in events)
        self.show |= bool(events)
        if self.segments and events and show_both:  # as at any event
            self.segments[-1].shown[-1] = True

    def _switch_coordinates(self, event: EventRecord, recorder: Recorder) -> None:
        """Go on in other coordinates of an orientation."""
        _, q, self.u, _ = recorder.last()
        self.assembly, self.q = switch_coordinates(self.assembly, to_regular(self.assembly, q), self._reassemble)
        self.plan, self.impact, self.rests, self.show, self._unsettled = None, False, False, False, ()
        self.coordinate_switches.append(CoordinateSwitch(self.t, event.part))

    def _enter(self, outcome: Outcome, recorder: Recorder) -> None:
        """Enter the mode that an event leads to; states change by all events that happen together."""
        _, q, u, _ = recorder.last()
        event = outcome.event
        assert event is not None
        self.impact, self.rests, self.show = event.impact, False, event.target != SIDE
        self._unsettled = ()
        if event.target in CONTACT:
            self.q, self.u, self.probe = q, u, None
            self._unsettled = tuple(one for one in (event, *outcome.together) if one.target in CONTACT)
            self._late = outcome.late
        elif event.target in (UPDATE, SIDE):
            self.q, self.u, self.probe = q, u, self.probe if event.target == UPDATE else None
        else:
            from atwood.simulation.events.mode_change import enter_mode

            state = self.t, q, u
            self.assembly, self.q, self.u = enter_mode(state, self.assembly, event, self._reassemble, self.start.length)
            self.plan = None
        if due := {i for one in (event, *outcome.together) for i in self.sampler.due_after(one.part, one.law)}:
            self._update(sorted(due))

    def _finished_run(self, status: str, message: str, outcome: Outcome) -> Run:
        """Return the run, or raise with it what made it fail."""
        if outcome.error is not None:
            message = outcome.error.message
        made = self.run_so_far(status, message)
        if status == "failed":
            error = outcome.error or failed(message, self.assembly.flat.name, self.t > self.start.time)
            error.run = made  # type: ignore[attr-defined]
            raise error
        return made

    def run_so_far(self, status: str, message: str) -> Run:
        """Return what has been made of it."""
        parts = (self.first, tuple(self.segments), tuple(self.events), self.statistics, status, message)
        return Run(*parts, self.start, self.options, tuple(self.choices), tuple(self.coordinate_switches), self.again)
