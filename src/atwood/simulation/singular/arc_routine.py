"""One sweep of an arc as machine code: what `atwood.simulation.singular.collocation` does again and again.

States at the points are taken onto the constraints, rates are asked for there, and both are integrated.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import address_of
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Kind, Record, Routine, Value
from atwood.integrators.protocol import CompiledRates

SWEPT, ELSEWHERE, NOWHERE = range(3)
"""What a sweep returns: that it is done; that states are to be taken onto constraints in another way; that there the
motion does not go on."""

_SWEEP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)

_ARRAYS = ("times", "integral", "values", "first", "states", "held", "later", "rates", "integrated", "sizes")
_FUNCTIONS = ("project", "project_data", "function", "function_data")
_COUNTS = ("points", "coordinates", "unknowns", "is_plain")
_FIELDS: dict[str, Kind] = {
    **dict.fromkeys((*_ARRAYS, *_FUNCTIONS), ADDRESS),
    **dict.fromkeys(_COUNTS, INTEGER),
    **dict.fromkeys(("half", "change"), NUMBER),
}


class Sweep:
    """Sweeps of one arc.

    Parameters
    ----------
    code
        Gives rates, and takes states onto the constraints.
    arrays
        The times of the points; what gives coefficients of an integral from values at the points, and values from
        coefficients; the state at the start; what is guessed at the points, one row of coordinates and speeds each,
        in whose place a sweep puts what it gives; and sizes of coordinates and speeds, by which changes are measured.
    half
        Half the length of the arc, s.
    coordinates, is_plain
        Their number, and whether the speeds are their rates.

    Attributes
    ----------
    integrated
        Coefficients of coordinates and speeds.
    """

    def __init__(
        self,
        code: CompiledRates,
        arrays: Sequence[NDArray[Any]],
        half: float,
        coordinates: int,
        is_plain: bool,
    ) -> None:
        times, integral, values, first, states, sizes = (np.ascontiguousarray(one) for one in arrays)
        points, unknowns = states.shape
        self.states, self.integrated = states, np.empty((len(integral), unknowns))
        room = np.empty((3 * points, unknowns))
        parts = (room[:points], room[points : 2 * points], room[2 * points :])
        self._kept = code, times, integral, values, first, sizes, room
        given = (times, integral, values, first, states, *parts, self.integrated, sizes)
        self._data = np.zeros(len(_FIELDS), dtype=np.int64)
        self._data[:-2] = [
            *map(address_of, given),
            *(code.project, code.project_data, code.function, code.data),
            *(points, coordinates, unknowns, is_plain),
        ]
        self._numbers = self._data[-2:].view(float)
        self._numbers[0] = half
        self._run: Any = _SWEEP(_code().code.addresses["sweep"])

    def __call__(self) -> int:
        """Sweep once, and return how that went."""
        return int(self._run(address_of(self._data)))

    @property
    def change(self) -> float:
        """By how much the last sweep changed the states, relative to the sizes."""
        return float(self._numbers[1])


@once
def _code() -> Built:
    source = RoutineSource("simulation.singular.arc_routine")
    return build_code([], CodeOptions(level=2), exports=["sweep"], routines=source)


def write_routines() -> list[Routine]:
    """Write one sweep."""
    r = Routine("sweep", {"data": ADDRESS}, exported=True)
    m = Record(r.arguments[0], _FIELDS)
    points, n, width = m.points, m.coordinates, m.unknowns
    held, later, rates = m.held, m.later, m.rates
    with r.count(points) as i:
        state, row = held.at(i * width), i * width
        r.copy(state, m.states.at(row), width)
        with r.when(_misses(r, m, m.times[i], state, width)):
            r.give(ELSEWHERE)
        r.call(m.function, m.times[i], state, rates.at(row), m.function_data)
    for_speeds = n, width
    _integrate(r, m, for_speeds)
    _evaluate(r, m, later, for_speeds)
    with r.count(points) as i:
        state = later.at(i * width)
        r.copy(state, held.at(i * width), n)
        holds = held.at(i * width)
        r.copy(holds, state, width)
        with r.when(_misses(r, m, m.times[i], holds, width)):
            r.give(NOWHERE)
        with r.when(m.is_plain != 0):
            r.copy(rates.at(i * width), holds.at(n), n)
        with r.otherwise():
            r.call(m.function, m.times[i], holds, rates.at(i * width), m.function_data)
    for_coordinates = 0, n
    _integrate(r, m, for_coordinates)
    _evaluate(r, m, later, for_coordinates)
    change, total = r.variable(0.0), r.variable(0.0)
    with r.count(points) as i, r.count(width) as j:
        share = r.size(later[i * width + j] - m.states[i * width + j]) / m.sizes[j]
        change.now, total.now = r.most(share, change.now), total.now + share
    m.change = r.choose(r.is_finite(total.now), change.now, np.inf)
    r.copy(m.states, later, points * width)
    r.give(SWEPT)
    return [r]


def _misses(r: Routine, m: Record, t: Value, state: Value, width: Value) -> Value:
    """Take a state onto the constraints; return whether that failed."""
    failed, total = r.variable(0, BOOLEAN), r.variable(0.0)
    with r.when(~r.is_null(m.project)):
        failed.now = r.call(m.project, t, state, m.project_data) != 0
    with r.count(width) as j:
        total.now = total.now + state[j]
    return failed.now | ~r.is_finite(total.now)


def _integrate(r: Routine, m: Record, of: tuple[Value | int, Value]) -> None:
    """Write coefficients of the integral of rates, from the start."""
    begin, end = of
    with r.count(m.points + 1) as k, r.count(end, begin) as j:
        total = r.variable(0.0)
        with r.count(m.points) as i:
            total.now = total.now + m.integral[k * m.points + i] * m.rates[i * m.unknowns + j]
        m.integrated[k * m.unknowns + j] = m.half * total.now + r.choose(k == 0, m.first[j], 0.0)


def _evaluate(r: Routine, m: Record, target: Value, of: tuple[Value | int, Value]) -> None:
    """Write values at the points from coefficients."""
    begin, end = of
    with r.count(m.points) as i, r.count(end, begin) as j:
        total = r.variable(0.0)
        with r.count(m.points + 1) as k:
            total.now = total.now + m.values[i * (m.points + 1) + k] * m.integrated[k * m.unknowns + j]
        target[i * m.unknowns + j] = total.now
