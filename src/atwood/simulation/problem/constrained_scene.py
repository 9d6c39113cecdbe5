"""From a scene whose constraints stay to the problem that an explicit method solves.

All coordinates and speeds are integrated, with accelerations from the augmented system; at the end of each step the
state is taken onto the constraints on position and velocity, in the metric in which outputs are
(`atwood.simulation.problem.projection`). That serves loops and rolling of the reduced form and all of the dae form.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.errors import KernelEvaluationError
from atwood.forms.caches import Key
from atwood.forms.constrained import ConstrainedProgram, constrained_program
from atwood.forms.quantities import to_maximal
from atwood.integrators.explicit_problem import MET, STEPS, CompiledRates, ExplicitProblem
from atwood.integrators.protocol import Values
from atwood.simulation.problem.explicit_scene import first_order
from atwood.simulation.problem.problem import Plan
from atwood.topology.graph import connected_groups

if TYPE_CHECKING:
    from atwood.integrators.embedded.rates import CompiledAccelerations


_PROGRAM: Key[ConstrainedProgram] = Key("accelerations and projections")
_COMPILED: Key[CompiledAccelerations | None] = Key("machine code of accelerations and projections")
_LIGHT: Key[tuple[int, ...]] = Key("what has no inertia of its own")

_LEAST = 1e-9
"""Of a body's inertia in one direction, relative to that in others, in units of the diagonal."""


def constrained_problem(
    plan: Plan,
    t: float,
    y: FloatArray,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
) -> ExplicitProblem:
    """Return the equations of a scene for an explicit method, with ``y = (q, u)`` on its constraints."""
    assembly, program = plan.assembly, _program(plan, t, y)
    n, m = plan.program.coordinates, plan.program.speeds
    values = np.concatenate([assembly.parameter_values, plan.sizes])
    kernel = assembly.compiled(program.accelerations).bind(values)
    nearer = assembly.compiled(program.projection).bind(values)

    def project(t: float, y: FloatArray) -> FloatArray:
        return _projected(nearer, t, y, n)

    return ExplicitProblem(
        size=n + m,
        rates=first_order(kernel, n),
        events=events,
        event_count=len(directions),
        event_directions=directions,
        compiled=_compiled(plan, program, values),
        project=project if plan.finding.kept else None,
    )


def _program(plan: Plan, t: float, y: FloatArray) -> ConstrainedProgram:
    assembly, kept = plan.assembly, plan.finding.kept
    light = assembly.kept.get(_LIGHT, lambda: _light_speeds(plan, t, y))
    rows = assembly.rows if assembly.form == "reduced" else assembly.maximal.rows
    name = f"{assembly.flat.name} ({assembly.form})"

    def make() -> ConstrainedProgram:
        return constrained_program(name, assembly.own_equations, assembly.parameters, rows, kept, light)

    return assembly.shared.get(_PROGRAM, make, assembly.form, kept, light)


def _light_speeds(plan: Plan, t: float, y: FloatArray) -> tuple[int, ...]:
    """Return the speeds of what has no inertia of its own in each of its directions, whatever holds it.

    In generalized coordinates these are all as soon as there is such a body: any mass matrix may then be singular.
    """
    assembly = plan.assembly
    q, u = plan.program.split(y)
    if assembly.form == "reduced":
        q, u = (np.asarray(one) for one in assembly.kernel(to_maximal(assembly))([t], q, u))
    program = assembly.balance("dae")
    entries = assembly.kernel(program.program)([t], q, u)[0]
    places = list(zip(program.mass_rows.tolist(), program.mass_columns.tolist(), strict=True))
    value = dict(zip(places, entries, strict=True))
    found: list[int] = []
    for group in connected_groups(range(program.speeds), places):
        block = np.array([[value.get((i, j), 0.0) for j in group] for i in group])
        if not _is_definite(block):
            found += group
    if assembly.form == "reduced":
        return tuple(range(plan.program.speeds)) if found else ()
    return tuple(sorted(found))


def _is_definite(block: FloatArray) -> bool:
    """Return whether there is inertia in each direction, in units of that along each speed."""
    own = np.diag(block)
    if not np.all(own > 0.0):
        return False
    return bool(np.linalg.eigvalsh(block / np.sqrt(own[:, None] * own[None, :]))[0] > _LEAST)


def _projected(nearer: BoundKernel, t: float, y: FloatArray, coordinates: int) -> FloatArray:
    """Return the values that meet the constraints nearest to others."""
    for _ in range(STEPS):
        q, u, moved = nearer([t], y[:coordinates], y[coordinates:])
        y = np.array([*q, *u])
        if max(map(abs, moved), default=0.0) <= MET:
            return y
    raise KernelEvaluationError(f"the constraints cannot be met near a state, at t = {t:.9g}")


def _compiled(plan: Plan, program: ConstrainedProgram, values: FloatArray) -> Callable[[], CompiledRates] | None:
    """Return what gives each session compiled functions, made when they are first asked for; None if they cannot be."""
    if plan.not_compilable:
        return None
    code = plan.assembly.shared.get(_COMPILED, lambda: _code(program), program)
    if code is None:
        return None

    @cache
    def bound() -> Callable[[], CompiledRates]:
        return code.bind(values, projects=bool(plan.finding.kept))

    return lambda: bound()()


def _code(program: ConstrainedProgram) -> CompiledAccelerations | None:
    """Return the machine code; None where there is none."""
    if any(node.operation == "external" for node in (*program.accelerations.nodes, *program.projection.nodes)):
        return None
    from atwood.integrators.embedded.rates import CompiledAccelerations

    return CompiledAccelerations(program.accelerations, program.projection)
