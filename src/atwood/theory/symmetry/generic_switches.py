"""Expressions in which nothing is left to the clock or to a switch: for what must hold whatever these do.

Numbers at a few states say nothing of a push that acts for a tenth of a second, or of a stop that nothing touches. So
what depends on time alone becomes a symbol that may have any value, and so does the choice of each switch, and each
function that can be as good as zero nearly everywhere. What switches alike, or is the same function of equal numbers,
has equal values: two stops on both sides of a mass that is in the middle belong together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.expr import Expression, Graph, InputGroup, OutputGroup, Program
from atwood.expr.core import algebra
from atwood.expr.core.relations import TimeRelations
from atwood.late import dataclass

__all__ = ["Loosened", "loosen"]


_COMPARISONS = ("less", "less_equal")
_CONDITIONS = (*_COMPARISONS, "logical_and", "logical_or", "logical_not")
_SWITCHES = (*_COMPARISONS, "sign", "absolute", "minimum", "maximum")
_EVEN, _ODD = ("exp", "cosh"), ("sinh", "tanh")

_ALIKE = 1e-9
"""Numbers that switch something are equal if they are this near, relative to the largest of them."""


@dataclass(frozen=True)
class Loosened:
    """A program in which what the clock and switches decide are parameters.

    Attributes
    ----------
    program
        The program; the further parameters are its last ones: those of the clock, of switches, of functions.
    probe
        Program of the same inputs that says what those of the clock are, and by which numbers the others are decided.
    conditions
        Which of those of the clock are conditions, 0 or 1.
    odd
        Which of those of functions have the sign of their argument.
    """

    program: Program
    probe: Program
    conditions: BoolArray
    odd: BoolArray

    @property
    def is_plain(self) -> bool:
        """Whether neither the clock nor a switch nor such a function decides anything."""
        return not self.probe.results

    def choose(self, probed: Sequence[FloatArray], random: np.random.Generator, number: int) -> FloatArray:
        """Return values of the further parameters.

        Parameters
        ----------
        probed
            What the probe says at the state.
        random
            Where chances come from.
        number
            Of the sample: in the first all switches are on one side, in the second on the other.
        """
        at, sides, arguments = (np.asarray(one, dtype=float) for one in probed)
        # What is zero now may not be at another time.
        clock = np.where(at == 0.0, random.uniform(-1.0, 1.0, len(at)), at * random.uniform(0.5, 1.5, len(at)))
        clock[self.conditions] = random.integers(0, 2, np.count_nonzero(self.conditions))
        chosen = _alike(sides, lambda: float(random.choice([-1.0, 1.0])) if number > 1 else 1.0 - 2.0 * number)
        chosen[sides == 0.0] = 0.0
        functions = _alike(np.abs(arguments), lambda: float(random.uniform(0.5, 1.5)))
        functions = np.where(self.odd, np.sign(arguments) * functions, functions)
        return np.concatenate([clock, chosen, functions])


def _alike(keys: FloatArray, draw: Callable[[], float]) -> FloatArray:
    """Return a value drawn for each number, the same for numbers that are equal."""
    found = np.zeros(len(keys))
    near = _ALIKE * float(np.max(np.abs(keys), initial=0.0))
    last = -np.inf
    value = 0.0
    for i in np.argsort(keys):
        if keys[i] - last > near:
            value = draw()
        last = keys[i]
        found[i] = value
    return found


def loosen(program: Program, relations: TimeRelations, moving: Collection[Expression]) -> Loosened:
    """Return a program in which what the clock and switches decide are parameters.

    Parameters
    ----------
    program
        The program.
    relations
        Time, and the relations of functions of time.
    moving
        The symbols of the state, and of what follows from it.
    """
    maker = _Maker(program.graph, relations)
    nodes = program.nodes
    by_clock, by_motion = _followers(nodes, relations.roots), _followers(nodes, moving)

    def taken(node: Expression) -> Expression:
        if node.index in by_motion or node.index not in by_clock:
            return maker.made.get(node.index, node)
        return maker.by_clock(node)

    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        if node.index not in by_motion or not node.arguments:
            continue
        if node.operation == "component":
            maker.made[node.index] = unknowns[node.arguments[0].index][node.payload]
            continue
        arguments = [taken(one) for one in node.arguments]
        if node.operation == "solve":
            split = node.payload**2
            unknowns[node.index] = algebra.solve(arguments[:split], arguments[split:])
            continue
        maker.made[node.index] = maker.rebuilt(node, arguments)
    outputs = tuple(OutputGroup(name, tuple(taken(one) for one in found)) for name, found in program.outputs)
    return maker.finish(program, outputs)


def _followers(nodes: Sequence[Expression], roots: Collection[Expression]) -> set[int]:
    found = {one.index for one in roots}
    for node in nodes:
        if any(argument.index in found for argument in node.arguments):
            found.add(node.index)
    return found


class _Maker:
    """Puts symbols in the place of what is decided, and notes what decides it."""

    def __init__(self, graph: Graph, relations: TimeRelations) -> None:
        self.graph = graph
        self._relations = {one.symbol: one.kind for one in relations.found}
        self.made: dict[int, Expression] = {}
        self._clock: dict[Expression, Expression] = {}
        self._sides: list[tuple[Expression, Expression]] = []
        self._functions: list[tuple[Expression, Expression, bool]] = []

    def by_clock(self, node: Expression) -> Expression:
        """Return what stands for a function of time alone."""
        if node not in self._clock:
            self._clock[node] = self.graph.symbol(f"clock:{len(self._clock)}")
        return self._clock[node]

    def _side(self, node: Expression) -> Expression:
        """Return what stands for the side on which a switch is, -1 or 1; 0 where it is on the very edge."""
        first = node.arguments[0]
        key = first if len(node.arguments) == 1 else first - node.arguments[1]
        self._sides.append((key, self.graph.symbol(f"side:{len(self._sides)}")))
        return self._sides[-1][1]

    def rebuilt(self, node: Expression, arguments: list[Expression]) -> Expression:
        """Return a node of the state on other arguments; what is decided there is a symbol."""
        if node.operation in _EVEN or node.operation in _ODD:
            symbol = self.graph.symbol(f"function:{len(self._functions)}")
            self._functions.append((node.arguments[0], symbol, node.operation in _ODD))
            return symbol
        if node.operation not in _SWITCHES:
            return algebra.build(self.graph, node.operation, arguments, node.payload)
        side = self._side(node)
        if node.operation == "sign":
            return side
        if node.operation == "absolute":
            return side * arguments[0]
        if node.operation in _COMPARISONS:
            return algebra.less(self.graph.zero, side)
        return algebra.select(algebra.less(self.graph.zero, side), arguments[0], arguments[1])

    def _is_condition(self, node: Expression) -> bool:
        return node.operation in _CONDITIONS or self._relations.get(node, "sign") != "sign"

    def finish(self, program: Program, outputs: tuple[OutputGroup, ...]) -> Loosened:
        """Return the programs."""
        symbols = (*self._clock.values(), *(one for _, one in self._sides), *(one for _, one, _ in self._functions))
        keys = (
            OutputGroup("clock", tuple(self._clock)),
            OutputGroup("sides", tuple(key for key, _ in self._sides)),
            OutputGroup("arguments", tuple(argument for argument, _, _ in self._functions)),
        )
        inputs: tuple[InputGroup, ...] = program.inputs
        return Loosened(
            Program(f"{program.name}, loosened", inputs, (*program.parameters, *symbols), outputs),
            Program(f"{program.name}, probed", inputs, program.parameters, keys),
            np.array([self._is_condition(one) for one in self._clock], dtype=bool),
            np.array([is_odd for _, _, is_odd in self._functions], dtype=bool),
        )
