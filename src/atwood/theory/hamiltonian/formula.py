"""The Hamiltonian of a scene as a formula, with a letter for each momentum."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import permutations

from atwood.expr import Expression, jacobian, substitute
from atwood.forms.lagrangian import Lagrangian
from atwood.late import replace
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.formulas.notation import Notation
from atwood.theory.formulas.order import in_brackets, in_order
from atwood.theory.formulas.tree import Sum, Symbol, Term, cost, product
from atwood.theory.hamiltonian.legendre import LegendreTransform

__all__ = ["hamiltonian_formula", "momentum_symbol", "with_momenta"]

_LARGEST_BLOCK = 3
"""Mass matrices are inverted in symbols block by block, where no block has more rows."""


def momentum_symbol(found: Lagrangian, number: int) -> Expression:
    """Return the symbol of the momentum of a coordinate, by its number."""
    return found.graph.symbol(f"p:{found.names[number].name}")


def with_momenta(notation: Notation, found: Lagrangian) -> Notation:
    """Return a notation that has a letter p for the momentum of each coordinate."""
    symbols, added = dict(notation.symbols), []
    for number, (q, name) in enumerate(zip(found.coordinates, found.names, strict=True)):
        own = symbols[q]
        meaning = f"Momentum of {name.name}."
        unit = "kg*m^2/s" if own.unit == "rad" else f"kg*m^2/(s*{own.unit})" if own.unit != "m" else "kg*m/s"
        below = (own.letter, *own.subscripts)
        made = Symbol("p", below, f"p:{name.name}", unit, meaning, None, "momentum", own.order)
        symbols[momentum_symbol(found, number)] = made
        added.append(made)
    moving = [one for one in notation.legend if one.kind == "coordinate"]
    others = [one for one in notation.legend if one.kind != "coordinate"]
    return replace(notation, symbols=symbols, legend=(*moving, *added, *others))


def hamiltonian_formula(formulas: EquationFormulas, transform: LegendreTransform) -> Sum | None:
    """Return ``H = (p - a) M^-1 (p - a)/2 - L0`` as a formula; None where a block of M is too large.

    Each block of the mass matrix is taken apart as ``L D L^T``, in the order in which that is shortest: so each term
    is the square of a momentum, less what other momenta contribute to it, over twice an inertia.
    """
    found = transform.lagrangian
    still = dict.fromkeys(found.velocities, 0.0)
    momenta = transform.momentum_expressions
    at_rest = substitute(list(momenta), still)
    mass = jacobian(list(momenta), list(transform.velocity_symbols))
    entries = {(i, j): one for i, j, one in zip(mass.rows, mass.columns, mass.entries, strict=True) if not one.is_zero}
    free = [momentum_symbol(found, i) - at_rest[i] for i in range(transform.size)]
    terms: list[Term] = []
    for block in _blocks(transform.size, entries):
        if len(block) > _LARGEST_BLOCK:
            return None
        ways = (_squares(formulas, order, entries, free) for order in permutations(reversed(block)))
        terms += min(ways, key=lambda one: cost(Sum(tuple(one))))
    rest = formulas.formula(-substitute([found.lagrangian], still)[0], energy=True)
    return Sum((*terms, *rest.terms))


def _blocks(size: int, entries: Mapping[tuple[int, int], Expression]) -> Iterator[list[int]]:
    """Yield the rows that belong together since entries join them."""
    left = set(range(size))
    while left:
        block, new = set[int](), {min(left)}
        while new:
            block |= new
            new = {j for i, j in entries if i in new} - block
        left -= block
        yield sorted(block)


def _squares(
    formulas: EquationFormulas,
    order: Sequence[int],
    entries: Mapping[tuple[int, int], Expression],
    free: Sequence[Expression],
) -> list[Term]:
    """Return the terms of a block, with its momenta eliminated in an order."""
    graph = free[0].graph
    matrix = {(i, j): entries.get((i, j), graph.zero) for i in order for j in order}
    momenta = {i: free[i] for i in order}
    terms = []
    for k, one in enumerate(order):
        pivot = matrix[one, one]
        above, below = formulas.formula(momenta[one]), formulas.formula(pivot, energy=True)
        squared = above if len(above.terms) == 1 else in_brackets(above.terms)
        terms.append(in_order(product(Fraction(1, 2), [(squared, Fraction(2)), (below, Fraction(-1))])))
        for i in order[k + 1 :]:
            share = matrix[i, one] / pivot
            momenta[i] = momenta[i] - share * momenta[one]
            for j in order[k + 1 :]:
                matrix[i, j] = matrix[i, j] - share * matrix[one, j]
    return terms[::-1]
