"""The Taylor-series method as machine code: no Python runs between outputs.

The code of the steps is the same for all systems and comes from the cache after the first time.  What a system adds is
its recurrences, as two compiled programs.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_double, c_int, c_int64, c_void_p
from itertools import accumulate
from math import inf, log2
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.once import once
from atwood.codegen.routines.source import RoutineSource
from atwood.errors import UsageError
from atwood.expr.series.taylor import TaylorPrograms
from atwood.integrators.compiled_functions import StepGuard
from atwood.integrators.event_location import State
from atwood.integrators.explicit_problem import Counts, Outcome, absolute_tolerances, no_interpolation
from atwood.integrators.protocol import FloatArray, SolverOptions
from atwood.integrators.taylor.memory import (
    COUNTS,
    LANES,
    NUMBERS,
    POINTERS,
    ROWS,
    STRIDE,
    WIDTH,
    positions,
)
from atwood.integrators.taylor.problem import DEFECT, FLOOR, TaylorProblem, choose_order, share_of_radius
from atwood.late import names_of, replace

if TYPE_CHECKING:
    from atwood.integrators.ensemble.batch import BatchPlaces

__all__ = ["CompiledRecurrences", "CompiledStepper"]

_UNLIMITED = 2**62
_NO_VALUE = 3
_PACKED = (0, 1, 2)
"""The groups of results of the program of an order whose rows lie in blocks: left, right and squares."""

_LINE = 8
"""Numbers in one line of the processor's cache: every array begins with one."""


class CompiledRecurrences:
    """The recurrences of a system as machine code, for any parameter values.

    Parameters
    ----------
    programs
        The recurrences, made for `~atwood.integrators.taylor.memory.LANES`.
    """

    def __init__(self, programs: TaylorPrograms) -> None:
        self.programs = programs
        self.size = len(programs.start.inputs[1].symbols)
        order = Part("order", programs.order, positions(programs.pairs, programs.squares, self.size), LANES, _PACKED)
        parts = [Part("start", programs.start), order]
        self.built = build_code(parts, replace(default_options(parts), contract=True))
        self.addresses = self.built.code.addresses
        self.layout = _Layout(self)

    def bind(self, parameter_values: ArrayLike) -> FloatArray:
        """Return what depends on parameters alone."""
        values = np.array(parameter_values, dtype=np.float64)
        count = len(self.programs.start.parameters)
        if values.shape != (count,):
            raise UsageError(f"needs {count} parameter values, got an array of {values.shape}")
        derived, scratch = np.empty(len(self.programs.start.prologue)), np.empty(self.built.scratch)
        prologue = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)(self.addresses["start_prologue"])
        prologue(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)
        return derived


