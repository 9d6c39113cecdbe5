"""Gaussian elimination with pivots that are fixed beforehand: which they are, and what is then done.

Whether a pivot can be anything but zero is found out from the pattern alone, in the integers modulo a prime with random
entries: zero comes out there, but for a chance of one in a thousand million, only where the pattern forces it (R.
Zippel, *Effective Polynomial Computation*, section 12.1). Where that is not enough, matrices with this pattern say how
large pivots are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, IndexArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.body_order import Stage
from atwood.numerics.remainders import Remainders, Residues, Samples

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
