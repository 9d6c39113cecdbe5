"""Equations in the form that an expert would write by hand, where that costs less.

Equations of motion come out of the recursion with products such as ``(l cos(a) u') cos(a) + (l sin(a) u') sin(a)``;
an expert writes ``l u'``.  The rows are expanded into polynomials, brought into several normal forms, written
back in several ways, and the cheapest outcome is kept: never one that costs more than the rows as they were.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import field
from heapq import heapify, heappop, heappush
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.expr.core import algebra
from atwood.expr.core.analysis import count_nodes, live, varying
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.core.operations import UNCOUNTED
from atwood.expr.simplify.polynomial import (
    Atom,
    Coefficient,
    Effort,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    Wave,
    expand,
    volume,
)
from atwood.expr.simplify.trigonometry import join_squares, products_of_waves, sum_of_waves
from atwood.lazy_dataclasses import dataclass

_WEIGHTS = {"add": 1, "sub": 1, "mul": 1, "neg": 1, "div": 4, "sqrt": 6}
_OTHER_WEIGHT = 12
_MIXING_EFFORT = 200_000

_BUDGET = 100_000
"""So many operations on single terms are spent on rows: several times what it takes where it makes them shorter."""

_LONGEST = 1
"""Beyond the budget, what depends on parameters alone is taken whole where it has more terms."""

_WRITTEN = 8
"""So often each normal form is written."""


def cost(rows: Sequence[Expression], parameters: Collection[Expression]) -> int:
    """Return what one evaluation of the rows costs, in additions.

    Additions, subtractions, multiplications and negations count 1, divisions 4, square roots 6, everything else 12;
    what depends on parameters alone counts nothing.
    """
    return cost_of_nodes(live(rows), parameters)


def cost_of_nodes(nodes: Sequence[Expression], parameters: Collection[Expression]) -> int:
    """Return the same for all nodes that rows need, arguments before users."""
    return sum(_WEIGHTS.get(kind, _OTHER_WEIGHT) * count for kind, count in count_nodes(nodes, parameters).items())


def collect(
    rows: Sequence[Expression],
    angles: Collection[Expression],
    parameters: Collection[Expression],
    limit: int = 400,
    effort: Effort | None = None,
) -> list[Expression]:
    """Rewrite expressions with fewer operations, or return them as they are.

    Parameters
    ----------
    rows
        The expressions, to be evaluated together.
    angles
        The expressions, usually symbols, whose sines and cosines are to be combined: ``sin(a) sin(b) + cos(a) cos(b)``
        becomes ``cos(a - b)``.
    parameters
        Symbols that keep their value for a run; what depends on them alone costs nothing and goes into
        coefficients.
    limit
        The largest number of terms of a row to work with.
    effort
        What this and other calls may spend together.

    Returns
    -------
    list of Expression
        Expressions of the same values, up to rounding.  Divisions are by the same divisors as before, and nothing is
        singular that was not.
    """
    best = list(rows)
    lowest = cost(best, parameters)
    found: list[list[Expression]] = []
    for candidate in _candidates(rows, angles, parameters, limit, lowest, effort):
        found.append(candidate)
        price = cost(candidate, parameters)
        if price < lowest:
            best, lowest = candidate, price
    return _mix(best, lowest, [list(rows), *found], parameters)


def _mix(
    best: list[Expression], lowest: int, found: Sequence[Sequence[Expression]], parameters: Collection[Expression]
) -> list[Expression]:
    """Return the best candidate with single rows from others, where that is cheaper still."""
    if len(best) * len(found) * lowest > _MIXING_EFFORT:
        return best
    versions = [list(dict.fromkeys(candidate[row] for candidate in found)) for row in range(len(best))]
    different = list(dict.fromkeys(one for several in versions for one in several))
    place = {one: k for k, one in enumerate(different)}
    weights, has = _weights_of(different, parameters)
    for row, several in enumerate(versions):
        others = has[:, [place[one] for k, one in enumerate(best) if k != row]].any(axis=1)
        for version in several:
            price = int(weights @ (others | has[:, place[version]]))
            if price < lowest:
                best, lowest = [*best[:row], version, *best[row + 1 :]], price
    return best


def _weights_of(
    values: Sequence[Expression], parameters: Collection[Expression]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return what each operation behind values costs, and which values need it, shape (operations, values)."""
    nodes = live(values)
    needed = varying(nodes, parameters)
    users = dict.fromkeys((node.index for node in nodes), 0)  # a bit for each value
    for k, one in enumerate(values):
        users[one.index] |= 1 << k
    weights, found, size = [], [], len(values) // 8 + 1
    for node in reversed(nodes):
        own = users[node.index]
        for argument in node.arguments:
            users[argument.index] |= own
        if node in needed and node.operation not in UNCOUNTED:
            weights.append(_WEIGHTS.get(node.operation, _OTHER_WEIGHT))
            found.append(own.to_bytes(size, "little"))
    bits = np.frombuffer(b"".join(found), dtype=np.uint8).reshape(len(found), size)
    return np.array(weights, dtype=np.int64), np.unpackbits(bits, axis=1, bitorder="little").astype(bool)


