"""The Taylor-series method as machine code: no Python runs between outputs.

The code of the steps is the same for all systems and comes from the cache after the first time.  What a system adds is
its recurrences, as two compiled programs.
"""

from __future__ import annotations

from itertools import accumulate
from math import inf, log2
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.once import once
from atwood.codegen.routines.source import RoutineSource
from atwood.expr.series.taylor import TaylorPrograms
from atwood.integrators.compiled_functions import StepGuard
from atwood.integrators.explicit_problem import absolute_tolerances
from atwood.integrators.native_stepper import NativeStepper, Routines, routines_of
from atwood.integrators.protocol import SolverOptions
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
from atwood.lazy_dataclasses import replace

if TYPE_CHECKING:
    from atwood.integrators.ensemble.batch import BatchPlaces


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
        return self.built.derive("start", self.programs.start, parameter_values)[0]


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


class CompiledStepper(NativeStepper):
    """The state of a run with Taylor series.

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

    _number = MappingProxyType({name: place for place, name in enumerate(NUMBERS)})
    _count = MappingProxyType({name: place for place, name in enumerate(COUNTS)})

    def __init__(
        self,
        problem: TaylorProblem,
        options: SolverOptions,
        order: int | None = None,
        guard: StepGuard | None = None,
    ) -> None:
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
        self._routines = _routines()

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
        self._ends = self._arrays[ROWS["y"], :n], self._arrays[ROWS["rates"], :n]
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
        factor = 1.0 / self._options.relative_tolerance
        return self._places(self._arrays[ROWS["floors"]], factor, self._parameters)


_FIRST = NUMBERS.index("first")


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
def _routines() -> Routines:
    """Return the routines of the method."""
    return routines_of(_ROUTINES)
