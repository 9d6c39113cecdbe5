"""Interval arithmetic on the expression graph: within which bounds a value stays for all values of its symbols.

Bounds are rounded outwards by more than the functions of NumPy err, so that what is excluded cannot be (Moore,
Kearfott and Cloud, Introduction to Interval Analysis, chapters 2 to 5). Many boxes are done at once, as arrays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression

Bounds = tuple[FloatArray, FloatArray]
"""Lower and upper bounds."""

_ROUND, _TINY = 2.0**-51, 1e-300
"""By twice what an operation may round bounds are moved outwards, and by what numbers without full digits may."""


def bounds(outputs: Sequence[Expression], values: Mapping[Expression, Bounds]) -> list[Bounds]:
    """Return bounds of expressions; infinite where nothing is known of them."""
    known: dict[int, Bounds] = {symbol.index: given for symbol, given in values.items()}
    with np.errstate(all="ignore"):
        for node in live(outputs):
            if node.index not in known:
                known[node.index] = _sure(_of(node, [known[one.index] for one in node.arguments]))
    return [known[output.index] for output in outputs]


def _sure(given: Bounds) -> Bounds:
    """Return bounds of which none is missing."""
    low, high = given
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)


def _of(node: Expression, data: Sequence[Bounds]) -> Bounds:
    operation = node.operation
    if operation == "constant":
        return np.array([node.value]), np.array([node.value])
    if operation in _EXACT:
        return _EXACT[operation](*data)
    if operation == "mul" and node.arguments[0] is node.arguments[1]:
        return _rounded(_square(data[0]))
    if operation in _INEXACT:
        return _rounded(_INEXACT[operation](*data))
    return _NOTHING_KNOWN


_NOTHING_KNOWN = (np.array([-np.inf]), np.array([np.inf]))


def _rounded(given: Bounds) -> Bounds:
    low, high = given
    return low - _ROUND * np.abs(low) - _TINY, high + _ROUND * np.abs(high) + _TINY


def _corners(function: Callable[[FloatArray, FloatArray], FloatArray], a: Bounds, b: Bounds) -> Bounds:
    found = [function(x, y) for x in a for y in b]
    return np.minimum.reduce(found), np.maximum.reduce(found)


def _product(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((x == 0.0) | (y == 0.0), 0.0, x * y)


def _divided(a: Bounds, b: Bounds) -> Bounds:
    low, high = _corners(np.divide, a, b)
    open_ = (b[0] <= 0.0) & (b[1] >= 0.0)
    return np.where(open_, -np.inf, low), np.where(open_, np.inf, high)


def _square(a: Bounds) -> Bounds:
    low, high = _magnitude(a)
    return low**2, high**2


def _magnitude(a: Bounds) -> Bounds:
    low, high = np.abs(a[0]), np.abs(a[1])
    through = (a[0] <= 0.0) & (a[1] >= 0.0)
    return np.where(through, 0.0, np.minimum(low, high)), np.maximum(low, high)


def _rising(function: Callable[[FloatArray], FloatArray]) -> Callable[[Bounds], Bounds]:
    return lambda a: (function(a[0]), function(a[1]))


def _falling(function: Callable[[FloatArray], FloatArray]) -> Callable[[Bounds], Bounds]:
    return lambda a: (function(a[1]), function(a[0]))


def _reaches(a: Bounds, phase: float, period: float) -> NDArray[np.bool_]:
    """Return whether an interval reaches any of ``phase + k period``, as far as rounding tells."""
    slack = 8.0 * _ROUND * (1.0 + np.maximum(np.abs(a[0]), np.abs(a[1])))
    first = np.ceil((a[0] - slack - phase) / period)
    return (phase + first * period <= a[1] + slack) | ~np.isfinite(a[0] + a[1])


def _wave(function: Callable[[FloatArray], FloatArray], top: float) -> Callable[[Bounds], Bounds]:
    def of(a: Bounds) -> Bounds:
        x, y = function(a[0]), function(a[1])
        low = np.where(_reaches(a, top + math.pi, 2.0 * math.pi), -1.0, np.fmin(x, y))
        return low, np.where(_reaches(a, top, 2.0 * math.pi), 1.0, np.fmax(x, y))

    return of


def _tangent(a: Bounds) -> Bounds:
    has_pole = _reaches(a, 0.5 * math.pi, math.pi)
    return np.where(has_pole, -np.inf, np.tan(a[0])), np.where(has_pole, np.inf, np.tan(a[1]))


def _hyperbolic_cosine(a: Bounds) -> Bounds:
    low, high = _magnitude(a)
    return np.cosh(low), np.cosh(high)


def _power(a: Bounds, b: Bounds) -> Bounds:
    low, high = _corners(np.power, a, b)
    defined = a[0] >= 0.0
    return np.where(defined, low, -np.inf), np.where(defined, high, np.inf)


def _turn(y: Bounds, x: Bounds) -> Bounds:
    low, high = _corners(np.arctan2, y, x)
    comes_round = (x[0] <= 0.0) & (y[0] <= 0.0) & (y[1] >= 0.0) & (y[0] < y[1])  # not where y is zero exactly
    return np.where(comes_round, -math.pi, low), np.where(comes_round, math.pi, high)


def _chosen(condition: Bounds, a: Bounds, b: Bounds) -> Bounds:
    never = (condition[0] == 0.0) & (condition[1] == 0.0)
    always = (condition[0] > 0.0) | (condition[1] < 0.0)
    low = np.where(never, b[0], np.where(always, a[0], np.minimum(a[0], b[0])))
    return low, np.where(never, b[1], np.where(always, a[1], np.maximum(a[1], b[1])))


def _truth(always: NDArray[np.bool_], never: NDArray[np.bool_]) -> Bounds:
    return np.where(always, 1.0, 0.0), np.where(never, 0.0, 1.0)


def _is_never(a: Bounds) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = (a[0] == 0.0) & (a[1] == 0.0)
    return found


def _is_always(a: Bounds) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = (a[0] > 0.0) | (a[1] < 0.0)
    return found


_EXACT: Mapping[str, Callable[..., Bounds]] = {
    "neg": lambda a: (-a[1], -a[0]),
    "absolute": _magnitude,
    "sign": lambda a: (np.sign(a[0]), np.sign(a[1])),
    "floor": _rising(np.floor),
    "minimum": lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    "maximum": lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
    "select": _chosen,
    "less": lambda a, b: _truth(a[1] < b[0], a[0] >= b[1]),
    "less_equal": lambda a, b: _truth(a[1] <= b[0], a[0] > b[1]),
    "logical_not": lambda a: _truth(_is_never(a), _is_always(a)),
    "logical_and": lambda a, b: _truth(_is_always(a) & _is_always(b), _is_never(a) | _is_never(b)),
    "logical_or": lambda a, b: _truth(_is_always(a) | _is_always(b), _is_never(a) & _is_never(b)),
}

_INEXACT: Mapping[str, Callable[..., Bounds]] = {
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "mul": lambda a, b: _corners(_product, a, b),
    "div": _divided,
    "pow": _power,
    "atan2": _turn,
    "sqrt": lambda a: (np.sqrt(np.maximum(a[0], 0.0)), np.sqrt(a[1])),
    "sin": _wave(np.sin, 0.5 * math.pi),
    "cos": _wave(np.cos, 0.0),
    "tan": _tangent,
    "asin": _rising(lambda x: np.arcsin(np.clip(x, -1.0, 1.0))),
    "acos": _falling(lambda x: np.arccos(np.clip(x, -1.0, 1.0))),
    "atan": _rising(np.arctan),
    "exp": _rising(np.exp),
    "log": lambda a: (np.log(np.maximum(a[0], 0.0)), np.log(a[1])),
    "sinh": _rising(np.sinh),
    "cosh": _hyperbolic_cosine,
    "tanh": _rising(np.tanh),
}
