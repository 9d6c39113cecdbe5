"""Memory of a session of Taylor series: what routines, recurrences and Python agree on.

The coefficients that are convolved lie in blocks of `LANES` values, each block with one row for each order, so that
the convolutions of a block are worked out together and read memory in order: nothing has to be gathered, and no lane
waits for another.
"""

from __future__ import annotations

from collections.abc import Mapping

from atwood.codegen.routines.kinds import ADDRESS, CODE, INTEGER, NUMBER, Kind, Lanes
from atwood.codegen.routines.language import Operand, Record, Routine, Value
from atwood.integrators.taylor.problem import HIGHEST

WIDTH = 4
"""How many unknowns a loop works on at a time; rows are padded to a multiple of it with finite numbers."""

LANES = 8
"""How many convolutions are worked out at a time."""

STRIDE = LANES * (HIGHEST + 1)
"""How far one block is from the next: an odd number of rows, so that the rows of one order do not share cache sets."""

_NAMES = (
    *("y", "y_low", "new", "new_low", "rates", "new_rates", "slope", "floors", "sizes"),
    *("trial", "trial_rates", "kept", "kept_rates"),
)
ROWS = {"x": 0, **{name: HIGHEST + 1 + i for i, name in enumerate(_NAMES)}, "all": HIGHEST + 1 + len(_NAMES)}
"""The rows of the table of arrays: the coefficients of the unknowns from order zero on, and what steps need."""

NUMBERS = (
    *("order_number", "order_inverse", "order_step", "order_tick"),  # what the program of an order is told
    *("t", "t_old", "t_new", "time"),
    *("unit", "last", "first", "stop", "stop_time", "share", "allowed", "longest", "horizon", "reach"),
)
COUNTS = (
    *("size", "padded", "order", "pair_blocks", "square_blocks", "limit"),
    *("steps", "failures", "evaluations", "undefined", "stiff", "filled"),
)
POINTERS = (
    *("start", "prologue", "recurrence"),  # functions
    *("start_derived", "derived", "scratch", "known"),
    *("new_in", "new_out", "trial_in", "trial_out", "order_in", "order_out"),  # tables of pointers
    *("arrays", "table", "pair_sums", "square_sums", "numbers", "counts"),
    *("guard", "guard_data"),
)


def positions(pairs: int, squares: int, size: int) -> tuple[int, ...]:
    """Return where the results of the program of an order go, from the row of that order in the first block.

    The blocks of left and right factors take turns, and those of squares follow; the coefficients of the unknowns have
    an array of their own.
    """
    left = [2 * (i // LANES) * STRIDE + i % LANES for i in range(pairs)]
    first = 2 * (-(-pairs // LANES))
    last = [(first + i // LANES) * STRIDE + i % LANES for i in range(squares)]
    return (*left, *(at + STRIDE for at in left), *last, *range(size))


class Memory:
    """The memory of a session within a routine."""

    def __init__(self, session: Value) -> None:
        self.session = session
        self.at = Record(session, dict.fromkeys(POINTERS, ADDRESS))
        self.numbers = Record(self.at.numbers, dict.fromkeys(NUMBERS, NUMBER))
        self.counts = Record(self.at.counts, dict.fromkeys(COUNTS, INTEGER))
        self.arrays, self.size, self.padded = self.at.arrays, self.counts.size, self.counts.padded

    def row(self, row: Operand | str) -> Value:
        """Return the address of a row of the table of arrays, by its name or number."""
        return self.arrays.at(self.padded * (ROWS[row] if isinstance(row, str) else row))

    def lanes(self, row: Value, j: Value) -> Value:
        """Return the lanes of a row from an unknown on."""
        return row.read(j, Lanes(WIDTH))


def open_routine(
    name: str, more: Mapping[str, Kind] | None = None, result: Kind | None = CODE, exported: bool = False
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    routine = Routine(name, {"session": ADDRESS, **(more or {})}, result, exported)
    return routine, Memory(routine.arguments[0]), routine.arguments[1:]
