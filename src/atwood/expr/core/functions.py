"""Mathematical functions of numbers, arrays, expressions and sympy objects alike.

A law written with these works on floats (for a quick look), on numpy arrays (elementwise), on
:class:`~atwood.expr.core.graph.Expression` (to be compiled) and on sympy objects (to be read).
"""

from __future__ import annotations

import math
import numbers
import sys
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from atwood.arguments import Kind, Refused, check, each, show, takes
from atwood.errors import AtwoodError, KernelEvaluationError, UsageError
from atwood.expr.core import algebra
from atwood.expr.core.elementary import ON_ARRAYS, ON_FLOATS, STRICT
from atwood.expr.core.graph import Expression, Graph, graph_of
from atwood.expr.core.operations import ExternalFunction, floor as _floor_of_float, sign as _sign_of_float, solve_floats
from atwood.lazy_modules import sympy

Scalar: TypeAlias = Any
"""A ``float``, an :class:`Expression`, or a ``sympy.Expr``: what laws compute with."""


def _is_sympy(value: object) -> bool:
    """Return whether a value is a sympy object, without importing sympy."""
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, (sympy.Basic, sympy.MatrixBase))


def is_scalar(value: object) -> bool:
    """Return whether laws compute with a value: a number, an expression, a sympy term, an array of these."""
    if isinstance(value, (Expression, float, int, np.floating, np.integer)):
        return not isinstance(value, bool)
    if hasattr(type(value), "__array__"):
        value = np.asarray(value)
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fiu" or (value.dtype == object and all(map(is_scalar, value.flat)))
    return _is_sympy(value) or isinstance(value, numbers.Real)


SCALAR = Kind("a number, or an expression", lambda value: value if is_scalar(value) else _refuse())


def _refuse() -> Any:
    raise Refused


def _checked(function: str, **values: Scalar) -> None:
    """Refuse what a function has no value of at all; values that are plain numbers need not come here."""
    for name, value in values.items():
        check(SCALAR, value, name, function)


def _unary(operation: str, x: Scalar, on_float: Callable[[float], float], sympy_name: str = "") -> Scalar:
    if isinstance(x, Expression):
        return algebra.unary(operation, x)
    if isinstance(x, (float, int)):
        try:
            return on_float(x)
        except (ValueError, OverflowError):
            raise KernelEvaluationError(
                f"it has no value at x = {x!r}", where=operation, advice="Give a number in its domain."
            ) from None
    _checked(operation, x=x)
    if _is_sympy(x):
        return getattr(sympy, sympy_name or operation)(x)
    array = np.asarray(x)
    if array.dtype == object:
        return _elementwise(lambda item: _unary(operation, item, on_float, sympy_name), array)
    on_arrays: Callable[[Any], Any] = ON_ARRAYS.get(operation) or getattr(np, operation)
    return on_arrays(x)


def _elementwise(function: Callable[..., Scalar], *arrays: Any) -> Scalar:
    """Apply a function item by item to object arrays that broadcast."""
    return np.frompyfunc(function, len(arrays), 1)(*arrays)


def _operands(graph: Graph, *values: Scalar) -> list[Expression]:
    return [graph.convert(value) for value in values]


def is_zero(x: Scalar) -> bool:
    """Return whether a value is zero whatever happens: the number 0, or an expression that has folded to it."""
    return x.is_zero if isinstance(x, Expression) else bool(x == 0)


def sin(x: Scalar) -> Scalar:
    """Return the sine of an angle in radians."""
    return _unary("sin", x, STRICT["sin"])


def cos(x: Scalar) -> Scalar:
    """Return the cosine of an angle in radians."""
    return _unary("cos", x, STRICT["cos"])


def tan(x: Scalar) -> Scalar:
    """Return the tangent of an angle in radians."""
    return _unary("tan", x, STRICT["tan"])


def asin(x: Scalar) -> Scalar:
    """Return the angle in [-pi/2, pi/2] with the given sine."""
    return _unary("asin", x, STRICT["asin"])


