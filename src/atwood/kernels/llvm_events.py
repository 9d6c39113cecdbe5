"""Values of events as machine code: as the explicit methods call them, and as SUNDIALS IDA does.

They tell in which steps something may happen, so that no Python runs in all the others.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import Array, c_double, c_int, c_void_p
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.errors import UsageError
from atwood.expr.program import Program
from atwood.kernels.llvm_build import Built, build_code, default_options
from atwood.kernels.llvm_ida_text import array_of, sundials_layout
from atwood.kernels.llvm_module import Part

__all__ = ["EVENTS_PLACE", "EventCode", "EventData", "compile_events"]

EVENTS_PLACE = 31
"""Which of the pointers of IDA's user data leads to the data of the events."""

_EVENTS = ctypes.CFUNCTYPE(c_int, c_double, *[c_void_p] * 4)
_PROLOGUE = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)

_TEXT = """define i32 @events(double %t, ptr %y, ptr %yp, ptr %values, ptr %data) #0 {{
  %time = alloca double
  %inputs = alloca [4 x ptr]
  %outputs = alloca ptr
  store double %t, ptr %time
  %u = getelementptr double, ptr %y, i64 {count}
  %shift.at = getelementptr ptr, ptr %data, i64 2
  %shift = load ptr, ptr %shift.at
  %second = getelementptr ptr, ptr %inputs, i64 1
  %third = getelementptr ptr, ptr %inputs, i64 2
  %fourth = getelementptr ptr, ptr %inputs, i64 3
  store ptr %time, ptr %inputs
  store ptr %y, ptr %second
  store ptr %u, ptr %third
  store ptr %shift, ptr %fourth
  store ptr %values, ptr %outputs
  %derived = load ptr, ptr %data
  %scratch.at = getelementptr ptr, ptr %data, i64 1
  %scratch = load ptr, ptr %scratch.at
  %code = call i32 @kernel(ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs)
  ret i32 %code
}}
"""


@dataclass(frozen=True, eq=False)
class EventData:
    """The event functions of one session, with its own memory.

    Attributes
    ----------
    explicit
        Address of ``int (double t, const double *y, const double *yp, double *values, void *data)``.
    ida
        Address of an ``IDARootFn``, whose user data hold `address` at `EVENTS_PLACE`.
    address
        The last argument of the first.
    count
        Number of events.
    keep
        Whatever must live as long as the addresses are used.
    """

    explicit: int
    ida: int
    address: int
    count: int
    keep: object

    def function(self) -> Callable[[float, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]:
        """Return the values as a function of (t, y, y')."""
        call, found, address = _EVENTS(self.explicit), np.empty(self.count), self.address
        place = found.ctypes.data

        def values(
            t: float, y: NDArray[np.float64], yp: NDArray[np.float64], _: EventData = self
        ) -> NDArray[np.float64]:
            state = np.ascontiguousarray(y, dtype=np.float64)
            call(t, state.ctypes.data, None, place, address)
            return found.copy()

        return values

    def joined(self, user_data: int, size: int) -> Array[c_void_p]:
        """Return user data of IDA's other functions with those of the events behind them.

        Parameters
        ----------
        user_data, size
            Where they are, and how long: nothing but pointers.
        """
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
    built
        The code.
    has_ida
        Whether the function for IDA is there.
    """

    def __init__(self, program: Program, built: Built, has_ida: bool) -> None:
        self.program, self._built = program, built
        addresses = built.code.addresses
        self._explicit, self._ida = addresses["events"], addresses["ida_events"] if has_ida else 0
        self._prologue = _PROLOGUE(addresses["kernel_prologue"])

    def bind(self, parameter_values: ArrayLike, shifts: ArrayLike) -> EventData:
        """Return the functions for one session.

        Parameters
        ----------
        parameter_values
            The values in the order of the program's parameters.
        shifts
            What is added to each value.
        """
        values = np.array(parameter_values, dtype=np.float64)
        if values.shape != (len(self.program.parameters),):
            raise UsageError(f"needs {len(self.program.parameters)} parameter values, got an array of {values.shape}")
        derived, scratch = np.empty(len(self.program.prologue)), np.empty(self._built.scratch)
        shift = np.array(shifts, dtype=np.float64)
        self._prologue(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)
        arrays: tuple[NDArray[np.float64], ...] = (derived, scratch, shift)
        data = (c_void_p * 3)(*(array.ctypes.data for array in arrays))
        keep = (self._built, arrays, data)
        return EventData(self._explicit, self._ida, ctypes.addressof(data), len(shift), keep)


def compile_events(program: Program, for_ida: bool) -> EventCode:
    """Compile the values of events.

    Parameters
    ----------
    program
        Program of (t, q, u, shift) with one output group.
    for_ida
        Whether IDA is to call them too, which needs to know how SUNDIALS was built.

    Raises
    ------
    UsageError
        If the program has other inputs or outputs.
    """
    groups = [len(group.symbols) for group in program.inputs]
    if len(groups) != 4 or groups[0] != 1 or [groups[3]] != [len(program.results)]:
        raise UsageError(f"needs the input groups t, q, u and shift, not groups of {groups}", where=program.name)
    part = Part("kernel", program)
    text, exports = _TEXT.format(count=groups[1]), ["events"]
    if for_ida:
        text, exports = text + _ida_text(), [*exports, "ida_events"]
    return EventCode(program, build_code([part], default_options([part]), more=text, exports=exports), for_ida)


def _ida_text() -> str:
    """Write the function that IDA calls."""
    layout = sundials_layout()
    vectors = array_of("y", "yy", layout.vector_data) + array_of("yp", "yyp", layout.vector_data)
    return f"""define i32 @ida_events(double %t, ptr %yy, ptr %yyp, ptr %values, ptr %user) #0 {{
{vectors}  %data.at = getelementptr ptr, ptr %user, i64 {EVENTS_PLACE}
  %data = load ptr, ptr %data.at
  %code = call i32 @events(double %t, ptr %y, ptr %yp, ptr %values, ptr %data)
  ret i32 %code
}}
"""
