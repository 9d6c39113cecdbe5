"""Operations that repeat: a chain of ten thousand equal links is a loop over arrays, in code as long as that of one.

What repeats is found in the order of the operations, not declared: neighbouring stretches of equal length with the
same operations on the same constants, on values of their own, and on values from the same arrays.  Where each of these
lies is a number that grows by the same amount from one stretch to the next, or stands in a table.  Operations and their
order are those of straight code, and so are all values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.expr.core.graph import Expression
from atwood.lazy_dataclasses import dataclass

Unit = tuple[Expression, ...]
"""Operations that must stay together: a sine with its cosine, a linear system with its unknowns."""

_LONGEST, _FEWEST, _LEAST = 150, 8, 100
"""A stretch has at most so many operations; at least so many repeat; together they have at least so many operations."""


@dataclass(frozen=True)
class Loop:
    """Stretches of operations that differ only in where their values lie.

    Attributes
    ----------
    stretches
        The operations of each.
    read
        What each reads of the outside: one value for each, stretch by stretch.
    """

    stretches: tuple[tuple[Unit, ...], ...]
    read: tuple[tuple[Expression, ...], ...]


Chunk = tuple[Unit, ...] | Loop
"""Operations that one function of code does."""


def units_of(chunk: Chunk) -> list[Unit]:
    """Return all operations of a chunk, in order."""
    return [unit for stretch in chunk.stretches for unit in stretch] if isinstance(chunk, Loop) else list(chunk)


def rows_of(loop: Loop) -> list[tuple[Expression, ...]]:
    """Return what each operation of a loop makes, stretch by stretch."""
    made = ([node for unit in stretch for node in unit] for stretch in loop.stretches)
    return list(zip(*made, strict=True))


def find_loops(
    units: Sequence[Unit], known: Mapping[int, tuple[str, int]], targets: Mapping[int, Sequence[tuple[str, int]]]
) -> list[Chunk]:
    """Return operations in the same order, with loops where they repeat.

    Parameters
    ----------
    units
        The operations.
    known
        Arrays of the values that are given.
    targets
        Arrays to which results go.
    """
    found: list[Chunk] = []
    straight: list[Unit] = []
    taken = 0
    runs = _repeated(_signs(units, known)) if _repeated(_kinds(units)) else []
    for start, length, period in runs:
        straight += units[taken:start]
        stretches = [tuple(units[at : at + period]) for at in range(start, start + length - period + 1, period)]
        taken = start + len(stretches) * period
        read = [_outside(one) for one in stretches]
        shapes = [_shape(one, outside, known, targets) for one, outside in zip(stretches, read, strict=True)]
        first = 0
        while first < len(stretches):
            end = first + 1
            while end < len(stretches) and shapes[end] == shapes[first]:
                end += 1
            if end - first >= _FEWEST and (end - first) * period >= _LEAST:
                loop = Loop(tuple(stretches[first:end]), tuple(zip(*read[first:end], strict=True)))
                found += [tuple(straight)] * bool(straight) + [loop]
                straight = []
            else:
                straight += [unit for one in stretches[first:end] for unit in one]
            first = end
    straight += units[taken:]
    return [*found, tuple(straight)] if straight or not found else found


def _kinds(units: Sequence[Unit]) -> NDArray[np.int64]:
    """Return a number for each operation that tells what it does: where these do not repeat, nothing does."""
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(unit[0].operation, len(numbers)) for unit in units], dtype=np.int64)


def _signs(units: Sequence[Unit], known: Mapping[int, tuple[str, int]]) -> NDArray[np.int64]:
    """Return a number for each operation that tells what it does, and from how far before its values come."""
    place = {node.index: at for at, unit in enumerate(units) for node in unit}
    numbers: dict[object, int] = {}
    signs = np.empty(len(units), dtype=np.int64)
    for at, unit in enumerate(units):
        if unit[0].operation == "solve":
            signs[at] = -1 - at
            continue
        given: list[object] = []
        for one in unit[0].arguments:
            if one.operation == "constant":
                given.append(("constant", float(one.payload).hex()))
            elif one.index in known:
                given.append(known[one.index][0])
            else:
                given.append(min(at - place[one.index], _LONGEST))
        sign = (*(node.operation for node in unit), *given)
        signs[at] = numbers.setdefault(sign, len(numbers))
    return signs


def _repeated(signs: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Return where signs repeat: starts, lengths and periods, in order and apart from each other."""
    runs: list[tuple[int, int, int]] = []
    for period in range(1, min(_LONGEST, len(signs) // _FEWEST) + 1):
        edges = np.diff(np.concatenate([[False], signs[:-period] == signs[period:], [False]]).astype(np.int8))
        starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        lengths = ends - starts + period
        for k in np.flatnonzero(lengths >= max(_FEWEST * period, _LEAST)):
            runs.append((int(starts[k]), int(lengths[k]), period))
    kept: list[tuple[int, int, int]] = []
    for start, length, period in sorted(runs, key=lambda run: (-run[1], run[2])):
        if all(start + length <= one[0] or one[0] + one[1] <= start for one in kept):
            kept.append((start, length, period))
    return sorted(kept)


def _outside(stretch: Sequence[Unit]) -> list[Expression]:
    """Return what a stretch reads that it does not make, each once, in the order in which it is read first."""
    made: set[int] = set()
    read: dict[int, Expression] = {}
    for unit in stretch:
        for one in unit[0].arguments:
            if one.index not in made and one.operation != "constant":
                read.setdefault(one.index, one)
        made.update(node.index for node in unit)
    return list(read.values())


def _shape(
    stretch: Sequence[Unit],
    read: Sequence[Expression],
    known: Mapping[int, tuple[str, int]],
    targets: Mapping[int, Sequence[tuple[str, int]]],
) -> tuple[object, ...]:
    """Return all of a stretch, and of what it reads of the outside, but where values lie."""
    names: dict[int, object] = {
        one.index: (k, known[one.index][0] if one.index in known else "") for k, one in enumerate(read)
    }
    shape: list[object] = []
    for at, unit in enumerate(stretch):
        shape += [(node.operation, node.payload) for node in unit]
        shape += [
            ("constant", float(one.payload).hex()) if one.operation == "constant" else names[one.index]
            for one in unit[0].arguments
        ]
        for k, node in enumerate(unit):
            names[node.index] = ("own", at, k)
            shape.append(tuple(pointer for pointer, _ in targets.get(node.index, ())))
    return tuple(shape)
