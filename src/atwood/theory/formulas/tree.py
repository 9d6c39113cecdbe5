"""A formula as sums of products of named things: what is written down, whichever way."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import TypeAlias

from atwood.late import dataclass, replace

__all__ = [
    "Call",
    "Factor",
    "Name",
    "Node",
    "Number",
    "Sum",
    "Symbol",
    "Term",
    "alone",
    "cost",
    "names_in",
    "product",
    "replaced",
]

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
        ``"coordinate"``, ``"momentum"``, ``"angular velocity"``, ``"parameter"``, ``"multiplier"``, ``"time"`` or
        ``"shared"``.
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
