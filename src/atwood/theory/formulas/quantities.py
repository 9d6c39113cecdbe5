"""Sub-expressions that have a name of their own in mechanics: distances of bodies, moments of inertia about a point."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from typing import TypeAlias

from atwood.theory.formulas.tree import ONE, Name, Node, Number, Sum, Symbol, Term, names_in, sums_within

_TIMES = 3
"""A moment of inertia has a name where it stands so often."""

Key: TypeAlias = tuple[tuple[Symbol, int], ...]
Plain: TypeAlias = dict[Key, Number]
"""A polynomial of symbols."""


def distances_in(formulas: Iterable[Node], legend: Iterable[Symbol]) -> dict[Sum, tuple[Name, Sum]]:
    """Return the squares of distances of two bodies: the distance, and its square as a sum of squares."""
    places: dict[str, dict[str, Symbol]] = {}
    for one in legend:
        body, _, axis = one.path.rpartition(".position.")
        if body and one.kind == "coordinate":
            places.setdefault(body, {})[axis] = one
    known: dict[frozenset[tuple[Key, Number]], tuple[Name, Sum]] = {}
    for a, b in combinations(places.values(), 2):
        ends = ["_".join(next(iter(one.values())).subscripts) for one in (a, b)]
        if a.keys() == b.keys() and all(ends) and ends[0] != ends[1]:
            gaps = [Sum((Term(ONE, ((Name(a[axis]), ONE),)), Term(-ONE, ((Name(b[axis]), ONE),)))) for axis in a]
            square = Sum(tuple(Term(ONE, ((gap, Fraction(2)),)) for gap in gaps))
            name = Name(Symbol("r", tuple(ends), kind="distance"))
            known[frozenset((_expanded(square) or {}).items())] = name, square
    found: dict[Sum, tuple[Name, Sum]] = {}
    for bracket in dict.fromkeys(sums_within(formulas)) if known else ():
        plain = _expanded(bracket)
        if plain is not None and (key := frozenset(plain.items())) in known:
            found[bracket] = known[key]
    return found


def moments_in(formulas: Sequence[Node]) -> dict[Sum, Name]:
    """Return sums ``I + m c^2`` of parameters that stand often, each with a letter J and the index of I."""
    counts = Counter(one for one in sums_within(formulas) if len(one.terms) > 1)
    found: dict[Sum, Name] = {}
    for one in sorted(counts, key=lambda node: len(node.terms)):
        moments = [term.factors[0][0] for term in one.terms if len(term.factors) == 1 and term.factors[0][1] == 1]
        own = [node.symbol for node in moments if isinstance(node, Name) and node.symbol.unit == "kg*m^2"]
        is_plain = all(name.symbol.kind == "parameter" for name in names_in([one]))
        if len(own) != 1 or not is_plain or any(term.number != 1 for term in one.terms):
            continue
        name = Name(Symbol("J", own[0].subscripts, kind="shared", unit="kg*m^2", order=own[0].order))
        times = sum(n for other, n in counts.items() if set(one.terms) <= set(other.terms))
        if times >= _TIMES and name not in found.values():
            found[one] = name
    return found


def _expanded(node: Sum) -> Plain | None:
    """Return a sum of products of symbols and of squares of such sums as a polynomial; None if it is another."""
    total: Plain = {}
    for term in node.terms:
        product: Plain = {(): term.number}
        for base, power in term.factors:
            one: Plain | None = {((base.symbol, 1),): ONE} if isinstance(base, Name) and not base.dots else None
            inner = _expanded(base) if isinstance(base, Sum) else one
            if inner is None or power.denominator != 1 or not 0 < power <= 2:
                return None
            for _ in range(int(power)):
                product = _times(product, inner)
        for key, value in product.items():
            total[key] = total.get(key, ONE * 0) + value
    return {key: value for key, value in total.items() if value}


def _times(a: Plain, b: Plain) -> Plain:
    result: Plain = {}
    for first, x in a.items():
        for second, y in b.items():
            powers = Counter(dict(first))
            powers.update(dict(second))
            key = tuple(sorted(powers.items(), key=lambda item: item[0].name))
            result[key] = result.get(key, ONE * 0) + x * y
    return result
