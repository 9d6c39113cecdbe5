"""Gaussian elimination with pivots that are fixed beforehand: which they are, and what is then done.

Whether a pivot can be anything but zero is found out from the pattern alone, in the integers modulo a prime with random
entries: zero comes out there, but for a chance of one in a thousand million, only where the pattern forces it (R.
Zippel, *Effective Polynomial Computation*, section 12.1). Where that is not enough, matrices with this pattern say how
large pivots are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, IndexArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.body_order import Stage
from atwood.numerics.matrices import or_one

_DIAGONAL, _ANYWHERE = 1e-4, 0.1
"""Which share of the largest in its column a pivot must be, in its own row and in another one."""

_DESPERATE = (_ANYWHERE, 1e-3, 1e-8)
"""The same for what is left at the very end, one after another."""

Places = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class FixedPivots:
    """What an elimination does, as lists of places.

    Step k has a run of places in one array of numbers: its pivot, what is left of the pivot's row, and what is left
    of its column. Rows and columns of the factors are numbered by steps.

    Attributes
    ----------
    rows, columns
        The row and the column of the pivot of each step.
    positions
        The place of each entry of the matrix.
    starts, middles
        Where the run of each step begins, with its end after the last; where its part of the column begins.
    indices
        The column of each entry of a pivot's row, and the row of each of its column.
    targets, target_starts
        The places that a step changes, for each entry of its column those for each of its row; where those of each
        step begin.
    by_row, row_starts, row_columns
        The matrix's entries row by row, where each row begins, and the column of each.
    """

    rows: Places
    columns: Places
    positions: Places
    starts: Places
    middles: Places
    indices: Places
    targets: Places
    target_starts: Places
    by_row: Places
    row_starts: Places
    row_columns: Places

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return len(self.rows)

    @property
    def room(self) -> int:
        """The number of places: entries and what is filled in."""
        return len(self.indices)

    @property
    def operations(self) -> dict[str, int]:
        """Multiplications and divisions of a factorisation, and those of a solution with the factors."""
        lower = int(np.sum(self.starts[1:] - self.middles))
        return {"factorise": len(self.targets) + lower + self.size, "solve": self.room}


def fix_pivots(
    rows: IndexArray,
    columns: IndexArray,
    equations: NDArray[np.intp],
    stages: Sequence[Stage],
    samples: Sequence[FloatArray] = (),
) -> FixedPivots | None:
    """Return an elimination stage by stage; None if it meets a column in which all is zero.

    Each stage takes the unknowns of its body, then its multipliers, and always that which changes fewest entries
    (H. M. Markowitz, Management Science 3, 1957). What then has no pivot in its own row takes one in the row of another
    such unknown, as what has no mass and its constraints do, or waits for the next stage that it is coupled with.
    """
    size = len(equations)
    numbers = Samples(rows, columns, size, samples) if samples else Residues(len(rows))
    elimination = _Elimination(Remainders(rows, columns, size, numbers), equations)
    when = np.full(size, len(stages))
    for k, stage in enumerate(stages):
        when[list(stage.body)] = k
    waiting: list[tuple[list[int], list[int]]] = [([], []) for _ in range(len(stages) + 1)]
    listed = np.zeros(size, dtype=bool)
    for k, stage in enumerate(stages):
        listed[[*stage.body, *stage.constraints]] = True
        own, held = elimination.take(stage.body, *waiting[k])
        own, held = elimination.take(stage.constraints, own, held)
        if own:
            later = waiting[min(elimination.coupled(own, when, k), default=len(stages))]
            later[0].extend(own)
            later[1].extend(held)
    left = elimination.take(np.flatnonzero(~listed).tolist(), *waiting[-1])
    for share in _DESPERATE:
        elimination.take_anywhere(*left, share)
    return None if left[0] else _listed(rows, columns, elimination.steps, elimination.left)


class _Elimination:
    """An elimination in progress.

    Parameters
    ----------
    matrix
        What is left of the matrix.
    equations
        The row in which each unknown has its pivot.

    Attributes
    ----------
    steps, left
        Row and column of the pivot of each step, and what it leaves of them.
    """

    def __init__(self, matrix: Remainders, equations: NDArray[np.intp]) -> None:
        self._matrix, self._own = matrix, equations.tolist()
        self.steps: list[tuple[int, int]] = []
        self.left: list[tuple[list[int], list[int]]] = []

    def coupled(self, rows: Iterable[int], when: NDArray[np.intp], stage: int) -> set[int]:
        """Return the later stages that rows are coupled with."""
        found = {int(when[column]) for row in rows for column in self._matrix.rows[row]}
        return {one for one in found if one > stage}

    def take(self, unknowns: Iterable[int], rows: Iterable[int], columns: Iterable[int]) -> tuple[list[int], list[int]]:
        """Eliminate unknowns, with rows and columns that have waited; return those that still have to."""
        unknowns = list(unknowns)
        pending = [*rows, *(self._own[unknown] for unknown in unknowns)], [*columns, *unknowns]
        while pending[0] and (self._take_own(*pending) or self._take_other(*pending, _ANYWHERE)):
            pass
        return pending

    def take_anywhere(self, rows: list[int], columns: list[int], share: float) -> None:
        """Eliminate as much as possible of some rows and columns, with pivots that are such a share of their column."""
        while rows and self._take_other(rows, columns, share):
            pass

    def _take_own(self, rows: list[int], columns: list[int]) -> bool:
        known = set(rows)
        pairs = ((self._own[column], column) for column in columns if self._own[column] in known)
        return self._take_best(pairs, _DIAGONAL, rows, columns)

    def _take_other(self, rows: list[int], columns: list[int], share: float) -> bool:
        known = set(columns)
        pairs = ((row, column) for row in rows for column in self._matrix.rows[row] if column in known)
        return self._take_best(pairs, share, rows, columns)

    def _take_best(self, pairs: Iterable[tuple[int, int]], share: float, rows: list[int], columns: list[int]) -> bool:
        """Eliminate with the pivot that changes fewest entries, the first of them; return whether there was one."""
        matrix = self._matrix
        best = min(
            (pair for pair in pairs if matrix.is_good(*pair, share)), key=lambda pair: matrix.cost(*pair), default=None
        )
        if best is None:
            return False
        rows.remove(best[0])
        columns.remove(best[1])
        self.steps.append(best)
        self.left.append(matrix.eliminate(*best))
        return True


def _listed(
    rows: IndexArray,
    columns: IndexArray,
    steps: Sequence[tuple[int, int]],
    left: Sequence[tuple[list[int], list[int]]],
) -> FixedPivots:
    """Return the places of an elimination from the rows and columns of its steps."""
    size = len(steps)
    pivots = np.array(steps, dtype=np.int64).reshape(size, 2)
    of_row, of_column = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    of_row[pivots[:, 0]] = of_column[pivots[:, 1]] = np.arange(size)
    right = [np.sort(of_column[a]) for a, _ in left]
    below = [np.sort(of_row[b]) for _, b in left]
    widths, heights = (np.array([len(one) for one in part], dtype=np.int64) for part in (right, below))
    starts = np.concatenate([[0], np.cumsum(1 + widths + heights)])
    middles = starts[:-1] + 1 + widths
    indices = np.concatenate([np.concatenate([[k], a, b]) for k, (a, b) in enumerate(zip(right, below, strict=True))])
    # Of each place its row and its column in the factors, as one number by which it is found.
    owner = np.repeat(np.arange(size), np.diff(starts))
    in_row = np.arange(len(indices)) < middles[owner]
    keys = np.where(in_row, owner * size + indices, indices * size + owner)
    order = np.argsort(keys)

    def places(row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.int64]:
        found: NDArray[np.int64] = order[np.searchsorted(keys, row * size + column, sorter=order)]
        return found

    products = [(np.repeat(b, len(a)), np.tile(a, len(b))) for a, b in zip(right, below, strict=True)]
    changed = places(*(np.concatenate(part) for part in zip(*products, strict=True)))
    by_row = np.lexsort((columns, rows))
    return FixedPivots(
        *(_places(pivots[:, 0]), _places(pivots[:, 1])),
        _places(places(of_row[np.asarray(rows)], of_column[np.asarray(columns)])),
        *(_places(starts), _places(middles), _places(indices), _places(changed)),
        _places(np.concatenate([[0], np.cumsum(widths * heights)])),
        _places(by_row),
        _places(np.searchsorted(np.asarray(rows)[by_row], np.arange(size + 1))),
        _places(np.asarray(columns)[by_row]),
    )


def _places(numbers: NDArray[Any]) -> Places:
    return np.ascontiguousarray(numbers, dtype=np.int32)


_PRIME = 2**31 - 1
_ROUNDING = 1e-6
"""What is less than this share of the terms it is a sum of may be nothing but rounding."""

_PASSES = 5


class Numbers(Protocol):
    """Numbers that entries are."""

    entries: Sequence[Any]

    def inverse(self, value: Any) -> Any:
        """Return the reciprocal."""

    def product(self, one: Any, other: Any) -> Any:
        """Return a product."""

    def less(self, value: Any | None, factor: Any, other: Any) -> Any:
        """Return a value, or zero, less a product."""

    def is_good(self, value: Any, column: Iterable[Any], share: float) -> bool:
        """Return whether a value may be a pivot: if it is such a share of the largest in its column."""


class Residues:
    """Random integers modulo a prime.

    Parameters
    ----------
    count
        How many entries there are.
    """

    def __init__(self, count: int) -> None:
        self.entries: Sequence[int] = np.random.default_rng(20_240).integers(1, _PRIME, count).tolist()

    def inverse(self, value: int) -> int:
        """See `Numbers`."""
        return pow(value, -1, _PRIME)

    def product(self, one: int, other: int) -> int:
        """See `Numbers`."""
        return one * other % _PRIME

    def less(self, value: int | None, factor: int, other: int) -> int:
        """See `Numbers`."""
        return ((value or 0) - factor * other) % _PRIME

    def is_good(self, value: int, column: Iterable[int], share: float) -> bool:
        """See `Numbers`."""
        return value != 0


class Samples:
    """The entries of some matrices side by side, each with the sum of the sizes that it was made of.

    Parameters
    ----------
    rows, columns, size
        Where the entries are, and of how many rows.
    samples
        The entries of each matrix.
    """

    def __init__(self, rows: IndexArray, columns: IndexArray, size: int, samples: Sequence[FloatArray]) -> None:
        scaled = [_equilibrated(rows, columns, size, one) for one in samples]
        self.entries: Sequence[Sequence[tuple[float, float]]] = [
            [(value, abs(value)) for value in values] for values in zip(*(one.tolist() for one in scaled), strict=True)
        ]

    def inverse(self, value: Sequence[tuple[float, float]]) -> list[float]:
        """See `Numbers`."""
        return [1.0 / v for v, _ in value]

    def product(self, one: Sequence[tuple[float, float]], other: Sequence[float]) -> list[float]:
        """See `Numbers`."""
        return [v * w for (v, _), w in zip(one, other, strict=True)]

    def less(
        self, value: Sequence[tuple[float, float]] | None, factor: Sequence[float], other: Sequence[tuple[float, float]]
    ) -> list[tuple[float, float]]:
        """See `Numbers`."""
        products = [f * v for f, (v, _) in zip(factor, other, strict=True)]
        if value is None:
            return [(-p, abs(p)) for p in products]
        return [(v - p, size + abs(p)) for (v, size), p in zip(value, products, strict=True)]

    def is_good(
        self, value: Sequence[tuple[float, float]], column: Iterable[Sequence[tuple[float, float]]], share: float
    ) -> bool:
        """See `Numbers`."""
        if not all(abs(v) > _ROUNDING * size for v, size in value):
            return False
        return all(abs(v) >= share * abs(w) for one in column for (v, _), (w, _) in zip(value, one, strict=True))


def _equilibrated(rows: IndexArray, columns: IndexArray, size: int, entries: FloatArray) -> FloatArray:
    """Scale rows and columns so that the largest entries of all of them are of size 1 (D. Ruiz, RAL-TR-2001-034)."""
    found = np.array(entries, dtype=float)
    for _ in range(_PASSES):
        for places in (rows, columns):
            largest = np.zeros(size)
            np.maximum.at(largest, places, np.abs(found))
            found /= np.sqrt(or_one(largest))[places]
    return found


class Remainders:
    """A matrix while it is being eliminated.

    Parameters
    ----------
    rows, columns, size
        Where it has entries, and how many rows.
    numbers
        What they are.

    Attributes
    ----------
    rows, columns
        The entries of each row by column, and the rows of each column.
    """

    def __init__(self, rows: IndexArray, columns: IndexArray, size: int, numbers: Numbers) -> None:
        self._numbers = numbers
        self.rows: list[dict[int, Any]] = [{} for _ in range(size)]
        self.columns: list[set[int]] = [set() for _ in range(size)]
        for row, column, value in zip(rows.tolist(), columns.tolist(), numbers.entries, strict=True):
            self.rows[row][column] = value
            self.columns[column].add(row)

    def cost(self, row: int, column: int) -> int:
        """Return how many entries a pivot changes."""
        return (len(self.rows[row]) - 1) * (len(self.columns[column]) - 1)

    def is_good(self, row: int, column: int, share: float) -> bool:
        """Return whether there can be a pivot: one that is such a share of the largest in its column."""
        value = self.rows[row].get(column)
        if value is None:
            return False
        return self._numbers.is_good(value, (self.rows[other][column] for other in self.columns[column]), share)

    def eliminate(self, row: int, column: int) -> tuple[list[int], list[int]]:
        """Eliminate an unknown; return the columns that are left in the pivot's row and the rows of its column."""
        numbers = self._numbers
        own, below = self.rows[row], self.columns[column]
        inverse = numbers.inverse(own.pop(column))
        below.discard(row)
        for other in own:
            self.columns[other].discard(row)
        entries = list(own.items())
        for target in below:
            values = self.rows[target]
            factor = numbers.product(values.pop(column), inverse)
            for other, value in entries:
                before = values.get(other)
                if before is None:
                    self.columns[other].add(target)
                values[other] = numbers.less(before, factor, value)
        left = list(below)
        below.clear()
        return list(own), left
