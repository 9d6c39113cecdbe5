"""Conditions of rest in closed form: equations that are solved for one unknown at a time.

An equation is a product of factors that are polynomials in unknowns and in their sines and cosines; it holds where one
of them is zero. A factor is solved for an unknown that is linear in it, or alone in it as a polynomial of degree two,
as ``A cos + B sin + C``, or as a polynomial of degree two in one of sine and cosine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from atwood.late import dataclass

Sympy: TypeAlias = Any
"""A sympy object."""

_LONGEST = 250
"""Equations of more operations are not factored: nobody would solve them by hand."""

_MOST = 64
"""The largest number of solutions."""

_EFFORT = 6_000
"""So many operations of equations are factored in all."""


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
    """

    values: Mapping[Sympy, Sympy]
    conditions: tuple[Sympy, ...] = ()
    free: tuple[Sympy, ...] = ()


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
    import sympy

    plain, roots = _without_roots(equations, unknowns)
    search = _Search((*unknowns, *roots))
    found: list[Solution] = []
    try:
        for one in search.solutions(plain, {}, (), search.unknowns):
            made = _of_unknowns(one, unknowns, roots)
            if made is not None and made not in found and _is_regular(equations, made):
                found.append(made)
            if len(found) > _MOST:
                raise NoClosedFormError
    except sympy.PolynomialError:
        raise NoClosedFormError from None
    return found


def _without_roots(
    equations: Sequence[Sympy], unknowns: Sequence[Sympy]
) -> tuple[list[Sympy], dict[Sympy, Sympy]]:
    """Return equations in which square roots are unknowns of their own, and what each is the root of."""
    import sympy

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

    plain = [one.replace(is_root, named) for one in equations]
    return [*plain, *(root**2 - inside for root, inside in roots.items())], roots


def _of_unknowns(one: Solution, unknowns: Sequence[Sympy], roots: Mapping[Sympy, Sympy]) -> Solution | None:
    """Return a solution in the unknowns that were asked for, with the condition that roots are positive; None if not."""
    import sympy

    conditions = list(one.conditions)
    for root in roots:
        value = one.values.get(root)
        if value is None:
            continue
        if value.is_nonpositive:
            return None
        if not value.is_positive:
            conditions.append(sympy.Gt(value, 0))
    values = {key: value for key, value in one.values.items() if key in unknowns}
    return Solution(values, tuple(conditions), tuple(key for key in one.free if key in unknowns))


def _is_regular(equations: Sequence[Sympy], one: Solution) -> bool:
    """Return whether nothing is divided by zero at a solution."""
    import sympy

    for equation in equations:
        below = sympy.denom(sympy.together(equation)).subs(one.values)
        if below.is_zero or sympy.expand(below) == 0:
            return False
    return True


class _Search:
    """Solves equations factor by factor, within a bound on what is factored."""

    def __init__(self, unknowns: tuple[Sympy, ...]) -> None:
        self.unknowns, self.effort = unknowns, _EFFORT

    def solutions(
        self,
        equations: Sequence[Sympy],
        known: Mapping[Sympy, Sympy],
        conditions: tuple[Sympy, ...],
        unknowns: tuple[Sympy, ...],
    ) -> Iterator[Solution]:
        """Yield the solutions of what is left."""
        rest: list[list[Sympy]] = []
        for equation in equations:
            self.effort -= int(equation.count_ops())
            if self.effort < 0:
                raise NoClosedFormError
            factors = factors_of(equation, unknowns)
            if factors is None:
                continue
            if not factors:
                return  # it holds nowhere
            rest.append(factors)
        if not rest:
            yield Solution(dict(known), conditions, unknowns)
            return
        rest.sort(key=lambda factors: (_hardness(factors, unknowns), len(factors)))
        first, others = rest[0], [_product(one) for one in rest[1:]]
        for factor in first:
            unknown, roots = _roots(factor, unknowns)
            left = tuple(one for one in unknowns if one != unknown)
            for value, condition in roots:
                if value.is_nonpositive and unknown.is_positive:
                    continue
                by = {k: _shorter(v.subs(unknown, value)) if v.has(unknown) else v for k, v in known.items()}
                by[unknown] = value
                more = conditions if condition is None else (*conditions, condition)
                yield from self.solutions([one.subs(unknown, value) for one in others], by, more, left)


def _shorter(value: Sympy) -> Sympy:
    """Return a rational value as one fraction, another as it is."""
    symbols = sorted(value.free_symbols, key=str)
    return value.factor() if value.is_rational_function(*symbols) else value


def _product(factors: Sequence[Sympy]) -> Sympy:
    import sympy

    return sympy.Mul(*factors)


def factors_of(equation: Sympy, unknowns: Sequence[Sympy]) -> list[Sympy] | None:
    """Return the factors of an equation that may be zero; None if it is zero whatever the unknowns are."""
    import sympy

    if equation.count_ops() > _LONGEST:
        raise NoClosedFormError
    above = sympy.numer(sympy.together(sympy.expand(sympy.expand_trig(equation))))
    above = sympy.expand(above)
    if above == 0 or _reduced(above, unknowns) == 0:
        return None
    found = []
    for base, _ in sympy.factor_list(_reduced(above, unknowns))[1]:
        if base.has(*unknowns) if unknowns else False:
            found.append(base)
    return found


