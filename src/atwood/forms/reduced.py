"""The reduced form: generalized coordinates (Lagrange's equations of the second kind).

Loops that could not be eliminated stay as ``g(q) = 0`` with dependent coordinates among the unknowns. The equations
of motion are projected on the null space of the constraints, in which the dependent speeds follow from the
independent ones; so there are no multipliers, and the index is 1.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from atwood.expr import Expression, jacobian, solve
from atwood.forms.program import FormProgram, either_sign, kinematic_rows, make_form_program, rows_along_speeds
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.graph import connected_groups

__all__ = ["reduced_form"]


def reduced_form(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    rows: Sequence[Expression],
    dependent: Sequence[int] = (),
    dependent_speeds: Sequence[int] | None = None,
) -> FormProgram:
    """Return the reduced form of a scene.

    Parameters
    ----------
    name
        Named in messages.
    equations
        Equations in the coordinates of the forest.
    parameters
        The symbols of parameters.
    rows
        The equations' rows, perhaps rewritten.
    dependent
        With loops: one speed for each constraint on positions, chosen so that these can be solved for what moves with
        them.
    dependent_speeds
        One speed for each constraint; the same ones when None.
    """
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
