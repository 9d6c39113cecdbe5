"""Programs over many states as machine code: arrays with one row for each number, and one column for each state.

For a few dozen states that takes a tenth of the time of NumPy, which does one operation of the program for all of them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_int64, c_void_p
from itertools import accumulate
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray, address_of
from atwood.clock import check_time
from atwood.codegen.llvm.build import Built, RoutineSource
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, INTEGER, Kind, Record, Routine
from atwood.expr.core.program import Program

_COLUMNS = ctypes.CFUNCTYPE(None, c_void_p)


def compile_columns(program: Program) -> ColumnProgram:
    """Compile a program for many states at once."""
    return ColumnProgram(program, Tiers([Part("kernel", program)], ["columns"], RoutineSource("codegen.llvm.columns")))


class ColumnProgram:
    """A program for many states, for any parameter values.

    Parameters
    ----------
    program, tiers
        What it computes, and its code.
    """

    def __init__(self, program: Program, tiers: Tiers) -> None:
        self.program, self.tiers = program, tiers
        self.inputs = [len(group.symbols) for group in program.inputs]
        self.outputs = [len(group.expressions) for group in program.outputs]
        sizes = (*self.inputs, *self.outputs)
        self.counts, self.width = np.array(sizes, dtype=np.int64), sum(sizes)
        self.counts_at = address_of(self.counts)
        self.begins = 8 * np.array([0, *accumulate(sizes)][:-1], dtype=np.int64)
        self._function: tuple[Built | None, Callable[[int], None]] = None, lambda _: None

    def function(self) -> tuple[Built, Callable[[int], None]]:
        """Return the present code, and its loop over the states."""
        built = self.tiers.now
        if self._function[0] is not built:
            self._function = built, _COLUMNS(built.code.addresses["columns"])
        return built, self._function[1]

    def bind(self, parameter_values: ArrayLike) -> ColumnKernel:
        """Compute once what depends on parameters alone."""
        derived, _ = self.tiers.now.derive("kernel", self.program, parameter_values)
        return ColumnKernel(self, derived)


class ColumnKernel:
    """A program with its parameter values: a function of the input groups, for one caller at a time.

    Parameters
    ----------
    code
        The program.
    derived
        What depends on parameters alone.
    """

    def __init__(self, code: ColumnProgram, derived: FloatArray) -> None:
        self.code, self._derived, self._derived_at = code, derived, address_of(derived)

    def __call__(self, *groups: FloatArray) -> tuple[FloatArray, ...]:
        """Evaluate the program; what is outside the domain of an operation gives nan."""
        check_time()
        code, states = self.code, max(one.shape[1] for one in groups)
        given = [_full(one, (size, states)) for one, size in zip(groups, code.inputs, strict=True)]
        found = [np.empty((size, states)) for size in code.outputs]
        (built, call), began, taken = code.function(), perf_counter(), len(given)
        room = np.empty(code.width + built.scratch)
        begin = address_of(room)
        arrays, places = np.array([*map(address_of, (*given, *found))], dtype=np.int64), code.begins + begin
        a, b, c = address_of(arrays), code.counts_at, address_of(places)
        data = a, a + 8 * taken, b, b + 8 * taken, c, c + 8 * taken, self._derived_at, begin + 8 * code.width
        job = (c_int64 * len(_FIELDS))(*data, taken, len(found), states)
        call(ctypes.addressof(job))
        code.tiers.spend_on(states, perf_counter() - began)
        return tuple(found)


def _full(values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    return np.ascontiguousarray(values if values.shape == shape else np.broadcast_to(values, shape))


_LISTS = ("inputs", "outputs", "input_sizes", "output_sizes", "gathered", "computed", "derived", "scratch")
_COUNTS = ("taken", "given", "states")
_FIELDS: dict[str, Kind] = {**dict.fromkeys(_LISTS, ADDRESS), **dict.fromkeys(_COUNTS, INTEGER)}


def write_routines() -> list[Routine]:
    """Write the loop over the states: each is gathered, worked on, and scattered."""
    r = Routine("columns", {"job": ADDRESS}, None, exported=True)
    m = Record(r.arguments[0], _FIELDS)
    states = m.states
    with r.count(states) as state:
        with r.count(m.taken) as k:
            array, place = m.inputs.read(k, ADDRESS), m.gathered.read(k, ADDRESS)
            with r.count(m.input_sizes.read(k, INTEGER)) as i:
                place[i] = array[i * states + state]
        r.call("kernel", m.gathered, m.derived, m.scratch, m.computed)
        with r.count(m.given) as k:
            array, place = m.outputs.read(k, ADDRESS), m.computed.read(k, ADDRESS)
            with r.count(m.output_sizes.read(k, INTEGER)) as i:
                array[i * states + state] = place[i]
    return [r]
