"""Programs without code of their own: a program that runs but a few times is walked through, node by node.

The values are those of generated code to the bit: the same functions in the same order. To write and compile Python
takes as long as some fifteen walks.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from atwood.codegen.python.source import Flavour
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import BINARY, UNARY

WALKS = 4
"""So often a program is walked through before it is compiled."""

LONG, LONG_WALKS = 5000, 12
"""Programs of so many nodes are walked through more often: to compile them takes long, and a second run need not."""

_INFIX: Mapping[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
}
_ON_FLOATS: Mapping[str, Callable[..., Any]] = {**UNARY, **BINARY, "select": lambda c, a, b: a if c != 0.0 else b}
_ON_ARRAYS: Mapping[str, Callable[..., Any]] = {
    **_INFIX,
    "minimum": lambda a, b: np.where(a <= b, a, b),
    "maximum": lambda a, b: np.where(a >= b, a, b),
    "select": lambda c, a, b: np.where(c != 0.0, a, b),
    "less": lambda a, b: np.where(a < b, 1.0, 0.0),
    "less_equal": lambda a, b: np.where(a <= b, 1.0, 0.0),
    "logical_and": lambda a, b: np.where(np.logical_and(a != 0.0, b != 0.0), 1.0, 0.0),
    "logical_or": lambda a, b: np.where(np.logical_or(a != 0.0, b != 0.0), 1.0, 0.0),
    "logical_not": lambda a: np.where(a != 0.0, 0.0, 1.0),
}


def operations_of(flavour: Flavour, names: Mapping[str, Any]) -> dict[str, Callable[..., Any]]:
    """Return what each operation does to values, from what the names in generated code of a flavour mean."""
    if flavour == "vectorized":
        return {**names, **_ON_ARRAYS}
    return {**_ON_FLOATS, **(_INFIX if flavour == "fast" else {}), **names}


def walk(
    nodes: Iterable[Expression], values: dict[int, Any], operations: Mapping[str, Callable[..., Any]]
) -> dict[int, Any]:
    """Return the values of nodes, arguments before users, by index; those that are known stay as they are."""
    for node in nodes:
        if node.index in values:
            continue
        operation, arguments = node.operation, node.arguments
        if len(arguments) == 2 and operation != "external":
            a, b = arguments
            values[node.index] = operations[operation](values[a.index], values[b.index])
        elif operation == "constant":
            values[node.index] = node.payload
        elif operation == "component":
            values[node.index] = values[arguments[0].index][node.payload]
        elif operation == "solve":
            data, split = [values[one.index] for one in arguments], node.payload**2
            values[node.index] = operations["solve"](node.payload, data[:split], data[split:])
        else:
            values[node.index] = operations[operation](*[values[one.index] for one in arguments])
    return values
