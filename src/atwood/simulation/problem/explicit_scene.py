"""From an assembled scene to the problem that an explicit method solves, with independent coordinates or constraints.

Where constraints stay, all coordinates and speeds are integrated, with accelerations from the augmented system; at the
end of each step the state is taken onto the constraints on position and velocity, in the metric in which outputs are
(`atwood.simulation.problem.projection`). That serves loops and rolling of the reduced form and all of the dae form.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.errors import KernelEvaluationError
from atwood.expr import DivisionByExactZeroError, Program
from atwood.forms.accelerations import AccelerationProgram, accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.constrained import ConstrainedProgram, constrained_program, impact_program
from atwood.forms.loose import balance_with_masses, has_touched, is_loose, loose_equations
from atwood.forms.quantities import to_maximal
from atwood.integrators.embedded.rates import CompiledAccelerations, OwnRates
from atwood.integrators.protocol import MET, PROJECTION, RATES, STEPS, CompiledRates, ExplicitProblem, Values
from atwood.numerics.rank import least_inertia
from atwood.simulation.problem.problem import SceneProblem
from atwood.topology.graph import connected_groups

if TYPE_CHECKING:
    from atwood.codegen.llvm.columns import ColumnKernel
    from atwood.integrators.embedded.lanes import RatesOfMany
    from atwood.integrators.jumps import JumpCode
    from atwood.mechanics.dynamics.equations import ContactRow

_COMPILED: Key[CompiledAccelerations] = Key("machine code of accelerations")
_MANY: Key[RatesOfMany] = Key("machine code of accelerations of runs side by side")


def explicit_problem(
    assembly: Assembly,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
) -> ExplicitProblem | None:
    """Return the equations of a scene in the reduced form for an explicit method, with ``y = (q, u)``."""
    program = accelerations_of(assembly)
    if program is None or len(assembly.reduced.coordinates) == 0:
        return None
    return explicit_problem_of(assembly, program, assembly.parameter_values, events, directions)


def explicit_problem_of(
    assembly: Assembly,
    program: AccelerationProgram,
    values: FloatArray,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
) -> ExplicitProblem:
    """Return what an explicit method is given of accelerations."""
    return _problem(assembly, program.program, values, _compiled(assembly, program, values), events, directions)


def _problem(
    assembly: Assembly,
    program: Program,
    values: FloatArray,
    compiled: Callable[[], CompiledRates] | None,
    events: Callable[[float, FloatArray, FloatArray], Values] | None,
    directions: tuple[int, ...],
    project: Callable[[float, FloatArray], FloatArray] | None = None,
) -> ExplicitProblem:
    _, n, m = (len(group.symbols) for group in program.inputs)
    made = cache(lambda: first_order(assembly.compiled(program).bind(values), n))  # when it is asked for
    return ExplicitProblem(
        size=n + m,
        rates=lambda t, y: made()(t, y),
        events=events,
        event_count=len(directions),
        event_directions=directions,
        compiled=compiled,
        project=project,
    )


def first_order(kernel: BoundKernel, coordinates: int) -> Callable[[float, FloatArray], Sequence[float]]:
    """Return the rates of ``y = (q, u)`` from a kernel of accelerations, or of (q', u') where q' is not u."""

    def rates(t: float, y: FloatArray) -> Sequence[float]:
        u = y[coordinates:]
        found = kernel([t], y[:coordinates], u)
        return [*(u if len(found) == 1 else found[0]), *found[-1]]

    return rates


