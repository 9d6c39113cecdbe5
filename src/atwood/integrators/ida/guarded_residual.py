"""A residual for IDA that judges each step before it is worked out, as machine code.

IDA has no place for that: it hands out steps when they are taken. But a residual that cannot be had makes it try a
quarter of the step, and which step it tries is seen from the times: time goes on only from a step that was kept.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import Array, c_void_p
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, Record, Routine
from atwood.codegen.sundials.events import EVENTS_PLACE
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.residuals import RESIDUAL, array_of
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.protocol import StepGuard

_PLACE = EVENTS_PLACE - 1
"""Which of the pointers of IDA's user data leads to what is remembered here."""

_FIELDS = dict.fromkeys(("guard", "guard_data", "residual", "kept", "tried", "verdict"), ADDRESS) | {"size": INTEGER}


@once
def _code() -> Built:
    """Return the code of the residual."""
    files = ("codegen/sundials/events.py", "codegen/sundials/residuals.py")
    routines = RoutineSource("integrators.ida.guarded_residual", files, (sundials_layout(),))
    return build_code([], CodeOptions(level=2), exports=["guarded"], routines=routines)


def write_routines(layout: SundialsLayout) -> list[Routine]:
    """Write the residual; the states kept and tried last are a time with values and rates each."""
    r = Routine("guarded", RESIDUAL, exported=True)
    t, y, yp, found, user = r.arguments
    own = Record(user.read(_PLACE, ADDRESS), _FIELDS)
    values, rates = (array_of(one, layout.vector_data) for one in (y, yp))
    size, kept, tried, verdict = own.size, own.kept, own.tried, own.verdict
    before = tried[0]
    with r.when(t == before):
        r.give_if(verdict.read(0, INTEGER) != 0, 1)
    with r.when(~(t == before)):
        with r.when(t > before):
            r.copy(kept, tried, size * 2 + 1)
        tried[0] = t
        code = r.call(own.guard, kept[0], kept.at(1), kept.at(size + 1), t, values, rates, own.guard_data)
        verdict.write(0, code.integer())
        r.give_if(code != 0, 1)
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


class GuardedResidual:
    """A residual in Python that judges each step before it is worked out.

    It has no value where a step may have passed over something, which makes IDA try a smaller one. Time goes on only
    from a step that was kept.

    Parameters
    ----------
    residual
        The residual itself.
    guard
        What judges.
    size
        How many of the unknowns, the first ones, are looked at.
    """

    def __init__(self, residual: Callable[..., Any], guard: StepGuard, size: int) -> None:
        self._residual, self._guard, self._size = residual, guard, size
        self._kept = self._tried = (0.0, np.zeros(size), np.zeros(size))
        self._passes = True

    def begin(self, t: float, y: FloatArray, yp: FloatArray) -> None:
        """Hear of a start."""
        self._kept = self._tried = (t, y[: self._size].copy(), yp[: self._size].copy())

    def __call__(self, t: float, y: FloatArray, yp: FloatArray) -> Any:
        """Return the values of the residual."""
        if t > self._tried[0]:
            self._kept = self._tried
        here = (t, y[: self._size].copy(), yp[: self._size].copy())
        if t != self._tried[0]:
            self._passes = self._guard.passes(*self._kept, *here)
        self._tried = here if self._passes else (t, *self._tried[1:])
        if not self._passes:
            raise KernelEvaluationError(f"a law may change too fast within a step to t = {t:.9g}")
        return self._residual(t, y, yp)
