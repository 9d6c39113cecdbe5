"""Gaussian elimination with fixed pivots as machine code: the same for all patterns, with lists of places.

The factors have the reciprocal of each pivot in its place, and the column below it divided by it.
A probe says whether these are good: a system with a right-hand side of all signs is solved, and each equation compared
with the sizes of its terms (the componentwise backward error of W. Oettli and W. Prager, Numer. Math. 6, 1964).
"""

from __future__ import annotations

from atwood.codegen.llvm.routine import Routine

__all__ = ["AGAIN", "SLOTS", "fixed_pivots_text"]

SLOTS = (
    *("starts", "middles", "indices", "targets", "target_starts", "rows", "columns"),
    *("positions", "by_row", "row_starts", "row_columns"),
    *("size", "count", "room", "values", "probe", "right", "work", "found"),
    *("entries", "failed", "mend", "solve"),
)
"""What a block of 64-bit numbers and addresses holds, in this order.

First the lists of `atwood.numerics.fixed_pivots.FixedPivots`; how many unknowns, entries and places there are; the
factors, signs for the right-hand side of the probe, and room for three vectors; the entries of the present matrix;
whether its factors are no good; and what is then done: a function that either returns `AGAIN`, with other lists in the
block, or factorises in another way and returns 0, or else something other; and one that then solves, given right-hand
side and solution.
"""

AGAIN = 77
"""What the function that mends returns where the lists are others now."""

BACKWARD_ERROR = 1e-7
"""What an equation of the probe may be off, as a share of its terms.

A Newton step is then wrong by that times the condition of the equations, which is a few thousand for pendulums and
linkages; IDA's iteration, whose Jacobian is itself off by some percent, does not notice.
"""

_HEADS = {
    "factorise": "define void @factorise_fixed(ptr %block) #0",
    "solve": "define void @solve_fixed(ptr %block, ptr %right, ptr %solution) #0",
    "probe": "define i1 @fails_fixed(ptr %block) #0",
}


def fixed_pivots_text() -> str:
    """Write the functions that factorise, that solve, and that tell whether an equation of the probe is off."""
    return _factorise() + _solve() + _probe()


class _Block:
    """The block, while a routine is being written."""

    def __init__(self, routine: Routine, *names: str) -> None:
        self._routine = routine
        self._at = {name: routine.load_pointer("%block", SLOTS.index(name)) for name in names}
        self.size = routine.load_index("%block", SLOTS.index("size"))

    def __getitem__(self, name: str) -> str:
        return self._at[name]

    def value(self, name: str, *where: str | int) -> str:
        """Read an entry of a list."""
        r = self._routine
        total = where[0] if len(where) == 1 else r.index("add", where[0], where[1])
        at = r.put(f"getelementptr i32, ptr {self._at[name]}, i64 {total}")
        return r.put(f"sext i32 {r.put(f'load i32, ptr {at}')} to i64")

    def run(self, name: str, place: str) -> tuple[str, str]:
        """Read an entry of a list and the next."""
        return self.value(name, place), self.value(name, place, 1)


def _factorise() -> str:
    r = Routine()
    block = _Block(r, "positions", "starts", "middles", "targets", "target_starts", "entries", "values")
    values = block["values"]
    with r.loop(0, r.load_index("%block", SLOTS.index("room"))) as place:
        r.store("0.0", values, place.index)
    with r.loop(0, r.load_index("%block", SLOTS.index("count"))) as entry:
        r.store(r.load(block["entries"], entry.index), values, block.value("positions", entry.index))
    with r.loop(0, block.size) as step:
        (start, end), middle = block.run("starts", step.index), block.value("middles", step.index)
        begin, width = r.index("add", start, 1), r.index("sub", r.index("sub", middle, start), 1)
        inverse = r.number("fdiv", "1.0", r.load(values, start))
        r.store(inverse, values, start)
        first = r.index("sub", block.value("target_starts", step.index), begin)
        with r.loop(middle, end) as below:
            factor = r.number("fmul", r.load(values, below.index), inverse)
            r.store(factor, values, below.index)
            shift = r.index("add", first, r.index("mul", r.index("sub", below.index, middle), width))
            with r.loop(begin, middle) as right:
                target = block.value("targets", shift, right.index)
                product = r.number("fmul", factor, r.load(values, right.index))
                r.store(r.number("fsub", r.load(values, target), product), values, target)
    r.do("ret void")
    return r.function(_HEADS["factorise"])


def _solve() -> str:
    r = Routine()
    block = _Block(r, "starts", "middles", "indices", "rows", "columns", "work", "values")
    with r.loop(0, block.size) as step:
        r.store(r.load("%right", block.value("rows", step.index)), block["work"], step.index)
    with r.loop(0, block.size) as step:
        value = r.load(block["work"], step.index)
        with r.loop(block.value("middles", step.index), block.value("starts", step.index, 1)) as below:
            row = block.value("indices", below.index)
            product = r.number("fmul", r.load(block["values"], below.index), value)
            r.store(r.number("fsub", r.load(block["work"], row), product), block["work"], row)
    with r.loop(0, block.size) as turn:
        step_back = r.index("sub", r.index("sub", block.size, 1), turn.index)
        start, value = block.value("starts", step_back), r.load(block["work"], step_back)
        with r.loop(r.index("add", start, 1), block.value("middles", step_back), [value]) as right:
            known = r.load(block["work"], block.value("indices", right.index))
            product = r.number("fmul", r.load(block["values"], right.index), known)
            right.following = (r.number("fsub", right.carried[0], product),)
        found = r.number("fmul", right.carried[0], r.load(block["values"], start))
        r.store(found, block["work"], step_back)
        r.store(found, "%solution", block.value("columns", step_back))
    r.do("ret void")
    return r.function(_HEADS["solve"])


def _probe() -> str:
    r = Routine()
    block = _Block(r, "by_row", "row_starts", "row_columns", "entries", "probe", "right", "found")
    with r.loop(0, block.size) as row:
        with r.loop(*block.run("row_starts", row.index), ["0.0"]) as entry:
            value, largest = _size(r, r.load(block["entries"], block.value("by_row", entry.index))), entry.carried[0]
            larger = r.put(f"fcmp ogt double {value}, {largest}")
            entry.following = (r.put(f"select i1 {larger}, double {value}, double {largest}"),)
        r.store(r.number("fmul", entry.carried[0], r.load(block["probe"], row.index)), block["right"], row.index)
    r.do(f"call void @solve_fixed(ptr %block, ptr {block['right']}, ptr {block['found']})")
    with r.loop(0, block.size, ["0.0"]) as row:
        wanted = r.load(block["right"], row.index)
        with r.loop(*block.run("row_starts", row.index), [wanted, _size(r, wanted)]) as entry:
            value = r.load(block["entries"], block.value("by_row", entry.index))
            term = r.number("fmul", value, r.load(block["found"], block.value("row_columns", entry.index)))
            left = r.number("fsub", entry.carried[0], term)
            entry.following = (left, r.number("fadd", entry.carried[1], _size(r, term)))
        allowed = r.number("fmul", entry.carried[1], f"{BACKWARD_ERROR:.17e}")
        good = r.put(f"fcmp ole double {_size(r, entry.carried[0])}, {allowed}")  # false for what is no number
        row.following = (r.put(f"select i1 {good}, double {row.carried[0]}, double 1.0"),)
    r.do(f"ret i1 {r.put(f'fcmp une double {row.carried[0]}, 0.0')}")
    return r.function(_HEADS["probe"])


def _size(r: Routine, value: str) -> str:
    return r.put(f"call double @llvm.fabs.f64(double {value})")
