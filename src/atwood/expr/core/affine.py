"""Expressions that are affine in some of their symbols."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from atwood.expr.core.analysis import dependents, live, substitute, varying
from atwood.expr.core.derivatives import jacobian
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import PIECEWISE_CONSTANT


def affine_coefficients(
    expression: Expression, variables: Sequence[Expression], parameters: Collection[Expression]
) -> tuple[list[Expression], Expression] | None:
    """Write an expression as a sum of coefficients times variables, plus a remainder.

    Parameters
    ----------
    expression
        The expression to take apart.
    variables
        The symbols it may be affine in.
    parameters
        Symbols that coefficients may depend on.

    Returns
    -------
    tuple or None
        The coefficients in the order of the variables, which depend on constants and parameters only, and the
        remainder, which depends on none of the variables.  ``None`` if the expression has no such form.
    """
    nodes = live([expression])
    active = dependents(nodes, variables)
    if any(node.operation in PIECEWISE_CONSTANT and node.index in active for node in nodes):
        return None
    coefficients = [expression.graph.zero] * len(variables)
    derivative = jacobian([expression], variables)
    for column, entry in zip(derivative.columns, derivative.entries, strict=True):
        coefficients[column] = entry
    slopes = live(coefficients)
    if varying(slopes, parameters) & {coefficient.index for coefficient in coefficients}:
        return None
    [remainder] = substitute([expression], dict.fromkeys(variables, 0.0))
    return coefficients, remainder
