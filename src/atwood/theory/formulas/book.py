"""Expressions of the graph as formulas in the shortest of some forms: expanded, with sums and differences of angles.

The forms are those of `atwood.expr.simplify`, which programs are made of. There the fewest operations win; here the
fewest symbols to read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import partial
from itertools import islice

from atwood.expr import Expression, live, substitute
from atwood.expr.simplify.polynomial import (
    ONE,
    Atom,
    Coefficient,
    Effort,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    expand,
)
from atwood.lazy_dataclasses import dataclass, replace
from atwood.theory.formulas.forms import (
    LIMIT,
    Owners,
    content_of,
    forms_of,
    length_of,
    nearer,
    shape_of,
    squares_in,
    with_unit_quaternion,
)
from atwood.theory.formulas.tree import (
    Call,
    Factor,
    Name,
    Node,
    Number,
    Sum,
    Symbol,
    Term,
    alone,
    as_decimal,
    as_fraction,
    cost,
    in_brackets,
    in_order,
    of_pi,
    place_of_term,
    product,
)

_BUDGET = 60_000
_WORTH_A_NAME = 4
"""What is shared has a name of its own if there is more to read than this."""

_SHARED = "s"
_LARGEST_ROOT = 12

_SQUARES = 6
"""Up to so many squares of sums it is tried whether they are shorter as they stand."""

PI = Name(Symbol("pi", kind="time"))


@dataclass
class Book:
    """Writes expressions as formulas.

    Attributes
    ----------
    names
        What stands for symbols, and how many dots it has.
    angles
        Symbols whose sines and cosines are combined.
    parameters
        Symbols that go into coefficients.
    is_exact
        Whether numbers come from laws alone, and are fractions; else they are decimals.
    quaternions
        Symbols of the parts of each, scalar part first; their size is taken as one.
    shared
        Names that were given to what formulas share, and what they stand for, each after those that it needs.
    """

    names: Mapping[Expression, Name]
    angles: tuple[Expression, ...]
    parameters: tuple[Expression, ...]
    is_exact: bool = True
    quaternions: Sequence[Sequence[Expression]] = ()
    shared: list[tuple[Name, Sum]] = field(default_factory=list)
    _named: set[int] = field(default_factory=set)
    _norms: dict[tuple[int, int], bool] = field(default_factory=dict)
    _known: dict[int, Node] = field(default_factory=dict)

    def write(self, total: Expression, shares: Mapping[str, Expression] | None = None, grouped: bool = False) -> Sum:
        """Return an expression as a formula."""
        values = [total, *(shares or {}).values()]
        best = self._best(values, shares or {}, grouped)
        squares = list(islice(squares_in(total), _SQUARES + 1)) if grouped else []
        if 0 < len(squares) <= _SQUARES:
            for chosen in ([*squares], *([one] for one in squares)):
                found = self._with_squares(values, chosen, shares or {}, grouped)
                if found is not None and cost(found) < cost(best):
                    best = found
        return best

    def _with_squares(
        self,
        values: Sequence[Expression],
        squares: Sequence[tuple[Expression, Expression, Expression | None]],
        shares: Mapping[str, Expression],
        grouped: bool,
    ) -> Sum | None:
        """Return the formula with some squares of sums as they stand."""
        by: dict[Expression, Expression | float] = {}
        try:
            for square, base, factor in squares:
                stand_in = base.graph.symbol(f"base {base.index}")
                self._known[stand_in.index] = _with_leading_plus(in_brackets(self.write(base).terms))
                by[square] = stand_in * stand_in if factor is None else factor * (stand_in * stand_in)
            return self._best(substitute(list(values), by), shares, grouped)
        except TooLargeError:
            return None

    def _best(self, values: Sequence[Expression], shares: Mapping[str, Expression], grouped: bool) -> Sum:
        expansion = self._expanded(values)
        total, *others = [self._with_unit_quaternions(expansion, row) for row in expansion.rows]
        owners = Owners(expansion, dict(zip(shares, others, strict=True)))
        best = min(forms_of(expansion, total), key=partial(length_of, expansion))
        return Sum(tuple(self._terms(expansion, best, owners, grouped)))

    def _expanded(self, values: Sequence[Expression]) -> Expansion:
        try:
            return expand(values, self.angles, self.parameters, LIMIT, Effort(_BUDGET))
        except TooLargeError:
            return expand(values, self.angles, self.parameters, LIMIT, Effort(_BUDGET), 1)

    def _with_unit_quaternions(self, expansion: Expansion, row: Polynomial) -> Polynomial:
        """Return a polynomial in which quaternions have size one: in its one form, with no square of the first part.

        So axes are orthonormal, whatever products of their components there are.
        """
        for quaternion in self.quaternions:
            if not all(Atom("node", part) in expansion.numbers for part in quaternion):
                continue
            numbers = [expansion.numbers[Atom("node", part)] for part in quaternion]
            norms = {i for i, atom in enumerate(expansion.atoms) if self._is_norm(atom, quaternion)}
            row = with_unit_quaternion(row, numbers, norms)
        return row

    def _is_norm(self, atom: Atom, quaternion: Sequence[Expression]) -> bool:
        if atom.kind != "inverse" or not isinstance(atom.argument, Expression):
            return False
        key = atom.argument.index, quaternion[0].index
        if key not in self._norms:
            try:
                found = expand([atom.argument], (), self.parameters, 4, Effort(100))
                wanted = [found.numbers.get(Atom("node", part), -1) for part in quaternion]
                self._norms[key] = found.rows[0] == {((number, 2),): {ONE: 1.0} for number in wanted}
            except TooLargeError:
                self._norms[key] = False
        return self._norms[key]

    # -- from polynomials -----------------------------------------------------------------------------------------

    def _terms(self, expansion: Expansion, polynomial: Polynomial, owners: Owners, grouped: bool) -> Iterator[Term]:
        together: dict[object, dict[object, list[tuple[Monomial, float]]]] = {}
        for monomial in polynomial:
            shape, lead = shape_of(polynomial[monomial])
            below = tuple(one for one in monomial if expansion.atoms[one[0]].kind == "inverse")
            key = () if grouped else below or monomial
            together.setdefault(shape, {}).setdefault(key, []).append((monomial, lead))
        found: list[Term] = []
        for monomials in (one for several in together.values() for one in several.values()):
            if monomials[0][0] == ONE and len(monomials) == 1:
                found += self._still(expansion, polynomial[ONE], owners)
                continue
            made = []
            for monomial, lead in monomials:
                who = owners.of(monomial, polynomial[monomial])
                factors = [*self._atoms(expansion, monomial)]
                made.append((product(Fraction(1), factors, who), lead, polynomial[monomial]))
            if len(made) == 1 or (grouped and made[0][2].keys() == {ONE}):
                for one, _, coefficient in made:
                    number, constants = self._coefficient(expansion, coefficient)
                    found.append(in_order(product(number * one.number, [*constants, *one.factors], one.owners)))
                continue
            number, constants = self._coefficient(expansion, made[0][2])
            ratios = [as_fraction(lead / made[0][1]) for _, lead, _ in made]
            whole = content_of(ratios)
            content = min(
                (whole if whole > 0 else -whole, Fraction(1)), key=lambda c: sum(abs(ratio) != c for ratio in ratios)
            )
            inner = [one.times(ratio / content) for (one, _, _), ratio in zip(made, ratios, strict=True)]
            number = number * content
            who = tuple(dict.fromkeys(owner for one, _, _ in made for owner in one.owners))
            shared = [] if grouped else [one for one in inner[0].factors if one[1] < 0 and _all_have(inner, one)]
            inner = [replace(one, factors=tuple(f for f in one.factors if f not in shared)) for one in inner]
            both = in_brackets(map(in_order, inner))
            found.append(in_order(product(number, [*constants, (both, Fraction(1)), *shared], who)))
        yield from sorted(found, key=place_of_term)

    def _still(self, expansion: Expansion, coefficient: Coefficient, owners: Owners) -> list[Term]:
        """Return what does not move: term by term, or with what the terms share before a bracket."""
        number, factors = self._coefficient(expansion, coefficient)
        together = in_order(product(number, factors, owners.of(ONE, coefficient)))
        apart = []
        for monomial, value in coefficient.items():
            number, factors = self._number(value)
            who = owners.of(ONE, {monomial: value})
            apart.append(in_order(product(number, [*factors, *self._constants(expansion, monomial)], who)))
        return [together] if cost(Sum((together,))) <= cost(Sum(tuple(apart))) else apart

    def _coefficient(self, expansion: Expansion, coefficient: Coefficient) -> tuple[Number, list[Factor]]:
        """Return a coefficient as a number and factors: what all its terms share comes first."""
        monomials = sorted(coefficient)
        shared = dict(monomials[0])
        for monomial in monomials[1:]:
            powers = dict(monomial)
            shared = {atom: nearer(shared.get(atom, 0), powers.get(atom, 0)) for atom in {*shared, *powers}}
        shared = {atom: power for atom, power in shared.items() if power}
        pairs = [self._number(coefficient[monomial]) for monomial in monomials]
        content = content_of([number for number, _ in pairs])
        outside = self._constants(expansion, tuple(sorted(shared.items())))
        if len(monomials) == 1:
            return pairs[0][0], [*pairs[0][1], *outside]
        terms = []
        for monomial, (number, extra) in zip(monomials, pairs, strict=True):
            rest = dict(monomial)
            for atom, power in shared.items():
                rest[atom] = rest.get(atom, 0) - power
            inner = self._constants(expansion, tuple(sorted((a, p) for a, p in rest.items() if p)))
            terms.append(in_order(product(number / content, [*extra, *inner])))
        return content, [*outside, (in_brackets(terms), Fraction(1))]

    def _number(self, value: float) -> tuple[Number, list[Factor]]:
        if not self.is_exact:
            return as_decimal(value), []
        number = as_fraction(value)
        turns = of_pi(value) if isinstance(number, float) else None
        return (number, []) if turns is None else (turns, [(PI, Fraction(1))])

    def _constants(self, expansion: Expansion, monomial: Monomial) -> list[Factor]:
        return [(self._node(expansion.constants[atom]), Fraction(power)) for atom, power in monomial]

    def _atoms(self, expansion: Expansion, monomial: Monomial) -> Iterator[Factor]:
        for number, exponent in monomial:
            atom = expansion.atoms[number]
            power = Fraction(-exponent if atom.kind == "inverse" else exponent)
            node = self._atom(expansion, atom)
            if isinstance(node, Sum) and len(node.terms) == 1 and len(node.terms[0].factors) == 1:
                ((base, inner),) = node.terms[0].factors
                if node.terms[0].number == 1:
                    node, power = base, power * inner
            yield node, power

    def _atom(self, expansion: Expansion, atom: Atom) -> Node:
        argument = atom.argument
        if not isinstance(argument, Expression):
            pairs = zip(expansion.angles, argument, strict=True)
            turns = (product(Fraction(count), [(self._node(angle), Fraction(1))]) for angle, count in pairs if count)
            return Call(atom.kind, (Sum(tuple(turns)),))
        if atom.kind in ("sin", "cos"):
            return Call(atom.kind, (self._node(argument),))
        return self._node(argument)

    # -- what is too long to expand -------------------------------------------------------------------------------

    def write_plainly(self, expressions: Sequence[Expression]) -> list[Sum]:
        """Return expressions as they are computed, with names for what they share; see `shared`."""
        nodes = live(expressions)
        uses = Counter(argument.index for node in nodes for argument in node.arguments)
        made: dict[int, Node] = {}
        for node in nodes:
            if node.operation == "solve":
                continue
            known = self._known.get(node.index) if node.index in self._named else None
            written = known or self._plain(node, made)
            if known is None and uses[node.index] > 1 and cost(written) > _WORTH_A_NAME and not node.is_parametric:
                name = Name(Symbol(_SHARED, (str(len(self.shared) + 1),), kind="shared", order=len(self.shared)))
                self.shared.append((name, alone(written)))
                written = self._known[node.index] = name
                self._named.add(node.index)
            made[node.index] = written
        return [alone(made[expression.index]) for expression in expressions]

    def _plain(self, node: Expression, made: Mapping[int, Node]) -> Node:
        """Return one node from those of its arguments."""
        one = Fraction(1)
        if node.operation in ("add", "sub", "neg"):
            signs = {"add": (1, 1), "sub": (1, -1), "neg": (-1,)}[node.operation]
            terms = []
            for argument, sign in zip(node.arguments, signs, strict=True):
                terms += [term.times(Fraction(sign)) for term in alone(made[argument.index]).terms]
            return Sum(tuple(terms))
        if node.operation in ("mul", "div"):
            first, second = (made[argument.index] for argument in node.arguments)
            return Sum((product(one, [(first, one), (second, one if node.operation == "mul" else -one)]),))
        if node.operation == "component":
            matrix = [made[argument.index] for argument in node.arguments[0].arguments]
            return Call("component", (*matrix, self._integer(node.payload)))
        arguments = {argument.index: made[argument.index] for argument in node.arguments}
        return self._made(node, arguments)

    # -- what polynomials do not look into ------------------------------------------------------------------------

    def _node(self, expression: Expression) -> Node:
        """Return an expression as a name, a function of others, or a formula of its own."""
        index = expression.index
        if index not in self._known:
            self._known[index] = self._made(expression)
        return self._known[index]

    def _made(self, e: Expression, known: Mapping[int, Node] | None = None) -> Node:
        if e in self.names:
            return self.names[e]
        if e.is_symbol:
            return Name(Symbol(e.name))
        if e.operation == "constant":
            number, factors = self._number(e.value)
            return Sum((Term(number, tuple(factors)),)) if number else Sum(())
        if e.operation in ("add", "sub", "mul", "neg", "div"):
            return self.write(e)
        if e.operation == "component":
            return Call("component", (*map(self._node, e.arguments[0].arguments), self._integer(e.payload)))
        arguments = tuple(self._node(one) if known is None else known[one.index] for one in e.arguments)
        if e.operation == "sqrt":
            return Sum((product(Fraction(1), [(arguments[0], Fraction(1, 2))]),))
        if e.operation == "pow" and e.arguments[1].is_constant:
            exponent = as_fraction(e.arguments[1].value)
            if isinstance(exponent, Fraction) and exponent.denominator <= _LARGEST_ROOT:
                return Sum((product(Fraction(1), [(arguments[0], exponent)]),))
        name = e.payload.name if e.operation == "external" else e.operation
        return Call(name, arguments)

    def _integer(self, value: int) -> Node:
        return Sum((Term(Fraction(value)),)) if value else Sum(())


def _all_have(terms: Sequence[Term], factor: Factor) -> bool:
    return all(factor in term.factors for term in terms)


def _with_leading_plus(base: Sum) -> Sum:
    """Return what is squared with the sign in which its first term is added."""
    return base if base.terms[0].number > 0 else Sum(tuple(term.times(Fraction(-1)) for term in base.terms))
