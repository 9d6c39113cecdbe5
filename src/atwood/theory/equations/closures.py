"""Closed loops solved in closed form, where one would by hand: one unknown after the other.

An unknown that is linear is solved for; an angle in ``A cos + B sin + C = 0`` is ``atan2(B, A) +- acos(-C/sqrt(A^2 +
B^2))``; of two angles in two equations that are linear in the sine and cosine of one, these are solved for, and their
squares, whose sum is one, leave an equation in the other (as Freudenstein's of the four-bar linkage).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, TypeAlias

__all__ = ["solve_closures"]

Sympy: TypeAlias = Any
"""A sympy object."""

_LONGEST = 250
"""Equations of more operations are not looked at: nobody would solve them by hand."""


def solve_closures(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of closed loops, one for each way in which they can be put together.

    Parameters
    ----------
    equations
        What is zero.
    unknowns
        As many coordinates.

    Returns
    -------
    list
        What each unknown is, in terms of the coordinates that are left; None if there is no closed form of this kind.
    """
    if not unknowns:
        return [{}] if not equations else None
    for size, solve in ((1, _alone), (2, _pair)):
        for chosen in combinations(equations, size):
            inside = [one for one in unknowns if any(equation.has(one) for equation in chosen)]
            if len(inside) == size:
                found = solve(chosen, inside)
                if found is not None:
                    rest = [one for one in equations if one not in chosen]
                    return _with_rest(found, rest, [one for one in unknowns if one not in inside])
    return None


def _with_rest(
    ways: Sequence[dict[Sympy, Sympy]], rest: Sequence[Sympy], others: Sequence[Sympy]
) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of what is left for each way of putting together what was solved."""
    inner = solve_closures(rest, others)  # in terms of what was solved, whichever way
    if inner is None:
        return None
    return [{**way, **{k: v.xreplace(way) for k, v in one.items()}} for way in ways for one in inner]


def _alone(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of one equation in one unknown."""
    (equation,), (unknown,) = equations, unknowns
    values = _values(equation, unknown)
    return None if values is None else [{unknown: one} for one in values]


def _values(equation: Sympy, unknown: Sympy) -> list[Sympy] | None:
    """Return the values of the only unknown of an equation."""
    import sympy

    parts = _linear(equation, unknown)
    if parts is not None:
        a, b, c = parts
        if a == 0 and b == 0:
            return None
        turn, reach = sympy.atan2(b, a), sympy.acos(-c / sympy.sqrt(a**2 + b**2))
        return [turn + reach, turn - reach]
    slope = sympy.diff(equation, unknown)
    if slope.has(unknown) or slope == 0:
        return None
    return [sympy.expand(-equation.subs(unknown, 0) / slope)]


def _linear(equation: Sympy, angle: Sympy) -> tuple[Sympy, Sympy, Sympy] | None:
    """Return A, B and C of ``A cos + B sin + C``, if an equation is that in an angle."""
    import sympy

    if equation.count_ops() > _LONGEST:
        return None
    c, s = sympy.Dummy("c"), sympy.Dummy("s")
    written = sympy.expand(sympy.expand_trig(equation)).subs({sympy.cos(angle): c, sympy.sin(angle): s})
    written = sympy.expand(sympy.expand(written).subs(s**2, 1 - c**2))
    if written.has(angle) or not written.has(c, s):
        return None
    a, b = written.diff(c), written.diff(s)
    if a.has(c, s) or b.has(c, s):
        return None
    return a, b, sympy.expand(written - a * c - b * s)


def _pair(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of two equations in two unknowns."""
    import sympy

    for angle, other in (tuple(unknowns), tuple(unknowns)[::-1]):
        parts = [_linear(one, angle) for one in equations]
        if parts[0] is None or parts[1] is None:
            continue
        (a1, b1, c1), (a2, b2, c2) = parts[0], parts[1]
        measure = sympy.expand(a1 * b2 - a2 * b1)
        if measure == 0 or measure.has(other):
            continue
        cosine, sine = (b1 * c2 - b2 * c1) / measure, (a2 * c1 - a1 * c2) / measure
        closing = sympy.expand((b1 * c2 - b2 * c1) ** 2 + (a2 * c1 - a1 * c2) ** 2 - measure**2)
        values = _values(closing, other)
        if values is not None:
            return [{other: one, angle: sympy.atan2(sine, cosine).subs(other, one)} for one in values]
    return None
