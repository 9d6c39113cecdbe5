"""How sums, products and quotients are made, with what simplifies them; see `atwood.expr.core.algebra`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from atwood.errors import AtwoodError
from atwood.expr.core.elementary import ON_FLOATS

if TYPE_CHECKING:
    from atwood.expr.core.graph import Expression


_SIGNED = frozenset({"neg", "mul", "div"})
"""What may be the opposite of something plainer, or have a factor; nothing else is looked at for these."""


def add(a: Expression, b: Expression) -> Expression:
    """Return ``a + b``."""
    if b.operation == "constant":
        a, b = b, a
    graph = a.graph
    if a.operation == "constant":
        if b.operation == "constant":
            return graph.constant(a.payload + b.payload)
        return _shift(a.payload, b)
    if a is b or a.operation in _SIGNED or b.operation in _SIGNED:
        if a.operation == "neg" and b.operation == "neg":
            return negate(add(a.arguments[0], b.arguments[0]))
        opposite = plainer_opposite(b)
        if opposite is not None:
            return subtract(a, opposite)
        opposite = plainer_opposite(a)
        if opposite is not None:
            return subtract(b, opposite)
        merged = _merge(a, b, 1.0)
        if merged is not None:
            return merged
    if a.operation == "sub" and a.arguments[1] is b:
        return a.arguments[0]
    if b.operation == "sub" and b.arguments[1] is a:
        return b.arguments[0]
    return graph.node("add", _in_order(a, b)) if graph.origin is None else _from_origin(a, b)


def subtract(a: Expression, b: Expression) -> Expression:
    """Return ``a - b``."""
    graph = a.graph
    if b.operation == "constant":
        return add(graph.constant(-b.payload), a)
    if a is b:
        return graph.zero
    if a.operation == "constant":
        return _shift_minus(a.payload, b)
    if a.operation in _SIGNED or b.operation in _SIGNED:
        opposite = plainer_opposite(b)
        if opposite is not None:
            return add(a, opposite)
        if a.operation == "neg":
            opposite = negate(b)
            if opposite.operation != "neg":
                return subtract(opposite, a.arguments[0])
            return negate(add(a.arguments[0], b))
        merged = _merge(a, b, -1.0)
        if merged is not None:
            return merged
    left = _without(a, b)
    if left is not None:
        return left
    left = _without(b, a)
    if left is not None:
        return negate(left)
    met = _known_together(a, b)
    if met is None and graph.origin is not None:
        met = _apart_from_origin(a, b)
    return graph.node("sub", (a, b)) if met is None else met


def _known_together(a: Expression, b: Expression) -> Expression | None:
    """Return ``a - b`` with the known terms of both taken from each other, so that a large one that both have is gone.

    So positions that are counted from one place far away are as far apart as they are from there.
    """
    known_a, known_b = _known_term(a), _known_term(b)
    if known_a is not None and known_b is not None:
        return subtract(_other(a, known_a), _other(b, known_b)) if known_a is known_b else None
    if known_a is not None and not b.reads:
        return subtract(_other(a, known_a), subtract(b, known_a))
    if known_b is not None and not a.reads:
        return subtract(subtract(a, known_b), _other(b, known_b))
    return None


def _origin_term(total: Expression) -> Expression | None:
    """Return the term of a sum that is where positions are counted from."""
    known = _known_term(total)
    return known if known is not None and any(known is one for one in total.graph.origin or ()) else None


def _from_origin(a: Expression, b: Expression) -> Expression:
    """Return ``a + b`` with the origin outside, as o + (p + arm), or (p + arm) - (r - o).

    So the difference of two positions is without it.
    """
    for one, other in ((a, b), (b, a)):
        term = _origin_term(one)
        if term is not None and other.reads:
            return a.graph.node("add", (term, add(_other(one, term), other)))
        if one.operation == "sub" and not one.arguments[1].reads and other.reads:
            return a.graph.node("sub", (add(one.arguments[0], other), one.arguments[1]))
    return a.graph.node("add", _in_order(a, b))


def _apart_from_origin(a: Expression, b: Expression) -> Expression | None:
    """Return ``a - b`` with the origin outside, or taken from what is known, as for o + (p - arm), p - (r - o) - o."""
    term = _origin_term(a)
    if term is not None and _known_term(b) is None:
        return a.graph.node("add", (term, subtract(_other(a, term), b)))
    if a.operation != "sub" or a.arguments[1].reads:
        return None
    place, known = a.arguments
    if not b.reads:
        return subtract(place, add(known, b))
    term = _origin_term(b)
    return None if term is None else subtract(subtract(place, _other(b, term)), add(known, term))


def _known_term(total: Expression) -> Expression | None:
    """Return the term of a sum of two that is known and no constant, if the other is not known."""
    if total.operation != "add" or not total.reads:
        return None
    return next((one for one in total.arguments if not one.reads and not one.is_constant), None)


def _other(total: Expression, term: Expression) -> Expression:
    """Return the other term of a sum of two."""
    return total.arguments[1] if total.arguments[0] is term else total.arguments[0]


def _without(a: Expression, b: Expression) -> Expression | None:
    """Return ``a - b`` if b is one of the two terms of a.

    So the difference of two positions along a chain is the one link between them.
    """
    if a.operation == "add" and b in a.arguments:
        return _other(a, b)
    if a.operation == "sub" and a.arguments[0] is b:
        return negate(a.arguments[1])
    return None


def _shift(c: float, b: Expression) -> Expression:
    """Return ``c + b`` for a constant c and a b that is not constant."""
    graph = b.graph
    if c == 0.0:
        return b
    if b.operation == "neg":
        return subtract(graph.constant(c), b.arguments[0])
    if b.operation in ("add", "sub") and b.arguments[0].operation == "constant":
        total = c + b.arguments[0].payload
        if math.isfinite(total):
            rest = b.arguments[1]
            head = graph.constant(total)
            return add(head, rest) if b.operation == "add" else subtract(head, rest)
    return graph.node("add", (graph.constant(c), b))


def _shift_minus(c: float, b: Expression) -> Expression:
    """Return ``c - b`` for a constant c and a b that is not constant."""
    graph = b.graph
    if c == 0.0:
        return negate(b)
    if b.operation == "neg":
        return _shift(c, b.arguments[0])
    if b.operation in ("add", "sub") and b.arguments[0].operation == "constant":
        total = c - b.arguments[0].payload
        if math.isfinite(total):
            rest = b.arguments[1]
            return _shift_minus(total, rest) if b.operation == "add" else _shift(total, rest)
    return graph.node("sub", (graph.constant(c), b))


def _merge(a: Expression, b: Expression, side: float) -> Expression | None:
    """Return ``a + side * b`` as one product if both share all but a known factor, or the constant factor."""
    known_a, rest_a = _parametric_factor(a)
    known_b, rest_b = _parametric_factor(b)
    if rest_a is rest_b and not (known_a is None and known_b is None):
        one = a.graph.one
        p, q = (one if known_a is None else known_a), (one if known_b is None else known_b)
        return multiply(add(p, q) if side > 0.0 else subtract(p, q), rest_a)
    factor_a, core_a = _split(a)
    factor_b, core_b = _split(b)
    if core_a is not core_b:
        if factor_a == 1.0 or abs(factor_a) != abs(factor_b):
            return None
        alike = (factor_a == factor_b) == (side > 0.0)
        return multiply(a.graph.constant(factor_a), add(core_a, core_b) if alike else subtract(core_a, core_b))
    total = factor_a + side * factor_b
    if not math.isfinite(total):
        return None
    return multiply(a.graph.constant(total), core_a)


def _split(a: Expression) -> tuple[float, Expression]:
    """Return an expression as a constant factor and the rest."""
    if a.operation == "mul" and a.arguments[0].operation == "constant":
        core = a.arguments[1]
        if not (core.operation == "mul" and core.arguments[0].operation == "constant"):
            return a.arguments[0].payload, core
    return 1.0, a  # also if two constants could not become one without overflow: then leave both alone


def multiply(a: Expression, b: Expression) -> Expression:
    """Return ``a * b``."""
    if b.operation == "constant":
        a, b = b, a
    graph = a.graph
    if a.operation == "constant":
        if b.operation == "constant":
            return graph.constant(a.payload * b.payload)
        return _scale(a.payload, b)
    if b.operation == "neg":
        if a.operation == "neg":
            return multiply(a.arguments[0], b.arguments[0])
        return negate(multiply(a, b.arguments[0]))
    if a.operation == "neg":
        return negate(multiply(a.arguments[0], b))
    if a is b and a.operation == "sqrt":
        return a.arguments[0]
    if a.operation == b.operation == "exp" and a is not b and a.reads and b.reads:
        power = add(a.arguments[0], b.arguments[0])  # one factor may be too large for a number where the product is not
        if power.operation == "constant":
            return graph.constant(ON_FLOATS["exp"](power.payload))
        return graph.node("exp", (power,))
    if (not a.reads) != (not b.reads):
        known, other = (b, a) if a.reads else (a, b)
        inner, rest = _parametric_factor(other)
        if inner is not None:
            return multiply(multiply(known, inner), rest)
        found = _meet_known_products(known, other)
        if found is not None:
            return found
        return graph.node("mul", _in_order(a, b))
    if a.operation != "mul" and b.operation != "mul":
        return graph.node("mul", _in_order(a, b))
    for product, symbol in ((a, b), (b, a)):  # (x u) u is x (u u), whose square others share
        if symbol.operation == "symbol" and product.operation == "mul" and symbol in product.arguments:
            first, second = product.arguments
            if first is not second:
                return multiply(second if first is symbol else first, multiply(symbol, symbol))
    factor_a, core_a = _split(a)
    factor_b, core_b = _split(b)
    if core_a is not a or core_b is not b:
        factor = factor_a * factor_b
        if _is_safe(factor):
            return multiply(graph.constant(factor), multiply(core_a, core_b))
    return graph.node("mul", _in_order(a, b))


def _meet_known_products(known: Expression, other: Expression) -> Expression | None:
    """Return ``known * other`` from products with `known` that are there already: l (c u) is (l c) u where l c is."""
    graph = known.graph
    if other.operation == "mul":
        for core, rest in (other.arguments, other.arguments[::-1]):
            product = graph.find("mul", _in_order(known, core))
            if product is not None:
                return graph.node("mul", _in_order(product, rest))
    if other.operation in ("add", "sub"):
        p, q = other.arguments
        if p.operation == q.operation == "mul":
            p_met, q_met = _meet_known_products(known, p), _meet_known_products(known, q)
            if p_met is not None and q_met is not None:
                return add(p_met, q_met) if other.operation == "add" else subtract(p_met, q_met)
    return None


def _in_order(a: Expression, b: Expression) -> tuple[Expression, Expression]:
    """Return two operands that may be exchanged in the order in which they are shared."""
    return (a, b) if a.index < b.index else (b, a)


def _parametric_factor(a: Expression) -> tuple[Expression | None, Expression]:
    """Return a product as its factor that depends on parameters alone and the rest; None if it has no such factor."""
    if a.operation == "mul" and a.reads:
        p, q = a.arguments
        if not p.reads:
            return p, q
        if not q.reads:
            return q, p
    return None, a


def _scale(c: float, b: Expression) -> Expression:
    """Return ``c * b`` for a constant c and a b that is not constant."""
    graph = b.graph
    if c == 0.0:
        return graph.zero
    if c == 1.0:
        return b
    if c == -1.0:
        return negate(b)
    if b.operation == "neg":
        return _scale(-c, b.arguments[0])
    if b.operation in ("mul", "div") and b.arguments[0].operation == "constant":
        product = c * b.arguments[0].payload
        if _is_safe(product):
            rest = b.arguments[1]
            return _scale(product, rest) if b.operation == "mul" else divide(graph.constant(product), rest)
    factor, rest = _parametric_factor(b)
    if factor is not None and not factor.is_constant:
        if c < 0.0:  # the sign stays outside, where products of either sign are shared
            return negate(_scale(-c, b))
        return multiply(_scale(c, factor), rest)
    return graph.node("mul", (graph.constant(c), b))


def _is_safe(factor: float) -> bool:
    """Return whether a product of constants neither overflowed nor lost digits by underflow."""
    return 1e-290 < abs(factor) < 1e290


class DivisionByExactZeroError(AtwoodError):
    """A quotient whose divisor is zero by the structure of a scene, whatever its coordinates are."""


def divide(a: Expression, b: Expression) -> Expression:
    """Return ``a / b``; dividing by the constant 0 is an error."""
    graph = a.graph
    if b.operation == "constant":
        divisor = b.payload
        if divisor == 0.0:
            raise DivisionByExactZeroError(
                f"{a!r} is divided by the constant 0",
                advice="A quantity that is exactly zero shapes the equations: leave the part out, or give it a size.",
            )
        if a.operation == "constant":
            return graph.constant(a.payload / divisor)
        if _is_safe(divisor):
            return _scale(1.0 / divisor, a)
    if a.operation == "constant" and a.payload == 0.0:
        return graph.zero
    if b.operation == "neg":
        return negate(divide(a, b.arguments[0]))
    if a.operation == "neg":
        return negate(divide(a.arguments[0], b))
    factor, core = _split(b)
    if a.operation == "constant" and core is not b:
        quotient = a.payload / factor
        if _is_safe(quotient):
            return divide(graph.constant(quotient), core)
    return graph.node("div", (a, b))


def negate(a: Expression) -> Expression:
    """Return ``-a``, without an operation of its own where the sign can go elsewhere."""
    graph = a.graph
    operation = a.operation
    if operation == "constant":
        return graph.constant(-a.payload)
    if operation == "neg":
        return a.arguments[0]
    if operation == "sub":
        return subtract(a.arguments[1], a.arguments[0])
    if operation in ("mul", "div", "add") and a.arguments[0].operation == "constant":
        head = graph.constant(-a.arguments[0].payload)
        rest = a.arguments[1]
        if operation == "mul":
            return multiply(head, rest)
        return divide(head, rest) if operation == "div" else subtract(head, rest)
    return graph.node("neg", (a,))


def plainer_opposite(a: Expression) -> Expression | None:
    """Return ``-a`` if that is the plainer of the two."""
    if a.operation == "neg":
        return a.arguments[0]
    if a.operation in ("mul", "div"):
        head = a.arguments[0]
        if head.operation == "constant" and head.payload < 0.0:
            return negate(a)
    return None
