"""The Taylor coefficients of one order of all values of a program, in terms of those of lower orders.

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

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias

from atwood.errors import UnsupportedError
from atwood.expr.core import algebra
from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression, Graph
from atwood.lazy_dataclasses import dataclass


@dataclass(eq=False)
class Convolution:
    """The sum of ``left_j right_(k-j)`` for j from 1 to k - 1.

    Attributes
    ----------
    total
        The symbol that stands for it.
    left, right
        The coefficients of the order at hand.
    """

    total: Expression
    left: Expression
    right: Expression


class Recurrence:
    """The coefficients of the order at hand of all values of a program.

    Parameters
    ----------
    name
        What the program is called in messages.
    target
        The graph in which they are written.
    time
        The symbol of time.
    given
        The coefficients of the inputs that change, time among them.
    fixed
        The inputs that do not.
    order, inverse
        The order k, and 1/k.

    Attributes
    ----------
    convolutions
        What lower orders give.
    """

    def __init__(
        self,
        name: str,
        target: Graph,
        time: Expression,
        given: Mapping[Expression, Expression],
        fixed: Iterable[Expression],
        order: Expression,
        inverse: Expression,
    ) -> None:
        self.name, self.target, self.order, self.inverse = name, target, order, inverse
        self.convolutions: list[Convolution] = []
        self._series: dict[int, Series] = {symbol.index: value for symbol, value in given.items()}
        self._series.update(dict.fromkeys((symbol.index for symbol in fixed), None))
        self._time = time
        self._values: dict[int, tuple[Expression, Expression]] = {}
        self._products: dict[tuple[int, int], Convolution] = {}
        self._inverses: dict[tuple[int, ...], list[list[Expression]]] = {}

    @property
    def values(self) -> list[tuple[Expression, Expression]]:
        """The values of order zero that are used, each with the symbol that stands for it."""
        return list(self._values.values())

    def series(self, outputs: Sequence[Expression]) -> list[Series]:
        """Return the coefficients of outputs."""
        for node in live(outputs):
            self.of(node)
        return [self.of(output) for output in outputs]

    def of(self, node: Expression) -> Series:
        """Return the coefficient of a value whose arguments' are known or few."""
        if node.index not in self._series:
            self._series[node.index] = self._derive(node)
        return self._series[node.index]

    def value(self, node: Expression) -> Expression:
        """Return what stands for the coefficient of order zero."""
        if node.is_constant:
            return self.target.constant(node.payload)
        found = self._values.get(node.index)
        if found is None:
            found = self._values[node.index] = node, self.target.parameter(f"v{node.index}")
        return found[1]

    # -- what rules are made of -----------------------------------------------------------------------------------

    def _derive(self, node: Expression) -> Series:
        operation = node.operation
        if operation == "constant":
            return None
        if operation in _PIECEWISE:
            return self._piecewise(node)
        if operation == "external":
            raise UnsupportedError(
                f"the function {node.payload.name} has no Taylor series here: the expressions do not look into it",
                where=self.name,
            )
        if all(self.of(argument) is None for argument in node.arguments):
            return None
        rule = RULES.get(operation)
        if rule is None:
            raise UnsupportedError(f"there is no Taylor series for the operation {operation}", where=self.name)
        return rule(self, node)

    def pair(self, left: Expression, right: Expression) -> Expression:
        """Return the convolution of two series; the same two in either order are one."""
        key = (min(left.index, right.index), max(left.index, right.index))
        if key not in self._products:
            self._products[key] = self.open(left, right)
        return self._products[key].total

    def open(self, left: Expression | None = None, right: Expression | None = None) -> Convolution:
        """Return a new convolution, whose series may be filled in later."""
        total = self.target.symbol(f"s{len(self.convolutions)}")
        made = Convolution(
            total, self.target.zero if left is None else left, self.target.zero if right is None else right
        )
        self.convolutions.append(made)
        return made

    def slope(self, node: Expression) -> Expression:
        """Return the coefficient d_k = k a_k of the derivative of a value that changes."""
        return self.order * self.moving(node)

    def moving(self, node: Expression) -> Expression:
        """Return the coefficient of a value that changes."""
        value = self.of(node)
        assert value is not None
        return value

    def or_zero(self, node: Expression) -> Expression:
        """Return the coefficient of any value."""
        value = self.of(node)
        return self.target.zero if value is None else value

    def keep(self, node: Expression, value: Expression) -> None:
        """Keep the coefficient of a value that was found together with another."""
        self._series[node.index] = value

    def strip(self, node: Expression) -> tuple[Expression, Expression]:
        """Return a value as a factor that does not change, in the target, and what does."""
        factor = self.target.one
        while True:
            if node.operation == "neg":
                factor, node = -factor, node.arguments[0]
            elif node.operation == "mul" and self.of(node.arguments[0]) is None:
                factor, node = factor * self.value(node.arguments[0]), node.arguments[1]
            elif node.operation == "mul" and self.of(node.arguments[1]) is None:
                factor, node = factor * self.value(node.arguments[1]), node.arguments[0]
            else:
                return factor, node

    def product(self, a: Expression, b: Expression) -> Expression:
        """Return the coefficient of the product of two values that both change."""
        (f, a), (g, b) = self.strip(a), self.strip(b)
        if a.operation == "div" and self.of(a.arguments[0]) is None:
            a, b, f, g = b, a, g, f
        if b.operation == "div" and self.of(b.arguments[0]) is None:  # a (p / b) is p (a / b)
            numerator, divisor = b.arguments
            quotient = algebra.divide(a, divisor)
            return f * g * self.value(numerator) * self.moving(quotient)
        p, q = self.moving(a), self.moving(b)
        if a is b:
            return f * g * (self.pair(p, p) + (2.0 * self.value(a)) * p)
        return f * g * (self.pair(p, q) + self.value(a) * q + self.value(b) * p)

    def against(self, argument: Expression, divisor: Expression) -> Expression:
        """Return y_k of ``y' w = a'``, with the coefficient a_k and the value w."""
        one = self.open(None, self.moving(divisor))
        value = (argument - self.inverse * one.total) * (1.0 / self.value(divisor))
        one.left = self.order * value
        return value

    # -- what switches --------------------------------------------------------------------------------------------

    def _piecewise(self, node: Expression) -> Series:
        """Return the coefficient of what is smooth between switches by the clock, at which every run stops."""
        operation, arguments = node.operation, node.arguments
        zero = self.target.zero
        if operation == "select":
            a, b = (self.or_zero(argument) for argument in arguments[1:])
            self._refuse_motion(node, arguments[:1])
            return None if a is b is zero else algebra.select(self.value(arguments[0]), a, b)
        self._refuse_motion(node, arguments)
        if operation in ("minimum", "maximum"):
            a, b = (self.or_zero(argument) for argument in arguments)
            low, high = arguments if operation == "minimum" else arguments[::-1]
            return None if a is b is zero else algebra.select(self.value(algebra.less_equal(low, high)), a, b)
        if operation == "absolute":
            moving = self.of(arguments[0])
            return None if moving is None else self.value(algebra.unary("sign", arguments[0])) * moving
        return None

    def _refuse_motion(self, node: Expression, conditions: Sequence[Expression]) -> None:
        """Refuse what switches with anything but the clock."""
        for symbol in (n for n in live(conditions) if n.is_symbol):
            if self._series.get(symbol.index) is not None and symbol is not self._time:
                path = symbol.name.split(":", 1)[-1]
                what = _WORDS.get(node.operation, "a condition")
                raise UnsupportedError(
                    f"{what} switches with the motion, and has no Taylor series there",
                    where=path,
                )

    def inverse_matrix(self, size: int, entries: tuple[Expression, ...]) -> list[list[Expression]]:
        """Return the inverse of the matrix of a linear system at order zero, row by row."""
        key = tuple(entry.index for entry in entries)
        if key not in self._inverses:
            graph = entries[0].graph
            columns = [
                algebra.solve(entries, [graph.one if i == j else graph.zero for i in range(size)]) for j in range(size)
            ]
            self._inverses[key] = [[self.value(columns[j][i]) for j in range(size)] for i in range(size)]
        return self._inverses[key]


_COMPARISONS = ("less", "less_equal", "logical_and", "logical_or", "logical_not")
_WORDS = {
    "select": "a law that is written with select",
    "minimum": "a smaller of two values",
    "maximum": "a larger of two values",
    "absolute": "an absolute value",
    "sign": "a sign",
    "floor": "a number that is rounded down",
}
_PIECEWISE = frozenset((*_WORDS, *_COMPARISONS))


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
