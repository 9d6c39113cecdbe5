"""How a scene is prepared to be run from a consistent state, and what of it cannot become machine code.

A function in Python that a law calls (`atwood.external`), or an operation that nobody has written code for, leaves the
scene to kernels in Python. That is slower by far, so it is said.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, KernelEvaluationError, StartError, UnsupportedError
from atwood.expr import Expression, live
from atwood.expr.core.program import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import in_no_contact
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.model.declare.component import bind
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Vector
from atwood.simulation.dynamics.balance import balance_of, is_wide
from atwood.simulation.dynamics.numerical_failure import ADVICE_AT_START, undefined_value_at
from atwood.simulation.dynamics.reactions import check_read_reactions
from atwood.simulation.dynamics.redundancy import RankFinding, find_rank
from atwood.simulation.dynamics.scales import coordinate_scales, find_scales, motion_scales, seen_from_afar
from atwood.simulation.initialization.mobility import bodies_have_inertia, check_massless_directions
from atwood.simulation.problem.problem import SceneProblem, dependent_speeds_of, kept_rows

_PLAN: Key[SceneProblem] = Key("plan")


def make_problem(
    assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float
) -> SceneProblem:
    """Prepare a run from a consistent state in the coordinates of the form."""
    about = t, q.tobytes(), u.tobytes(), length, span
    made = assembly.kept.get(_PLAN, lambda: _make_problem(assembly, t, q, u, length, span), *about)
    if made.not_compilable and "foreign code" not in made.not_compilable:
        announce(assembly, made.not_compilable)
    return replace(made)  # its dependent coordinates change on the way


def problem_of_run(
    assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float
) -> SceneProblem:
    """Return the plan of a mode, as `make_problem` does; if a law has no value there, it is named."""
    try:
        return make_problem(assembly, t, q, u, length, span)
    except UnsupportedError:
        raise
    except AtwoodError as error:
        found = undefined_value_at(assembly, t, q, u)
        if found is None:
            raise
        if assembly.own_equations.contacts:
            _check_without_contacts(in_no_contact(assembly), t, q, u, length)
        raise StartError(
            f"{found.describe()}, so that the run cannot start", where=found.part, advice=ADVICE_AT_START
        ) from error


def _check_without_contacts(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float) -> None:
    """Refuse what nothing but gaps and slips would hold, and has no mass: their reactions have no value."""
    sizes, balance = motion_scales(assembly.own_equations, length), balance_of(assembly, assembly.form)
    now, kept = balance.at(t, q, u), list(find_rank(balance, t, q, sizes).kept)
    check_massless_directions(assembly, now, now.jacobian[kept], sizes, (t, q, u))


def _make_problem(
    assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float
) -> SceneProblem:
    equations = assembly.own_equations
    balance = balance_of(assembly, assembly.form)
    sizes, coordinate_sizes = motion_scales(equations, length), coordinate_scales(equations, length)
    finding = find_rank(balance, t, q, sizes)
    check_read_reactions(assembly, t, q, u, length)
    # Of a large tree, masses and forces are then not written down.
    by_formulas = is_wide(assembly, assembly.form) and bodies_have_inertia(assembly, t, q, u) and balance.formulas
    try:
        now = None if by_formulas else balance.at(t, q, u)
        accelerations = balance.accelerate(t, q, u)[0] if now is None else None
    except KernelEvaluationError as error:
        raise StartError(
            f"at the start a law has no value: {error.message}",
            where=assembly.flat.name,
            advice=ADVICE_AT_START,
        ) from error
    if now is not None:
        constraint_jacobian = now.jacobian[list(finding.kept)] if finding.kept else now.jacobian[:0]
        check_massless_directions(assembly, now, constraint_jacobian, sizes, (t, q, u))
    if finding.starts_singular:
        raise _singular_start(assembly, finding)
    dependent: tuple[tuple[int, ...], tuple[int, ...]] = (), ()
    if assembly.form == "reduced" and now is not None and finding.kept:
        dependent = dependent_speeds_of(balance, finding, now.jacobian, sizes)
    program = assembly.form_program(kept_rows(finding), *dependent)
    kept = np.asarray(finding.kept, dtype=np.intp) if finding.redundant else None
    if accelerations is None:
        accelerations, _ = balance.accelerate(t, q, u, kept, now)
    share, moving = seen_from_afar(assembly, q, u, length, span)
    scales = find_scales(assembly, length, moving, accelerations, sizes, span)
    not_compilable = find_not_compilable(assembly)
    parts = assembly, balance, finding, scales, sizes, coordinate_sizes, program, *dependent
    return SceneProblem(*parts, not_compilable=not_compilable, relative_share=share)


def _singular_start(assembly: Assembly, finding: RankFinding) -> StartError:
    constraints = assembly.own_equations.constraints
    lost = [constraints[i].label for i in finding.lost_at_start]
    return StartError(
        "the start is a singular position, from which the mechanism has more than one possible motion: "
        f"{', '.join(lost)} {'follows' if len(lost) == 1 else 'follow'} from the other constraints here "
        "and nowhere near",
        where=constraints[finding.lost_at_start[0]].key[0],
        advice="Start at a small distance from it, on the branch that you want.",
    )


def pack_state(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return consistent y and y' from a state that fulfils the constraints."""
    accelerations, multipliers = plan.balance.accelerate(t, q, u, plan.kept)
    if plan.assembly.form == "dae":
        tail = [multipliers, np.zeros(plan.program.extra)]
    else:
        tail = []
    y = np.concatenate([q, u, *tail])
    yp = np.concatenate([plan.balance.kinematic_map.rates(t, q, u), accelerations, *(np.zeros_like(x) for x in tail)])
    return y, yp


