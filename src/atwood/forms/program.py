"""A form of a scene as programs: the residual for the solver and its Jacobian.

The Jacobian of a long chain in generalized coordinates is full.  Written out entry by entry it grows with the square of
the number of links; its product with one direction is a single forward sweep, which is written once and done for one
column after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import field
from functools import cached_property, reduce
from operator import add
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, jvp, live, substitute, sweeps_exceed
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.stages import stage

Level = Literal["", "ggl", "index1", "index1-projected"]


@dataclass(frozen=True, eq=False)
class FormProgram:
    """The equations ``F(t, y, y') = 0`` of one form, with ``y = (q, u, multipliers, extra)``.

    Attributes
    ----------
    form, level
        Which form it is; the level is empty for the reduced form.
    write
        Makes `residual`.
    derive
        Makes its Jacobian from it; see `derivative`.
    coordinates, speeds
        Number of coordinates and of speeds.
    multipliers
        Number of multipliers of constraint forces.
    extra
        Number of further multipliers, which keep positions on the constraints.
    independent
        With loops in the reduced form: the kinematic rows that are kept (see `rows_along_speeds`): the coordinates, or
        what moves with the speeds, that are integrated; the others follow from them.
    """

    form: Literal["reduced", "dae"]
    level: Level
    write: Callable[[], Program]
    derive: Callable[[Program], Derivative]
    coordinates: int
    speeds: int
    multipliers: int
    extra: int
    independent: tuple[int, ...]

    @cached_property
    def residual(self) -> Program:
        """The program of (t, y, yp) with F, made when it is first asked for: explicit methods need none."""
        return self.write()

    @cached_property
    def derivative(self) -> Derivative:
        """The Jacobian ``dF/dy + cj dF/dy'``, made when it is first asked for."""
        return self.derive(self.residual)

    @cached_property
    def algebraic(self) -> tuple[int, ...]:
        """The unknowns whose derivative does not appear."""
        appearing = set(self.residual.nodes)
        return tuple(i for i, rate in enumerate(self.residual.inputs[2].symbols) if rate not in appearing)

    def with_lock(self, lock: AbstractContextManager[Any]) -> FormProgram:
        """Return the same with a lock that is held while residual and Jacobian are made."""

        def write() -> Program:
            with lock, stage("equations"):
                return self.residual

        def derive(_: Program) -> Derivative:
            with lock, stage("equations"):
                return self.derivative

        return replace(self, write=write, derive=derive)

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


def state_groups(equations: Equations) -> tuple[InputGroup, ...]:
    """Return the input groups (t, q, u) of programs of a state."""
    return equations.inputs[:3]


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
    """
    symbols = rate_symbols(equations)
    number = {speed: i for i, speed in enumerate(equations.speeds)}
    rows: dict[int, Expression] = {}
    more: list[Expression] = []
    for orientation in equations.orientation_coordinates:
        rates = [symbols[i] for i in orientation.coordinates]
        speeds = [equations.speeds[i] for i in orientation.speeds]
        found = jacobian([equations.rates[i] for i in orientation.coordinates], speeds)
        entries = list(found.triples)
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
    """Return, for each coordinate, the row that says how it moves with the speeds."""
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


@dataclass(frozen=True, eq=False)
class Pull:
    """How a motion is pulled onto what it is to hold: nothing if there is none.

    Attributes
    ----------
    speeds, accelerations
        What takes the place of the speeds where they move coordinates, and of their derivatives.
    """

    speeds: Mapping[Expression, Expression] = field(default_factory=dict)
    accelerations: Mapping[Expression, Expression] = field(default_factory=dict)

    def of_rates(self, rows: Sequence[Expression]) -> list[Expression]:
        """Return kinematic rows with it."""
        return substitute(list(rows), self.speeds) if self.speeds else list(rows)

    def of_motion(self, rows: Sequence[Expression]) -> list[Expression]:
        """Return balances of forces with it."""
        return substitute(list(rows), self.accelerations) if self.accelerations else list(rows)


NO_PULL = Pull()


def either_sign(row: Expression) -> Expression:
    """Return a row that is to be zero, without a minus sign before all of it."""
    return row.arguments[0] if row.operation == "neg" else row


def make_form_program(
    name: str,
    form: Literal["reduced", "dae"],
    level: Level,
    equations: Equations,
    parameters: Collection[Expression],
    rows: Callable[[], Sequence[Expression]],
    multipliers: Sequence[Expression] = (),
    extra: Sequence[Expression] = (),
    independent: Sequence[int] = (),
) -> FormProgram:
    """Put a residual, whose rows are made when it is asked for, into programs, with its Jacobian."""

    def write() -> Program:
        symbol = equations.graph.symbol
        idle = tuple(symbol(f"rate of {s.name}") for s in (*multipliers, *extra))
        y = (*equations.coordinates, *equations.speeds, *multipliers, *extra)
        yp = (*rate_symbols(equations), *equations.accelerations, *idle)
        groups = (InputGroup("t", (equations.time,)), InputGroup("y", y), InputGroup("yp", yp))
        return Program(f"{name} residual", groups, tuple(parameters), (OutputGroup("residual", tuple(rows())),))

    # With loops, rows are chosen anew along a run, by functions that are written entry by entry.
    by_columns = (form == "reduced" or bool(equations.contacts)) and not independent
    few = _FEW_AT_CONTACTS if equations.contacts else _FEW
    return FormProgram(
        form,
        level,
        write,
        lambda residual: derive(f"{name} Jacobian", residual, by_columns, few),
        len(equations.coordinates),
        len(equations.speeds),
        len(multipliers),
        len(extra),
        tuple(independent),
    )


_LONGEST = 60_000
"""Entries are written out if no more nodes than these are visited for them.

A chain of 80 links is about that long. There, on one core, the columns of 100 links take 1 ms and its entries 0.03 ms,
which is little beside the 5 ms of a factorisation; to derive and compile them takes 0.1 s instead of 2 s.
"""

_LOOKED = 64
"""Of many more columns than these some are looked at, evenly spread: how full they are is seen in them."""

_FEW, _FEW_AT_CONTACTS = 50, 4
"""Entries for so few unknowns are written out; forces of gaps and slips, as functions of the state, are long."""

_FULL = 0.05
"""A Jacobian is full if a column visits more than this share of the nodes; where it is not, a product wastes work."""


@dataclass(frozen=True)
class Derivative:
    """The Jacobian ``dF/dy + cj dF/dy'``.

    Attributes
    ----------
    program
        Program of (t, y, yp, cj) with the entries; by columns, of (t, y, yp, cj, direction) with the product.
    rows, columns
        Where the entries are, by column and then by row; by columns, everywhere.
    by_columns
        Which of the two it is.
    """

    program: Program
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    by_columns: bool


def is_too_long(
    outputs: Sequence[Expression], wrt: Sequence[Expression | dict[Expression, Expression | float]], few: int = _FEW
) -> bool:
    """Return whether a Jacobian is better done by columns than entry by entry."""
    if len(wrt) < few:
        return False
    every = max(1, len(wrt) // _LOOKED)
    return sweeps_exceed(outputs, wrt[::every], max(_LONGEST, int(_FULL * len(wrt) * len(live(outputs)))) // every)


def directions(symbols: Sequence[Expression]) -> InputGroup:
    """Return a direction: one symbol for each of the given ones."""
    return InputGroup("direction", tuple(s.graph.symbol(f"direction:{s.name}") for s in symbols))


def derive(name: str, program: Program, may_go_by_columns: bool, few: int = _FEW) -> Derivative:
    """Return the Jacobian of a residual."""
    groups, parameters, residual = program.inputs, program.parameters, program.results
    _, (_, y), (_, yp) = groups
    graph = program.graph
    cj = graph.symbol("cj")
    inputs = (*groups, InputGroup("cj", (cj,)))
    wrt: list[dict[Expression, Expression | float]] = [{a: 1.0, b: cj} for a, b in zip(y, yp, strict=True)]
    n = len(y)
    if may_go_by_columns and is_too_long(residual, wrt, few):
        along = directions(y)
        seeds: dict[Expression, Expression | float] = {}
        for a, b, v in zip(y, yp, along.symbols, strict=True):
            seeds[a], seeds[b] = v, cj * v
        outputs = (OutputGroup("product", tuple(jvp(list(residual), seeds))),)
        rows, columns = np.tile(np.arange(n), n), np.repeat(np.arange(n), n)
        return Derivative(Program(name, (*inputs, along), parameters, outputs), rows, columns, True)
    entries = jacobian(list(residual), list(wrt))
    outputs = (OutputGroup("entries", tuple(entries.entries)),)
    rows, columns = np.asarray(entries.rows, dtype=np.intp), np.asarray(entries.columns, dtype=np.intp)
    return Derivative(Program(name, inputs, parameters, outputs), rows, columns, False)
