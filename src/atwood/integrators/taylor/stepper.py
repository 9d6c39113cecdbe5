"""The Taylor-series method: what it is given, its order, and how its steps are chosen.

A. Jorba and M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,
Experimental Mathematics 14 (2005) 99-117: the order from the tolerance and the step from the last coefficients are in
section 3.  Three things differ:

- Sizes are those of each unknown, as its tolerances say, where they take the largest of all.
- Their two last coefficients are not enough: a mechanism that is released at rest where its forces are odd has series
  in which only every fourth coefficient is there, and both can be zero.  So four are looked at.
- At the end of a step, the rates are compared with the derivative of the polynomial.  That costs nothing, since the
  next step begins with these rates, and it shows what no coefficient can: a law that changes within a step.

Memory of a session of Taylor series: what routines, recurrences and Python agree on.

The coefficients that are convolved lie in blocks of `LANES` values, each block with one row for each order, so that
the convolutions of a block are worked out together and read memory in order: nothing has to be gathered, and no lane
waits for another.

The Taylor-series method as machine code: no Python runs between outputs.

The code of the steps is the same for all systems and comes from the cache after the first time.  What a system adds is
its recurrences, as two programs, which begin as tapes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from itertools import accumulate
from math import ceil, exp, frexp, inf, log, log2
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_lanes, once
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, CODE, Kind, Lanes, Routine, Value, places_of
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import OutputGroup, Program
from atwood.expr.series.taylor import TaylorPrograms
from atwood.integrators.protocol import CompiledRates, SolverOptions, StepGuard, absolute_tolerances
from atwood.integrators.stepper import (
    LANE_FIELDS,
    PROJECTS,
    WIDTH,
    Counts,
    Memory,
    Routines,
    Stepper,
    fields_of,
    in_lanes,
    open_routine as session_routine,
    routines_of,
)
from atwood.lazy_dataclasses import dataclass, names_of

if TYPE_CHECKING:
    from atwood.expr.series.taylor import TaylorPrograms
    from atwood.integrators.batch import BatchPlaces

LOWEST, HIGHEST = 5, 28
"""The orders that are used."""

FACTOR = 0.65
"""Orders for each factor e of the tolerance; a step is then e^(-1/FACTOR) of the radius of convergence.

A half is best if an order costs as much as its number of terms; here convolutions are cheap beside what every order
costs, and 0.6 to 0.7 takes the least time for an error (chains of 2, 10 and 40 links, errors from 1e-3 to 1e-12).
"""

WATCHED = 4
"""The radius of convergence is estimated from so many last coefficients."""

DEFECT = 30.0
"""How far the rates at the end of a step may be from the polynomial's, in units of the tolerance."""

FLOOR = 1e-12
"""The least such difference that is looked at, relative to the sizes: below it is rounding."""

RETREAT = 0.5
"""The share of a step that is tried next where the rates do not fit or have no value."""


RETRIES, SMALLER = 4, 1e-6
"""How often coefficients that are not finite are tried again, with a unit of time that is so many times smaller."""


PARTS = 2
"""What judges a step is asked about so many parts of it: longer ones bend more than the cubics between their ends."""


REACH = 0.5
"""Where events are looked for, no step changes an unknown by more than so many times its size."""


@dataclass(frozen=True, eq=False)
class TaylorProblem:
    """The recurrences of one mode, with parameter values.

    Parameters
    ----------
    programs
        The recurrences, of which `atwood.integrators.taylor.stepper.LANES` convolutions are worked out at a time.
    parameters
        The values of the parameters of the program of order zero.
    compiled
        ``compiled()``: the recurrences as machine code, and what depends on their parameters alone.
    wide
        ``wide(runs)``: the recurrences as machine code for several runs side by side.
    stop_time
        No step goes beyond this time: what acts may change there.
    reach
        No step changes an unknown by more than so many times its size: where events are looked for, a step must not be
        so long that one comes and goes within it.
    """

    programs: TaylorPrograms
    parameters: FloatArray
    compiled: Callable[[], tuple[CompiledRecurrences, FloatArray]]
    wide: Callable[[int], CompiledRecurrences] | None = None
    stop_time: float = inf
    reach: float = inf


def choose_order(options: SolverOptions) -> int:
    """Return the order that suits a tolerance: Jorba and Zou, section 3.1, where the factor is 1/2."""
    found = ceil(1.0 - FACTOR * log(options.relative_tolerance))
    return min(max(found, LOWEST), HIGHEST)


def share_of_radius(order: int, tolerance: float) -> float:
    """Return the step as a share of the radius of convergence: where terms of order p - 1 are as small as allowed.

    The last factor is that of Jorba and Zou, section 3.2.
    """
    return exp((log(tolerance) - 0.7) / (order - 1))


