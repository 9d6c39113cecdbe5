"""A form of a scene as programs: the residual for the solver, its Jacobian, and the balance of forces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager
from functools import cached_property, partial, reduce
from operator import add
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import (
    Expression,
    InputGroup,
    OutputGroup,
    Program,
    SparseMatrix,
    jacobian,
    jvp,
    live,
    substitute,
)
from atwood.forms.derivative import Derivative, derive, directions, is_too_long
from atwood.late import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.orientation_coordinates import OrientationCoordinates

__all__ = [
    "BalanceProgram",
    "FormProgram",
    "Level",
    "RatesProgram",
    "balance_program",
    "either_sign",
    "kinematic_rows",
    "make_form_program",
    "rates_are_speeds",
    "rates_program",
    "rows_along_speeds",
    "state_groups",
]

Level = Literal["", "ggl", "index1", "index1-projected"]


@dataclass(frozen=True, eq=False)
class FormProgram:
    """The equations ``F(t, y, y') = 0`` of one form, with ``y = (q, u, multipliers, extra)``.

    Attributes
    ----------
    form, level
        Which form it is; the level is empty for the reduced form.
    residual
        Program of (t, y, yp) with F.
    derive
        Makes its Jacobian; see `derivative`.
    coordinates, speeds
        Number of coordinates and of speeds.
    multipliers
        Number of multipliers of constraint forces.
    extra
        Number of further multipliers, which keep positions on the constraints.
    algebraic
        Unknowns whose derivative does not appear.
    independent
        With loops in the reduced form: the kinematic rows that are kept (see `rows_along_speeds`): the coordinates, or
        what moves with the speeds, that are integrated; the others follow from them.
    """

    form: Literal["reduced", "dae"]
    level: Level
    residual: Program
    derive: Callable[[], Derivative]
    coordinates: int
    speeds: int
    multipliers: int
    extra: int
    algebraic: tuple[int, ...]
    independent: tuple[int, ...]

    @cached_property
    def derivative(self) -> Derivative:
        """The Jacobian ``dF/dy + cj dF/dy'``, made when it is first asked for: explicit methods need none."""
        return self.derive()

    def with_lock(self, lock: AbstractContextManager[Any]) -> FormProgram:
        """Return the same with a lock that is held while the Jacobian is made."""

        def derive() -> Derivative:
            with lock:
                return self.derivative

        return replace(self, derive=derive)

    @property
    def jacobian(self) -> Program:
        """The program of the Jacobian: its entries, or by columns its product with a direction."""
        return self.derivative.program

    @property
    def rows(self) -> NDArray[np.intp]:
        """The row of each entry."""
        return self.derivative.rows

    @property
    def columns(self) -> NDArray[np.intp]:
        """The column of each entry."""
        return self.derivative.columns

    @property
    def size(self) -> int:
        """Length of y."""
        return self.coordinates + self.speeds + self.multipliers + self.extra

    def split(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and speeds of a vector y, without copying."""
        n = self.coordinates
        return y[:n], y[n : n + self.speeds]

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
        and the rates' part that is not linear in the speeds. M and G belong to the speeds. The value of a constraint
        on velocities alone is zero.
    mass_rows, mass_columns, jacobian_rows, jacobian_columns
        Where the entries of M and G are.
    speeds
        Number of speeds.
    constraints
        Number of constraints.
    holonomic
        Numbers of the constraints that hold positions.
    mass_product
        Where the mass matrix is full and too long to be written out: the program of (t, q, u, direction) with its
        product with a direction; `program` then has no entries of it.
    """

    program: Program
    mass_rows: NDArray[np.intp]
    mass_columns: NDArray[np.intp]
    jacobian_rows: NDArray[np.intp]
    jacobian_columns: NDArray[np.intp]
    speeds: int
    constraints: int
    holonomic: tuple[int, ...]
    mass_product: Program | None = None

    @cached_property
    def constraints_alone(self) -> Program:
        """The program of the constraints' values, slopes and drifts, without masses and forces.

        Positions are looked at without speeds, where a force in the direction of a velocity has no value.
        """
        groups = {group.name: group for group in self.program.outputs}
        outputs = tuple(groups[name] for name in ("value", "jacobian", "explicit_rate"))
        return replace(self.program, name=f"{self.program.name} of constraints", outputs=outputs)


@dataclass(frozen=True)
class RatesProgram:
    """How coordinates move with the speeds: ``q' = B(q, t) u + b(q, t)``; states of parts do not move with these.

    Attributes
    ----------
    program
        Program of (t, q, u) with the rates and the entries of B; None if the rates are the speeds.
    rows, columns
        Where the entries of B are.
    coordinates, speeds
        Number of coordinates and of speeds.
    orientation_coordinates
        Coordinates that stand for an orientation together.
    """

    program: Program | None
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    coordinates: int
    speeds: int
    orientation_coordinates: tuple[OrientationCoordinates, ...]


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


def rates_are_speeds(equations: Equations) -> bool:
    """Return whether the rate of every coordinate is the speed of the same number."""
    return equations.rates == equations.speeds


def rows_along_speeds(equations: Equations) -> list[Expression]:
    """Return kinematic rows of which each says what one speed does to the coordinates; those without a speed last.

    With loops, the row of a speed that follows from the constraints is left out, and a constraint takes its place. That
    is as good for the coordinates as for the speeds: for an orientation the rows are ``B^T q' = B^T B u``; there
    B^T B is a multiple of one for a quaternion, and one more keeps its size.

    Parameters
    ----------
    equations
        The equations.
    """
    symbols = rate_symbols(equations)
    number = {speed: i for i, speed in enumerate(equations.speeds)}
    rows: dict[int, Expression] = {}
    more: list[Expression] = []
    for orientation in equations.orientation_coordinates:
        rates = [symbols[i] for i in orientation.coordinates]
        speeds = [equations.speeds[i] for i in orientation.speeds]
        found = jacobian([equations.rates[i] for i in orientation.coordinates], speeds)
        entries = list(zip(found.rows, found.columns, found.entries, strict=True))
        if not orientation.is_homogeneous:
            misses = [rate - equations.rates[i] for i, rate in zip(orientation.coordinates, rates, strict=True)]
            rows |= {
                i: _sum([e * misses[r] for r, c, e in entries if c == k]) for k, i in enumerate(orientation.speeds)
            }
            continue
        square = _sum([e * e for _, column, e in entries if column == 0])
        for k, i in enumerate(orientation.speeds):
            rows[i] = _sum([e * rates[r] for r, column, e in entries if column == k]) - square * speeds[k]
        more.append(_sum([equations.coordinates[i] * symbols[i] for i in orientation.coordinates]))
    in_orientations = {i for orientation in equations.orientation_coordinates for i in orientation.coordinates}
    for i, (symbol, rate) in enumerate(zip(symbols, equations.rates, strict=True)):
        if i >= equations.placing:
            more.append(symbol - rate)
        elif i not in in_orientations:
            rows[number[rate]] = symbol - rate
    return [*(rows[i] for i in range(len(equations.speeds))), *more]


def _sum(terms: Sequence[Expression]) -> Expression:
    return reduce(add, terms)


def kinematic_rows(equations: Equations, shift: Sequence[Expression] | None = None) -> list[Expression]:
    """Return, for each coordinate, the row that says how it moves with the speeds.

    Parameters
    ----------
    equations
        The equations.
    shift
        For each speed, what is taken from it first.
    """
    symbols = rate_symbols(equations)
    number = {speed: i for i, speed in enumerate(equations.speeds)}
    rows = []
    for i, (symbol, rate) in enumerate(zip(symbols, equations.rates, strict=True)):
        if shift is None or i >= equations.placing:
            rows.append(symbol - rate)
        elif rate in number:
            rows.append(symbol - rate + shift[number[rate]])
        else:
            less = {speed: speed - by for speed, by in zip(equations.speeds, shift, strict=True)}
            rows.append(symbol - substitute([rate], less)[0])
    return rows


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
    groups = (InputGroup("t", (equations.time,)), InputGroup("y", y), InputGroup("yp", yp))
    known = tuple(parameters)
    # With loops, rows are chosen anew along a run, by functions that are written entry by entry.
    by_columns = form == "reduced" and not independent
    return FormProgram(
        form,
        level,
        Program(f"{name} residual", groups, known, (OutputGroup("residual", tuple(residual)),)),
        partial(derive, f"{name} Jacobian", tuple(residual), groups, known, by_columns),
        len(equations.coordinates),
        len(equations.speeds),
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
    inputs, known = state_groups(equations), tuple(parameters)
    mass, product = SparseMatrix((), (), ()), None
    if equations.forest.form == "reduced" and is_too_long(equations.rows, equations.accelerations):
        along = directions(equations.accelerations)
        moved = jvp(list(equations.rows), dict(zip(equations.accelerations, along.symbols, strict=True)))
        groups = (*inputs, along)
        product = Program(f"{name} mass", groups, known, (OutputGroup("product", tuple(moved)),))
    else:
        mass = jacobian(list(equations.rows), list(equations.accelerations))
    rates = [one.rate for one in equations.constraints]
    values = [one.value for one in equations.constraints]
    constraint_jacobian = jacobian(rates, list(equations.speeds))
    still = dict.fromkeys(equations.speeds, 0.0)
    outputs = (
        OutputGroup("mass", tuple(mass.entries)),
        OutputGroup("bias", tuple(substitute(list(equations.rows), at_rest))),
        OutputGroup("value", tuple(equations.graph.zero if v is None else v for v in values)),
        OutputGroup("rate", tuple(rates)),
        OutputGroup("gamma", tuple(substitute([one.second for one in equations.constraints], at_rest))),
        OutputGroup("jacobian", tuple(constraint_jacobian.entries)),
        OutputGroup("explicit_rate", tuple(substitute(rates, still))),
    )
    return BalanceProgram(
        Program(f"{name} balance", inputs, known, outputs),
        np.asarray(mass.rows, dtype=np.intp),
        np.asarray(mass.columns, dtype=np.intp),
        np.asarray(constraint_jacobian.rows, dtype=np.intp),
        np.asarray(constraint_jacobian.columns, dtype=np.intp),
        len(equations.speeds),
        len(equations.constraints),
        tuple(i for i, one in enumerate(equations.constraints) if one.holonomic),
        product,
    )


def rates_program(name: str, equations: Equations, parameters: Collection[Expression]) -> RatesProgram:
    """Return how the coordinates of a set of equations move with its speeds.

    Parameters
    ----------
    name
        Named in messages.
    equations
        The equations, of either form.
    parameters
        The symbols of parameters.
    """
    sizes = (len(equations.coordinates), len(equations.speeds))
    if rates_are_speeds(equations):
        everyone = np.arange(sizes[0], dtype=np.intp)
        return RatesProgram(None, everyone, everyone, *sizes, equations.orientation_coordinates)
    tangent = jacobian(list(equations.rates[: equations.placing]), list(equations.speeds))
    outputs = (OutputGroup("rates", equations.rates), OutputGroup("matrix", tuple(tangent.entries)))
    return RatesProgram(
        Program(f"{name} rates", state_groups(equations), tuple(parameters), outputs),
        np.asarray(tangent.rows, dtype=np.intp),
        np.asarray(tangent.columns, dtype=np.intp),
        *sizes,
        equations.orientation_coordinates,
    )
