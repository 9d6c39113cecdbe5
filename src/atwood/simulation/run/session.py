"""From a scene in one mode and the options of a run to a solver at its start."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from atwood.errors import UsageError
from atwood.integrators.compiled_functions import GuardedResidual, NativeCallbacks, StepGuard
from atwood.integrators.explicit_problem import LOOSEST, CompiledEvents, ExplicitProblem
from atwood.integrators.explicit_session import ExplicitSession, Leave
from atwood.integrators.protocol import Budget, FloatArray, ImplicitProblem, LinearSolver, Session, SolverOptions
from atwood.late import dataclass, replace
from atwood.simulation.dynamics.orientation_coordinates import longest_step
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.problem.options import FIXED_STEPS, LEAST, SOLVERS, RunOptions
from atwood.simulation.problem.problem import Plan
from atwood.simulation.problem.step_guard import REACHES, step_guard

if TYPE_CHECKING:
    from atwood.forms.loops.closed_form import ClosedForm
    from atwood.integrators.dop853.native import CompiledAccelerations, OwnRates
    from atwood.simulation.run.closed_session import ClosedLoopSession
    from atwood.simulation.singular.monitor import SingularityMonitor

__all__ = ["KeptSession", "SolverRequest", "open_explicit_session", "open_implicit_session"]


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

    plan: Plan
    probe: EventProbe
    options: RunOptions
    end: float
    budget: Budget
    kept: KeptSession

    def guard(self, solver: str, closed: tuple[ClosedForm, FloatArray] | None = None) -> StepGuard | None:
        """Return what judges the steps of a method besides their error; see `step_guard`."""
        options, reach, is_estimated = self.options, REACHES[solver], solver not in FIXED_STEPS
        if not is_estimated and options.step is None:
            reach *= options.relative_tolerance ** (1.0 / (1 + (options.order or 8)))
        span = self.plan.assembly.flat.t_start, options.t_end
        return step_guard(self.plan.assembly, span, reach, closed, is_estimated)

    def horizon(self, t: float) -> float:
        """Return a typical length of what is left of the run at a time, s."""
        return self.options.t_end - t if self.options.t_end > t else 1.0

    def settings(self, t: float, loosest: float = 1.0) -> SolverOptions:
        """Return the options of a solver that starts at a time, with no looser tolerance than it can hold."""
        options = self.options
        relative = min(options.relative_tolerance, loosest)
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


def open_implicit_session(
    request: SolverRequest,
    solver: str,
    t: float,
    y: FloatArray,
    yp: FloatArray,
    monitor: SingularityMonitor | None = None,
) -> Session:
    """Start IDA, driven directly or through scikit-sundae.

    Parameters
    ----------
    request
        What is to be solved.
    solver
        ``"ida"`` or ``"ida-sundae"``.
    t, y, yp
        Consistent start values.
    monitor
        What looks out for singular positions; a session looks itself, if it can.
    """
    plan, probe, settings = request.plan, request.probe, request.settings(t)
    if solver == "ida":
        problem = _guarded(_with_events(_implicit_problem(request), probe), request, solver)
        from atwood.integrators.ida import native as ida_native

        tuning = ida_native.IdaTuning(angle_like=plan.angles, stop_time=request.end)
        lookout = None if monitor is None else monitor.lookout
        session = ida_native.open_session(problem, settings, t, y, yp, request.budget, tuning, lookout)
        if monitor is not None and not session.looks_out:
            monitor.look_in_python()
        return session
    if monitor is not None:
        monitor.look_in_python()
    from atwood.integrators.ida.sundae import open_session

    problem = _guarded(_implicit_problem(request), request, solver)
    return open_session(problem, settings, t, y, yp, request.budget)


def _implicit_problem(request: SolverRequest) -> ImplicitProblem:
    probe = request.probe
    problem = request.plan.problem(probe.function(), probe.directions)
    return replace(problem, event_rough=probe.rough, event_signs=probe.handed)


def _guarded(problem: ImplicitProblem, request: SolverRequest, solver: str) -> ImplicitProblem:
    """Return a problem whose residual judges steps, if laws could slip through them."""
    guard, make = request.guard(solver), problem.native
    if guard is None:
        return problem
    size = request.plan.program.coordinates + request.plan.program.speeds
    residual = GuardedResidual(problem.residual, guard, size)
    begins: list[Callable[[float, FloatArray, FloatArray], None]] = [residual.begin]

    def native(linear_solver: LinearSolver) -> NativeCallbacks:
        from atwood.codegen.sundials.guarded_residual import guarded_residual

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
            keep=keep,
        )

    return replace(problem, events=found.function(), native=native)


@dataclass(eq=False)
class KeptSession:
    """The session of an explicit method, which a run begins again where only values of parameters have changed.

    So a run that stops at sample times opens one session, not one for each. What it was opened with is compared by
    identity: a run has one object of each as long as these stay what they are.

    Attributes
    ----------
    session
        The session; None before the first.
    code, rates
        The compiled rates, and their place for parameters.
    opened_with
        What else it was opened with.
    """

    session: ExplicitSession | None = None
    code: CompiledAccelerations | None = None
    rates: OwnRates | None = None
    opened_with: tuple[object, ...] = ()

    def begin_again(
        self, request: SolverRequest, t: float, y: FloatArray, leave: Leave | None
    ) -> ExplicitSession | None:
        """Return the session at the start of another segment; None where it was opened for something else."""
        session, code, rates = self.session, self.code, self.rates
        if session is None or code is None or rates is None or request.probe.event_functions:
            return None
        if not all(one is other for one, other in zip(self.opened_with, _opened_with(request, leave), strict=True)):
            return None
        code.fill(rates, request.plan.assembly.parameter_values)
        session.begin_again(t, y, request.horizon(t), request.budget, leave, request.end)
        return session


def _opened_with(request: SolverRequest, leave: Leave | None) -> tuple[object, ...]:
    plan = request.plan
    return plan.assembly.shared, plan.program, request.options, plan.scales, plan.sizes, leave is None


def open_explicit_session(
    request: SolverRequest,
    solver: str,
    t: float,
    y: FloatArray,
    leave: Leave | None = None,
    give_up: Callable[[float, FloatArray], None] | None = None,
    keeps_constraints: bool = False,
) -> ExplicitSession | ClosedLoopSession:
    """Start an explicit method.

    Parameters
    ----------
    request
        What is to be solved.
    solver
        A key of `SOLVERS`.
    t, y
        Start values.
    leave
        See `atwood.integrators.explicit_session.open_explicit`.
    give_up
        See `atwood.simulation.run.closed_session.ClosedLoopSession`.
    keeps_constraints
        See `atwood.simulation.run.choice.Choice`.

    Raises
    ------
    UsageError
        If the scene is not one for explicit methods.
    """
    if request.plan.balance.constraints and not keeps_constraints:
        from atwood.simulation.problem.closed_loops import solve_at
        from atwood.simulation.run.closed_session import ClosedLoopSession

        solved = solve_at(request.plan, t, *request.plan.program.split(y))
        if solved is not None:
            return ClosedLoopSession(request, solver, t, y, solved, leave, give_up)
    if solver == "explicit" and (request.plan.balance.constraints or request.plan.assembly.form == "dae"):
        return _open_constrained(request, t, y, leave)
    if solver == "taylor":
        return _open_taylor(request, t, y)
    if solver in FIXED_STEPS:
        return _open_fixed(request, solver, t, y)
    session = request.kept.begin_again(request, t, y, leave)
    if session is None:
        session = _open_steps(request, t, y, leave)
    equations, program = request.plan.assembly.own_equations, request.plan.program
    session.limit_steps(longest_step(equations, program.split(y)[1]))
    return session


def _open_steps(request: SolverRequest, t: float, y: FloatArray, leave: Leave | None) -> ExplicitSession:
    """Start the method of order 8(5,3), and keep its session if that can be begun again."""
    from atwood.integrators.explicit_session import open_explicit
    from atwood.simulation.problem.explicit_scene import own_rates

    problem, kept, assembly = _explicit_problem(request, "explicit"), request.kept, request.plan.assembly
    own = None if problem.events is not None or problem.guard is not None else own_rates(assembly)
    if own is None:
        return open_explicit(problem, request.settings(t, LOOSEST), t, y, request.budget, leave=leave, end=request.end)
    code, rates = own
    problem = replace(problem, compiled=lambda: rates.rates)
    session = open_explicit(problem, request.settings(t, LOOSEST), t, y, request.budget, leave=leave, end=request.end)
    kept.session, kept.code, kept.rates = session, code, rates
    kept.opened_with = _opened_with(request, leave)
    return session


def _open_constrained(request: SolverRequest, t: float, y: FloatArray, leave: Leave | None) -> ExplicitSession:
    """Start the method of order 8(5,3) with steps that end on the constraints."""
    from atwood.integrators.explicit_session import open_explicit
    from atwood.simulation.problem.constrained_scene import constrained_problem

    plan, probe = request.plan, request.probe
    plan.keep_better(t, plan.program.split(y)[0])
    problem = constrained_problem(plan, t, y, probe.function(), probe.directions)
    settings = request.settings(t, LOOSEST)
    absolute = np.asarray(settings.absolute_tolerances)[: len(y)]
    settings = replace(settings, absolute_tolerances=absolute)
    problem = _watched(request, problem, "explicit")
    session = open_explicit(problem, settings, t, y, request.budget, leave=leave, end=request.end)
    session.limit_steps(longest_step(plan.assembly.own_equations, plan.program.split(y)[1]))
    return session


def _open_taylor(request: SolverRequest, t: float, y: FloatArray) -> ExplicitSession:
    from atwood.simulation.problem.taylor_scene import open_taylor, taylor_problem

    problem = _explicit_problem(request, "taylor")
    series = taylor_problem(request.plan.assembly, request.end, has_events=bool(request.probe.directions))
    return open_taylor(problem, series, request.settings(t, LOOSEST), t, y, request.budget)


def _open_fixed(request: SolverRequest, solver: str, t: float, y: FloatArray) -> ExplicitSession:
    from atwood.simulation.problem.gauss_scene import GaussSettings, open_gauss

    options = request.options
    settings = GaussSettings(
        solver, options.order, options.step, request.end, request.plan.tolerances(1.0, request.options.nominal)
    )
    problem = _explicit_problem(request, solver)
    return open_gauss(request.plan.assembly, problem, request.settings(t), settings, t, y, request.budget)


def _explicit_problem(request: SolverRequest, solver: str) -> ExplicitProblem:
    """Return the equations for an explicit method, with what is watched."""
    from atwood.simulation.problem.explicit_scene import explicit_problem

    assembly, probe = request.plan.assembly, request.probe
    problem = explicit_problem(assembly, probe.function(), probe.directions) if assembly.form == "reduced" else None
    if problem is None:
        raise UsageError(
            f"this method ({SOLVERS[solver]}) needs the reduced form of a scene without closed loops, or "
            "with such as formulas solve",
            where=assembly.flat.name,
            advice="Use the solver 'explicit' or 'ida'.",
        )
    return _watched(request, problem, solver)


def _watched(request: SolverRequest, problem: ExplicitProblem, solver: str) -> ExplicitProblem:
    """Return a problem with what judges its steps, whose events are machine code too, if they can be."""
    probe = request.probe
    problem = replace(problem, event_rough=probe.rough, event_signs=probe.handed, guard=request.guard(solver))
    found = None if problem.events is None else probe.compiled(for_ida=False)
    if found is None:
        return problem
    own = CompiledEvents(found.explicit, found.address, found.count, found.restart, found)
    return replace(problem, events=found.function(), compiled_events=lambda: own)
