"""Formulas as sympy objects; sympy is imported when one is made."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from math import isqrt
from typing import Any, TypeAlias

from atwood.lazy_modules import sympy
from atwood.theory.formulas.tree import Call, Name, Node, Number, Symbol, Term

Sympy: TypeAlias = Any
"""A sympy object."""

_NAMES: Mapping[str, str] = {"absolute": "Abs", "minimum": "Min", "maximum": "Max"}


def symbol_of(symbol: Symbol) -> Sympy:
    """Return a symbol; what moves is a function of time, so that it can be differentiated, without assumptions."""
    if symbol.letter == "pi" and symbol.kind == "time":
        return sympy.pi
    return sympy.Function(symbol.name)(sympy.Symbol("t")) if symbol.moves else sympy.Symbol(symbol.name)


@lru_cache(maxsize=4096)
def derivative(symbol: Symbol, dots: int) -> Sympy:
    """Return a symbol or one of its derivatives by time."""
    made = symbol_of(symbol)
    return sympy.Derivative(made, (sympy.Symbol("t"), dots)) if dots else made


def formula(node: Node) -> Sympy:
    """Return a formula as a sympy expression."""
    if isinstance(node, Name):
        return derivative(node.symbol, node.dots)
    if isinstance(node, Call):
        return _call(node)
    return sympy.Add(*map(_term, node.terms))


def _term(term: Term) -> Sympy:
    powers = [_value(formula(node)) ** _number(power) for node, power in term.factors]
    return sympy.Mul(_number(term.number), *powers)


def _number(value: Number) -> Sympy:
    if isinstance(value, Fraction):
        return sympy.Rational(value.numerator, value.denominator)
    return sympy.Float(value)


def _call(node: Call) -> Sympy:
    name, arguments = node.function, [formula(one) for one in node.arguments]
    if name == "component":
        size = isqrt(len(arguments) - 1)
        unknowns = sympy.Matrix(size, size, arguments[: size * size]).LUsolve(sympy.Matrix(arguments[size * size : -1]))
        return unknowns[int(arguments[-1])]
    if name == "select":
        return sympy.Piecewise((_value(arguments[1]), _condition(arguments[0])), (_value(arguments[2]), True))
    if name in ("logical_and", "logical_or", "logical_not"):
        made = {"logical_and": sympy.And, "logical_or": sympy.Or, "logical_not": sympy.Not}[name]
        return made(*map(_condition, arguments))
    relations = {"less": sympy.Lt, "less_equal": sympy.Le, "pow": sympy.Pow}
    function = relations.get(name) or getattr(sympy, _NAMES.get(name, name), None) or sympy.Function(name)
    return function(*map(_value, arguments))


def _value(item: Sympy) -> Sympy:
    """Return a condition as 1 or 0, other things as they are."""
    return sympy.Piecewise((1, item), (0, True)) if _is_condition(item) else item


def _condition(item: Sympy) -> Sympy:
    """Return a number as the condition that it is not zero, conditions as they are."""
    return item if _is_condition(item) else sympy.Ne(item, 0)


def _is_condition(item: Sympy) -> bool:
    return isinstance(item, sympy.logic.boolalg.Boolean) and not isinstance(item, sympy.Symbol)