def _candidates(
    rows: Sequence[Expression],
    angles: Collection[Expression],
    parameters: Collection[Expression],
    limit: int,
    lowest: int,
    effort: Effort | None,
) -> Iterator[list[Expression]]:
    """Yield the rows written in other ways."""
    spent = Effort(_BUDGET, effort)
    try:
        expansion = expand(rows, angles, parameters, limit, spent)
    except TooLargeError:
        if spent.left >= 0:
            return  # it has too many terms, of which coefficients that are taken whole leave no fewer
        try:
            expansion = expand(rows, angles, parameters, limit, Effort(_BUDGET, effort), _LONGEST)
        except TooLargeError:
            return
    if sum(map(len, expansion.rows)) > 2 * lowest:
        return
    written: dict[frozenset[tuple[Monomial, float]], tuple[int, Expression]] = {}
    for normal_form in _normal_forms(expansion, limit):
        terms = sum(len(polynomial) for polynomial in normal_form)
        if terms > 10 * limit or terms - len(rows) >= lowest:
            continue
        try:
            expansion.spend(_WRITTEN * sum(map(volume, normal_form)))
        except TooLargeError:
            return
        before, versions = None, list[list[Expression]]()
        for single_angles in (False, True):
            emitter = Emitter(rows[0].graph, expansion, single_angles, written)
            split = [terms_of(emitter, polynomial) for polynomial in normal_form]
            if split != before:
                before, versions = split, list(_written(emitter, split))
            yield from versions


def _written(emitter: Emitter, rows: Sequence[Sequence[Term]]) -> Iterator[list[Expression]]:
    """Yield the rows from their terms, with and without shared products and nesting."""
    for version in (rows, share_products(emitter, rows)):
        for nested in (False, True):
            yield [sum_terms(emitter, terms, nested) for terms in version]


def _normal_forms(expansion: Expansion, limit: int) -> Iterator[list[Polynomial]]:
    """Yield the polynomials in the normal forms that are different from those before."""
    forms: list[Callable[[Polynomial], Polynomial]] = [
        lambda row: row,
        lambda row: join_squares(expansion, row),
        lambda row: sum_of_waves(expansion, row, limit),
        lambda row: products_of_waves(expansion, sum_of_waves(expansion, row, limit)),
    ]
    seen: list[list[Polynomial]] = []
    for form in forms:
        try:
            expansion.spend(sum(map(volume, expansion.rows)))
            made = [form(row) for row in expansion.rows]
        except TooLargeError:
            continue
        if made not in seen:
            seen.append(made)
            yield made


Factor: TypeAlias = int
"""The rank of a factor (coefficients, waves, values, products, inverses), times `_RANK`, and its number."""

_RANK = 1 << 40
_COEFFICIENT, _WAVE, _VALUE, _PRODUCT, _INVERSE = range(5)


