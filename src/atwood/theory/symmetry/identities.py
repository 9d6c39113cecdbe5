"""Whether an expression of the graph is zero whatever its symbols are: proven by a normal form.

The expression is written as a polynomial; divisions are cleared by what was divided by, squares of roots are what is
under the root, and sines and cosines are brought to the one form that each polynomial in them has. What is zero then is
zero identically, up to rounding of the numbers that laws and directions contain.
"""

from __future__ import annotations

from collections.abc import Collection

from atwood.expr import Expression
from atwood.expr.simplify.polynomial import (
    Atom,
    Effort,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    add_polynomials,
    expand,
    multiply_monomials,
    multiply_polynomials,
)
from atwood.expr.simplify.trigonometry import sum_of_waves, without_squares

__all__ = ["is_proven_zero"]

_TERMS, _BUDGET = 5_000, 150_000
"""Beyond so many terms, or operations on single ones, nothing is proven."""

_ROUNDS = 12
"""How often roots and divisors that stand inside each other are looked into."""


def is_proven_zero(value: Expression, angles: Collection[Expression] = ()) -> bool:
    """Return whether an expression is proven to be zero identically.

    Parameters
    ----------
    value
        The expression.
    angles
        Symbols whose sines and cosines are combined.

    Returns
    -------
    bool
        False where it is not zero, and where that is not known: it is too long, or holds functions that are related
        in ways that are not looked for.
    """
    if value.is_zero:
        return True
    try:
        expansion, inner = _expanded(value, angles)
        row = _cleared(expansion, expansion.rows[0], inner)
        for kind in ("sin", "cos"):
            row = row and without_squares(expansion, row, kind, _TERMS)
        return not row or not sum_of_waves(expansion, row, _TERMS)
    except TooLargeError:
        return False


def _expanded(value: Expression, angles: Collection[Expression]) -> tuple[Expansion, dict[Expression, Polynomial]]:
    """Return the polynomial of an expression, and those of what it divides by and of what stands under its roots."""
    inner: list[Expression] = []
    for _ in range(_ROUNDS):
        expansion = expand([value, *inner], tuple(angles), (), _TERMS, Effort(_BUDGET))  # parameters as any symbols
        asked = [one for one in map(_inside, expansion.atoms) if one is not None]
        new = [one for one in dict.fromkeys(asked) if one not in inner]
        if not new:
            return expansion, dict(zip(inner, expansion.rows[1:], strict=True))
        inner += new
    raise TooLargeError


def _inside(atom: Atom) -> Expression | None:
    """Return what an atom divides by, or has under its root."""
    if not isinstance(atom.argument, Expression):
        return None
    if atom.kind == "inverse":
        return atom.argument
    return atom.argument.arguments[0] if atom.argument.operation == "sqrt" and atom.kind == "node" else None


def _cleared(expansion: Expansion, row: Polynomial, inner: dict[Expression, Polynomial]) -> Polynomial:
    """Return a polynomial times what it divides by, without squares of roots."""
    for _ in range(4 * _ROUNDS):
        number = next((n for n, atom in enumerate(expansion.atoms) if _is_met(row, n) and _must_go(atom, row, n)), None)
        if number is None:
            return row
        atom = expansion.atoms[number]
        value = _inside(atom)
        assert value is not None
        highest = max(_power(monomial, number) for monomial in row)
        # Of an inverse, all terms are brought to its highest power; of a root, each pair is what is under it.
        power = {e: highest - e if atom.kind == "inverse" else e // 2 for e in range(highest + 1)}
        kept = {e: 0 if atom.kind == "inverse" else e % 2 for e in range(highest + 1)}
        total: Polynomial = {}
        powers = _powers(inner[value], max(power.values()))
        for e in range(highest + 1):
            own = {
                multiply_monomials(monomial, ((number, kept[e] - e),)) if kept[e] != e else monomial: coefficient
                for monomial, coefficient in row.items()
                if _power(monomial, number) == e
            }
            expansion.spend(len(own) * len(powers[power[e]]))
            total = add_polynomials(total, multiply_polynomials(own, powers[power[e]], _TERMS), 1.0)
        row = total
    raise TooLargeError


def _must_go(atom: Atom, row: Polynomial, number: int) -> bool:
    if _inside(atom) is None:
        return False
    return atom.kind == "inverse" or any(_power(monomial, number) > 1 for monomial in row)


def _is_met(row: Polynomial, number: int) -> bool:
    return any(_power(monomial, number) for monomial in row)


def _power(monomial: Monomial, number: int) -> int:
    return next((exponent for atom, exponent in monomial if atom == number), 0)


def _powers(base: Polynomial, highest: int) -> list[Polynomial]:
    found: list[Polynomial] = [{(): {(): 1.0}}]
    for _ in range(highest):
        found.append(multiply_polynomials(found[-1], base, _TERMS))
    return found
