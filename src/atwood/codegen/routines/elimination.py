"""Elimination with partial pivoting of a full matrix of any size, in its place; a pivot that is zero becomes nan."""

from __future__ import annotations

from math import nan

from atwood.codegen.routines.kinds import ADDRESS, INTEGER, Lanes
from atwood.codegen.routines.language import Routine, Value

_WIDTH = 4


def write_elimination(factorise: str = "factorise", substitute: str = "substitute") -> list[Routine]:
    """Write the routines that factorise a matrix row by row, and that solve for one right-hand side."""
    return [_factorise(factorise), _substitute(substitute)]


def _factorise(name: str) -> Routine:
    r = Routine(name, {"n": INTEGER, "a": ADDRESS, "pivots": ADDRESS}, None)
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


def _substitute(name: str) -> Routine:
    r = Routine(name, {"n": INTEGER, "a": ADDRESS, "pivots": ADDRESS, "x": ADDRESS}, None)
    n, a, pivots, x = r.arguments
    with r.count(n) as k:
        other = pivots.read(k, INTEGER)
        x[k], x[other] = x[other], x[k]
    with r.count(n, 1) as i:
        row, total = a.at(i * n), r.variable(x[i])
        with r.count(i) as j:
            total.now = total.now - row[j] * x[j]
        x[i] = total.now
    with r.count(n) as turn:
        i = n - 1 - turn
        row, total = a.at(i * n), r.variable(x[i])
        with r.count(n, i + 1) as j:
            total.now = total.now - row[j] * x[j]
        x[i] = total.now / row[i]
    return r
