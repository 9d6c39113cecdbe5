"""From a scene in one mode and the options of a run to a solver at its start."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Hashable
from functools import cache
from operator import is_
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import is_loose
from atwood.integrators.explicit_session import ExplicitSession, OnStiff
from atwood.integrators.ida.guarded_residual import GuardedResidual
from atwood.integrators.methods import EXPLICIT, IDA, LEAST, TAYLOR, Method, Task, advise
from atwood.integrators.protocol import (
    Budget,
    ExplicitProblem,
    ImplicitProblem,
    LinearSolver,
    NativeCallbacks,
    SolverOptions,
    StepGuard,
)
from atwood.integrators.session import Session
from atwood.lazy_dataclasses import dataclass, replace
from atwood.simulation.contacts.groups import refuse_groups
from atwood.simulation.dynamics.orientation_coordinates import longest_step
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.problem.explicit_scene import (
    constrained_problem,
    explicit_problem,
    own_rates,
    own_rates_on_constraints,
    program_on_constraints,
    values_on_constraints,
)
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.step_guard import step_guard
from atwood.simulation.run.choice import solved_loops

if TYPE_CHECKING:
    from atwood.forms.loops.closed_form import ClosedForm
    from atwood.integrators.embedded.rates import CompiledAccelerations, OwnRates
    from atwood.integrators.protocol import CompiledRates
    from atwood.integrators.set_jumps import SetSolver
    from atwood.integrators.symplectic.stepper import Hamiltonian
    from atwood.integrators.taylor.stepper import TaylorProblem
    from atwood.simulation.problem.closed_loops import Solved


_MANY_IMPACTS = 3
"""From so many on it pays to compile what an impact does."""

MANY_CHANGES = 6
"""The same of the change of a set of contacts."""

OF_CONTACTS = 0.01
"""Of the tolerance, where gaps and slips decide how the motion goes on."""


@dataclass(frozen=True, eq=False)
class SolverRequest:
    """What is to be solved.

    Attributes
    ----------
    plan, probe
        The scene in its mode, and what is watched.
    options
        What the run was asked for.
    end
        Where this stretch ends at the latest, s.
    budget
        Limits.
    kept
        The session of an explicit method that the run has opened before.
    """

    plan: SceneProblem
    probe: EventProbe
    options: RunOptions
    end: float
    budget: Budget
    kept: KeptSession

    def guard(self, method: Method, closed: tuple[ClosedForm, FloatArray] | None = None) -> StepGuard | None:
        """Return what judges the steps of a method besides their error; see `step_guard`."""
        options, reach, is_estimated = self.options, method.reach, not method.has_equal_steps
        if not is_estimated and options.step is None:
            reach *= options.relative_tolerance ** (1.0 / (1 + (options.order or method.default_order)))
        span = self.plan.assembly.flat.t_start, options.t_end
        return step_guard(self.plan.assembly, span, reach, closed, is_estimated)

    def horizon(self, t: float) -> float:
        """Return a typical length of what is left of the run at a time, s."""
        return self.options.t_end - t if self.options.t_end > t else 1.0

    def settings(self, t: float, loosest: float = 1.0) -> SolverOptions:
        """Return the options of a solver that starts at a time, with no looser tolerance than it can hold."""
        options = self.options
        relative = min(options.relative_tolerance, loosest)
        if not self.kept.is_undisturbed:  # errors add up over impacts, and decide when the next one is
            relative, loosest = OF_CONTACTS * relative, OF_CONTACTS * loosest
        return SolverOptions(
            relative_tolerance=max(relative * self.plan.relative_share, LEAST),
            absolute_tolerances=self.plan.tolerances(
                min(options.absolute_tolerance or relative, loosest), options.nominal
            ),
            first_step=options.first_step,
            max_step=options.max_step,
            max_order=options.max_order,
            horizon=self.horizon(t),
        )


def open_session(
    request: SolverRequest,
    method: Method,
    t: float,
    y: FloatArray,
    yp: FloatArray,
    on_stiff: OnStiff | None = None,
    on_dead_centre: Callable[[float, FloatArray], None] | None = None,
    keeps_constraints: bool = False,
) -> Session:
    """Start a method."""
    plan = request.plan
    if not method.looks_for_events:
        return _open_time_stepping(request, method, t, y)
    refuse_groups(plan.assembly)
    if plan.assembly.own_equations.contacts and not method.keeps_constraints:
        raise UsageError(
            f"{method.title} does not end its steps on gaps that are closed and on what sticks",
            where=plan.assembly.own_equations.contacts[0].row.key[0],
            advice=advise(EXPLICIT, TAYLOR, IDA),
        )
    if method.is_implicit:
        return method.open(_implicit_task(request, method, t, y, yp))
    if plan.balance.constraints and not keeps_constraints:
        from atwood.simulation.run.closed_session import ClosedLoopSession

        solved = solved_loops(plan, t, *plan.program.split(y))
        if solved is not None:
            return ClosedLoopSession(request, method, t, y, solved, on_stiff, on_dead_centre)
    if method.keeps_constraints and (
        plan.balance.constraints or plan.assembly.form == "dae" or plan.assembly.own_equations.contacts
    ):
        session = _open_on_constraints(request, method, t, y, on_stiff)
    else:
        session = _open_tree(request, method, t, y, on_stiff)
    session.limit_steps(longest_step(plan.assembly.own_equations, plan.program.split(y)[1]))
    return session


def _open_time_stepping(request: SolverRequest, method: Method, t: float, y: FloatArray) -> Session:
    """Start a method whose steps look for no event."""
    from atwood.simulation.contacts.time_stepping import impulsive_problem

    options = request.options
    if options.step is None or options.order not in (None, *method.orders):
        raise UsageError(
            f"{method.title} takes a step, and is of order {method.orders[0]} where nothing touches",
            where=request.plan.assembly.flat.name,
            advice=f"Give step= in seconds, with solver={method.key!r}, and no other order.",
        )
    motion = impulsive_problem(request.plan, request.probe, t, y, options.step, options.impacts)
    settings = request.settings(t, method.loosest_tolerance)
    return method.open(Task(settings, t, y, budget=request.budget, end=request.end, impulsive=motion))


def _implicit_task(request: SolverRequest, method: Method, t: float, y: FloatArray, yp: FloatArray) -> Task:
    """Return a task with multipliers and rates among the unknowns."""

    def implicit(finds_events: bool) -> ImplicitProblem:
        problem = _implicit_problem(request)
        return _guarded(_with_events(problem, request.probe) if finds_events else problem, request, method)

    settings, angles = request.settings(t, method.loosest_tolerance), request.plan.angles
    return Task(settings, t, y, yp, request.budget, request.end, implicit=implicit, angles=angles)


def _implicit_problem(request: SolverRequest) -> ImplicitProblem:
    probe = request.probe
    return request.plan.problem(probe.function(), probe.directions, probe.rough, probe.handed)


def _guarded(problem: ImplicitProblem, request: SolverRequest, method: Method) -> ImplicitProblem:
    """Return a problem whose residual judges steps, if laws could slip through them."""
    guard, make = request.guard(method), problem.native
    if guard is None:
        return problem
    size = request.plan.program.coordinates + request.plan.program.speeds
    residual = GuardedResidual(problem.residual, guard, size)
    begins: list[Callable[[float, FloatArray, FloatArray], None]] = [residual.begin]

    def native(linear_solver: LinearSolver) -> NativeCallbacks:
        from atwood.integrators.ida.guarded_residual import guarded_residual

        assert make is not None
        made = make(linear_solver)
        address, block, begin, own = guarded_residual(
            (guard.function, guard.data), made.residual, made.user_data, made.data_bytes, size
        )
        begins[:] = [begin]
        keep = (made.keep, guard, block, own)
        return replace(made, residual=address, user_data=ctypes.addressof(block), data_bytes=0, keep=keep)

    def begin(t: float, y: FloatArray, yp: FloatArray) -> None:
        begins[0](t, y, yp)

    return replace(problem, residual=residual, native=None if make is None else native, begin=begin)


def _with_events(problem: ImplicitProblem, probe: EventProbe) -> ImplicitProblem:
    """Return a problem whose compiled functions, if it has any, look for events too."""
    make = problem.native
    found = None if problem.events is None or make is None else probe.compiled(for_ida=True)
    if found is None or make is None:
        return problem

    def native(linear_solver: LinearSolver) -> NativeCallbacks:
        made = make(linear_solver)
        if not made.data_bytes:
            return made
        block = found.joined(made.user_data, made.data_bytes)
        keep = (made.keep, found, block)
        return replace(
            made,
            user_data=ctypes.addressof(block),
            data_bytes=ctypes.sizeof(block),
            events=found.ida,
            restart_events=found.restart,
            has_noticed=found.has_noticed,
            watched=found,
            keep=keep,
        )

    return replace(problem, events=found.function(), native=native)


_SESSIONS_KEPT = 4

_SESSIONS: Key[list[Opened]] = Key("sessions of explicit methods")

_TOLD: Key[set[Hashable]] = Key("states at which forces by formulas have been compared")

_TOLD_KEPT = 1_000
"""So many are remembered."""


@dataclass(frozen=True, eq=False)
class Opened:
    """A session that can be begun again.

    Attributes
    ----------
    objects, values
        What it was opened with: compared by identity, and as values.
    session
        The session.
    fill
        Gives its functions the parameters of a request.
    """

    objects: tuple[object, ...]
    values: tuple[object, ...]
    session: ExplicitSession
    fill: Callable[[SolverRequest], None]


class KeptSession:
    """The sessions of an explicit method, which are begun again where only values of parameters have changed.

    So a run that stops at sample times opens one session, not one for each, and a run with contacts one for where
    something touches and one for where nothing does; and the next run of the assembly goes on with them. One run at a
    time has them.

    Parameters
    ----------
    assembly
        The scene of the run; None where its sessions are its own.

    Attributes
    ----------
    kept
        The sessions.
    told
        States at which forces by formulas have been compared, in this run and those before it.
    impacts
        Times and parts of the impacts so far, to which steps may add; None where each is looked at.
    is_undisturbed
        Whether there are no gaps and slips, or nothing is to happen at them.
    """

    impacts: list[tuple[float, str]] | None = None
    is_undisturbed: bool = True
    changes: int = 0
    shortest: float = 0.0

    def __init__(self, assembly: Assembly | None = None) -> None:
        self._assembly = assembly
        self._solvers: list[tuple[tuple[object, ...], SetSolver]] = []
        self.kept: list[Opened] = (None if assembly is None else assembly.kept.take(_SESSIONS)) or []
        self.told: set[Hashable] = set() if assembly is None else assembly.kept.get(_TOLD, set)

    def hand_back(self) -> None:
        """Leave the sessions to the next run; logs of their jumps have been copied."""
        if len(self.told) > _TOLD_KEPT:
            self.told.clear()
        if self._assembly is not None and self.kept:
            self._assembly.kept.get(_SESSIONS, lambda: self.kept)

    def jumps(self, assembly: Assembly) -> bool:
        """Whether steps are to make impacts, or changes of a set of contacts, by themselves."""
        if self.impacts is None or self.is_undisturbed or not assembly.own_equations.contacts:
            return False  # what is tried as without contacts ends at the first event, and is made anew
        return self._are_many(assembly)

    def _are_many(self, assembly: Assembly) -> bool:
        """Return whether there are so many changes, or so few rows, that the routine of sets pays."""
        from atwood.simulation.contacts.compiled import FEW_ROWS  # few scenes have any

        many = len(self.impacts or ()) >= _MANY_IMPACTS or self.changes >= MANY_CHANGES
        return many or len(assembly.own_equations.contacts) <= FEW_ROWS

    def filling_of(self, session: Session | None) -> Filling | None:
        """Return what gives a session its parameters; None where it is not kept."""
        found = next((one.fill for one in self.kept if one.session is session), None)
        return found if isinstance(found, Filling) else None

    def rates_of(self, session: Session) -> CompiledRates | None:
        """Return the rates of a session, which has them alone; None where it is not kept, or formulas solve loops."""
        filling = self.filling_of(session)
        return None if filling is None else filling.own.rates

    def sets(
        self, plan: SceneProblem, state: tuple[float, FloatArray, FloatArray], method: Method | None
    ) -> SetSolver | None:
        """Return what finds sets for a plan: the changes of its session, or where steps make none, a routine alone.

        None where there is none, and where nothing is opened for what begins: there is no method yet. Sessions of runs
        before change no set that the first run left to Python: a run that is made again is the same to the last digit.
        """
        if not self._are_many(plan.assembly):
            return None
        own = plan.assembly.shared, plan.program, plan.scales, plan.sizes, plan.finding
        for one in self.kept:
            jumps = one.fill.problem.jumps if isinstance(one.fill, Filling) else None
            _, shared, _, *objects = one.objects
            if jumps is not None and all(map(is_, (shared, *objects), own)):
                from atwood.integrators.set_jumps import SetJumps

                if isinstance(jumps, SetJumps):
                    return jumps
        if method is None or method.tableau is not None or not self.jumps(plan.assembly):
            return None
        known = next((found for objects, found in self._solvers if all(map(is_, objects, own))), None)
        if known is None:
            from atwood.simulation.contacts.compiled import solver_of

            known = solver_of(plan, state[0], np.concatenate(state[1:]))
            if known is not None:
                self._solvers.append((own, known))
        return known

    def begin_again(
        self, request: SolverRequest, method: Method, t: float, y: FloatArray, on_stiff: OnStiff | None, *more: object
    ) -> ExplicitSession | None:
        """Return the session at the start of another segment; None where none was opened for it, and for more."""
        objects, values = _opened_with(request, method, on_stiff) if self.kept else ((), ())
        objects = *objects, *more
        for one in self.kept:
            is_same = len(one.objects) == len(objects) and all(map(is_, one.objects, objects))
            if is_same and one.values == values:
                one.fill(request)
                session, signs = one.session, request.probe.handed
                session.begin_again(t, y, request.horizon(t), request.budget, on_stiff, request.end, signs=signs)
                return session
        return None

    def keep(
        self,
        request: SolverRequest,
        method: Method,
        on_stiff: OnStiff | None,
        session: Session,
        fill: Callable[[SolverRequest], None],
        *more: object,
    ) -> None:
        """Keep a session for what comes next, with a few before it: those of other modes, and of other contacts."""
        assert isinstance(session, ExplicitSession)
        objects, values = _opened_with(request, method, on_stiff)
        self.kept[:] = [*self.kept[1 - _SESSIONS_KEPT :], Opened((*objects, *more), values, session, fill)]


def _opened_with(
    request: SolverRequest, method: Method, on_stiff: OnStiff | None
) -> tuple[tuple[object, ...], tuple[object, ...]]:
    """Return what sessions are told apart by, as objects and as values."""
    plan, options = request.plan, request.options
    scene = plan.assembly.shared, request.probe.code(for_ida=False)
    steps = options.relative_tolerance, options.absolute_tolerance, options.first_step, options.max_step, options.order
    asked = options.step, options.max_order, options.impacts, options.nominal, options.conditions
    told = is_loose(plan.assembly), on_stiff is None, request.kept.jumps(plan.assembly), request.kept.is_undisturbed
    seen = plan.program, plan.scales, plan.sizes, plan.finding, request.guard(method)
    return (method, *scene, *seen), (steps, asked, told)


def _can_be_kept(problem: ExplicitProblem, method: Method) -> bool:
    """Return whether a session can be begun again: nothing in Python belongs to the segment that it was opened for."""
    is_watched = problem.events is not None and problem.compiled_events is None
    is_judged = problem.guard is not None and not problem.guard.function
    return (method.tableau is not None or method.kind == "series") and not (is_judged or is_watched)


def _open_tree(request: SolverRequest, method: Method, t: float, y: FloatArray, on_stiff: OnStiff | None) -> Session:
    """Start a method on independent coordinates, and keep its session if that can be begun again."""
    kept, plan = request.kept, request.plan
    session = kept.begin_again(request, method, t, y, on_stiff)
    if session is not None:
        return session
    problem, assembly = _explicit_problem(request, method), plan.assembly
    is_kept = _can_be_kept(problem, method)
    own = own_rates(assembly) if is_kept and method.tableau is not None else None
    fill: Callable[[SolverRequest], None] | None
    fill = None if own is None else Filling(*own, problem, lambda one: one.assembly.parameter_values)
    if own is not None and fill is not None:
        fill(request)
        rates = own[1].rates
        problem = replace(problem, compiled=lambda: rates)
    series, canonical = equations_of(request, problem, (t, y))
    settings = request.settings(t, method.loosest_tolerance)
    task = Task(
        settings,
        t,
        y,
        budget=request.budget,
        end=request.end,
        on_stiff=on_stiff,
        explicit=problem,
        series=series,
        hamiltonian=canonical,
    )
    if is_kept and method.kind == "series":
        recurrences = series()
        task = replace(task, series=lambda: recurrences)
    opened = method.open(task)
    if is_kept and method.kind == "series":
        assert isinstance(opened, ExplicitSession)
        fill = FillingOfSeries(recurrences, problem, opened)
    if fill is not None:
        kept.keep(request, method, on_stiff, opened, fill)
    return opened


@dataclass(frozen=True, eq=False)
class FillingOfSeries:
    """What gives the recurrences of a session, and its events if there are any, the parameters of a request.

    Attributes
    ----------
    series
        The recurrences.
    problem, session
        What the session was opened for, and the session.
    values
        The parameters of the recurrences, and of the projection.
    onto
        The projection onto constraints; None where there are none.
    """

    series: TaylorProblem
    problem: ExplicitProblem
    session: ExplicitSession
    values: Callable[[SceneProblem], FloatArray] = lambda plan: plan.assembly.parameter_values
    onto: tuple[CompiledAccelerations, OwnRates] | None = None

    def __call__(self, request: SolverRequest) -> None:
        """Give them the parameters of a request, and the time beyond which no step goes."""
        (code, derived), values = self.series.compiled(), self.values(request.plan)
        derived[:] = code.bind(values)
        if self.onto is not None:
            rates, own = self.onto
            rates.fill(own, values)
        self.session.stop_at(request.end)
        _fill_events(self.problem, request)


def _fill_events(problem: ExplicitProblem, request: SolverRequest) -> None:
    """Give the events of a session the parameters of a request."""
    events = problem.compiled_events
    found = None if events is None else request.probe.code(for_ida=False)
    if found is not None and events is not None:
        found.fill(events, request.plan.assembly.parameter_values, request.probe.shift)


@dataclass(frozen=True, eq=False)
class Filling:
    """What gives the functions of a session, its rates and events if there are any, the parameters of a request.

    Attributes
    ----------
    code, own
        The rates.
    problem
        What the session was opened for.
    values
        The parameters of the rates.
    """

    code: CompiledAccelerations
    own: OwnRates
    problem: ExplicitProblem
    values: Callable[[SceneProblem], FloatArray]

    def __call__(self, request: SolverRequest) -> None:
        """Give them the parameters of a request."""
        self.code.fill(self.own, self.values(request.plan))
        jumps = self.problem.jumps
        if jumps is not None:
            from atwood.integrators.set_jumps import SetJumps
            from atwood.simulation.contacts.bounces import fill_bounces
            from atwood.simulation.contacts.compiled import fill_sets

            plan, options, past = request.plan, request.options, request.kept.impacts or ()
            if isinstance(jumps, SetJumps):
                fill_sets(jumps, plan, request.probe, options.relative_tolerance, past, request.kept.shortest)
            else:
                fill_bounces(jumps, plan, request.probe, options.relative_tolerance, past)
        _fill_events(self.problem, request)


def equations_of(
    request: SolverRequest,
    problem: ExplicitProblem,
    start: tuple[float, FloatArray],
    solved: Solved | None = None,
) -> tuple[Callable[[], TaylorProblem], Callable[[], Hamiltonian]]:
    """Return the equations of a task as series and as Hamilton's, made where a method asks for them."""
    assembly, options = request.plan.assembly, request.options
    found = () if solved is None else (solved.form.accelerations.program, solved.values)
    if problem.project is not None:
        found = program_on_constraints(request.plan, *start).accelerations, values_on_constraints(request.plan)

    def series() -> TaylorProblem:
        from atwood.simulation.problem.taylor_scene import taylor_problem

        return taylor_problem(assembly, request.end, problem.event_count > 0, *found)

    def canonical() -> Hamiltonian:
        from atwood.simulation.problem.gauss_scene import hamiltonian

        sizes = request.plan.tolerances(1.0, options.nominal)
        sizes = sizes if solved is None else solved.reduced(sizes)
        return hamiltonian(assembly, problem, start, sizes, (options.order, options.step), solved)

    return series, canonical


