"""A large program as loops: one piece of code for all cells that are alike, and tables of what each works on.

Cells are alike if their operations are the same, applied in the same way to values of the same kinds: inputs,
parameters, constants, or results of other cells.  Then one *pattern* stands for all of them.  The cells of one pattern
are done one after the other in *runs*; a cell can use the result of the one before it, so that sums along a chain are
loops as well.  Code grows with the number of patterns, not with the number of parts.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atwood.expr.graph import Expression
from atwood.expr.operations import COMMUTATIVE
from atwood.kernels.llvm_layout import Body, Unit
from atwood.kernels.rolled_cells import Cell, count_operations, find_cells

__all__ = ["CONSTANTS", "SCRATCH", "Leaf", "Outcome", "Pattern", "Rolled", "roll", "roll_large"]

SCRATCH, CONSTANTS = "scratch", "constants"
"""Names of the arrays of results of other cells, and of constants."""


@dataclass(frozen=True)
class Leaf:
    """A value that a pattern works on.

    Attributes
    ----------
    node
        What it is in the pattern's first cell.
    pointer
        The array that it is read from.
    column
        Where in the table of the pattern's cells its position is; -1 if it is the same for all of them.
    uniform
        Which of the positions that all cells share is its own; -1 if they differ.
    """

    node: Expression
    pointer: str
    column: int
    uniform: int


@dataclass(frozen=True)
class Outcome:
    """A value that a pattern gives.

    Attributes
    ----------
    node
        What it is in the pattern's first cell.
    slot
        Which of the values that each cell hands on it is; -1 if no other cell needs it.
    targets
        The arrays of results that it goes to, each with the column of the table that says where.
    """

    node: Expression
    slot: int
    targets: tuple[tuple[str, int], ...]


@dataclass(frozen=True, eq=False)
class Pattern:
    """What cells have in common.

    Attributes
    ----------
    units
        The operations of the first cell.
    leaves, outcomes
        What goes in and what comes out.
    table
        Positions, one row for each cell in the order in which they are done.
    shared
        Positions that are the same for all cells.
    handed
        How many values each cell hands on.
    base
        Where in the scratch array the first cell's are.
    """

    units: tuple[Unit, ...]
    leaves: tuple[Leaf, ...]
    outcomes: tuple[Outcome, ...]
    table: NDArray[np.int32]
    shared: tuple[int, ...]
    handed: int
    base: int


@dataclass(frozen=True, eq=False)
class Rolled:
    """A body as loops.

    Attributes
    ----------
    patterns
        The patterns.
    runs
        What is done in order: a pattern, its first cell, and how many.
    constants
        The constants that differ from cell to cell.
    scratch
        The length of the scratch array.
    """

    patterns: tuple[Pattern, ...]
    runs: tuple[tuple[int, int, int], ...]
    constants: tuple[float, ...]
    scratch: int

    @property
    def operations(self) -> int:
        """The number of operations that code has to be written for."""
        return sum(len(unit) for pattern in self.patterns for unit in pattern.units)


@dataclass
class _Member:
    """One cell as a member of its pattern."""

    cell: int
    units: tuple[Unit, ...]
    leaves: list[Expression]
    outcomes: list[Expression]


@dataclass
class _Facts:
    """What is known about a body."""

    known: dict[int, tuple[str, int]]
    targets: dict[int, list[tuple[str, int]]]
    cell_of: dict[int, int]
    shapes: dict[int, int]
    exported: set[int]


def roll(body: Body) -> Rolled | None:
    """Return a body as loops.

    Parameters
    ----------
    body
        What to compute.

    Returns
    -------
    Rolled or None
        None if it has a linear system that is not eliminated in registers.
    """
    found = find_cells(body)
    if found is None:
        return None
    cells, cell_of, shapes = found
    targets: dict[int, list[tuple[str, int]]] = {}
    copies: dict[int, Expression] = {}
    for node, pointer, position in body.results:
        targets.setdefault(node.index, []).append((pointer, position))
        if node.index not in cell_of:
            copies[node.index] = node
    known = {node.index: (pointer, k) for pointer, nodes in body.given for k, node in enumerate(nodes)}
    facts = _Facts(known, targets, cell_of, shapes, _exported(cells, cell_of))
    groups: dict[object, list[_Member]] = {}
    for number, cell in enumerate(cells):
        key, member = _describe(number, cell, facts)
        groups.setdefault(key, []).append(member)
    for node in copies.values():
        kinds = tuple(pointer for pointer, _ in targets[node.index])
        key = ("copy", known[node.index][0] if node.index in known else CONSTANTS, kinds)
        groups.setdefault(key, []).append(_Member(-1, (), [node], [node]))
    members = list(groups.values())
    order, runs = _schedule(members, cell_of, len(cells))
    return _tabulate(order, runs, facts)


def roll_large(body: Body, smallest: int) -> Rolled | None:
    """Return a body as loops if it is large, and much shorter as loops; else None.

    Parameters
    ----------
    body
        What to compute.
    smallest
        The number of operations and results from which it is large.
    """
    size = len(body.results)
    if size < smallest:
        size += count_operations(body)
    if size < smallest:
        return None
    found = roll(body)
    return found if found is not None and found.operations * _GAIN <= size else None


_GAIN = 5
"""Loops must be shorter by so much; they take longer for each operation, and their positions take memory."""


def _exported(cells: Sequence[Cell], cell_of: dict[int, int]) -> set[int]:
    """Return the nodes that other cells need."""
    found: set[int] = set()
    for number, cell in enumerate(cells):
        for unit in cell.units:
            for argument in unit[0].arguments:
                home = cell_of.get(argument.index)
                if home is not None and home != number:
                    found.add(argument.index)
    return found


def _describe(number: int, cell: Cell, facts: _Facts) -> tuple[object, _Member]:
    """Return what a cell has in common with those that are alike, and the cell with its leaves in that order."""
    inside = {node.index: unit for unit in cell.units for node in unit}
    outcomes = [
        node for unit in cell.units for node in unit if node.index in facts.exported or node.index in facts.targets
    ]
    outcomes.sort(key=lambda node: (facts.shapes[node.index], node.index))
    numbers: dict[int, int] = {}
    leaves: list[Expression] = []
    key: list[object] = []
    for outcome in outcomes:
        stack = [outcome]
        while stack:
            node = stack[-1]
            if node.index in numbers:
                stack.pop()
                continue
            if node.index not in inside:
                numbers[node.index] = len(numbers)
                leaves.append(node)
                key.append(_kind(node, facts))
                stack.pop()
                continue
            arguments = _in_order(node, facts)
            waiting = [a for a in arguments if a.index not in numbers]
            if waiting:
                stack.extend(reversed(waiting))
                continue
            stack.pop()
            numbers[node.index] = len(numbers)
            payload = id(node.payload) if node.operation == "external" else node.payload
            key.append((node.operation, payload, *[numbers[a.index] for a in arguments]))
    for outcome in outcomes:
        kinds = tuple(pointer for pointer, _ in facts.targets.get(outcome.index, ()))
        key.append((numbers[outcome.index], outcome.index in facts.exported, kinds))
    return tuple(key), _Member(number, tuple(cell.units), leaves, outcomes)


def _in_order(node: Expression, facts: _Facts) -> Sequence[Expression]:
    """Return arguments, those that may change places in an order of their own."""
    if node.operation not in COMMUTATIVE:
        return node.arguments
    a, b = node.arguments
    return (b, a) if _rank(b, facts) < _rank(a, facts) else (a, b)


def _rank(node: Expression, facts: _Facts) -> tuple[str, int, int]:
    if node.index in facts.shapes:
        return ("", facts.shapes[node.index], node.index)
    return (_kind(node, facts), 0, facts.known.get(node.index, ("", node.index))[1])


def _kind(node: Expression, facts: _Facts) -> str:
    """Return the array that a leaf is read from."""
    if node.index in facts.cell_of:
        return SCRATCH
    found = facts.known.get(node.index)
    return CONSTANTS if found is None else found[0]


def _schedule(
    groups: Sequence[Sequence[_Member]], cell_of: dict[int, int], count: int
) -> tuple[list[list[_Member]], list[tuple[int, int, int]]]:
    """Return the members of each group in the order in which they are done, and the runs.

    A group that is ready as a whole goes first, and otherwise the one of which most is ready; it goes on as long as its
    own results make more of it ready.
    """
    waits = [0] * count
    wakes: list[list[tuple[int, _Member]]] = [[] for _ in range(count)]
    ready: list[deque[_Member]] = [deque() for _ in groups]
    for number, group in enumerate(groups):
        for member in group:
            sources = (
                {cell_of[leaf.index] for leaf in member.leaves if leaf.index in cell_of} if member.units else set()
            )
            for source in sources:
                wakes[source].append((number, member))
            if member.units:
                waits[member.cell] = len(sources)
            if not sources:
                ready[number].append(member)
    left = [len(group) for group in groups]
    order: list[list[_Member]] = [[] for _ in groups]
    runs: list[tuple[int, int, int]] = []
    waiting = {number for number, queue in enumerate(ready) if queue}
    while waiting:
        best = max(waiting, key=lambda number: (len(ready[number]) == left[number], len(ready[number]), -number))
        queue, done = ready[best], order[best]
        first = len(done)
        while queue:
            member = queue.popleft()
            done.append(member)
            if not member.units:
                continue
            for number, other in wakes[member.cell]:
                waits[other.cell] -= 1
                if waits[other.cell] == 0:
                    ready[number].append(other)
                    waiting.add(number)
        waiting.discard(best)
        left[best] -= len(done) - first
        runs.append((best, first, len(done) - first))
    return order, runs


def _tabulate(order: Sequence[Sequence[_Member]], runs: Sequence[tuple[int, int, int]], facts: _Facts) -> Rolled:
    """Give every value a place, and write down the places."""
    places = dict(facts.known)
    bases: list[tuple[int, int]] = []
    used = 0
    for members in order:
        slots = [k for k, node in enumerate(members[0].outcomes) if node.index in facts.exported]
        for number, member in enumerate(members):
            for slot, k in enumerate(slots):
                places[member.outcomes[k].index] = (SCRATCH, used + number * len(slots) + slot)
        bases.append((used, len(slots)))
        used += len(members) * len(slots)
    constants: dict[int, int] = {}
    patterns = tuple(
        _pattern(members, base, facts, places, constants) for members, base in zip(order, bases, strict=True)
    )
    values = {number: node for node, number in constants.items()}
    graph = order[0][0].outcomes[0].graph if order else None
    numbers = tuple(graph.nodes[values[i]].value for i in range(len(values))) if graph is not None else ()
    return Rolled(patterns, tuple(runs), numbers, used)


def _pattern(
    members: Sequence[_Member],
    base: tuple[int, int],
    facts: _Facts,
    places: dict[int, tuple[str, int]],
    constants: dict[int, int],
) -> Pattern:
    first = members[0]
    columns: list[list[int]] = []
    shared: list[int] = []
    leaves: list[Leaf] = []
    for k, node in enumerate(first.leaves):
        nodes = [member.leaves[k] for member in members]
        pointer = _kind(node, facts)
        if all(other is node for other in nodes):
            if pointer == CONSTANTS:
                leaves.append(Leaf(node, CONSTANTS, -1, -1))
            else:
                leaves.append(Leaf(node, pointer, -1, len(shared)))
                shared.append(places[node.index][1])
            continue
        leaves.append(Leaf(node, pointer, len(columns), -1))
        if pointer == CONSTANTS:
            columns.append([constants.setdefault(other.index, len(constants)) for other in nodes])
        else:
            columns.append([places[other.index][1] for other in nodes])
    outcomes: list[Outcome] = []
    handed = 0
    for k, node in enumerate(first.outcomes):
        slot = -1
        if node.index in facts.exported:
            slot, handed = handed, handed + 1
        targets = []
        for i, (pointer, _) in enumerate(facts.targets.get(node.index, ())):
            targets.append((pointer, len(columns)))
            columns.append([facts.targets[member.outcomes[k].index][i][1] for member in members])
        outcomes.append(Outcome(node, slot, tuple(targets)))
    table = np.array(columns, dtype=np.int32).T if columns else np.zeros((len(members), 0), dtype=np.int32)
    return Pattern(
        first.units, tuple(leaves), tuple(outcomes), np.ascontiguousarray(table), tuple(shared), handed, base[0]
    )
