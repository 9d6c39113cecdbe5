"""How nodes are made: local algebra applied while an expression is written down.

Each function returns the node of one operation after cheap simplifications that look one level down.  They
change a value by rounding at most.  A product with the constant 0 is the constant 0: a structural zero means
"not there", whatever the other factor would be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from atwood.errors import AtwoodError
from atwood.expr.core.arithmetic import add, divide, multiply, negate, plainer_opposite, subtract
from atwood.expr.core.operations import BINARY, UNARY, solve_or_nan

if TYPE_CHECKING:
    from atwood.expr.core.graph import Expression, Graph

__all__ = [
    "add",
    "binary",
    "build",
    "component",
    "divide",
    "external",
    "less",
    "less_equal",
    "logical",
    "multiply",
    "negate",
    "power",
    "select",
    "solve",
    "subtract",
    "unary",
]

_ODD = frozenset({"sin", "tan", "asin", "atan", "sinh", "tanh", "sign"})
_EVEN = frozenset({"cos", "cosh", "absolute"})
_NEVER_NEGATIVE = frozenset({"sqrt", "exp", "cosh", "absolute"})


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
        opposite = plainer_opposite(a)
        if opposite is not None:
            return negate(unary(operation, opposite))
    elif operation in _EVEN:
        opposite = plainer_opposite(a)
        if opposite is not None:
            return unary(operation, opposite)
        if operation == "absolute" and (a.operation in _NEVER_NEGATIVE or is_square(a)):
            return a
    elif operation == "sqrt" and is_square(a):
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


def is_square(a: Expression) -> bool:
    """Return whether a value is the product of one with itself."""
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
    builder = _BINARY_BUILDERS.get(operation)
    if builder is not None:
        return builder(arguments[0], arguments[1])
    if operation in UNARY:
        return unary(operation, arguments[0])
    if operation in BINARY:
        return binary(operation, arguments[0], arguments[1])
    if operation == "select":
        return select(arguments[0], arguments[1], arguments[2])
    if operation == "external":
        return external(payload, arguments)
    return graph.node(operation, tuple(arguments), payload)


def rebuild(graph: Graph, nodes: Iterable[Expression], made: dict[Expression, Expression]) -> None:
    """Make nodes, in an order in which arguments come first, anew in a graph, where they are not known yet."""
    for node in nodes:
        if node.is_constant:
            made[node] = graph.constant(node.value)
        elif node not in made:
            made[node] = build(graph, node.operation, [made[a] for a in node.arguments], node.payload)
