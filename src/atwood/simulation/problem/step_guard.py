"""Runs whose steps laws could slip through, and what judges these (`atwood.simulation.problem.curved_laws`)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.codegen.python.backend import compile_program
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.integrators.protocol import StepGuard
from atwood.simulation.problem.curved_laws import Curved, find_curved, find_external, is_needed, watched_program

if TYPE_CHECKING:
    from atwood.forms.loops.closed_form import ClosedForm


_SHORTEST = 1e-13
"""Relative to the run: steps that are no longer are taken as they are, and what lasts no longer is a moment."""

_PROGRAM: Key[Program] = Key("how far functions in laws change over a step")
_NEEDED: Key[bool] = Key("whether a function in a law may change fast in a run")
_CODE: Key[object] = Key("machine code of that")
_GUARD: Key[StepGuard] = Key("what judges steps")


def step_guard(
    assembly: Assembly,
    span: tuple[float, float],
    reach: float,
    closed: tuple[ClosedForm, FloatArray] | None = None,
    is_estimated: bool = True,
) -> StepGuard | None:
    """Return what judges the steps of a session; None where no law can change faster than coordinates do."""
    found = _by_bounds(assembly, span, reach, closed, is_estimated)
    calls = find_external(assembly)
    return _by_samples(assembly, span, calls, closed, found) if calls else found


def _by_samples(
    assembly: Assembly,
    span: tuple[float, float],
    calls: Sequence[Expression],
    closed: tuple[ClosedForm, FloatArray] | None,
    other: StepGuard | None,
) -> StepGuard:
    """Return what looks at functions in Python now and then, and say so."""
    from atwood.integrators.step_guard import GRID, SAMPLES, SampledSteps  # few laws are in Python

    inputs, parameters, values = state_groups(assembly.own_equations), assembly.parameters, assembly.parameter_values
    if closed is not None:
        program, values = closed[0].accelerations.program, closed[1]
        inputs, parameters, calls = program.inputs, program.parameters, substitute(calls, closed[0].known)
    q, u = (group.symbols for group in inputs[1:])
    moving = [one for one in calls if depends_on(one, [*q, *u])]
    timed = [one for one in calls if one not in moving]

    def bound(groups: tuple[InputGroup, ...], called: Sequence[Expression]) -> BoundKernel:
        outputs = (OutputGroup("values", tuple(called)),)
        name = f"{assembly.flat.name} (functions in Python)"
        return compile_program(Program(name, groups, tuple(parameters), outputs)).bind(values)

    of_time, of_motion = bound(inputs[:1], timed), bound(inputs, moving)
    names = ", ".join(sorted({one.payload.name.rstrip("'") for one in calls}))
    length = abs(span[1] - span[0])
    warnings.warn(
        f"{assembly.flat.name}: nothing is known of {names} but samples, {SAMPLES} a step and {GRID} a run where it "
        f"is a function of time alone; what lasts less than {length / GRID:.3g} s, or is narrower than that part of a "
        "step, could be missed",
        stacklevel=2,
    )
    return SampledSteps(
        lambda t: np.asarray(of_time([t])[0], dtype=float),
        lambda t, y: np.asarray(of_motion([t], y[: len(q)], y[len(q) : len(q) + len(u)])[0], dtype=float),
        span,
        other,
    ).guard()


def _by_bounds(
    assembly: Assembly,
    span: tuple[float, float],
    reach: float,
    closed: tuple[ClosedForm, FloatArray] | None,
    is_estimated: bool,
) -> StepGuard | None:
    curved, key = find_curved(assembly, is_estimated), (span, reach, is_estimated)
    if not curved or not assembly.kept.get(_NEEDED, lambda: is_needed(assembly, curved, span, reach), *key):
        return None
    if closed is None:  # of a session that the next run goes on with
        about = (assembly.form, *key)
        return assembly.kept.get(_GUARD, lambda: _bound(assembly, curved, None, key, assembly.parameter_values), *about)
    return _bound(assembly, curved, closed[0], key, closed[1])


def _bound(
    assembly: Assembly,
    curved: Sequence[Curved],
    form: ClosedForm | None,
    key: tuple[tuple[float, float], float, bool],
    values: FloatArray,
) -> StepGuard:
    from atwood.integrators.step_guard import GuardCode, compile_guard

    span, reach, is_estimated = key
    program = guard_program(assembly, curved, form, is_estimated)
    code = assembly.shared.get(_CODE, lambda: compile_guard(program), program)
    assert isinstance(code, GuardCode)
    return code.bind(values, reach, shortest_judged(span))


def shortest_judged(span: tuple[float, float]) -> float:
    """Return the longest step of a run that is taken as it is, s."""
    return _SHORTEST * abs(span[1] - span[0])


def guard_program(
    assembly: Assembly, curved: Sequence[Curved], form: ClosedForm | None = None, is_estimated: bool = True
) -> Program:
    """Return the program that judges steps; see `watched_program`."""

    def make() -> Program:
        equations, parameters = assembly.own_equations, assembly.parameters
        angles = [s for s, one in zip(equations.coordinates, equations.names, strict=True) if one.unit == "rad"]
        groups, known = state_groups(equations), None
        if form is not None:
            found = form.accelerations.program
            groups, parameters, known = found.inputs, found.parameters, form.known
        reactions = equations.read.values()
        return watched_program(assembly.flat.name, curved, groups, parameters, angles, known, reactions)

    shared = assembly.shared
    with shared.lock:
        return shared.get(_PROGRAM, make, assembly.form, form, is_estimated)
