"""Expressions as sums of waves in one angle or in several."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from atwood.expr import Expression, cos, jvp, sin, substitute

__all__ = ["Wave", "at", "harmonics", "sum_of_waves", "waves_of"]

Wave = tuple[Expression, Expression]
"""Real and imaginary part of the coefficient of ``exp(i (n . angles))``."""


def at(values: Sequence[Expression], place: Mapping[Expression, float]) -> list[Expression]:
    """Return values at a place."""
    return substitute(list(values), place)


def harmonics(
    values: Sequence[Expression], x: Expression
) -> tuple[list[Expression], list[Expression], list[Expression]]:
    """Return e, p and q of values that are ``e + p cos x + q sin x``."""
    first = jvp(values, {x: 1.0})
    second = at(jvp(first, {x: 1.0}), {x: 0.0})
    start = at(values, {x: 0.0})
    return [a + b for a, b in zip(start, second, strict=True)], [-b for b in second], at(first, {x: 0.0})


def waves_of(p: Expression, q: Expression, angles: Sequence[Expression]) -> dict[tuple[int, ...], Wave]:
    """Return the terms ``z exp(i (n . angles))`` of ``p + i q`` with n of -1, 0 and 1, but for those that are zero.

    Whether these are all is for the caller to see (`sum_of_waves`).
    """
    found: dict[tuple[int, ...], Wave] = {(): (p, q)}
    for angle in angles:
        e, c, s = harmonics(list(itertools.chain.from_iterable(found.values())), angle)
        more: dict[tuple[int, ...], Wave] = {}
        for k, orders in enumerate(found):
            re, im = 2 * k, 2 * k + 1
            more[*orders, 0] = e[re], e[im]
            more[*orders, 1] = 0.5 * (c[re] + s[im]), 0.5 * (c[im] - s[re])
            more[*orders, -1] = 0.5 * (c[re] - s[im]), 0.5 * (c[im] + s[re])
        found = {orders: z for orders, z in more.items() if not (z[0].is_zero and z[1].is_zero)}
    return found


def sum_of_waves(
    waves: Mapping[tuple[int, ...], Wave], angles: Sequence[Expression], zero: Expression
) -> tuple[Expression, Expression]:
    """Return p and q from their terms."""
    p = q = zero
    for orders, (re, im) in waves.items():
        turned = zero
        for angle, order in zip(angles, orders, strict=True):
            turned = turned + float(order) * angle
        c, s = cos(turned), sin(turned)
        p, q = p + re * c - im * s, q + re * s + im * c
    return p, q
