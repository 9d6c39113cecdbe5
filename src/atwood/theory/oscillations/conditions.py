"""Conditions of rest in closed form: equations that are solved for one unknown at a time.

An equation is a product of factors that are polynomials in unknowns and in their sines and cosines; it holds where one
of them is zero. A factor is solved for an unknown that is linear in it, or alone in it as a polynomial of degree two,
as ``A cos + B sin + C``, or as a polynomial of degree two in one of sine and cosine.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy

_LONGEST, _LONGEST_OF_SEVERAL = 250, 60
"""Equations of more operations in one unknown, or in several, are not factored: nobody would solve them by hand."""

_MOST_TERMS = 60
"""Longer polynomials are not factored."""

_MOST = 32
"""The largest number of solutions."""

_EFFORT, _TRIES = 6_000, 4
"""So many operations of equations are factored in all; so many equations in several unknowns that are no products end
the search."""


_NO_RULE = "none of them, or of their factors, is solved for one unknown"


class NoClosedFormError(Exception):
    """The conditions are not solved by factors of one unknown each."""


@dataclass(frozen=True)
class Solution:
    """A solution of some equations.

    Attributes
    ----------
    values
        Each unknown in terms of the parameters.
    conditions
        What parameters must fulfil for it to exist; sympy relations.
    free
        Unknowns that may have any value.
    positive
        Values of square roots.
    """

    values: Mapping[Sympy, Sympy]
    conditions: tuple[Sympy, ...] = ()
    free: tuple[Sympy, ...] = ()
    positive: tuple[Sympy, ...] = ()


def solve_conditions(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[Solution]:
    """Return every solution of equations in closed form.

    Parameters
    ----------
    equations
        Each is zero; all other symbols are parameters that may have any value of their sign.
    unknowns
        Real symbols; those in sines and cosines are angles, given within half a turn.

    Raises
    ------
    NoClosedFormError
        If there is an equation that no rule solves.
    """
    plain, roots = _without_roots(equations, unknowns)
    search = _Search((*unknowns, *roots))
    found: list[Solution] = []
    try:
        for one in search.solutions(plain, {}, (), search.unknowns):
            made = _of_unknowns(one, unknowns, roots)
            if made is not None and made not in found and _is_regular(equations, made):
                found.append(made)
            if len(found) > _MOST:
                raise NoClosedFormError(f"there are more than {_MOST} of them")
    except sympy.PolynomialError:
        raise NoClosedFormError(_NO_RULE) from None
    return found


def _without_roots(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> tuple[list[Sympy], dict[Sympy, Sympy]]:
    """Return equations in which square roots are unknowns of their own, and what each is the root of."""
    roots: dict[Sympy, Sympy] = {}

    def named(power: Sympy) -> Sympy:
        base = sympy.factor(power.base)
        root = next((one for one, inside in roots.items() if sympy.expand(inside - base) == 0), None)
        if root is None:
            root = sympy.Dummy("r", positive=True)
            roots[root] = base
        return root**power.exp.p

    def is_root(value: Sympy) -> bool:
        return bool(value.is_Pow and value.exp.is_Rational and value.exp.q == 2 and value.base.has(*unknowns))

    def magnitude(inside: Sympy) -> Sympy:
        square = sympy.Pow(inside, 2, evaluate=False)
        return named(sympy.Pow(square, sympy.S.Half, evaluate=False)) if inside.has(*unknowns) else abs(inside)

    plain = [one.replace(sympy.Abs, magnitude).replace(is_root, named) for one in equations]
    return [*plain, *(root**2 - inside for root, inside in roots.items())], roots


def _of_unknowns(one: Solution, unknowns: Sequence[Sympy], roots: Mapping[Sympy, Sympy]) -> Solution | None:
    """Return a solution in the unknowns asked for, with the condition that roots are positive; None if they are not."""
    conditions = list(one.conditions)
    positive = [one.values[root] for root in roots if root in one.values]
    for value in positive:
        if value.is_nonpositive:
            return None
        conditions.append(is_positive(value))
    values = {key: value for key, value in one.values.items() if key in unknowns}
    kept = (condition for condition in conditions if condition != True)  # noqa: E712 - a truth value of sympy
    return Solution(values, tuple(kept), tuple(key for key in one.free if key in unknowns), tuple(positive))


def _is_regular(equations: Sequence[Sympy], one: Solution) -> bool:
    """Return whether nothing is divided by zero at a solution."""
    for equation in equations:
        below = sympy.denom(sympy.together(equation)).subs(one.values)
        if below.is_zero or sympy.expand(below) == 0:
            return False
    return True


class _Branch(NamedTuple):
    """A way in which an equation holds: an unknown with its value, if that exists, and other equations."""

    unknown: Sympy | None
    value: Sympy
    condition: Sympy | None = None
    others: tuple[Sympy, ...] = ()


class _Search:
    """Solves equations factor by factor, within a bound on what is factored."""

    def __init__(self, unknowns: tuple[Sympy, ...]) -> None:
        self.unknowns, self.effort = unknowns, _EFFORT
        self.factored: dict[Sympy, list[Sympy] | None] = {}

    def solutions(
        self,
        equations: Sequence[Sympy],
        known: Mapping[Sympy, Sympy],
        conditions: tuple[Sympy, ...],
        unknowns: tuple[Sympy, ...],
    ) -> Iterator[Solution]:
        """Yield the solutions of what is left."""
        branches = self._branches(equations, unknowns)
        if branches is None:
            yield Solution(dict(known), conditions, unknowns)
            return
        for unknown, value, condition, others in branches:
            if unknown is None:
                yield from self.solutions(others, known, conditions, unknowns)
                continue
            if value.is_nonpositive and unknown.is_positive:
                continue
            by = {k: _shorter(v.subs(unknown, value)) if v.has(unknown) else v for k, v in known.items()}
            left = [one.subs(unknown, value) for one in others]
            if any(one.has(sympy.zoo, sympy.nan) for one in (*by.values(), *left)):
                continue  # what was divided by is zero here: that is a branch of its own
            by[unknown] = value
            more = conditions if condition is None else (*conditions, condition)
            yield from self.solutions(left, by, more, tuple(one for one in unknowns if one != unknown))

    def _branches(self, equations: Sequence[Sympy], unknowns: tuple[Sympy, ...]) -> list[_Branch] | None:
        """Return how the equation holds that is solved most easily, each with what is left; None if all hold."""
        order = [(sum(one.has(x) for x in unknowns), int(one.count_ops()), i) for i, one in enumerate(equations)]
        holding: set[int] = set()
        factored: dict[int, list[Sympy]] = {}

        def without(i: int) -> tuple[Sympy, ...]:
            return tuple(one for j, one in enumerate(equations) if j not in {i, *holding})

        for inside, operations, i in sorted(order):
            if operations > (_LONGEST if inside < 2 else _LONGEST_OF_SEVERAL):
                continue
            if inside > 1:
                found = _linear(equations[i], [one for one in unknowns if equations[i].has(one)])
                if found is not None:
                    return [found._replace(others=without(i))]
            if equations[i] not in self.factored:
                self.effort -= operations * inside
                if self.effort < 0 or len(factored) >= _TRIES:
                    break
                self.factored[equations[i]] = factors_of(equations[i], unknowns)
            factors = self.factored[equations[i]]
            if factors is None:
                holding.add(i)
                continue
            roots = _every(_roots(factor, unknowns) for factor in factors)
            if roots is not None:
                return [one._replace(others=without(i)) for one in roots]
            factored[i] = factors
        for i, factors in factored.items():
            roots = _every(_roots(factor, unknowns) or _divided(factor, unknowns) for factor in factors)
            if roots is not None:
                return [one._replace(others=(*one.others, *without(i))) for one in roots]
        if len(holding) < len(equations):
            raise NoClosedFormError(_NO_RULE)
        return None


def _every(branches: Iterable[list[_Branch] | None]) -> list[_Branch] | None:
    """Return branches of all factors; None if one has none."""
    found: list[_Branch] = []
    for one in branches:
        if one is None:
            return None
        found += one
    return found


def _shorter(value: Sympy) -> Sympy:
    """Return a rational value as one fraction, another as it is."""
    symbols = sorted(value.free_symbols, key=str)
    return value.factor() if value.is_rational_function(*symbols) else value


def factors_of(equation: Sympy, unknowns: Sequence[Sympy]) -> list[Sympy] | None:
    """Return the factors of an equation that may be zero; None if it is zero whatever the unknowns are."""
    above = sympy.expand(sympy.numer(sympy.together(sympy.expand(sympy.expand_trig(equation)))))
    if len(sympy.Add.make_args(above)) > _MOST_TERMS:
        return [above]
    forms = _forms(above, unknowns)
    if any(form == 0 for form in forms):
        return None
    found = max((_factors(form) for form in forms), key=lambda one: (len(one), -sum(x.count_ops() for x in one)))
    return [one for one in found if one.has(*unknowns)] if unknowns else []


def _factors(form: Sympy) -> list[Sympy]:
    """Return the factors of a polynomial; those of one whose parameters are numbers tell whether there are any."""
    parameters = sorted((one for one in form.free_symbols if one.is_Symbol and not one.is_Dummy), key=str)
    numbers = dict(zip(parameters, map(sympy.prime, range(5, 5 + len(parameters))), strict=True))
    plain = sympy.factor_list(form.xreplace(numbers))[1]
    if sum(times for _, times in plain) < 2:
        return [form]
    return [base for base, _ in sympy.factor_list(form)[1]]


def _forms(value: Sympy, unknowns: Sequence[Sympy]) -> list[Sympy]:
    """Return a polynomial in sines and cosines with squares of cosines alone, and of sines alone."""
    forms = []
    for first, second in ((sympy.sin, sympy.cos), (sympy.cos, sympy.sin)):
        form = value
        for one in unknowns:
            if form.has(first(one)):
                s, c = first(one), second(one)
                form = sympy.rem(sympy.Poly(form, s), sympy.Poly(s**2 + c**2 - 1, s)).as_expr()
        forms.append(sympy.expand(form))
    return list(dict.fromkeys(forms))


def _roots(factor: Sympy, unknowns: Sequence[Sympy]) -> list[_Branch] | None:
    """Return the values of an unknown for which a factor is solved; None if there is none."""
    inside = [one for one in unknowns if factor.has(one)]
    if len(inside) == 1:
        found = _alone(factor, inside[0])
        return None if found is None else [_Branch(inside[0], *one) for one in found]
    linear = _linear(factor, inside)
    return None if linear is None else [linear]


def _linear(factor: Sympy, inside: Sequence[Sympy]) -> _Branch | None:
    """Return an unknown that is linear with a coefficient without unknowns, and its value."""
    for unknown in inside:
        slope = factor.diff(unknown)
        if slope != 0 and not slope.has(*inside):
            return _Branch(unknown, (-factor.subs(unknown, 0) / slope).cancel())
    return None


def _divided(factor: Sympy, unknowns: Sequence[Sympy]) -> list[_Branch] | None:
    """Return the value of an unknown that is linear, and the other way: that its coefficient and the rest are zero."""
    for unknown in unknowns[::-1]:
        slope = factor.diff(unknown)
        if slope != 0 and not slope.has(unknown):
            rest = factor.subs(unknown, 0)
            return [_Branch(unknown, (-rest / slope).cancel()), _Branch(None, sympy.nan, None, (slope, rest))]
    return None


def _alone(factor: Sympy, unknown: Sympy) -> list[tuple[Sympy, Sympy | None]] | None:
    """Return the values of the only unknown of a factor."""
    if factor.is_polynomial(unknown):
        return _of_polynomial(factor, unknown)
    s, c = sympy.Dummy("s", real=True), sympy.Dummy("c", real=True)
    form = factor.subs({sympy.sin(unknown): s, sympy.cos(unknown): c})
    if form.has(unknown):
        return None
    for own, absent, inverse, other in ((s, c, sympy.asin, lambda x: sympy.pi - x), (c, s, sympy.acos, lambda x: -x)):
        if not form.has(absent):
            return [arc for found in _of_polynomial(form, own) or () for arc in _arcs(inverse, *found, other)]
    a, b = form.diff(c), form.diff(s)
    if a.has(c, s) or b.has(c, s):
        return None
    rest = form.subs({c: 0, s: 0})
    if rest == 0:
        first = sympy.atan((-a / b).cancel())
        return [(first, None), (first + sympy.pi, None)]
    reach, middle = (-rest / sympy.sqrt(a**2 + b**2)).cancel(), sympy.atan2(b, a)
    return [(middle + arc, condition) for arc, condition in _arcs(sympy.acos, reach, None, lambda angle: -angle)]


def _arcs(inverse: Any, value: Sympy, condition: Sympy | None, other: Any) -> list[tuple[Sympy, Sympy | None]]:
    """Return the two angles of a sine or cosine, and when there are any."""
    if value.is_number:
        if not -1 <= value <= 1:
            return []
        angle = inverse(value)
        both = [angle, other(angle)]
        return [(one, condition) for one in dict.fromkeys(_within_half_turn(one) for one in both)]
    above, below = sympy.fraction(sympy.together(value))
    exists = sympy.Le(sympy.Abs(above), sympy.Abs(below))
    both_hold = exists if condition is None else sympy.And(condition, exists)
    angle = inverse(value)
    return [(angle, both_hold), (other(angle), both_hold)]


def _within_half_turn(angle: Sympy) -> Sympy:
    while angle > sympy.pi:
        angle -= 2 * sympy.pi
    while angle <= -sympy.pi:
        angle += 2 * sympy.pi
    return angle


def _of_polynomial(factor: Sympy, unknown: Sympy) -> list[tuple[Sympy, Sympy | None]] | None:
    """Return the real roots of a polynomial of degree one or two, or of one of degree four that is even."""
    poly = sympy.Poly(factor, unknown)
    degree, coefficients = poly.degree(), poly.all_coeffs()
    if degree == 1:
        return [((-coefficients[1] / coefficients[0]).cancel(), None)]
    if degree == 4 and coefficients[1] == coefficients[3] == 0:
        return [
            root
            for square, condition in _of_quadratic(*coefficients[::2])
            for root in _of_quadratic(sympy.Integer(1), sympy.Integer(0), -square, condition)
        ]
    return _of_quadratic(*coefficients) if degree == 2 else None


def _of_quadratic(a: Sympy, b: Sympy, c: Sympy, condition: Sympy | None = None) -> list[tuple[Sympy, Sympy | None]]:
    """Return the real roots of ``a x^2 + b x + c`` and when there are any."""
    under = sympy.factor(b**2 - 4 * a * c)
    if under.is_negative:
        return []
    if not under.is_nonnegative:
        exists = sympy.Ge(under, 0)
        condition = exists if condition is None else sympy.And(condition, exists)
    root = sympy.sqrt(under)
    values = [sympy.factor((-b + sign * root) / (2 * a)) for sign in (1, -1)]
    return [(value, condition) for value in dict.fromkeys(values)]


def is_positive(value: Sympy) -> Sympy:
    """Return that an expression is positive, as a relation of sympy, true or false."""
    value = sympy.sympify(value)
    if value.is_positive or sympy.expand(value).is_positive:
        return sympy.true
    negative, found, under = False, [], []
    for factor in sympy.Mul.make_args(sympy.factor(sympy.together(value))):
        base, exponent = factor.as_base_exp()
        if factor.is_zero:
            return sympy.false
        if exponent.is_Rational and exponent.q == 2:
            under.append(is_positive(base))
            continue
        if factor.is_negative:
            negative = not negative
        elif not (factor.is_positive or sympy.expand(factor).is_positive):
            found.append(base if exponent.is_odd else factor)
    sign = sympy.Integer(-1 if negative else 1)
    return sympy.And(balanced(sympy.Mul(sign, *found)) if found else sign > 0, *under)


def balanced(value: Sympy) -> Sympy:
    """Return ``a - b > 0`` as ``a > b``."""
    is_turned = value.is_Mul and len(value.args) == 2 and value.args[0] == -1
    terms = sympy.Add.make_args(value.expand() if is_turned else value)
    left = sympy.Add(*(one for one in terms if not one.could_extract_minus_sign()))
    right = sympy.Add(*(-one for one in terms if one.could_extract_minus_sign()))
    return sympy.Gt(left, right)
