"""Elimination on the expression graph: sparse symmetric systems written out as straight-line code.

The accelerations of a mechanism and the forces of its joints solve a system that has an entry only where two things
touch.  Eliminated from the leaves of the mechanism to its root it keeps that shape, so that the work grows with the
number of joints (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 7 and 8).
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence

from atwood.expr import Expression, Graph, live
from atwood.expr.core import algebra
from atwood.lazy_dataclasses import dataclass, replace

Tidy = Callable[[list[Expression]], list[Expression]]
Place = tuple[int, int]

_MANY = 50_000
"""After so many new nodes a large graph forgets those that nothing refers to."""

_REACH = 40
"""So many sums are taken apart in search of what two values have in common."""


@dataclass(frozen=True)
class SymmetricSystem:
    """A linear system ``M x - G^T y = b``, ``G x + C y = c`` with symmetric M and C, unknowns in any order.

    If M is positive definite, and G has full rank or C is positive definite, pivots are positive when multipliers
    follow the masses that hold them.

    Attributes
    ----------
    entries
        The entries of M, G and C, by two unknowns in rising order.
    right
        The right-hand side.
    signs
        +1 for each unknown in x, -1 for each in y.
    """

    entries: Mapping[Place, Expression]
    right: Sequence[Expression]
    signs: Sequence[int]


@dataclass(frozen=True)
class Step:
    """How one unknown follows from those that were eliminated after it.

    Attributes
    ----------
    unknown
        Its number.
    right, shares
        It is `right` plus the sum of each share times its unknown.
    is_near
        Whether the pivot depends on parameters alone.
    inverse
        One over the pivot.
    """

    unknown: int
    right: Expression
    shares: tuple[tuple[int, int, Expression], ...]
    is_near: bool
    inverse: Expression


@dataclass
class _Entry:
    """A value in two parts: what parameters and the configuration give, and what elimination has added."""

    near: Expression
    far: Expression


def eliminate(system: SymmetricSystem, order: Sequence[int], tidy: Tidy = list) -> list[Step]:
    """Eliminate the unknowns of a system one after the other."""
    graph = system.right[0].graph
    rows: list[dict[int, _Entry]] = [{} for _ in system.right]
    for (i, j), value in system.entries.items():
        if not value.is_zero:
            rows[i][j] = rows[j][i] = _Entry(value, graph.zero)
    right = [_Entry(value, graph.zero) for value in system.right]
    steps: list[Step] = []
    first = start = len(graph)
    for p in order:
        steps.append(_eliminate_one(p, rows, right, system.signs, tidy))
        if len(graph) > start + _MANY:
            graph.forget(start)
            start = len(graph)
    right.clear()
    graph.forget(first)
    return steps


def _eliminate_one(
    p: int, rows: list[dict[int, _Entry]], right: list[_Entry], signs: Sequence[int], tidy: Tidy
) -> Step:
    row = rows[p]
    others = sorted(j for j in row if j != p)
    for j in others:
        del rows[j][p]
    pivot, side, *values = _settled([row.pop(p), right[p], *(row[j] for j in others)], tidy)
    near = pivot.is_parametric
    inverse = pivot.graph.one / pivot
    shares = [value * inverse for value in values]
    for a, j in enumerate(others):
        for b, k in enumerate(others[a:], a):
            entry = rows[j].get(k)
            if entry is None:
                entry = rows[j][k] = rows[k][j] = _Entry(pivot.graph.zero, pivot.graph.zero)
            _change(entry, signs[j] == signs[k] != signs[p], shares[a] * values[b], near)
        _change(right[j], signs[p] < 0 < signs[j], shares[a] * side, near)
    directions = [1 if signs[p] > 0 > signs[j] else -1 for j in others]
    return Step(p, side * inverse, tuple(zip(others, directions, shares, strict=True)), near, inverse)


def _change(entry: _Entry, adds: bool, amount: Expression, near: bool) -> None:
    if near:
        entry.near = entry.near + amount if adds else entry.near - amount
    else:
        entry.far = entry.far + amount if adds else entry.far - amount


def _settled(entries: Sequence[_Entry], tidy: Tidy) -> list[Expression]:
    values = tidy([entry.near for entry in entries])
    return [near + entry.far for near, entry in zip(values, entries, strict=True)]


def with_right(steps: Sequence[Step], signs: Sequence[int], right: Sequence[Expression]) -> list[Step]:
    """Return the same steps for another right-hand side."""
    left, found = [_Entry(value, value.graph.zero) for value in right], []
    for step in steps:
        (side,) = _settled([left[step.unknown]], list)
        for other, _, share in step.shares:
            _change(left[other], signs[step.unknown] < 0 < signs[other], share * side, step.is_near)
        found.append(replace(step, right=side * step.inverse))
    return found


def solution_of(steps: Sequence[Step]) -> list[Expression]:
    """Return all unknowns of a system that is eliminated."""
    known: dict[int, Expression] = {}
    for step in reversed(steps):
        known[step.unknown] = back_substitute(step, known)
    return [known[i] for i in range(len(steps))]


def back_substitute(step: Step, known: Mapping[int, Expression]) -> Expression:
    """Return an unknown from those that were eliminated after it."""
    total = step.right
    for other, direction, share in step.shares:
        product = share * known[other]
        total = total + product if direction > 0 else total - product
    return total


def minimum_degree(places: Sequence[Place], size: int, first: Sequence[int] = ()) -> list[int]:
    """Return an order of elimination that adds few entries: always the unknown with the fewest neighbours."""
    from atwood.numerics.body_order import by_least, neighbours_of

    around, preferred = neighbours_of(places, size), set(first)
    return list(by_least(around, lambda i: (len(around[i]), i not in preferred, -i)))


def fill_of(places: Sequence[Place], order: Sequence[int]) -> int:
    """Return the number of products that an elimination takes."""
    from atwood.numerics.body_order import eliminated, neighbours_of

    around = neighbours_of(places, len(order))
    sizes = (len(eliminated(around, p)) for p in order)
    return sum(size * (size + 7) // 2 for size in sizes)


def place_differences(
    outputs: Sequence[Expression], mapping: Mapping[Expression, Expression | float]
) -> list[Expression]:
    """Replace symbols as `substitute` does, and cancel what the two sides of a difference have in common.

    The difference of two positions along a chain becomes the one link between them, although each position is a sum
    over all links before it.
    """
    if not outputs:
        return []
    graph = outputs[0].graph
    nodes = live(outputs)
    placed = {old.index: graph.convert(new) for old, new in mapping.items()}
    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        if node.index in placed or not node.arguments:
            continue
        if node.operation == "component":
            placed[node.index] = unknowns[node.arguments[0].index][node.payload]
            continue
        arguments = [placed.get(argument.index, argument) for argument in node.arguments]
        if node.operation == "solve":
            split = node.payload**2
            unknowns[node.index] = algebra.solve(arguments[:split], arguments[split:])
            placed[node.index] = node
            continue
        made = None
        if node.operation in ("add", "sub") and any(a is not b for a, b in zip(arguments, node.arguments, strict=True)):
            made = _cancelled(graph, arguments[0], arguments[1], 1 if node.operation == "add" else -1)
        placed[node.index] = algebra.build(graph, node.operation, arguments, node.payload) if made is None else made
    return [placed.get(output.index, output) for output in outputs]


def difference(a: Expression, b: Expression) -> Expression:
    """Return ``a - b`` without what both have in common."""
    found = _cancelled(a.graph, a, b, -1)
    return a - b if found is None else found


def _cancelled(graph: Graph, a: Expression, b: Expression, side: int) -> Expression | None:
    """Return ``a + side b`` without the terms that cancel; None if none were found."""
    counts: dict[int, int] = {}
    heap: list[int] = []
    found = False

    def take(term: Expression, count: int) -> None:
        nonlocal found
        while term.operation == "neg":
            term, count = term.arguments[0], -count
        if term.is_zero:
            return
        present = counts.get(term.index)
        if present is None:
            counts[term.index] = count
            heapq.heappush(heap, -term.index)
        else:
            found = found or present * count < 0
            counts[term.index] = present + count

    take(a, 1)
    take(b, side)
    kept: dict[int, int] = {}
    effort = _REACH
    while heap:
        index = -heapq.heappop(heap)
        count = counts.pop(index)
        node = graph.nodes[index]
        if count == 0:
            continue
        if node.operation in ("add", "sub") and effort > 0:
            effort -= 1
            take(node.arguments[0], count)
            take(node.arguments[1], count if node.operation == "add" else -count)
        else:
            kept[index] = count
    if not found:
        return None
    total = graph.zero
    for index, count in sorted(kept.items(), key=lambda item: (item[1] < 0, item[0])):
        total = total + float(count) * graph.nodes[index]
    return total
