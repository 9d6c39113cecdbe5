"""A linear solver with fixed pivots as SUNDIALS calls it: its matrix is one column with all entries.

The routines are the same for all patterns, with lists of places. The factors have the reciprocal of each pivot in its
place, and the column below it divided by it. A probe says whether these are good: a system with a right-hand side of
all signs, as large as unknowns of their sizes make it, is solved, and each equation compared with the sizes of its
terms (the componentwise backward error of W. Oettli and W. Prager, Numer. Math. 6, 1964).
"""

from __future__ import annotations

from collections.abc import Mapping

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, BOOLEAN, CODE, INTEGER, NUMBER, Kind, Operand, Record, Routine, Value
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.residuals import array_of

SLOTS = (
    *("starts", "middles", "indices", "targets", "target_starts", "rows", "columns"),
    *("positions", "by_row", "row_starts", "row_columns"),
    *("size", "count", "room", "values", "probe", "sizes", "right", "work", "found"),
    *("entries", "failed", "mend", "solve"),
)
"""What a block of 64-bit numbers and addresses holds, in this order.

First the lists of `atwood.numerics.fixed_pivots.FixedPivots`; how many unknowns, entries and places there are; the
factors, signs for the right-hand side of the probe, sizes of the unknowns, and room for three vectors; the entries of
the present matrix; whether its factors are no good; and what is then done: a function that either returns `AGAIN`, with
other lists in the block, or factorises in another way and returns 0, or else something other; and one that then solves,
given right-hand side and solution.
"""

AGAIN = 77
"""What the function that mends returns where the lists are others now."""

BACKWARD_ERROR = 1e-7
"""What an equation of the probe may be off, as a share of its terms.

A Newton step is then wrong by that times the condition of the equations, which is a few thousand for pendulums and
linkages; IDA's iteration, whose Jacobian is itself off by some percent, does not notice.
"""

_KINDS: dict[str, Kind] = {name: INTEGER if name in ("size", "count", "room", "failed") else ADDRESS for name in SLOTS}
_EXPORTS = ("setup_fixed", "answer_fixed")


def fixed_pivots_addresses() -> Mapping[str, int]:
    """Return the addresses of ``setup`` and ``solve`` with the signatures of SUNDIALS' linear solvers.

    The content of the solver is a block of `SLOTS`. Where the factors do not pass the probe, or are not finite, both go
    to the block's own functions until the next setup.
    """
    found = _code().code.addresses
    return dict(zip(("setup", "solve"), (found[name] for name in _EXPORTS), strict=True))


@once
def _code() -> Built:
    files = ("codegen/sundials/residuals.py",)
    routines = RoutineSource("codegen.sundials.fixed_pivots", files, (sundials_layout(),))
    return build_code([], CodeOptions(level=2), exports=_EXPORTS, routines=routines)


def write_routines(layout: SundialsLayout) -> list[Routine]:
    """Write the functions that factorise, that solve, that tell whether an equation of the probe is off, and IDA's."""
    return [_factorise(), _solve(), _probe(), _setup(layout), _answer(layout)]


class _Block:
    """The block with its lists, while a routine is being written."""

    def __init__(self, block: Value) -> None:
        self.slots = Record(block, _KINDS)
        self.size = self.slots.size
        self._lists = {name: block.read(k, ADDRESS) for k, name in enumerate(SLOTS[: SLOTS.index("size")])}

    def listed(self, name: str, where: Operand) -> Value:
        """Return an entry of a list."""
        return self._lists[name].read(where, CODE).integer()

    def run(self, name: str, place: Value) -> tuple[Value, Value]:
        """Return an entry of a list behind the one after it, as loops take them."""
        return self.listed(name, place + 1), self.listed(name, place)


