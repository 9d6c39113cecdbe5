"""Convolutions of Taylor coefficients: their terms are written out for each order; only the blocks are a loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from atwood.codegen.routines.kinds import ADDRESS, INTEGER, Lanes
from atwood.codegen.routines.language import Routine, Value
from atwood.integrators.taylor.memory import LANES, STRIDE
from atwood.integrators.taylor.problem import HIGHEST

_CHAINS = 4
"""Sums that the terms of a convolution are spread over, so that additions do not wait for each other."""

_BLOCK = Lanes(LANES)

Products = Sequence[tuple[Value, Value]]


def write_convolutions() -> list[Routine]:
    """Write ``pairs1``, ``squares1`` and so on, which add up the products of an order in all blocks of a table."""
    orders = range(1, HIGHEST)
    pairs = [_blocks(f"pairs{order}", 2 * STRIDE, _pairs, order) for order in orders]
    return [*pairs, *(_blocks(f"squares{order}", STRIDE, _squares, order) for order in orders)]


def _blocks(name: str, stride: int, write: Callable[[Routine, Value, int], Value | None], order: int) -> Routine:
    r = Routine(name, {"table": ADDRESS, "sums": ADDRESS, "blocks": INTEGER}, result=None)
    table, sums, blocks = r.arguments
    with r.count(blocks) as b:
        total = write(r, table.at(b * stride), order)
        sums.write(b * LANES, 0.0 if total is None else total, _BLOCK)
    return r


def _row(block: Value, order: int) -> Value:
    """Return the row of an order in a block."""
    return block.read(LANES * (order - 1), _BLOCK)


def _with(r: Routine, total: Value | None, a: Value, b: Value) -> Value:
    """Return a sum with one product more."""
    return a * b if total is None else r.fused(a, b, total)


def _total(r: Routine, products: Products) -> Value | None:
    """Return the sum of products; None if there are none."""
    chains: list[Value] = []
    for i, (a, b) in enumerate(products):
        if i < _CHAINS:
            chains.append(a * b)
        else:
            chains[i % _CHAINS] = r.fused(a, b, chains[i % _CHAINS])
    while len(chains) > 1:
        pairs = [chains[i : i + 2] for i in range(0, len(chains), 2)]
        chains = [one[0] + one[1] if len(one) == 2 else one[0] for one in pairs]
    return chains[0] if chains else None


def _pairs(r: Routine, left: Value, order: int) -> Value | None:
    """Return the convolutions of two values at an order.

    The rows of the order before have just been written by parts, and are the last that can be read: what they are in
    is added last.
    """
    right = left.at(STRIDE)
    products = [(_row(left, j), _row(right, order - j)) for j in range(1, order)]
    total = _total(r, products[1:-1])
    for a, b in products[:1] + products[1:][-1:]:
        total = _with(r, total, a, b)
    return total


def _squares(r: Routine, left: Value, order: int) -> Value | None:
    """Return the convolutions of values with themselves: each product occurs twice but the middle.

    What the rows of the order before are in is added last.
    """
    half = _total(r, [(_row(left, j), _row(left, order - j)) for j in range(2, (order + 1) // 2)])
    total = None if half is None else half + half
    if order % 2 == 0:
        middle = _row(left, order // 2)
        total = _with(r, total, middle, middle)
    if order > 2:
        first, last = _row(left, 1), _row(left, order - 1)
        total = _with(r, total, first + first, last)
    return total