def _reduced(value: Sympy, unknowns: Sequence[Sympy]) -> Sympy:
    """Return a polynomial in sines and cosines with squares of one of the two alone, whichever has more factors."""
    import sympy

    forms = []
    for first, second in ((sympy.sin, sympy.cos), (sympy.cos, sympy.sin)):
        form = value
        for one in unknowns:
            if form.has(first(one)):
                s, c = first(one), second(one)
                form = sympy.rem(sympy.Poly(form, s), sympy.Poly(s**2 + c**2 - 1, s)).as_expr()
        forms.append(sympy.expand(form))
    if any(form == 0 for form in forms):
        return sympy.Integer(0)
    factored = [sympy.factor(form) for form in forms]
    best = max(range(2), key=lambda k: (len(sympy.Mul.make_args(factored[k])), -factored[k].count_ops()))
    return forms[best]


def _hardness(factors: Sequence[Sympy], unknowns: Sequence[Sympy]) -> tuple[int, int]:
    """Return how far factors are from one unknown each, and their length."""
    return (
        max(sum(one.has(x) for x in unknowns) for one in factors),
        max(int(one.count_ops()) for one in factors),
    )


def _roots(factor: Sympy, unknowns: Sequence[Sympy]) -> tuple[Sympy, list[tuple[Sympy, Sympy | None]]]:
    """Return an unknown for which a factor is solved, and its values with the conditions under which they exist."""
    inside = [one for one in unknowns if factor.has(one)]
    for one in inside:
        if len(inside) == 1:
            found = _alone(factor, one)
        else:
            found = _linear(factor, one, inside)
        if found is not None:
            return one, found
    raise NoClosedFormError


def _linear(factor: Sympy, unknown: Sympy, inside: Sequence[Sympy]) -> list[tuple[Sympy, Sympy | None]] | None:
    """Return the value of an unknown that is linear with a coefficient without unknowns."""
    slope = factor.diff(unknown)
    if slope == 0 or slope.has(*inside):
        return None
    return [((-factor.subs(unknown, 0) / slope).cancel(), None)]


def _alone(factor: Sympy, unknown: Sympy) -> list[tuple[Sympy, Sympy | None]] | None:
    """Return the values of the only unknown of a factor."""
    import sympy

    if factor.is_polynomial(unknown):
        return _of_polynomial(factor, unknown)
    s, c = sympy.Dummy("s", real=True), sympy.Dummy("c", real=True)
    form = factor.subs({sympy.sin(unknown): s, sympy.cos(unknown): c})
    if form.has(unknown):
        return None
    if not form.has(c):
        return [
            (angle, condition)
            for value, condition in _of_polynomial(form, s) or ()
            for angle, condition in _arcs(sympy.asin, value, condition, lambda angle: sympy.pi - angle)
        ]
    if not form.has(s):
        return [
            (angle, condition)
            for value, condition in _of_polynomial(form, c) or ()
            for angle, condition in _arcs(sympy.acos, value, condition, lambda angle: -angle)
        ]
    a, b = form.diff(c), form.diff(s)
    if a.has(c, s) or b.has(c, s):
        return None
    rest = form.subs({c: 0, s: 0})
    if rest == 0:
        first = sympy.atan((-a / b).cancel())
        return [(first, None), (first + sympy.pi, None)]
    reach, middle = (-rest / sympy.sqrt(a**2 + b**2)).cancel(), sympy.atan2(b, a)
    return [(middle + arc, condition) for arc, condition in _arcs(sympy.acos, reach, None, lambda angle: -angle)]


def _arcs(
    inverse: Any, value: Sympy, condition: Sympy | None, other: Any
) -> list[tuple[Sympy, Sympy | None]]:
    """Return the two angles of a sine or cosine, and when there are any."""
    import sympy

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
    import sympy

    while angle > sympy.pi:
        angle -= 2 * sympy.pi
    while angle <= -sympy.pi:
        angle += 2 * sympy.pi
    return angle


def _of_polynomial(factor: Sympy, unknown: Sympy) -> list[tuple[Sympy, Sympy | None]] | None:
    """Return the real roots of a polynomial of degree one or two, or of one of degree four that is even."""
    import sympy

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


def _of_quadratic(
    a: Sympy, b: Sympy, c: Sympy, condition: Sympy | None = None
) -> list[tuple[Sympy, Sympy | None]]:
    """Return the real roots of ``a x^2 + b x + c`` and when there are any."""
    import sympy

    under = sympy.factor(b**2 - 4 * a * c)
    if under.is_negative:
        return []
    if not under.is_nonnegative:
        exists = sympy.Ge(under, 0)
        condition = exists if condition is None else sympy.And(condition, exists)
    root = sympy.sqrt(under)
    values = [sympy.factor((-b + sign * root) / (2 * a)) for sign in (1, -1)]
    return [(value, condition) for value in dict.fromkeys(values)]
