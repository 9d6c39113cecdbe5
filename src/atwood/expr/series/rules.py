"""The recurrences of Taylor coefficients, operation by operation.

Written a_k for the coefficient of order k of a value a, with sums over j from 1 to k - 1, and d_j = j a_j for its
derivative.  All follow from a differential equation for the operation by comparing coefficients (A. Griewank and
A. Walther, Evaluating Derivatives, 2nd edition, SIAM 2008, table 13.2):

- c = a b: c_k = a_0 b_k + a_k b_0 + sum a_j b_(k-j)
- c = a / b: c_k = (a_k - c_0 b_k - sum c_j b_(k-j)) / b_0, from a = c b
- c = sqrt(a): c_k = (a_k - sum c_j c_(k-j)) / (2 c_0), from a = c c
- y' = g a', such as y = sin(a) with g = cos(a): k y_k = d_k g_0 + sum d_j g_(k-j)
- y' w = a', such as y = log(a) with w = a: k y_k = (d_k - sum (j y_j) w_(k-j)) / w_0
- c = a^p: c' a = p c a': k c_k a_0 = p d_k c_0 + p sum d_j c_(k-j) - sum (j c_j) a_(k-j)
- A x = b: A_0 x_k = b_k - A_k x_0 - sum A_j x_(k-j)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from atwood.expr.core import algebra
from atwood.expr.core.graph import Expression

if TYPE_CHECKING:
    from atwood.expr.series.recurrence import Convolution, Recurrence

__all__ = ["RULES", "Series"]

Series: TypeAlias = Expression | None
"""The coefficient of the order at hand; None where it is zero at every order but the first."""


def _sum(one: Recurrence, node: Expression) -> Series:
    a, b = (one.of(argument) for argument in node.arguments)
    if b is None:
        return a
    if node.operation == "add":
        return b if a is None else a + b
    return -b if a is None else a - b


def _negative(one: Recurrence, node: Expression) -> Series:
    value = one.of(node.arguments[0])
    return None if value is None else -value


def _product(one: Recurrence, node: Expression) -> Series:
    a, b = node.arguments
    if one.of(a) is not None and one.of(b) is not None:
        return one.product(a, b)
    factor, rest = one.strip(node)
    return factor * one.moving(rest)


def _quotient(one: Recurrence, node: Expression) -> Series:
    a, b = node.arguments
    if one.of(b) is None:
        return one.moving(a) * (1.0 / one.value(b))
    moves = one.of(a) is not None
    f, a = one.strip(a) if moves else (one.value(a), a.graph.one)
    g, b = one.strip(b)
    plain = algebra.divide(a, b)
    if plain is not node:
        return (f / g) * one.moving(plain)
    divisor = one.moving(b)
    total = one.open(None, divisor)
    rest = one.value(node) * divisor + total.total
    total.left = (one.moving(a) - rest if moves else -rest) * (1.0 / one.value(b))
    return total.left


def _root(one: Recurrence, node: Expression) -> Series:
    total = one.open()
    total.left = total.right = (one.moving(node.arguments[0]) - total.total) * (0.5 / one.value(node))
    return total.left


def _wave(one: Recurrence, node: Expression) -> Series:
    """Sine and cosine, or their hyperbolic cousins, come together: each is the other's derivative."""
    argument = node.arguments[0]
    round_, other = ("sin", "cos") if node.operation in ("sin", "cos") else ("sinh", "cosh")
    sine, cosine = algebra.unary(round_, argument), algebra.unary(other, argument)
    a, slope = one.moving(argument), one.slope(argument)
    for_sine, for_cosine = one.open(slope), one.open(slope)
    s = a * one.value(cosine) + one.inverse * for_sine.total
    c = a * one.value(sine) + one.inverse * for_cosine.total
    for_sine.right, for_cosine.right = -c if round_ == "sin" else c, s
    one.keep(sine, s)
    one.keep(cosine, for_sine.right)
    return one.of(node)


def _exponential(one: Recurrence, node: Expression) -> Series:
    argument = node.arguments[0]
    total = one.open(one.slope(argument))
    total.right = one.moving(argument) * one.value(node) + one.inverse * total.total
    return total.right


