"""Steppers of machine code: what is asked of the routines of a method, whatever they do within a step.

The routine of a session that goes through output times, which all explicit methods share.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from ctypes import c_double, c_int, c_int64, c_void_p
from enum import IntEnum
from math import nan
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, address_of
from atwood.codegen.llvm.build import Built, RoutineSource, build_code
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Lanes, Operand, Record, Routine, Value
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.protocol import Handed, Nearest, State, StepMonitor
from atwood.lazy_dataclasses import dataclass, names_of

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.batch import BatchPlaces
    from atwood.integrators.event_location import EventLocator
    from atwood.integrators.jumps import Jumps
    from atwood.integrators.moments import Changes, Moments


class Outcome(IntEnum):
    """Why a stepper came back; `NOTICED` where it was asked to watch something."""

    REACHED = 0
    USED_UP = 1
    TOO_SMALL = 2
    NOTICED = 5


_OUTCOMES = {int(one): one for one in Outcome}


@dataclass
class Counts:
    """What a stepper has done.

    Attributes
    ----------
    steps, failures
        Steps that were kept, and steps whose error was too large or that had no value.
    evaluations, undefined
        Calls of the right-hand side, and those of them that gave no finite value.
    stiff
        How often stability, not accuracy, seemed to keep steps short: `STIFF` steps with few others between.
    """

    steps: int = 0
    failures: int = 0
    evaluations: int = 0
    undefined: int = 0
    stiff: int = 0


STIFF, CALM = 15, 6
"""So many steps at the edge of stability, with fewer than so many others in a row between, are a stiff problem."""


COUNTED = len(names_of(Counts))
"""So many counts follow each other in the memory of a session, from its steps on."""

_UNLIMITED = 2**62
_NO_VALUE = 3

WIDTH = 4
"""How many unknowns a loop works on at a time; rows are padded to a multiple of it with finite numbers."""


def fields_of(pointers: Iterable[str], numbers: Iterable[str], counts: Iterable[str]) -> dict[str, Kind]:
    """Return the fields with which the memory of a session begins, 8 bytes each: addresses, numbers and counts."""
    return {
        **dict.fromkeys(pointers, ADDRESS),
        **dict.fromkeys(numbers, NUMBER),
        **dict.fromkeys((*counts, "limit", "filled", *names_of(Counts)), INTEGER),
    }


LANE_FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("time", "taken", "edges"), NUMBER),
    "active": INTEGER,
    "factors": ADDRESS,
}
"""What a session of runs side by side has: the time to read each at, its steps, how often it seemed stiff, which lanes
have a run, and what Taylor series convolve.

