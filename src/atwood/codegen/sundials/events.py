"""Values of events as machine code: as the explicit methods call them, and as SUNDIALS IDA does.

They tell in which steps something may happen, so that no Python runs in all the others: where a sign has changed, and
where the tangents at the ends of a step leave room for a value that passes zero and comes back
(`atwood.integrators.dips`). IDA itself locates no roots: it gives up where a value is zero up to its own rounding of
time, as beside an extreme.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import Array, c_double, c_int, c_void_p

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.text import array_of, sundials_layout
from atwood.codegen.tangents import SECANT, STEEP
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.late import dataclass

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
        What depends on parameters alone, room for the code, and what is added to each value.
    keep
        Whatever must live as long as the addresses are used.
    """

    plain: int
    explicit: int
    ida: int
    address: int
    count: int
    memory: NDArray[np.float64]
    arrays: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    keep: object

    def restart(self, t: float) -> None:
        """Forget what was seen before a new start."""
        self.memory[:] = 0.0
        self.memory[0] = t

    def has_noticed(self) -> bool:
        """Return, once, whether a value may have passed zero."""
        said = self.memory[2] != 0.0
        self.memory[2] = 0.0
        return bool(said)

    def function(self) -> Callable[[float, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]:
        """Return the values as a function of (t, y, y')."""
        call, found, address = _EVENTS(self.plain), np.empty(self.count), self.address
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
        self._plain, self._explicit = addresses["events"], addresses["look"]
        self._ida = addresses["ida_events"] if has_ida else 0
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
        derived, scratch = np.empty(len(self.program.prologue)), np.empty(self._built.scratch)
        shift = np.array(shifts, dtype=np.float64)
        memory = np.zeros(3 + 3 * len(shift))
        arrays: tuple[NDArray[np.float64], ...] = (derived, scratch, shift, memory)
        data = (c_void_p * 4)(*(array.ctypes.data for array in arrays))
        functions = self._plain, self._explicit, self._ida
        place, own = ctypes.addressof(data), (derived, scratch, shift)
        made = EventData(*functions, place, len(shift), memory, own, (self._built, data))
        self.fill(made, parameter_values, shifts)
        return made

    def fill(self, data: EventData, parameter_values: ArrayLike, shifts: ArrayLike) -> None:
        """Give the functions of a session other parameters and shifts; arguments as of `bind`."""
        values = np.array(parameter_values, dtype=np.float64)
        if values.shape != (len(self.program.parameters),):
            raise UsageError(f"needs {len(self.program.parameters)} parameter values, got an array of {values.shape}")
        derived, scratch, shift = data.arrays
        shift[:] = shifts
        self._prologue(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)


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
    text = _TEXT.format(count=groups[1]) + _look_text(groups[1] + groups[2], groups[3])
    exports = ["events", "look"]
    if for_ida:
        text, exports = text + _ida_text(groups[3]), [*exports, "ida_events"]
    return EventCode(program, build_code([part], default_options([part]), more=text, exports=exports), for_ida)


def _look_text(size: int, count: int) -> str:
    """Write the function that remembers the last point, and compares signs and tangents; -2 where zero may be passed.

    Its memory: the time of the last point, the length over which slopes are taken, whether it has said so, and then
    values and slopes at the last point, and room for two rows of values.
    """
    return f"""define i32 @look(double %t, ptr %y, ptr %yp, ptr %values, ptr %data) #0 {{
entry:
  %shifted = alloca double, i64 {size}
  %code = call i32 @events(double %t, ptr %y, ptr %yp, ptr %values, ptr %data)
  %memory.at = getelementptr ptr, ptr %data, i64 3
  %memory = load ptr, ptr %memory.at
  %length.at = getelementptr double, ptr %memory, i64 1
  %said.at = getelementptr double, ptr %memory, i64 2
  %lasts = getelementptr double, ptr %memory, i64 3
  %slopes = getelementptr double, ptr %memory, i64 {3 + count}
  %others = getelementptr double, ptr %memory, i64 {3 + 2 * count}
  %last = load double, ptr %memory
  %width = fsub double %t, %last
  %old = fcmp ole double %width, 0.0
  %bad = icmp ne i32 %code, 0
  %leave = or i1 %old, %bad
  br i1 %leave, label %return, label %measure
return:
  ret i32 %code
{_measure_text(size)}{_compare_text(count)}end:
  %dips = and i1 %found.next, %known
  br i1 %dips, label %say, label %nothing
say:
  store double 1.0, ptr %said.at
  ret i32 -2
nothing:
  ret i32 0
}}
"""


def _measure_text(size: int) -> str:
    """Write how events are evaluated a little before the point too, along its tangent."""
    return f"""measure:
  %known = fcmp ogt double %width, 0.0
  %before = load double, ptr %length.at
  %half = fmul double %before, 0.5
  %longer = fcmp ogt double %width, %half
  %length = select i1 %longer, double %width, double %half
  store double %length, ptr %length.at
  store double %t, ptr %memory
  %past = fmul double %length, {SECANT}
  %earlier = fsub double %t, %past
  br label %shift
shift:
  %i = phi i64 [ 0, %measure ], [ %i.next, %shift ]
  %y.at = getelementptr double, ptr %y, i64 %i
  %yp.at = getelementptr double, ptr %yp, i64 %i
  %to = getelementptr double, ptr %shifted, i64 %i
  %y.i = load double, ptr %y.at
  %yp.i = load double, ptr %yp.at
  %moved = fmul double %yp.i, %past
  %back = fsub double %y.i, %moved
  store double %back, ptr %to
  %i.next = add i64 %i, 1
  %i.more = icmp slt i64 %i.next, {size}
  br i1 %i.more, label %shift, label %slope
slope:
  %lost = call i32 @events(double %earlier, ptr %shifted, ptr %yp, ptr %others, ptr %data)
  %has = icmp eq i32 %lost, 0
  br label %each
"""


def _compare_text(count: int) -> str:
    """Write the loop that asks of each event whether the tangents at both points leave room for a dip between them."""
    return f"""each:
  %k = phi i64 [ 0, %slope ], [ %k.next, %each ]
  %found = phi i1 [ false, %slope ], [ %found.next, %each ]
  %value.at = getelementptr double, ptr %values, i64 %k
  %other.at = getelementptr double, ptr %others, i64 %k
  %last.at = getelementptr double, ptr %lasts, i64 %k
  %slope.at = getelementptr double, ptr %slopes, i64 %k
  %value = load double, ptr %value.at
  %other = load double, ptr %other.at
  %first = load double, ptr %last.at
  %first.slope = load double, ptr %slope.at
  %change = fsub double %value, %other
  %quotient = fdiv double %change, %past
  %end.slope = select i1 %has, double %quotient, double 0.0
  store double %value, ptr %last.at
  store double %end.slope, ptr %slope.at
  %negative = fcmp olt double %value, 0.0
  %sign = select i1 %negative, double -1.0, double 1.0
  %a = fmul double %first, %sign
  %b = fmul double %value, %sign
  %signed = fmul double %width, %sign
  %down = fmul double %first.slope, %signed
  %up = fmul double %end.slope, %signed
  %left = fadd double %a, %down
  %right = fsub double %b, %up
  %falls = fcmp ole double %left, 0.0
  %rises = fcmp ole double %right, 0.0
  %down.size = call double @llvm.fabs.f64(double %down)
  %up.size = call double @llvm.fabs.f64(double %up)
  %down.larger = fcmp ogt double %down.size, %up.size
  %steepest = select i1 %down.larger, double %down.size, double %up.size
  %a.larger = fcmp ogt double %a, %b
  %largest = select i1 %a.larger, double %a, double %b
  %bound = fmul double %largest, {STEEP}
  %steep = fcmp ogt double %steepest, %bound
  %a.same = fcmp ogt double %a, 0.0
  %b.same = fcmp ogt double %b, 0.0
  %same = and i1 %a.same, %b.same
  %turns = or i1 %falls, %rises
  %doubtful = or i1 %turns, %steep
  %one.side = xor i1 %same, true
  %this = or i1 %one.side, %doubtful
  %found.next = or i1 %found, %this
  %k.next = add i64 %k, 1
  %k.more = icmp slt i64 %k.next, {count}
  br i1 %k.more, label %each, label %end
"""


def _ida_text(count: int) -> str:
    """Write the function that IDA calls."""
    layout = sundials_layout()
    vectors = array_of("y", "yy", layout.vector_data) + array_of("yp", "yyp", layout.vector_data)
    places = [f"  %at.{i} = getelementptr double, ptr %values, i64 {i}\n" for i in range(count)]
    calm = "".join(f"{place}  store double 1.0, ptr %at.{i}\n" for i, place in enumerate(places))
    return f"""define i32 @ida_events(double %t, ptr %yy, ptr %yyp, ptr %values, ptr %user) #0 {{
{vectors}  %data.at = getelementptr ptr, ptr %user, i64 {EVENTS_PLACE}
  %data = load ptr, ptr %data.at
  %code = call i32 @look(double %t, ptr %y, ptr %yp, ptr %values, ptr %data)
{calm}  ret i32 %code
}}
"""
