"""Programs in arithmetic that rounds more than the machine's: how far rounding can take what they compute.

Every operation, input and parameter is off by a few units in its last place, up or down, in some ways that are fixed
once for all. What comes out differs from way to way by what rounding could have made of it, with all cancellation
(stochastic arithmetic; Vignes, Mathematics and Computers in Simulation 35, 1993). Bounds that are carried along each
operation say the same for one sum, and grow without need from rotation to rotation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr.core import elementary
from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression

WAYS = 8
"""In how many ways everything is rounded."""

ROUGHNESS = 2.0**-48
"""By how much each operation is off, relative to what it gives: 16 times the machine's own rounding."""


_KEPT = 1000
"""The factors of so many values at most are kept."""


def _logical(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *values: np.asarray(function(*values), dtype=float)


_EXACT: dict[str, Callable[..., Any]] = {
    "neg": np.negative,
    "absolute": np.absolute,
    "sign": np.sign,
    "floor": np.floor,
    "less": _logical(np.less),
    "less_equal": _logical(np.less_equal),
    "logical_and": _logical(np.logical_and),
    "logical_or": _logical(np.logical_or),
    "logical_not": _logical(np.logical_not),
    "minimum": np.minimum,
    "maximum": np.maximum,
    "select": lambda condition, a, b: np.where(condition != 0.0, a, b),
}
"""Operations that do not round."""

_ROUNDED: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "sqrt": np.sqrt,
    **elementary.ON_ARRAYS,
}

ON_ARRAYS = {**_EXACT, **_ROUNDED}
"""Operations on arrays, entry by entry."""


def roughly(count: int, start: int = 0) -> FloatArray:
    """Return factors next to one, up or down, shape (count, `WAYS`): the same ones each time, not to be changed."""
    return _kept_factors(count, start) if count <= _KEPT else _factors(count, start)


def _factors(count: int, start: int) -> FloatArray:
    numbers = np.arange(start + 1, start + count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    bits = (numbers[:, None] >> np.arange(40, 40 + WAYS, dtype=np.uint64)) & np.uint64(1)
    found: FloatArray = 1.0 + ROUGHNESS * (2.0 * bits.astype(float) - 1.0)
    found.flags.writeable = False
    return found


_kept_factors = lru_cache(maxsize=128)(_factors)


class RoughProgram:
    """Expressions in rough arithmetic.

    Parameters
    ----------
    symbols
        What they depend on: the parameters, and groups of inputs, one after the other or with the place of each.
    results
        The expressions.
    nodes
        What is live in them, where that is known.
    """

    def __init__(
        self,
        symbols: Sequence[Sequence[Expression] | Mapping[Expression, int]],
        results: Sequence[Expression],
        nodes: Sequence[Expression] | None = None,
    ) -> None:
        nodes = live(results) if nodes is None else nodes
        read = [node for node in nodes if node.operation == "symbol"]
        place = {node.index: i for i, node in enumerate(nodes)}
        self._count = len(nodes)
        self._constants = [(place[n.index], float(n.payload)) for n in nodes if n.operation == "constant"]
        self._rounded = {i for i, value in self._constants if not (2.0 * value).is_integer()}
        self._groups = [
            [(place[one.index], group[one]) for one in read if one in group]
            if isinstance(group, Mapping)
            else [(place[one.index], k) for k, one in enumerate(group) if one.index in place]
            for group in symbols
        ]
        self._steps = [
            (place[node.index], *_function_of(node), [place[argument.index] for argument in node.arguments])
            for node in nodes
            if node.operation not in ("constant", "symbol")
        ]
        self._results = [place[result.index] for result in results]

    def __call__(self, parameters: FloatArray, *groups: FloatArray) -> FloatArray:
        """Return the results, shape (results, `WAYS`); not finite where there is no value."""
        factors = roughly(self._count)
        values: list[Any] = [None] * self._count
        for place, value in self._constants:
            values[place] = value * factors[place] if place in self._rounded else value
        for symbols, given in zip(self._groups, (parameters, *groups), strict=True):
            for place, k in symbols:
                values[place] = given[k] if given is not parameters else given[k] * factors[place]
        with np.errstate(all="ignore"):
            for place, function, is_exact, arguments in self._steps:
                found = function(*[values[i] for i in arguments])
                values[place] = found if is_exact else found * factors[place]
        filled = np.empty((len(self._results), WAYS))
        for row, place in enumerate(self._results):
            filled[row] = values[place]
        return filled


def _function_of(node: Expression) -> tuple[Callable[..., Any], bool]:
    """Return what computes a node from its arguments, and whether it does not round."""
    if node.operation in _EXACT:
        return _EXACT[node.operation], True
    if node.operation in _ROUNDED:
        return _ROUNDED[node.operation], False
    if node.operation == "solve":
        size = node.payload
        return lambda *values: _solve(size, values), True
    if node.operation == "component":
        number = node.payload
        return lambda solved: solved[number], False
    call = np.vectorize(node.payload.function, otypes=[float])
    return lambda *values: call(*values), False


def _solve(size: int, values: Sequence[Any]) -> FloatArray:
    """Return the solutions of linear systems, shape (size, `WAYS`); not finite where a matrix is singular."""
    filled = np.array([np.broadcast_to(value, (WAYS,)) for value in values])
    matrices = filled[: size * size].T.reshape(WAYS, size, size)
    try:
        return np.asarray(np.linalg.solve(matrices, filled[size * size :].T[:, :, None])[:, :, 0].T)
    except np.linalg.LinAlgError:
        return np.full((size, WAYS), np.nan)
