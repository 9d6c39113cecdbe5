"""Quadratures in closed form: integrals of a momentum, and of its derivatives by constants, over its coordinate.

With ``x = q``, ``q^2``, ``cos q`` or ``exp q`` the integral of ``p = sqrt(R(q))`` becomes that of ``S(x) sqrt(Q(x))``.
Where Q is of second degree, and what stands over its root a polynomial and simple poles, integrals are arcs and
logarithms, and those to and fro between turning points are residues (Goldstein, section 10.8). The signs of
coefficients are those of given values.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from typing import NamedTuple

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.tidied import length, tidied, without_even

_NONE = 1e-9
"""Where a value is zero, signs are those of formulas with a small positive one."""


class _Form(NamedTuple):
    """A momentum over x: ``R (dq/dx)^2 = Q S^2``.

    Attributes
    ----------
    x
        x in terms of q.
    slope, root, outside
        ``(dq/dx)^2``, Q and S.
    sign
        Whether x rises with q.
    """

    x: Sympy
    slope: Sympy
    root: Sympy
    outside: Sympy
    sign: int


@dataclass(frozen=True, eq=False)
class Quadrature:
    """The integral of ``p = sqrt(square)`` over a coordinate where it rises, and derivatives of it by constants.

    Attributes
    ----------
    square
        ``p^2`` in terms of the coordinate, constants and parameters.
    coordinate
        Its symbol.
    values
        Values of all symbols at some place of the motion, that of the coordinate included.
    """

    square: Sympy
    coordinate: Sympy
    values: Mapping[Sympy, float]

    def integral(self, constant: Sympy | None = None) -> Sympy:
        """Return the integral of p, or its derivative by a constant; an `Integral` where there is no closed form."""
        by = sympy.sqrt(self.square)
        by = by if constant is None else by.diff(constant)
        if by == 0:
            return sympy.Integer(0)
        found = self._total(constant, False)
        return sympy.Integral(by, self.coordinate) if found is None else found

    def turn(self, constant: Sympy | None = None) -> Sympy | None:
        """Return the same to and fro between two turning points; None where there is no closed form."""
        found = self._total(constant, True)
        if found is None:
            return self._elliptic(constant)
        return tidied(sympy.expand(found * self.form.sign), self.known)

    def unbound(self, constant: Sympy) -> Sympy | None:
        """Return the derivative of the integral from infinity to a turning point and back, where that is one arc."""
        terms = self._terms(constant)
        if terms is None or len(terms) != 1 or terms[0].pole is None:
            return None
        a, b, c = self._coefficients(terms[0].pole)
        if not self._number(a) < 0.0 < self._number(c):
            return None
        arc = sympy.pi / 2 + sympy.asin(b / (2 * self._spread))
        turned = 2 * self.form.sign * self._side(terms[0].pole)
        return turned * arc * tidied(terms[0].weight / self.root(-a), self.known)

    def inverse(self, constant: Sympy, since: Sympy) -> Sympy | None:
        """Return the coordinate where the derivative by a constant has risen since a turning point, if it is one arc.

        Of two turning points it is that of least x; None where that derivative is more than one arc.
        """
        terms = self._terms(constant)
        if terms is None or len(terms) != 1 or terms[0].power:
            return None
        a, b, c = self._coefficients(terms[0].pole)
        if not self._number(b * b - 4 * a * c) > 0.0:
            return None
        past = since / terms[0].weight

        def wave(square: Sympy) -> Sympy:
            """Return the cosine of the arc, or the hyperbolic one."""
            turned = self._number(square) < 0.0
            rate = self.root(-square if turned else square)
            return (sympy.cos if turned else sympy.cosh)(tidied(rate * past, self.known))

        if terms[0].pole is not None and self._number(a) < 0.0:
            x = terms[0].pole - a * self._side(terms[0].pole) / (b / 2 + self._spread * wave(a))
        elif terms[0].pole is None and c != 0:
            side = -1 if self._number(c) > 0.0 > self._number(c * self.form.x + b / 2) else 1
            x = (side * self._spread * wave(c) - b / 2) / c
        elif terms[0].pole is None and b != 0:
            x = tidied(b * past**2 / 4 - a / b, self.known)
        else:
            return None
        q, turns = self.coordinate, round(self._number(self.coordinate) / (2.0 * math.pi))
        side = 1 if self._number(q) > 0.0 else -1
        arc = 2 * sympy.pi * turns + (1 if self._number(q) > 2.0 * math.pi * turns else -1) * sympy.acos(x)
        return {q: x, q**2: side * sympy.sqrt(x), sympy.cos(q): arc}.get(self.form.x)

    @property
    def conic(self) -> tuple[Sympy, Sympy, Sympy] | None:
        """Coefficients a, b, c where ``p^2 = c + b/q + a/q^2``, as of an orbit; None else."""
        form = self._form
        if form is None or form.x != self.coordinate or sympy.cancel(form.outside * _x()) != 1:
            return None
        return self._coefficients(None)

    @cached_property
    def known(self) -> tuple[Sympy, ...]:
        """What is known to be positive."""
        return tuple(one if value >= 0.0 else -one for one, value in self.values.items())

    def root(self, value: Sympy) -> Sympy:
        """Return a square root, without that of a square."""
        if value not in self._roots:
            self._roots[value] = tidied(sympy.sqrt(sympy.expand(value)), self.known)
        return self._roots[value]

    @cached_property
    def _roots(self) -> dict[Sympy, Sympy]:
        return {}

    @cached_property
    def _spread(self) -> Sympy:
        """Half the root of the discriminant, wherever it is counted from."""
        a, b, c = self._coefficients(None)
        return self.root(b * b / 4 - a * c)

    def __repr__(self) -> str:
        return f"<Quadrature over {self.coordinate}>"

    # -- the form -------------------------------------------------------------------------------------------------

    @property
    def form(self) -> _Form:
        """The form, where there is one."""
        assert self._form is not None
        return self._form

    @cached_property
    def _form(self) -> _Form | None:
        """The form with Q of second degree, where the motion goes on from one end of x to the other."""
        for one, folds in self._forms:
            goes_on = any(sympy.expand(one.root.subs(_x(), fold)) == 0 for fold in folds)
            if not goes_on and sympy.degree(one.root, _x()) <= 2:
                sign = sympy.sign(self._number(one.outside.xreplace({_x(): one.x})))
                return one._replace(outside=one.outside * sign)
        return None

    @cached_property
    def _forms(self) -> list[tuple[_Form, tuple[int, ...]]]:
        """Forms with any polynomial Q, and the values of x at which x turns back and the motion may go on."""
        found = []
        for x, slope in _substitutions(self.square, self.coordinate):
            made = _in_terms_of(self.square, self.coordinate, x)
            if made is None:
                continue
            odd = even = sympy.Integer(1)
            for part, sign in zip(sympy.fraction(sympy.cancel(sympy.together(made * slope))), (1, -1), strict=True):
                coefficient, factors = sympy.factor_list(part, _x())
                odd *= coefficient**sign
                for one, power in factors:
                    above = (sign * power) // 2  # what is odd below stands above, too
                    odd, even = odd * one ** (sign * power - 2 * above), even * one**above
            odd, rises = sympy.expand(odd), 1 if self._number(x.diff(self.coordinate)) > 0.0 else -1
            if odd.is_polynomial(_x()):
                folds = {sympy.cos: (1, -1), sympy.Pow: (0,)}.get(x.func, ())
                found.append((_Form(x, slope, odd, even, rises), folds))
        return found

    def _elliptic(self, constant: Sympy | None) -> Sympy | None:
        """Return a whole turn between roots of a cubic Q, by Legendre's complete integrals; None of other motions."""
        for form, folds in self._forms:
            first = sympy.Poly(form.root, _x()).LC()
            side = 1 if self._number(first) > 0.0 else -1
            roots = sympy.roots(sympy.Poly(form.root.xreplace({_x(): side * _x()}), _x()), cubics=False)
            if sympy.degree(form.root, _x()) != 3 or len(roots) != 3:
                continue
            low, high, top = sorted((tidied(one, self.known) for one in roots), key=self._number)
            numbers = [self._number(one) for one in (low, high, top)]
            if not numbers[0] < numbers[1] < numbers[2] or self._number(side * form.x) > 0.5 * sum(numbers[1:]):
                continue
            middle = {_x(): side * sympy.Float(0.5 * sum(numbers[:2]))}
            terms = self._terms(
                constant, form._replace(outside=form.outside * sympy.sign(self._number(form.outside.xreplace(middle))))
            )
            if terms is None or any(one.pole is not None or one.power > 2 for one in terms):
                continue
            _, b, c, _ = sympy.Poly(form.root.xreplace({_x(): side * _x()}), _x()).all_coeffs()
            modulus, rate = (
                tidied(one, self.known) for one in ((high - low) / (top - low), side * first * (top - low))
            )
            whole = 2 * sympy.elliptic_k(modulus) / self.root(rate)
            once = top * whole - 2 * self.root(rate) / (side * first) * sympy.elliptic_e(modulus)
            powers = (whole, once, -(2 * b * once + c * whole) / (3 * side * first))
            times = 4 if sum(side * fold in (low, high) for fold in folds) == 1 else 2
            total = sympy.expand(
                sympy.Add(*(times * side**one.power * one.weight * powers[one.power] for one in terms))
            )
            return sympy.collect(
                total, [*total.atoms(sympy.elliptic_k, sympy.elliptic_e)], lambda one: tidied(one, self.known)
            )
        return None

    def _coefficients(self, pole: Sympy | None) -> tuple[Sympy, Sympy, Sympy]:
        """Return those of Q, counted from a pole to the side on which the motion is."""
        x = _x() if pole is None else pole + self._side(pole) * _x()
        found = sympy.Poly(sympy.expand(self.form.root.xreplace({_x(): x})), _x())
        a, b, c = (tidied(found.coeff_monomial(_x() ** k), self.known) for k in range(3))
        return a, b, c

    def _side(self, pole: Sympy) -> int:
        return 1 if self._number(self.form.x - pole) > 0.0 else -1

    def _terms(self, constant: Sympy | None, form: _Form | None = None) -> list[_Term] | None:
        """Return what stands over the root of Q; None where that is more than a polynomial and simple poles."""
        form = form or self._form
        if form is None:
            return None
        whole = form.outside * form.root
        if constant is not None:
            by = _in_terms_of(self.square.diff(constant), self.coordinate, form.x)
            if by is None:
                return None
            whole = by * form.slope / (2 * form.outside)
        found = []
        for one in sympy.Add.make_args(sympy.apart(sympy.cancel(sympy.together(whole)), _x())):
            above, below = sympy.fraction(sympy.cancel(one))
            if not below.has(_x()):
                found += [_Term(weight, power, None) for (power,), weight in sympy.Poly(one, _x()).terms()]
                continue
            made = sympy.Poly(below, _x())
            if made.degree() != 1 or above.has(_x()):
                return None
            first, last = made.all_coeffs()
            found.append(_Term(above / first, 0, sympy.cancel(-last / first)))
        return [one for one in found if one.weight != 0]

    def _total(self, constant: Sympy | None, is_whole: bool) -> Sympy | None:
        """Return the sum of the integrals of all terms, over a whole turn or not."""
        terms = self._terms(constant)
        if terms is None or any(one.power > 2 for one in terms):
            return None
        made = [self._integral_of(one, is_whole) for one in terms]
        if any(one is None for one in made):
            return None
        total = sympy.Add(*(sympy.expand_mul(one.weight * of, deep=False) for one, of in zip(terms, made, strict=True)))
        gathered = sympy.collect(total, [_stem(), *total.atoms(sympy.asin, sympy.log)], tidied)
        back = {_stem(): sympy.sqrt(sympy.expand(self.form.root))}
        return self.form.sign * gathered.xreplace(back).xreplace({_x(): self.form.x})

    def _integral_of(self, term: _Term, is_whole: bool) -> Sympy | None:
        """Return the integral of a term over the root of Q; None where a whole turn has none."""
        a, b, c = self._coefficients(term.pole)
        x = _x()
        root = sympy.Integer(0) if is_whole else _stem()
        if is_whole and not self._number(c) < 0.0:
            return None
        if term.pole is not None:
            y = self._side(term.pole) * (x - term.pole)
            if a == 0:
                return -2 * root / (b * y)
            if self._number(a) < 0.0:
                turn = 2 * sympy.pi * self._side(term.pole)
                arc = turn if is_whole else sympy.asin((b / 2 * y + a) / (y * self._spread))
                return arc / self.root(-a)
            return None if is_whole else -self._log((self.root(a) * _stem() + b / 2 * y + a) / y) / self.root(a)
        if c == 0:
            if b == 0:
                return x ** (term.power + 1) / ((term.power + 1) * self.root(a))
            return (
                root
                * (
                    2 / b,
                    2 * (b * x - 2 * a) / (3 * b**2),
                    2 * (3 * b**2 * x**2 - 4 * a * b * x + 8 * a**2) / (15 * b**3),
                )[term.power]
            )
        if self._number(c) < 0.0:
            arc = (2 * sympy.pi if is_whole else -sympy.asin((c * x + b / 2) / self._spread)) / self.root(-c)
        else:
            arc = self._log(self.root(c) * _stem() + c * x + b / 2) / self.root(c)
        if term.power == 0:
            return arc
        if term.power == 1:
            return root / c - b / (2 * c) * arc
        return (x / (2 * c) - 3 * b / (4 * c**2)) * root + (3 * b**2 - 4 * a * c) / (8 * c**2) * arc

    def _log(self, value: Sympy) -> Sympy:
        there = value.xreplace({_stem(): sympy.sqrt(self.form.root)}).xreplace({_x(): self.form.x})
        return sympy.log(value if self._number(there) > 0.0 else -value)

    def _number(self, value: Sympy) -> float:
        there = {one: sympy.Float(known or _NONE) for one, known in self.values.items()}
        return float(sympy.re(sympy.sympify(value).xreplace(there).evalf()))


