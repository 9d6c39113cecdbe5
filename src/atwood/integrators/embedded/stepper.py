"""Embedded pairs as machine code: no Python runs between outputs.

The code of the steps is the same for all problems of a pair and comes from the cache after the first time.  What a
problem adds is the compiled right-hand side (`atwood.integrators.embedded.rates`).

Memory of a session of an embedded pair: what routines and Python agree on.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from ctypes import c_double, c_int, c_void_p
from functools import cache
from itertools import accumulate
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, once
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Lanes, Record, Routine, Value
from atwood.errors import KernelEvaluationError
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.protocol import (
    CompiledRates,
    ExplicitProblem,
    Lookout,
    SolverOptions,
    absolute_tolerances,
)
from atwood.integrators.stepper import COUNTED, NativeStepper, Routines, routines_of

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.batch import BatchPlaces

LANES = 4
"""How many unknowns a loop works on at a time; rows are padded to a multiple of it with finite numbers."""

NUMBERS = ("t", "t_old", "h", "next", "stop", "relative", "longest", "horizon", "first", "looked", "likeness", "tried")
COUNTS = (
    "size",
    "padded",
    "limit",
    "steps",
    "failures",
    "evaluations",
    "undefined",
    "stiff",
    "is_dense",
    "filled",
    "edgy",
    "calm",
    "event_count",
    "heeds",
    "seen",
    "looks",
)
POINTERS = (
    "function",
    "data",
    "numbers",
    "counts",
    "arrays",
    "events",
    "events_data",
    "values",
    "signs",
    "project",
    "project_data",
    "watch",
    "watch_data",
    "due",
    "guard",
    "guard_data",
)


class Memory:
    """The memory of a session within a routine."""

    def __init__(self, session: Value, pair: Tableau) -> None:
        self.session, self.pair = session, pair
        self.at = Record(session, dict.fromkeys(POINTERS, ADDRESS))
        self.numbers = Record(self.at.numbers, dict.fromkeys(NUMBERS, NUMBER))
        self.counts = Record(self.at.counts, dict.fromkeys(COUNTS, INTEGER))
        self.arrays = self.at.arrays
        self.size, self.padded = self.counts.size, self.counts.padded

    def row(self, row: int | str) -> Value:
        """Return the address of a row of the table of arrays."""
        return self.arrays.at(self.padded * (self.pair.rows[row] if isinstance(row, str) else row))

    def lanes(self, row: Value, j: Value) -> Value:
        """Return the lanes of a row from an unknown on."""
        return row.read(j, Lanes(LANES))


def open_routine(
    pair: Tableau, name: str, more: Mapping[str, Kind] | None = None, result: Kind = CODE, exported: bool = False
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    routine = Routine(name, {"session": ADDRESS, **(more or {})}, result, exported)
    return routine, Memory(routine.arguments[0], pair), routine.arguments[1:]


_RATES = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_PROJECTION = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p)
_GUARDS = ctypes.CFUNCTYPE(c_int, *[c_double, c_void_p, c_void_p] * 2, c_void_p)


class CompiledStepper(NativeStepper):
    """The state of a run with an embedded pair.

    Parameters
    ----------
    problem
        The equations.  Where these have no compiled functions, the steps call those in Python.
    options
        The accuracy.
    pair
        The method.
    """

    _number = MappingProxyType({name: place for place, name in enumerate(NUMBERS)})
    _count = MappingProxyType({name: place for place, name in enumerate(COUNTS)})

    def __init__(self, problem: ExplicitProblem, options: SolverOptions, pair: Tableau) -> None:
        self._size, self._options, self._pair, self._rows = problem.size, options, pair, pair.rows
        self._failure: BaseException | None = None
        self._functions: list[object] = []
        self.interrupted = False
        self._restart: Callable[[float], None] | None = None
        guard = problem.guard
        self._calls_python = problem.compiled is None or (guard is not None and not guard.function)
        rates = self._in_python(problem) if problem.compiled is None else problem.compiled()
        self._keep = rates.keep
        n, absolute = problem.size, absolute_tolerances(options, problem.size)
        padded, ends = _layout(n, self._rows["all"])
        # All memory is one piece, since looking up an address takes longer than a step.
        self._memory = memory = np.zeros(ends[-1])
        base = memory.ctypes.data
        self._arrays = arrays = memory[: ends[0]].reshape(-1, padded)
        self._numbers = memory[ends[0] : ends[1]]
        whole = memory.view(np.int64)
        self._counts, self._pointers = whole[ends[1] : ends[2]], whole[ends[2] : ends[3]]
        self._values = memory[ends[3] :].reshape(2, n)
        self._ends = arrays[self._rows["y"], :n], arrays[self._rows["end slope"], :n]
        arrays[self._rows["absolute"]] = 1.0
        arrays[self._rows["absolute"], :n] = absolute
        self._counts[:2] = n, padded
        longest = options.max_step or inf
        # From the relative tolerance on, numbers are those of the options.
        self._numbers[_R : _FIRST + 1] = options.relative_tolerance, longest, options.horizon, options.first_step or 0.0
        self._pointers[:5] = rates.function, rates.data, base + 8 * ends[0], base + 8 * ends[1], base
        self._pointers[_PROJECT : _PROJECT + 2] = rates.project, rates.project_data
        if guard is not None:
            function = guard.function or self._called(_GUARDS, guard.passes, (1, 2, 4, 5))
            self._keep = (self._keep, guard)
            self._pointers[_GUARD : _GUARD + 2] = function, guard.data
        self._session = base + 8 * ends[2]
        self._outputs = base + 8 * ends[3], base + 8 * ends[4]
        self._routines = _routines(pair)

    def batch_places(self) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call."""
        return self._places(self._arrays[self._rows["absolute"]])

    def watch(self, events: EventData) -> bool:
        """Come back with `Outcome.NOTICED` after a step in which an event may have happened."""
        self._events, self._signs = np.zeros((2, events.count))
        self._keep, self._restart = (self._keep, events), events.restart
        places = (array.ctypes.data for array in (self._events, self._signs))
        self._pointers[5:9] = events.explicit, events.address, *places
        self._counts[_EVENTS] = events.count
        return True

    def expect(self, signs: FloatArray) -> None:
        """Say which sign each event has; where it is zero, every step is noticed."""
        self._signs[:] = signs

    def look_out(self, lookout: Lookout) -> bool:
        """Let the motion be looked at, and come back with `Outcome.NOTICED` where something is seen."""
        self._keep = (self._keep, lookout)
        self._pointers[_WATCH : _WATCH + 3] = lookout.look, lookout.data, lookout.due_at
        return True

    def has_seen(self) -> bool:
        """Return whether something was seen since this was last asked."""
        seen, self._counts[_SEEN] = bool(self._counts[_SEEN]), 0
        return seen

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow."""
        self._numbers[_LONGEST] = min(longest, self._options.max_step or inf)

    def heed_stiffness(self) -> None:
        """Let `run` and `sample` come back with `Outcome.NOTICED` whenever the problem seems stiff."""
        self._counts[_HEEDS] = 1

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        if absolute is not None:
            self._arrays[self._rows["absolute"], : self._size] = np.maximum(absolute, np.finfo(float).tiny)
        self._counts[_STEPS : _STEPS + COUNTED] = 0
        self._numbers[_HORIZON] = horizon
        self._numbers[_LONGEST] = self._options.max_step or inf

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        return float(self._numbers[_T_OLD])

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        if self._restart is not None:
            self._restart(t)
        return super().start(t, y)

    def _call(self, function: Callable[..., int], *arguments: float) -> int:
        """Call a function of the steps and return its code, or raise what Python functions raised in it."""
        if not self._calls_python:
            return function(self._session, *arguments)
        from atwood.interrupts import InterruptLater

        with InterruptLater(self):
            code = function(self._session, *arguments)
        failure, self._failure = self._failure, None
        interrupted, self.interrupted = self.interrupted, False
        if failure is not None:
            raise failure
        if interrupted:
            raise KeyboardInterrupt
        return code

    def _in_python(self, problem: ExplicitProblem) -> CompiledRates:
        """Return rates and projection that call Python."""
        rates = self._called(_RATES, problem.rates, (1,), 2)
        project = 0 if problem.project is None else self._called(_PROJECTION, problem.project, (1,), 1)
        return CompiledRates(rates, project=project, keep=self._functions)

    def _called(
        self, kind: Callable[..., Any], function: Callable[..., Any], arrays: tuple[int, ...], target: int | None = None
    ) -> int:
        """Return the address of a function in C that calls one in Python."""
        size = self._size
        count = max(arrays) + 1

        def array(place: int) -> FloatArray:
            return np.ctypeslib.as_array(ctypes.cast(place, ctypes.POINTER(c_double)), (size,))

        def call(*given: Any) -> int:
            if self._failure is not None or self.interrupted:
                return 1
            try:
                found = function(*(array(one) if k in arrays else one for k, one in enumerate(given[:count])))
                if target is None:
                    return 0 if found else 1
                values = array(given[target])
                values[:] = found
            except (KernelEvaluationError, ArithmeticError):
                return 1
            except BaseException as error:
                self._failure = error
                return 1
            return 0 if np.isfinite(values).all() else 1

        made = kind(call)
        self._functions.append(made)
        return ctypes.cast(made, c_void_p).value or 0


@cache
def _layout(size: int, rows: int) -> tuple[int, tuple[int, ...]]:
    """Return how long rows are, and where each array of a session ends, for so many unknowns."""
    padded = -(-size // LANES) * LANES
    lengths = rows * padded, len(NUMBERS), len(COUNTS), len(POINTERS), size, size
    return padded, tuple(accumulate(lengths))


_R, _LONGEST, _HORIZON, _FIRST = map(NUMBERS.index, ("relative", "longest", "horizon", "first"))
_T_OLD = NUMBERS.index("t_old")
_STEPS = COUNTS.index("steps")
_EVENTS, _HEEDS, _SEEN = map(COUNTS.index, ("event_count", "heeds", "seen"))
_PROJECT, _WATCH, _GUARD = map(POINTERS.index, ("project", "watch", "guard"))


_FILES = (
    *(f"integrators/embedded/{name}.py" for name in ("dense_output", "stepper", "tableau")),
    "integrators/protocol.py",
    "integrators/stepper.py",
)


@once
def _routines(pair: Tableau) -> Routines:
    """Return the routines of a pair."""
    return routines_of(RoutineSource("integrators.embedded.steps", _FILES, (pair,)))
