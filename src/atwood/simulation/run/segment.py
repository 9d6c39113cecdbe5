"""One stretch of a run: from a state in one mode to a time, an event, a limit or a failure."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from atwood.clock import TimeIsUp, check_time, more_time, time_left
from atwood.errors import SolveError
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.protocol import Advance, Budget, FloatArray, Session, Statistics, Status
from atwood.late import dataclass
from atwood.simulation.dynamics.orientation_coordinates import CHART, Restated, longest_step, restated
from atwood.simulation.dynamics.redundancy import RankFinding
from atwood.simulation.dynamics.undefined_values import find_missing, states_ahead
from atwood.simulation.events.modes import EventProbe, Happening
from atwood.simulation.problem.options import RunOptions, Samples
from atwood.simulation.problem.problem import Plan, pack_state
from atwood.simulation.problem.projection import project_safely
from atwood.simulation.run.choice import Choice, stiffness_of, turned_stiff
from atwood.simulation.run.record import Recorder
from atwood.simulation.run.session import Order, open_explicit_session, open_implicit_session
from atwood.simulation.run.stuck import explain_stuck
from atwood.simulation.run.tolerances import too_tight
from atwood.simulation.singular.crossing import Passage, events_on
from atwood.simulation.singular.monitor import Guard, guard_of

__all__ = ["Outcome", "Stretch", "run_stretch"]

_BLOCKS = 50
"""Progress is told about so many times."""


@dataclass(frozen=True, eq=False)
class Stretch:
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
    """

    plan: Plan
    probe: EventProbe
    options: RunOptions
    choice: Choice
    samples: Samples
    first_shown: bool
    spent: Statistics

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
        Why: ``"finished"``, ``"event"``, or as in `atwood.simulation.run.run.Run`.
    statistics
        What it cost.
    happening
        The event that ended it.
    choices
        What solved it, one after the other.
    error
        What went wrong, where that names a part.
    restated
        Orientations that went on in other coordinates.
    """

    t: float
    status: str
    message: str
    statistics: Statistics
    choices: tuple[Choice, ...]
    happening: Happening | None = None
    error: SolveError | None = None
    restated: tuple[Restated, ...] = ()


def run_stretch(stretch: Stretch, recorder: Recorder, t: float, q: FloatArray, u: FloatArray) -> Outcome:
    """Integrate in one mode until a time, an event or a limit of the run.

    Parameters
    ----------
    stretch
        What it is to be.
    recorder
        Takes up the samples.
    t, q, u
        The state at its start.
    """
    plan = stretch.plan
    n = plan.program.coordinates
    with more_time():  # so that there is its start, whatever comes
        y, yp = (np.zeros(0), np.zeros(0)) if n == 0 else pack_state(plan, t, q, u)
        recorder.take(t, y, stretch.first_shown)
    already = stretch.probe.broken_at_start(t)
    if already is not None:
        return Outcome(t, "event", "", Statistics(), (stretch.choice,), already)
    if n == 0:
        return _follow(stretch, recorder, t)
    return _Runner(stretch, recorder).run(t, y, yp)


def _follow(stretch: Stretch, recorder: Recorder, t: float) -> Outcome:
    """Go through a mode in which nothing is free to move: its state is a function of time, its events still happen."""
    nothing, last, options = np.zeros(0), t, stretch.options
    try:
        for moment, show in zip(stretch.samples.times, stretch.samples.shown, strict=True):
            check_time()
            happening = stretch.probe.between(last, float(moment))
            if happening is not None:
                recorder.take(happening.time, nothing, True)
                return Outcome(happening.time, "event", "", Statistics(), (stretch.choice,), happening)
            last = float(moment)
            recorder.take(last, nothing, bool(show))
            if options.progress is not None:
                options.progress(last)
    except TimeIsUp:
        last = recorder.close()
        return Outcome(last, "time_limit", options.out_of_time(last), Statistics(), (stretch.choice,))
    return Outcome(last, "finished", "", Statistics(), (stretch.choice,))


class _Runner:
    """The way through one stretch, with whatever solves it."""

    def __init__(self, stretch: Stretch, recorder: Recorder) -> None:
        self.stretch, self.recorder = stretch, recorder
        self.choices = [stretch.choice]
        self.before = Statistics(error_test_failures=0, convergence_failures=0)
        self.session: Session | None = None
        self.guard: Guard | None = None
        self.order: Order | None = None
        self.restated: list[Restated] = []

    def run(self, t: float, y: FloatArray, yp: FloatArray) -> Outcome:
        """Go from sample to sample; change the solver where the scene turns out stiff."""
        self.began, done = t, 0
        try:
            session = self._open(t, y, yp)
            while True:
                if isinstance(session, ExplicitSession):
                    done, advance = self._sample(session, done)
                else:
                    done, advance = self._advance(session, done)
                    session = self.session or session
                if advance is not None and advance.status is Status.STIFF:
                    session = self._open(*self._change_solver(advance))
                elif advance is None or not self._restates(session, advance):
                    break
            return self._outcome(advance)
        except KeyboardInterrupt:  # from the progress function, or between two steps; what is there already is kept
            t = self.recorder.close()
            return self._ended(t, "interrupted", f"interrupted (at t = {t:.9g})")
        except TimeIsUp:
            return self._out_of_time()
        except SolveError as error:  # from a state that cannot be projected
            return replace(self._ended(self.recorder.end, "failed", error.message), error=error)

    def _out_of_time(self) -> Outcome:
        t = max(self.recorder.close(), self.began)
        return self._ended(t, "time_limit", self.stretch.options.out_of_time(t))

    def _ended(self, t: float, status: str, message: str) -> Outcome:
        return Outcome(t, status, message, self._cost(), tuple(self.choices), restated=tuple(self.restated))

    def _cost(self) -> Statistics:
        cost = self.before if self.session is None else self.before + self.session.statistics
        return cost if self.guard is None else replace(cost, seconds=cost.seconds + self.guard.seconds)

    def _outcome(self, advance: Advance | None) -> Outcome:
        """Record where a solver stopped early, if it did."""
        if advance is None:
            self.recorder.settle()
            return self._ended(self.stretch.end, "finished", "")
        if advance.status is Status.EVENT:
            happening = self.stretch.probe.name(advance.t, advance.events)
            if happening.target != CHART:
                self.recorder.take(advance.t, advance.y, True)
            elif advance.t > self.recorder.end:
                stretch = self.stretch
                self.recorder.take(
                    advance.t, advance.y, bool(np.any(stretch.samples.shown[stretch.samples.times == advance.t]))
                )
            return replace(self._ended(advance.t, "event", ""), happening=happening)
        if advance.t > self.recorder.end:
            self.recorder.take(advance.t, advance.y, True)
        if advance.status is Status.TIME_LIMIT:
            return self._out_of_time()
        message = advance.message
        if advance.status is Status.STEP_LIMIT:
            message = self.stretch.options.out_of_steps(advance.t)
        ended = self._ended(advance.t, advance.status.value, message)
        return ended if advance.status is not Status.FAILED else replace(ended, error=self._explain(advance))

    def _restates(self, session: Session, advance: Advance) -> bool:
        """After an event, go on in other coordinates of an orientation, if that is all that has happened."""
        stretch = self.stretch
        plan = stretch.plan
        if advance.status is not Status.EVENT or stretch.probe.name(advance.t, advance.events).target != CHART:
            return False
        q, u = (part.copy() for part in plan.program.split(advance.y))
        q, bodies = restated(plan.assembly, q)
        if not bodies:
            return False
        if plan.is_projected:
            q, u = plan.balance.project(advance.t, q, u, plan.sizes)
        if isinstance(session, ExplicitSession):
            session.limit_steps(longest_step(plan.assembly.equations, u))
            session.reinitialize(advance.t, np.concatenate([q, u]))
        else:
            y, yp = pack_state(plan, advance.t, q, u)
            session.reinitialize(advance.t, y, yp)
            if self.guard is not None:
                self.guard.restart(Advance(advance.t, y, yp, Status.REACHED))
        self.restated += [Restated(advance.t, body) for body in bodies]
        return True

    def _explain(self, advance: Advance) -> SolveError | None:
        """Return an error that names what has no value, or a singular position; None where it is neither."""
        program, assembly, options = self.stretch.plan.program, self.stretch.plan.assembly, self.stretch.options
        now, rates = program.split(advance.y), program.split(advance.yp)
        states = states_ahead(advance.t, now, rates, options.t_end - self.stretch.choice.time)
        found = find_missing(assembly, *states)
        if found is None:
            stuck = None if self.guard is None else self.guard.explain(advance.message)
            tight = None if stuck or self.order is None else too_tight(self.order, self.choices[-1].solver, advance)
            return stuck or tight or explain_stuck(self.stretch.plan, advance)
        return SolveError(
            f"{found.describe()}, so that the run cannot go on: {advance.message}",
            where=found.part,
            advice="A law is evaluated where it has no value: look at its formula, and at what the scene does before "
            "(the error's `run`).",
        )

    def _open(self, t: float, y: FloatArray, yp: FloatArray) -> Session:
        stretch, choice = self.stretch, self.choices[-1]
        options, spent = stretch.options, stretch.spent + self.before
        order = Order(
            stretch.plan,
            stretch.probe,
            options,
            stretch.end,
            Budget(
                max_steps=None if options.max_steps is None else max(0, options.max_steps - spent.steps),
                wall_seconds=None if options.max_seconds is None else max(0.0, time_left()),
                poll=_both(stretch.plan.poll(choice.solver), options.on_step),
            ),
        )
        if choice.solver.startswith("ida"):
            here = Advance(t, y, yp, Status.REACHED)
            self.order = order
            self.guard = guard_of(stretch.plan, options.relative_tolerance, stretch.end, here)
            self.session = open_implicit_session(order, choice.solver, t, y, yp)
        else:
            leave = self._is_stiff if options.solver == "auto" else None
            self.session = open_explicit_session(order, choice.solver, t, y, leave)
        return self.session

    def _is_stiff(self, t: float, y: FloatArray) -> bool:
        plan = self.stretch.plan
        found = stiffness_of(plan, self.stretch.options, t, *plan.program.split(y))
        if found is None or not found.is_stiff:
            return False
        self.choices.append(turned_stiff(t, found))
        return True

    def _change_solver(self, advance: Advance) -> tuple[float, FloatArray, FloatArray]:
        """Return the state from which another solver goes on."""
        self.before, self.session = self._cost(), None
        self.choices[-1] = replace(self.choices[-1], time=advance.t)
        plan = self.stretch.plan
        return advance.t, *pack_state(plan, advance.t, *plan.program.split(advance.y))

    def _sample(self, session: ExplicitSession, done: int) -> tuple[int, Advance | None]:
        """Let an explicit method fill tables; return how many samples are done, and why it stopped early."""
        stretch, progress = self.stretch, self.stretch.options.progress
        turning = stretch.plan.balance.turning
        whole = progress is None and not turning.can_stray
        samples = stretch.samples
        ends = samples.ends_of_blocks(1 if whole else _BLOCKS)
        while done < len(samples.times):
            times = samples.times[done : ends[np.searchsorted(ends, done, side="right")]]
            y, _, advance = session.sample(times)
            count = len(y)
            self.recorder.take_many(times[:count], y, stretch.samples.shown[done : done + count])
            done += count
            if advance.status is not Status.REACHED:
                return done, advance
            q, u = stretch.plan.program.split(y[-1])
            if turning.strays(q):
                session.reinitialize(float(times[-1]), np.concatenate([turning.normalized(q), u]))
            if progress is not None:
                progress(float(times[-1]))
        return done, None

    def _advance(self, session: Session, done: int) -> tuple[int, Advance | None]:
        """Go from sample to sample; return how many are done, and why it stopped early."""
        stretch, recorder, progress = self.stretch, self.recorder, self.stretch.options.progress
        samples = stretch.samples
        times, shown, extra = (x.tolist() for x in (samples.times, samples.shown, samples.between))
        plan, told = stretch.plan, -np.inf
        looks = plan.is_projected or bool(plan.dependent_speeds) or not plan.balance.turning.is_plain
        while done < len(times):
            moment, guard = times[done], self.guard
            between = guard is not None and guard.next < moment
            target = guard.next if guard is not None and between else moment
            advance = session.advance(target)
            if advance.status is Status.FAILED and self._chose_anew(session, advance):
                advance = session.advance(target)
            turned = self._turned(advance) if between or guard is None else None
            at_end = moment >= stretch.end or turned is not None
            passage = None if guard is None else guard.look(advance, between, at_end)
            if passage is not None:
                done, stopped = self._pass_over(session, passage)
                if stopped is not None:
                    return done, stopped
                continue
            if guard is not None and guard.agreed:
                recorder.note(guard.agreed)
                for one in guard.agreed:
                    if one.path is None:
                        warnings.warn(one.describe(), stacklevel=2)
                guard.agreed.clear()
            if advance.status is not Status.REACHED:
                return done, advance
            if turned is not None:
                session = self._keep(turned, advance)
            if between:
                continue
            recorder.take(advance.t, advance.y, shown[done])
            done += 1
            if looks and not extra[done - 1]:
                plan.review_output(advance.t, advance.y[: plan.program.coordinates])
                self._repair(session, advance)
            if progress is not None and moment > told:
                told = moment
                progress(moment)
        return done, None

    def _pass_over(self, session: Session, passage: Passage) -> tuple[int, Advance | None]:
        """Take a passage into the record and go on behind it, unless something happens on its way."""
        stretch, plan, path = self.stretch, self.stretch.plan, passage.path
        assert path is not None
        times = stretch.samples.times
        root = events_on(path, plan, stretch.probe)
        end = path.end if root is None else min(path.end, root.state[0])
        first, done = (int(np.searchsorted(times, one, side="right")) for one in (path.start, end))
        self.recorder.pass_over(passage, times[first:done], stretch.samples.shown[first:done])
        if root is not None and root.state[0] <= stretch.end:
            return done, Advance(*root.state, Status.EVENT, root.events)
        if done < len(times):
            q, u, _ = (one[:, 0] for one in path.at(np.array([path.end])))
            q, u = project_safely(plan, path.end, q, u)
            plan.review_dependent(path.end, q)
            y, yp = pack_state(plan, path.end, q, u)
            session.reinitialize(path.end, y, yp)
            assert self.guard is not None
            self.guard.restart(Advance(path.end, y, yp, Status.REACHED), is_behind=True)
        return done, None

    def _chose_anew(self, session: Session, advance: Advance) -> bool:
        """After a failure, go on with other dependent coordinates if those were a poor choice."""
        plan = self.stretch.plan
        q, u = (part.copy() for part in plan.program.split(advance.y))
        if not plan.review_dependent(advance.t, q):
            return False
        q, u = plan.balance.project(advance.t, q, u, plan.sizes)
        session.reinitialize(advance.t, *pack_state(plan, advance.t, q, u))
        return True

    def _turned(self, advance: Advance) -> RankFinding | None:
        """Return which constraints are better kept from here on, if those that are have become a poor choice."""
        plan = self.stretch.plan
        q, _ = plan.program.split(advance.y)
        return plan.better_kept(advance.t, q) if advance.status is Status.REACHED else None

    def _keep(self, finding: RankFinding, advance: Advance) -> Session:
        """Go on with other constraints kept, from the same state."""
        plan = self.stretch.plan
        q, u = (part.copy() for part in plan.program.split(advance.y))
        if plan.is_projected:
            q, u = project_safely(plan, advance.t, q, u)
        self.before, self.session = self._cost(), None
        plan.keep(finding, advance.t, q)
        return self._open(advance.t, *pack_state(plan, advance.t, q, u))

    def _repair(self, session: Session, advance: Advance) -> None:
        """Go on from the recorded state where the solver's own has strayed.

        At index 1 with projection that is where the drift outgrows the error of the steps; for any orientation, where
        the size of its coordinates is no longer near one.
        """
        plan = self.stretch.plan
        strays = plan.balance.turning.strays(plan.program.split(advance.y)[0])
        if plan.program.level != "index1-projected" and not strays:
            return
        _, q, u, held = self.recorder.last()
        if strays or np.max(held) > 100.0 * self.stretch.options.relative_tolerance:
            session.reinitialize(advance.t, *pack_state(plan, advance.t, q, u))


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
