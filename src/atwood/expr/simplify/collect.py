"""Equations in the form that an expert would write by hand, where that costs less.

Equations of motion come out of the recursion with products such as ``(l cos(a) u') cos(a) + (l sin(a) u') sin(a)``;
an expert writes ``l u'``.  The rows are expanded into polynomials, brought into several normal forms, written
back in several ways, and the cheapest outcome is kept: never one that costs more than the rows as they were.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence

from atwood.expr.core.analysis import count_operations
from atwood.expr.core.graph import Expression
from atwood.expr.simplify.emission import Emitter, Term, share_products, sum_terms, terms_of
from atwood.expr.simplify.polynomial import Effort, Expansion, Polynomial, TooLargeError, expand, volume
from atwood.expr.simplify.trigonometry import join_squares, products_of_waves, sum_of_waves

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
    return sum(_WEIGHTS.get(kind, _OTHER_WEIGHT) * count for kind, count in count_operations(rows, parameters).items())


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
    for row in range(len(best)):
        for version in dict.fromkeys(candidate[row] for candidate in found):
            trial = [*best[:row], version, *best[row + 1 :]]
            price = cost(trial, parameters)
            if price < lowest:
                best, lowest = trial, price
    return best


def _candidates(
    rows: Sequence[Expression],
    angles: Collection[Expression],
    parameters: Collection[Expression],
    limit: int,
    lowest: int,
    effort: Effort | None,
) -> Iterator[list[Expression]]:
    """Yield the rows written in other ways."""
    try:
        expansion = expand(rows, angles, parameters, limit, Effort(_BUDGET, effort))
    except TooLargeError:
        try:
            expansion = expand(rows, angles, parameters, limit, Effort(_BUDGET, effort), _LONGEST)
        except TooLargeError:
            return
    if sum(map(len, expansion.rows)) > 2 * lowest:
        return
    for normal_form in _normal_forms(expansion, limit):
        terms = sum(len(polynomial) for polynomial in normal_form)
        if terms > 10 * limit or terms - len(rows) >= lowest:
            continue
        try:
            expansion.spend(_WRITTEN * sum(map(volume, normal_form)))
        except TooLargeError:
            return
        graph = rows[0].graph
        for single_angles in (False, True):
            emitter = Emitter(graph, expansion, single_angles)
            split = [terms_of(emitter, polynomial) for polynomial in normal_form]
            yield from _written(emitter, split)


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
