"""Formulas as sympy objects; sympy is imported when one is made."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from math import isqrt
from typing import Any, TypeAlias

from atwood.analysis.formulas.tree import Call, Name, Node, Number, Symbol, Term

__all__ = ["Sympy", "derivative", "formula", "symbol_of"]

Sympy: TypeAlias = Any
"""A sympy object."""

_NAMES: Mapping[str, str] = {"absolute": "Abs", "minimum": "Min", "maximum": "Max"}


def symbol_of(symbol: Symbol) -> Sympy:
    """Return a symbol; what moves is a function of time, so that it can be differentiated, without assumptions."""
    import sympy

    if symbol.letter == "pi" and symbol.kind == "time":
        return sympy.pi
    return sympy.Function(symbol.name)(sympy.Symbol("t")) if symbol.moves else sympy.Symbol(symbol.name)


@lru_cache(maxsize=4096)
def derivative(symbol: Symbol, dots: int) -> Sympy:
    """Return a symbol or one of its derivatives by time."""
    import sympy

    made = symbol_of(symbol)
    return sympy.Derivative(made, (sympy.Symbol("t"), dots)) if dots else made


def formula(node: Node) -> Sympy:
    """Return a formula as a sympy expression."""
    import sympy

    if isinstance(node, Name):
        return derivative(node.symbol, node.dots)
    if isinstance(node, Call):
        return _call(node)
    return sympy.Add(*map(_term, node.terms))


def _term(term: Term) -> Sympy:
    import sympy

    powers = [formula(node) ** _number(power) for node, power in term.factors]
    return sympy.Mul(_number(term.number), *powers)


def _number(value: Number) -> Sympy:
    import sympy

    if isinstance(value, Fraction):
        return sympy.Rational(value.numerator, value.denominator)
    return sympy.Float(value)


def _call(node: Call) -> Sympy:
    import sympy

    name, arguments = node.function, [formula(one) for one in node.arguments]
    if name == "component":
        size = isqrt(len(arguments) - 1)
        unknowns = sympy.Matrix(size, size, arguments[: size * size]).LUsolve(sympy.Matrix(arguments[size * size : -1]))
        return unknowns[int(arguments[-1])]
    if name == "select":
        condition = arguments[0]
        if not isinstance(condition, sympy.logic.boolalg.Boolean):
            condition = sympy.Ne(condition, 0)
        return sympy.Piecewise((arguments[1], condition), (arguments[2], True))
    relations = {"less": sympy.Lt, "less_equal": sympy.Le, "pow": sympy.Pow}
    relations |= {"logical_and": sympy.And, "logical_or": sympy.Or, "logical_not": sympy.Not}
    if name in relations:
        return relations[name](*arguments)
    made = getattr(sympy, _NAMES.get(name, name), None)
    return (made or sympy.Function(name))(*arguments)
