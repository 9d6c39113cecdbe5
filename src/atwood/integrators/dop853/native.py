"""The explicit method of order 8(5,3) as machine code: no Python runs between outputs.

The code of the steps is the same for all problems and comes from the cache after the first time.  What a problem adds
is the compiled right-hand side, which is made here from a program of accelerations.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_double, c_int, c_int64, c_void_p
from functools import cache
from itertools import accumulate
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.once import once
from atwood.codegen.routines.source import RoutineSource
from atwood.errors import KernelEvaluationError, UnsupportedError, UsageError
from atwood.expr import Program
from atwood.integrators.compiled_functions import Lookout
from atwood.integrators.dop853.memory import COUNTS, LANES, NUMBERS, POINTERS, ROWS
from atwood.integrators.dop853.rates import rates_source
from atwood.integrators.event_location import State
from atwood.integrators.explicit_problem import (
    CompiledEvents,
    CompiledRates,
    Counts,
    ExplicitProblem,
    Outcome,
    absolute_tolerances,
    no_interpolation,
)
from atwood.integrators.protocol import FloatArray, SolverOptions
from atwood.late import dataclass, names_of

if TYPE_CHECKING:
    from atwood.integrators.ensemble.batch import BatchPlaces

__all__ = ["CompiledAccelerations", "CompiledStepper", "OwnRates"]

_RATES = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_UNLIMITED = 2**62
_NO_VALUE = 3


class CompiledAccelerations:
    """A program of accelerations as a compiled right-hand side, for any parameter values.

    Parameters
    ----------
    program
        A program of (t, q, u) with the accelerations, and before them the rates of the coordinates unless these are
        the speeds.

    Raises
    ------
    UnsupportedError
        If the program calls functions in Python.
    """

    def __init__(self, program: Program) -> None:
        if any(node.operation == "external" for node in program.nodes):
            raise UnsupportedError("a program that calls functions in Python has no compiled rates", where=program.name)
        part = Part("kernel", program)
        _, q, u = (len(group.symbols) for group in program.inputs)
        self.program, self.size = program, q + u
        routines = rates_source(q, u, given=len(program.outputs) == 2)
        self._built = build_code([part], default_options([part]), exports=["rates"], routines=routines)
        self._prologue = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)(self._built.code.addresses["kernel_prologue"])

    def bind(self, parameter_values: ArrayLike) -> Callable[[], CompiledRates]:
        """Compute once what depends on parameters alone; return what gives each session rates of its own.

        Parameters
        ----------
        parameter_values
            The values in the order of the program's parameters.
        """
        values = np.array(parameter_values, dtype=np.float64)
        if values.shape != (len(self.program.parameters),):
            raise UsageError(f"needs {len(self.program.parameters)} parameter values, got an array of {values.shape}")
        derived, scratch = np.empty(len(self.program.prologue)), np.empty(self._built.scratch)
        self._prologue(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)

        function, place, room = self._built.code.addresses["rates"], derived.ctypes.data, 2 + len(scratch)

        def rates() -> CompiledRates:
            # The pointers to derived values and scratch, and then the scratch itself.
            own = np.empty(room)
            data = own.ctypes.data
            own.view(np.int64)[:2] = place, data + 16
            return CompiledRates(function, data, (self._built, derived, own))

        return rates

    def open(self) -> OwnRates:
        """Return rates of a session whose parameters can be changed between its runs."""
        # The pointers to derived values and scratch, then the derived values and the scratch themselves.
        count = len(self.program.prologue)
        own = np.empty(2 + count + self._built.scratch)
        data = own.ctypes.data
        own[:2].view(np.uint64)[:] = derived, scratch = data + 16, data + 16 + 8 * count
        rates = CompiledRates(self._built.code.addresses["rates"], data, (self._built, own))
        return OwnRates(rates, self._built.code.addresses["kernel_prologue"], derived, scratch)

    def fill(self, own: OwnRates, parameter_values: ArrayLike) -> None:
        """Give rates of a session their parameters."""
        values = np.array(parameter_values, dtype=np.float64)
        self._prologue(values.ctypes.data, own.derived, own.scratch)


@dataclass(frozen=True)
class OwnRates:
    """Compiled rates with a place for their parameters.

    Attributes
    ----------
    rates
        The rates; they have values once the prologue was called.
    prologue, derived, scratch
        Address of the function that computes what depends on parameters alone, and of its two arrays.
    """

    rates: CompiledRates
    prologue: int
    derived: int
    scratch: int


class CompiledStepper:
    """The state of a run; see `~atwood.integrators.explicit_problem.Stepper`.

    Parameters
    ----------
    problem
        The equations.  Where it has no compiled rates, the steps call Python for each of its rates.
    options
        The accuracy.
    """

    def __init__(self, problem: ExplicitProblem, options: SolverOptions) -> None:
        self._size, self._options = problem.size, options
        self._failure: BaseException | None = None
        self.interrupted = False
        self._calls_python = problem.compiled is None
        self._restart: Callable[[float], None] | None = None
        rates = self._in_python(problem) if problem.compiled is None else problem.compiled()
        self._keep = rates.keep
        n, absolute = problem.size, absolute_tolerances(options, problem.size)
        padded, ends = _layout(n)
        # All memory is one piece, since looking up an address takes longer than a step.
        self._memory = memory = np.zeros(ends[-1])
        base = memory.ctypes.data
        self._arrays = arrays = memory[: ends[0]].reshape(-1, padded)
        self._numbers = memory[ends[0] : ends[1]]
        whole = memory.view(np.int64)
        self._counts, self._pointers = whole[ends[1] : ends[2]], whole[ends[2] : ends[3]]
        self._y, self._yp = memory[ends[3] : ends[4]], memory[ends[4] :]
        arrays[ROWS["absolute"]] = 1.0
        arrays[ROWS["absolute"], :n] = absolute
        self._counts[:2] = n, padded
        longest = options.max_step or inf
        # From the relative tolerance on, numbers are those of the options.
        self._numbers[_R : _FIRST + 1] = options.relative_tolerance, longest, options.horizon, options.first_step or 0.0
        self._pointers[:5] = rates.function, rates.data, base + 8 * ends[0], base + 8 * ends[1], base
        self._pointers[_PROJECT : _PROJECT + 2] = rates.project, rates.project_data
        if problem.guard is not None:
            self._keep = (self._keep, problem.guard)
            self._pointers[_GUARD : _GUARD + 2] = problem.guard.function, problem.guard.data
        self._session = base + 8 * ends[2]
        self._places = base + 8 * ends[3], base + 8 * ends[4]
        self._run, self._interpolate, self._sample, self._begin = functions()

    def batch_places(self) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call."""
        from atwood.integrators.ensemble.batch import BatchPlaces

        begin, sample = (_code().code.addresses[name] for name in ("begin", "sample"))
        limit, steps, filled = (self._counts[k:].ctypes.data for k in (_LIMIT, _STEPS, _FILLED))
        tolerance = self._arrays[ROWS["absolute"]].ctypes.data
        places = begin, sample, self._session, limit, steps, filled, tolerance, _COUNTED
        return BatchPlaces(*places, keep=self)

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""
        return Counts(*self._counts[_STEPS : _STEPS + _COUNTED].tolist())

    def watch(self, events: CompiledEvents) -> None:
        """Let `run` and `sample` come back with `Outcome.NOTICED` after a step in which an event may have happened."""
        self._values, self._signs = np.zeros((2, events.count))
        self._keep, self._restart = (self._keep, events), events.restart
        places = (array.ctypes.data for array in (self._values, self._signs))
        self._pointers[5:9] = events.function, events.data, *places
        self._counts[_EVENTS] = events.count

    def expect(self, signs: FloatArray) -> None:
        """Say which sign each event has; where it is zero, every step is noticed."""
        self._signs[:] = signs

    def look_out(self, lookout: Lookout) -> None:
        """Let the motion be looked at, and come back with `Outcome.NOTICED` where something is seen."""
        self._keep = (self._keep, lookout)
        self._pointers[_WATCH : _WATCH + 3] = lookout.look, lookout.data, lookout.due_at

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
            self._arrays[ROWS["absolute"], : self._size] = np.maximum(absolute, np.finfo(float).tiny)
        self._counts[_STEPS : _STEPS + _COUNTED] = 0
        self._numbers[_HORIZON] = horizon
        self._numbers[_LONGEST] = self._options.max_step or inf

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        return float(self._numbers[_T_OLD])

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._y[:] = y
        if self._restart is not None:
            self._restart(t)
        return self._call(self._begin, t, self._places[0]) == 0

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        n = self._size
        return float(self._numbers[_T]), self._arrays[ROWS["y"], :n].copy(), self._arrays[12, :n].copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        self._numbers[_STOP] = t_stop
        self._counts[_LIMIT] = self._counts[_STEPS] + min(steps, _UNLIMITED)
        return Outcome(self._call(self._run))

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if self._call(self._interpolate, t, *self._places) or not np.isfinite(self._y).all():
            raise no_interpolation(t)
        return t, self._y.copy(), self._yp.copy()

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        y, yp = np.empty((2, len(times), self._size))
        self._counts[_LIMIT] = self._counts[_STEPS] + min(steps, _UNLIMITED)
        tables = (array.ctypes.data for array in (y, yp))
        outcome = self._call(self._sample, times.ctypes.data, len(times), *tables)
        filled = int(self._counts[_FILLED])
        if outcome == _NO_VALUE:
            raise no_interpolation(float(times[filled]))
        return y[:filled], yp[:filled], Outcome(outcome)

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
        """Return rates that call Python."""
        size = problem.size

        def rates(t: float, y: int, yp: int, data: int) -> int:
            if self._failure is not None or self.interrupted:
                return 1
            try:
                found = np.ctypeslib.as_array(ctypes.cast(yp, ctypes.POINTER(c_double)), (size,))
                found[:] = problem.rates(t, np.ctypeslib.as_array(ctypes.cast(y, ctypes.POINTER(c_double)), (size,)))
            except (KernelEvaluationError, ArithmeticError):
                return 1
            except BaseException as error:
                self._failure = error
                return 1
            return 0 if np.isfinite(found).all() else 1

        function = _RATES(rates)
        return CompiledRates(ctypes.cast(function, c_void_p).value or 0, 0, function)


