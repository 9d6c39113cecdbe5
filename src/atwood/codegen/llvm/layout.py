"""Which operation goes where: a program cut into pieces that are short enough to be compiled quickly.

The time that LLVM needs grows faster than the length of a function.  So the operations are cut into chunks, each a
function of its own.  A value that only its own chunk needs lives in a register; the others are handed on through
the scratch array, in slots that are used again once nobody needs their value any more.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Generic, TypeVar

from atwood.codegen.llvm.loops import Chunk, Loop, Unit as Unit, find_loops, rows_of, units_of
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

LARGEST_UNROLLED = 3
"""Linear systems up to this size are eliminated in registers; larger ones by a loop over the scratch array."""

_PARTNER = {"sin": "cos", "cos": "sin"}

MatrixKey = tuple[int, ...]
"""The entries of a matrix, by the indices of their nodes."""


@dataclass(frozen=True)
class Body:
    """One function to compile.

    Attributes
    ----------
    given
        Arrays of known values: the name of each pointer with what it holds, in order.
    results
        What to compute, and where it goes: the name of a pointer and a position.
    """

    given: tuple[tuple[str, tuple[Expression, ...]], ...]
    results: tuple[tuple[Expression, str, int], ...]


C = TypeVar("C", bound=Chunk)


@dataclass(frozen=True)
class LayoutOf(Generic[C]):
    """A body cut into chunks.

    Attributes
    ----------
    chunks
        The operations of each chunk, in order.
    slots
        Where in the scratch array a value lies that a later chunk, or another stretch of a loop, needs.
    regions
        Where the factors of a large matrix begin; they are followed by the pivots and the right-hand side.
    scratch
        The length of the scratch array.
    """

    chunks: tuple[C, ...]
    slots: dict[int, int]
    regions: dict[MatrixKey, int]
    scratch: int


Layout = LayoutOf[tuple[Unit, ...]]
"""A body cut into chunks without loops."""


def main_body(program: Program, positions: Sequence[int] | None = None) -> Body:
    """Return what is computed in every call."""
    given = [("derived", program.prologue)]
    given += [(f"in{k}", tuple(group.symbols)) for k, group in enumerate(program.inputs)]
    results = [
        (node, f"out{k}", position)
        for k, group in enumerate(program.outputs)
        for position, node in enumerate(group.expressions)
    ]
    if positions is not None:
        results = [(node, pointer, at) for (node, pointer, _), at in zip(results, positions, strict=True)]
    return Body(tuple(given), tuple(results))


def prologue_body(program: Program) -> Body:
    """Return what is computed once a run, from the parameters alone."""
    results = tuple((node, "out0", position) for position, node in enumerate(program.prologue))
    return Body((("in0", program.parameters),), results)


def matrix_key(solve: Expression) -> MatrixKey:
    """Return what two linear systems with the same matrix have in common."""
    return tuple(argument.index for argument in solve.arguments[: solve.payload**2])


def lay_out(body: Body, longest: int) -> Layout:
    """Cut a body into chunks and give every value that crosses between them a place."""
    units = _units(_depth_first([node for node, _, _ in body.results], set(places_of(body))))
    return _laid_out(_cut(units, longest))


def lay_out_in_loops(body: Body, longest: int, least: int) -> LayoutOf[Chunk]:
    """Do the same with loops where operations repeat, if there are at least so many."""
    known = places_of(body)
    units = _units(_depth_first([node for node, _, _ in body.results], set(known)))
    if len(units) < least:
        return _laid_out(list[Chunk](_cut(units, longest)))
    chunks: list[Chunk] = []
    for piece in find_loops(units, known, targets_of(body)):
        chunks += [piece] if isinstance(piece, Loop) else _cut(piece, longest)
    return _laid_out(chunks)


def places_of(body: Body) -> dict[int, tuple[str, int]]:
    """Return where the values lie that are given."""
    return {node.index: (pointer, k) for pointer, nodes in body.given for k, node in enumerate(nodes)}


def targets_of(body: Body) -> dict[int, list[tuple[str, int]]]:
    """Return where each result goes."""
    targets: dict[int, list[tuple[str, int]]] = {}
    for node, pointer, position in body.results:
        targets.setdefault(node.index, []).append((pointer, position))
    return targets


def _laid_out(chunks: Sequence[C]) -> LayoutOf[C]:
    slots, used = _share_slots(chunks)
    regions: dict[MatrixKey, int] = {}
    for chunk in chunks:
        for unit in units_of(chunk):
            solve = unit[0]
            if solve.operation == "solve" and solve.payload > LARGEST_UNROLLED and matrix_key(solve) not in regions:
                regions[matrix_key(solve)] = used
                used += solve.payload * (solve.payload + 2)
    return LayoutOf(tuple(chunks), slots, regions, used)


def _depth_first(results: Iterable[Expression], known: set[int]) -> list[Expression]:
    """Return the operations that the results need beyond known values, each shortly before its first use.

    Compared with the order of creation, fewer values cross from one chunk to another.
    """
    order: list[Expression] = []
    placed: set[int] = set(known)
    for result in results:
        stack = [(result, False)]
        while stack:
            node, ready = stack.pop()
            if node.index in placed or not node.arguments:
                continue
            if ready:
                placed.add(node.index)
                order.append(node)
            else:
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.arguments) if a.index not in placed)
    return order


def _units(nodes: Sequence[Expression]) -> list[Unit]:
    """Return the operations in order, those together that are computed together."""
    waves: dict[tuple[str, int], Expression] = {}
    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        if node.operation in _PARTNER:
            waves[node.operation, node.arguments[0].index] = node
        elif node.operation == "component":
            unknowns.setdefault(node.arguments[0].index, []).append(node)
    units: list[Unit] = []
    done: set[int] = set()
    for node in nodes:
        if node.operation == "component" or node.index in done:
            continue
        unit: Unit = (node,)
        if node.operation in _PARTNER:
            partner = waves.get((_PARTNER[node.operation], node.arguments[0].index))
            if partner is not None:
                unit = (node, partner)
                done.add(partner.index)
        elif node.operation == "solve":
            unit = (node, *unknowns.get(node.index, ()))
        units.append(unit)
    return units


def _cut(units: Sequence[Unit], longest: int) -> tuple[tuple[Unit, ...], ...]:
    total = sum(_cost(unit) for unit in units)
    if total <= longest:
        return (tuple(units),)
    share = total / -(-total // longest)
    chunks: list[tuple[Unit, ...]] = []
    current: list[Unit] = []
    length = 0
    for unit in units:
        cost = _cost(unit)
        if current and length + cost > share:
            chunks.append(tuple(current))
            current, length = [], 0
        current.append(unit)
        length += cost
    chunks.append(tuple(current))
    return tuple(chunks)


def _cost(unit: Unit) -> int:
    """Return about how many instructions a unit takes."""
    if unit[0].operation == "solve":
        size = unit[0].payload
        return int(size**3 if size <= LARGEST_UNROLLED else size * (size + 2))
    return 1


def _share_slots(chunks: Sequence[Chunk]) -> tuple[dict[int, int], int]:
    """Return the slots of the values that later chunks need, and how many slots there are.

    What an operation of a loop makes in all stretches lies side by side, if any of it is needed.
    """
    home: dict[int, tuple[int, int]] = {}
    last_use: dict[int, int] = {}
    for position, chunk in enumerate(chunks):
        for number, stretch in enumerate(chunk.stretches if isinstance(chunk, Loop) else (chunk,)):
            here = position, number
            for unit in stretch:
                for argument in unit[0].arguments:
                    if home.get(argument.index, here) != here:
                        last_use[argument.index] = position
                for node in unit:
                    home[node.index] = here
    slots: dict[int, int] = {}
    free: list[int] = []
    used = 0
    ending: dict[int, list[int]] = {}
    for position, chunk in enumerate(chunks):
        if isinstance(chunk, Loop):
            for row in rows_of(chunk):
                if any(node.index in last_use for node in row):
                    slots |= {node.index: used + k for k, node in enumerate(row)}
                    used += len(row)
        for unit in () if isinstance(chunk, Loop) else chunk:
            for node in unit:
                if node.index in last_use:
                    if not free:
                        free.append(used)
                        used += 1
                    slots[node.index] = free.pop()
                    ending.setdefault(last_use[node.index], []).append(slots[node.index])
        free.extend(ending.pop(position, ()))
    return slots, used
