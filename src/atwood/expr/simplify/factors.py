"""Products in which all that is known is one factor: it is worked out once a run, and what changes is multiplied once.

Of products that follow each other, as ``p (q (r x))`` with known p, q and r, one is left, ``(p q r) x``, also where
``q (r x)`` is read elsewhere. So there are never more operations, and fewer of them wait for each other. Sums of
multiples of one value are such a product, too. Others stay as they are: what cancels in them does so as before.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence, Set
from operator import is_

from atwood.expr.core.algebra import add, build, multiply, subtract
from atwood.expr.core.analysis import live, varying
from atwood.expr.core.graph import Expression

_Product = tuple[Expression, Expression]
"""A known factor, and what changes."""


def join_known_factors(values: Sequence[Expression], known: Collection[Expression]) -> list[Expression]:
    """Return expressions of the same values, up to rounding, in whose products what is known is one factor.

    Parameters
    ----------
    values
        The expressions.
    known
        Symbols that keep their value for a while. What depends on them alone is known.
    """
    nodes = live(values)
    changing = varying(nodes, known)
    made: dict[Expression, Expression] = {}
    products: dict[Expression, _Product] = {}
    for node in nodes:
        product = _product(node, changing, products) if node in changing else None
        if product is not None:
            products[node] = product
            pair = sorted((product[0], made[product[1]]), key=lambda one: one.index)
            made[node] = node.graph.node("mul", tuple(pair))
            continue
        own = [made[one] for one in node.arguments]
        is_same = all(map(is_, own, node.arguments))
        made[node] = node if is_same else build(node.graph, node.operation, own, node.payload)
    return [made[one] for one in values]


def _product(node: Expression, changing: Set[Expression], products: Mapping[Expression, _Product]) -> _Product | None:
    """Return a product as its known factor and the rest, and so a sum of two multiples of one value or its opposite."""
    if node.operation == "mul":
        factor, rest = sorted(node.arguments, key=lambda one: one in changing)
        if factor in changing:
            return None
        inner, core = products.get(rest, (node.graph.one, rest))
        return multiply(factor, inner), core
    if node.operation not in ("add", "sub") or not all(one in products for one in node.arguments):
        return None
    (first, core), (second, other) = (products[one] for one in node.arguments)
    is_opposite = core.operation == "sub" and other.operation == "sub" and core.arguments == other.arguments[::-1]
    if core is not other and not is_opposite:
        return None
    return (add if is_opposite == (node.operation == "sub") else subtract)(first, second), core
