"""How nodes are made: local algebra applied while an expression is written down.

Each function returns the node of one operation after cheap simplifications that look one level down.  They
change a value by rounding at most.  A product with the constant 0 is the constant 0: a structural zero means
"not there", whatever the other factor would be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from atwood.errors import AtwoodError
from atwood.expr.operations import BINARY, UNARY, solve_or_nan

if TYPE_CHECKING:
    from atwood.expr.graph import Expression, Graph

_ODD = frozenset({"sin", "tan", "asin", "atan", "sinh", "tanh", "sign"})
_EVEN = frozenset({"cos", "cosh", "absolute"})
_NEVER_NEGATIVE = frozenset({"sqrt", "exp", "cosh", "absolute"})


def add(a: Expression, b: Expression) -> Expression:
    """Return ``a + b``."""
    if b.operation == "constant":
        a, b = b, a
    graph = a.graph
    if a.operation == "constant":
        if b.operation == "constant":
            return graph.constant(a.payload + b.payload)
        return _shift(a.payload, b)
    if a.operation == "neg" and b.operation == "neg":
        return negate(add(a.arguments[0], b.arguments[0]))
    opposite = _opposite(b)
    if opposite is not None:
        return subtract(a, opposite)
    opposite = _opposite(a)
    if opposite is not None:
        return subtract(b, opposite)
    merged = _merge(a, b, 1.0)
    if merged is not None:
        return merged
    if a.operation == "sub" and a.arguments[1] is b:
        return a.arguments[0]
    if b.operation == "sub" and b.arguments[1] is a:
        return b.arguments[0]
    return graph.node("add", _in_order(a, b))


def subtract(a: Expression, b: Expression) -> Expression:
    """Return ``a - b``."""
    graph = a.graph
    if b.operation == "constant":
        return add(graph.constant(-b.payload), a)
    if a is b:
        return graph.zero
    if a.operation == "constant":
        return _shift_minus(a.payload, b)
    opposite = _opposite(b)
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
    return graph.node("sub", (a, b)) if left is None else negate(left)


def _without(a: Expression, b: Expression) -> Expression | None:
    """Return ``a - b`` if b is one of the two terms of a.

    So the difference of two positions along a chain is the one link between them.
    """
    if a.operation == "add" and b in a.arguments:
        return a.arguments[1] if a.arguments[0] is b else a.arguments[0]
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
    if a.is_parametric != b.is_parametric:
        known, other = (a, b) if a.is_parametric else (b, a)
        inner, rest = _parametric_factor(other)
        if inner is not None:
            return multiply(multiply(known, inner), rest)
        found = _meet_known_products(known, other)
        if found is not None:
            return found
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
    if a.operation == "mul" and not a.is_parametric:
        p, q = a.arguments
        if p.is_parametric:
            return p, q
        if q.is_parametric:
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


def divide(a: Expression, b: Expression) -> Expression:
    """Return ``a / b``; dividing by the constant 0 is an error."""
    graph = a.graph
    if b.operation == "constant":
        divisor = b.payload
        if divisor == 0.0:
            raise AtwoodError(
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


def _opposite(a: Expression) -> Expression | None:
    """Return ``-a`` if that is the plainer of the two."""
    if a.operation == "neg":
        return a.arguments[0]
    if a.operation in ("mul", "div"):
        head = a.arguments[0]
        if head.operation == "constant" and head.payload < 0.0:
            return negate(a)
    return None


def power(a: Expression, b: Expression) -> Expression:
    """Return ``a ** b``; whole constant exponents become products."""
    graph = a.graph
    if b.operation == "constant":
        exponent = b.payload
        if a.operation == "constant":
            return graph.constant(BINARY["pow"](a.payload, exponent))
        if exponent == 0.5:
            return unary("sqrt", a)
        if exponent == -0.5:
            return divide(graph.one, unary("sqrt", a))
        if exponent.is_integer() and abs(exponent) <= 1024:
            whole = _whole_power(a, abs(int(exponent)))
            return whole if exponent >= 0.0 else divide(graph.one, whole)
        pieces = _in_pieces(a, lambda part: power(part, b))
        if pieces is not None:
            return pieces
    return graph.node("pow", (a, b))


def _whole_power(a: Expression, exponent: int) -> Expression:
    """Return a whole power by repeated squaring."""
    result = a.graph.one
    square = a
    while exponent:
        if exponent & 1:
            result = multiply(result, square)
        exponent >>= 1
        if exponent:
            square = multiply(square, square)
    return result


def unary(operation: str, a: Expression) -> Expression:
    """Return the node of a function of one argument."""
    graph = a.graph
    if operation == "neg":
        return negate(a)
    if a.operation == "constant":
        return graph.constant(UNARY[operation](a.payload))
    pieces = _in_pieces(a, lambda part: unary(operation, part))
    if pieces is not None:
        return pieces
    if operation in _ODD:
        opposite = _opposite(a)
        if opposite is not None:
            return negate(unary(operation, opposite))
    elif operation in _EVEN:
        opposite = _opposite(a)
        if opposite is not None:
            return unary(operation, opposite)
        if operation == "absolute" and (a.operation in _NEVER_NEGATIVE or _is_square(a)):
            return a
    elif operation == "sqrt" and _is_square(a):
        return unary("absolute", a.arguments[0])
    elif operation == "logical_not" and a.operation == "logical_not":
        inner = a.arguments[0]
        if _is_condition(inner):
            return inner
    if operation in _INVERSES:
        wave = _time_wave(operation, a)
        if wave is not None:
            return wave
    if operation == "floor":
        relation = _time_relation("floor", a)
        if relation is not None:
            return relation
    if operation in ("sign", "absolute"):
        side = _time_relation("sign", a)
        if side is not None:
            return side if operation == "sign" else multiply(side, a)
    return graph.node(operation, (a,))


def _is_square(a: Expression) -> bool:
    return a.operation == "mul" and a.arguments[0] is a.arguments[1]


def _is_condition(a: Expression) -> bool:
    return a.operation.startswith(("less", "logical"))


def binary(operation: str, a: Expression, b: Expression) -> Expression:
    """Return the node of any operation of two arguments, with its simplifications."""
    special = _BINARY_BUILDERS.get(operation)
    if special is not None:
        return special(a, b)
    if a.operation == "constant" and b.operation == "constant":
        return a.graph.constant(BINARY[operation](a.payload, b.payload))
    if operation in ("minimum", "maximum"):
        if a is b:
            return a
        first = _time_relation("less", a, b) if operation == "minimum" else _time_relation("less", b, a)
        if first is not None:
            return select(first, a, b)
    relations = a.graph.relations
    if operation == "atan2" and relations is not None and relations.are_timed(a, b):  # it jumps where it comes round
        is_left, is_below = relations.take("less", b), relations.take("less", a)
        half = select(is_below, a.graph.constant(-math.pi), a.graph.constant(math.pi))
        around = add(a.graph.node("atan2", (negate(a), negate(b))), half)
        return select(is_left, around, a.graph.node("atan2", (a, b)))
    return a.graph.node(operation, (a, b))


_INVERSES = frozenset({"asin", "acos", "atan"})


def _time_wave(operation: str, a: Expression) -> Expression | None:
    """Return a triangular or saw-tooth wave of time, such as ``asin(sin(w t))``, as an angle that is smooth in pieces.

    So its kinks and jumps, at which sine and cosine only touch or have a pole, are relations like any others.
    """
    if a.operation not in ("sin", "cos", "tan"):
        return None
    x = a.arguments[0]
    along, across = unary("cos", x), unary("sin", x)
    if operation == "atan" and a.operation == "tan":
        side = _time_relation("sign", along)
        return None if side is None else a.graph.node("atan2", (multiply(side, across), multiply(side, along)))
    if operation == "atan" or a.operation == "tan":
        return None
    first, second = (across, along) if a.operation == "sin" else (along, across)
    side = _time_relation("sign", second)
    if side is None:
        return None
    angle = a.graph.node("atan2", (first, multiply(side, second)))  # far from where this jumps
    return angle if operation == "asin" else subtract(a.graph.constant(0.5 * math.pi), angle)


def _in_pieces(a: Expression, function: Callable[[Expression], Expression]) -> Expression | None:
    """Return a function of what is constant in a piece of time, such as the root of ``max(t, 0)``, piece by piece.

    So its derivatives are zero there, and not a root's at zero.
    """
    if a.operation != "select" or a.graph.relations is None:
        return None
    condition, first, second = a.arguments
    if not (first.is_constant or second.is_constant) or not a.graph.relations.has(condition):
        return None
    return select(condition, function(first), function(second))


def _time_relation(kind: str, a: Expression, b: Expression | None = None) -> Expression | None:
    """Return what stands for a relation of functions of time alone; None for any other, and where none are sought."""
    relations = a.graph.relations
    if relations is None or not relations.are_timed(a, b):
        return None
    return relations.take(kind, a if b is None else subtract(a, b))


def less(a: Expression, b: Expression) -> Expression:
    """Return the condition ``a < b``."""
    return a.graph.zero if a is b else _plain_binary("less", a, b)


def less_equal(a: Expression, b: Expression) -> Expression:
    """Return the condition ``a <= b``."""
    return _plain_binary("less_equal", a, b)


def _plain_binary(operation: str, a: Expression, b: Expression) -> Expression:
    if a.operation == "constant" and b.operation == "constant":
        return a.graph.constant(BINARY[operation](a.payload, b.payload))
    relation = _time_relation(operation, a, b)
    return a.graph.node(operation, (a, b)) if relation is None else relation


def logical(operation: str, a: Expression, b: Expression) -> Expression:
    """Return the condition ``a and b`` or ``a or b``."""
    if a is b and _is_condition(a):
        return a
    if b.operation == "constant":
        a, b = b, a
    if a.operation == "constant" and (b.operation == "constant" or _is_condition(b)):
        if operation == "logical_and":
            return b if a.payload != 0.0 else a.graph.zero
        return b if a.payload == 0.0 else a.graph.one
    return a.graph.node(operation, (a, b))


def select(condition: Expression, a: Expression, b: Expression) -> Expression:
    """Return ``a`` where the condition is not zero, else ``b``."""
    if condition.operation == "constant":
        return a if condition.payload != 0.0 else b
    if a is b:
        return a
    if condition.operation == "logical_not":
        return select(condition.arguments[0], b, a)
    if not _is_condition(condition):
        relation = _time_relation("nonzero", condition)
        condition = condition if relation is None else relation
    return condition.graph.node("select", (condition, a, b))


def solve(entries: Sequence[Expression], right: Sequence[Expression]) -> list[Expression]:
    """Return the unknowns of a linear system given row by row."""
    size = len(right)
    if all(value.is_zero for value in right):
        return list(right)
    if size == 1:
        return [divide(right[0], entries[0])]
    graph = right[0].graph
    if all(value.operation == "constant" for value in (*entries, *right)):
        numbers = solve_or_nan(size, [e.payload for e in entries], [r.payload for r in right])
        if any(number != number for number in numbers):
            raise AtwoodError("a linear system with a constant singular matrix has no solution")
        return [graph.constant(number) for number in numbers]
    node = graph.node("solve", (*entries, *right), size)
    return [component(node, i) for i in range(size)]


def component(node: Expression, position: int) -> Expression:
    """Return one unknown of a linear solve."""
    return node.graph.node("component", (node,), position)


def external(function: Any, arguments: Sequence[Expression]) -> Expression:
    """Return the call of an external function."""
    graph = arguments[0].graph
    if all(argument.operation == "constant" for argument in arguments):
        return graph.constant(function.function(*(argument.payload for argument in arguments)))
    return graph.node("external", tuple(arguments), function)


_BINARY_BUILDERS: dict[str, Callable[[Expression, Expression], Expression]] = {
    "add": add,
    "sub": subtract,
    "mul": multiply,
    "div": divide,
    "pow": power,
    "less": less,
    "less_equal": less_equal,
    "logical_and": lambda a, b: logical("logical_and", a, b),
    "logical_or": lambda a, b: logical("logical_or", a, b),
}


def build(graph: Graph, operation: str, arguments: Sequence[Expression], payload: Any = None) -> Expression:
    """Return the node of any operation, with its simplifications; the way to rebuild a graph.

    A ``solve`` node is returned as it stands; simplify it through :func:`solve`.
    """
    if operation in UNARY:
        return unary(operation, arguments[0])
    if operation in BINARY:
        return binary(operation, arguments[0], arguments[1])
    if operation == "select":
        return select(arguments[0], arguments[1], arguments[2])
    if operation == "external":
        return external(payload, arguments)
    return graph.node(operation, tuple(arguments), payload)