def _logarithm(one: Recurrence, node: Expression) -> Series:
    a = node.arguments[0]
    return one.against(one.moving(a), a)


def _tangent(one: Recurrence, node: Expression) -> Series:
    """``t' = (1 + t t) a'``, and with a minus for the hyperbolic one."""
    argument = node.arguments[0]
    sign = 1.0 if node.operation == "tan" else -1.0
    total = one.open(one.slope(argument))
    t0 = one.value(node)
    t = one.moving(argument) * (1.0 + sign * (t0 * t0)) + one.inverse * total.total
    total.right = sign * (one.pair(t, t) + (2.0 * t0) * t)
    return t


def _arc(one: Recurrence, node: Expression) -> Series:
    """``y' w = a'`` with w = 1 + a a for the arctangent, and sqrt(1 - a a) for the arcsine."""
    a = node.arguments[0]
    square, unit = algebra.multiply(a, a), a.graph.one
    if node.operation == "atan":
        return one.against(one.moving(a), algebra.add(unit, square))
    divisor = algebra.unary("sqrt", algebra.subtract(unit, square))
    return one.against(one.moving(a) if node.operation == "asin" else -one.moving(a), divisor)


def _angle(one: Recurrence, node: Expression) -> Series:
    """``c' (x x + y y) = x y' - y x'``."""
    y, x = node.arguments
    radius = algebra.add(algebra.multiply(x, x), algebra.multiply(y, y))
    total = one.target.zero
    for sign, a, b in ((1.0, y, x), (-1.0, x, y)):
        if one.of(a) is None:
            continue
        term = one.moving(a) * one.value(b)
        if one.of(b) is not None:
            term = term + one.inverse * one.pair(one.slope(a), one.moving(b))
        total = total + sign * term
    return one.against(total, radius)


def _power(one: Recurrence, node: Expression) -> Series:
    base, exponent = node.arguments
    if one.of(exponent) is not None:
        return one.of(algebra.unary("exp", algebra.multiply(exponent, algebra.unary("log", base))))
    p, a = one.value(exponent), one.moving(base)
    up, down = one.open(one.slope(base)), one.open(None, a)
    value = (p * one.value(node)) * a + one.inverse * (p * up.total - down.total)
    up.right = value * (1.0 / one.value(base))
    down.left = one.order * up.right
    return up.right


def _system(one: Recurrence, node: Expression) -> Series:
    """Solve for the unknowns of a linear system, whose coefficients are kept; they stand for the node itself."""
    size = node.payload
    entries, right = node.arguments[: size * size], node.arguments[size * size :]
    unknowns = [algebra.component(node, j) for j in range(size)]
    rests: list[Expression] = []
    opened: list[tuple[int, Convolution]] = []
    for i in range(size):
        rest = one.or_zero(right[i])
        for j, entry in enumerate(entries[i * size : (i + 1) * size]):
            moving = one.of(entry)
            if moving is not None:
                opened.append((j, one.open(moving)))
                rest = rest - (moving * one.value(unknowns[j]) + opened[-1][1].total)
        rests.append(rest)
    for j, row in enumerate(one.inverse_matrix(size, entries)):
        total = one.target.zero
        for factor, rest in zip(row, rests, strict=True):
            total = total + factor * rest
        one.keep(unknowns[j], total)
    for j, convolution in opened:
        convolution.right = one.moving(unknowns[j])
    return one.order


RULES: dict[str, Callable[[Recurrence, Expression], Series]] = {
    "add": _sum,
    "sub": _sum,
    "neg": _negative,
    "mul": _product,
    "div": _quotient,
    "sqrt": _root,
    **dict.fromkeys(("sin", "cos", "sinh", "cosh"), _wave),
    "exp": _exponential,
    "log": _logarithm,
    **dict.fromkeys(("tan", "tanh"), _tangent),
    **dict.fromkeys(("asin", "acos", "atan"), _arc),
    "atan2": _angle,
    "pow": _power,
    "solve": _system,
}
"""The rule of each operation of which an argument changes; those that switch are not among them."""
