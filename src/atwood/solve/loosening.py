"""Expressions in which nothing is left to the clock or to a switch: for what must hold whatever these do.

Numbers at a few states say nothing of a push that acts for a tenth of a second, or of a stop that nothing touches. So
what depends on time alone becomes a symbol that may have any value, and the choice of each switch one that is made at
random.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atwood.expr import Expression, Graph, OutputGroup, Program, algebra

__all__ = ["Loosened", "loosen"]

FloatArray = NDArray[np.float64]

_CONDITIONS = ("less", "less_equal", "logical_and", "logical_or", "logical_not")


@dataclass(frozen=True)
class Loosened:
    """A program in which what the clock and switches decide are parameters.

    Attributes
    ----------
    program
        The program; the further parameters are its last ones.
    clock
        Program of time that says what the parameters of the clock are.
    conditions
        Which of these are conditions, 0 or 1.
    switches
        How many of the further parameters are choices, -1 or 1; they come after those of the clock.
    """

    program: Program
    clock: Program
    conditions: NDArray[np.bool_]
    switches: int

    @property
    def is_plain(self) -> bool:
        """Whether neither the clock nor a switch decides anything."""
        return not self.switches and not self.clock.results

    def choose(self, at: FloatArray, random: np.random.Generator, number: int) -> FloatArray:
        """Return values of the further parameters.

        Parameters
        ----------
        at
            What the functions of time are at some time.
        random
            Where chances come from.
        number
            Of the sample: in the first, switches are as they are on one side, in the second as on the other.
        """
        near = at * random.uniform(0.5, 1.5, len(at))
        # What is zero now may not be at another time.
        clock = np.where(at == 0.0, random.uniform(-1.0, 1.0, len(at)), near)
        clock[self.conditions] = random.integers(0, 2, np.count_nonzero(self.conditions))
        sides = random.choice([-1.0, 1.0], self.switches) if number > 1 else np.full(self.switches, 1.0 - 2.0 * number)
        return np.concatenate([clock, sides])


def loosen(program: Program, time: Expression, moving: Collection[Expression]) -> Loosened:
    """Return a program in which what the clock and switches decide are parameters.

    Parameters
    ----------
    program
        The program.
    time
        The symbol of time.
    moving
        The symbols of the state, and of what follows from it.
    """
    graph, nodes = program.graph, program.nodes
    by_clock, by_motion = _followers(nodes, (time,)), _followers(nodes, moving)
    made: dict[int, Expression] = {}
    unknowns: dict[int, list[Expression]] = {}
    clock: dict[Expression, Expression] = {}
    switches: list[Expression] = []

    def taken(node: Expression) -> Expression:
        if node.index in by_motion or node.index not in by_clock:
            return made.get(node.index, node)
        if node not in clock:
            clock[node] = graph.symbol(f"clock:{len(clock)}")
        return clock[node]

    def side() -> Expression:
        switches.append(graph.symbol(f"switch:{len(switches)}"))
        return switches[-1]

    for node in nodes:
        if node.index not in by_motion or not node.arguments:
            continue
        if node.operation == "component":
            made[node.index] = unknowns[node.arguments[0].index][node.payload]
            continue
        arguments = [taken(one) for one in node.arguments]
        if node.operation == "solve":
            split = node.payload**2
            unknowns[node.index] = algebra.solve(arguments[:split], arguments[split:])
            continue
        made[node.index] = _rebuilt(graph, node, arguments, side)
    outputs = tuple(OutputGroup(name, tuple(taken(one) for one in found)) for name, found in program.outputs)
    known = (*program.parameters, *clock.values(), *switches)
    functions = OutputGroup("clock", tuple(clock))
    inputs = tuple(group for group in program.inputs if time in group.symbols)
    return Loosened(
        Program(f"{program.name}, loosened", program.inputs, known, outputs),
        Program(f"{program.name}, by the clock", inputs, program.parameters, (functions,)),
        np.array([one.operation in _CONDITIONS for one in clock], dtype=bool),
        len(switches),
    )


def _followers(nodes: Sequence[Expression], roots: Collection[Expression]) -> set[int]:
    found = {one.index for one in roots}
    for node in nodes:
        if any(argument.index in found for argument in node.arguments):
            found.add(node.index)
    return found


def _rebuilt(graph: Graph, node: Expression, arguments: list[Expression], side: Callable[[], Expression]) -> Expression:
    """Return a node of the state on other arguments; where it switches, with a choice of its own."""
    if node.operation in _CONDITIONS:
        return 0.5 + 0.5 * side()
    if node.operation == "sign":
        return side()
    if node.operation == "absolute":
        return side() * arguments[0]
    if node.operation in ("minimum", "maximum"):
        return algebra.select(algebra.less(graph.zero, side()), arguments[0], arguments[1])
    return algebra.build(graph, node.operation, arguments, node.payload)
