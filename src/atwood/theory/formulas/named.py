"""Sub-expressions to which somebody gives a name, found in formulas wherever they stand, up to a factor."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from atwood.arguments import BY_PATH, Refused
from atwood.errors import UsageError, suggestion
from atwood.lazy_dataclasses import replace
from atwood.lazy_modules import sympy
from atwood.model.values.letters import LETTER, split_letter
from atwood.theory.formulas.page import Line, Matrix, Section, formulas_of, line_for
from atwood.theory.formulas.printers import objects
from atwood.theory.formulas.reading import read_formula
from atwood.theory.formulas.tree import (
    ONE,
    Call,
    Factor,
    Name,
    Node,
    Number,
    Sum,
    Symbol,
    Term,
    alone,
    in_brackets,
    in_order,
    names_in,
    product,
)


def _names(value: Any) -> dict[str, Any]:
    found = {LETTER.read(name): one for name, one in BY_PATH.read(value).items()}
    if not found:
        raise Refused
    return found


NAMED = replace(BY_PATH, what="formulas by name, such as {'Delta': 'm1 + m2'}", read=_names, word="NAME=FORMULA")
"""What has a name in formulas."""


def with_given_names(sections: Sequence[Section], named: Mapping[str, Any], where: str) -> list[Section]:
    """Return sections in which sub-expressions have the names that were given, and what these stand for.

    Parameters
    ----------
    sections
        Formulas under headings.
    named
        By name what it stands for, in the letters of the formulas and of the names before it.
    where
        Of what the formulas are.
    """
    lines = [line for one in sections for line in one.lines]
    heads = {line.left[1] for line in lines}
    taken = {one.symbol.name: one for line in lines for one in names_in(formulas_of(line))}
    told: list[Line] = []
    for order, (name, given) in enumerate(named.items()):
        if name in taken or name in heads:
            raise UsageError(f"{name} stands for something already", where=where, advice="Take another letter.")
        formula = _read(given, {key: one.symbol for key, one in taken.items()}, where)
        letter, *below = name.split("_")
        unit = next((one.symbol.unit for one in names_in([formula])), "1")  # by which factors are ordered
        taken[name] = own = Name(Symbol(letter, tuple(below), unit=unit, kind="shared", order=order))
        search = _Search(formula, own)
        sections = [replace(s, lines=tuple(map(search.line, s.lines))) for s in sections]
        if not search.has_found:
            raise UsageError(f"{given} stands in no formula", where=where, advice="Write it as the formulas have it.")
        told.append(line_for(own, formula))
    return [*sections, Section("Names", tuple(told))]


def _read(given: Any, known: Mapping[str, Symbol], where: str) -> Sum:
    """Return what was given as a formula: text, or an expression of sympy."""
    if isinstance(given, str):
        by: dict[str, Any] = {}

        def letter(found: re.Match[str]) -> str:
            name = "_".join(split_letter(found[1]))
            if name not in known:
                raise UsageError(f"no formula has {found[1]}", where=where, advice=suggestion(name, known))
            by[f"s{len(by)}_"] = objects.letter(known[name], len(found[2]))
            return f"s{len(by) - 1}_"

        text = re.sub(r"\b([A-Za-z]\w*)\b(?!\s*\()('*)", letter, given)
        try:
            given = sympy.sympify(text, by)
        except (sympy.SympifyError, TypeError) as error:
            raise UsageError(f"{given!r} is no formula", where=where) from error
    made = read_formula(given, known)
    if not any(names_in([made])):
        raise UsageError(f"{given} has no letters", where=where, advice="A number needs no name.")
    return made


class _Search:
    """Puts a name in the place of a sub-expression: in sums all of whose terms are there, up to a factor of all.

    Parameters
    ----------
    formula
        What is looked for; of a root what stands below it, so that its powers are found too.
    name
        What takes its place.
    """

    def __init__(self, formula: Sum, name: Name) -> None:
        power = ONE
        if len(formula.terms) == 1 == len(formula.terms[0].factors) and formula.terms[0].number == 1:
            ((base, power),) = formula.terms[0].factors
            formula = alone(base)
        self._wanted = [_factors(term) for term in formula.terms]
        self._own: Factor = name, 1 / power
        self.has_found = False

    def line(self, line: Line | Matrix) -> Line | Matrix:
        """Return a line with the name in it."""
        if isinstance(line, Line):
            return replace(line, formula=self._sum(line.formula))
        return replace(line, entries=tuple(tuple(map(self._sum, row)) for row in line.entries))

    def _sum(self, node: Sum) -> Sum:
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
        return self._sum(node) if isinstance(node, Sum) else node

    def _match(self, terms: Sequence[Term], first: Term) -> list[Term] | None:
        """Return terms in which those of the sub-expression are one, where some term is its first times a factor."""
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
        made = in_order(product(ratio, [*over.items(), self._own], tuple(owners)))
        place = sum(one in rest for one in terms[: terms.index(first)])
        return [*rest[:place], made, *rest[place:]]


def _times(one: Mapping[Node, Fraction], other: Mapping[Node, Fraction], power: int = 1) -> dict[Node, Fraction]:
    """Return a product of powers, or a quotient."""
    found = {node: one.get(node, Fraction(0)) + power * other.get(node, 0) for node in {**one, **other}}
    return {node: exponent for node, exponent in found.items() if exponent}


def _factors(term: Term) -> tuple[Number, dict[Node, Fraction]]:
    """Return the number and the powers in a term, in one way of writing them."""
    number, found = term.number, dict[Node, Fraction]()
    for base, power in term.factors:
        sign, node = _in_one_way(base)
        number = number * sign ** int(power)
        found = _times(found, {node: power})
    return number, found


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
