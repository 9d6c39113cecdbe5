"""A formula as sums of products of named things, with terms, factors and numbers as textbooks have them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import TypeAlias

from atwood.lazy_dataclasses import dataclass, replace

Number: TypeAlias = Fraction | float
"""An exact fraction, or a number that is none."""


@dataclass(frozen=True)
class Symbol:
    """What stands for a quantity.

    Attributes
    ----------
    letter
        A letter, the name of a Greek one, or a word.
    subscripts
        What stands below it.
    path, unit, meaning
        What it stands for, in which unit, in one line.
    value
        Of a parameter; None for what moves.
    kind
        ``"coordinate"``, ``"momentum"``, ``"angular velocity"``, ``"parameter"``, ``"multiplier"``, ``"time"``,
        ``"constant"`` or ``"shared"``.
    order
        Where it stands among symbols of its kind.
    """

    letter: str
    subscripts: tuple[str, ...] = ()
    path: str = ""
    unit: str = "1"
    meaning: str = ""
    value: float | None = None
    kind: str = "parameter"
    order: int = 0

    @property
    def name(self) -> str:
        """The symbol in one word, such as ``theta_1``, as sympy reads it."""
        return "_".join((self.letter, *self.subscripts))

    @property
    def moves(self) -> bool:
        """Whether it is a function of time."""
        return self.kind in ("coordinate", "momentum", "angular velocity", "multiplier")


@dataclass(frozen=True)
class Name:
    """A symbol, or its first or second derivative by time."""

    symbol: Symbol
    dots: int = 0


@dataclass(frozen=True)
class Call:
    """A function of some arguments: ``"sin"``, ``"atan2"``, ``"select"``, ``"less"``, or one of a user's own."""

    function: str
    arguments: tuple[Node, ...]


@dataclass(frozen=True)
class Sum:
    """A sum of terms; zero if there are none."""

    terms: tuple[Term, ...]


Node: TypeAlias = Name | Call | Sum
Factor: TypeAlias = tuple[Node, Fraction]


@dataclass(frozen=True)
class Term:
    """A number times powers.

    Attributes
    ----------
    number
        The number.
    factors
        What is multiplied, each with its exponent.
    owners
        Paths of the parts that it comes from, where that is known.
    """

    number: Number
    factors: tuple[Factor, ...] = ()
    owners: tuple[str, ...] = field(default=(), compare=False)

    def times(self, number: Number) -> Term:
        """Return it times a number."""
        return replace(self, number=self.number * number)


ONE = Fraction(1)


def alone(node: Node) -> Sum:
    """Return a node as a sum of one term."""
    return node if isinstance(node, Sum) else Sum((Term(ONE, ((node, ONE),)),))


def product(number: Number, factors: Iterable[Factor], owners: tuple[str, ...] = ()) -> Term:
    """Return a product in which powers of one thing are joined, and products within it are taken apart."""
    powers: dict[Node, Fraction] = {}
    stack = list(factors)[::-1]
    while stack:
        node, exponent = stack.pop()
        if isinstance(node, Sum) and len(node.terms) == 1:
            inner = node.terms[0]
            whole = exponent.denominator == 1
            if whole and (isinstance(inner.number, Fraction) or exponent > 0):
                number = number * inner.number ** int(exponent)
                stack += [(base, power * exponent) for base, power in inner.factors[::-1]]
                continue
        powers[node] = powers.get(node, Fraction(0)) + exponent
    return Term(number, tuple((node, power) for node, power in powers.items() if power), owners)


def fraction(above: Sum, below: Sum) -> Sum:
    """Return a quotient without the factors that all terms above and below share, and without quotients in them."""
    every = [dict(term.factors) for term in (*above.terms, *below.terms)]
    over = [
        (node, -min(one.get(node, ONE * 0) for one in every)) for node in dict.fromkeys(k for d in every for k in d)
    ]
    above, below = (
        Sum(tuple(in_order(product(term.number, [*term.factors, *over], term.owners)) for term in one.terms))
        for one in (above, below)
    )
    if len(below.terms) == 1:
        under = (below, -ONE)
        return Sum(tuple(in_order(product(term.number, [*term.factors, under])) for term in above.terms))
    return Sum((product(ONE, [(above, ONE), (below, -ONE)]),)) if above.terms else above


def cost(node: Node) -> int:
    """Return how much there is to read: symbols, functions, numbers and signs."""
    if isinstance(node, Name):
        return 1
    if isinstance(node, Call):
        multiple = any(isinstance(one, Sum) and any(abs(t.number) != 1 for t in one.terms) for one in node.arguments)
        return 1 + 2 * multiple + sum(map(cost, node.arguments))
    return sum(1 + (abs(term.number) != 1) + _cost_of_factors(term.factors) for term in node.terms)


def _cost_of_factors(factors: Sequence[Factor]) -> int:
    return sum(cost(node) + (exponent != 1) for node, exponent in factors)