class Term(NamedTuple):
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
    written
        Coefficients that have been written: a sign, and an expression.
    meanings
        What each factor stands for.
    atoms
        The factor of each atom that has been met, by its number.
    """

    graph: Graph
    expansion: Expansion
    single_angles: bool
    written: dict[frozenset[tuple[Monomial, float]], tuple[int, Expression]] = field(default_factory=dict)
    meanings: dict[Factor, Expression] = field(default_factory=dict)
    atoms: dict[int, Factor] = field(default_factory=dict)

    def factor(self, rank: int, expression: Expression) -> Factor:
        """Return the factor of an expression."""
        found = rank * _RANK + expression.index
        self.meanings[found] = expression
        return found


def terms_of(emitter: Emitter, polynomial: Polynomial) -> list[Term]:
    """Return the terms of a polynomial, with one expression for each coefficient and as few minus signs as may be."""
    terms: list[Term] = []
    for monomial in sorted(polynomial):
        of_parameters = polynomial[monomial]
        key = frozenset(of_parameters.items())
        if key not in emitter.written:
            emitter.written[key] = _coefficient(emitter, of_parameters)
        sign, coefficient = emitter.written[key]
        factors = [] if coefficient is emitter.graph.one else [emitter.factor(_COEFFICIENT, coefficient)]
        for number, exponent in monomial:
            if number not in emitter.atoms:
                emitter.atoms[number] = _atom_factor(emitter, emitter.expansion.atoms[number])
            factors += [emitter.atoms[number]] * exponent
        terms.append(Term(sign, tuple(sorted(factors))))
    if terms and all(term.sign < 0 for term in terms):
        for position, term in enumerate(terms):
            if term.factors and term.factors[0] // _RANK == _COEFFICIENT:
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
    pairs = [_pairs(factors) for factors in terms]
    where: dict[tuple[Factor, Factor], set[int]] = {}
    for position, found in enumerate(pairs):
        for pair in found:
            where.setdefault(pair, set()).add(position)
    queue = [(-len(positions), pair) for pair, positions in where.items() if len(positions) > 1]
    heapify(queue)
    while queue:
        count, best = heappop(queue)
        positions = where[best]
        if len(positions) != -count:  # it was counted before others took their factors
            if len(positions) > 1:
                heappush(queue, (-len(positions), best))
            continue
        product = emitter.factor(_PRODUCT, _product(emitter, best))
        grown = {best}  # where its factors are squares it is still there
        for position in sorted(positions):
            factors = terms[position]
            for factor in best:
                factors.remove(factor)
            factors.append(product)
            factors.sort()
            before, pairs[position] = pairs[position], _pairs(factors)
            for pair in before - pairs[position]:
                where[pair].discard(position)
            for pair in pairs[position] - before:
                where.setdefault(pair, set()).add(position)
                grown.add(pair)
        for pair in grown:
            if len(where[pair]) > 1:
                heappush(queue, (-len(where[pair]), pair))
    remaining = iter(terms)
    return [[Term(term.sign, tuple(next(remaining))) for term in row] for row in rows]


def _pairs(factors: Sequence[Factor]) -> set[tuple[Factor, Factor]]:
    """Return the pairs of factors of a term, which are sorted, without those of two inverses."""
    found = set(combinations(factors, 2))
    if factors and factors[-1] // _RANK == _INVERSE:
        return {pair for pair in found if pair[0] // _RANK != _INVERSE}
    return found


def _product(emitter: Emitter, factors: Sequence[Factor]) -> Expression:
    """Return a product: coefficients and waves first, values together, divisions last."""
    graph = emitter.graph
    head, values = graph.one, graph.one
    for factor in factors:
        rank = factor // _RANK
        if rank in (_COEFFICIENT, _WAVE, _PRODUCT):
            head = algebra.multiply(head, emitter.meanings[factor])
        elif rank == _VALUE:
            values = algebra.multiply(values, emitter.meanings[factor])
    result = algebra.multiply(head, values)
    for factor in factors:
        if factor // _RANK == _INVERSE:
            result = algebra.divide(result, emitter.meanings[factor])
    return result


def sum_terms(emitter: Emitter, terms: Sequence[Term], nested: bool) -> Expression:
    """Return the sum of terms."""
    if not terms:
        return emitter.graph.zero
    sign, total = _nested(emitter, terms) if nested else _plain(emitter, terms)
    return total if sign > 0 else algebra.negate(total)


def _plain(emitter: Emitter, terms: Sequence[Term]) -> tuple[int, Expression]:
    return _signed_sum([(term.sign, _product(emitter, term.factors)) for term in terms])


def _nested(emitter: Emitter, terms: Sequence[Term]) -> tuple[int, Expression]:
    """Return a sum by Horner's scheme, up to its sign."""
    counts = Counter(factor for term in terms for factor in set(term.factors))
    best = min(counts, key=lambda factor: (-counts[factor], -(factor // _RANK), factor), default=None)
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
    product = algebra.divide(value, taken) if best // _RANK == _INVERSE else algebra.multiply(value, taken)
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