_NOT_COMPILABLE: Key[str] = Key("what cannot be compiled")

_PLAIN = ("potential", "dissipation", "force", "inertia", "lagrangian", "derivative")


def find_not_compilable(assembly: Assembly, program: Program | None = None) -> str:
    """Return what keeps a program, or the scene's equations, from being compiled, with the component and the law.

    It is empty if nothing does.
    """
    return assembly.shared.get(_NOT_COMPILABLE, lambda: _describe(assembly, program), program)


def announce(assembly: Assembly, not_compilable: str) -> None:
    """Warn that a scene runs through kernels in Python."""
    warnings.warn(
        f"{assembly.flat.name} is evaluated in Python, which is slower: {not_compilable}. Write it in plain "
        "arithmetic with Atwood's functions to have it compiled.",
        stacklevel=2,
    )


def _is_obstacle(operation: str) -> bool:
    from atwood.codegen.llvm.text import has_code  # not with this module: code that is cached needs no more of LLVM

    return not has_code(operation)


def _describe(assembly: Assembly, program: Program | None) -> str:
    if not any(map(_is_obstacle, assembly.own_equations.graph.operations)):
        return ""
    nodes = live(_written(assembly.own_equations)) if program is None else program.nodes
    kinds = {node.operation: node for node in nodes}
    obstacle = next((node for node in kinds.values() if _is_obstacle(node.operation)), None)
    if obstacle is None:
        return ""
    for path, local in assembly.mechanism.locals_.items():
        for law, expressions in _laws(local):
            for node in live(expressions):
                if _is_obstacle(node.operation):
                    return f"{path}.{law} {_reason(node)}"
    return f"an equation {_reason(obstacle)}"


def _written(equations: Equations) -> Iterator[Expression]:
    """Yield all that equations are made of."""
    yield from equations.rows_with_multipliers or equations.rows
    yield from (*equations.rates, *equations.constraint_rows)
    for one in equations.constraints:
        yield from (each for each in (one.value, one.rate) if each is not None)


def _reason(node: Expression) -> str:
    if node.operation == "external":
        if node.payload.is_smooth:  # its author knows of it: it stands for what cannot be written in Atwood's functions
            return f"calls {node.payload.name!r}, which is foreign code"
        return f"calls the function {node.payload.name!r} in Python"
    return f"needs the operation {node.operation!r}, for which there is no machine code"


def _laws(local: LocalPart) -> Iterator[tuple[str, list[Expression]]]:
    """Yield the laws and inputs of a part, by name, with what they compute."""
    for name in local.part.signals:
        yield name, list(_expressions(local.binding.values[name]))
    for joint in local.joints:
        yield joint.law.name, list(_expressions(joint.placement))
    for constraint in local.constraints:
        yield constraint.law.name, [constraint.value]
    component = local.part.component
    bound = bind(component, local.binding)
    for kind in _PLAIN:
        for law in component.laws(kind):  # type: ignore[arg-type]
            if law.holds_in(local.binding.space):
                yield law.name, list(_expressions(getattr(bound, law.name)()))


def _expressions(value: Any) -> Iterator[Expression]:
    """Yield the expressions inside whatever a law returns."""
    if isinstance(value, Expression):
        yield value
    elif isinstance(value, (list, tuple, Vector)):
        for one in value:
            yield from _expressions(one)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from _expressions(getattr(value, field.name))
    elif isinstance(value, Iterator):
        yield from _expressions(list(value))
