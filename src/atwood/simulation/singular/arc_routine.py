"""Sweeps of an arc as machine code: what `atwood.simulation.singular.collocation` does until nothing changes.

States at the points are taken onto the constraints, rates are asked for there, and both are integrated.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import address_of
from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Kind, Record, Routine, Value
from atwood.integrators.protocol import CompiledRates

SWEPT, ELSEWHERE, NOWHERE = range(3)
"""What sweeps return: that they are done; that states are to be taken onto constraints in another way; that there the
motion does not go on."""

SWEEPS = 60

PATIENCE = 8
"""In so many sweeps changes must become clearly smaller."""

SETTLED = 3e-13
"""Relative to the scene's sizes: ten times what the next sweep would change must be less. Near singular positions
rounding leaves 1e-12 of what forces are asked for, and further sweeps would only stir it."""

ROUNDED = 1e-8
"""Relative to the scene's sizes: changes that are smaller and do not shrink any more are those of rounding."""

TOO_FAR = 1e3
"""Relative to the scene's sizes: where a sweep changes more, no motion is found."""

LAST = 2
"""What the last so many coefficients add up to tells the error of a polynomial."""

_HOPELESS, _KNOWN = 10.0, 0.03
"""Once sweeps change less than the second share of that error they change it by less than a half: an arc on which it is
so many times what is asked for is none to take."""

_SETTLE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)

_ARRAYS = ("times", "integral", "values", "first", "states", "held", "later", "rates", "integrated", "sizes")
_FUNCTIONS = ("project", "project_data", "function", "function_data")
_COUNTS = ("points", "coordinates", "unknowns", "is_plain")
ARC: dict[str, Kind] = {
    **dict.fromkeys((*_ARRAYS, *_FUNCTIONS), ADDRESS),
    **dict.fromkeys(_COUNTS, INTEGER),
    **dict.fromkeys(("settled", "half", "accurate", "change", "error"), NUMBER),
}
"""What an arc is swept with; the first are the arguments of `Sweeps`."""


class Sweeps:
    """Sweeps of an arc.

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

    settle, settled, accurate
        The address of the routine that sweeps, what the next sweep would change where it ends, and an error from which
        on an arc is not taken, both relative to the sizes.

    Attributes
    ----------
    integrated
        Coefficients of coordinates and speeds.
    address
        Where its record is.
    """

    def __init__(
        self,
        code: CompiledRates,
        arrays: Sequence[NDArray[Any]],
        half: float,
        coordinates: int,
        is_plain: bool,
        settle: int,
        settled: float,
        accurate: float = np.inf,
    ) -> None:
        times, integral, values, first, states, sizes = (np.ascontiguousarray(one) for one in arrays)
        points, unknowns = states.shape
        self.states, self.integrated = states, np.empty((len(integral), unknowns))
        room = np.empty((3 * points, unknowns))
        parts = (room[:points], room[points : 2 * points], room[2 * points :])
        self._kept = code, times, integral, values, first, sizes, room
        given = (times, integral, values, first, states, *parts, self.integrated, sizes)
        self._data = np.zeros(len(ARC), dtype=np.int64)
        self._data[:-5] = [
            *map(address_of, given),
            *(code.project, code.project_data, code.function, code.data),
            *(points, coordinates, unknowns, is_plain),
        ]
        self._data[-5:].view(float)[:3] = settled, half, accurate
        self.address = address_of(self._data)
        self._run: Any = _SETTLE(settle)

    def __call__(self) -> int:
        """Sweep until nothing changes, and return how that went."""
        return int(self._run(self.address))

    @property
    def error(self) -> float:
        """Estimate of the largest error of the states, relative to the sizes."""
        return float(self._data[-1:].view(float)[0])


def write_sweeps() -> list[Routine]:
    """Write what sweeps once, and until nothing changes."""
    return [_sweep(), _settle()]


def _settle() -> Routine:
    """Write sweeps until nothing changes, or where they do not come to that."""
    r = Routine("settle", {"data": ADDRESS}, exported=True)
    data = r.arguments[0]
    m = Record(data, ARC)
    changes, last = r.array(SWEEPS), r.variable(np.inf)
    with r.count(SWEEPS) as k:
        code = r.call("sweep", data)
        with r.when(code != SWEPT):
            r.give(code)
        change = m.change
        changes[k] = change
        r.give_if(~(change <= TOO_FAR), NOWHERE)
        with r.when((k >= PATIENCE) & (change > ROUNDED)), r.when(change > 0.3 * changes[k + (1 - PATIENCE)]):
            r.give(NOWHERE)
        left = r.choose(last.now < np.inf, change * change / last.now, change)  # what the next would change, about
        is_still = r.least(change, 10.0 * left) < m.settled
        rest = r.variable(0.0)
        with r.count(m.unknowns) as j:
            one, other = (m.integrated[(m.points - i) * m.unknowns + j] for i in range(LAST))
            total = r.size(one) + r.size(other)
            rest.now = r.most(total / m.sizes[j], rest.now)
        is_hopeless = (change < _KNOWN * rest.now) & (rest.now > _HOPELESS * m.accurate)
        with r.when(is_still | is_hopeless | ((change < ROUNDED) & (change >= 0.5 * last.now))):
            m.error = r.most(r.least(change, left), rest.now)
            r.give(SWEPT)
        last.now = change
    r.give(NOWHERE)
    return r


def _sweep() -> Routine:
    """Write one sweep."""
    r = Routine("sweep", {"data": ADDRESS})
    m = Record(r.arguments[0], ARC)
    points, n, width = m.points, m.coordinates, m.unknowns
    held, later, rates = m.held, m.later, m.rates
    with r.count(points) as i:
        state, row = held.at(i * width), i * width
        r.copy(state, m.states.at(row), width)
        r.give_if(misses(r, m, m.times[i], state, width), ELSEWHERE)
        r.call(m.function, m.times[i], state, rates.at(row), m.function_data)
    for_speeds = n, width
    _integrate(r, m, for_speeds)
    _evaluate(r, m, later, for_speeds)
    with r.count(points) as i:
        state = later.at(i * width)
        r.copy(state, held.at(i * width), n)
        holds = held.at(i * width)
        r.copy(holds, state, width)
        r.give_if(misses(r, m, m.times[i], holds, width), NOWHERE)
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
    return r


def misses(r: Routine, m: Record, t: Value, state: Value, width: Value) -> Value:
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
