"""Linear systems in LLVM's language: elimination with partial pivoting.

Systems of up to three unknowns are eliminated in registers.  Larger ones are factorised in the scratch array by a
routine that is written once.  Systems with the same matrix share its factors.  A pivot that is zero becomes nan,
and so does then every unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from atwood.codegen.llvm.layout import LARGEST_UNROLLED, MatrixKey, matrix_key
from atwood.codegen.llvm.text import Writer, literal
from atwood.expr.core.graph import Expression
from atwood.late import dataclass

__all__ = ["ROUTINES", "Solver"]


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
        start = self._regions[key]
        pivots, side = start + size * size, start + size * (size + 1)
        writer.needs.elimination = True
        if key not in self._large:
            self._large.add(key)
            for position, argument in enumerate(solve.arguments[: size * size]):
                writer.store(writer.value(argument), "scratch", start + position)
            places = f"ptr {writer.address('scratch', start)}, ptr {writer.address('scratch', pivots)}"
            writer.lines.append(f"  call void @factorise(i64 {size}, {places})")
        for position, value in enumerate(right):
            writer.store(value, "scratch", side + position)
        places = f"ptr {writer.address('scratch', start)}, ptr {writer.address('scratch', pivots)}"
        writer.lines.append(f"  call void @substitute(i64 {size}, {places}, ptr {writer.address('scratch', side)})")
        for unknown in unknowns:
            writer.values[unknown.index] = writer.load("scratch", side + unknown.payload)


def _eliminate(writer: Writer, size: int, entries: Sequence[str]) -> _Factors:
    """Write the elimination of a small matrix."""
    put = writer.put
    rows = [list(entries[i * size : (i + 1) * size]) for i in range(size)]
    factors = _Factors(rows, {}, {})
    for k in range(size):
        for i in range(k + 1, size):
            held = put(f"call double @llvm.fabs.f64(double {rows[k][k]})")
            other = put(f"call double @llvm.fabs.f64(double {rows[i][k]})")
            swap = put(f"fcmp ogt double {other}, {held}")
            factors.exchanges[k, i] = swap
            for j in range(k, size):
                rows[k][j], rows[i][j] = _exchange(writer, swap, rows[k][j], rows[i][j])
        zero = put(f"fcmp oeq double {rows[k][k]}, 0.0")
        rows[k][k] = put(f"select i1 {zero}, double {literal(math.nan)}, double {rows[k][k]}")
        for i in range(k + 1, size):
            factor = put(f"fdiv double {rows[i][k]}, {rows[k][k]}")
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
        side[i] = writer.put(f"fdiv double {side[i]}, {factors.rows[i][i]}")
    return side


def _exchange(writer: Writer, swap: str, a: str, b: str) -> tuple[str, str]:
    first = writer.put(f"select i1 {swap}, double {b}, double {a}")
    return first, writer.put(f"select i1 {swap}, double {a}, double {b}")


def _reduce(writer: Writer, a: str, factor: str, b: str) -> str:
    product = writer.put(f"fmul double {factor}, {b}")
    return writer.put(f"fsub double {a}, {product}")


_FACTORISE = """
define internal void @factorise(i64 %n, ptr noalias %a, ptr noalias %pivots) {
entry:
  br label %column
column:
  %k = phi i64 [ 0, %entry ], [ %k.next, %column.end ]
  %k.more = icmp slt i64 %k, %n
  br i1 %k.more, label %search.start, label %end
search.start:
  %kn = mul i64 %k, %n
  %row.k = getelementptr double, ptr %a, i64 %kn
  %kk = getelementptr double, ptr %row.k, i64 %k
  %head = load double, ptr %kk
  %head.abs = call double @llvm.fabs.f64(double %head)
  %k.next = add i64 %k, 1
  br label %search
search:
  %s = phi i64 [ %k.next, %search.start ], [ %s.next, %search.body ]
  %best = phi i64 [ %k, %search.start ], [ %best.next, %search.body ]
  %best.abs = phi double [ %head.abs, %search.start ], [ %best.abs.next, %search.body ]
  %s.more = icmp slt i64 %s, %n
  br i1 %s.more, label %search.body, label %search.end
search.body:
  %sn = mul i64 %s, %n
  %sk = add i64 %sn, %k
  %s.place = getelementptr double, ptr %a, i64 %sk
  %s.value = load double, ptr %s.place
  %s.abs = call double @llvm.fabs.f64(double %s.value)
  %s.better = fcmp ogt double %s.abs, %best.abs
  %best.next = select i1 %s.better, i64 %s, i64 %best
  %best.abs.next = select i1 %s.better, double %s.abs, double %best.abs
  %s.next = add i64 %s, 1
  br label %search
search.end:
  %pivot.place = getelementptr i64, ptr %pivots, i64 %k
  store i64 %best, ptr %pivot.place
  %bn = mul i64 %best, %n
  %row.b = getelementptr double, ptr %a, i64 %bn
  %stays = icmp eq i64 %best, %k
  br i1 %stays, label %scale, label %swap
swap:
  %w = phi i64 [ 0, %search.end ], [ %w.next, %swap ]
  %w.k = getelementptr double, ptr %row.k, i64 %w
  %w.b = getelementptr double, ptr %row.b, i64 %w
  %w.first = load double, ptr %w.k
  %w.second = load double, ptr %w.b
  store double %w.second, ptr %w.k
  store double %w.first, ptr %w.b
  %w.next = add i64 %w, 1
  %w.more = icmp slt i64 %w.next, %n
  br i1 %w.more, label %swap, label %scale
scale:
  %p.read = load double, ptr %kk
  %p.zero = fcmp oeq double %p.read, 0.0
  %p = select i1 %p.zero, double 0x7FF8000000000000, double %p.read
  store double %p, ptr %kk
  br label %row
row:
  %i = phi i64 [ %k.next, %scale ], [ %i.next, %row.end ]
  %i.more = icmp slt i64 %i, %n
  br i1 %i.more, label %row.start, label %column.end
row.start:
  %in = mul i64 %i, %n
  %row.i = getelementptr double, ptr %a, i64 %in
  %ik = getelementptr double, ptr %row.i, i64 %k
  %ik.read = load double, ptr %ik
  %f = fdiv double %ik.read, %p
  store double %f, ptr %ik
  %f.zero = fcmp oeq double %f, 0.0
  br i1 %f.zero, label %row.end, label %wide.start
wide.start:
  %f.one = insertelement <4 x double> poison, double %f, i64 0
  %f.all = shufflevector <4 x double> %f.one, <4 x double> poison, <4 x i32> zeroinitializer
  br label %wide
wide:
  %j = phi i64 [ %k.next, %wide.start ], [ %j.next, %wide.body ]
  %j.next = add i64 %j, 4
  %j.more = icmp sle i64 %j.next, %n
  br i1 %j.more, label %wide.body, label %tail
wide.body:
  %kj = getelementptr double, ptr %row.k, i64 %j
  %ij = getelementptr double, ptr %row.i, i64 %j
  %kj.read = load <4 x double>, ptr %kj, align 8
  %ij.read = load <4 x double>, ptr %ij, align 8
  %product = fmul <4 x double> %f.all, %kj.read
  %reduced = fsub <4 x double> %ij.read, %product
  store <4 x double> %reduced, ptr %ij, align 8
  br label %wide
tail:
  %l = phi i64 [ %j, %wide ], [ %l.next, %tail.body ]
  %l.more = icmp slt i64 %l, %n
  br i1 %l.more, label %tail.body, label %row.end
tail.body:
  %kl = getelementptr double, ptr %row.k, i64 %l
  %il = getelementptr double, ptr %row.i, i64 %l
  %kl.read = load double, ptr %kl
  %il.read = load double, ptr %il
  %l.product = fmul double %f, %kl.read
  %l.reduced = fsub double %il.read, %l.product
  store double %l.reduced, ptr %il
  %l.next = add i64 %l, 1
  br label %tail
row.end:
  %i.next = add i64 %i, 1
  br label %row
column.end:
  br label %column
end:
  ret void
}
"""

_SUBSTITUTE = """
define internal void @substitute(i64 %n, ptr noalias %a, ptr noalias %pivots, ptr noalias %x) {
entry:
  br label %order
order:
  %k = phi i64 [ 0, %entry ], [ %k.next, %order ]
  %k.pivot = getelementptr i64, ptr %pivots, i64 %k
  %b = load i64, ptr %k.pivot
  %x.k = getelementptr double, ptr %x, i64 %k
  %x.b = getelementptr double, ptr %x, i64 %b
  %first = load double, ptr %x.k
  %second = load double, ptr %x.b
  store double %second, ptr %x.k
  store double %first, ptr %x.b
  %k.next = add i64 %k, 1
  %k.more = icmp slt i64 %k.next, %n
  br i1 %k.more, label %order, label %down
down:
  %i = phi i64 [ 1, %order ], [ %i.next, %down.end ]
  %i.more = icmp slt i64 %i, %n
  br i1 %i.more, label %down.start, label %up.start
down.start:
  %in = mul i64 %i, %n
  %row.i = getelementptr double, ptr %a, i64 %in
  %x.i = getelementptr double, ptr %x, i64 %i
  %i.read = load double, ptr %x.i
  br label %down.sum
down.sum:
  %j = phi i64 [ 0, %down.start ], [ %j.next, %down.sum ]
  %sum = phi double [ %i.read, %down.start ], [ %sum.next, %down.sum ]
  %ij = getelementptr double, ptr %row.i, i64 %j
  %x.j = getelementptr double, ptr %x, i64 %j
  %ij.read = load double, ptr %ij
  %j.read = load double, ptr %x.j
  %product = fmul double %ij.read, %j.read
  %sum.next = fsub double %sum, %product
  %j.next = add i64 %j, 1
  %j.more = icmp slt i64 %j.next, %i
  br i1 %j.more, label %down.sum, label %down.end
down.end:
  store double %sum.next, ptr %x.i
  %i.next = add i64 %i, 1
  br label %down
up.start:
  br label %up
up:
  %u.after = phi i64 [ %n, %up.start ], [ %u, %up.end ]
  %u.more = icmp sgt i64 %u.after, 0
  br i1 %u.more, label %up.row, label %end
up.row:
  %u = sub i64 %u.after, 1
  %un = mul i64 %u, %n
  %row.u = getelementptr double, ptr %a, i64 %un
  %x.u = getelementptr double, ptr %x, i64 %u
  %u.read = load double, ptr %x.u
  br label %up.sum
up.sum:
  %v = phi i64 [ %u.after, %up.row ], [ %v.next, %up.body ]
  %total = phi double [ %u.read, %up.row ], [ %total.next, %up.body ]
  %v.more = icmp slt i64 %v, %n
  br i1 %v.more, label %up.body, label %up.end
up.body:
  %uv = getelementptr double, ptr %row.u, i64 %v
  %x.v = getelementptr double, ptr %x, i64 %v
  %uv.read = load double, ptr %uv
  %v.read = load double, ptr %x.v
  %v.product = fmul double %uv.read, %v.read
  %total.next = fsub double %total, %v.product
  %v.next = add i64 %v, 1
  br label %up.sum
up.end:
  %uu = getelementptr double, ptr %row.u, i64 %u
  %uu.read = load double, ptr %uu
  %quotient = fdiv double %total, %uu.read
  store double %quotient, ptr %x.u
  br label %up
end:
  ret void
}
"""

ROUTINES = _FACTORISE + _SUBSTITUTE
"""Factorise a matrix of any size row by row, and solve for one right-hand side, both in place."""
