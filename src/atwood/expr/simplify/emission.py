"""From polynomials back to expressions with few operations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import field
from heapq import heappop, heappush
from typing import TypeAlias

from atwood.expr.core import algebra
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.simplify.polynomial import Atom, Coefficient, Expansion, Polynomial, Wave
from atwood.late import dataclass

Factor: TypeAlias = tuple[int, int]
"""The rank of a factor (coefficients, waves, values, products, inverses) and its number."""

_COEFFICIENT, _WAVE, _VALUE, _PRODUCT, _INVERSE = range(5)


@dataclass(frozen=True)
class Term:
    """A product with a sign.

    Attributes
    ----------
    sign
        1 or -1.
    factors
        What is multiplied, sorted, repeated for powers.
    """

    sign: int
    factors: tuple[Factor, ...]


@dataclass
class Emitter:
    """The factors of all terms, and the expressions that they stand for.

    Attributes
    ----------
    graph
        Where expressions are made.
    expansion
        The atoms of the polynomials.
    single_angles
        Whether sines and cosines of combinations are made from those of single angles, by the addition theorems.
    """

    graph: Graph
    expansion: Expansion
    single_angles: bool
    meanings: dict[Factor, Expression] = field(default_factory=dict)

    def factor(self, rank: int, expression: Expression) -> Factor:
        """Return the factor of an expression."""
        found = (rank, expression.index)
        self.meanings[found] = expression
        return found


def terms_of(emitter: Emitter, polynomial: Polynomial) -> list[Term]:
    """Return the terms of a polynomial, with one expression for each coefficient and as few minus signs as may be."""
    terms: list[Term] = []
    for monomial in sorted(polynomial):
        sign, coefficient = _coefficient(emitter, polynomial[monomial])
        factors = [] if coefficient is emitter.graph.one else [emitter.factor(_COEFFICIENT, coefficient)]
        for number, exponent in monomial:
            factors += [_atom_factor(emitter, emitter.expansion.atoms[number])] * exponent
        terms.append(Term(sign, tuple(sorted(factors))))
    if terms and all(term.sign < 0 for term in terms):
        for position, term in enumerate(terms):
            if term.factors and term.factors[0][0] == _COEFFICIENT:
                opposite = algebra.negate(emitter.meanings[term.factors[0]])
                factors = [emitter.factor(_COEFFICIENT, opposite), *term.factors[1:]]
                terms[position] = Term(1, tuple(sorted(factors)))
                break
    return terms


def _coefficient(emitter: Emitter, coefficient: Coefficient) -> tuple[int, Expression]:
    """Return a coefficient as a sign and an expression of parameters."""
    graph = emitter.graph
    negative = sum(value < 0.0 for value in coefficient.values())
    leading = coefficient[min(coefficient)]
    flip = negative * 2 > len(coefficient) or (negative * 2 == len(coefficient) and leading < 0.0)
    total = graph.zero
    for monomial in sorted(coefficient):
        value = -coefficient[monomial] if flip else coefficient[monomial]
        above, below = graph.one, graph.one
        for number, exponent in monomial:
            power = algebra.power(emitter.expansion.constants[number], graph.constant(abs(exponent)))
            if exponent > 0:
                above = algebra.multiply(above, power)
            else:
                below = algebra.multiply(below, power)
        total = algebra.add(total, algebra.multiply(graph.constant(value), algebra.divide(above, below)))
    return (-1 if flip else 1), total


def _atom_factor(emitter: Emitter, atom: Atom) -> Factor:
    """Return the factor of an atom."""
    argument = atom.argument
    if isinstance(argument, Expression):
        if atom.kind in ("sin", "cos"):
            return emitter.factor(_WAVE, algebra.unary(atom.kind, argument))
        return emitter.factor(_INVERSE if atom.kind == "inverse" else _VALUE, argument)
    if emitter.single_angles:
        parts = _from_single_angles(emitter, argument)
        return emitter.factor(_WAVE, parts[0 if atom.kind == "cos" else 1])
    combination = emitter.graph.zero
    for angle, count in zip(emitter.expansion.angles, argument, strict=True):
        combination = algebra.add(combination, algebra.multiply(emitter.graph.constant(count), angle))
    return emitter.factor(_WAVE, algebra.unary(atom.kind, combination))


def _from_single_angles(emitter: Emitter, wave: Wave) -> tuple[Expression, Expression]:
    """Return the cosine and sine of a combination of angles from those of single angles."""
    cosine, sine = emitter.graph.one, emitter.graph.zero
    for angle, count in zip(emitter.expansion.angles, wave, strict=True):
        c, s = algebra.unary("cos", angle), algebra.unary("sin", angle)
        if count < 0:
            s = algebra.negate(s)
        for _ in range(abs(count)):
            cosine, sine = (
                algebra.subtract(algebra.multiply(cosine, c), algebra.multiply(sine, s)),
                algebra.add(algebra.multiply(sine, c), algebra.multiply(cosine, s)),
            )
    return cosine, sine


def share_products(emitter: Emitter, rows: Sequence[Sequence[Term]]) -> list[list[Term]]:
    """Return the terms with products of two factors that occur more than once made into factors.

    The pair that occurs most often goes first, coefficients before values among equals.
    """
    terms = [list(term.factors) for row in rows for term in row]
    where: dict[tuple[Factor, Factor], set[int]] = {}

    queue: list[tuple[int, tuple[Factor, Factor]]] = []

    def record(position: int, present: bool) -> None:
        for pair in _pairs(terms[position]):
            if present:
                where.setdefault(pair, set()).add(position)
            else:
                where[pair].discard(position)
            if len(where[pair]) > 1:
                heappush(queue, (-len(where[pair]), pair))

    for position in range(len(terms)):
        record(position, True)
    while queue:
        count, best = heappop(queue)
        if len(where[best]) != -count:
            continue  # an entry from before the count changed
        product = emitter.factor(_PRODUCT, _product(emitter, best))
        for position in sorted(where[best]):
            record(position, False)
            for factor in best:
                terms[position].remove(factor)
            terms[position].append(product)
            terms[position].sort()
            record(position, True)
    remaining = iter(terms)
    return [[Term(term.sign, tuple(next(remaining))) for term in row] for row in rows]


def _pairs(factors: Sequence[Factor]) -> set[tuple[Factor, Factor]]:
    """Return the pairs of factors of a term, without those of two inverses."""
    return {(a, b) for i, a in enumerate(factors) for b in factors[i + 1 :] if not a[0] == b[0] == _INVERSE}


def _product(emitter: Emitter, factors: Sequence[Factor]) -> Expression:
    """Return a product: coefficients and waves first, values together, divisions last."""
    graph = emitter.graph
    head, values = graph.one, graph.one
    for factor in factors:
        if factor[0] in (_COEFFICIENT, _WAVE, _PRODUCT):
            head = algebra.multiply(head, emitter.meanings[factor])
        elif factor[0] == _VALUE:
            values = algebra.multiply(values, emitter.meanings[factor])
    result = algebra.multiply(head, values)
    for factor in factors:
        if factor[0] == _INVERSE:
            result = algebra.divide(result, emitter.meanings[factor])
    return result


def sum_terms(emitter: Emitter, terms: Sequence[Term], nested: bool) -> Expression:
    """Return the sum of terms.

    Parameters
    ----------
    emitter
        What the factors mean.
    terms
        The terms.
    nested
        Whether the factor that most terms share is taken out, again and again (Horner's scheme).
    """
    if not terms:
        return emitter.graph.zero
    sign, total = _nested(emitter, terms) if nested else _plain(emitter, terms)
    return total if sign > 0 else algebra.negate(total)


def _plain(emitter: Emitter, terms: Sequence[Term]) -> tuple[int, Expression]:
    return _signed_sum([(term.sign, _product(emitter, term.factors)) for term in terms])


def _nested(emitter: Emitter, terms: Sequence[Term]) -> tuple[int, Expression]:
    """Return a sum by Horner's scheme, up to its sign."""
    counts = Counter(factor for term in terms for factor in set(term.factors))
    best = min(counts, key=lambda factor: (-counts[factor], -factor[0], factor), default=None)
    if best is None or counts[best] < 2:
        return _plain(emitter, terms)
    inner: list[Term] = []
    rest: list[Term] = []
    for term in terms:
        if best in term.factors:
            factors = list(term.factors)
            factors.remove(best)
            inner.append(Term(term.sign, tuple(factors)))
        else:
            rest.append(term)
    sign, value = _nested(emitter, inner)
    taken = emitter.meanings[best]
    product = algebra.divide(value, taken) if best[0] == _INVERSE else algebra.multiply(value, taken)
    if not rest:
        return sign, product
    return _signed_sum([(sign, product), _nested(emitter, rest)])


def _signed_sum(parts: Sequence[tuple[int, Expression]]) -> tuple[int, Expression]:
    """Return a sum of signed values, up to its sign, without a negation."""
    overall = 1 if any(sign > 0 for sign, _ in parts) else -1
    start = next(position for position, (sign, _) in enumerate(parts) if sign == overall)
    total = parts[start][1]
    for position, (sign, value) in enumerate(parts):
        if position != start:
            total = algebra.add(total, value) if sign == overall else algebra.subtract(total, value)
    return overall, total
