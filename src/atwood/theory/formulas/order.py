"""The order of terms and of factors, as textbooks have them."""

from __future__ import annotations

from collections.abc import Iterable

from atwood.late import replace
from atwood.theory.formulas.tree import Call, Factor, Name, Sum, Symbol, Term, names_in

__all__ = ["in_brackets", "in_order", "place_of_term"]


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
        if symbol.kind == "time":
            return (3, 0, symbol.name)
        if symbol.moves:
            place = 4 if symbol.kind == "multiplier" else 5 + (node.dots > 0 or symbol.kind == "angular velocity")
            return (place, symbol.order, symbol.name)
        return (_rank_of_unit(symbol), symbol.order, symbol.name)
    if isinstance(node, Call):
        return (8, 0, node.function)
    moving = any(name.symbol.moves for name in names_in([node]))
    return (7 if moving else 0, 0, "")


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
