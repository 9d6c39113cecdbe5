"""Formulas in text, where a quantity may stand in their place: ``"0.5*t^2"`` and ``"30 cm"``."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

from atwood.arguments import show
from atwood.errors import AtwoodError, ParameterError, near_matches, suggestion
from atwood.expr.core import functions
from atwood.model.values.units import Unit, parse_quantity, parse_unit, split_quantity, unit_of

__all__ = ["read_text", "unknown_name"]

_NAMES: Mapping[str, Any] = {
    "pi": math.pi,
    "abs": functions.absolute,
    "min": functions.minimum,
    "max": functions.maximum,
    **{
        name: getattr(functions, name)
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt"),
            *("hypot", "absolute", "minimum", "maximum", "sign", "floor", "select"),
        )
    },
}
_OPERATORS: Mapping[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def read_text(text: str, symbols: Mapping[str, Any], unit: Unit, where: str) -> Any:
    """Return the value of a formula, or of a quantity, which has no operator between its number and its unit.

    Parameters
    ----------
    text
        The formula or the quantity.
    symbols
        The arguments of the formula, by name.
    unit
        The unit that a quantity is asked for in, and that a formula is in.
    where
        The path that an error names.

    Raises
    ------
    ParameterError
        If it is neither, or reads what is no argument; or if it could be both: the unit of a quantity is an argument.
    """
    tree, split = _parsed(text), split_quantity(text)
    if tree is not None:
        try:
            return _value_of(tree, symbols, where)
        except ParameterError as error:
            if split is None or _unit_in(split[1]) is None:
                raise
            raise _two_ways(text, error.message, symbols, unit, where) from None
    if split is None:
        advice = f"Write it as '0.5*{next(iter(symbols))}**2', with {', '.join(symbols)}, pi and functions such as sin."
        raise ParameterError(f"{show(text)} is no formula", where=where, advice=advice)
    if split[1].startswith(("*", "/", "·")) or set(_WORDS.findall(split[1])) & set(symbols):
        raise _two_ways(text, f"{show(text)} is no formula, and no number with a unit", symbols, unit, where)
    return parse_quantity(text, unit, where)


def _parsed(text: str) -> ast.expr | None:
    """Return the tree of a formula; None if it is none, as a quantity is."""
    try:
        tree = ast.parse(text.strip().replace("^", "**").replace("·", "*"), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        return None
    return None if isinstance(tree, ast.Constant) and isinstance(tree.value, complex) else tree  # 5J is five joules


def _unit_in(text: str) -> Unit | None:
    """Return the unit that stands behind a number, maybe after an operator; None if there is none."""
    try:
        return parse_unit(text)
    except AtwoodError:
        return None


def _two_ways(text: str, problem: str, symbols: Mapping[str, Any], unit: Unit, where: str) -> ParameterError:
    """Return the error about text that is neither a formula nor a quantity, with how each is written."""
    number, unit_text = split_quantity(text) or (0.0, "")
    words = set(_WORDS.findall(unit_text))
    behind, given = unit_text.lstrip("*· "), _unit_in(unit_text)
    if given is None or not given.has_dimension_of(unit):
        quantity = f"'{number:g} {'m' if unit.text in ('1', 'any') else unit.text}'"
    elif words & set(symbols):
        quantity = f"'{number * given.factor:g} {unit_of(given.exponents).text}'"
    else:
        quantity = f"'{number:g} {'1' if behind.startswith('/') else ''}{behind}'"
    formula = f"{number:g}*{behind}" if words <= {*symbols, *_NAMES} else f"{number:g}*{next(iter(symbols))}"
    return ParameterError(problem, where=where, advice=f"Write '{formula}' for a formula, {quantity} for a quantity.")


_WORDS = re.compile("[A-Za-z_][A-Za-z_0-9]*")


def unknown_name(name: str, symbols: Mapping[str, Any], where: str) -> ParameterError:
    """Return the error about a name in a formula that is no argument of it.

    Parameters
    ----------
    name
        The name.
    symbols
        The arguments.
    where
        The path of the parameter.
    """
    known = [*symbols, *_NAMES]
    advice = suggestion(name, known) if near_matches(name, known) else f"It is a function of {', '.join(symbols)}."
    return ParameterError(f"the formula reads {name!r}, which is no argument of it", where=where, advice=advice)


def _value_of(node: ast.expr, symbols: Mapping[str, Any], where: str) -> Any:
    """Return the value of a formula; nothing in it is run that is not arithmetic."""

    def value(one: ast.expr) -> Any:
        return _value_of(one, symbols, where)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name):
        if node.id in symbols:
            return symbols[node.id]
        if node.id != "pi":
            raise unknown_name(node.id, symbols, where)
        return math.pi
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](value(node.left), value(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](value(node.operand))
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _OPERATORS:
        return _OPERATORS[type(node.ops[0])](value(node.left), value(node.comparators[0]))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in _NAMES or node.func.id == "pi":
            raise unknown_name(node.func.id, symbols, where)
        return _NAMES[node.func.id](*map(value, node.args))
    raise ParameterError(f"{ast.unparse(node)!r} has no place in a formula", where=where, advice=_ARITHMETIC)


_ARITHMETIC = "It has numbers (1.5, with a point), its arguments, + - * / **, brackets and functions such as sin."
