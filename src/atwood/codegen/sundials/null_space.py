"""Rows of a mechanism with loops, projected on the null space of its constraints, as routines with IDA's signatures.

Two kernels compute what does not depend on which coordinates are dependent: the stack ``(K, r, g, g')`` of kinematic
rows, balances of forces, constraints and their rates, with their Jacobian ``G``; and the derivatives of the stack
with ``r - G^T lambda`` in the place of r, at given multipliers.  What does depend on it comes in as numbers:

    lambda = G_d^-T r_d,    F = (K_i, g, r_i - G_i^T lambda, g'),    dF = (..., dR_i - G_i^T G_d^-T dR_d, ...)

where d are the dependent speeds, i the independent ones and R = r - G^T lambda with lambda held.  So another choice of
dependent coordinates is another list of numbers, for which nothing is compiled.  Constraints that share no dependent
speed are solved separately, block by block.

Residual, Jacobian and error weights of a mechanism with loops as IDA calls them, for any choice of coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, default_options
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, Operand, Routine, Value, Variable, call_kernel, place_of
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.residuals import (
    EXPORTS,
    JACOBIAN,
    RESIDUAL,
    Callbacks,
    UserData,
    array_of,
    check_groups,
    index_kind,
    write_weights,
)
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

FIELDS = (
    "derived_residual",
    "derived_jacobian",
    "scratch",
    "relative",
    "absolute",
    "choice",
    "work",
    "sizes",
    "state",
)
"""The pointers of the user's data, in order."""

ATTENTION, RATE, LIMIT = range(3)
"""In the state: whether the choice has become a poor one, cj of the last Jacobian, and what is poor."""


@dataclass(frozen=True)
class NullSpaceShape:
    """How many there are of each.

    Attributes
    ----------
    coordinates, speeds
        The length of q and of u.
    values, rates
        The number of constraints on q and on u.
    """

    coordinates: int
    speeds: int
    values: int
    rates: int

    @property
    def size(self) -> int:
        """The length of y, and the number of rows."""
        return self.coordinates + self.speeds

    @property
    def stack(self) -> int:
        """The number of rows from which those are chosen and projected."""
        return self.size + self.values + self.rates

    @property
    def free(self) -> int:
        """The number of independent speeds."""
        return self.speeds - self.rates

    @cached_property
    def choice(self) -> dict[str, int]:
        """Where the lists of a choice begin; see `atwood.simulation.dynamics.redundancy.Choice`."""
        lengths = {
            "source": self.size,
            "target": self.free,
            "independent": self.free,
            "dependent": self.rates,
            "constraints": self.rates,
            "starts": self.rates + 1,
            "blocks": 1,
        }
        return _places(lengths)

    @cached_property
    def work(self) -> dict[str, int]:
        """Where the arrays of one evaluation begin."""
        m = self.rates
        lengths = {
            "stack": self.stack,
            "jacobian": m * self.speeds,
            "derivatives": self.stack * self.size,
            "multipliers": m,
            "matrix": m * m,
            "pivots": m,
            "side": m,
            "weights": m * self.free,
            "column": m,
        }
        return _places(lengths)


def _places(lengths: dict[str, int]) -> dict[str, int]:
    """Return where arrays begin that lie one after the other, and where the last ends as ``end``."""
    found, total = {}, 0
    for name, length in lengths.items():
        found[name] = total
        total += length
    return found | {"end": total}


def null_space_source(layout: SundialsLayout, shape: NullSpaceShape, sparse: bool) -> RoutineSource:
    """Return what writes residual, Jacobian and error weights with IDA's signatures."""
    files = ("codegen/sundials/residuals.py",)
    return RoutineSource("codegen.sundials.null_space", files, (layout, shape, sparse))


def write_routines(layout: SundialsLayout, shape: NullSpaceShape, sparse: bool) -> list[Routine]:
    """Write the routines; see `null_space_source`."""
    elimination = write_elimination("factorise_block", "substitute_block")  # the kernels may bring others of their own
    weights = write_weights(layout, shape.size, FIELDS, ATTENTION)
    return [*elimination, _residual(layout, shape), _jacobian(layout, shape, sparse), weights]


