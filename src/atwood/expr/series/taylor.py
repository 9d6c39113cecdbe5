"""Taylor coefficients of the solution of ``x' = f(t, x)``, from the expression graph of f.

Every value of a program is a series in time while the solution is one.  The coefficients of one order follow from
those of all lower orders by recurrences, one for each operation (`atwood.expr.series.recurrence`). What an operation
needs of lower orders is always a sum of products of the coefficients of two values,

    S_k = sum of a_j b_(k-j) for j from 1 to k - 1,

a *convolution*.  Whatever else happens at an order is straight-line arithmetic: linear in the coefficients of that
order, with factors that depend on the coefficients of order zero alone.  So the recurrences of a program are written
as two programs more, which are compiled like any other: one for the order zero, and one for all further orders, which
gets the convolutions as inputs.

Time is scaled: coefficients are those of the powers of time over a unit of the caller's choice, near the length of a
step, so that they neither overflow nor vanish.

References: A. Griewank and A. Walther, Evaluating Derivatives, 2nd edition, SIAM 2008, section 13.2; A. Jorba and
M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods, Experimental
Mathematics 14 (2005) 99-117, section 2.
"""

from __future__ import annotations

from collections.abc import Sequence

from atwood.errors import UsageError
from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.core.program import InputGroup, OutputGroup, Program
from atwood.expr.series.recurrence import Convolution, Recurrence
from atwood.lazy_dataclasses import dataclass

NUMBERS = ("order", "inverse", "step", "tick")
"""What the program of an order is told of it: k, 1/k, the unit of time over (k + 1), and the coefficient of time."""


_FEW = 2
"""So many times the lanes are few convolutions."""


@dataclass(frozen=True, eq=False)
class TaylorPrograms:
    """The recurrences of a system ``x' = f(t, x)``.

    Attributes
    ----------
    start
        Program of (t, x), with the parameters of f: the output groups are ``rates``, the values of f, and ``known``,
        the values that the other program needs as its parameters.
    order
        Program of (pairs, squares, numbers, x), whose parameters are ``known``: the convolutions of this order, the
        numbers of `NUMBERS`, and the coefficients of x.  The output groups are ``left`` and ``right``, the
        coefficients whose convolutions are the next ``pairs``, ``squares``, those convolved with themselves, and
        ``next``, the coefficients of x of the next order.
    pairs, squares
        The number of convolutions of two values and of one with itself.
    """

    start: Program
    order: Program
    pairs: int
    squares: int


def taylor_programs(
    name: str,
    time: Expression,
    states: Sequence[Expression],
    rates: Sequence[Expression],
    parameters: Sequence[Expression],
    lanes: int = 1,
) -> TaylorPrograms:
    """Return the recurrences of a system."""
    if len(rates) != len(states):
        raise UsageError(f"{len(states)} states need as many rates, not {len(rates)}", where=name)
    target = Graph()
    numbers = tuple(target.symbol(word) for word in NUMBERS)
    symbols = [target.symbol(f"x{i}") for i in range(len(states))]
    given = dict(zip(states, symbols, strict=True))
    given[time] = numbers[NUMBERS.index("tick")]
    recurrence = Recurrence(name, target, time, given, parameters, numbers[0], numbers[1])
    step = numbers[NUMBERS.index("step")]
    following = []
    for value in recurrence.series(rates):
        following.append(target.zero if value is None else step * value)
    pairs, squares = _arrange(_needed(recurrence.convolutions, following), lanes)
    inputs, outputs = _groups(pairs, squares, numbers, symbols, following)
    read = set(live(e for group in outputs for e in group.expressions))
    known = [(node, symbol) for node, symbol in recurrence.values if symbol in read]
    order = Program(f"{name} (Taylor coefficients)", inputs, tuple(symbol for _, symbol in known), outputs)
    start = Program(
        f"{name} (order zero)",
        (InputGroup("t", (time,)), InputGroup("x", tuple(states))),
        tuple(parameters),
        (OutputGroup("rates", tuple(rates)), OutputGroup("known", tuple(node for node, _ in known))),
    )
    return TaylorPrograms(start, order, len(pairs), len(squares))


def _groups(
    pairs: Sequence[Convolution],
    squares: Sequence[Convolution],
    numbers: Sequence[Expression],
    symbols: Sequence[Expression],
    following: Sequence[Expression],
) -> tuple[tuple[InputGroup, ...], tuple[OutputGroup, ...]]:
    """Return what the program of an order is given, and what it gives."""
    inputs = (
        InputGroup("pairs", tuple(one.total for one in pairs)),
        InputGroup("squares", tuple(one.total for one in squares)),
        InputGroup("numbers", tuple(numbers)),
        InputGroup("x", tuple(symbols)),
    )
    outputs = (
        OutputGroup("left", tuple(one.left for one in pairs)),
        OutputGroup("right", tuple(one.right for one in pairs)),
        OutputGroup("squares", tuple(one.left for one in squares)),
        OutputGroup("next", tuple(following)),
    )
    return inputs, outputs


def _needed(convolutions: Sequence[Convolution], outputs: Sequence[Expression]) -> list[Convolution]:
    """Return the convolutions that the outputs need, of this order or of a later one."""
    by_symbol = {one.total.index: one for one in convolutions}
    seen: set[int] = set()
    stack = list(outputs)
    while stack:
        node = stack.pop()
        if node.index in seen:
            continue
        seen.add(node.index)
        stack.extend(node.arguments)
        one = by_symbol.get(node.index)
        if one is not None:
            stack.extend((one.left, one.right))
    return [one for one in convolutions if one.total.index in seen]


def _arrange(used: Sequence[Convolution], lanes: int) -> tuple[list[Convolution], list[Convolution]]:
    """Return the convolutions of pairs and of squares, with squares in places that pairs would leave empty.

    Where there are few, those whose values are known early at an order go together, so that they need not wait for one
    that is known late; where there are many, there is enough to do meanwhile.
    """
    pairs = [one for one in used if one.left is not one.right]
    squares = [one for one in used if one.left is one.right]
    room, over = -len(pairs) % lanes, len(squares) % lanes
    if squares and over <= room:
        moved = over if over else 0
        pairs, squares = pairs + squares[len(squares) - moved :], squares[: len(squares) - moved]
    if len(used) <= _FEW * lanes:
        depths = _depths([e for one in used for e in (one.left, one.right)])
        for group in (pairs, squares):
            group.sort(key=lambda one: max(depths[one.left.index], depths[one.right.index]))
    return pairs, squares


def _depths(outputs: Sequence[Expression]) -> dict[int, int]:
    """Return how many operations are one behind the other before a value is known."""
    found: dict[int, int] = {}
    for node in live(outputs):
        known = not node.arguments or node.is_parametric
        found[node.index] = 0 if known else 1 + max(found[argument.index] for argument in node.arguments)
    return found
