"""From a scene in one mode and the options of a run to a solver at its start."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from typing import TYPE_CHECKING

from atwood.errors import UsageError
from atwood.integrators.explicit_problem import LOOSEST, CompiledEvents
from atwood.integrators.explicit_session import ExplicitSession, Leave
from atwood.integrators.protocol import (
    Budget,
    FloatArray,
    ImplicitProblem,
    LinearSolver,
    NativeCallbacks,
    Session,
    SolverOptions,
)
from atwood.late import dataclass
from atwood.simulation.dynamics.orientation_coordinates import longest_step
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.problem.options import SOLVERS, RunOptions
from atwood.simulation.problem.problem import Plan

if TYPE_CHECKING:
    from atwood.simulation.singular.monitor import SingularityMonitor

__all__ = ["SolverRequest", "open_explicit_session", "open_implicit_session"]


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
    """

    plan: Plan
    probe: EventProbe
    options: RunOptions
    end: float
    budget: Budget

    def settings(self, t: float, loosest: float = 1.0) -> SolverOptions:
        """Return the options of a solver that starts at a time, with no looser tolerance than it can hold."""
        options = self.options
        relative = min(options.relative_tolerance, loosest)
        return SolverOptions(
            relative_tolerance=relative,
            absolute_tolerances=self.plan.tolerances(min(options.absolute_tolerance or relative, loosest)),
            max_step=options.max_step,
            max_order=options.max_order,
            horizon=options.t_end - t if options.t_end > t else 1.0,
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
        problem = _with_events(_implicit_problem(request), probe)
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

    return open_session(_implicit_problem(request), settings, t, y, yp, request.budget)


def _implicit_problem(request: SolverRequest) -> ImplicitProblem:
    probe = request.probe
    return replace(request.plan.problem(probe.function(), probe.directions), event_rough=probe.rough)


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
            data_bytes=0,
            events=found.ida,
            restart_events=found.restart,
            has_noticed=found.has_noticed,
            keep=keep,
        )

    return replace(problem, events=found.function(), native=native)


def open_explicit_session(
    request: SolverRequest, solver: str, t: float, y: FloatArray, leave: Leave | None = None
) -> ExplicitSession:
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

    Raises
    ------
    UsageError
        If the scene is not one for explicit methods.
    """
    from atwood.integrators.explicit_session import open_explicit
    from atwood.simulation.problem.explicit_scene import explicit_problem

    assembly, probe = request.plan.assembly, request.probe
    problem = explicit_problem(assembly, probe.function(), probe.directions) if assembly.form == "reduced" else None
    if problem is None:
        raise UsageError(
            f"an explicit method ({SOLVERS[solver]}) needs the reduced form of a scene without closed loops",
            where=assembly.flat.name,
            advice="Use the solver 'ida'.",
        )
    problem = replace(problem, event_rough=probe.rough)
    found = None if problem.events is None else probe.compiled(for_ida=False)
    if found is not None:
        own = CompiledEvents(found.explicit, found.address, found.count, found.restart, found)
        problem = replace(problem, events=found.function(), compiled_events=lambda: own)
    if solver == "taylor":
        from atwood.simulation.problem.taylor_scene import open_taylor, taylor_problem

        series = taylor_problem(assembly, request.end, has_events=bool(probe.directions))
        return open_taylor(problem, series, request.settings(t, LOOSEST), t, y, request.budget)
    session = open_explicit(problem, request.settings(t, LOOSEST), t, y, request.budget, leave=leave, end=request.end)
    session.limit_steps(longest_step(assembly.own_equations, request.plan.program.split(y)[1]))
    return session
