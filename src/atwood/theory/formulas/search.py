"""One formula found in another, wherever all its terms stand, up to a factor of all, and a name put in its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import lru_cache

from atwood.theory.formulas.tree import (
    ONE,
    Call,
    Factor,
    Name,
    Node,
    Number,
    Sum,
    Term,
    alone,
    in_brackets,
    in_order,
    product,
)


class Search:
    """Puts a name in the place of a sub-expression: in sums all of whose terms are there, up to a factor of all.

    Parameters
    ----------
    formula
        What is looked for; of a root what stands below it, so that its powers are found too.
    name, times
        What takes its place, with its power.
    """

    def __init__(self, formula: Sum, name: Name, times: Fraction = ONE) -> None:
        power = ONE
        if len(formula.terms) == 1 == len(formula.terms[0].factors) and formula.terms[0].number == 1:
            ((base, power),) = formula.terms[0].factors
            formula = alone(base)
        self._wanted = [_factors(term) for term in formula.terms]
        self._own: Factor = name, times / power
        self.has_found = False

    def put(self, node: Sum) -> Sum:
        """Return a formula with the name in it."""
        terms = [self._term(one) for one in node.terms]
        while (found := next(filter(None, (self._match(terms, term) for term in terms)), None)) is not None:
            terms = found
            self.has_found = True
        return Sum(tuple(terms))

    def _term(self, term: Term) -> Term:
        made = tuple((self._node(base), power) for base, power in term.factors)
        if made == term.factors:
            return term
        powers, (own, times) = Sum((Term(ONE, (self._own,)),)), self._own  # what is called a root is not negative
        made = tuple((own, power * times) if base == powers else (base, power) for base, power in made)
        return product(term.number, made, term.owners)

    def _node(self, node: Node) -> Node:
        if isinstance(node, Call):
            return Call(node.function, tuple(map(self._node, node.arguments)))
        return self.put(node) if isinstance(node, Sum) else node

    def _match(self, terms: Sequence[Term], first: Term) -> list[Term] | None:
        """Return terms in which those of the sub-expression are one, where some term is its first times a factor."""
        if len(terms) < len(self._wanted):
            return None
        number, given = _factors(first)
        lead, wanted = self._wanted[0]
        if not all(node in given and 0 < power / given[node] <= 1 for node, power in wanted.items()):
            return None
        ratio, over = number / lead, _times(given, wanted, -1)
        rest, owners = list(terms), dict.fromkeys(first.owners)
        for own, factors in self._wanted:
            sought = ratio * own, _times(over, factors)
            same = next((one for one in rest if _factors(one) == sought), None)
            if same is None:
                return None
            rest.remove(same)
            owners |= dict.fromkeys(same.owners)
        given_so = {node: base for base, _ in first.factors for sign, node in [_in_one_way(base)] if sign == 1}
        left = [(given_so.get(node, node), power) for node, power in over.items()]
        made = in_order(product(ratio, [*left, self._own], tuple(owners)))
        place = sum(one in rest for one in terms[: terms.index(first)])
        return [*rest[:place], made, *rest[place:]]


def _times(one: Mapping[Node, Fraction], other: Mapping[Node, Fraction], power: int = 1) -> dict[Node, Fraction]:
    """Return a product of powers, or a quotient."""
    found = {node: one.get(node, Fraction(0)) + power * other.get(node, 0) for node in {**one, **other}}
    return {node: exponent for node, exponent in found.items() if exponent}


@lru_cache(maxsize=4096)
def _factors(term: Term) -> tuple[Number, dict[Node, Fraction]]:
    """Return the number and the powers in a term, in one way of writing them."""
    number, found = term.number, dict[Node, Fraction]()
    for base, power in term.factors:
        sign, node = _in_one_way(base)
        number = number * sign ** int(power)
        found = _times(found, {node: power})
    return number, found


@lru_cache(maxsize=4096)
def _in_one_way(node: Node) -> tuple[int, Node]:
    """Return what a formula is in one way of writing it, and its sign: the sine of a difference has two."""
    if isinstance(node, Name):
        return 1, node
    if isinstance(node, Sum):
        made = [(number, sorted(found.items(), key=repr)) for number, found in map(_factors, node.terms)]
        return 1, in_brackets(sorted((Term(number, tuple(one)) for number, one in made), key=repr))
    arguments = tuple(_in_one_way(alone(one))[1] for one in node.arguments)
    plain = Call(node.function, arguments)
    if node.function not in ("sin", "cos", "tan"):
        return 1, plain
    turned = Sum(tuple(term.times(-1) for term in alone(arguments[0]).terms))
    other = Call(node.function, (_in_one_way(turned)[1],))
    chosen = min(plain, other, key=repr)
    return -1 if chosen is other and node.function != "cos" else 1, chosen
