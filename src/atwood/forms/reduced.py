"""The reduced form: generalized coordinates (Lagrange's equations of the second kind).

Loops that could not be eliminated stay as ``g(q) = 0`` with dependent coordinates among the unknowns. The equations
of motion are projected on the null space of the constraints, in which the dependent speeds follow from the
independent ones; so there are no multipliers, and the index is 1.

The rows depend on the choice of dependent coordinates, and the choice can change between two steps. What does not
depend on it is a stack of kinematic rows, balances of forces, constraints and rates, with the constraint Jacobian; from
these and from the derivatives at given multipliers, residual and Jacobian follow by linear algebra on numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from atwood.arrays import IndexArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, solve
from atwood.forms.program import (
    FormProgram,
    either_sign,
    kinematic_rows,
    make_form_program,
    rate_symbols,
    rows_along_speeds,
)
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.graph import connected_groups


def reduced_form(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    rows: Sequence[Expression],
    dependent: Sequence[int] = (),
    dependent_speeds: Sequence[int] | None = None,
) -> FormProgram:
    """Return the reduced form of a scene."""
    if not equations.constraints:
        residual = [*kinematic_rows(equations), *rows]
        return make_form_program(name, "reduced", "", equations, parameters, residual)
    kinematic = rows_along_speeds(equations)
    independent = _others(kinematic, dependent)
    given = sorted(dependent if dependent_speeds is None else dependent_speeds)
    projected = _project(equations, rows, given, _others(equations.speeds, given))
    residual = [
        *(kinematic[i] for i in independent),
        *(either_sign(one.value) for one in equations.constraints if one.value is not None),
        *projected,
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
    entry = {
        (r, c): e
        for r, c, e in zip(
            constraint_jacobian.rows, constraint_jacobian.columns, constraint_jacobian.entries, strict=True
        )
    }
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
    name: str, equations: Equations, parameters: Collection[Expression], rows: Sequence[Expression]
) -> NullSpaceProgram:
    """Return what the reduced form of a mechanism with loops is made of."""
    rates = rate_symbols(equations)
    kinematic = rows_along_speeds(equations)
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
