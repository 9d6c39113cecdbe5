"""Relations of functions of time alone, which keep their values between two time events.

A law that reads ``select(t < 1, a, b)`` is smooth before and after its switch, and a solver that works across it errs
by what it missed. So such a relation is taken out of the equations while they are read and a symbol stands for it,
which programs have among their parameters: a run stops where the relation changes, and goes on with another value.
That is what Modelica calls a time event (Modelica Language Specification, section 8.5).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from atwood.expr.core import algebra
from atwood.expr.core.analysis import evaluate, live, substitute
from atwood.expr.core.derivatives import jvp
from atwood.expr.core.graph import Expression
from atwood.expr.core.intervals import bounds

_KNOWN, _TIMED, _MOVING, _OTHER = 0, 1, 2, 3

_ORDERS = 6
"""So many derivatives say on which side of zero a function is just after it was there."""


class Relation(NamedTuple):
    """A relation of functions of time alone.

    Attributes
    ----------
    symbol
        What stands for it in the equations.
    kind
        ``"less"``, ``"less_equal"`` or ``"nonzero"``, true (1) or not (0), ``"sign"`` (-1, 0 or 1), or ``"floor"``, the
        largest whole number that is not above.
    difference
        What is compared with zero, or rounded down; it may read relations that were found before.
    zero
        What passes zero where the relation changes.
    """

    symbol: Expression
    kind: str
    difference: Expression
    zero: Expression


class TimeRelations:
    """The relations of functions of time alone that the laws of one graph have.

    Parameters
    ----------
    time
        The symbol of time.

    Attributes
    ----------
    found
        The relations, each after those that it reads.
    """

    what = "relation"
    """Names its symbols."""

    def __init__(self, time: Expression) -> None:
        self.time = time
        self.found: list[Relation] = []
        self._symbols: dict[tuple[str, Expression], Expression] = {}
        self._kinds: dict[int, int] = {time.index: _TIMED}
        self._else = _MOVING
        self._is_reading = False

    @contextmanager
    def reading(self, is_reading: bool = True) -> Iterator[None]:
        """Take up relations while laws that make motions are read; what is only shown is evaluated as it stands."""
        before, self._is_reading = self._is_reading, is_reading
        try:
            yield
        finally:
            self._is_reading = before

    @property
    def symbols(self) -> tuple[Expression, ...]:
        """What stands for the relations."""
        return tuple(one.symbol for one in self.found)

    @property
    def roots(self) -> tuple[Expression, ...]:
        """All that makes an expression change with time: time itself, and what stands for relations."""
        return (self.time, *self.symbols)

    def has(self, expression: Expression) -> bool:
        """Return whether an expression stands for a relation."""
        return expression.is_symbol and self._kinds.get(expression.index) == _TIMED and expression is not self.time

    def are_timed(self, *expressions: Expression | None) -> bool:
        """Return whether expressions depend on time, on nothing that moves, and are being read."""
        return self._is_reading and max(self._kind(one) for one in expressions if one is not None) == _TIMED

    def take(self, kind: str, difference: Expression) -> Expression:
        """Return what stands for a relation, the same for the same one; a constant if it is always the same."""
        if difference.is_constant:
            return difference.graph.constant(relation_value(kind, difference.value))
        if kind == "nonzero" and difference in self._symbols.values():
            return difference
        key = (kind, difference)
        if key not in self._symbols:
            graph, zero = difference.graph, difference
            if kind == "floor":
                zero = algebra.unary("sin", algebra.multiply(graph.constant(math.pi), difference))
            symbol = graph.symbol(f"{self.what} {len(self.found)}")
            # Making nodes may end with `TimeIsUp`: so it is known only once it is found, too.
            self._symbols[key] = symbol
            self._kinds[symbol.index] = _TIMED
            self.found.append(Relation(symbol, kind, difference, zero))
        return self._symbols[key]

    def _kind(self, expression: Expression) -> int:
        """Return whether an expression depends on parameters alone, on time besides, or on what moves."""
        kinds, stack = self._kinds, [expression]
        while stack:
            node = stack[-1]
            waiting = [one for one in node.arguments if one.index not in kinds]
            if node.index not in kinds and not waiting:
                own = self._else if node.is_symbol and not node.is_parametric else _KNOWN
                kinds[node.index] = max((kinds[one.index] for one in node.arguments), default=own)
            if not waiting:
                stack.pop()
            stack += waiting
        return kinds[expression.index]


class MotionRelations(TimeRelations):
    """The relations of what moves that equations have, taken out while the equations are written anew.

    Each keeps its value in a piece of the motion, until its difference passes zero. What depends on accelerations or
    multipliers is left as it stands.

    Parameters
    ----------
    relations
        Those of functions of time alone.
    moving
        The symbols of coordinates and speeds in whose terms differences are wanted.
    left
        Numbers of the relations that stay in the laws.
    layered
        Whether a sign that stays changes within a layer: its symbol is then one over the layer's width.
    """

    what = "side"

    def __init__(
        self,
        relations: TimeRelations,
        moving: Iterable[Expression],
        left: Collection[int] = (),
        layered: bool = False,
    ) -> None:
        super().__init__(relations.time)
        self._before, self._else = relations, _OTHER
        self._kinds |= {one.index: _TIMED for one in relations.symbols}
        self._kinds |= {one.index: _MOVING for one in moving}
        self._left, self._layered = left, layered
        self._places: Mapping[Expression, Expression] = {}
        self._is_closed = False

    def are_timed(self, *expressions: Expression | None) -> bool:
        """Return whether expressions depend on coordinates or speeds."""
        return max(self._kind(one) for one in expressions if one is not None) == _MOVING

    def take(self, kind: str, difference: Expression) -> Expression:
        """Return what stands for a relation; on which side equal numbers are is decided by what comes after."""
        if kind == "nonzero":  # of numbers that are no conditions, and are hardly ever zero
            return difference
        kind, graph = "less" if kind == "less_equal" else kind, difference.graph
        (placed,) = substitute([difference], self._places) if self._places else (difference,)
        as_it_stands = graph.node(kind, (difference, graph.zero) if kind == "less" else (difference,))
        if self._is_closed and (kind, placed) not in self._symbols:
            return as_it_stands
        symbol = super().take(kind, placed)
        if symbol.is_constant or int(symbol.name.split()[1]) not in self._left:
            return symbol
        if kind == "sign" and self._layered:
            inner = graph.node("minimum", (algebra.multiply(difference, symbol), graph.one))
            return graph.node("maximum", (inner, algebra.negate(graph.one)))
        return as_it_stands

    def taken_out(
        self, values: Sequence[Expression], places: Mapping[Expression, Expression], is_closed: bool = False
    ) -> list[Expression]:
        """Return expressions with what stands for their relations."""
        self._kinds |= {one.index: _MOVING for one in places}
        graph, again = self.time.graph, [one for one in live(values) if one.operation in _COMPARING]
        again = [one for one in again if self.are_timed(*one.arguments)]
        if not again:
            return list(values)
        self._places, self._is_closed, graph.relations = places, is_closed, self
        try:
            return substitute(values, {}, again)
        finally:
            graph.relations = self._before


_COMPARING = frozenset({"less", "less_equal", "sign", "absolute", "minimum", "maximum", "floor"})


def relation_value(kind: str, difference: float) -> float:
    """Return the value of a relation: 0 or 1, or a sign."""
    return _VALUES[kind](difference)


_VALUES: Mapping[str, Callable[[float], float]] = {
    "less": lambda d: float(d < 0.0),
    "less_equal": lambda d: float(d <= 0.0),
    "nonzero": lambda d: float(d != 0.0),
    "sign": lambda d: float(np.sign(d)),
    "floor": lambda d: float(np.floor(d)),
}


def values_just_after(relations: Sequence[Relation], known: Mapping[Expression, float], t: float) -> tuple[float, ...]:
    """Return the values of relations just after a time, also where some of them change at that very time."""
    if not relations:
        return ()
    relations_of = relations[0].symbol.graph.relations
    assert relations_of is not None
    values: dict[Expression, float] = {**known, relations_of.time: t}
    for one in relations:
        if one.kind == "floor":
            nearest = float(np.round(evaluate([one.difference], values)[0]))
            is_below = _side_after(one.difference - nearest, values, relations_of.time) < 0.0
            values[one.symbol] = nearest - 1.0 if is_below else nearest
            continue
        values[one.symbol] = relation_value(one.kind, _side_after(one.difference, values, relations_of.time))
    return tuple(values[one.symbol] for one in relations)


def _side_after(difference: Expression, values: Mapping[Expression, float], time: Expression) -> float:
    """Return a number with the sign that a function of time has just after a time; 0 where it stays zero."""
    nodes = live([difference])
    points = {one: (np.array([values[one]]), np.array([values[one]])) for one in nodes if one in values}
    if any(node.operation == "external" for node in nodes):  # it has no bounds, and maybe no derivatives
        return evaluate([difference], values)[0]
    derivative = difference
    for _ in range(_ORDERS):
        ((low, high),) = bounds([derivative], points)
        if low[0] > 0.0 or high[0] < 0.0:
            return float(low[0]) if low[0] > 0.0 else float(high[0])
        (derivative,) = jvp([derivative], {time: 1.0})
        if derivative.is_zero:
            break
    return evaluate([difference], values)[0] if derivative is not difference and not derivative.is_zero else 0.0