def names_in(nodes: Iterable[Node]) -> Iterator[Name]:
    """Yield the names in some formulas, each once."""
    seen: set[Node] = set()
    stack = list(nodes)[::-1]
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        if isinstance(node, Name):
            yield node
        elif isinstance(node, Call):
            stack += node.arguments[::-1]
        else:
            stack += [inner for term in node.terms[::-1] for inner, _ in term.factors[::-1]]


def sums_within(formulas: Iterable[Node], *, in_calls: bool = True) -> Iterator[Sum]:
    """Yield all sums within products, outer ones first, and within functions."""
    for node in formulas:
        if isinstance(node, Call) and in_calls:
            yield from sums_within(node.arguments)
        elif isinstance(node, Sum):
            for term in node.terms:
                for inner, _ in term.factors:
                    if isinstance(inner, Sum):
                        yield inner
                    yield from sums_within([inner], in_calls=in_calls)


def replaced(node: Node, by: Mapping[Node, Node]) -> Node:
    """Return a formula with some of its parts replaced, from the outside inwards."""
    if node in by:
        return by[node]
    if isinstance(node, Name):
        return node
    if isinstance(node, Call):
        return Call(node.function, tuple(replaced(one, by) for one in node.arguments))
    terms = [replace(t, factors=tuple((replaced(base, by), power) for base, power in t.factors)) for t in node.terms]
    return Sum(tuple(terms))


def in_brackets(terms: Iterable[Term]) -> Sum:
    """Return a sum in order, that begins with a term that is added if there is one."""
    found = sorted(terms, key=place_of_term)
    first = next((i for i, term in enumerate(found) if term.number > 0), 0)
    return Sum((found[first], *found[:first], *found[first + 1 :]))


def in_order(term: Term) -> Term:
    """Return a term with its factors in the order of textbooks: masses, fields, lengths, motion, functions."""
    return replace(term, factors=tuple(sorted(term.factors, key=_place_of_factor)))


def _place_of_factor(factor: Factor) -> tuple[int, int, str]:
    node, _ = factor
    if isinstance(node, Name):
        symbol = node.symbol
        if symbol.kind == "constant":
            return (-1, 0, symbol.name)
        if symbol.kind == "time":
            return (3, 0, symbol.name)
        if symbol.moves:
            place = 4 if symbol.kind == "multiplier" else 5 + (node.dots > 0 or symbol.kind == "angular velocity")
            return (place, symbol.order, symbol.name)
        return (_rank_of_unit(symbol), symbol.order, symbol.name)
    if isinstance(node, Call):
        return (8, 0, node.function)
    names = list(names_in([node]))
    moving = any(name.symbol.moves for name in names)
    return (7 if moving else 0 if names else -2, 0, "")


def _rank_of_unit(symbol: Symbol) -> int:
    if "kg" in symbol.unit or symbol.unit.startswith("N"):
        return 0
    return 1 if symbol.unit == "m/s^2" else 2


def place_of_term(term: Term) -> tuple[int, int, tuple[int, ...], int]:
    """Return where a term stands in a sum: accelerations first, then velocities, then the rest, each in order."""
    dots, degree, calls = 0, 0, 0
    orders: list[int] = []
    for node, power in term.factors:
        if not isinstance(node, Name):
            dots = max([dots, *(name.dots for name in names_in([node]))])
            calls += 1
        elif node.dots or node.symbol.kind == "angular velocity":
            times = max(int(power), 1)
            dots, degree = max(dots, node.dots + (node.symbol.kind == "angular velocity")), degree + times
            orders += [node.symbol.order] * times
    if not orders:
        every = [name.symbol for name in names_in(node for node, _ in term.factors)]
        orders = [one.order for one in every if one.moves] or [1000 + one.order for one in every]
    return -dots, -degree, tuple(sorted(orders)), calls


_LARGEST_DENOMINATOR = 360
_NEAR = 1e-14
"""Relative: a few operations on fractions like 1/12 round by less."""


def as_fraction(value: float) -> Number:
    """Return a number as the small fraction that it is up to rounding, or as it is."""
    if not math.isfinite(value):
        return value
    fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
    near = abs(float(fraction) - value) <= _NEAR * abs(value)
    return fraction if near else value


def of_pi(value: float) -> Fraction | None:
    """Return a number as a fraction of pi, if it is one and no fraction itself."""
    turns = Fraction(value / math.pi).limit_denominator(180)
    if turns and abs(float(turns) * math.pi - value) <= _NEAR * abs(value):
        return turns
    return None


def as_decimal(value: float) -> Number:
    """Return a number without the digits that rounding made; a whole one as a fraction."""
    rounded = float(f"{value:.14g}")
    return Fraction(int(rounded)) if rounded.is_integer() and abs(rounded) < 1e9 else rounded
