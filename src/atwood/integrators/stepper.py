"""Steppers of machine code: what is asked of the routines of a method, whatever they do within a step.

The routine of a session that goes through output times, which all explicit methods share.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from ctypes import c_double, c_int, c_int64, c_void_p
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, Operand, Record, Routine, Value
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.protocol import Lookout, State
from atwood.lazy_dataclasses import dataclass, names_of

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.batch import BatchPlaces


class Outcome(IntEnum):
    """Why a stepper came back; `NOTICED` where it was asked to watch something."""

    REACHED = 0
    USED_UP = 1
    TOO_SMALL = 2
    NOTICED = 5


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


class Stepper(ABC):
    """Takes the steps of an explicit method; one that can do more than these says so by its answers."""

    @abstractmethod
    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""

    @abstractmethod
    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""

    @abstractmethod
    def state(self) -> State:
        """Return time, values and rates at the end of the last step, which the caller may keep."""

    @abstractmethod
    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""

    @property
    @abstractmethod
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        last = self.counts.steps + steps
        size = len(self.state()[1])
        y, yp = np.empty((2, len(times), size))
        for filled, t in enumerate(times):
            outcome = self.run(float(t), last - self.counts.steps)
            if outcome is not Outcome.REACHED:
                return y[:filled], yp[:filled], outcome
            _, y[filled], yp[filled] = self.interpolate(float(t))
        return y, yp, Outcome.REACHED

    def watch(self, events: EventData) -> bool:
        """Come back with `Outcome.NOTICED` after a step in which an event may have happened; return whether it can."""
        return False

    def expect(self, signs: FloatArray) -> None:
        """Learn which sign each event has; where it is zero, every step is noticed."""
        return

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        raise NotImplementedError

    def heed_stiffness(self) -> None:
        """Come back with `Outcome.NOTICED` whenever the problem seems stiff, where that can be told."""
        return

    def look_out(self, lookout: Lookout) -> bool:
        """Let the motion be looked at, and come back where something is seen; return whether it can."""
        return False

    def has_seen(self) -> bool:
        """Return whether something was seen since this was last asked."""
        return False

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow, where they can be limited."""
        return

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        raise UsageError("only compiled steps can be begun again")


def no_interpolation(t: float) -> KernelEvaluationError:
    """Return the error of a step within which there is no value."""
    return KernelEvaluationError(f"the right-hand side has no value within a step, at t = {t:.9g}")


STIFF, CALM = 15, 6
"""So many steps at the edge of stability, with fewer than so many others in a row between, are a stiff problem."""


COUNTED = len(names_of(Counts))
"""So many counts follow each other in the memory of a session, from its steps on."""

_UNLIMITED = 2**62
_NO_VALUE = 3


@dataclass(frozen=True, eq=False)
class Routines:
    """The compiled routines of a method, and the addresses of two of them."""

    built: Built
    run: Callable[..., int]
    interpolate: Callable[..., int]
    sample: Callable[..., int]
    begin: Callable[..., int]
    addresses: dict[str, int]


def routines_of(source: RoutineSource) -> Routines:
    """Return the routines of a method, compiled; whoever asks keeps them."""
    shapes = {
        "run": (c_void_p,),
        "interpolate": (c_void_p, c_double, c_void_p, c_void_p),
        "sample": (c_void_p, c_void_p, c_int64, c_void_p, c_void_p),
        "begin": (c_void_p, c_double, c_void_p),
    }
    built = build_code([], CodeOptions(level=2), exports=tuple(shapes), routines=source)
    addresses = built.code.addresses
    found = {name: ctypes.CFUNCTYPE(c_int, *shape)(addresses[name]) for name, shape in shapes.items()}
    return Routines(built, **found, addresses=addresses)


class NativeStepper(Stepper):
    """The state of a run whose steps are machine code.

    A method lays out the memory of a session and sets these:

    Attributes
    ----------
    _routines
        Its routines.
    _session, _outputs
        The address of the session, and those of values and rates that it hands out.
    _values
        Both of these, shape (2, unknowns).
    _numbers, _counts
        Tables of the session.
    _number, _count
        Where what they hold stands in these, by name.
    _ends
        Values and rates at the end of the last step.
    _size
        The number of unknowns.
    """

    _routines: Routines
    _session: int
    _outputs: tuple[int, int]
    _values: FloatArray
    _numbers: FloatArray
    _counts: NDArray[np.int64]
    _number: Mapping[str, int]
    _count: Mapping[str, int]
    _ends: tuple[FloatArray, FloatArray]
    _size: int

    def _call(self, function: Callable[..., int], *arguments: float) -> int:
        """Call a routine and return its code."""
        return function(self._session, *arguments)

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""
        first = self._count["steps"]
        return Counts(*self._counts[first : first + COUNTED].tolist())

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._values[0] = y
        return self._call(self._routines.begin, t, self._outputs[0]) == 0

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        y, yp = self._ends
        return float(self._numbers[self._number["t"]]), y.copy(), yp.copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        self._numbers[self._number["stop"]] = t_stop
        self._allow(steps)
        return Outcome(self._call(self._routines.run))

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if self._call(self._routines.interpolate, t, *self._outputs) or not np.isfinite(self._values).all():
            raise no_interpolation(t)
        return t, self._values[0].copy(), self._values[1].copy()

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        y, yp = np.empty((2, len(times), self._size))
        self._allow(steps)
        tables = (array.ctypes.data for array in (y, yp))
        outcome = self._call(self._routines.sample, times.ctypes.data, len(times), *tables)
        filled = int(self._counts[self._count["filled"]])
        if outcome == _NO_VALUE:
            raise no_interpolation(float(times[filled]))
        return y[:filled], yp[:filled], Outcome(outcome)

    def _allow(self, steps: int) -> None:
        self._counts[self._count["limit"]] = self._counts[self._count["steps"]] + min(steps, _UNLIMITED)

    def _places(
        self, tolerances: FloatArray, factor: float = 1.0, parameters: tuple[int, int, int] = (0, 0, 0)
    ) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call."""
        from atwood.integrators.batch import BatchPlaces

        begin, sample = (self._routines.addresses[name] for name in ("begin", "sample"))
        limit, steps, filled = (self._counts[self._count[name] :].ctypes.data for name in ("limit", "steps", "filled"))
        places = begin, sample, self._session, limit, steps, filled, tolerances.ctypes.data, COUNTED
        return BatchPlaces(*places, parameters, factor, self)


SAMPLE_ARGUMENTS = {"times": ADDRESS, "wanted": INTEGER, "ys": ADDRESS, "yps": ADDRESS}
"""What the routine takes behind its session."""


def write_sample(r: Routine, numbers: Record, counts: Record, width: Operand) -> Routine:
    """Write the body of ``sample``: fill a table with values and rates at output times; it ends as ``run`` does."""
    session, times, wanted, ys, yps = r.arguments
    i = r.variable(0, INTEGER)
    with r.forever():
        now = i.now
        counts.filled = now
        with r.when(now >= wanted):
            r.give(0)
        moment, place = times[now], now * width
        numbers.stop = moment
        steps: tuple[Callable[[], Value], ...] = (
            lambda: r.call("run", session),
            lambda: r.call("interpolate", session, moment, ys.at(place), yps.at(place)),
        )
        for step in steps:
            code = step()
            with r.when(code != 0):
                r.give(code)
        i.now = now + 1
    return r