class _Evaluation:
    """What residual and Jacobian have in common while they are written."""

    def __init__(self, r: Routine, data: Value, shape: NullSpaceShape) -> None:
        self.r, self.shape = r, shape
        self.data = {name: data.read(k, ADDRESS) for k, name in enumerate(FIELDS)}
        work, choice = self.data["work"], self.data["choice"]
        self.work = {name: work.at(begin) for name, begin in shape.work.items()}
        self.lists = {name: choice.at(begin) for name, begin in shape.choice.items()}

    def listed(self, name: str, position: Operand) -> Value:
        """Return an element of one of the lists of the choice."""
        return self.lists[name].read(position, INTEGER)

    def call(self, kernel: str, inputs: Sequence[Value], output: str) -> Value:
        """Call a kernel; return whether it found a value that is not finite."""
        derived, scratch = self.data[f"derived_{kernel}"], self.data["scratch"]
        return call_kernel(self.r, kernel, inputs, derived, scratch, [self.work[output]]) != 0

    def entries(self, constraint: Value) -> Value:
        """Return the row of the Jacobian of a constraint."""
        return self.work["jacobian"].at(constraint * self.shape.speeds)

    @contextmanager
    def blocks(self) -> Iterator[tuple[Value, Value]]:
        """Do what follows for each block: where its lists begin, and how many constraints it has."""
        with self.r.count(self.listed("blocks", 0)) as block:
            start = self.listed("starts", block)
            yield start, self.listed("starts", block + 1) - start

    def solve_multipliers(self) -> None:
        """Write ``lambda = G_d^-T r_d``, block by block."""
        r, work = self.r, self.work
        matrix, pivots, side = work["matrix"], work["pivots"], work["side"]
        balances = work["stack"].at(self.shape.coordinates)
        with self.blocks() as (start, count):
            with r.count(count) as row:
                speed = self.listed("dependent", start + row)
                side[row] = balances[speed]
                at = matrix.at(row * count)
                with r.count(count) as column:
                    at[column] = self.entries(self.listed("constraints", start + column))[speed]
            r.call("factorise_block", count, matrix, pivots, result=None)
            r.call("substitute_block", count, matrix, pivots, side, result=None)
            with r.count(count) as row:
                work["multipliers"][self.listed("constraints", start + row)] = side[row]

    def solve_weights(self) -> Value:
        """Write ``W = G_d^-1 G_i``, one row for each independent speed; return whether it is not finite."""
        r, work, total = self.r, self.work, self.r.variable(0.0)
        matrix, pivots = work["matrix"], work["pivots"]
        with self.blocks() as (start, count):
            with r.count(count) as row:
                entries = self.entries(self.listed("constraints", start + row))
                at = matrix.at(row * count)
                with r.count(count) as column:
                    at[column] = entries[self.listed("dependent", start + column)]
            r.call("factorise_block", count, matrix, pivots, result=None)
            with r.count(self.shape.free) as free:
                self._weigh(free, start, count, total)
        return ~r.is_finite(total.now)

    def _weigh(self, free: Value, start: Value, count: Value, total: Variable) -> None:
        """Write the weights of an independent speed in a block, and notice where it moves a dependent one far."""
        r, work = self.r, self.work
        side, sizes, state = work["side"], self.data["sizes"], self.data["state"]
        speed, any_entry = self.listed("independent", free), r.variable(0.0)
        with r.count(count) as row:
            entry = self.entries(self.listed("constraints", start + row))[speed]
            side[row] = entry
            any_entry.now = any_entry.now + r.size(entry)
        with r.when(any_entry.now != 0.0):
            r.call("substitute_block", count, work["matrix"], work["pivots"], side, result=None)
        own, limit, weights = sizes[speed], state[LIMIT], work["weights"].at(free * self.shape.rates)
        with r.count(count) as column:
            position = start + column
            weights[position] = side[column]
            size = r.size(side[column])
            with r.when(~(size * own <= limit * sizes[self.listed("dependent", position)])):
                state[ATTENTION] = 1.0
            total.now = total.now + size


def _residual(layout: SundialsLayout, shape: NullSpaceShape) -> Routine:
    """Write the residual with IDA's signature."""
    r = Routine("ida_residual", RESIDUAL, exported=True)
    t, *vectors, data = r.arguments
    made = _Evaluation(r, data, shape)
    y, yp, out = (array_of(one, layout.vector_data) for one in vectors)
    missing = made.call("residual", (place_of(r, t), y, yp), "stack")
    made.solve_multipliers()
    balances, total = made.work["stack"].at(shape.coordinates), r.variable(0.0)
    with r.count(shape.rates) as row:
        multiplier, entries = made.work["multipliers"][row], made.entries(row)
        with r.count(shape.speeds) as speed:
            balances[speed] = balances[speed] - entries[speed] * multiplier
    with r.count(shape.size) as row:
        value = made.work["stack"][made.listed("source", row)]
        out[row] = value
        total.now = total.now + value
    r.give((missing | ~r.is_finite(total.now)).code())
    return r


def _jacobian(layout: SundialsLayout, shape: NullSpaceShape, sparse: bool) -> Routine:
    """Write the Jacobian with IDA's signature; it writes every entry of the matrix, and the pattern of a sparse one."""
    r = Routine("ida_jacobian", JACOBIAN, exported=True)
    t, cj, yy, yyp, _, matrix, data, *_ = r.arguments
    made = _Evaluation(r, data, shape)
    state = place_of(r, t), array_of(yy, layout.vector_data), array_of(yyp, layout.vector_data)
    out = array_of(matrix, layout.sparse_data if sparse else layout.dense_data)
    if sparse:
        _write_pattern(r, layout, matrix, shape.size)
    made.data["state"][RATE] = cj
    missing = made.call("residual", state, "stack")
    made.solve_multipliers()
    lost = made.call("jacobian", (*state, place_of(r, cj), made.work["multipliers"]), "derivatives")
    poor = made.solve_weights()
    with r.count(shape.size) as unknown:
        _project_column(made, made.work["derivatives"].at(unknown * shape.stack), out.at(unknown * shape.size))
    r.give((missing | lost | poor).code())
    return r