_COUNTED = len(names_of(Counts))


@cache
def _layout(size: int) -> tuple[int, tuple[int, ...]]:
    """Return how long rows are, and where each array of a session ends, for so many unknowns."""
    padded = -(-size // LANES) * LANES
    lengths = ROWS["all"] * padded, len(NUMBERS), len(COUNTS), len(POINTERS), size, size
    return padded, tuple(accumulate(lengths))


_T, _STOP, _R, _LONGEST, _HORIZON, _FIRST = map(NUMBERS.index, ("t", "stop", "relative", "longest", "horizon", "first"))
_T_OLD = NUMBERS.index("t_old")
_LIMIT, _STEPS, _FILLED = map(COUNTS.index, ("limit", "steps", "filled"))
_EVENTS, _HEEDS, _SEEN = map(COUNTS.index, ("event_count", "heeds", "seen"))
_PROJECT, _WATCH, _GUARD = map(POINTERS.index, ("project", "watch", "guard"))


_ROUTINES = RoutineSource(
    "integrators.dop853.steps",
    (
        "integrators/dop853/dense_output.py",
        "integrators/dop853/memory.py",
        "integrators/dop853/reference.py",
        "integrators/dop853/tableau.py",
        "integrators/explicit_problem.py",
        "integrators/output_times.py",
    ),
)


@once
def _code() -> Built:
    """Return the code of the steps."""
    return build_code([], CodeOptions(level=2), exports=("run", "interpolate", "sample", "begin"), routines=_ROUTINES)


@once
def functions() -> tuple[Callable[..., int], ...]:
    """Return the functions `run`, `interpolate`, `sample` and `begin`."""
    addresses = _code().code.addresses
    shapes = {
        "run": (c_void_p,),
        "interpolate": (c_void_p, c_double, c_void_p, c_void_p),
        "sample": (c_void_p, c_void_p, c_int64, c_void_p, c_void_p),
        "begin": (c_void_p, c_double, c_void_p),
    }
    return tuple(ctypes.CFUNCTYPE(c_int, *shape)(addresses[name]) for name, shape in shapes.items())