def acos(x: Scalar) -> Scalar:
    """Return the angle in [0, pi] with the given cosine."""
    return _unary("acos", x, STRICT["acos"])


def atan(x: Scalar) -> Scalar:
    """Return the angle in (-pi/2, pi/2) with the given tangent."""
    return _unary("atan", x, STRICT["atan"])


def sqrt(x: Scalar) -> Scalar:
    """Return the square root."""
    return _unary("sqrt", x, math.sqrt)


def exp(x: Scalar) -> Scalar:
    """Return e to the power x."""
    return _unary("exp", x, STRICT["exp"])


def log(x: Scalar) -> Scalar:
    """Return the natural logarithm."""
    return _unary("log", x, STRICT["log"])


def sinh(x: Scalar) -> Scalar:
    """Return the hyperbolic sine."""
    return _unary("sinh", x, STRICT["sinh"])


def cosh(x: Scalar) -> Scalar:
    """Return the hyperbolic cosine."""
    return _unary("cosh", x, STRICT["cosh"])


def tanh(x: Scalar) -> Scalar:
    """Return the hyperbolic tangent."""
    return _unary("tanh", x, STRICT["tanh"])


def absolute(x: Scalar) -> Scalar:
    """Return the absolute value."""
    return _unary("absolute", x, abs, "Abs")


def sign(x: Scalar) -> Scalar:
    """Return -1, 0 or 1."""
    return _unary("sign", x, _sign_of_float)


