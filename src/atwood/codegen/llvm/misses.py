"""By how much states miss conditions, as machine code: what NumPy would do with all slopes of all states at once."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from ctypes import c_int64, c_void_p
from functools import partial
from math import nan
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray, IndexArray, address_of
from atwood.clock import check_time
from atwood.codegen.llvm.build import RoutineSource
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, INTEGER, Kind, Record, Routine, addresses
from atwood.expr.core.program import Program

_MISSES = ctypes.CFUNCTYPE(None, c_void_p, c_int64)


def compile_misses(program: Program, places: Sequence[tuple[int, int]]) -> MissProgram:
    """Compile by how much states miss conditions.

    Parameters
    ----------
    program
        Gives values of conditions, entries of their slopes along the speeds, and what their rates have besides, of
        (t, q, u).
    places
        Row and column of each entry.
    """
    tiers = Tiers([Part("kernel", program)], ["misses"], RoutineSource("codegen.llvm.misses"))
    return MissProgram(program, tiers, np.array(places, dtype=np.int64).reshape(-1, 2).T.copy())


class MissProgram:
    """By how much states miss conditions, for any parameter values; see `compile_misses`."""

    def __init__(self, program: Program, tiers: Tiers, places: IndexArray) -> None:
        self.program, self._tiers, self._places = program, tiers, places
        _, q, u = (len(group.symbols) for group in program.inputs)
        self._sizes = q, u, len(program.outputs[0].expressions)
        self._room = 2 * len(program.outputs[0].expressions) + sum(len(one.expressions) for one in program.outputs)

    def bind(self, parameter_values: ArrayLike) -> Callable[..., FloatArray]:
        """Compute once what depends on parameters alone; return what is called with the rest."""
        return partial(self._misses, self._tiers.now.derive("kernel", self.program, parameter_values)[0])

    def _misses(
        self, derived: FloatArray, t: FloatArray, y: FloatArray, sizes: FloatArray, least: FloatArray
    ) -> FloatArray:
        """Return the largest miss of values and of rates of each state, one row of q and u each; shape (2, states).

        Each condition counts in units of its largest slope, by displacements of the sizes, or of `least` where that is
        larger. What is not finite is missed by nan.
        """
        check_time()
        built, began = self._tiers.now, perf_counter()
        room, found = np.empty(self._room + built.scratch), np.empty((2, len(t)))
        y, t, least = (np.ascontiguousarray(one) for one in (y, t, least))
        arrays = t, y, sizes, least, derived, room, self._places, found
        data = (c_int64 * len(_FIELDS))(*map(address_of, arrays), *self._sizes, self._places.shape[1])
        _MISSES(built.code.addresses["misses"])(ctypes.addressof(data), len(t))
        self._tiers.spend_on(len(t), perf_counter() - began)
        return found


_ARRAYS = ("t", "y", "sizes", "least", "derived", "room", "places", "found")
_COUNTS = ("coordinates", "speeds", "conditions", "entries")
_FIELDS: dict[str, Kind] = {**dict.fromkeys(_ARRAYS, ADDRESS), **dict.fromkeys(_COUNTS, INTEGER)}


def write_routines() -> list[Routine]:
    """Write the loop over the states."""
    r = Routine("misses", {"data": ADDRESS, "states": INTEGER}, None, exported=True)
    data, states = r.arguments
    m = Record(data, _FIELDS)
    conditions, entries = m.conditions, m.entries
    units, rates, values, slopes = (m.room.at(conditions * k) for k in range(4))
    drifts = slopes.at(entries)
    scratch = drifts.at(conditions)
    outputs = addresses(r, [values, slopes, drifts])
    worst, total = (r.variable(0.0), r.variable(0.0)), r.variable(0.0)
    with r.count(states) as state:
        y = m.y.at(state * (m.coordinates + m.speeds))
        u = y.at(m.coordinates)
        r.call("kernel", addresses(r, [m.t.at(state), y, u]), m.derived, scratch, outputs)
        r.clear(units, values)
        for one in (*worst, total):
            one.now = 0.0
        with r.count(entries) as e:
            row, column = m.places.read(e, INTEGER), m.places.read(e + entries, INTEGER)
            slope = slopes[e] * m.sizes[column]
            slopes[e] = slope
            units[row] = r.most(r.size(slope), units[row])
        with r.count(conditions) as i:
            unit = r.most(units[i], m.least[i])
            units[i] = r.choose(unit > 0.0, unit, 1.0)
        with r.count(entries) as e:
            row, column = m.places.read(e, INTEGER), m.places.read(e + entries, INTEGER)
            rates[row] = rates[row] + slopes[e] / units[row] * (u[column] / m.sizes[column])
        with r.count(conditions) as i:
            unit = units[i]
            for one, value in zip(worst, (values[i] / unit, rates[i] + drifts[i] / unit), strict=True):
                miss = r.size(value)
                one.now, total.now = r.most(miss, one.now), total.now + miss
        for k, one in enumerate(worst):
            m.found[k * states + state] = r.choose(r.is_finite(total.now), one.now, nan)
    return [r]