class _Term(NamedTuple):
    """A term of what stands over the root of Q: ``weight x^power``, or ``weight/(x - pole)``."""

    weight: Sympy
    power: int
    pole: Sympy | None


def _substitutions(square: Sympy, q: Sympy) -> Iterator[tuple[Sympy, Sympy]]:
    """Yield what x may be in terms of q, and ``(dq/dx)^2`` in terms of x."""
    inside = {one.args[0] for one in square.atoms(sympy.sin, sympy.cos) if one.has(q)}
    powers = sorted((one.args[0] for one in square.atoms(sympy.exp) if one.has(q)), key=length)
    if powers:
        yield sympy.exp(powers[0]), 1 / (powers[0].diff(q) * _x()) ** 2
    elif inside:
        yield from ((sympy.cos(one), 1 / (one.diff(q) ** 2 * (1 - _x() ** 2))) for one in inside)
    else:
        yield q, sympy.Integer(1)
        yield q**2, 1 / (4 * _x())


def _in_terms_of(value: Sympy, q: Sympy, x: Sympy) -> Sympy | None:
    """Return a function of q as a rational one of x; None where it is none."""
    if x.func is sympy.exp:
        made = sympy.expand(value).replace(sympy.exp, lambda power: _x() ** sympy.cancel(power / x.args[0]))
    elif x.func is sympy.cos:
        above, below = (without_even(one, True).xreplace({x: _x()}) for one in sympy.fraction(sympy.together(value)))
        made = above / below
    else:
        made = sympy.cancel(sympy.together(value)).subs(q, _x() if x == q else sympy.sqrt(_x()))
    return made if not made.has(q) and made.is_rational_function(_x()) else None


@cache
def _x() -> Sympy:
    """Return the symbol for what the coordinate is replaced by."""
    return sympy.Dummy("x")


@cache
def _stem() -> Sympy:
    """Return the symbol for the root of Q."""
    return sympy.Dummy("root")