def floor(x: Scalar) -> Scalar:
    """Return the largest whole number that is not above a value; ``x // y`` and ``x % y`` are written with it."""
    return _unary("floor", x, _floor_of_float)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle of the point (x, y) from the x axis, in (-pi, pi]."""
    graph = graph_of(y, x)
    if graph is not None and not _is_array(y, x):
        return algebra.binary("atan2", *_operands(graph, y, x))
    if _is_sympy(y) or _is_sympy(x):
        return sympy.atan2(y, x)
    if isinstance(y, (float, int)) and isinstance(x, (float, int)):
        return ON_FLOATS["atan2"](y, x)
    _checked("atan2", y=y, x=x)
    return _elementwise(atan2, y, x) if _holds_objects(y, x) else ON_ARRAYS["atan2"](y, x)


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """Return the smaller of two values."""
    return _extremum("minimum", "Min", a, b)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """Return the larger of two values."""
    return _extremum("maximum", "Max", a, b)


def _extremum(operation: str, sympy_name: str, a: Scalar, b: Scalar) -> Scalar:
    graph = graph_of(a, b)
    if graph is not None and not _is_array(a, b):
        return algebra.binary(operation, *_operands(graph, a, b))
    if _is_sympy(a) or _is_sympy(b):
        return getattr(sympy, sympy_name)(a, b)
    if isinstance(a, (float, int)) and isinstance(b, (float, int)):
        return min(a, b) if operation == "minimum" else max(a, b)
    _checked(operation, a=a, b=b)
    if _holds_objects(a, b):
        return _elementwise(lambda p, q: _extremum(operation, sympy_name, p, q), a, b)
    return getattr(np, operation)(a, b)


def select(condition: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """Return ``a`` where the condition holds, else ``b``.

    Parameters
    ----------
    condition
        A comparison such as ``x < 0``. One of functions of time alone is a time event: runs stop and go on there, and
        results at that very time are those after it, whichever side the comparison takes.
    a, b
        The values on either side.  In a program both are computed, and what the other branch gives outside its
        domain does no harm.
    """
    graph = graph_of(condition, a, b)
    if graph is not None and not _is_array(condition, a, b):
        return algebra.select(*_operands(graph, condition, a, b))
    if any(_is_sympy(value) for value in (condition, a, b)):
        return sympy.Piecewise((a, condition), (b, True))
    if isinstance(condition, (float, int, np.bool_)):
        return a if condition else b
    if not is_scalar(condition) and not (isinstance(condition, np.ndarray) and condition.dtype.kind == "b"):
        advice = "Give a comparison, such as x < 0."
        raise UsageError(f"condition cannot be {show(condition)}", where="select", advice=advice)
    _checked("select", a=a, b=b)
    return _elementwise(select, condition, a, b) if _holds_objects(condition, a, b) else np.where(condition, a, b)


def _is_array(*values: object) -> bool:
    return any(isinstance(value, np.ndarray) for value in values)


def _holds_objects(*values: object) -> bool:
    return any(np.asarray(value).dtype == object for value in values)


def hypot(*values: Scalar) -> Scalar:
    """Return the square root of the sum of the squares: a length from its components."""
    total: Scalar = 0.0
    for value in values:
        if not is_scalar(value):
            _checked("hypot", x=value)
        total = total + value * value
    return sqrt(total)


_ROW = each(SCALAR, "numbers or expressions")


@takes(matrix=each(_ROW, "the rows of a matrix, of numbers or expressions"), right=_ROW)
def solve(matrix: Sequence[Sequence[Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """Solve a square linear system.

    Parameters
    ----------
    matrix
        The rows of the matrix.
    right
        The right-hand side.

    Returns
    -------
    list
        The unknowns.  For expressions they are components of one ``solve`` node, so that the matrix is factored
        once, when the program runs; a system of one unknown becomes a division.
    """
    size = len(right)
    if len(matrix) != size or any(len(row) != size for row in matrix):
        raise AtwoodError(
            f"a linear system needs a square matrix and a right-hand side of the same size, here {size}",
            advice="Give as many rows, each with as many numbers, as there are unknowns.",
        )
    values = [value for row in matrix for value in row]
    graph = graph_of(*values, *right)
    if graph is not None:
        return list(algebra.solve(_operands(graph, *values), _operands(graph, *right)))
    if any(_is_sympy(value) for value in (*values, *right)):
        return list(sympy.Matrix([list(row) for row in matrix]).LUsolve(sympy.Matrix(list(right))))
    if size and not _is_array(*values, *right):
        try:
            return [*solve_floats(size, values, list(right))] if size == 1 else _solve_numbers(matrix, right)
        except (ZeroDivisionError, np.linalg.LinAlgError):
            raise AtwoodError(_SINGULAR, advice=_INDEPENDENT) from None
    try:
        return _solve_numbers(matrix, right)
    except np.linalg.LinAlgError:
        raise AtwoodError(_SINGULAR, advice=_INDEPENDENT) from None


_SINGULAR = "the matrix of a linear system is singular"
_INDEPENDENT = "Give rows of which none follows from the others."


def _solve_numbers(matrix: Sequence[Sequence[Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """Solve one system of floats, or many at once whose entries are arrays of samples."""
    if not len(right):
        return []
    *flat, _ = np.broadcast_arrays(*(value for row in matrix for value in row), *right, 0.0)
    size = len(right)
    stacked = np.stack(flat[: size * size], axis=-1)
    stacked = stacked.reshape(*stacked.shape[:-1], size, size)
    sides = np.stack(flat[size * size :], axis=-1)[..., None]
    solution = np.linalg.solve(stacked.astype(float), sides.astype(float))[..., 0]
    return [solution[..., i] if solution.ndim > 1 else float(solution[i]) for i in range(size)]


def external(function: ExternalFunction, *arguments: Scalar) -> Scalar:
    """Call a named function of floats that the graph does not look into.

    Parameters
    ----------
    function
        The function and its partial derivatives.
    *arguments
        As many values as the function takes.
    """
    if not isinstance(function, ExternalFunction):
        raise UsageError(f"function cannot be {show(function)}", where="external", advice="Give an ExternalFunction.")
    if not arguments:
        raise AtwoodError("an external function needs at least one argument", where=function.name)
    graph = graph_of(*arguments)
    if graph is not None and not _is_array(*arguments):
        return algebra.external(function, _operands(graph, *arguments))
    if any(_is_sympy(value) for value in arguments):
        return sympy.Function(function.name)(*arguments)
    if _is_array(*arguments):
        result = _elementwise(lambda *items: external(function, *items), *arguments)
        return result if graph is not None or _holds_objects(*arguments) else result.astype(float)
    return float(function.function(*(float(value) for value in arguments)))
