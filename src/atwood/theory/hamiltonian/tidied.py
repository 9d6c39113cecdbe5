"""Expressions in sines, cosines and roots, brought to where sums of squares and roots of squares are gone.

Even powers of sines are written by cosines, or the other way round, whichever is shorter, and rational functions of
both are cancelled. A root of a square is what the square is of, without its sign where that is known.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy

_LONG = 700
"""Operations beyond which nothing is cancelled or factored."""


def tidied(value: Sympy, positive: Iterable[Sympy] = ()) -> Sympy:
    """Return an expression as short as Pythagoras makes it; factors that are said to be positive have no bars."""
    value = sympy.sympify(value)
    known = frozenset(positive)
    value = value.replace(_is_root, lambda e: _root(tidied(e.base, known), 2 * e.exp, known))
    if not value.has(*_waves(), sympy.Pow):
        return value
    return min((value, *(one for way in _ways(value) for one in written_by(value, way))), key=length)


def _waves() -> tuple[Sympy, ...]:
    return sympy.sin, sympy.cos, sympy.sinh, sympy.cosh


def _ways(value: Sympy) -> tuple[bool, ...]:
    """Return whether to write by cosines: both ways, where there are such."""
    return (True, False) if value.has(*_waves()) else (True,)


def written_by(value: Sympy, by_cosines: bool) -> tuple[Sympy, ...]:
    """Return a rational function without even powers of sines, or of cosines: as a sum, and as a product."""
    if value.count_ops() > _LONG:
        return (without_even(value, by_cosines),)
    above, below = sympy.fraction(sympy.together(value))
    above, below = (without_even(one, by_cosines) for one in (above, below))
    try:
        found = sympy.cancel(above / below)
        return (found, _factored(found)) if found.count_ops() <= _LONG else (found,)
    except sympy.PolynomialError:
        return (above / below,)


def _factored(value: Sympy) -> Sympy:
    """Return a rational function as a product, one less the square of a sine as a square of the cosine."""
    found = sympy.factor(value)
    pairs = {sympy.cos: sympy.sin, sympy.sin: sympy.cos}
    for one in found.atoms(sympy.cos, sympy.sin):
        square = pairs[one.func](*one.args) ** 2
        for power in (1, -1, 2, -2):
            found = found.subs(((one - 1) * (one + 1)) ** power, (-square) ** power)
    return found


def without_even(value: Sympy, by_cosines: bool) -> Sympy:
    """Return an expression expanded, with no even power of a sine, or of a cosine."""
    gone = (sympy.sin, sympy.sinh) if by_cosines else (sympy.cos, sympy.cosh)
    others = {sympy.sin: sympy.cos, sympy.sinh: sympy.cosh, sympy.cos: sympy.sin, sympy.cosh: sympy.sinh}

    def square(base: Sympy) -> Sympy:
        other = others[base.func](*base.args) ** 2
        return 1 - other if base.func in (sympy.sin, sympy.cos) else other + (1 if base.func is sympy.cosh else -1)

    def is_even(e: Sympy) -> bool:
        return bool(e.is_Pow and e.exp.is_Integer and e.exp > 1 and isinstance(e.base, gone))

    made = sympy.expand(value).replace(is_even, lambda e: square(e.base) ** (e.exp // 2) * e.base ** (e.exp % 2))
    return sympy.expand(made)


def _is_root(e: Sympy) -> bool:
    return bool(e.is_Pow and e.exp.is_Rational and e.exp.q == 2 and e.free_symbols)


def length(value: Sympy) -> int:
    """Return how many signs an expression has."""
    return int(value.count_ops())


def _root(base: Sympy, power: Sympy, positive: frozenset[Sympy]) -> Sympy:
    """Return a power of the square root of an expression, the squares in it taken out."""
    if base.count_ops() > _LONG:
        return sympy.sqrt(base) ** power
    every = {one for way in _ways(base) for one in written_by(base, way)}
    made = [_taken_out(one, power, positive) for one in sorted(every, key=str)]
    return min((sympy.sqrt(base) ** power, *made), key=length)


def _taken_out(base: Sympy, power: Sympy, positive: frozenset[Sympy]) -> Sympy:
    try:
        coefficient, *factors = sympy.Mul.make_args(sympy.factor(base))
    except sympy.PolynomialError:
        return sympy.sqrt(base) ** power
    outside = inside = sympy.Integer(1)
    for one in (coefficient, *factors):
        bottom, exponent = one.as_base_exp()
        if not exponent.is_Integer or (bottom.is_number and not bottom.is_Rational):
            inside *= one
            continue
        if bottom.is_number and bottom.is_positive:
            outside *= sympy.sqrt(bottom) ** (exponent * power)
            continue
        whole = sympy.Integer(int(exponent) // 2 if exponent > 0 else -(int(-exponent) // 2))
        bars = bottom if is_positive(bottom, positive) else -bottom if is_positive(-bottom, positive) else abs(bottom)
        outside *= bars ** (whole * power)
        inside *= bottom ** (exponent - 2 * whole)
    return outside * sympy.sqrt(inside) ** power


def is_positive(value: Sympy, positive: Iterable[Sympy]) -> bool:
    """Return whether an expression is never negative, where others are positive and all symbols are real."""
    known = set(positive)
    if value in known or value.is_nonnegative:
        return True
    waves = {one: sympy.Dummy() for one in value.atoms(sympy.sin, sympy.cos)}
    high = {one: 1 + sympy.Dummy(nonnegative=True) for one in value.atoms(sympy.cosh)}
    made = value.xreplace({**waves, **high})
    if any(made.diff(one, 2) != 0 for one in waves.values()):
        return False
    real = {one: sympy.Dummy(positive=True) if one in known else sympy.Dummy(real=True) for one in value.free_symbols}
    ends = product((sympy.Integer(-1), sympy.Integer(1)), repeat=len(waves))
    at_ends = (made.xreplace({**dict(zip(waves.values(), end, strict=True)), **real}) for end in ends)
    return all(sympy.expand(one).is_nonnegative for one in at_ends)