def logarithm(value: float) -> float:
    """Return the logarithm to base 2, good enough for a step: linear between powers of two, and finite at zero."""
    if value < 2.0**-1022:
        return -1023.0
    mantissa, exponent = frexp(value)
    return 2.0 * mantissa + (exponent - 2)


LANES = 8
"""How many convolutions are worked out at a time."""

_NAMES = (
    *("y", "y_low", "new", "new_low", "rates", "new_rates", "slope", "floors", "sizes"),
    *("trial", "trial_rates", "kept", "kept_rates"),
)
ROWS = {"x": 0, **{name: HIGHEST + 1 + i for i, name in enumerate(_NAMES)}, "all": HIGHEST + 1 + len(_NAMES)}
"""The rows of the table of arrays: the coefficients of the unknowns from order zero on, and what steps need."""

FIELDS = fields_of(
    (
        *("start", "prologue", "recurrence"),  # functions
        *("start_derived", "derived", "scratch", "known"),
        *("new_in", "new_out", "trial_in", "trial_out", "order_in", "order_out"),  # tables of pointers
        *("arrays", "table", "pair_sums", "square_sums", "guard", "guard_data"),
        *("project", "project_data"),
    ),
    (
        *("order_number", "order_inverse", "order_step", "order_tick"),  # what the program of an order is told
        *("t", "t_old", "t_new", "time"),
        *("unit", "last", "first", "stop", "stop_time", "share", "allowed", "longest", "horizon", "reach"),
    ),
    ("size", "padded", "order", "pair_blocks", "square_blocks"),
)


def lanes_of(runs: int) -> int:
    """Return how many convolutions are worked out at a time: several of one run, or one of each of several."""
    return LANES if runs == 1 else runs


def stride_of(lanes: int) -> int:
    """Return how far one block is from the next: an odd number of rows, which so do not share cache sets."""
    return lanes * (HIGHEST + 1)


