"""The operations of the expression graph and their values on floats.

Every operation follows IEEE arithmetic: outside its domain it gives ``nan`` or an infinity and raises
nothing.  The interpreter, the folding of constants and the reference kernels all use this one table, so that
they agree on the corner cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from atwood.arguments import CALLBACK, NAME, check_fields, each, instance, optional, takes_names
from atwood.expr.core.elementary import FLOATS, ON_FLOATS
from atwood.lazy_dataclasses import dataclass

INF = math.inf
NAN = math.nan


@takes_names
@dataclass(frozen=True)
class ExternalFunction:
    """A named function of floats that the graph calls but does not look into.

    Attributes
    ----------
    name
        Identifies the function in messages, listings and digests.
    function
        Takes as many floats as the node has arguments and returns a float.
    derivatives
        The partial derivatives, one for each argument, themselves external functions of the same
        arguments.  ``None`` (as a whole, or for one argument) means "not known": differentiating
        with respect to it is an error.
    is_smooth
        Whether it is known to change smoothly, so that the error of steps sees what it does. Of any other function
        samples are taken, and a run says so.
    """

    name: str
    function: Callable[..., float]
    derivatives: tuple[ExternalFunction | None, ...] | None = None
    is_smooth: bool = False

    def __post_init__(self) -> None:
        check_fields(self, name=NAME, function=CALLBACK)
        derivatives = each(
            optional(instance("a function", ExternalFunction)), "an ExternalFunction for each argument", 1
        )
        check_fields(self, derivatives=optional(derivatives))


def divide(a: float, b: float) -> float:
    """Return ``a / b`` with the infinities and ``nan`` of IEEE arithmetic."""
    try:
        return a / b
    except ZeroDivisionError:
        if a == 0.0 or a != a:
            return NAN
        return math.copysign(INF, a) * math.copysign(1.0, b)


def sign(a: float) -> float:
    """Return -1, 0 or 1 (``nan`` for ``nan``)."""
    return 1.0 if a > 0.0 else -1.0 if a < 0.0 else a * 0.0


def floor(a: float) -> float:
    """Return the largest whole number that is not above ``a``; infinities and ``nan`` as they are."""
    return float(math.floor(a)) if math.isfinite(a) else a


def minimum(a: float, b: float) -> float:
    """Return ``a`` if ``a <= b``, else ``b``."""
    return a if a <= b else b


def maximum(a: float, b: float) -> float:
    """Return ``a`` if ``a >= b``, else ``b``."""
    return a if a >= b else b


UNARY: Mapping[str, Callable[[float], float]] = {
    "neg": lambda a: -a,
    "sqrt": FLOATS.sqrt,
    "absolute": abs,
    "sign": sign,
    "floor": floor,
    "logical_not": lambda a: 1.0 if a == 0.0 else 0.0,
    **{name: call for name, call in ON_FLOATS.items() if name not in ("atan2", "pow")},
}
"""Operations of one argument."""

BINARY: Mapping[str, Callable[[float, float], float]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": divide,
    "pow": ON_FLOATS["pow"],
    "atan2": ON_FLOATS["atan2"],
    "minimum": minimum,
    "maximum": maximum,
    "less": lambda a, b: 1.0 if a < b else 0.0,
    "less_equal": lambda a, b: 1.0 if a <= b else 0.0,
    "logical_and": lambda a, b: 1.0 if a != 0.0 and b != 0.0 else 0.0,
    "logical_or": lambda a, b: 1.0 if a != 0.0 or b != 0.0 else 0.0,
}
"""Operations of two arguments."""

LEAVES = frozenset({"constant", "symbol"})
"""Operations without arguments."""

UNCOUNTED = LEAVES | {"component"}
"""Operations that cost nothing: leaves, and picking one unknown of a linear solve."""

PIECEWISE_CONSTANT = frozenset({"sign", "floor", "less", "less_equal", "logical_and", "logical_or", "logical_not"})
"""Operations with derivative zero wherever they have one."""

COMMUTATIVE = frozenset({"add", "mul"})
"""Operations whose two arguments may be exchanged without any change of the value."""


def solve_floats(size: int, entries: Sequence[float], right: Sequence[float]) -> list[float]:
    """Solve a small dense linear system by elimination with partial pivoting."""
    rows = [[*entries[i * size : (i + 1) * size], right[i]] for i in range(size)]
    for column in range(size):
        pivot = max(range(column, size), key=lambda i: abs(rows[i][column]))
        rows[column], rows[pivot] = rows[pivot], rows[column]
        top = rows[column]
        head = top[column]
        for i in range(column + 1, size):
            row = rows[i]
            factor = row[column] / head
            if factor != 0.0:
                for j in range(column + 1, size + 1):
                    row[j] -= factor * top[j]
    result = [0.0] * size
    for i in range(size - 1, -1, -1):
        row = rows[i]
        total = row[size]
        for j in range(i + 1, size):
            total -= row[j] * result[j]
        result[i] = total / row[i]
    return result


def solve_or_nan(size: int, entries: Sequence[float], right: Sequence[float]) -> list[float]:
    """Solve a linear system, or return all ``nan`` if a pivot is exactly zero."""
    try:
        return solve_floats(size, entries, right)
    except ZeroDivisionError:
        return [NAN] * size
