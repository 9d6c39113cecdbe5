"""Sparse linear algebra for many states at once: one pattern, and numbers for every state.

What a mechanism's matrices are made of stays where it is while it moves. So the order of elimination and the places
of what it adds are found once, and every operation is done for all states together. Arrays have one row for each
entry, and one column for each state.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, IndexArray
from atwood.codegen.llvm.elimination import LISTS, elimination_functions
from atwood.numerics.body_order import by_least, neighbours_of
from atwood.numerics.matrices import or_one

_SHARE = 1e-13
"""What is added to the diagonal of normal equations, relative to its largest entry."""


def _sums(values: FloatArray, starts: IndexArray, count: int) -> FloatArray:
    """Return the sums of consecutive rows; `starts` says where each of `count` groups begins, none is empty."""
    if not count:
        return np.zeros((0, values.shape[1]))
    return np.asarray(np.add.reduceat(values, starts, axis=0))


class Pattern:
    """Where a matrix of some rows and columns has entries.

    Parameters
    ----------
    rows, columns
        Of each entry.
    shape
        Number of rows and of columns.
    """

    def __init__(self, rows: IndexArray, columns: IndexArray, shape: tuple[int, int]) -> None:
        self.rows, self.columns, self.shape = rows, columns, shape
        self._by_row = np.argsort(rows, kind="stable")
        self._used, self._starts = np.unique(rows[self._by_row], return_index=True)
        self._by_column = np.argsort(columns, kind="stable")
        self._met, self._begins = np.unique(columns[self._by_column], return_index=True)

    def largest(self, entries: FloatArray) -> FloatArray:
        """Return the largest absolute value in each row, shape (rows, states)."""
        found = np.zeros((self.shape[0], entries.shape[1]))
        if len(self._used):
            found[self._used] = np.maximum.reduceat(np.abs(entries[self._by_row]), self._starts, axis=0)
        return found

    def times(self, entries: FloatArray, x: FloatArray) -> FloatArray:
        """Return the product with a vector for each state, shape (rows, states)."""
        found = np.zeros((self.shape[0], entries.shape[1]))
        order = self._by_row
        found[self._used] = _sums(entries[order] * x[self.columns[order]], self._starts, len(self._used))
        return found

    def times_across(self, entries: FloatArray, y: FloatArray) -> FloatArray:
        """Return the product of the transposed matrix with a vector for each state, shape (columns, states)."""
        found = np.zeros((self.shape[1], entries.shape[1]))
        order = self._by_column
        found[self._met] = _sums(entries[order] * y[self.rows[order]], self._begins, len(self._met))
        return found

    def chosen(self, kept: Sequence[int]) -> tuple[Pattern, IndexArray]:
        """Return the pattern of some rows, and which entries these have."""
        number = np.full(self.shape[0], -1)
        number[list(kept)] = np.arange(len(kept))
        which = np.flatnonzero(number[self.rows] >= 0)
        return Pattern(number[self.rows[which]], self.columns[which], (len(kept), self.shape[1])), which


class Elimination:
    """Symmetric elimination ``A = L D L^T`` in an order that adds few entries.

    Parameters
    ----------
    size
        Number of unknowns.
    places
        Where the matrix has entries off its diagonal.
    late
        Unknowns that go last.
    """

    def __init__(self, size: int, places: Iterable[tuple[int, int]], late: Iterable[int] = ()) -> None:
        around = neighbours_of(places, size)
        self.size = size
        self.number: dict[tuple[int, int], int] = {(i, i): i for i in range(size)}
        for i, others in enumerate(around):
            for j in others:
                if i < j:
                    self._place(i, j)
        last = set(late)
        lists: dict[str, list[int]] = {name: [] for name in LISTS}
        for p in by_least(around, lambda i: (i in last, len(around[i]))):
            self._eliminate(p, sorted(around[p]), lists)
        begins = [*lists["begins"], len(lists["below"])]
        lists["begins"], lists["starts"] = begins, [*lists["starts"], len(lists["changed"])]
        self._touched = max((b - a for a, b in pairwise(begins)), default=0)
        self._lists = [np.array(one, dtype=np.int64) for one in lists.values()]
        self._addresses = (ctypes.c_void_p * len(LISTS))(*[one.ctypes.data for one in self._lists])

    def _place(self, i: int, j: int) -> int:
        return self.number.setdefault((i, j) if i < j else (j, i), len(self.number))

    def _eliminate(self, p: int, others: list[int], lists: dict[str, list[int]]) -> None:
        """Note what an unknown that goes changes of its neighbours."""
        lists["pivot"].append(p)
        lists["begins"].append(len(lists["below"]))
        lists["starts"].append(len(lists["changed"]))
        lists["others"] += others
        lists["below"] += [self._place(p, j) for j in others]
        for a, j in enumerate(others):
            for b in range(a, len(others)):
                lists["first"].append(a)
                lists["second"].append(b)
                lists["changed"].append(self._place(j, others[b]))

    def factorise(self, entries: FloatArray) -> FloatArray:
        """Return the factors, from entries by their `number`; where a pivot is zero nothing finite comes out."""
        room = np.empty((self._touched, entries.shape[1]))
        self._call(elimination_functions()[0], entries, room)
        return entries

    def solve(self, factors: FloatArray, right: FloatArray) -> FloatArray:
        """Return the solution for each state, shape (size, states)."""
        found = np.array(right, dtype=np.float64, order="C")
        self._call(elimination_functions()[1], factors, found)
        return found

    def _call(self, function: Callable[..., Any], entries: FloatArray, values: FloatArray) -> None:
        places = entries.ctypes.data, values.ctypes.data
        function(self._addresses, *places, len(self._lists[0]), self.size, entries.shape[1])


class Normal:
    """Least-norm solutions of ``A x = r`` by the normal equations ``A A^T y = r``, ``x = A^T y``.

    Parameters
    ----------
    whole
        Where a matrix has entries.
    kept
        The rows of it that are A.
    """

    def __init__(self, whole: Pattern, kept: Sequence[int]) -> None:
        self.whole, self.kept = whole, tuple(kept)
        self.pattern, self._which = whole.chosen(kept)
        pattern = self.pattern
        by_column: dict[int, list[tuple[int, int]]] = {}
        for entry, (row, column) in enumerate(zip(pattern.rows.tolist(), pattern.columns.tolist(), strict=True)):
            by_column.setdefault(column, []).append((row, entry))
        pairs = [(i, j, e, f) for column in by_column.values() for i, e in column for j, f in column if i <= j]
        self.elimination = Elimination(pattern.shape[0], ((i, j) for i, j, _, _ in pairs))
        number = self.elimination.number
        targets = np.array([number[i, j] for i, j, _, _ in pairs], dtype=np.intp)
        order = np.argsort(targets, kind="stable")
        self._first = np.array([e for _, _, e, _ in pairs], dtype=np.intp)[order]
        self._second = np.array([f for _, _, _, f in pairs], dtype=np.intp)[order]
        self._targets, self._starts = np.unique(targets[order], return_index=True)

    @property
    def volume(self) -> int:
        """How many numbers are worked on for each state."""
        return len(self._first) + 2 * len(self.elimination.number)

    def _factorise(self, entries: FloatArray) -> FloatArray:
        """Return the factors of the normal equations."""
        n = self.elimination.size
        square = np.zeros((len(self.elimination.number), entries.shape[1]))
        square[self._targets] = _sums(entries[self._first] * entries[self._second], self._starts, len(self._targets))
        square[:n] += _SHARE * np.max(square[:n], axis=0, initial=0.0)
        return self.elimination.factorise(square)

    def factorised(self, entries: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return what gives the shortest solutions, shape (columns, states), for one right-hand side after another."""
        entries = entries[self._which]
        factors = self._factorise(entries)

        def solve(right: FloatArray) -> FloatArray:
            found = self.pattern.times_across(entries, self.elimination.solve(factors, right))
            residual = right - self.pattern.times(entries, found)
            found += self.pattern.times_across(entries, self.elimination.solve(factors, residual))
            return found

        return solve

    def least_size(self, entries: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return the multipliers of all rows of least size whose force is that of some of those that are kept.

        The rows that are left out are combinations ``D = C K`` of those that are kept. Their multipliers minimise
        ``|k - C^T d|^2 + |d|^2``, so that ``(1 + C C^T) d = C k``.
        """
        rows, states = self.whole.shape[0], entries.shape[1]
        kept = np.array(self.kept, dtype=np.intp)
        left_out = np.setdiff1d(np.arange(rows), kept)
        sizes = or_one(self.whole.largest(entries))
        scaled = entries / sizes[self.whole.rows]
        held = scaled[self._which]
        factors = self._factorise(held)
        shares = np.empty((len(left_out), len(kept), states))
        for i, row in enumerate(left_out):
            wanted = np.zeros((self.whole.shape[1], states))
            own = np.flatnonzero(self.whole.rows == row)
            wanted[self.whole.columns[own]] = scaled[own]
            found = self.elimination.solve(factors, self.pattern.times(held, wanted))
            for _ in range(2):
                residual = wanted - self.pattern.times_across(held, found)
                found = found + self.elimination.solve(factors, self.pattern.times(held, residual))
            shares[i] = found * sizes[row] / sizes[kept]
        moved = np.moveaxis(shares, 2, 0)
        square = np.eye(len(left_out)) + moved @ np.swapaxes(moved, 1, 2)
        taken = np.linalg.solve(square, moved @ multipliers.T[:, :, None])
        every = np.zeros((rows, states))
        every[kept] = multipliers - (np.swapaxes(moved, 1, 2) @ taken)[:, :, 0].T
        every[left_out] = taken[:, :, 0].T
        return every


class Borders:
    """Solutions of ``M a + bias = G^T lambda``, ``G a + gamma = 0`` for many states, the masses first.

    Parameters
    ----------
    mass, jacobian
        Where M and G have entries.
    """

    def __init__(self, mass: Pattern, jacobian: Pattern) -> None:
        self.mass, self.jacobian = mass, jacobian
        n, m = jacobian.shape[1], jacobian.shape[0]
        places = list(zip(mass.rows.tolist(), mass.columns.tolist(), strict=True))
        borders = [(c, n + r) for r, c in zip(jacobian.rows.tolist(), jacobian.columns.tolist(), strict=True)]
        self._elimination = Elimination(n + m, [*places, *borders], range(n, n + m))
        number = self._elimination.number
        self._upper = np.flatnonzero(mass.rows <= mass.columns)
        self._masses = np.array([number[places[k]] for k in self._upper.tolist()], dtype=np.intp)
        self._slopes = np.array([number[one] for one in borders], dtype=np.intp)

    def solve(
        self, masses: FloatArray, jacobian: FloatArray, bias: FloatArray, gamma: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return the solutions."""
        n, m = len(bias), len(gamma)
        elimination = self._elimination
        entries = np.zeros((len(elimination.number), bias.shape[1]))
        entries[self._masses] = masses[self._upper]
        entries[self._slopes] = -jacobian
        factors = elimination.factorise(entries)
        right = np.concatenate([-bias, gamma])
        found = elimination.solve(factors, right)
        found = found + elimination.solve(factors, self._residual(masses, jacobian, right, found))
        a, multipliers = found[:n], found[n:]
        sizes = np.zeros((n + m, bias.shape[1]))
        sizes[:n] = self.mass.times(np.abs(masses), np.abs(a))
        sizes[:n] += self.jacobian.times_across(np.abs(jacobian), np.abs(multipliers))
        sizes[n:] = self.jacobian.times(np.abs(jacobian), np.abs(a))
        scale = np.max(sizes, axis=0, initial=0.0) + np.max(np.abs(right), axis=0, initial=0.0)
        left = self._residual(masses, jacobian, right, found)
        with np.errstate(invalid="ignore"):
            good: NDArray[np.bool_] = np.all(np.abs(left) <= 1e-10 * np.maximum(scale, 1e-300), axis=0)
        return a, multipliers, good

    def _residual(self, masses: FloatArray, jacobian: FloatArray, right: FloatArray, found: FloatArray) -> FloatArray:
        n = self.jacobian.shape[1]
        a, multipliers = found[:n], found[n:]
        forces = self.jacobian.times_across(jacobian, multipliers) - self.mass.times(masses, a)
        return np.asarray(right + np.concatenate([forces, self.jacobian.times(jacobian, a)]))


class Augmented:
    """The same solutions with ``M + s G^T G`` in place of M, where something has no mass of its own but is held.

    The constraints make the addition ``-s G^T gamma``, which goes to the other side (M. Fortin and R. Glowinski,
    *Augmented Lagrangian Methods*, chapter I).

    Parameters
    ----------
    mass, jacobian
        Where M and G have entries.
    """

    def __init__(self, mass: Pattern, jacobian: Pattern) -> None:
        by_row: dict[int, list[tuple[int, int]]] = {}
        for entry, (row, column) in enumerate(zip(jacobian.rows.tolist(), jacobian.columns.tolist(), strict=True)):
            by_row.setdefault(row, []).append((column, entry))
        number: dict[tuple[int, int], int] = {}
        own = [
            number.setdefault(one, len(number)) for one in zip(mass.rows.tolist(), mass.columns.tolist(), strict=True)
        ]
        pairs = [
            (number.setdefault((i, j), len(number)), e, f) for row in by_row.values() for i, e in row for j, f in row
        ]
        self._own, order = np.array(own, dtype=np.intp), sorted(pairs)
        targets, first, second = (np.array([one[k] for one in order], dtype=np.intp) for k in range(3))
        self._first, self._second = first, second
        self._targets, self._starts = np.unique(targets, return_index=True)
        rows, columns = (np.array([one[k] for one in number], dtype=np.intp) for k in range(2))
        self._slope, self._borders = jacobian, Borders(Pattern(rows, columns, mass.shape), jacobian)

    def solve(
        self, masses: FloatArray, jacobian: FloatArray, bias: FloatArray, gamma: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return the solutions; see `Borders.solve`."""
        share = np.max(np.abs(masses), axis=0, initial=0.0) / np.max(np.abs(jacobian), axis=0, initial=1e-300) ** 2
        share = or_one(share)
        entries = np.zeros((len(self._borders.mass.rows), bias.shape[1]))
        products = jacobian[self._first] * jacobian[self._second]
        entries[self._targets] = share * _sums(products, self._starts, len(self._targets))
        entries[self._own] += masses
        return self._borders.solve(entries, jacobian, bias + share * self._slope.times_across(jacobian, gamma), gamma)
