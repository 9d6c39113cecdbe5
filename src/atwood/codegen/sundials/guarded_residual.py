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
from atwood.codegen.sundials.events import EVENTS_PLACE
from atwood.codegen.sundials.text import array_of, sundials_layout
from atwood.errors import UsageError

__all__ = ["guarded_residual"]

_PLACE = EVENTS_PLACE - 1
"""Which of the pointers of IDA's user data leads to what is remembered here."""

_FIELDS = ("guard", "guard_data", "residual", "kept", "tried", "verdict", "bytes")


@once
def _code() -> Built:
    """Return the code of the residual."""
    layout = sundials_layout()
    fields = "\n".join(
        f"  %{name}.at = getelementptr ptr, ptr %own, i64 {i}\n  %{name} = load ptr, ptr %{name}.at"
        for i, name in enumerate(_FIELDS)
    )
    text = f"""define i32 @guarded(double %t, ptr %y, ptr %yp, ptr %out, ptr %user) #0 {{
entry:
  %own.at = getelementptr ptr, ptr %user, i64 {_PLACE}
  %own = load ptr, ptr %own.at
{fields}
{array_of("values", "y", layout.vector_data)}
{array_of("rates", "yp", layout.vector_data)}
  %size = ptrtoint ptr %bytes to i64
  %all = mul i64 %size, 2
  %both = add i64 %all, 8
  %tried.y = getelementptr double, ptr %tried, i64 1
  %tried.yp = getelementptr i8, ptr %tried.y, i64 %size
  %kept.y = getelementptr double, ptr %kept, i64 1
  %kept.yp = getelementptr i8, ptr %kept.y, i64 %size
  %before = load double, ptr %tried
  %is.same = fcmp oeq double %t, %before
  br i1 %is.same, label %known, label %new
known:
  %said = load i64, ptr %verdict
  %was.bad = icmp ne i64 %said, 0
  br i1 %was.bad, label %bad, label %good
new:
  %is.later = fcmp ogt double %t, %before
  br i1 %is.later, label %keep, label %ask
keep:
  call void @llvm.memcpy.p0.p0.i64(ptr %kept, ptr %tried, i64 %both, i1 false)
  br label %ask
ask:
  store double %t, ptr %tried
  %t0 = load double, ptr %kept
  %code = call i32 %guard(double %t0, ptr %kept.y, ptr %kept.yp, double %t, ptr %values, ptr %rates, ptr %guard_data)
  %wide = zext i32 %code to i64
  store i64 %wide, ptr %verdict
  %is.bad = icmp ne i32 %code, 0
  br i1 %is.bad, label %bad, label %good
good:
  call void @llvm.memcpy.p0.p0.i64(ptr %tried.y, ptr %values, i64 %size, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %tried.yp, ptr %rates, i64 %size, i1 false)
  %found = call i32 %residual(double %t, ptr %y, ptr %yp, ptr %out, ptr %user)
  ret i32 %found
bad:
  ret i32 1
}}
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)"""
    return build_code([], CodeOptions(level=2), more=text, exports=["guarded"])


def guarded_residual(
    guard: tuple[int, int], residual: int, user_data: int, data_bytes: int, size: int
) -> tuple[int, Array[c_void_p], Callable[[float, FloatArray, FloatArray], None], object]:
    """Return a residual that judges steps first, IDA's user data for it, what tells it of a start, and what to keep.

    Parameters
    ----------
    guard
        Address and data of what judges.
    residual, user_data, data_bytes
        The residual itself, and its user data, which are nothing but pointers.
    size
        How many of the unknowns, the first ones, are looked at.
    """
    block = (c_void_p * (EVENTS_PLACE + 1))()
    if _PLACE * ctypes.sizeof(c_void_p) < data_bytes != ctypes.sizeof(block):  # else those of events are behind them
        raise UsageError(f"user data of {data_bytes} bytes leave no place for what judges steps")
    ctypes.memmove(block, user_data, data_bytes)
    states, verdict = np.zeros((2, 1 + 2 * size)), np.zeros(1, dtype=np.int64)
    places = [*guard, residual, states[0].ctypes.data, states[1].ctypes.data, verdict.ctypes.data, 8 * size]
    own = (c_void_p * len(places))(*places)
    block[_PLACE] = ctypes.addressof(own)

    def begin(t: float, y: FloatArray, yp: FloatArray) -> None:
        states[:] = [t, *y[:size], *yp[:size]]

    return _code().code.addresses["guarded"], block, begin, (states, verdict, own)
