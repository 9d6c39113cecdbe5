"""A residual for IDA that judges each step before it is worked out, as machine code.

IDA has no place for that: it hands out steps when they are taken. But a residual that cannot be had makes it try a
quarter of the step, and which step it tries is seen from the times: time goes on only from a step that was kept.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import Array, c_void_p

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, build_code
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.once import once
from atwood.codegen.routines.kinds import ADDRESS, INTEGER
from atwood.codegen.routines.language import Record, Routine
from atwood.codegen.routines.source import RoutineSource
from atwood.codegen.sundials.events import EVENTS_PLACE
from atwood.codegen.sundials.ida_routines import RESIDUAL, array_of
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.errors import UsageError

_PLACE = EVENTS_PLACE - 1
"""Which of the pointers of IDA's user data leads to what is remembered here."""

_FIELDS = dict.fromkeys(("guard", "guard_data", "residual", "kept", "tried", "verdict"), ADDRESS) | {"size": INTEGER}


@once
def _code() -> Built:
    """Return the code of the residual."""
    files = ("codegen/sundials/events.py", "codegen/sundials/ida_routines.py")
    routines = RoutineSource("codegen.sundials.guarded_residual", files, (sundials_layout(),))
    return build_code([], CodeOptions(level=2), exports=["guarded"], routines=routines)


def write_routines(layout: SundialsLayout) -> list[Routine]:
    """Write the residual; the states kept and tried last are a time with values and rates each."""
    r = Routine("guarded", RESIDUAL, exported=True)
    t, y, yp, found, user = r.arguments
    own = Record(user.read(_PLACE, ADDRESS), _FIELDS)
    values, rates = (array_of(one, layout.vector_data) for one in (y, yp))
    size, kept, tried, verdict = own.size, own.kept, own.tried, own.verdict
    before = tried[0]
    with r.when(t == before), r.when(verdict.read(0, INTEGER) != 0):
        r.give(1)
    with r.when(~(t == before)):
        with r.when(t > before):
            r.copy(kept, tried, size * 2 + 1)
        tried[0] = t
        code = r.call(own.guard, kept[0], kept.at(1), kept.at(size + 1), t, values, rates, own.guard_data)
        verdict.write(0, code.integer())
        with r.when(code != 0):
            r.give(1)
    r.copy(tried.at(1), values, size)
    r.copy(tried.at(size + 1), rates, size)
    r.give(r.call(own.residual, t, y, yp, found, user))
    return [r]


def guarded_residual(
    guard: tuple[int, int], residual: int, user_data: int, data_bytes: int, size: int
) -> tuple[int, Array[c_void_p], Callable[[float, FloatArray, FloatArray], None], object]:
    """Return a residual that judges steps first, IDA's user data for it, what tells it of a start, and what to keep."""
    block = (c_void_p * (EVENTS_PLACE + 1))()
    if _PLACE * ctypes.sizeof(c_void_p) < data_bytes != ctypes.sizeof(block):  # else those of events are behind them
        raise UsageError(f"user data of {data_bytes} bytes leave no place for what judges steps")
    ctypes.memmove(block, user_data, data_bytes)
    states, verdict = np.zeros((2, 1 + 2 * size)), np.zeros(1, dtype=np.int64)
    places = [*guard, residual, states[0].ctypes.data, states[1].ctypes.data, verdict.ctypes.data, size]
    own = (c_void_p * len(places))(*places)
    block[_PLACE] = ctypes.addressof(own)

    def begin(t: float, y: FloatArray, yp: FloatArray) -> None:
        states[:] = [t, *y[:size], *yp[:size]]

    return _code().code.addresses["guarded"], block, begin, (states, verdict, own)
