"""The reduced form of a mechanism with loops, before it is decided which of its coordinates are dependent.

The rows of the reduced form depend on that choice, and the choice can change between two steps. What does not depend
on it is a stack of kinematic rows, balances of forces, constraints and their rates, with the constraint Jacobian;
from these and from the derivatives at given multipliers, residual and Jacobian follow by linear algebra on numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from atwood.arrays import IndexArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian
from atwood.forms.program import either_sign, rate_symbols, rows_along_speeds
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations

__all__ = ["NullSpaceProgram", "null_space_program"]


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
    """Return what the reduced form of a mechanism with loops is made of.

    Parameters
    ----------
    name
        Named in messages.
    equations
        Equations in the coordinates of the forest, with independent constraints.
    parameters
        The symbols of parameters.
    rows
        The equations' rows, perhaps rewritten.
    """
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
