"""Formulas as Python code."""

from __future__ import annotations

import keyword
from fractions import Fraction
from math import isqrt

from atwood.theory.formulas.lines import quotient, signed_sum
from atwood.theory.formulas.tree import Call, Name, Node, Number, Symbol, Term

_ENDS = ("", "_dot", "_ddot", "_dddot")
_BINARY = {"less": "<", "less_equal": "<=", "logical_and": "and", "logical_or": "or", "pow": "**"}
_NAMES = {"absolute": "abs", "minimum": "min", "maximum": "max"}


MATH = (
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "exp",
    "log",
    "sinh",
    "cosh",
    "tanh",
    "sqrt",
    "floor",
    "pi",
)
"""The names of `math` that formulas use."""

KNOWN = frozenset({*MATH, *_BINARY, *_NAMES, "select", "logical_not", "sign", "component"})
"""The functions that can be written down."""


RESERVED = frozenset(
    {"t", "y", "q", "u", "a", "np", "solve", "rates", "mass_matrix", "bias", "constraints", "constraint_jacobian"}
    | {"constraint_bias", "accelerations", "derivative", "M", "G", "RANK", *MATH, *_NAMES.values()}
)
"""Names that mean something else in a module; a symbol that is called so has a line after its name."""


def identifier(symbol: Symbol, dots: int = 0) -> str:
    """Return a symbol as a name of Python."""
    name = "".join(one if one.isalnum() or one == "_" else "_" for one in symbol.name) + _ENDS[dots]
    taken = keyword.iskeyword(name) or (name in RESERVED and symbol.kind != "time")
    return f"{name}_" if taken else name


def formula(node: Node) -> str:
    """Return a formula as an expression of Python with the functions of `math`."""
    if isinstance(node, Name):
        return identifier(node.symbol, node.dots)
    if isinstance(node, Call):
        return _call(node)
    return signed_sum(node.terms, _term) or "0.0"


def _term(term: Term) -> str:
    return quotient(term, _number, _power, times=" * ")


def _number(value: Number) -> str:
    if isinstance(value, Fraction):
        size = abs(value)
        return f"{size.numerator}.0" if size.denominator == 1 else f"({size.numerator} / {size.denominator})"
    return repr(abs(value))


def _power(node: Node, power: Fraction) -> str:
    if power == Fraction(1, 2):
        return f"sqrt({formula(node)})"
    text = formula(node)
    if not isinstance(node, Name) and not (isinstance(node, Call) and node.function not in _BINARY):
        text = f"({text})"
    if power == 1:
        return text
    return f"{text} ** {power}" if power.denominator == 1 else f"{text} ** ({power})"


def _call(node: Call) -> str:
    arguments = [formula(one) for one in node.arguments]
    if node.function in _BINARY:
        return f"({arguments[0]}) {_BINARY[node.function]} ({arguments[1]})"
    if node.function == "select":
        return f"({arguments[1]} if {arguments[0]} else {arguments[2]})"
    if node.function == "logical_not":
        return f"not ({arguments[0]})"
    if node.function == "sign":
        return f"(({arguments[0]} > 0.0) - ({arguments[0]} < 0.0))"
    if node.function == "component":
        size = isqrt(len(arguments) - 1)
        matrix, right = ", ".join(arguments[: size * size]), ", ".join(arguments[size * size : -1])
        return f"solve(np.reshape([{matrix}], ({size}, {size})), [{right}])[int({arguments[-1]})]"
    return f"{_NAMES.get(node.function, node.function)}({', '.join(arguments)})"