def positions(pairs: int, squares: int, size: int) -> tuple[int, ...]:
    """Return where the results of the program of an order go, from the row of that order in the first block.

    The blocks of left and right factors take turns, and those of squares follow; the coefficients of the unknowns have
    an array of their own.
    """
    stride = stride_of(LANES)
    left = [2 * (i // LANES) * stride + i % LANES for i in range(pairs)]
    first = 2 * (-(-pairs // LANES))
    last = [(first + i // LANES) * stride + i % LANES for i in range(squares)]
    return (*left, *(at + stride for at in left), *last, *range(size))


def open_routine(
    runs: int, name: str, more: Mapping[str, Kind] | None = None, result: Kind | None = CODE, exported: bool = False
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session of so many runs, its memory, and its further arguments."""
    fields = FIELDS if runs == 1 else FIELDS | LANE_FIELDS
    return session_routine(partial(Memory, fields, ROWS, runs=runs), name, more, result, exported)


_PACKED = (0, 1, 2)
"""The groups of results of the program of an order whose rows lie in blocks: left, right and squares."""

_LINE = 8
"""Numbers in one line of the processor's cache: every array begins with one."""


class CompiledRecurrences:
    """The recurrences of a system as machine code, for any parameter values.

    Parameters
    ----------
    programs
        The recurrences, made for `~atwood.integrators.taylor.stepper.LANES`.
    runs
        How many runs are taken side by side; see `atwood.codegen.llvm.module.CodeOptions`.

    Attributes
    ----------
    tiers
        The code of one run; None of several.
    """

    def __init__(self, programs: TaylorPrograms, runs: int = 1) -> None:
        self.programs, self.runs = programs, runs
        self.size = len(programs.start.inputs[1].symbols)
        parts = [Part("start", programs.start), _order_alone(programs) if runs == 1 else _order_of_many(programs)]
        self.tiers = Tiers(parts) if runs == 1 else None
        self.built = build_lanes(parts, runs) if self.tiers is None else self.tiers.now
        self.addresses = self.built.code.addresses
        self.layout = _Layout(self)

    def bind(self, parameter_values: ArrayLike) -> FloatArray:
        """Return what depends on parameters alone."""
        return self.built.derive("start", self.programs.start, parameter_values)[0]


def _order_alone(programs: TaylorPrograms) -> Part:
    """Return the program of an order whose results stand in the blocks in which they are convolved."""
    size = len(programs.start.inputs[1].symbols)
    return Part("order", programs.order, positions(programs.pairs, programs.squares, size), LANES, _PACKED)


def _factors(programs: TaylorPrograms) -> tuple[dict[Expression, int], list[int]]:
    """Return the series that are convolved, each once, and which of them are the two of each pair and of squares."""
    left, right, squares, _ = (group.expressions for group in programs.order.outputs)
    series = {one: k for k, one in enumerate(dict.fromkeys((*left, *right, *squares)))}
    used = [one for pair in zip(left, right, strict=True) for one in pair]
    return series, [series[one] for one in (*used, *squares)]


def _order_of_many(programs: TaylorPrograms) -> Part:
    """Return the program of an order for runs side by side: each has a row for itself, so every series stands once.

    Results are in the order in which they are first met, so that they are computed and checked as those of one run.
    """
    series, order = list(_factors(programs)[0]), programs.order
    outputs = OutputGroup("series", tuple(series)), order.outputs[-1]
    positions = [k * stride_of(1) for k in range(len(series))]
    program = Program(order.name, order.inputs, order.parameters, outputs)
    return Part("order", program, (*positions, *range(len(order.outputs[-1].expressions))))


class _Layout:
    """Where each array of a session stands, from the beginning of its memory.

    Parameters
    ----------
    recurrences
        What a session is of.

    Attributes
    ----------
    places, size, padded
        In numbers of 8 bytes: where arrays begin, how many there are in all, and in a row of unknowns.
    tables
        What the tables of pointers hold, in bytes from the beginning.
    pointers, is_own
        The pointers of a session, and which of them are such distances; addresses of functions are not.
    """

    def __init__(self, recurrences: CompiledRecurrences) -> None:
        programs, n, runs = recurrences.programs, recurrences.size, recurrences.runs
        self.padded = -(-n // WIDTH) * WIDTH if runs == 1 else n * runs
        known = len(programs.order.parameters) * runs
        self.lanes = lanes = lanes_of(runs)
        each = LANES if runs == 1 else 1
        self.blocks = pairs, squares = -(-programs.pairs // each), -(-programs.squares // each)
        series, factors = _factors(programs)
        self.factors = stride_of(lanes) * np.array(factors, dtype=np.int64)
        self.fields = FIELDS if runs == 1 else in_lanes(FIELDS | LANE_FIELDS, runs)
        self.numbers = places_of(self.fields)
        lengths = {
            "fields": sum(kind.count if isinstance(kind, Lanes) else 1 for kind in self.fields.values()),
            "tables": 16,
            "values": 2 * n * runs,
            "known": known,
            "spare": known,
            "derived": len(programs.order.prologue) * runs,
            "scratch": recurrences.built.scratch,
            "arrays": ROWS["all"] * self.padded,
            "pair_sums": 2 * pairs * lanes,
            "square_sums": squares * lanes,
            "factors": 0 if runs == 1 else len(factors),
            "table": (2 * pairs + squares if runs == 1 else len(series)) * stride_of(lanes),
        }
        ends = [0, *accumulate(-(-length // _LINE) * _LINE for length in lengths.values())]
        self.places, self.size = dict(zip(lengths, ends, strict=False)), ends[-1]
        far = {name: 8 * at for name, at in self.places.items()}

        def row(name: str) -> int:
            return far["arrays"] + 8 * self.padded * ROWS[name]

        def number(name: str) -> int:
            return far["fields"] + 8 * self.numbers[name]

        pairs_of_tables = (
            *(number("t_new"), row("new"), row("new_rates"), far["known"]),
            *(number("time"), row("trial"), row("trial_rates"), far["spare"]),
            *(far["pair_sums"], far["square_sums"], number("order_number")),
        )
        self.tables = np.array(pairs_of_tables, dtype=np.int64)
        names = ("new_in", "new_out", "trial_in", "trial_out", "order_in", "order_out")
        far |= {name: far["tables"] + 8 * at for name, at in zip(names, (0, 2, 4, 6, 8, 12), strict=True)}
        code = recurrences.addresses
        given = {"start": code["start"], "prologue": code["order_prologue"], "recurrence": code["order"]}
        given |= dict.fromkeys(
            ("start_derived", "guard", "guard_data", "project", "project_data"), 0
        )  # of each session
        pointers = [name for name, kind in FIELDS.items() if kind is ADDRESS]
        self.pointers = np.array([{**far, **given}[name] for name in pointers], dtype=np.int64)
        self.is_own = np.array([name not in given for name in pointers], dtype=np.int64)

    def allocate(self) -> tuple[FloatArray, int]:
        """Return memory in one piece that begins with a cache line, with all pointers, and its address."""
        memory = np.zeros(self.size + _LINE)
        begins: int = memory.ctypes.data
        skipped = -(begins // 8) % _LINE
        memory, base = memory[skipped:], begins + 8 * skipped
        at, whole = self.places, memory.view(np.int64)
        whole[at["tables"] : at["tables"] + len(self.tables)] = self.tables + base
        whole[at["fields"] : at["fields"] + len(self.pointers)] = self.pointers + base * self.is_own
        return memory, base


class CompiledStepper(Stepper):
    """The state of a run with Taylor series.

    Parameters
    ----------
    problem
        The recurrences.
    options
        The accuracy.
    order
        The order of the method; None takes the one that suits the tolerance.
    guard
        What judges steps besides their error.
    onto
        Takes states onto the constraints, with which steps end.
    """

    _fields = FIELDS
    _parameters: tuple[int, int, int]

    def __init__(
        self,
        problem: TaylorProblem,
        options: SolverOptions,
        order: int | None = None,
        guard: StepGuard | None = None,
        onto: CompiledRates | None = None,
    ) -> None:
        recurrences, derived = problem.compiled()
        self._size, self._options = recurrences.size, options
        self._keep: tuple[object, ...] = recurrences, derived
        chosen = choose_order(options) if order is None else order
        self._lay_out(recurrences, derived, guard)
        n = self._size
        self._arrays[ROWS["floors"]] = 1.0
        self._arrays[ROWS["floors"], :n] = absolute_tolerances(options, n) / options.relative_tolerance
        pairs, squares = recurrences.layout.blocks
        self._set(size=n, padded=self._arrays.shape[1], order=chosen, pair_blocks=pairs, square_blocks=squares)
        self._set(longest=options.max_step or inf, horizon=options.horizon)
        self._set(stop_time=problem.stop_time, reach=problem.reach)
        if onto is not None:
            self._keep = *self._keep, onto
            self._set(project=onto.project, project_data=onto.project_data)
        self._set(share=log2(share_of_radius(chosen, options.relative_tolerance)))
        self._set(allowed=DEFECT * options.relative_tolerance + FLOOR)
        self._functions = _routines().functions
        assert recurrences.tiers is not None
        self._tiers, self._built = recurrences.tiers, recurrences.built

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._take_up(self._tiers.spend(0.0))
        self._set(first=self._options.first_step or 0.0)  # the step that takes it forgets it
        return super().start(t, y)

    def _take_up(self, built: Built) -> None:
        """Go on with other code of the recurrences, which has the same bits."""
        if built is not self._built:
            self._built, code, (_, derived, scratch) = built, built.code.addresses, self._parameters
            self._set(start=code["start"], prologue=code["order_prologue"], recurrence=code["order"])
            self._parameters = code["start_prologue"], derived, scratch

    def _go_on(self, last: int, function: str, *arguments: int) -> int | None:
        """Take steps, and see whether the next ones are to be taken by faster code."""
        began = time.perf_counter()
        code = super()._go_on(last, function, *arguments)
        if self._tiers.now is not self._built or self._tiers.has_better:
            self._take_up(self._tiers.spend(time.perf_counter() - began))
        return code

    def _lay_out(self, recurrences: CompiledRecurrences, derived: FloatArray, guard: StepGuard | None) -> None:
        """Find a place for everything, in one piece of memory that begins with a cache line."""
        layout, n = recurrences.layout, self._size
        memory, base = layout.allocate()
        at = layout.places
        self._arrays = memory[at["arrays"] : at["arrays"] + ROWS["all"] * layout.padded].reshape(-1, layout.padded)
        self._ends = self._arrays[ROWS["y"], :n], self._arrays[ROWS["rates"], :n]
        self._values = memory[at["values"] : at["values"] + 2 * n].reshape(2, n)
        self._begin_at(memory[at["fields"] :], start_derived=derived.ctypes.data)
        if guard is not None:
            self._guard = guard
            self._set(guard=guard.function, guard_data=guard.data)
        self._parameters = recurrences.addresses["start_prologue"], derived.ctypes.data, base + 8 * at["scratch"]
        self._outputs = base + 8 * at["values"], base + 8 * (at["values"] + n)

    def stop_at(self, end: float) -> None:
        """Let no step go beyond a time."""
        self._set(stop_time=end)

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        if absolute is not None:
            found = np.maximum(absolute, np.finfo(float).tiny) / self._options.relative_tolerance
            self._arrays[ROWS["floors"], : self._size] = found
        self._set(**dict.fromkeys(names_of(Counts), 0), horizon=horizon, longest=self._options.max_step or inf)

    def batch_places(self) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call.

        What this session knows of parameters is written over by a run that has others.
        """
        self._take_up(self._tiers.at_its_best())
        factor = 1.0 / self._options.relative_tolerance
        return self._batch_places(_routines().built, self._arrays[ROWS["floors"]], factor, self._parameters)


_ROUTINES = RoutineSource(
    "integrators.taylor.steps",
    (
        "integrators/stepper.py",
        "integrators/taylor/stepper.py",
    ),
)


@once
def _routines() -> Routines:
    """Return the routines of the method."""
    return routines_of(_ROUTINES, project_each=PROJECTS)