def _project_column(made: _Evaluation, entries: Value, target: Value) -> None:
    """Choose the rows of a column, and subtract from the projected ones what the dependent rows contribute."""
    r, shape, column = made.r, made.shape, made.work["column"]
    with r.count(shape.size) as row:
        target[row] = entries[made.listed("source", row)]
    any_entry = r.variable(0.0)
    with r.count(shape.rates) as row:
        value = entries[made.listed("dependent", row) + shape.coordinates]
        column[row] = value
        any_entry.now = any_entry.now + r.size(value)
    with r.when(any_entry.now != 0.0), r.count(shape.free) as free:
        own, place = made.work["weights"].at(free * shape.rates), made.listed("target", free)
        total = r.variable(target[place])
        with r.count(shape.rates) as row:
            total.now = total.now - own[row] * column[row]
        target[place] = total.now


def _write_pattern(r: Routine, layout: SundialsLayout, matrix: Value, size: int) -> None:
    """Write the pattern of a matrix in compressed columns that is full."""
    kind = index_kind(layout)
    rows, starts = (array_of(matrix, one) for one in (layout.sparse_values, layout.sparse_pointers))

    def write(array: Value, position: Value, value: Value) -> None:
        array.write(position, value.code() if kind is CODE else value)

    with r.count(size + 1) as column:
        write(starts, column, column * size)
    with r.count(size) as column, r.count(size) as row:
        write(rows, column * size + row, row)


def compile_null_space_callbacks(
    stack: Program,
    derivatives: Program,
    jacobian: tuple[ArrayLike, ArrayLike],
    pattern: tuple[ArrayLike, ArrayLike],
    shape: NullSpaceShape,
    sparse: bool = False,
    *,
    cache: bool = True,
    layout: SundialsLayout | None = None,
) -> NullSpaceCallbacks:
    """Compile what the reduced form of a mechanism with loops is made of to functions that IDA calls."""
    jacobian_rows, jacobian_columns, rows, columns = (
        np.asarray(x, dtype=np.int64).ravel() for x in (*jacobian, *pattern)
    )
    check_groups(stack, [1, shape.size, shape.size], shape.stack + len(jacobian_rows))
    check_groups(derivatives, [1, shape.size, shape.size, 1, shape.rates], len(rows))
    placed = np.concatenate([np.arange(shape.stack), shape.stack + jacobian_rows * shape.speeds + jacobian_columns])
    parts = [
        Part("residual", stack, tuple(placed.tolist())),
        Part("jacobian", derivatives, tuple((columns * shape.stack + rows).tolist())),
    ]
    routines = null_space_source(layout or sundials_layout(), shape, sparse)
    built = build_code(parts, default_options(parts), exports=EXPORTS, routines=routines, cached=cache)
    return NullSpaceCallbacks({"residual": stack, "jacobian": derivatives}, shape, built)


class NullSpaceData(UserData):
    """The user's data of one session, with the choice of dependent coordinates; see `UserData`."""

    @property
    def choice(self) -> NDArray[np.int64]:
        """Which coordinates are dependent, as lists of numbers; may be changed between two steps."""
        return self.arrays["choice"]

    @property
    def rate(self) -> float:
        """The factor cj of the last Jacobian."""
        return float(self.arrays["state"][RATE])

    def take_attention(self) -> bool:
        """Return whether a Jacobian found the choice to be a poor one since this was last asked."""
        state = self.arrays["state"]
        found, state[ATTENTION] = bool(state[ATTENTION]), 0.0
        return found


class NullSpaceCallbacks(Callbacks):
    """The functions of a mechanism with loops, for any choice of dependent coordinates; see `Callbacks`.

    The weights return -1, at which IDA hands over what it has, also where the last Jacobian found the choice to be a
    poor one.
    """

    def __init__(self, programs: Mapping[str, Program], shape: NullSpaceShape, built: Built) -> None:
        super().__init__(programs, shape.size, built)
        self.shape = shape

    def bind(self, parameter_values: ArrayLike, choice: ArrayLike, sizes: ArrayLike, limit: float) -> NullSpaceData:
        """Return the user's data for values of the parameters; each run needs its own."""
        arrays = self._arrays(parameter_values) | {
            "choice": np.array(choice, dtype=np.int64),
            "work": np.zeros(self.shape.work["end"]),
            "sizes": np.array(sizes, dtype=float),
            "state": np.zeros(3),
        }
        arrays["state"][LIMIT] = limit
        if arrays["choice"].shape != (self.shape.choice["end"],) or arrays["sizes"].shape != (self.shape.speeds,):
            raise UsageError("the choice or the sizes have another length than the mechanism")
        return NullSpaceData(FIELDS, arrays)
