"""How a scene is prepared to be run from a consistent state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, KernelEvaluationError, StartError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import replace
from atwood.numerics.matrices import to_array
from atwood.simulation.dynamics.balance import balance_of, solve_balance
from atwood.simulation.dynamics.numerical_failure import ADVICE_AT_START, undefined_value_at
from atwood.simulation.dynamics.reactions import check_read_reactions
from atwood.simulation.dynamics.redundancy import RankFinding, find_rank
from atwood.simulation.dynamics.scales import coordinate_scales, find_scales, motion_scales, seen_from_afar
from atwood.simulation.initialization.mobility import check_massless_directions
from atwood.simulation.problem.not_compilable import announce, find_not_compilable

if TYPE_CHECKING:
    pass
from atwood.simulation.problem.problem import Plan, dependent_speeds_of, kept_rows

_PLAN: Key[Plan] = Key("plan")


def make_plan(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float) -> Plan:
    """Prepare a run from a consistent state in the coordinates of the form."""
    about = t, q.tobytes(), u.tobytes(), length, span
    made = assembly.kept.get(_PLAN, lambda: _make_plan(assembly, t, q, u, length, span), *about)
    if made.not_compilable:
        announce(assembly, made.not_compilable)
    return replace(made)  # its dependent coordinates change on the way


def plan_of_run(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float) -> Plan:
    """Return the plan of a mode, as `make_plan` does; if a law has no value there, it is named."""
    try:
        return make_plan(assembly, t, q, u, length, span)
    except UnsupportedError:
        raise
    except AtwoodError as error:
        found = undefined_value_at(assembly, t, q, u)
        if found is None:
            raise
        raise StartError(
            f"{found.describe()}, so that the run cannot start", where=found.part, advice=ADVICE_AT_START
        ) from error


def _make_plan(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, span: float) -> Plan:
    equations = assembly.own_equations
    balance = balance_of(assembly, assembly.form)
    sizes, coordinate_sizes = motion_scales(equations, length), coordinate_scales(equations, length)
    finding = find_rank(balance, t, q, sizes)
    check_read_reactions(assembly, t, q, u, length)
    try:
        now = balance.at(t, q, u)
    except KernelEvaluationError as error:
        raise StartError(
            f"at the start a law has no value: {error.message}",
            where=assembly.flat.name,
            advice=ADVICE_AT_START,
        ) from error
    constraint_jacobian = now.jacobian[list(finding.kept)] if finding.kept else now.jacobian[:0]
    check_massless_directions(assembly, now.mass, constraint_jacobian, sizes, (t, q, u))
    if finding.starts_singular:
        raise _singular_start(assembly, finding)
    dependent: tuple[tuple[int, ...], tuple[int, ...]] = (), ()
    if assembly.form == "reduced" and finding.kept:
        dependent = dependent_speeds_of(balance, finding, to_array(now.jacobian), sizes)
    program = assembly.form_program(kept_rows(finding), *dependent)
    kept = np.asarray(finding.kept, dtype=np.intp) if finding.redundant else None
    accelerations, _ = solve_balance(now, kept, t)
    share, moving = seen_from_afar(assembly, q, u, length, span)
    scales = find_scales(assembly, length, moving, accelerations, sizes, span)
    not_compilable = find_not_compilable(assembly, program.residual)
    parts = assembly, balance, finding, scales, sizes, coordinate_sizes, program, *dependent
    return Plan(*parts, not_compilable=not_compilable, relative_share=share)


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


def pack_state(plan: Plan, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return consistent y and y' from a state that fulfils the constraints."""
    now = plan.balance.at(t, q, u)
    accelerations, multipliers = solve_balance(now, plan.kept, t)
    if plan.assembly.form == "dae":
        tail = [multipliers, np.zeros(plan.program.extra)]
    else:
        tail = []
    y = np.concatenate([q, u, *tail])
    yp = np.concatenate([plan.balance.kinematic_map.rates(t, q, u), accelerations, *(np.zeros_like(x) for x in tail)])
    return y, yp
