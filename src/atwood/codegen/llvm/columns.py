"""Programs over many states as machine code: arrays with one row for each number, and one column for each state.

For a few dozen states that takes a tenth of the time of NumPy, which does one operation of the program for all of them.
"""

from __future__ import annotations

import ctypes
from ctypes import c_int64, c_void_p
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray, address_of
from atwood.clock import check_time
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines import ADDRESS, INTEGER, Routine, addresses
from atwood.expr.core.program import Program

_COLUMNS = ctypes.CFUNCTYPE(None, *[c_void_p] * 5, c_int64)


def compile_columns(program: Program) -> ColumnProgram:
    """Compile a program for many states at once."""
    inputs = tuple(len(group.symbols) for group in program.inputs)
    outputs = tuple(len(group.expressions) for group in program.outputs)
    part, routines = Part("kernel", program), RoutineSource("codegen.llvm.columns", (), (inputs, outputs))
    return ColumnProgram(program, build_code([part], default_options([part]), exports=["columns"], routines=routines))


class ColumnProgram:
    """A program for many states, for any parameter values.

    Parameters
    ----------
    program, built
        What it computes, and its code.
    """

    def __init__(self, program: Program, built: Built) -> None:
        self.program, self.built = program, built
        self.call = _COLUMNS(built.code.addresses["columns"])
        self.inputs = [len(group.symbols) for group in program.inputs]
        self.outputs = [len(group.expressions) for group in program.outputs]

    def bind(self, parameter_values: ArrayLike) -> ColumnKernel:
        """Compute once what depends on parameters alone."""
        derived, _ = self.built.derive("kernel", self.program, parameter_values)
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
        self.code, self._derived = code, derived

    def __call__(self, *groups: FloatArray) -> tuple[FloatArray, ...]:
        """Evaluate the program; what is outside the domain of an operation gives nan."""
        check_time()
        code, states = self.code, max(one.shape[1] for one in groups)
        given = [_full(one, (size, states)) for one, size in zip(groups, code.inputs, strict=True)]
        found = [np.empty((size, states)) for size in code.outputs]
        room, scratch = np.empty(sum(code.inputs) + sum(code.outputs)), np.empty(code.built.scratch)
        lists = [(c_void_p * len(arrays))(*map(address_of, arrays)) for arrays in (given, found)]
        work = (self._derived, scratch, room)
        code.call(*lists, *map(address_of, work), states)
        return tuple(found)


def _full(values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    return np.ascontiguousarray(values if values.shape == shape else np.broadcast_to(values, shape))


def write_routines(inputs: tuple[int, ...], outputs: tuple[int, ...]) -> list[Routine]:
    """Write the loop over the states: each is gathered, worked on, and scattered."""
    arguments = dict.fromkeys(("inputs", "outputs", "derived", "scratch", "room"), ADDRESS) | {"states": INTEGER}
    r = Routine("columns", arguments, None, exported=True)
    given, found, derived, scratch, room, states = r.arguments
    sizes, begins = (*inputs, *outputs), [0, *accumulate((*inputs, *outputs))]
    places = [room.at(begin) for begin in begins[:-1]]
    arrays = [given.read(k, ADDRESS) for k in range(len(inputs))] + [
        found.read(k, ADDRESS) for k in range(len(outputs))
    ]
    groups, middle = list(zip(arrays, places, sizes, strict=True)), len(inputs)
    lists = [addresses(r, places[:middle]), addresses(r, places[middle:])]
    with r.count(states) as state:
        for array, place, size in groups[:middle]:
            with r.count(size) as i:
                place[i] = array[i * states + state]
        r.call("kernel", lists[0], derived, scratch, lists[1])
        for array, place, size in groups[middle:]:
            with r.count(size) as i:
                array[i * states + state] = place[i]
    return [r]
