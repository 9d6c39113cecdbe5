"""Functions of time that a person gives: their values and derivatives at the nodes of a quadrature."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError, suggestion
from atwood.late import dataclass
from atwood.theory.hamiltonian.arguments import as_expression

__all__ = ["Nodes", "curves_at", "panels"]

COUNT = 12
"""Points of Gauss and Legendre between two edges."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Points of Gauss and Legendre between edges.

    Attributes
    ----------
    edges
        Between which functions are smooth, s.
    times
        The points, shape (edges - 1, points).
    """

    edges: FloatArray
    times: FloatArray

    def integral(self, values: FloatArray) -> float:
        """Return the integral of what has these values at the points, of any shape with as many of them."""
        weights = legendre.leggauss(self.times.shape[1])[1]
        return float(np.sum(0.5 * np.diff(self.edges)[:, None] * weights * values.reshape(self.times.shape)))

    def derivative(self, values: FloatArray) -> FloatArray:
        """Return the derivative of the polynomials that have these values at the points between two edges."""
        count = self.times.shape[1]
        points, weights = legendre.leggauss(count)
        table = legendre.legvander(points, count - 1)
        to_coefficients = (np.arange(count) + 0.5)[:, None] * (table * weights[:, None]).T
        slopes = legendre.legval(points, legendre.legder(np.eye(count))).T
        matrix = slopes @ to_coefficients
        return np.asarray((values.reshape(self.times.shape) @ matrix.T) * (2.0 / np.diff(self.edges))[:, None])

    def derivative_at_ends(self, values: FloatArray) -> FloatArray:
        """Return the derivatives of the first and the last of these polynomials at the ends."""
        count = self.times.shape[1]
        points, weights = legendre.leggauss(count)
        rows = values.reshape(self.times.shape)[[0, -1]]
        series = (rows * weights) @ legendre.legvander(points, count - 1) * (np.arange(count) + 0.5)
        slopes = [legendre.legval(end, legendre.legder(one)) for end, one in zip((-1.0, 1.0), series, strict=True)]
        return np.asarray(np.array(slopes) * 2.0 / np.diff(self.edges)[[0, -1]])


def panels(edges: FloatArray) -> Nodes:
    """Return the points between edges."""
    points = legendre.leggauss(COUNT)[0]
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    return Nodes(edges, middle[:, None] + half[:, None] * points)


def curves_at(
    given: Mapping[str, Any], names: Sequence[str], nodes: Nodes, where: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values and derivatives of functions of time at points, and their values at the two ends.

    Parameters
    ----------
    given
        By path: a number, text or a sympy expression in t, or a function of an array of times.
    names
        The paths; those that are not given are zero.
    nodes
        The points.
    where
        The scene, for errors.

    Returns
    -------
    tuple
        Shapes (names, points), the same, and (names, 2).

    Raises
    ------
    UsageError
        If a path is unknown, or a function has no finite value.
    """
    for path in given:
        if path not in names:
            raise UsageError(f"{path!r} is no coordinate of it", where=where, advice=suggestion(path, list(names)))
    t, ends = nodes.times.ravel(), nodes.edges[[0, -1]]
    values, rates, at_ends = (np.zeros((len(names), size)) for size in (len(t), len(t), 2))
    for k, name in enumerate(names):
        if name not in given:
            continue
        function, derivative = _read(given[name], name)
        values[k], at_ends[k] = _called(function, t, name), _called(function, ends, name)
        rates[k] = nodes.derivative(values[k]).ravel() if derivative is None else _called(derivative, t, name)
    return values, rates, at_ends


Function = Callable[[FloatArray], Any]


def _read(given: Any, name: str) -> tuple[Function, Function | None]:
    """Return a function, and its derivative where that is known."""
    if callable(given) and not hasattr(given, "free_symbols"):
        return given, None
    import sympy

    t = sympy.Symbol("t")
    try:
        made = as_expression(given)
    except Exception:  # text is read as Python
        made = None
    if made is None or not made.free_symbols <= {t} or made.is_real is False:
        raise UsageError(
            f"{given!r} is no function of time", where=name, advice="Write it in t, as 'sin(2*t)', or give a function."
        )
    return sympy.lambdify(t, made, "numpy"), sympy.lambdify(t, made.diff(t), "numpy")


def _called(function: Function, t: FloatArray, name: str) -> FloatArray:
    try:
        found = np.asarray(function(t), dtype=float)
    except AtwoodError:
        raise
    except Exception as error:  # a function of somebody else
        advice = "Give a function of an array of times, in seconds, that returns as many numbers."
        raise UsageError(f"it fails: {type(error).__name__}: {error}", where=name, advice=advice) from error
    try:
        found = np.broadcast_to(found, t.shape)
    except ValueError:
        advice = "Give a function of an array of times that returns as many numbers."
        raise UsageError(f"gives {found.shape} values for {t.shape} times", where=name, advice=advice) from None
    if not np.all(np.isfinite(found)):
        raise UsageError(f"has no finite value at t = {t[~np.isfinite(found)][0]:.6g}", where=name)
    return found
