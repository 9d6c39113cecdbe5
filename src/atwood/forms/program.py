"""A form of a scene as programs: the residual for the solver, its Jacobian, and the balance of forces."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, live, substitute
from atwood.mechanics.equations import Equations

__all__ = ["BalanceProgram", "FormProgram", "Level", "balance_program", "either_sign", "make_form_program"]

Level = Literal["", "ggl", "index1", "index1-projected"]


@dataclass(frozen=True)
class FormProgram:
    """The equations ``F(t, y, y') = 0`` of one form, with ``y = (q, u, multipliers)``.

    Attributes
    ----------
    form, level
        Which form it is; the level is empty for the reduced form.
    residual
        Program of (t, y, yp) with F.
    jacobian
        Program of (t, y, yp, cj) with the entries of ``dF/dy + cj dF/dy'``.
    rows, columns
        Where these entries are, by column and then by row.
    coordinates
        Number of coordinates; there are as many speeds.
    multipliers
        Number of multipliers of constraint forces.
    extra
        Number of further multipliers, which keep positions on the constraints.
    algebraic
        Unknowns whose derivative does not appear.
    independent
        With loops in the reduced form: the coordinates that are integrated; the others follow from them.
    """

    form: Literal["reduced", "dae"]
    level: Level
    residual: Program
    jacobian: Program
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    coordinates: int
    multipliers: int
    extra: int
    algebraic: tuple[int, ...]
    independent: tuple[int, ...]

    @property
    def size(self) -> int:
        """Length of y."""
        return 2 * self.coordinates + self.multipliers + self.extra

    @property
    def operations(self) -> dict[str, int]:
        """Operations of one residual, by kind."""
        return dict(self.residual.operations)


@dataclass(frozen=True)
class BalanceProgram:
    """The balance of forces ``M a + bias = G^T lambda``, ``G a + gamma = 0`` at a position and velocity.

    Attributes
    ----------
    program
        Program of (t, q, u) with the entries of M, bias, the constraints' values, rates and gamma, the entries of G,
        and the rates' part that is not linear in the speeds.
    mass_rows, mass_columns, slope_rows, slope_columns
        Where the entries of M and G are.
    size
        Number of coordinates.
    constraints
        Number of constraints.
    """

    program: Program
    mass_rows: NDArray[np.intp]
    mass_columns: NDArray[np.intp]
    slope_rows: NDArray[np.intp]
    slope_columns: NDArray[np.intp]
    size: int
    constraints: int


def state_groups(equations: Equations) -> tuple[InputGroup, ...]:
    """Return the input groups (t, q, u) of programs of a state."""
    return (
        InputGroup("t", (equations.time,)),
        InputGroup("q", equations.coordinates),
        InputGroup("u", equations.speeds),
    )


def rate_symbols(equations: Equations) -> tuple[Expression, ...]:
    """Return the symbols of the coordinates' derivatives in y'."""
    return tuple(equations.graph.symbol(f"rate:{c.name}") for c in equations.names)


def either_sign(row: Expression) -> Expression:
    """Return a row that is to be zero, without a minus sign before all of it."""
    return row.arguments[0] if row.operation == "neg" else row


def make_form_program(
    name: str,
    form: Literal["reduced", "dae"],
    level: Level,
    equations: Equations,
    parameters: Collection[Expression],
    residual: Sequence[Expression],
    multipliers: Sequence[Expression] = (),
    extra: Sequence[Expression] = (),
    independent: Sequence[int] = (),
) -> FormProgram:
    """Put a residual into programs, with its Jacobian by forward derivatives.

    Parameters
    ----------
    name
        Named in messages.
    form, level, equations
        What the residual belongs to.
    parameters
        The symbols of parameters.
    residual
        F, in terms of time, coordinates, their rates, speeds, accelerations and multipliers.
    multipliers, extra
        Symbols of the multipliers.
    independent
        See `FormProgram`.
    """
    graph = equations.graph
    rates = rate_symbols(equations)
    y = (*equations.coordinates, *equations.speeds, *multipliers, *extra)
    idle = tuple(graph.symbol(f"rate of {s.name}") for s in (*multipliers, *extra))
    yp = (*rates, *equations.accelerations, *idle)
    appearing = set(live(residual))
    cj = graph.symbol("cj")
    entries = jacobian(list(residual), [{a: 1.0, b: cj} for a, b in zip(y, yp, strict=True)])
    t = InputGroup("t", (equations.time,))
    groups = (t, InputGroup("y", y), InputGroup("yp", yp))
    known = tuple(parameters)
    return FormProgram(
        form,
        level,
        Program(f"{name} residual", groups, known, (OutputGroup("residual", tuple(residual)),)),
        Program(
            f"{name} Jacobian",
            (*groups, InputGroup("cj", (cj,))),
            known,
            (OutputGroup("entries", tuple(entries.entries)),),
        ),
        np.asarray(entries.rows, dtype=np.intp),
        np.asarray(entries.columns, dtype=np.intp),
        len(equations.coordinates),
        len(multipliers),
        len(extra),
        tuple(i for i, rate in enumerate(yp) if rate not in appearing),
        tuple(independent),
    )


def balance_program(name: str, equations: Equations, parameters: Collection[Expression]) -> BalanceProgram:
    """Return the balance of forces of a set of equations.

    Parameters
    ----------
    name
        Named in messages.
    equations
        The equations, of either form.
    parameters
        The symbols of parameters.
    """
    at_rest = dict.fromkeys(equations.accelerations, 0.0)
    mass = jacobian(list(equations.rows), list(equations.accelerations))
    rates = [one.rate for one in equations.constraints]
    slope = jacobian(rates, list(equations.speeds))
    still = dict.fromkeys(equations.speeds, 0.0)
    outputs = (
        OutputGroup("mass", tuple(mass.entries)),
        OutputGroup("bias", tuple(substitute(list(equations.rows), at_rest))),
        OutputGroup("value", tuple(one.value for one in equations.constraints)),
        OutputGroup("rate", tuple(rates)),
        OutputGroup("gamma", tuple(substitute([one.second for one in equations.constraints], at_rest))),
        OutputGroup("slope", tuple(slope.entries)),
        OutputGroup("drift", tuple(substitute(rates, still))),
    )
    inputs = state_groups(equations)
    return BalanceProgram(
        Program(f"{name} balance", inputs, tuple(parameters), outputs),
        np.asarray(mass.rows, dtype=np.intp),
        np.asarray(mass.columns, dtype=np.intp),
        np.asarray(slope.rows, dtype=np.intp),
        np.asarray(slope.columns, dtype=np.intp),
        len(equations.coordinates),
        len(equations.constraints),
    )
