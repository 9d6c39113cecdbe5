"""The rows of both forms: reduced (Lagrange's equations of the second kind) and dae (of the first kind).

In the reduced form loops that could not be eliminated stay as ``g(q) = 0`` with dependent coordinates among the
unknowns. The equations of motion are projected on the null space of the constraints, in which the dependent speeds
follow from the independent ones; so there are no multipliers, and the index is 1. The rows depend on the choice of
dependent coordinates, and the choice can change between two steps. What does not depend on it is a stack of kinematic
rows, balances of forces, constraints and rates, with the constraint Jacobian; from these and from the derivatives at
given multipliers, residual and Jacobian follow by linear algebra on numbers.

In the dae form constraints stay, with one Lagrange multiplier each.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import cast

import numpy as np

from atwood.arrays import IndexArray
from atwood.errors import UsageError, check_known
from atwood.expr import (
    Expression,
    InputGroup,
    OutputGroup,
    Program,
    depends_on,
    jacobian,
    live,
    select,
    solve,
    sqrt,
    substitute,
)
from atwood.forms.program import (
    NO_PULL,
    FormProgram,
    Level,
    Pull,
    either_sign,
    kinematic_rows,
    make_form_program,
    rate_symbols,
    rows_along_speeds,
)
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.graph import connected_groups


def reduced_form(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    rows: Callable[[], Sequence[Expression]],
    dependent: Sequence[int] = (),
    dependent_speeds: Sequence[int] | None = None,
    pull: Callable[[], Pull] = Pull,
) -> FormProgram:
    """Return the reduced form of a scene.

    What makes its equations of motion is called when the residual is made; where there are loops every method reads
    them.
    """
    if not equations.constraints:

        def tree() -> list[Expression]:
            held = pull()
            return [*held.of_rates(kinematic_rows(equations)), *held.of_motion(rows())]

        return make_form_program(name, "reduced", "", equations, parameters, tree)
    balances, kinematic = rows(), rows_along_speeds(equations)
    independent = _others(kinematic, dependent)
    given = sorted(dependent if dependent_speeds is None else dependent_speeds)

    def residual() -> list[Expression]:
        held = pull()
        return [
            *held.of_rates([kinematic[i] for i in independent]),
            *(either_sign(one.value) for one in equations.constraints if one.value is not None),
            *held.of_motion(_project(equations, balances, given, _others(equations.speeds, given))),
            *(either_sign(one.rate) for one in equations.constraints),
        ]

    return make_form_program(name, "reduced", "", equations, parameters, residual, independent=independent)


def _others(symbols: Sequence[Expression], chosen: Sequence[int]) -> list[int]:
    """Return the numbers of what was not chosen."""
    return [i for i in range(len(symbols)) if i not in set(chosen)]


def _project(
    equations: Equations, rows: Sequence[Expression], dependent: Sequence[int], independent: Sequence[int]
) -> list[Expression]:
    """Return ``r_i - G_i^T G_d^-T r_d``, solving separately for loops that share nothing."""
    constraint_jacobian = jacobian([one.rate for one in equations.constraints], list(equations.speeds))
    entry = {(r, c): e for r, c, e in constraint_jacobian.triples}
    given = set(dependent)
    sharing = [(("constraint", r), ("speed", c)) for r, c in entry if c in given]
    members = [("constraint", r) for r in range(len(equations.constraints))]
    members += dict.fromkeys(speed for _, speed in sharing)
    weights: dict[int, Expression] = {}
    for group in connected_groups(members, sharing):
        constraints = sorted(i for kind, i in group if kind == "constraint")
        speeds = sorted(i for kind, i in group if kind == "speed")
        zero = equations.graph.constant(0.0)
        matrix = [[entry.get((r, c), zero) for r in constraints] for c in speeds]
        found = solve(matrix, [rows[c] for c in speeds])
        weights.update(zip(constraints, found, strict=True))
    projected = []
    for i in independent:
        total = rows[i]
        for r, weight in sorted(weights.items()):
            if (r, i) in entry:
                total = total - entry[r, i] * weight
        projected.append(total)
    return projected


@dataclass(frozen=True)
class NullSpaceProgram:
    """The stack ``(K, r, g, g')`` and its derivatives, with ``r - G^T lambda`` in the place of r.

    Attributes
    ----------
    stack
        Program of (t, y, yp) with the stack, followed by the entries of G: the constraints' rates by the speeds.
    jacobian_rows, jacobian_columns
        Where the entries of G are.
    derivatives
        Program of (t, y, yp, cj, multipliers) with the entries of ``d/dy + cj d/dy'`` of the stack.
    rows, columns
        Where these entries are, by column and then by row.
    coordinates, speeds, values, rates
        How many kinematic rows and coordinates, balances and speeds, constraints, and rates of constraints there are.
    """

    stack: Program
    jacobian_rows: IndexArray
    jacobian_columns: IndexArray
    derivatives: Program
    rows: IndexArray
    columns: IndexArray
    coordinates: int
    speeds: int
    values: int
    rates: int


def null_space_program(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    rows: Sequence[Expression],
    pull: Pull = NO_PULL,
) -> NullSpaceProgram:
    """Return what the reduced form of a mechanism with loops is made of."""
    rates, rows = rate_symbols(equations), pull.of_motion(rows)
    kinematic = pull.of_rates(rows_along_speeds(equations))
    values = [either_sign(one.value) for one in equations.constraints if one.value is not None]
    speeds = [either_sign(one.rate) for one in equations.constraints]
    constraint_jacobian = jacobian([one.rate for one in equations.constraints], list(equations.speeds))
    y = (*equations.coordinates, *equations.speeds)
    yp = (*rates, *equations.accelerations)
    cj = equations.graph.symbol("cj")
    balanced = [row - force for row, force in zip(rows, equations.constraint_rows, strict=True)]
    found = jacobian([*kinematic, *balanced, *values, *speeds], [{a: 1.0, b: cj} for a, b in zip(y, yp, strict=True)])
    groups = (InputGroup("t", (equations.time,)), InputGroup("y", y), InputGroup("yp", yp))
    more = (InputGroup("cj", (cj,)), InputGroup("multipliers", equations.multipliers))
    stack = OutputGroup("stack", (*kinematic, *rows, *values, *speeds, *constraint_jacobian.entries))
    return NullSpaceProgram(
        Program(f"{name} residual", groups, tuple(parameters), (stack,)),
        np.asarray(constraint_jacobian.rows, dtype=np.intp),
        np.asarray(constraint_jacobian.columns, dtype=np.intp),
        Program(f"{name} Jacobian", (*groups, *more), tuple(parameters), (OutputGroup("entries", found.entries),)),
        np.asarray(found.rows, dtype=np.intp),
        np.asarray(found.columns, dtype=np.intp),
        len(equations.coordinates),
        len(equations.speeds),
        len(values),
        len(speeds),
    )


LEVELS: tuple[Level, ...] = ("ggl", "index1", "index1-projected")

_TINY = 1e-300
"""In place of a square that is zero."""


def check_level(level: str, form: str) -> None:
    """Refuse a level that would change nothing."""
    if form == "reduced" and level != "ggl":
        raise UsageError(
            f"the reduced form has no levels, and no {level!r}: its constraints are eliminated",
            advice="Give form='dae' with it, or leave level out.",
        )


def dae_form(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    level: str,
    tidy: Callable[[Sequence[Expression]], list[Expression]] = list,
    pull: Callable[[], Pull] = Pull,
) -> FormProgram:
    """Return the dae form of a scene at a level.

    ``ggl``, the stabilised index-2 form of Gear, Gupta and Leimkuhler (J. Comput. Appl. Math. 12, 1985), holds
    position and velocity constraints, with a second set of multipliers that shifts positions onto the constraints. One
    over the square of the scene's size follows the parameters there: shifts in metres and in radians are compared.
    ``index1`` holds the constraints' second derivative and drifts; ``index1-projected`` is the same, with what comes
    out of it projected.
    """
    check_known(level, LEVELS, f"there is no level {level!r} of the dae form", where="")
    multipliers = equations.multipliers
    chosen: Level = "ggl" if level == "ggl" or not multipliers else cast("Level", level)
    constraints = equations.constraints
    extra = {
        one.multiplier: equations.graph.symbol(f"mu:{one.multiplier.name}")
        for one in (constraints if chosen == "ggl" else ())
        if one.value is not None
    }

    lever = equations.graph.symbol("one over the square of the scene's size")

    def residual() -> list[Expression]:
        rows, pulled = _smooth_at_zero(equations.rows_with_multipliers, multipliers) or equations.rows, pull()
        dynamic = pulled.of_motion([r - f for r, f in zip(rows, equations.constraint_rows, strict=True)])
        if chosen == "ggl":
            kinematic = _shifted(equations, extra, lever) if multipliers else kinematic_rows(equations)
            values = [one.value for one in constraints if one.value is not None]
            held = values + [one.rate for one in constraints]
        else:
            kinematic = kinematic_rows(equations)
            held = [one.second for one in constraints]
        return tidy(pulled.of_rates(kinematic) + dynamic + [either_sign(one) for one in held])

    known = (*parameters, lever) if extra else parameters
    return make_form_program(name, "dae", chosen, equations, known, residual, multipliers, tuple(extra.values()))


def _smooth_at_zero(rows: Sequence[Expression], multipliers: Sequence[Expression]) -> list[Expression]:
    """Return rows in which roots of multipliers, such as the size of a force, have the slope zero at zero.

    Newton's method asks for it where nothing presses; the values are the same but for 1e-150.
    """
    if not rows:
        return []
    roots = [node for node in live(rows) if node.operation == "sqrt" and depends_on(node, multipliers)]
    inside = {root: root.arguments[0] for root in roots}
    guarded = {root: sqrt(select(one > 0.0, one, _TINY)) for root, one in inside.items()}
    return substitute(list(rows), guarded) if guarded else list(rows)


def _shifted(equations: Equations, extra: Mapping[Expression, Expression], lever: Expression) -> list[Expression]:
    """Return the kinematic rows that keep positions on the constraints by multipliers in the place of others.

    What turns is shifted as a point at the scene's size from the axis is, so that no unit of length counts.
    """
    symbols = {one.multiplier: extra.get(one.multiplier, equations.graph.zero) for one in equations.constraints}
    along = substitute(list(equations.constraint_rows), symbols)
    shift = [by if one.unit == "m/s" else by * lever for by, one in zip(along, equations.speed_names, strict=True)]
    return kinematic_rows(equations, shift=shift)


def keep_constraints(equations: Equations, kept: Sequence[int]) -> Equations:
    """Return the equations with some of their constraints only; the multipliers of the others are zero."""
    chosen = set(kept)
    gone = {one.multiplier: 0.0 for i, one in enumerate(equations.constraints) if i not in chosen}
    if not gone:
        return equations
    return replace(
        equations,
        constraints=tuple(one for i, one in enumerate(equations.constraints) if i in chosen),
        constraint_rows=tuple(substitute(list(equations.constraint_rows), gone)),
    )
