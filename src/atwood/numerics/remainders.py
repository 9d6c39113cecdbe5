"""What is left of a sparse matrix while it is being eliminated, in numbers of two kinds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.numerics.matrices import or_one

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
