"""Formulas given in sympy, as functions that a law can call, and as expressions of a graph.

sympy is imported when one of these functions is called, not before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, TypeAlias

from atwood.arguments import check, each, instance, takes_names
from atwood.display import fitted
from atwood.errors import AtwoodError
from atwood.expr.core import algebra
from atwood.expr.core.analysis import evaluate, live
from atwood.expr.core.functions import Scalar
from atwood.expr.core.graph import Expression, Graph, graph_of
from atwood.expr.core.operations import ExternalFunction
from atwood.lazy_modules import sympy

SympyExpression: TypeAlias = Any
"""A ``sympy.Expr``."""

_FROM_SYMPY_UNARY = {"Abs": "absolute"} | {
    name: name
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh", "sign", "floor")
}


def from_sympy(
    expression: SympyExpression,
    graph: Graph,
    mapping: Mapping[SympyExpression | str, Expression | float] | None = None,
    functions: Mapping[str, ExternalFunction] | None = None,
) -> Expression:
    """Return a sympy expression as an expression of a graph."""
    known: dict[SympyExpression, Expression] = {}
    names: dict[str, Expression] = {}
    for key, value in (mapping or {}).items():
        if isinstance(key, str):
            names[key] = graph.convert(value)
        else:
            known[key] = graph.convert(value)
    start = sympy.sympify(expression)
    stack = [(start, False)]
    while stack:
        item, ready = stack.pop()
        if item in known:
            continue
        if ready or not item.args:
            known[item] = _read(item, graph, known, names, functions or {})
        else:
            stack.append((item, True))
            stack.extend((child, False) for child in _children(item))
    return known[start]


def _read(
    item: SympyExpression,
    graph: Graph,
    known: Mapping[SympyExpression, Expression],
    names: Mapping[str, Expression],
    functions: Mapping[str, ExternalFunction],
) -> Expression:
    """Return one sympy node from the expressions of its arguments."""
    if item.is_Symbol:
        return names[item.name] if item.name in names else graph.symbol(item.name)
    if item in (True, False):
        return graph.constant(1.0 if item else 0.0)
    if getattr(item, "is_number", False) and not item.args:
        return graph.constant(float(item))
    name = item.func.__name__
    if name == "Piecewise":
        return _read_piecewise(item, graph, known)
    arguments = [known[argument] for argument in item.args]
    if name == "Mul":
        return _read_product(item, graph, known)
    if name == "Add":
        return reduce(algebra.add, arguments)
    if name == "Pow":
        return algebra.power(*arguments)
    if name in _FROM_SYMPY_UNARY and len(arguments) == 1:
        return algebra.unary(_FROM_SYMPY_UNARY[name], arguments[0])
    if name in ("Min", "Max"):
        operation = "minimum" if name == "Min" else "maximum"
        return reduce(lambda a, b: algebra.binary(operation, a, b), arguments)
    if name in _SPECIAL:
        return _SPECIAL[name](graph, arguments)
    if name in functions:
        return algebra.external(functions[name], arguments)
    raise AtwoodError(
        f"the sympy function {name} has no counterpart in a program",
        where=str(item)[:80],
        advice="Rewrite it with other functions, or give an ExternalFunction for it.",
    )


def _read_product(item: SympyExpression, graph: Graph, known: Mapping[SympyExpression, Expression]) -> Expression:
    """Return a product as one numerator over one denominator."""
    above, below = graph.one, graph.one
    for factor in item.args:
        if factor.is_Pow and factor.exp.is_number and factor.exp.is_negative and factor.base in known:
            below = algebra.multiply(below, algebra.power(known[factor.base], graph.constant(-float(factor.exp))))
        else:
            above = algebra.multiply(above, known[factor])
    return algebra.divide(above, below)


def _children(item: SympyExpression) -> list[SympyExpression]:
    """Return what must be translated first; a Piecewise is taken apart into its values and conditions."""
    if item.func.__name__ == "Piecewise":
        return [part for pair in item.args for part in pair.args]
    return list(item.args)


def _read_piecewise(item: SympyExpression, graph: Graph, known: Mapping[SympyExpression, Expression]) -> Expression:
    result = graph.constant(math.nan)
    for value, condition in reversed(item.args):
        result = algebra.select(known[condition], known[value], result)
    return result


def _equal(a: Expression, b: Expression) -> Expression:
    return algebra.logical("logical_and", algebra.less_equal(a, b), algebra.less_equal(b, a))


_SPECIAL: dict[str, Callable[[Graph, list[Expression]], Expression]] = {
    "atan2": lambda g, a: algebra.binary("atan2", a[0], a[1]),
    "cot": lambda g, a: algebra.divide(g.one, algebra.unary("tan", a[0])),
    "sec": lambda g, a: algebra.divide(g.one, algebra.unary("cos", a[0])),
    "csc": lambda g, a: algebra.divide(g.one, algebra.unary("sin", a[0])),
    "Heaviside": lambda g, a: algebra.multiply(g.constant(0.5), algebra.add(g.one, algebra.unary("sign", a[0]))),
    "StrictLessThan": lambda g, a: algebra.less(a[0], a[1]),
    "LessThan": lambda g, a: algebra.less_equal(a[0], a[1]),
    "StrictGreaterThan": lambda g, a: algebra.less(a[1], a[0]),
    "GreaterThan": lambda g, a: algebra.less_equal(a[1], a[0]),
    "Equality": lambda g, a: _equal(a[0], a[1]),
    "Unequality": lambda g, a: algebra.unary("logical_not", _equal(a[0], a[1])),
    "And": lambda g, a: reduce(lambda p, q: algebra.logical("logical_and", p, q), a),
    "Or": lambda g, a: reduce(lambda p, q: algebra.logical("logical_or", p, q), a),
    "Not": lambda g, a: algebra.unary("logical_not", a[0]),
}


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
        algebra.rebuild(graph, self._nodes, made)
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