def first_order_rows(
    kernel: BoundKernel | ColumnKernel, coordinates: int
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return the same for many states, one row each, from a kernel for many."""

    def rates(t: FloatArray, states: FloatArray) -> FloatArray:
        u = states[:, coordinates:].T
        found = kernel(t[None, :], states[:, :coordinates].T, u)
        first = u if len(found) == 1 else found[0]
        both = [np.broadcast_to(one, (len(one), len(states))) for one in (first, found[-1])]
        return np.concatenate(both).T

    return rates


def compiled_rates(assembly: Assembly, found: AccelerationProgram) -> CompiledAccelerations:
    """Return the accelerations of a scene as machine code, for any parameter values."""
    return assembly.shared.get(_COMPILED, lambda: CompiledAccelerations(found.program), found)


def compiled_rates_of_many(assembly: Assembly, found: AccelerationProgram, runs: int) -> RatesOfMany:
    """Return the same for so many runs side by side."""
    from atwood.integrators.embedded.lanes import rates_of_many

    return assembly.shared.get(_MANY, lambda: rates_of_many(found.program, runs), found, runs)


def _once(bind: Callable[[], Callable[[], CompiledRates]]) -> Callable[[], CompiledRates]:
    """Return a factory of compiled rates for sessions, whose code is bound on first use."""
    bound = cache(bind)
    return lambda: bound()()


def _compiled(assembly: Assembly, found: AccelerationProgram, values: FloatArray) -> Callable[[], CompiledRates] | None:
    """Return a factory of compiled rates for sessions, compiled on first use; None if not compilable."""
    return None if found.program.calls_python else _once(lambda: compiled_rates(assembly, found).bind(values))


def own_rates(assembly: Assembly) -> tuple[CompiledAccelerations, OwnRates] | None:
    """Return the accelerations of a scene as machine code, and rates with its parameters, for which others can be set.

    None where they cannot be compiled, and where the scene is not one for explicit methods.
    """
    found = accelerations_of(assembly)
    if found is None or found.program.calls_python:
        return None
    code = compiled_rates(assembly, found)
    return code, code.open()


def own_rates_on_constraints(
    plan: SceneProblem, t: float, y: FloatArray
) -> tuple[CompiledAccelerations, OwnRates] | None:
    """Return the same of a scene whose constraints stay; its parameters are those of `values_on_constraints`."""
    program = program_on_constraints(plan, t, y)
    code = plan.assembly.shared.get(
        _COMPILED_ON_CONSTRAINTS, lambda: _code(program, has_touched(plan.assembly)), program
    )
    return None if code is None or plan.not_compilable else (code, code.open(plan.holds))


def values_on_constraints(plan: SceneProblem) -> FloatArray:
    """Return the parameters of accelerations and projections where constraints stay."""
    return np.concatenate([plan.assembly.parameter_values, plan.sizes])


_IMPACTS: Key[JumpCode | None] = Key("machine code of impacts")
_PROGRAM: Key[ConstrainedProgram] = Key("accelerations and projections")
_COMPILED_ON_CONSTRAINTS: Key[CompiledAccelerations | None] = Key("machine code of accelerations and projections")
_LIGHT: Key[tuple[int, ...]] = Key("what has no inertia of its own")

_LEAST = 1e-9
"""Of a body's inertia in one direction, relative to that in others, in units of the diagonal."""


def constrained_problem(
    plan: SceneProblem,
    t: float,
    y: FloatArray,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
) -> ExplicitProblem:
    """Return the equations of a scene for an explicit method, with ``y = (q, u)`` on its constraints."""
    assembly, program = plan.assembly, program_on_constraints(plan, t, y)
    values = values_on_constraints(plan)
    nearer = cache(lambda: assembly.compiled(program.projection).bind(values))

    def project(t: float, y: FloatArray) -> FloatArray:
        return _projected(nearer(), t, y, plan.program.coordinates)

    compiled = _compiled_on_constraints(plan, program, values)
    onto = project if plan.holds else None
    return _problem(assembly, program.accelerations, values, compiled, events, directions, onto)


def impact_code(plan: SceneProblem, t: float, y: FloatArray, gaps: Sequence[ContactRow]) -> JumpCode | None:
    """Return what an impact at one gap alone does where nothing touches, as machine code; None where there is none.

    Its parameters are those of `values_on_constraints`.
    """
    assembly, kept = plan.assembly, plan.finding.kept
    light = light_speeds(plan, t, y)
    rows = assembly.rows if assembly.form == "reduced" else assembly.maximal.rows

    def make() -> JumpCode | None:
        from atwood.integrators.jumps import JumpCode

        equations, loose = loose_equations(assembly, rows)
        try:
            program = impact_program(assembly.flat.name, equations, loose, gaps, assembly.parameters, kept, light)
        except DivisionByExactZeroError:  # no gap moves by a force: where it closes, that is told
            return None
        return None if program.calls_python else JumpCode(program)

    return assembly.shared.get(_IMPACTS, make, assembly.form, kept, light)


def nearest_state(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates and speeds nearest to others that meet the constraints, and gaps that are closed."""
    y = np.concatenate([q, u])
    values = values_on_constraints(plan)
    nearer = plan.assembly.compiled(program_on_constraints(plan, t, y).projection).bind(values)
    found = _projected(nearer, t, y, len(q))
    return found[: len(q)], found[len(q) :]


def project_quickly(
    plan: SceneProblem, t: float, q: FloatArray, u: FloatArray, rates: CompiledRates | None = None
) -> tuple[FloatArray, FloatArray] | None:
    """Return the same by machine code, that of a session if given; None where none is there, or leads to no state."""
    y = np.concatenate([q, u])
    rates = rates or (compiled_on_constraints(plan, t, y) if plan.has_rates else None)
    if rates is None or not rates.project or PROJECTION(rates.project)(t, y.ctypes.data, rates.project_data):
        return None
    return (y[: len(q)], y[len(q) :]) if np.isfinite(y).all() else None


def rates_on_constraints(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return the rates of coordinates and speeds on the constraints."""
    y = np.concatenate([q, u])
    rates, found = compiled_on_constraints(plan, t, y), np.empty_like(y)
    if rates is None:
        program, values = program_on_constraints(plan, t, y), values_on_constraints(plan)
        found[:] = first_order(plan.assembly.compiled(program.accelerations).bind(values), len(q))(t, y)
    else:
        RATES(rates.function)(t, y.ctypes.data, found.ctypes.data, rates.data)
    return found


def compiled_on_constraints(plan: SceneProblem, t: float, y: FloatArray) -> CompiledRates | None:
    """Return rates and projections on the constraints as machine code; None where they cannot be."""
    found = _compiled_on_constraints(plan, program_on_constraints(plan, t, y), values_on_constraints(plan))
    return None if found is None else found()


def program_on_constraints(plan: SceneProblem, t: float, y: FloatArray) -> ConstrainedProgram:
    """Return accelerations and projections of a scene whose constraints stay."""
    assembly, kept = plan.assembly, plan.finding.kept
    light = light_speeds(plan, t, y)
    rows = assembly.rows if assembly.form == "reduced" else assembly.maximal.rows
    name = f"{assembly.flat.name} ({assembly.form})"

    def make() -> ConstrainedProgram:
        return constrained_program(name, *loose_equations(assembly, rows), assembly.parameters, kept, light)

    return assembly.shared.get(_PROGRAM, make, assembly.form, kept, light, is_loose(assembly))


def light_speeds(plan: SceneProblem, t: float, y: FloatArray) -> tuple[int, ...]:
    """Return the speeds of what has no inertia of its own in each of its directions; see `_light_speeds`."""
    return plan.assembly.kept.get(_LIGHT, lambda: _light_speeds(plan, t, y))


def _light_speeds(plan: SceneProblem, t: float, y: FloatArray) -> tuple[int, ...]:
    """Return the speeds of what has no inertia of its own in each of its directions, whatever holds it.

    In generalized coordinates these are all as soon as there is such a body: any mass matrix may then be singular.
    """
    assembly = plan.assembly
    q, u = plan.program.split(y)
    if assembly.form == "reduced":
        q, u = (np.asarray(one) for one in assembly.kernel(to_maximal(assembly))([t], q, u))
    program = balance_with_masses(assembly, "dae")
    entries = assembly.kernel(program.program)([t], q, u)[0]
    places = list(zip(program.mass_rows.tolist(), program.mass_columns.tolist(), strict=True))
    value = dict(zip(places, entries, strict=True))
    found: list[int] = []
    for group in connected_groups(range(program.speeds), places):
        block = np.array([[value.get((i, j), 0.0) for j in group] for i in group])
        if not least_inertia(block) > _LEAST:
            found += group
    if assembly.form == "reduced":
        return tuple(range(plan.program.speeds)) if found else ()
    return tuple(sorted(found))


def _projected(nearer: BoundKernel, t: float, y: FloatArray, coordinates: int) -> FloatArray:
    """Return the values that meet the constraints nearest to others."""
    for _ in range(STEPS):
        q, u, moved = nearer([t], y[:coordinates], y[coordinates:])
        y = np.array([*q, *u])
        if max(map(abs, moved), default=0.0) <= MET:
            return y
    raise KernelEvaluationError(f"the constraints cannot be met near a state, at t = {t:.9g}")


def _compiled_on_constraints(
    plan: SceneProblem, program: ConstrainedProgram, values: FloatArray
) -> Callable[[], CompiledRates] | None:
    """Return a factory of compiled rates and projections for sessions; None if not compilable."""
    if plan.not_compilable:
        return None
    code = plan.assembly.shared.get(
        _COMPILED_ON_CONSTRAINTS, lambda: _code(program, has_touched(plan.assembly)), program
    )
    return None if code is None else _once(lambda: code.bind(values, projects=plan.holds))


def _code(program: ConstrainedProgram, is_brief: bool) -> CompiledAccelerations | None:
    """Return the machine code; None where there is none."""
    if program.accelerations.calls_python or program.projection.calls_python:
        return None
    return CompiledAccelerations(program.accelerations, program.projection, is_brief)
