"""Roots of squares of sines in equations in Euler angles, where the middle angle leaves the sine one sign.

What lies against a plane reads how steep an axis is, ``sqrt(1 - cos^2 theta)``. Between the places at which Euler
angles are singular that is the sine itself, in whose powers everything is a polynomial that can be divided by it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from atwood.expr import Expression, cos, live, sin, substitute
from atwood.expr.simplify.collect import Emitter, sum_terms, terms_of
from atwood.expr.simplify.polynomial import (
    Atom,
    Effort,
    Expansion,
    Polynomial,
    TooLargeError,
    add_coefficient,
    expand,
    multiply_coefficients,
    multiply_monomials,
)
from atwood.expr.simplify.trigonometry import sum_of_waves
from atwood.forms.lagrangian import Lagrangian

_LIMIT, _EFFORT = 2_000, 2_000_000
"""Terms of a row, and operations on single terms."""


def middle_angles(found: Lagrangian) -> list[tuple[Expression, bool]]:
    """Return the middle one of each three Euler angles, and whether its sine is what has one sign, or its cosine."""
    chosen = [one for one in found.equations.orientation_coordinates if one.kind.startswith("euler-")]
    return [(found.coordinates[one.coordinates[1]], one.kind[-1] == one.kind[-3]) for one in chosen]


def in_whole_angles(
    rows: Sequence[Expression], angles: Collection[Expression], known: Sequence[Expression]
) -> list[Expression]:
    """Return rows with products of sines and cosines of half an angle as those of the angle.

    Parameters
    ----------
    rows
        The rows, or themselves where they are too long.
    angles, known
        The angles, and parameters.
    """
    waves = {one.arguments[0] for one in live(rows) if one.operation in ("sin", "cos")}
    halves = {one: one.graph.symbol(f"half of {one.name}") for one in angles if 0.5 * one in waves}
    if not halves:
        return list(rows)
    below = [one.arguments[1] for one in live(rows) if one.operation == "div" and not one.arguments[1].is_parametric]
    if below:
        rows = substitute(list(rows), dict(zip(below, in_whole_angles(below, angles, known), strict=True)))
    plain = substitute(list(rows), {one: 2.0 * half for one, half in halves.items()})
    try:
        made = expand(plain, [halves.get(one, one) for one in angles], known, _LIMIT, Effort(_EFFORT))
        written = _written(made, [sum_of_waves(made, row, _LIMIT) for row in made.rows])
    except TooLargeError:
        return list(rows)
    return substitute(written, {half: 0.5 * one for one, half in halves.items()})


def _written(expansion: Expansion, rows: Sequence[Polynomial], single: bool = False) -> list[Expression]:
    emitter = Emitter((*expansion.angles, *expansion.constants)[0].graph, expansion, single)
    return [sum_terms(emitter, terms_of(emitter, row), False) for row in rows]


def with_one_sign(
    values: Sequence[Expression],
    angle: Expression,
    is_sine: bool,
    angles: Collection[Expression],
    known: Sequence[Expression],
) -> list[Expression]:
    """Return values without roots of the square of a sine, or of a cosine, and without quotients that come out even.

    Parameters
    ----------
    values
        The values, or themselves where there is no such root or they are too long.
    angle, is_sine
        The angle, and whether its sine is not negative, or its cosine.
    angles, known
        What sines and cosines of sums are recognised for, and parameters.
    """
    graph, (size, other) = angle.graph, (sin, cos) if is_sine else (cos, sin)
    s, c = graph.symbol("one sign"), graph.symbol("two signs")

    def expanded(rows: Sequence[Expression]) -> list[Expression]:
        first = expand(rows, angles, known, _LIMIT, Effort(_EFFORT))
        plain = substitute(_written(first, first.rows, True), {size(angle): s, other(angle): c})
        made = expand(plain, [one for one in angles if one is not angle], [*known, s], _LIMIT, Effort(_EFFORT))
        return _written(made, [_reduced(made, row, s, c) for row in made.rows])

    try:
        roots = [one for one in live(values) if one.operation == "sqrt"]
        misses = expanded([one.arguments[0] - size(angle) * size(angle) for one in roots]) if roots else []
        even = [one for one, miss in zip(roots, misses, strict=True) if miss.is_zero]
        if not even:
            return list(values)
        by: dict[Expression, Expression | float] = {one: size(angle) for one in even}
        by |= {one.arguments[0]: size(angle) * size(angle) for one in even}
        return substitute(expanded(substitute(list(values), by)), {s: size(angle), c: other(angle)})
    except TooLargeError:
        return list(values)


def _reduced(expansion: Expansion, row: Polynomial, s: Expression, c: Expression) -> Polynomial:
    """Return a polynomial with ``c^2 = 1 - s^2``."""
    number, square = expansion.number(Atom("node", c)), ((expansion.constant_number(s), 2),)
    result: Polynomial = {}
    stack = [*row.items()]
    while stack:
        monomial, coefficient = stack.pop()
        if dict(monomial).get(number, 0) < 2:
            add_coefficient(result, monomial, coefficient)
            continue
        rest = multiply_monomials(monomial, ((number, -2),))
        stack.append((rest, multiply_coefficients(coefficient, {(): 1.0, square: -1.0})))
    return result