def _factorise() -> Routine:
    r = Routine("factorise_fixed", {"block": ADDRESS}, None)
    block = _Block(*r.arguments)
    values, entries, room = block.slots.values, block.slots.entries, block.slots.room
    r.clear(values, values.at(room))
    with r.count(block.slots.count) as entry:
        values[block.listed("positions", entry)] = entries[entry]
    with r.count(block.size) as step:
        (end, start), middle = block.run("starts", step), block.listed("middles", step)
        begin, width = start + 1, middle - start - 1
        inverse = 1.0 / values[start]
        values[start] = inverse
        first = block.listed("target_starts", step) - begin
        with r.count(end, middle) as below:
            factor = values[below] * inverse
            values[below] = factor
            shift = first + (below - middle) * width
            with r.count(middle, begin) as right:
                target = block.listed("targets", shift + right)
                values[target] = values[target] - factor * values[right]
    return r


def _solve() -> Routine:
    r = Routine("solve_fixed", dict.fromkeys(("block", "right", "solution"), ADDRESS), None)
    given, side, solution = r.arguments
    block = _Block(given)
    work, values = block.slots.work, block.slots.values
    with r.count(block.size) as step:
        work[step] = side[block.listed("rows", step)]
    with r.count(block.size) as step:
        value = work[step]
        with r.count(block.listed("starts", step + 1), block.listed("middles", step)) as below:
            row = block.listed("indices", below)
            work[row] = work[row] - values[below] * value
    with r.count(block.size) as turn:
        back = block.size - 1 - turn
        start, total = block.listed("starts", back), r.variable(work[back])
        with r.count(block.listed("middles", back), start + 1) as right:
            total.now = total.now - values[right] * work[block.listed("indices", right)]
        found = total.now * values[start]
        work[back] = found
        solution[block.listed("columns", back)] = found
    return r


def _probe() -> Routine:
    r = Routine("fails_fixed", {"block": ADDRESS})
    block = _Block(*r.arguments)
    entries, probe, side, found = block.slots.entries, block.slots.probe, block.slots.right, block.slots.found
    with r.count(block.size) as row:
        largest = r.variable(0.0)
        with r.count(*block.run("row_starts", row)) as entry:
            size = block.slots.sizes[block.listed("row_columns", entry)]
            largest.now = r.most(r.size(entries[block.listed("by_row", entry)]) * size, largest.now)
        side[row] = largest.now * probe[row]
    r.call("solve_fixed", *r.arguments, side, found, result=None)
    fails = r.variable(0, BOOLEAN)
    with r.count(block.size) as row:
        left, terms = r.variable(side[row]), r.variable(r.size(side[row]))
        with r.count(*block.run("row_starts", row)) as entry:
            term = entries[block.listed("by_row", entry)] * found[block.listed("row_columns", entry)]
            left.now = left.now - term
            terms.now = terms.now + r.size(term)
        is_good = r.size(left.now) <= terms.now * BACKWARD_ERROR  # false for what is no number
        fails.now = fails.now | ~is_good
    r.give(fails.now.code())
    return r


def _setup(layout: SundialsLayout) -> Routine:
    r = Routine("setup_fixed", dict.fromkeys(("solver", "matrix"), ADDRESS), exported=True)
    solver, matrix = r.arguments
    block = solver.read(0, ADDRESS)
    slots = Record(block, _KINDS)
    slots.entries = array_of(matrix, layout.dense_data)
    with r.forever():
        r.call("factorise_fixed", block, result=None)
        fails = r.call("fails_fixed", block)
        slots.failed = fails.integer()
        r.give_if(fails == 0, 0)
        code = r.call(slots.mend)
        r.give_if(code != AGAIN, code)
    return r


def _answer(layout: SundialsLayout) -> Routine:
    arguments = dict.fromkeys(("solver", "matrix", "solution", "right"), ADDRESS) | {"tolerance": NUMBER}
    r = Routine("answer_fixed", arguments, exported=True)
    solver, _, *vectors, _ = r.arguments
    block = solver.read(0, ADDRESS)
    slots, (y, b) = Record(block, _KINDS), (array_of(one, layout.vector_data) for one in vectors)
    with r.when(slots.failed == 0):
        r.call("solve_fixed", block, b, y, result=None)
        r.give(0)
    r.give(r.call(slots.solve, b, y))
    return r
