"""How far rounding can take the Jacobian of conditions: what they were computed from is off by a little, too.

Coordinates are known to a few units in the last place, of the larger of their value and of what counts as large for
them; parameters and every operation round as well (`atwood.codegen.rounding`).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, uneven
from atwood.codegen.rounding import ROUGHNESS, RoughProgram, roughly
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.numerics.matrices import Matrix, from_entries, is_full, scaled
from atwood.simulation.dynamics.kinematic_map import KinematicMap
from atwood.tolerances import tolerances

_ROUGH: Key[RoughProgram] = Key("program in rough arithmetic")


_GROWN = 10.0
"""Errors are looked at again once a coordinate, or the time that has passed, is so many times as large as before."""

_ASIDE = 0.1
"""Relative to the scales: how far from a place errors about it are looked at; there, nothing is exact or infinite."""


class RowErrors:
    """How far rounding can take each condition: its value, and its slopes along the speeds.

    Parameters
    ----------
    assembly
        The scene.
    program, groups
        The program of (t, q, u), and the names of the output groups, that values and entries of slopes come from, and
        the rates of values where nothing but time moves, if there are any.
    laws
        The law that each condition belongs to. What a law holds are components of one vector as a rule, in axes that
        could be any: each is as uncertain as the most uncertain one.
    places
        The row and the column of each entry.
    kinematic_map
        How the coordinates move with the speeds.
    of_coordinates
        Whether the entries are derivatives by coordinates, and not along the speeds.
    """

    def __init__(
        self,
        assembly: Assembly,
        program: Program,
        groups: tuple[str, ...],
        laws: Sequence[Hashable],
        places: tuple[Any, Any],
        kinematic_map: KinematicMap,
        of_coordinates: bool = False,
    ) -> None:
        self._assembly, self._program, self._groups, self._kinematic_map = assembly, program, groups, kinematic_map
        self._rows, self._columns = (np.asarray(one, dtype=np.intp) for one in places)
        number = {law: i for i, law in enumerate(dict.fromkeys(laws))}
        self._laws = np.array([number[law] for law in laws], dtype=np.intp)
        self._of_coordinates = of_coordinates and not kinematic_map.is_plain
        self._first: float | None = None
        self._reach = self._passed = 0.0
        self._values = self._entries = np.zeros(0)
        self._tangent: Matrix | None = None
        self._known: tuple[FloatArray, FloatArray] | None = None

    @property
    def laws(self) -> NDArray[np.intp]:
        """The number of the law that each condition belongs to."""
        return self._laws

    def near(self, t: float, q: FloatArray, scales: FloatArray) -> FloatArray:
        """Return how far rounding can take values and slopes where coordinates are of like size, shape (rows,)."""
        reach, first = float(np.abs(q).max(initial=0.0)), self._first is None
        passed = 0.0 if self._first is None else abs(t - self._first)
        if first or reach > _GROWN * self._reach or (self.moves_by_itself and passed > _GROWN * self._passed):
            aside = _ASIDE * scales * uneven(len(scales))
            self._learn(t, self._kinematic_map.moved(t, q, aside), scales)
            # Afterwards, so that whoever is interrupted meanwhile learns again.
            self._known, self._reach, self._passed = None, max(reach, self._reach, 1.0), max(passed, self._passed)
            self._first = t if self._first is None else self._first
        if self._known is None or self._known[0] is not scales:
            found = self.shared(np.maximum(self._values, self._of_rows(self._entries, self._tangent, scales)))
            self._known = scales, found
        return self._known[1]

    @cached_property
    def moves_by_itself(self) -> bool:
        """Whether the conditions depend on time."""
        return any(one.operation == "symbol" and one in self._program.inputs[0].symbols for one in self._program.nodes)

    def _learn(self, t: float, q: FloatArray, scales: FloatArray) -> None:
        found, slopes, rates = self._rough(t, q, scales, 1.0)
        values, entries, tangent = _spread(found), _spread(slopes), self._kinematic_matrix(t, q)
        fastest, rounds = float(np.max(np.abs(rates), initial=0.0)), _spread(rates)
        # In the time in which what is prescribed moves by as much as the coordinates are scaled by; where it hardly
        # moves yet, its rate is rounding itself, and says nothing of such a time.
        if fastest > 0.0 and float(np.max(rounds)) <= tolerances.KNOWN * fastest:
            sizes = self._of_rows(np.max(np.abs(slopes), axis=1), tangent, scales)
            values = np.maximum(values, rounds * (float(np.max(sizes)) / fastest))
        if len(self._entries):
            values, entries = np.maximum(values, self._values), np.maximum(entries, self._entries)
            if tangent is not None and self._tangent is not None:
                tangent = np.maximum(tangent, self._tangent) if is_full(tangent) else tangent.maximum(self._tangent)
        self._values, self._entries, self._tangent = values, entries, tangent

    def of_jacobian(
        self, t: float, q: FloatArray, scales: FloatArray, miss: float = 0.0, of_rates: bool = False
    ) -> FloatArray:
        """Return how far rounding can take slopes at a place that is known no better than the values, shape (rows,)."""
        tangent = self._kinematic_matrix(t, q)
        values, found, _ = self._rough(t, q, scales, 1.0)
        errors = self._of_rows(_spread(found), tangent, scales)
        if of_rates:
            return self.shared(errors)
        sizes = np.maximum(self._of_rows(np.max(np.abs(found), axis=1), tangent, scales), errors / ROUGHNESS)
        unknown = np.divide(_spread(values), sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
        # A row that says no more of the place than that is followed by no step to it, and is no row here either.
        is_followed = unknown < 1.0 / (tolerances.TRUSTED * tolerances.RANK)
        off = max(miss, float(np.max(unknown, where=is_followed, initial=0.0))) / ROUGHNESS
        if off > 1.0:
            errors = self._of_rows(_spread(self._rough(t, q, scales, off)[1]), tangent, scales)
        errors = np.where(is_followed, errors, np.maximum(errors, sizes))
        return self.shared(errors)

    def of_values(self, t: float, q: FloatArray, scales: FloatArray) -> FloatArray:
        """Return how far rounding can take values at a place where nothing moves by itself, shape (rows,)."""
        return self.shared(_spread(self._rough(t, q, scales, 1.0)[0]))

    def shared(self, sizes: FloatArray, chosen: NDArray[np.intp] | None = None) -> FloatArray:
        """Return for each condition, or some, the largest of those of its law: of errors, or of the sizes of rows."""
        laws = self._laws if chosen is None else self._laws[chosen]
        largest = np.zeros(len(self._laws))
        np.maximum.at(largest, laws, sizes)
        return largest[laws]

    def _rough(
        self, t: float, q: FloatArray, scales: FloatArray, off: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return values, entries and rates, each in as many ways, with coordinates off by so many roundings."""
        rough, count = self._assembly.shared.get(_ROUGH, self._rough_program, self._program), len(self._laws)
        speeds = np.zeros(len(self._program.inputs[2].symbols))
        places = q[:, None] * roughly(len(q))
        steps = off * scales[:, None] * (roughly(len(scales), len(q)) - 1.0)
        places = places + (steps if self._kinematic_map.is_plain else self._kinematic_map.matrix(t, q) @ steps)
        found = rough(self._assembly.parameter_values, t * roughly(1), places, speeds)
        found = np.where(np.all(np.isfinite(found), axis=1, keepdims=True), found, 0.0)  # others say that it has none
        slopes = count + len(self._rows)
        return found[:count], found[count:slopes], found[slopes:]

    def _rough_program(self) -> RoughProgram:
        """Return the rough program."""
        by_name = {one.name: one.expressions for one in self._program.outputs}
        symbols = self._program.parameters, *(group.symbols for group in self._program.inputs)
        return RoughProgram(symbols, tuple(one for name in self._groups for one in by_name[name]))

    def _kinematic_matrix(self, t: float, q: FloatArray) -> Matrix | None:
        return abs(self._kinematic_map.matrix(t, q)) if self._of_coordinates else None

    def _of_rows(self, entries: FloatArray, tangent: Matrix | None, scales: FloatArray) -> FloatArray:
        """Return the sizes of rows from those of their entries."""
        count = len(self._laws)
        if tangent is not None:
            places = from_entries(self._rows, self._columns, entries, (count, tangent.shape[0]), is_full(tangent))
            rows = scaled(places @ tangent, scales)
            return np.asarray(np.linalg.norm(rows, axis=1) if is_full(rows) else np.sqrt((rows * rows).sum(axis=1)))
        squares = np.bincount(self._rows, (entries * scales[self._columns]) ** 2, count)
        return np.asarray(np.sqrt(squares))


def _spread(values: FloatArray) -> FloatArray:
    return np.asarray(values.max(axis=1, initial=-np.inf) - values.min(axis=1, initial=np.inf))
