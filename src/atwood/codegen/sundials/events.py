"""Values of events as machine code: as the explicit methods call them, and as SUNDIALS IDA does.

They tell in which steps something may happen, so that no Python runs in all the others: where a sign has changed, and
where the tangents at the ends of a step leave room for a value that passes zero and comes back
(`atwood.integrators.event_location`). IDA itself locates no roots: it gives up where a value is
zero up to its own rounding of time, as beside an extreme.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import Array, c_double, c_int, c_int64, c_void_p

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import address_of
from atwood.codegen.llvm.build import RoutineSource, prologue_at
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    INTEGER,
    NUMBER,
    Kind,
    Record,
    Routine,
    Value,
    call_kernel,
    place_of,
)
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.residuals import array_of
from atwood.codegen.tangents import SECANT, STEEP
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

EVENTS_PLACE = 31
"""Which of the pointers of IDA's user data leads to the data of the events."""

EVENTS = ctypes.CFUNCTYPE(c_int, c_double, *[c_void_p] * 4)
_ARGUMENTS = {"t": NUMBER} | dict.fromkeys(("y", "yp", "values", "data"), ADDRESS)


@dataclass(frozen=True, eq=False)
class EventData:
    """The event functions of one session, with its own memory.

    Attributes
    ----------
    plain
        Address of ``int (double t, const double *y, const double *yp, double *values, void *data)``.
    explicit
        The same for use after every step: it returns -2 where a value may have passed zero since then.
    ida
        Address of an ``IDARootFn`` that does so too, and else says that nothing is zero; its user data hold `address`
        at `EVENTS_PLACE`.
    address
        The last argument of the first.
    count
        Number of events.
    memory
        What the functions remember from step to step.
    arrays
        What depends on parameters alone, and what is added to each value.
    prologue
        Addresses of the function that computes the former, and of its scratch.
    faster
        Told for how long, in seconds, steps have been taken, or 0 at a start, it returns the address of what is faster
        in the place of `explicit`, as soon as that pays; None before. It is None where there is nothing faster.
    keep
        Whatever must live as long as the addresses are used.
    """

    plain: int
    explicit: int
    ida: int
    address: int
    count: int
    memory: NDArray[np.float64]
    arrays: tuple[NDArray[np.float64], NDArray[np.float64]]
    prologue: tuple[int, int]
    faster: Callable[[float], int | None] | None
    keep: object

    def restart(self, t: float) -> None:
        """Forget what was seen before a new start."""
        self.memory[:] = 0.0
        self.memory[0] = t

    def take_over(self, last: float, length: float, values: NDArray[np.float64], slopes: NDArray[np.float64]) -> None:
        """Know what was seen at the last point: its time, the length over which slopes are taken, values and slopes."""
        self.memory[:3] = last, length, 0.0
        self.memory[3 : 3 + 2 * self.count] = np.concatenate([values, slopes])

    def has_noticed(self) -> bool:
        """Return, once, whether a value may have passed zero."""
        said = self.memory[2] != 0.0
        self.memory[2] = 0.0
        return bool(said)

    def function(self) -> Callable[[float, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]:
        """Return the values as a function of (t, y, y')."""
        call, found, address = EVENTS(self.plain), np.empty(self.count), self.address
        place = found.ctypes.data

        def values(
            t: float, y: NDArray[np.float64], yp: NDArray[np.float64], _: EventData = self
        ) -> NDArray[np.float64]:
            state = np.ascontiguousarray(y, dtype=np.float64)
            call(t, state.ctypes.data, None, place, address)
            return found.copy()

        return values

    def joined(self, user_data: int, size: int) -> Array[c_void_p]:
        """Return user data of IDA's other functions with those of the events behind them."""
        block = (c_void_p * (EVENTS_PLACE + 1))()
        if size > EVENTS_PLACE * ctypes.sizeof(c_void_p):
            raise UsageError(f"user data of {size} bytes leave no place for those of events")
        ctypes.memmove(block, user_data, size)
        block[EVENTS_PLACE] = self.address
        return block


class EventCode:
    """The values of events as machine code, for any parameter values.

    Parameters
    ----------
    program
        Program of (t, q, u, shift) with one output group.
    tiers
        The code.
    """

    def __init__(self, program: Program, tiers: Tiers) -> None:
        self.program, self._tiers = program, tiers

    def bind(self, parameter_values: ArrayLike, shifts: ArrayLike) -> EventData:
        """Return the functions for one session."""
        shift, tiers, built = np.array(shifts, dtype=np.float64), self._tiers, self._tiers.now
        derived, scratch = built.derive("kernel", self.program, parameter_values)
        coordinates, speeds = (len(self.program.inputs[k].symbols) for k in (1, 2))
        counts = coordinates, coordinates + speeds, len(shift)
        memory = np.zeros(3 + 3 * len(shift) + coordinates + speeds)
        arrays: tuple[NDArray[np.float64], ...] = (derived, scratch, shift, memory)
        data = (c_int64 * 7)(*(array.ctypes.data for array in arrays), *counts)
        plain, explicit, ida = (built.code.addresses.get(name, 0) for name in ("events", "look", "ida_events"))
        prologue = built.code.addresses["kernel_prologue"], scratch.ctypes.data

        def faster(seconds: float) -> int | None:
            now = tiers.spend(seconds)
            return None if now is built else now.code.addresses["look"]

        return EventData(
            plain,
            explicit,
            ida,
            ctypes.addressof(data),
            len(shift),
            memory,
            (derived, shift),
            prologue,
            faster if tiers.has_better else None,
            (built, scratch, data),
        )

    def fill(self, data: EventData, parameter_values: ArrayLike, shifts: ArrayLike) -> None:
        """Give the functions of a session other parameters and shifts; arguments as of `bind`."""
        (derived, shift), (prologue, scratch) = data.arrays, data.prologue
        shift[:] = shifts
        values = np.array(parameter_values, dtype=np.float64)
        prologue_at(prologue)(address_of(values), address_of(derived), scratch)


def compile_events(program: Program, for_ida: bool, is_brief: bool = False) -> EventCode:
    """Compile the values of events; brief ones are used for short stretches at a time."""
    groups = [len(group.symbols) for group in program.inputs]
    if len(groups) != 4 or groups[0] != 1 or [groups[3]] != [len(program.results)]:
        raise UsageError(f"needs the input groups t, q, u and shift, not groups of {groups}", where=program.name)
    layout = sundials_layout() if for_ida else None
    exports = ["events", "look", *(["ida_events"] if for_ida else [])]
    files = ("codegen/sundials/residuals.py", "codegen/tangents.py")
    routines = RoutineSource("codegen.sundials.events", files, (layout,))
    return EventCode(program, Tiers([Part("kernel", program)], exports, routines, is_brief, is_quick=not for_ida))


def write_routines(layout: SundialsLayout | None) -> list[Routine]:
    """Write the values of events, what compares them with those at the last point, and the function that IDA calls."""
    written = [_values(), _look()]
    return [*written, _ida_events(layout)] if layout is not None else written


_DATA: dict[str, Kind] = dict.fromkeys(("derived", "scratch", "shift", "memory"), ADDRESS)
_DATA |= dict.fromkeys(("coordinates", "size", "count"), INTEGER)


def _values() -> Routine:
    r = Routine("events", _ARGUMENTS, exported=True)
    t, y, _, values, data = r.arguments
    m = Record(data, _DATA)
    inputs = [place_of(r, t), y, y.at(m.coordinates), m.shift]
    r.give(call_kernel(r, "kernel", inputs, m.derived, m.scratch, [values]))
    return r


def _look() -> Routine:
    """Remember the last point, and compare signs and tangents; -2 where zero may be passed.

    The memory: the time of the last point, the length over which slopes are taken, whether it has said so, and then
    values and slopes at the last point, and room for another row of values and for a state.
    """
    r = Routine("look", _ARGUMENTS, exported=True)
    t, y, yp, values, data = r.arguments
    code, m = r.call("events", t, y, yp, values, data), Record(data, _DATA)
    memory, count = m.memory, m.count
    lasts = memory.at(3)
    slopes, others, shifted = (lasts.at(count * k) for k in (1, 2, 3))
    own = Record(memory, dict.fromkeys(("last", "length", "said"), NUMBER))
    width = t - own.last
    r.give_if((width <= 0.0) | (code != 0), code)
    length = r.most(width, own.length * 0.5)
    own.length, own.last = length, t
    past = length * SECANT
    with r.count(m.size) as i:
        shifted[i] = y[i] - yp[i] * past
    has_slopes = r.call("events", t - past, shifted, yp, others, data) == 0
    found = r.variable(0, BOOLEAN)
    with r.count(count) as k:
        first, first_slope, value = lasts[k], slopes[k], values[k]
        slope = r.choose(has_slopes, (value - others[k]) / past, 0.0)
        lasts[k], slopes[k] = value, slope
        found.now = found.now | may_pass_zero(r, width, (first, first_slope), (value, slope))
    with r.when(found.now & (width > 0.0)):
        own.said = 1.0
        r.give(-2)
    r.give(0)
    return r


def may_pass_zero(r: Routine, width: Value, first: tuple[Value, Value], last: tuple[Value, Value]) -> Value:
    """Tell whether signs differ, or tangents at both ends leave room for a dip between them."""
    sign = r.choose(last[0] < 0.0, -1.0, 1.0)
    a, b, signed = first[0] * sign, last[0] * sign, width * sign
    down, up = first[1] * signed, last[1] * signed
    turns = (a + down <= 0.0) | (b - up <= 0.0)
    steep = r.most(r.size(down), r.size(up)) > r.most(a, b) * STEEP
    return ~((a > 0.0) & (b > 0.0)) | turns | steep


def _ida_events(layout: SundialsLayout) -> Routine:
    """Write the function that IDA calls, to which nothing ever is zero."""
    r = Routine("ida_events", _ARGUMENTS, exported=True)
    t, *vectors, values, user = r.arguments
    y, yp = (array_of(one, layout.vector_data) for one in vectors)
    data = user.read(EVENTS_PLACE, ADDRESS)
    code = r.call("look", t, y, yp, values, data)
    with r.count(Record(data, _DATA).count) as k:
        values[k] = 1.0
    r.give(code)
    return r
