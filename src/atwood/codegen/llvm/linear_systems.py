"""Linear systems in LLVM's language: elimination with partial pivoting.

Systems of up to three unknowns are eliminated in registers.  Larger ones are factorised in the scratch array by
routines, of which a process has one copy: they are worth LLVM's work where a program that is long is not.  Systems with
the same matrix share its factors.  A pivot that is zero
becomes nan, and so does then every unknown.

Elimination with partial pivoting of a full matrix of any size, in its place; a pivot that is zero becomes nan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import nan

from atwood.codegen.llvm.layout import LARGEST_UNROLLED, MatrixKey, matrix_key
from atwood.codegen.llvm.text import ELIMINATION, Writer
from atwood.codegen.routines import ADDRESS, INTEGER, Lanes, Routine, Value, own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class _Factors:
    """A small matrix after elimination.

    Attributes
    ----------
    rows
        What is left on and above the diagonal.
    exchanges
        For each pivot and row below it, in order: whether the two were exchanged.
    multipliers
        For each pivot and row below it: how much of the pivot's row was subtracted.
    """

    rows: list[list[str]]
    exchanges: dict[tuple[int, int], str]
    multipliers: dict[tuple[int, int], str]


class Solver:
    """Writes the linear systems of one function, and remembers which matrices have been factorised.

    Parameters
    ----------
    regions
        Where the factors of large matrices lie in the scratch array.
    """

    def __init__(self, regions: dict[MatrixKey, int]) -> None:
        self._regions = regions
        self._large: set[MatrixKey] = set()
        self._small: dict[MatrixKey, _Factors] = {}

    def start_chunk(self) -> None:
        """Forget what lies in registers."""
        self._small.clear()

    def write(self, writer: Writer, solve: Expression, unknowns: Sequence[Expression]) -> None:
        """Write a linear system with the unknowns that are needed."""
        size = solve.payload
        key = matrix_key(solve)
        right = [writer.value(argument) for argument in solve.arguments[size * size :]]
        if size <= LARGEST_UNROLLED:
            if key not in self._small:
                entries = [writer.value(argument) for argument in solve.arguments[: size * size]]
                self._small[key] = _eliminate(writer, size, entries)
            found = _substitute(writer, size, self._small[key], right)
            for unknown in unknowns:
                writer.values[unknown.index] = found[unknown.payload]
            return
        if writer.runs > 1:
            raise UnsupportedError(f"there is no machine code in lanes for a linear system of {size} unknowns")
        start = self._regions[key]
        pivots, side = start + size * size, start + size * (size + 1)
        writer.needs.functions.update(ELIMINATION)
        factorise, substitute = map(own_name, ELIMINATION)
        if key not in self._large:
            self._large.add(key)
            for position, argument in enumerate(solve.arguments[: size * size]):
                writer.store(writer.value(argument), "scratch", start + position)
            places = f"ptr {writer.address('scratch', start)}, ptr {writer.address('scratch', pivots)}"
            writer.lines.append(f"  call void @{factorise}(i64 {size}, {places})")
        for position, value in enumerate(right):
            writer.store(value, "scratch", side + position)
        places = f"ptr {writer.address('scratch', start)}, ptr {writer.address('scratch', pivots)}"
        writer.lines.append(f"  call void @{substitute}(i64 {size}, {places}, ptr {writer.address('scratch', side)})")
        for unknown in unknowns:
            writer.values[unknown.index] = writer.load("scratch", side + unknown.payload)


def _eliminate(writer: Writer, size: int, entries: Sequence[str]) -> _Factors:
    """Write the elimination of a small matrix."""
    put, kind = writer.put, writer.kind
    rows = [list(entries[i * size : (i + 1) * size]) for i in range(size)]
    factors = _Factors(rows, {}, {})
    for k in range(size):
        for i in range(k + 1, size):
            held = writer.intrinsic("absolute", rows[k][k])
            other = writer.intrinsic("absolute", rows[i][k])
            swap = put(f"fcmp ogt {kind} {other}, {held}")
            factors.exchanges[k, i] = swap
            for j in range(k, size):
                rows[k][j], rows[i][j] = _exchange(writer, swap, rows[k][j], rows[i][j])
        zero = put(f"fcmp oeq {kind} {rows[k][k]}, {writer.constant(0.0)}")
        rows[k][k] = writer.choose(zero, writer.constant(math.nan), rows[k][k])
        for i in range(k + 1, size):
            factor = put(f"fdiv {kind} {rows[i][k]}, {rows[k][k]}")
            factors.multipliers[k, i] = factor
            for j in range(k + 1, size):
                rows[i][j] = _reduce(writer, rows[i][j], factor, rows[k][j])
    # Row exchanges of later pivots also move the multipliers of earlier ones, which have been used by then: the
    # right-hand side goes through the same exchanges in the same order, and meets each multiplier in its place.
    return factors


def _substitute(writer: Writer, size: int, factors: _Factors, right: Sequence[str]) -> list[str]:
    """Write the solution for one right-hand side."""
    side = list(right)
    for k in range(size):
        for i in range(k + 1, size):
            side[k], side[i] = _exchange(writer, factors.exchanges[k, i], side[k], side[i])
        for i in range(k + 1, size):
            side[i] = _reduce(writer, side[i], factors.multipliers[k, i], side[k])
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            side[i] = _reduce(writer, side[i], factors.rows[i][j], side[j])
        side[i] = writer.put(f"fdiv {writer.kind} {side[i]}, {factors.rows[i][i]}")
    return side


def _exchange(writer: Writer, swap: str, a: str, b: str) -> tuple[str, str]:
    return writer.choose(swap, b, a), writer.choose(swap, a, b)


def _reduce(writer: Writer, a: str, factor: str, b: str) -> str:
    product = writer.put(f"fmul {writer.kind} {factor}, {b}")
    return writer.put(f"fsub {writer.kind} {a}, {product}")


_WIDTH = 4


def write_routines() -> list[Routine]:
    """Write the routines that programs call."""
    factorise, substitute = map(own_name, ELIMINATION)
    return write_elimination(factorise, substitute, exported=True)


def write_elimination(
    factorise: str = "factorise", substitute: str = "substitute", exported: bool = False
) -> list[Routine]:
    """Write the routines that factorise a matrix row by row, and that solve for one right-hand side."""
    return [_factorise_rows(factorise, exported), _substitute_rows(substitute, exported)]


def _factorise_rows(name: str, exported: bool) -> Routine:
    r = Routine(name, {"n": INTEGER, "a": ADDRESS, "pivots": ADDRESS}, None, exported)
    n, a, pivots = r.arguments
    with r.count(n) as k:
        row = a.at(k * n)
        best, largest = r.variable(k, INTEGER), r.variable(r.size(row[k]))
        with r.count(n, k + 1) as i:
            size = r.size(a[i * n + k])
            better = size > largest.now
            best.now = r.choose(better, i, best.now)
            largest.now = r.choose(better, size, largest.now)
        chosen = best.now
        pivots.write(k, chosen)
        with r.when(chosen != k):
            other = a.at(chosen * n)
            with r.count(n) as j:
                row[j], other[j] = other[j], row[j]
        head = row[k]
        pivot = r.choose(head == 0.0, nan, head)
        row[k] = pivot
        with r.count(n, k + 1) as i:
            below = a.at(i * n)
            factor = below[k] / pivot
            below[k] = factor
            with r.when(factor != 0.0):
                _subtract(r, below, row, factor, k + 1, n)
    return r


def _subtract(r: Routine, target: Value, source: Value, factor: Value, start: Value, end: Value) -> None:
    """Subtract a multiple of one row from another, several entries at once."""
    lanes = Lanes(_WIDTH)
    several, j = r.value(factor, lanes), r.variable(start, INTEGER)
    with r.forever() as loop:
        now = j.now
        following = now + _WIDTH
        with r.when(following > end):
            r.leave(loop)
        target.write(now, target.read(now, lanes) - several * source.read(now, lanes))
        j.now = following
    with r.count(end, j.now) as rest:
        target[rest] = target[rest] - factor * source[rest]


def _substitute_rows(name: str, exported: bool) -> Routine:
    r = Routine(name, {"n": INTEGER, "a": ADDRESS, "pivots": ADDRESS, "x": ADDRESS}, None, exported)
    n, a, pivots, x = r.arguments
    with r.count(n) as k:
        other = pivots.read(k, INTEGER)
        x[k], x[other] = x[other], x[k]
    with r.count(n) as k, r.when(x[k] != 0.0):  # what is masked has zeros, and none is waited for
        by = x[k]
        with r.count(n, k + 1) as i:
            x[i] = x[i] - a[i * n + k] * by
    begin, end = r.variable(n, INTEGER), r.variable(n, INTEGER)  # all unknowns that are not zero are between them
    with r.count(n) as turn:
        i = n - 1 - turn
        row, total = a.at(i * n), r.variable(x[i])
        with r.count(end.now, begin.now) as j, r.when(x[j] != 0.0):
            total.now = total.now - row[j] * x[j]
        x[i] = total.now / row[i]
        with r.when(x[i] != 0.0):
            end.now = r.choose(begin.now < n, end.now, i + 1)
            begin.now = i
    return r
