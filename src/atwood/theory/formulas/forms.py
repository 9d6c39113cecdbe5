"""Polynomials in sines and cosines in the forms of which a reader is shown the shortest."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from math import gcd, lcm

from atwood.expr import Expression, live
from atwood.expr.simplify.polynomial import (
    Coefficient,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    add_coefficient,
    multiply_monomials,
)
from atwood.expr.simplify.trigonometry import (
    join_squares,
    products_of_waves,
    squares_of_waves,
    sum_of_waves,
    without_squares,
)
from atwood.lazy_dataclasses import dataclass
from atwood.theory.formulas.tree import Number

LIMIT = 300
"""The largest number of terms of a formula."""


@dataclass
class Owners:
    """Says from which parts a term comes: those whose own terms, as sums of waves, it meets."""

    expansion: Expansion
    shares: Mapping[str, Polynomial]
    _keys: dict[str, set[tuple[Monomial, Monomial]]] | None = None

    def of(self, monomial: Monomial, coefficient: Coefficient) -> tuple[str, ...]:
        """Return the parts."""
        if not self.shares:
            return ()
        if self._keys is None:
            both = {path: (one, join_squares(self.expansion, one)) for path, one in self.shares.items()}
            self._keys = {path: self._waves(one) | self._waves(joined) for path, (one, joined) in both.items()}
        mine = self._waves({monomial: coefficient})
        return tuple(path for path, keys in self._keys.items() if not mine.isdisjoint(keys))

    def _waves(self, polynomial: Polynomial) -> set[tuple[Monomial, Monomial]]:
        found = _waves_of(self.expansion, polynomial) or polynomial
        return {(monomial, inner) for monomial, coefficient in found.items() for inner in coefficient}


def forms_of(expansion: Expansion, row: Polynomial) -> Iterator[Polynomial]:
    """Yield a polynomial in the forms of which the shortest is taken."""
    joined = join_squares(expansion, row)
    waves = _waves_of(expansion, row) or _waves_of(expansion, joined)
    squares = squares_of_waves(expansion, waves) if waves else {}
    forms: list[Callable[[], Polynomial]] = [
        lambda: row,
        lambda: joined,
        lambda: waves or row,
        lambda: products_of_waves(expansion, waves) if waves else row,
        lambda: without_squares(expansion, row, "sin", LIMIT),
        lambda: without_squares(expansion, row, "cos", LIMIT),
        lambda: squares or row,
        lambda: without_squares(expansion, squares, "sin", LIMIT) if squares else row,
        lambda: without_squares(expansion, squares, "cos", LIMIT) if squares else row,
    ]
    seen: list[Polynomial] = []
    for form in forms:
        with suppress(TooLargeError):
            made = form()
            if made not in seen:
                seen.append(made)
                yield made


def _waves_of(expansion: Expansion, row: Polynomial) -> Polynomial:
    """Return a polynomial as a sum of waves; nothing where that is too long."""
    with suppress(TooLargeError):
        return sum_of_waves(expansion, row, LIMIT)
    return {}


def length_of(expansion: Expansion, polynomial: Polynomial) -> int:
    """Return about how much there is to read in a polynomial; sines and cosines of multiples count more."""
    total = 0
    for monomial, coefficient in polynomial.items():
        total += 1 + sum(1 + len(inner) for inner in coefficient)
        for number, exponent in monomial:
            argument = expansion.atoms[number].argument
            waves = sum(2 + 3 * (abs(count) > 1) for count in argument if count) if isinstance(argument, tuple) else 0
            total += 1 + waves + (exponent != 1)
    return total


def with_unit_quaternion(row: Polynomial, quaternion: Sequence[int], norms: Collection[int]) -> Polynomial:
    """Return a polynomial with ``w^2 = 1 - x^2 - y^2 - z^2`` and norms of one."""
    w, *others = quaternion
    result: Polynomial = {}
    stack = [(monomial, coefficient) for monomial, coefficient in row.items()]
    while stack:
        monomial, coefficient = stack.pop()
        plain = tuple((atom, power) for atom, power in monomial if atom not in norms)
        if dict(plain).get(w, 0) < 2:
            add_coefficient(result, plain, coefficient)
            continue
        rest = multiply_monomials(plain, ((w, -2),))
        stack.append((rest, coefficient))
        opposite = {inner: -value for inner, value in coefficient.items()}
        stack += [(multiply_monomials(rest, ((other, 2),)), opposite) for other in others]
    return result


def squares_in(total: Expression) -> Iterator[tuple[Expression, Expression, Expression | None]]:
    """Yield the squares of sums in an expression: the product, what is squared, and a factor that stands before it."""
    for node in live([total]):
        if node.operation == "mul" and not node.is_parametric:
            a, b = node.arguments
            if a is b and a.operation in ("add", "sub"):
                yield node, a, None
            for base, more in ((a, b), (b, a)):
                if base.operation in ("add", "sub") and more.operation == "mul" and base in more.arguments:
                    p, q = more.arguments
                    yield node, base, q if p is base else p


def shape_of(coefficient: Coefficient) -> tuple[tuple[tuple[Monomial, float], ...], float]:
    """Return a coefficient up to a factor, and the factor."""
    terms = sorted(coefficient.items())
    lead = terms[0][1]
    return tuple((monomial, float(f"{value / lead:.12g}")) for monomial, value in terms), lead


def nearer(a: int, b: int) -> int:
    """Return the power that two powers share: the one nearer to zero, if they have one sign."""
    if a * b <= 0:
        return 0
    return min(a, b) if a > 0 else max(a, b)


def content_of(numbers: Sequence[Number]) -> Number:
    """Return the greatest number that divides all, with the sign of most."""
    sign = -1 if 2 * sum(number < 0 for number in numbers) > len(numbers) else 1
    fractions = [number for number in numbers if isinstance(number, Fraction)]
    if len(fractions) < len(numbers):
        return Fraction(sign)
    above, below = 0, 1
    for number in fractions:
        above, below = gcd(above, number.numerator), lcm(below, number.denominator)
    return Fraction(sign * above, below)
