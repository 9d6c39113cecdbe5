"""Which operations of a large program belong together: cells, of which there are many alike.

A mechanism repeats itself: the equations of one rod are those of the next, with other inputs.  Its program is cut into
*cells*, each the largest piece around one value that nothing outside needs.  A piece is that large only if its shape
comes up often; what comes up once, as a sum over all parts, falls into cells of one operation, and of these there are
many alike again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from atwood.expr.graph import Expression
from atwood.expr.operations import COMMUTATIVE
from atwood.kernels.llvm_layout import LARGEST_UNROLLED, Body, Unit

__all__ = ["Cell", "count_operations", "find_cells"]

_OFTEN = 8
"""A shape that comes up so often is kept together."""

_LARGEST = 120
"""The number of operations in a cell, at most."""

_PARTNER = {"sin": "cos", "cos": "sin"}


@dataclass
class Cell:
    """Operations that are computed together.

    Attributes
    ----------
    units
        The operations, arguments before users.
    is_regular
        Whether its shape comes up often, so that it can take in what only it needs.
    """

    units: list[Unit] = field(default_factory=list)
    is_regular: bool = False


@dataclass
class _Work:
    """The operations of a body: in units, with their users and shapes."""

    units: list[Unit]
    unit_of: dict[int, int]
    users: list[list[int]]
    shapes: dict[int, int]


def find_cells(body: Body) -> tuple[list[Cell], dict[int, int], dict[int, int]] | None:
    """Cut the operations of a body into cells.

    Parameters
    ----------
    body
        What to compute.

    Returns
    -------
    cells
        Each needs nothing of those before it in the list; None if there is a linear system that is too large.
    cell_of
        The cell of each operation, by the index of its node.
    shapes
        A number for each node; nodes made alike of leaves of the same kinds have the same.
    """
    known = {node.index: pointer for pointer, nodes in body.given for node in nodes}
    nodes = _needed([node for node, _, _ in body.results], known)
    if any(node.operation == "solve" and node.payload > LARGEST_UNROLLED for node in nodes):
        return None
    work = _prepare(nodes, known)
    often = _frequent(work)
    cells: list[Cell] = []
    home = [-1] * len(work.units)
    for number in range(len(work.units) - 1, -1, -1):
        unit = work.units[number]
        users = {home[user] for user in work.users[number]}
        if len(users) == 1:
            (only,) = users
            if cells[only].is_regular and len(cells[only].units) < _LARGEST:
                cells[only].units.append(unit)
                home[number] = only
                continue
        home[number] = len(cells)
        cells.append(Cell([unit], work.shapes[unit[0].index] in often))
    for cell in cells:
        cell.units.reverse()
    cell_of = {node.index: home[number] for number, unit in enumerate(work.units) for node in unit}
    return cells, cell_of, work.shapes


def count_operations(body: Body) -> int:
    """Return the number of operations of a body."""
    known = {node.index: pointer for pointer, nodes in body.given for node in nodes}
    return len(_needed([node for node, _, _ in body.results], known))


def _needed(results: Sequence[Expression], known: Mapping[int, str]) -> list[Expression]:
    """Return the operations that the results need beyond known values, arguments before users."""
    found: dict[int, Expression] = {}
    stack = [node for node in results if node.arguments and node.index not in known]
    while stack:
        node = stack.pop()
        if node.index not in found:
            found[node.index] = node
            for argument in node.arguments:
                if argument.arguments and argument.index not in found and argument.index not in known:
                    stack.append(argument)
    return [found[index] for index in sorted(found)]


def _prepare(nodes: Sequence[Expression], known: Mapping[int, str]) -> _Work:
    waves = {(n.operation, n.arguments[0].index): n for n in nodes if n.operation in _PARTNER}
    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        if node.operation == "component":
            unknowns.setdefault(node.arguments[0].index, []).append(node)
    work = _Work([], {}, [], {})
    table: dict[object, int] = {}
    leaves = {pointer: -1 - i for i, pointer in enumerate(dict.fromkeys(known.values()))}
    for node in nodes:
        shapes = [_shape(argument, work.shapes, known, leaves) for argument in node.arguments]
        if node.operation in COMMUTATIVE:
            shapes.sort()
        payload = id(node.payload) if node.operation == "external" else node.payload
        work.shapes[node.index] = table.setdefault((node.operation, payload, *shapes), len(table))
        if node.index in work.unit_of or node.operation == "component":
            continue
        unit: Unit = (node,)
        if node.operation in _PARTNER:
            partner = waves.get((_PARTNER[node.operation], node.arguments[0].index))
            unit = (node,) if partner is None else (node, partner)
        elif node.operation == "solve":
            unit = (node, *unknowns.get(node.index, ()))
        number = len(work.units)
        work.units.append(unit)
        work.users.append([])
        for one in unit:
            work.unit_of[one.index] = number
        for argument in node.arguments:
            source = work.unit_of.get(argument.index)
            if source is not None:
                work.users[source].append(number)
    return work


_CONSTANT = -1_000_000


def _shape(node: Expression, shapes: Mapping[int, int], known: Mapping[int, str], leaves: Mapping[str, int]) -> int:
    found = shapes.get(node.index)
    if found is not None:
        return found
    pointer = known.get(node.index)
    return _CONSTANT if pointer is None else leaves[pointer]


def _frequent(work: _Work) -> set[int]:
    counts: dict[int, int] = {}
    for shape in work.shapes.values():
        counts[shape] = counts.get(shape, 0) + 1
    return {shape for shape, count in counts.items() if count >= _OFTEN}
