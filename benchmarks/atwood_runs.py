"""Whole runs with Atwood: from opening the session, with everything compiled, to the state at the end.

That is what the programs by hand do in one call.  `whole_run` is the public call, which also finds the start, samples
the motion, and keeps it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from mechanisms import FloatArray, Mechanism

from atwood import simulate
from atwood.integrators.ida import native as ida_native
from atwood.integrators.methods import EXPLICIT, TAYLOR, Task
from atwood.integrators.protocol import SolverOptions, Statistics, Status, StepResult
from atwood.simulation.problem.explicit_scene import explicit_problem
from atwood.simulation.problem.preparation import pack_state
from atwood.simulation.problem.problem import SceneProblem

__all__ = ["Prepared", "explicit_run", "ida_run", "ida_session", "prepare", "taylor_run", "whole_run"]

Run = Callable[[], tuple[float, FloatArray]]


@dataclass(frozen=True, eq=False)
class Prepared:
    """A mechanism in one form, at its start.

    Attributes
    ----------
    mechanism, plan
        What moves.
    y, yp
        Consistent start values.
    """

    mechanism: Mechanism
    plan: SceneProblem
    y: FloatArray
    yp: FloatArray

    def settings(self, rtol: float) -> SolverOptions:
        """Return the options that a run gives its solver."""
        return SolverOptions(
            relative_tolerance=rtol, absolute_tolerances=self.plan.tolerances(rtol, {}), horizon=self.mechanism.t_end
        )

    def at_end(self, y: FloatArray) -> FloatArray:
        """Return what is compared."""
        is_reduced = self.plan.assembly.form == "reduced"
        return self.mechanism.from_angles(y) if is_reduced else self.mechanism.from_positions(y)


def prepare(mechanism: Mechanism, form: str) -> Prepared:
    """Assemble a mechanism and find its start."""
    result = simulate(mechanism.scene, form=form, solver="ida", t_end=mechanism.t_end, outputs=2, samples=1)
    segment = result.run.segments[0]
    y, yp = pack_state(segment.plan, 0.0, segment.coordinates[:, 0], segment.speeds[:, 0])
    made = Prepared(mechanism, segment.plan, y, yp)
    expected = mechanism.from_angles(mechanism.angles_at_start())
    if mechanism.error(made.at_end(y), expected) > 1e-12:
        raise SystemExit(f"{mechanism.name}: Atwood's start is another one")
    return made


class _Session(Protocol):
    def advance(self, t_out: float) -> StepResult: ...


def _run(prepared: Prepared, open_session: Callable[[], _Session], close: bool = False) -> Run:
    t_end = prepared.mechanism.t_end

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        session: Any = open_session()
        end = session.advance(t_end)
        if close:
            session.close()
        spent = time.perf_counter() - began
        if end.status is not Status.REACHED:
            raise ArithmeticError(end.message)
        return spent, prepared.at_end(end.y)

    return run


def explicit_run(prepared: Prepared, rtol: float) -> Run:
    """Return a run with the method of order 8(5,3)."""
    problem = explicit_problem(prepared.plan.assembly)
    assert problem is not None
    settings, t_end = prepared.settings(rtol), prepared.mechanism.t_end
    task = Task(settings, 0.0, prepared.y, end=t_end, explicit=problem)
    return _run(prepared, lambda: EXPLICIT.open(task))


def taylor_run(prepared: Prepared, rtol: float) -> Run:
    """Return a run with the Taylor-series method."""
    from atwood.simulation.problem.taylor_scene import taylor_problem

    assembly = prepared.plan.assembly
    problem, series = explicit_problem(assembly), taylor_problem(assembly, prepared.mechanism.t_end)
    assert problem is not None
    settings = prepared.settings(rtol)
    task = Task(settings, 0.0, prepared.y, explicit=problem, series=lambda: series)
    return _run(prepared, lambda: TAYLOR.open(task))


def ida_session(prepared: Prepared, rtol: float, python: bool = False) -> Callable[[], ida_native.NativeSession]:
    """Return what opens a session with IDA as a run does; with functions in Python only, if so asked."""
    from dataclasses import replace

    problem, settings = prepared.plan.problem(), prepared.settings(rtol)
    if python:
        problem = replace(problem, native=None)
    tuning = ida_native.IdaTuning(angle_like=prepared.plan.angles, stop_time=prepared.mechanism.t_end)
    return lambda: ida_native.open_session(problem, settings, 0.0, prepared.y, prepared.yp, None, tuning)


def ida_run(prepared: Prepared, rtol: float) -> Run:
    """Return a run with IDA."""
    return _run(prepared, ida_session(prepared, rtol), close=True)


def whole_run(prepared: Prepared, solver: str, rtol: float) -> Run:
    """Return a call of `simulate` on the assembled scene, with its own samples."""
    assembly, mechanism = prepared.plan.assembly, prepared.mechanism
    bobs = ["bob1", "bob2"] if mechanism.links == 2 else [f"bob[{mechanism.links - 1}]"]

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        result = simulate(assembly, solver=solver, rtol=rtol, t_end=mechanism.t_end)
        spent = time.perf_counter() - began
        if mechanism.by_angles:
            places = [[result.array(f"{bob}.position.{axis}")[-1] for axis in "xz"] for bob in bobs]
            return spent, mechanism.from_positions(np.ravel(places))
        return spent, np.array([result.array(f"{bobs[-1]}.position.{axis}")[-1] for axis in "xz"])

    return run


def statistics_of(open_session: Callable[[], ida_native.NativeSession], t_end: float) -> Statistics:
    """Return what a run costs."""
    with open_session() as session:
        if session.advance(t_end).status is not Status.REACHED:
            raise SystemExit("a run did not reach its end")
        return session.statistics
