"""Logarithmic derivatives of what outgrows all numbers, so that a quotient by it has derivatives where it is zero."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping

from atwood.expr.core.algebra import unary
from atwood.expr.core.arithmetic import add, divide, multiply, negate, subtract
from atwood.expr.core.graph import Expression

__all__ = ["hand_back_quotient", "logarithmic_slopes", "tangent_of_quotient"]

Slopes = list[tuple[Expression, Expression]]


def logarithmic_slopes(d: Expression, kept: Container[int]) -> Slopes | None:
    """Return expressions and factors with which the sum of ``factor * derivative`` is the derivative of ``log(d)``.

    An exponential, a hyperbolic cosine, their products, and their sums with what depends on parameters alone have
    factors that stay finite where they themselves do not. None for all else.

    Parameters
    ----------
    d
        What a quotient is divided by.
    kept
        Numbers of expressions that are independent, whatever they are made of.
    """
    if d.index in kept or d.is_parametric:
        return None
    if d.operation == "exp":
        return [(d.arguments[0], d.graph.one)]
    if d.operation == "cosh":
        return [(d.arguments[0], unary("tanh", d.arguments[0]))]
    if d.operation == "mul":
        found: Slopes = []
        for one in d.arguments:
            slopes = [] if one.is_parametric else logarithmic_slopes(one, kept)
            if slopes is None:
                return None
            found += slopes
        return found
    if d.operation == "add" and d.arguments[0].is_parametric != d.arguments[1].is_parametric:
        fixed, moving = d.arguments if d.arguments[0].is_parametric else d.arguments[::-1]
        slopes = logarithmic_slopes(moving, kept)
        share = subtract(d.graph.one, divide(fixed, d))
        return None if slopes is None else [(one, multiply(share, factor)) for one, factor in slopes]
    return None


def tangent_of_quotient(n: Expression, slopes: Slopes, tangents: Mapping[int, Expression]) -> Expression:
    """Return the derivative of a quotient from those slopes of its divisor.

    Parameters
    ----------
    n
        The quotient.
    slopes
        See `logarithmic_slopes`.
    tangents
        Derivatives by the numbers of expressions; others have none.
    """
    a, d = n.arguments
    total = zero = n.graph.zero
    for one, factor in slopes:
        total = add(total, multiply(factor, tangents.get(one.index, zero)))
    return subtract(divide(tangents.get(a.index, zero), d), multiply(n, total))


def hand_back_quotient(
    n: Expression, slopes: Slopes, weight: Expression, hand_back: Callable[[Expression, Expression], None]
) -> None:
    """Hand the weight of a quotient back to what it is made of.

    Parameters
    ----------
    n, slopes
        See `tangent_of_quotient`.
    weight
        Its weight.
    hand_back
        Takes an expression and what is added to its weight.
    """
    hand_back(n.arguments[0], divide(weight, n.arguments[1]))
    for one, factor in slopes:
        hand_back(one, negate(multiply(multiply(factor, weight), n)))