class _Layout:
    """Where each array of a session stands, from the beginning of its memory.

    Parameters
    ----------
    recurrences
        What a session is of.

    Attributes
    ----------
    places, size, padded
        In numbers of 8 bytes: where arrays begin, how many there are in all, and in a row of unknowns.
    tables
        What the tables of pointers hold, in bytes from the beginning.
    pointers, is_own
        The pointers of a session, and which of them are such distances; addresses of functions are not.
    """

    def __init__(self, recurrences: CompiledRecurrences) -> None:
        programs, n = recurrences.programs, recurrences.size
        self.padded = -(-n // WIDTH) * WIDTH
        known = len(programs.order.parameters)
        pairs, squares = -(-programs.pairs // LANES), -(-programs.squares // LANES)
        lengths = {
            "pointers": len(POINTERS),
            "numbers": len(NUMBERS),
            "counts": len(COUNTS),
            "tables": 16,
            "values": 2 * n,
            "known": known,
            "spare": known,
            "derived": len(programs.order.prologue),
            "scratch": recurrences.built.scratch,
            "arrays": ROWS["all"] * self.padded,
            "pair_sums": pairs * LANES,
            "square_sums": squares * LANES,
            "table": (2 * pairs + squares) * STRIDE,
        }
        ends = [0, *accumulate(-(-length // _LINE) * _LINE for length in lengths.values())]
        self.places, self.size = dict(zip(lengths, ends, strict=False)), ends[-1]
        far = {name: 8 * at for name, at in self.places.items()}

        def row(name: str) -> int:
            return far["arrays"] + 8 * self.padded * ROWS[name]

        def number(name: str) -> int:
            return far["numbers"] + 8 * NUMBERS.index(name)

        pairs_of_tables = (
            *(number("t_new"), row("new"), row("new_rates"), far["known"]),
            *(number("time"), row("trial"), row("trial_rates"), far["spare"]),
            *(far["pair_sums"], far["square_sums"], far["numbers"]),
        )
        self.tables = np.array(pairs_of_tables, dtype=np.int64)
        names = ("new_in", "new_out", "trial_in", "trial_out", "order_in", "order_out")
        far |= {name: far["tables"] + 8 * at for name, at in zip(names, (0, 2, 4, 6, 8, 12), strict=True)}
        code = recurrences.addresses
        given = {"start": code["start"], "prologue": code["order_prologue"], "recurrence": code["order"]}
        given |= dict.fromkeys(("start_derived", "guard", "guard_data"), 0)  # of each session
        self.pointers = np.array([{**far, **given}[name] for name in POINTERS], dtype=np.int64)
        self.is_own = np.array([name not in given for name in POINTERS], dtype=np.int64)


class CompiledStepper:
    """The state of a run; see `~atwood.integrators.explicit_problem.Stepper`.

    Parameters
    ----------
    problem
        The recurrences.
    options
        The accuracy.
    order
        The order of the method; None takes the one that suits the tolerance.
    guard
        What judges steps besides their error.
    """

    def __init__(
        self,
        problem: TaylorProblem,
        options: SolverOptions,
        order: int | None = None,
        guard: StepGuard | None = None,
    ) -> None:
        if problem.compiled is None:
            raise UsageError("there is no machine code of these recurrences")
        recurrences, derived = problem.compiled()
        self._size, self._options = recurrences.size, options
        self._keep = recurrences, derived
        chosen = choose_order(options) if order is None else order
        self._lay_out(recurrences, derived, guard)
        n = self._size
        self._arrays[ROWS["floors"]] = 1.0
        self._arrays[ROWS["floors"], :n] = absolute_tolerances(options, n) / options.relative_tolerance
        programs = recurrences.programs
        pairs, squares = -(-programs.pairs // LANES), -(-programs.squares // LANES)
        self._counts[: COUNTS.index("limit")] = n, self._arrays.shape[1], chosen, pairs, squares
        share = log2(share_of_radius(chosen, options.relative_tolerance))
        allowed = DEFECT * options.relative_tolerance + FLOOR
        limits = allowed, options.max_step or inf, options.horizon, problem.reach
        self._numbers[_FIRST:] = options.first_step or 0.0, 0.0, problem.stop_time, share, *limits
        self._run, self._interpolate, self._sample, self._begin = _functions()

    def _lay_out(self, recurrences: CompiledRecurrences, derived: FloatArray, guard: StepGuard | None) -> None:
        """Find a place for everything, in one piece of memory that begins with a cache line."""
        layout, n = recurrences.layout, self._size
        memory = np.zeros(layout.size + _LINE)
        begins: int = memory.ctypes.data
        skipped = -(begins // 8) % _LINE
        memory, base = memory[skipped:], begins + 8 * skipped
        at = layout.places
        whole = memory.view(np.int64)
        self._numbers = memory[at["numbers"] : at["numbers"] + len(NUMBERS)]
        self._counts = whole[at["counts"] : at["counts"] + len(COUNTS)]
        self._arrays = memory[at["arrays"] : at["arrays"] + ROWS["all"] * layout.padded].reshape(-1, layout.padded)
        self._values = memory[at["values"] : at["values"] + 2 * n].reshape(2, n)
        whole[at["tables"] : at["tables"] + len(layout.tables)] = layout.tables + base
        pointers = whole[at["pointers"] : at["pointers"] + len(POINTERS)]
        pointers[:] = layout.pointers + base * layout.is_own
        pointers[POINTERS.index("start_derived")] = derived.ctypes.data
        if guard is not None:
            self._guard = guard
            pointers[POINTERS.index("guard") :] = guard.function, guard.data
        self._session = base + 8 * at["pointers"]
        self._parameters = recurrences.addresses["start_prologue"], derived.ctypes.data, base + 8 * at["scratch"]
        self._outputs = base + 8 * at["values"], base + 8 * (at["values"] + n)

    def batch_places(self) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call.

        What this session knows of parameters is written over by a run that has others.
        """
        from atwood.integrators.ensemble.batch import BatchPlaces

        begin, sample = (_code().code.addresses[name] for name in ("begin", "sample"))
        limit, steps, filled = (self._counts[COUNTS.index(name) :].ctypes.data for name in ("limit", "steps", "filled"))
        floors = self._arrays[ROWS["floors"]].ctypes.data
        places = begin, sample, self._session, limit, steps, filled, floors, _COUNTED
        return BatchPlaces(*places, self._parameters, 1.0 / self._options.relative_tolerance, self)

    @property
    def counts(self) -> Counts:
        """What it has done so far, over all starts."""
        return Counts(*self._counts[_STEPS : _STEPS + _COUNTED].tolist())

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._values[0] = y
        return bool(self._begin(self._session, t, self._outputs[0]) == 0)

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        n, arrays = self._size, self._arrays
        return float(self._numbers[_T]), arrays[ROWS["y"], :n].copy(), arrays[ROWS["rates"], :n].copy()

    def run(self, t_stop: float, steps: int) -> Outcome:
        """Take steps until one ends at or after a time, but no more than so many."""
        self._set("stop", t_stop)
        self._set_count("limit", int(self._counts[_STEPS]) + min(steps, _UNLIMITED))
        return Outcome(self._run(self._session))

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step."""
        if self._interpolate(self._session, t, *self._outputs) or not np.isfinite(self._values).all():
            raise no_interpolation(t)
        return t, self._values[0].copy(), self._values[1].copy()

    def sample(self, times: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, Outcome]:
        """Take steps, and return values and rates at as many of the times, one row each, as were reached."""
        times = np.ascontiguousarray(times, dtype=np.float64)
        y, yp = np.empty((2, len(times), self._size))
        self._set_count("limit", int(self._counts[_STEPS]) + min(steps, _UNLIMITED))
        tables = (array.ctypes.data for array in (y, yp))
        outcome = self._sample(self._session, times.ctypes.data, len(times), *tables)
        filled = int(self._counts[COUNTS.index("filled")])
        if outcome == _NO_VALUE:
            raise no_interpolation(float(times[filled]))
        return y[:filled], yp[:filled], Outcome(outcome)

    def _set(self, name: str, value: float) -> None:
        self._numbers[NUMBERS.index(name)] = value

    def _set_count(self, name: str, value: int) -> None:
        self._counts[COUNTS.index(name)] = value


_COUNTED = len(names_of(Counts))
_T, _FIRST, _STEPS = NUMBERS.index("t"), NUMBERS.index("first"), COUNTS.index("steps")


_ROUTINES = RoutineSource(
    "integrators.taylor.steps",
    (
        "integrators/output_times.py",
        "integrators/taylor/convolutions.py",
        "integrators/taylor/memory.py",
        "integrators/taylor/problem.py",
    ),
)


@once
def _code() -> Built:
    """Return the code of the steps."""
    exports = ("run", "interpolate", "sample", "begin")
    return build_code([], CodeOptions(level=2), exports=exports, routines=_ROUTINES)


@once
def _functions() -> tuple[Callable[..., int], ...]:
    """Return the functions `run`, `interpolate`, `sample` and `begin`."""
    addresses = _code().code.addresses
    shapes = {
        "run": (c_void_p,),
        "interpolate": (c_void_p, c_double, c_void_p, c_void_p),
        "sample": (c_void_p, c_void_p, c_int64, c_void_p, c_void_p),
        "begin": (c_void_p, c_double, c_void_p),
    }
    return tuple(ctypes.CFUNCTYPE(c_int, *shape)(addresses[name]) for name, shape in shapes.items())