What says something of lanes has a bit for each, from the lowest on.
"""


def in_lanes(fields: Mapping[str, Kind], runs: int) -> dict[str, Kind]:
    """Return the fields of a session that takes several runs side by side: numbers are lanes of them."""
    return {name: number_kind(runs) if kind is NUMBER else kind for name, kind in fields.items()}


def number_kind(runs: int) -> Kind:
    """Return what a number is in a session that takes so many runs side by side."""
    return NUMBER if runs == 1 else Lanes(runs)


class Memory(Record):
    """The memory of a session within a routine: its fields, and rows of a table of arrays.

    Parameters
    ----------
    fields
        The fields, among them `arrays`, where the table is, `size`, the number of unknowns, and `padded`, that of a
        row.
    rows
        The rows by name.
    session
        Its address.
    runs
        How many runs it takes side by side, each with a number of its own in every place of a number.

    Attributes
    ----------
    part
        What a loop over a row works on at a time: some unknowns, or one of each run.
    """

    session: Value
    rows: Mapping[str, int]
    runs: int
    part: Lanes
    arrays: Value
    size: Value
    padded: Value

    def __init__(self, fields: Mapping[str, Kind], rows: Mapping[str, int], session: Value, runs: int = 1) -> None:
        super().__init__(session, fields if runs == 1 else in_lanes(fields, runs))
        known = {name: self.__getattr__(name) for name in ("arrays", "size", "padded")}
        part = Lanes(WIDTH if runs == 1 else runs)
        self.__dict__.update(session=session, rows=rows, runs=runs, part=part, **known)

    def row(self, row: Operand | str) -> Value:
        """Return the address of a row of the table of arrays, by its name or number."""
        return self.arrays.at(self.padded * (self.rows[row] if isinstance(row, str) else row))

    def lanes(self, row: Value, j: Value) -> Value:
        """Return the lanes of a row from an unknown on."""
        return row.read(j, self.part)

    def parts(self) -> AbstractContextManager[Value]:
        """Do what follows for all parts of a row; the value is where each begins."""
        return self.session.routine.count(self.padded, step=self.part.count)

    def each(self, body: Callable[[Sequence[Value]], None]) -> None:
        """Do something for all parts of a row, several at a time: what follows from itself in one waits less so."""
        r, padded, width = self.session.routine, self.padded, self.part.count
        begin = r.variable(0, INTEGER)
        for many in (4, 2, 1):
            with r.forever() as parts:
                first = begin.now
                after = first + many * width
                with r.when(after > padded):
                    r.leave(parts)
                body([first + k * width for k in range(many)])
                begin.now = after


_M = TypeVar("_M", bound=Record)


def open_routine(
    memory: Callable[[Value], _M],
    name: str,
    more: Mapping[str, Kind] | None = None,
    result: Kind | None = CODE,
    exported: bool = False,
) -> tuple[Routine, _M, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    routine = Routine(name, {"session": ADDRESS, **(more or {})}, result, exported)
    return routine, memory(routine.arguments[0]), routine.arguments[1:]


Functions = Mapping[str, Callable[..., int]]

_SHAPES: dict[str, tuple[Any, ...]] = {
    "run": (),
    "interpolate": (c_double, c_void_p, c_void_p),
    "sample": (c_void_p, c_int64, c_void_p, c_void_p),
    "begin": (c_double, c_void_p),
}


def bind_functions(built: Built, **others: tuple[Any, ...]) -> Functions:
    """Return the functions of a method that Python calls, by name, each with a session for its first argument.

    `others` are the arguments of those that it has besides, or has otherwise.
    """
    shapes, addresses = {**_SHAPES, **others}, built.code.addresses
    return {name: ctypes.CFUNCTYPE(c_int, c_void_p, *shape)(addresses[name]) for name, shape in shapes.items()}


@dataclass(frozen=True, eq=False)
class Routines:
    """The compiled routines of a method, and those of them that Python calls."""

    built: Built
    functions: Functions


def routines_of(source: RoutineSource, **others: tuple[Any, ...]) -> Routines:
    """Return the routines of a method, compiled; whoever asks keeps them. `others`: as of `bind_functions`."""
    built = build_code([], CodeOptions(level=2), exports=(*_SHAPES, *others), routines=source)
    return Routines(built, bind_functions(built, **others))


class Stepper:
    """The state of a run with an explicit method, whose steps are machine code.

    One that can do more than most says so by its answers.

    A method lays out the memory of a session and sets these:

    Attributes
    ----------
    _fields
        The fields with which it begins.
    _functions
        Its routines.
    _session, _outputs
        The address of the session, and those of values and rates that it hands out.
    _values
        Both of these, shape (2, unknowns).
    _numbers
        The memory from the session on.
    _ends
        Values and rates at the end of the last step.
    _size
        The number of unknowns.
    """

    _fields: Mapping[str, Kind]
    _places: Mapping[str, int]
    _functions: Functions
    _session: int
    _outputs: tuple[int, int]
    _values: FloatArray
    _numbers: FloatArray
    _ends: tuple[FloatArray, FloatArray]
    _size: int

    def __init_subclass__(cls) -> None:
        cls._places = {name: place for place, name in enumerate(cls._fields)}

    def _begin_at(self, numbers: FloatArray, **fields: float) -> None:
        """Take the memory of a session from its beginning on, and set some of its fields."""
        self._numbers, self._integers = numbers, numbers.view(np.int64)
        self._session = numbers.ctypes.data
        self._set(**fields)

    def _set(self, **fields: float) -> None:
        """Set fields of the session."""
        for name, value in fields.items():
            table: NDArray[Any] = self._numbers if self._fields[name] is NUMBER else self._integers
            table[self._places[name]] = value

    def _number(self, name: str) -> float:
        return float(self._numbers[self._places[name]])

    def _count(self, name: str) -> int:
        return int(self._integers[self._places[name]])

    def _call(self, function: str, *arguments: float) -> int:
        """Call a routine and return its code."""
        return self._functions[function](self._session, *arguments)

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""
        first = self._places["steps"]
        return Counts(*self._integers[first : first + COUNTED].tolist())

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._values[0] = y
        return self._call("begin", t, self._outputs[0]) == 0

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        y, yp = self._ends
        return self._number("t"), y.copy(), yp.copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        self._numbers[self._places["stop"]] = t_stop
        last = self._count("steps") + min(steps, _UNLIMITED)
        while True:
            code = self._go_on(last, "run")
            if code is not None:
                return Outcome(code)

    def _go_on(self, last: int, function: str, *arguments: int) -> int | None:
        """Take steps up to a number of them; None where the rest is to be taken in another way."""
        self._integers[self._places["limit"]] = last
        return self._call(function, *arguments)

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if self._call("interpolate", t, *self._outputs) or not np.isfinite(self._values).all():
            raise self._no_interpolation(t)
        return t, self._values[0].copy(), self._values[1].copy()

    def sample(self, times: FloatArray, steps: int, y: FloatArray, yp: FloatArray) -> tuple[int, Outcome]:
        """Take steps, and write values and rates at as many of the times, one row each, as are reached; return these.

        The tables are in C order.
        """
        times = np.ascontiguousarray(times, dtype=np.float64)
        last, filled, code = self._count("steps") + min(steps, _UNLIMITED), 0, None
        while code is None:
            left, values, rates = address_of(times[filled:]), address_of(y[filled:]), address_of(yp[filled:])
            code = self._go_on(last, "sample", left, len(times) - filled, values, rates)
            filled += self._count("filled")
        if code == _NO_VALUE:
            raise self._no_interpolation(float(times[filled]))
        return filled, _OUTCOMES[code]

    def interpolation(self) -> tuple[int, int] | None:
        """Return the addresses of the function that reads the last step, and of its session; None where there is none.

        It calls nothing in Python.
        """
        function: Any = self._functions["interpolate"]
        return ctypes.cast(function, c_void_p).value or 0, self._session

    def _no_interpolation(self, t: float) -> KernelEvaluationError:
        """Return the error of a step within which there is no value."""
        return KernelEvaluationError(f"the right-hand side has no value within a step, at t = {t:.9g}")

    def watch(self, events: EventData) -> bool:
        """Come back with `Outcome.NOTICED` after a step in which an event may have happened; return whether it can."""
        return False

    def leap(self, locator: EventLocator, jumps: Jumps, last: float) -> bool:
        """Locate events without Python, up to a last time, and make the jumps that can be made so; whether it can."""
        return False

    def through(self, changes: Changes) -> Moments | None:
        """Return a way through moments at which parameters change, from the start on; None where there is none."""
        return None

    @property
    def waits(self) -> bool:
        """Whether an event is located that nobody has seen to yet."""
        return False

    def take_event(self) -> int | None:
        """Return what came of the search for an event that is left to Python, once; None where there is none."""
        return None

    def shorten(self, event: float) -> bool:
        """Take the last step anew to just behind an event, where that finds it better; whether it was."""
        return False

    def expect(self, signs: FloatArray) -> None:
        """Learn which sign each event has; where it is zero, every step is noticed."""
        return

    def take_over(self, handed: Handed) -> None:
        """Stand behind a step that was taken side by side with those of other runs."""
        raise UsageError("only embedded pairs are watched side by side")

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        raise NotImplementedError

    def watch_stiffness(self) -> None:
        """Come back with `Outcome.NOTICED` whenever the problem seems stiff, where that can be told."""
        return

    def nearest(self, t: FloatArray, y: FloatArray, sizes: FloatArray) -> Nearest | None:
        """Take states, one row each, onto the constraints as steps are; None where none can be taken so."""
        if "project_each" not in self._functions or not self._count("project"):
            return None
        times, y = np.ascontiguousarray(t), np.ascontiguousarray(y)
        found, left, moved = np.empty(y.shape), np.empty(len(t), dtype=np.int64), np.empty(len(t))
        self._call("project_each", *map(address_of, (times, y, found, sizes, left, moved)), len(t))
        return Nearest(found, left == 0, moved)

    def set_monitor(self, monitor: StepMonitor) -> bool:
        """Let the motion be looked at, and come back where something is seen; return whether it can."""
        return False

    def has_noticed(self) -> bool:
        """Return whether something was seen since this was last asked."""
        return False

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        return

    def stop_at(self, end: float) -> None:
        """Let no step go beyond a time, of a method that would."""
        return

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        raise UsageError("only compiled steps can be begun again")

    def _batch_places(
        self, built: Built, tolerances: FloatArray, factor: float = 1.0, parameters: tuple[int, int, int] = (0, 0, 0)
    ) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call."""
        from atwood.integrators.batch import BatchPlaces

        begin, sample = (built.code.addresses[name] for name in ("begin", "sample"))
        limit, steps, filled = (self._session + 8 * self._places[name] for name in ("limit", "steps", "filled"))
        places = begin, sample, self._session, limit, steps, filled, tolerances.ctypes.data, COUNTED
        return BatchPlaces(*places, parameters, factor, self)


