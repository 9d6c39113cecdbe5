"""Where the time of a run goes: what one evaluation of each of its programs takes, times how often there was one."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Sequence
from ctypes import c_double, c_int64, c_void_p
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import compile_native
from atwood.codegen.llvm.build import RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, Routine
from atwood.errors import KernelEvaluationError
from atwood.expr import Program
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.integrators.ida.callbacks import Record, address
from atwood.integrators.ida.library import library
from atwood.integrators.ida.linear_solvers import FixedSolver
from atwood.integrators.methods import GAUSS, METHODS
from atwood.integrators.protocol import MET, STEPS, SolverOptions, Statistics, choose_linear_solver
from atwood.result.result import Result
from atwood.simulation.problem.closed_loops import solve_at
from atwood.simulation.problem.explicit_scene import program_on_constraints, values_on_constraints
from atwood.simulation.problem.problem import SceneProblem

_SECONDS: Key[float] = Key("what one evaluation takes")
_LEAST, _TRIES = 2e-4, 5
"""A measurement takes so long, s, and so many more are made, of which the least counts."""

_SHORT = 100.0
"""So many steps in the time in which the scene moves by its size."""


def write_routines() -> list[Routine]:
    """Write what calls a program many times."""
    r = Routine("repeat", {"times": INTEGER, "program": ADDRESS, **dict.fromkeys("abcd", ADDRESS)}, exported=True)
    times, program, *arguments = r.arguments
    with r.count(times):
        r.call(program, *arguments)
    r.give(r.value(0, CODE))
    return [r]


@once
def _repeat() -> Callable[..., None]:
    """Return the routine; the library keeps the code as long as it runs."""
    built = build_code([], CodeOptions(), exports=["repeat"], routines=RoutineSource("study.comparison.work"))
    called = ctypes.CFUNCTYPE(None, c_int64, *[c_void_p] * 5)(built.code.addresses["repeat"])

    def repeat(*arguments: Any, held: Any = built) -> None:
        called(*arguments)

    return repeat


def _seconds(function: int, *arguments: int) -> float:
    """Return what a call of a function takes, s."""
    repeat, count, taken = _repeat(), 1, 0.0
    given = (*arguments, 0, 0, 0)[:4]
    while taken < _LEAST:
        count *= 4
        taken = _timed(repeat, count, function, *given)
    return min(taken, *(_timed(repeat, count, function, *given) for _ in range(_TRIES))) / count


def _timed(repeat: Callable[..., None], *arguments: int) -> float:
    began = time.perf_counter()
    repeat(*arguments)
    return time.perf_counter() - began


def _evaluation(assembly: Assembly, program: Program, values: FloatArray, *inputs: Any) -> float:
    """Return what one evaluation of a program takes at a state, s."""

    def measure() -> float:
        code = compile_native(program)
        derived, scratch = code.built.derive("kernel", program, values)
        given = [np.array(one, dtype=float) for one in inputs]
        filled = [np.empty(len(one.expressions)) for one in program.outputs]
        pointers = [(c_void_p * len(some))(*[one.ctypes.data for one in some]) for some in (given, filled)]
        first, last = map(ctypes.addressof, pointers)
        return _seconds(code.built.code.addresses["kernel"], first, derived.ctypes.data, scratch.ctypes.data, last)

    return assembly.shared.get(_SECONDS, measure, program)


def _linear_algebra(plan: SceneProblem, jacobian: Sequence[float]) -> tuple[float, float] | None:
    """Return what SUNDIALS takes to factorise a matrix and to solve with its factors, s; None for sparse ones."""
    problem, sundials, context = plan.problem(), library(), c_void_p()
    kind, n = choose_linear_solver(problem, SolverOptions(), has_fixed=sundials.has_fixed_solvers), problem.size
    if kind == "sparse":
        return None
    values = np.ones((2, n))
    sundials.SUNContext_Create(0, ctypes.byref(context))
    x, b = (sundials.N_VMake_Serial(n, one.ctypes.data, context) for one in values)
    fixed = None
    if kind == "fixed" and problem.pivots is not None:
        fixed = FixedSolver(sundials, problem.pivots, context, Record(), np.ones(n))
        solver, matrix, entries = fixed.solver, fixed.matrix, np.asarray(jacobian)
    else:  # ones on and above the diagonal are their own factors, and can be factorised again and again
        matrix = sundials.SUNDenseMatrix(n, n, context)
        solver, entries = sundials.SUNLinSol_Dense(x, matrix, context), np.triu(np.ones((n, n))).T.ravel()
    np.ctypeslib.as_array((c_double * len(entries)).from_address(sundials.SUNDenseMatrix_Data(matrix)))[:] = entries
    setup = _seconds(address(sundials.SUNLinSolSetup), solver, matrix)
    solve = _seconds(address(sundials.SUNLinSolSolve), solver, matrix, x, b)
    if fixed is not None:
        fixed.free()
    else:
        sundials.SUNLinSolFree(solver)
        sundials.SUNMatDestroy(matrix)
    for one in (x, b):
        sundials.N_VDestroy(one)
    sundials.SUNContext_Free(ctypes.byref(context))
    return setup, solve


def shares_of(result: Result, rtol: float, seconds: float) -> dict[str, Any]:
    """Return what of the seconds of an integration each kind of work took, by field of `ComparisonRow`.

    Nothing for what calls Python, for runs with events, and for methods with programs of their own.
    """
    run = result.run
    segment, method = run.segments[0], METHODS[run.solver]
    if len(run.segments) > 1 or method is GAUSS or method.is_interpreted or segment.plan.not_compilable:
        return {}
    start = float(segment.time[0]), segment.coordinates[:, 0].copy(), segment.speeds[:, 0].copy()
    try:
        found = (_implicit if method.is_implicit else _explicit)(segment.plan, result.statistics, rtol, *start)
    except KernelEvaluationError:  # the Jacobian has no value at the start
        return {}
    return found | {"own_s": max(0.0, seconds - sum(found.values()))} if found else {}


def _implicit(
    plan: SceneProblem, done: Statistics, rtol: float, t: float, q: FloatArray, u: FloatArray
) -> dict[str, float]:
    """Return what residuals, Jacobians and SUNDIALS' linear algebra take, in steps that are short beside the motion."""
    assembly, program, values = plan.assembly, plan.program, plan.values
    y, still, rate = np.zeros(program.size), np.zeros(program.size), [_SHORT / plan.scales.time]
    y[: len(q) + len(u)] = np.concatenate([q, u])
    more = [still] * program.derivative.by_columns
    one = _evaluation(assembly, program.jacobian, values, [t], y, still, rate, *more)
    found = {"equations_s": done.residual_evaluations * _evaluation(assembly, program.residual, values, [t], y, still)}
    found["jacobians_s"] = done.jacobian_evaluations * one * (program.size if more else 1)
    linear = _linear_algebra(plan, assembly.compiled(program.jacobian).bind(values)([t], y, still, rate, *more)[0])
    if linear is not None:
        found["linear_s"] = done.jacobian_evaluations * linear[0] + done.residual_evaluations * linear[1]
    return found


