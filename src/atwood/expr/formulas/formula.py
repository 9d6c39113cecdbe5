"""Formulas given in sympy, as functions that a law can call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood.arguments import check, each, instance, takes_names
from atwood.display import fitted
from atwood.errors import AtwoodError
from atwood.expr.core import algebra
from atwood.expr.core.analysis import evaluate, live
from atwood.expr.core.functions import Scalar, graph_of
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.formulas.sympy_bridge import from_sympy
from atwood.lazy_modules import sympy


class Formula:
    """A function that evaluates a sympy expression on numbers, on expressions and on sympy terms.

    Made by `formula`.
    """

    def __init__(self, expression: Any, arguments: Sequence[Any]) -> None:
        self.expression = check(instance("an expression of sympy", sympy.Expr), expression, "expression", "formula")
        symbols = each(instance("a symbol", sympy.Symbol), "the symbols of the formula, each a sympy.Symbol")
        self.arguments = check(symbols, arguments, "arguments", "formula")
        graph = Graph()
        self._symbols = [graph.symbol(str(argument)) for argument in self.arguments]
        self._value = graph.convert(
            from_sympy(expression, graph, dict(zip(self.arguments, self._symbols, strict=True)))
        )
        self._nodes = live([self._value])
        stray = [n.name for n in self._nodes if n.is_symbol and n not in self._symbols]
        if stray:
            raise AtwoodError(
                f"the formula {expression} holds {', '.join(stray)}, which is none of its arguments",
                advice="List every symbol of the formula as an argument.",
            )

    def __repr__(self) -> str:
        return fitted(f"<Formula of {', '.join(map(str, self.arguments))}: {self.expression}>")

    def __call__(self, *values: Scalar) -> Scalar:
        """Return the value of the formula."""
        if len(values) != len(self.arguments):
            raise AtwoodError(f"the formula {self.expression} takes {len(self.arguments)} arguments, not {len(values)}")
        graph = graph_of(*values)
        if graph is not None:
            return self._rebuilt(graph, values)
        if all(isinstance(value, (int, float)) for value in values):
            return evaluate([self._value], dict(zip(self._symbols, map(float, values), strict=True)))[0]
        return self.expression.subs(dict(zip(self.arguments, values, strict=True)), simultaneous=True)

    def _rebuilt(self, graph: Graph, values: Sequence[Scalar]) -> Expression:
        made = {symbol: graph.convert(value) for symbol, value in zip(self._symbols, values, strict=True)}
        for node in self._nodes:
            if node.is_constant:
                made[node] = graph.constant(node.value)
            elif node not in made:
                made[node] = algebra.build(graph, node.operation, [made[a] for a in node.arguments], node.payload)
        return made[self._value]


@takes_names
def formula(expression: Any, arguments: Sequence[Any]) -> Formula:
    """Turn a sympy expression into a function that works in a law.

    Parameters
    ----------
    expression
        A ``sympy.Expr``.
    arguments
        Its symbols, in the order in which the function takes their values.

    Raises
    ------
    AtwoodError
        If it holds a symbol that is not among the arguments, or a function that Atwood does not know.
    """
    return Formula(expression, arguments)
