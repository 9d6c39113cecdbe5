"""Bounds of expressions as expressions: what compiled code knows of a value while its arguments move within bounds.

It is interval arithmetic (`atwood.expr.core.intervals`) written into the graph, so that it becomes a program. Rounding
is not directed: bounds are compared with numbers of the order of one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from atwood.expr.core.functions import (
    Scalar,
    absolute,
    acos,
    asin,
    atan,
    cos,
    exp,
    floor,
    log,
    maximum,
    minimum,
    select,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)
from atwood.expr.core.graph import Expression

Pair = tuple[Scalar, Scalar]
"""Lower and upper bound."""

_LARGE = 1e150
"""Stands for what has no bound; the product of two is still a number."""

_PI = 3.141592653589793


def enclose(outputs: Sequence[Expression], given: Callable[[Expression], Pair | None]) -> dict[int, Pair]:
    """Return bounds of expressions, and of what they are made of, by their numbers in the graph."""
    found: dict[int, Pair] = {}
    open_: dict[int, Expression] = {}
    stack = list(outputs)
    while stack:
        node = stack.pop()
        if node.index in found or node.index in open_:
            continue
        known = given(node)
        if known is not None:
            found[node.index] = known
        else:
            open_[node.index] = node
            stack.extend(node.arguments)
    for index in sorted(open_):
        found[index] = _of(open_[index], [found[one.index] for one in open_[index].arguments])
    return found


def _of(node: Expression, data: Sequence[Pair]) -> Pair:
    if node.operation == "mul" and node.arguments[0] is node.arguments[1]:
        least, most = magnitude(data[0])
        return least * least, most * most
    rule = _RULES.get(node.operation)
    return (-_LARGE, _LARGE) if rule is None else rule(*data)


def magnitude(a: Pair) -> Pair:
    """Return bounds of an absolute value."""
    low, high = a
    return maximum(maximum(low, -high), 0.0), maximum(high, -low)


def _product(a: Pair, b: Pair) -> Pair:
    if a[0] is a[1] or b[0] is b[1]:
        (c, _), (low, high) = (a, b) if a[0] is a[1] else (b, a)
        return minimum(c * low, c * high), maximum(c * low, c * high)
    one, two, three, four = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return minimum(minimum(one, two), minimum(three, four)), maximum(maximum(one, two), maximum(three, four))


def _quotient(a: Pair, b: Pair) -> Pair:
    low, high = b
    if low is high:
        return _product(a, (1.0 / low, 1.0 / low))
    passes = _at_most(low * high, 0.0)
    return _product(a, (select(passes, -_LARGE, 1.0 / high), select(passes, _LARGE, 1.0 / low)))


def _at_most(a: Scalar, b: Scalar) -> Scalar:
    return a <= b


def _wave(function: Callable[[Scalar], Scalar], slope: Callable[[Scalar], Scalar]) -> Callable[[Pair], Pair]:
    """Return bounds of a sine or cosine: neither it nor its slope changes faster than its argument."""

    def of(a: Pair) -> Pair:
        half = 0.5 * (a[1] - a[0])
        middle = function(a[0] + half)
        reach = half * minimum(absolute(slope(a[0] + half)) + 0.5 * half, 1.0)
        return maximum(middle - reach, -1.0), minimum(middle + reach, 1.0)

    return of


def _tangent(a: Pair) -> Pair:
    turns = [floor(one * (1.0 / _PI) + 0.5) for one in a]
    is_same = _at_most(turns[1] - turns[0], 0.5)
    return select(is_same, tan(a[0]), -_LARGE), select(is_same, tan(a[1]), _LARGE)


def _power(a: Pair, b: Pair) -> Pair:
    least, most = magnitude(a)
    ends = [exp(exponent * log(maximum(base, 1e-100))) for base in (least, most) for exponent in b]
    high = maximum(maximum(ends[0], ends[1]), maximum(ends[2], ends[3]))
    low = minimum(minimum(ends[0], ends[1]), minimum(ends[2], ends[3]))
    return select(_at_most(a[0], 0.0), -high, low), high


def _rising(function: Callable[[Scalar], Scalar]) -> Callable[[Pair], Pair]:
    return lambda a: (function(a[0]), function(a[1]))


def _hyperbolic_cosine(a: Pair) -> Pair:
    least, most = magnitude(a)
    return 0.5 * (exp(least) + exp(-least)), 0.5 * (exp(most) + exp(-most))


def _capped(function: Callable[[Scalar], Scalar], most: float) -> Callable[[Pair], Pair]:
    return lambda a: (function(maximum(minimum(a[0], most), -most)), function(maximum(minimum(a[1], most), -most)))


def _less(a: Pair, b: Pair) -> Pair:
    return _at_most(a[1], b[0]), _at_most(a[0], b[1])


def _choice(c: Pair, a: Pair, b: Pair) -> Pair:
    least, most = magnitude(c)
    low, high = minimum(a[0], b[0]), maximum(a[1], b[1])
    return select(least, a[0], select(most, low, b[0])), select(least, a[1], select(most, high, b[1]))


_RULES: Mapping[str, Callable[..., Pair]] = {
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "neg": lambda a: (-a[1], -a[0]),
    "mul": _product,
    "div": _quotient,
    "pow": _power,
    "sqrt": _rising(lambda x: sqrt(maximum(x, 0.0))),
    "exp": _capped(exp, 300.0),
    "sinh": _capped(sinh, 300.0),
    "cosh": lambda a: _hyperbolic_cosine(_capped(lambda x: x, 300.0)(a)),
    "tanh": _rising(tanh),
    "atan": _rising(atan),
    "log": _rising(lambda x: log(maximum(x, 1e-300))),
    "sin": _wave(sin, cos),
    "cos": _wave(cos, sin),
    "tan": _tangent,
    "asin": _capped(asin, 1.0),
    "acos": lambda a: _capped(acos, 1.0)(a)[::-1],
    "atan2": lambda a, b: (-_PI, _PI),
    "absolute": magnitude,
    "sign": _rising(sign),
    "floor": _rising(floor),
    "minimum": lambda a, b: (minimum(a[0], b[0]), minimum(a[1], b[1])),
    "maximum": lambda a, b: (maximum(a[0], b[0]), maximum(a[1], b[1])),
    "select": _choice,
    **dict.fromkeys(("less", "less_equal"), _less),
    "logical_not": lambda a: (1.0 - a[1], 1.0 - a[0]),
    "logical_and": lambda a, b: (a[0] * b[0], a[1] * b[1]),
    "logical_or": lambda a, b: (maximum(a[0], b[0]), maximum(a[1], b[1])),
}