def _explicit(
    plan: SceneProblem, done: Statistics, rtol: float, t: float, q: FloatArray, u: FloatArray
) -> dict[str, float]:
    """Return what accelerations take, with the elimination that they are, and projections at the ends of steps."""
    assembly = plan.assembly

    def accelerations(program: Program, values: FloatArray, *state: FloatArray) -> dict[str, float]:
        return {"equations_s": done.residual_evaluations * _evaluation(assembly, program, values, [t], *state)}

    if assembly.form == "reduced" and not plan.balance.constraints:
        plain = accelerations_of(assembly)
        return {} if plain is None else accelerations(plain.program, assembly.parameter_values, q, u)
    y, solved = np.concatenate([q, u]), solve_at(plan, t, q, u)
    if solved is not None:
        n = len(solved.independent)
        return accelerations(solved.form.accelerations.program, solved.values, *np.split(solved.reduced(y), [n]))
    held, values = program_on_constraints(plan, t, y), values_on_constraints(plan)
    found = accelerations(held.accelerations, values, q, u)
    if plan.holds:
        nearer, steps, moved = assembly.compiled(held.projection).bind(values), 0, [np.inf]
        place: Sequence[Sequence[float]] = (list(q + rtol * plan.coordinate_sizes), list(u))
        while steps < STEPS and max(map(abs, moved), default=0.0) > MET:
            *place, moved = nearer([t], *place)
            steps += 1
        found["projections_s"] = done.steps * steps * _evaluation(assembly, held.projection, values, [t], q, u)
    return found