def _open_on_constraints(
    request: SolverRequest, method: Method, t: float, y: FloatArray, on_stiff: OnStiff | None
) -> Session:
    """Start a method whose steps end on the constraints, and keep its session if that can be begun again."""
    plan, probe, kept = request.plan, request.probe, request.kept
    plan.keep_better(t, plan.program.split(y)[0])
    session = kept.begin_again(request, method, t, y, on_stiff)
    plan.has_rates = not plan.not_compilable
    if session is not None:
        return session
    problem = constrained_problem(plan, t, y, probe.function(), probe.directions)
    settings = request.settings(t, method.loosest_tolerance)
    absolute = np.asarray(settings.absolute_tolerances)[: len(y)]
    settings = replace(settings, absolute_tolerances=absolute)
    explicit = _watched(request, problem, method)
    is_kept = _can_be_kept(explicit, method)
    own = own_rates_on_constraints(plan, t, y) if is_kept else None
    rates = None if own is None else own[1].rates
    is_pair = method.tableau is not None
    if own is not None and is_pair and explicit.compiled_events is not None and kept.jumps(plan.assembly):
        from atwood.simulation.contacts.bounces import bounces_of
        from atwood.simulation.contacts.compiled import sets_of

        alone = None if request.options.impacts == "one_by_one" else own[1]
        found = bounces_of(plan, probe, t, y, explicit.compiled_events, own[1].rates)
        if found is None and alone is not None:
            found = sets = sets_of(plan, probe, t, y, explicit.compiled_events, alone)
            rates = rates if sets is None else sets.compiled
        explicit = replace(explicit, jumps=found)
    fill: Callable[[SolverRequest], None] | None
    fill = None if own is None else Filling(*own, explicit, values_on_constraints)
    if rates is not None and fill is not None:
        fill(request)
        explicit = replace(explicit, compiled=lambda: rates)
    series, _ = equations_of(request, explicit, (t, y))
    known = cache(series)
    task = Task(
        settings, t, y, budget=request.budget, end=request.end, on_stiff=on_stiff, explicit=explicit, series=known
    )
    opened = method.open(task)
    if own is not None and not is_pair:
        assert isinstance(opened, ExplicitSession)
        onto = () if explicit.project is None else (values_on_constraints, own)
        fill = FillingOfSeries(known(), explicit, opened, *onto)
    if fill is not None:
        kept.keep(request, method, on_stiff, opened, fill)
    return opened


def _explicit_problem(request: SolverRequest, method: Method) -> ExplicitProblem:
    """Return the equations for an explicit method, with what is watched."""
    assembly, probe = request.plan.assembly, request.probe
    problem = explicit_problem(assembly, probe.function(), probe.directions) if assembly.form == "reduced" else None
    if problem is None:
        raise UsageError(
            f"this method ({method.title}) needs the reduced form of a scene without closed loops, or "
            "with such as formulas solve",
            where=assembly.flat.name,
            advice=advise(EXPLICIT, IDA),
        )
    return _watched(request, problem, method)


def _watched(request: SolverRequest, problem: ExplicitProblem, method: Method) -> ExplicitProblem:
    """Return a problem with what judges its steps, whose events are machine code too, if they can be."""
    probe = request.probe
    problem = replace(problem, event_rough=probe.rough, event_anew=probe.anew, event_signs=probe.handed)
    problem = replace(problem, guard=request.guard(method))
    found = None if problem.events is None else probe.compiled(for_ida=False)
    return problem if found is None else replace(problem, events=found.function(), compiled_events=found)