SAMPLE_ARGUMENTS = {"times": ADDRESS, "wanted": INTEGER, "ys": ADDRESS, "yps": ADDRESS}
"""What the routine takes behind its session."""


PROJECT_ARGUMENTS: Mapping[str, Kind] = {
    **dict.fromkeys(("times", "given", "ys", "sizes", "left", "moved"), ADDRESS),
    "count": INTEGER,
}
PROJECTS = (*[c_void_p] * 6, c_int64)
"""What ``project_each`` takes behind its session, and as types of C."""


def write_project_each(r: Routine, m: Record) -> Routine:
    """Write what takes states, one row each, onto the constraints; where that fails, a number that is not zero is left.

    It says by how much of its size one of the unknowns of a state has moved at most; nan where that is no number.
    """
    _, times, given, ys, sizes, left, farthest, count = r.arguments
    project, data, width = m.project, m.project_data, m.size
    most, total = r.variable(0.0), r.variable(0.0)
    with r.count(count) as i:
        before, y = given.at(i * width), ys.at(i * width)
        most.now = total.now = 0.0
        r.copy(y, before, width)
        left.write(i, r.call(project, times[i], y, data).integer(), INTEGER)
        with r.count(width) as j:
            moved = r.size(y[j] - before[j]) / sizes[j]
            most.now, total.now = r.most(moved, most.now), total.now + moved
        farthest[i] = r.choose(r.is_finite(total.now), most.now, nan)
    r.give(0)
    return r


def write_sample(r: Routine, m: Record, width: Operand) -> Routine:
    """Write the body of ``sample``: fill a table with values and rates at output times; it ends as ``run`` does."""
    session, times, wanted, ys, yps = r.arguments
    i = r.variable(0, INTEGER)
    with r.forever():
        now = i.now
        m.filled = now
        r.give_if(now >= wanted, 0)
        moment, place = times[now], now * width
        m.stop = moment
        code = r.call("run", session)
        r.give_if(code != 0, code)
        code = r.call("interpolate", session, moment, ys.at(place), yps.at(place))
        r.give_if(code != 0, code)
        i.now = now + 1
    return r
