"""Programs over many states as machine code: arrays with one row for each number, and one column for each state.

For a few dozen states that takes a tenth of the time of NumPy, which does one operation of the program for all of them.
"""

from __future__ import annotations

import ctypes
from ctypes import c_int64, c_void_p

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.clock import check_time
from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.routine import Routine
from atwood.expr.core.program import Program

__all__ = ["ColumnKernel", "ColumnProgram", "compile_columns"]

_COLUMNS = ctypes.CFUNCTYPE(None, *[c_void_p] * 5, c_int64)
_PROLOGUE = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)


def compile_columns(program: Program) -> ColumnProgram:
    """Compile a program for many states at once.

    Parameters
    ----------
    program
        What to compute; without functions in Python.
    """
    inputs = [len(group.symbols) for group in program.inputs]
    outputs = [len(group.expressions) for group in program.outputs]
    part = Part("kernel", program)
    text = _columns_text(inputs, outputs)
    return ColumnProgram(program, build_code([part], default_options([part]), more=text, exports=["columns"]))


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
        self._prologue = _PROLOGUE(built.code.addresses["kernel_prologue"])

    def bind(self, parameter_values: ArrayLike) -> ColumnKernel:
        """Compute once what depends on parameters alone.

        Parameters
        ----------
        parameter_values
            The values in the order of the program's parameters.
        """
        values = np.array(parameter_values, dtype=float)
        derived, scratch = np.empty(len(self.program.prologue)), np.empty(self.built.scratch)
        self._prologue(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)
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
        """Evaluate the program; what is outside the domain of an operation gives nan.

        Parameters
        ----------
        *groups
            One array of shape (size, states) for each input group.

        Returns
        -------
        tuple
            One array of shape (size, states) for each output group.
        """
        check_time()
        code, states = self.code, max(one.shape[1] for one in groups)
        given = [_full(one, (size, states)) for one, size in zip(groups, code.inputs, strict=True)]
        found = [np.empty((size, states)) for size in code.outputs]
        room, scratch = np.empty(sum(code.inputs) + sum(code.outputs)), np.empty(code.built.scratch)
        lists = [(c_void_p * len(arrays))(*[one.ctypes.data for one in arrays]) for arrays in (given, found)]
        work = (self._derived, scratch, room)
        code.call(*lists, *[one.ctypes.data for one in work], states)
        return tuple(found)


def _full(values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    return np.ascontiguousarray(values if values.shape == shape else np.broadcast_to(values, shape))


def _columns_text(inputs: list[int], outputs: list[int]) -> str:
    """Write the loop over the states: each is gathered, worked on, and scattered."""
    r = Routine()
    lists = [r.put(f"alloca [{len(sizes)} x ptr]") for sizes in (inputs, outputs)]
    places, begin = [], 0
    for made, sizes in zip(lists, (inputs, outputs), strict=True):
        for number, size in enumerate(sizes):
            place = r.place("%room", begin)
            r.do(f"store ptr {place}, ptr {r.put(f'getelementptr ptr, ptr {made}, i64 {number}')}")
            places.append(place)
            begin += size
    given = [r.load_pointer("%inputs", number) for number in range(len(inputs))]
    found = [r.load_pointer("%outputs", number) for number in range(len(outputs))]
    with r.loop(0, "%states") as state:
        for source, target, size in zip(given, places, inputs, strict=False):
            with r.loop(0, size) as i:
                r.store(r.load(source, r.index("mul", i.index, "%states"), state.index), target, i.index)
        r.put(f"call i32 @kernel(ptr {lists[0]}, ptr %derived, ptr %scratch, ptr {lists[1]})")
        for target, source, size in zip(found, places[len(inputs) :], outputs, strict=True):
            with r.loop(0, size) as i:
                r.store(r.load(source, i.index), target, r.index("mul", i.index, "%states"), state.index)
    r.do("ret void")
    arguments = "ptr %inputs, ptr %outputs, ptr %derived, ptr %scratch, ptr %room, i64 %states"
    return r.function(f"define void @columns({arguments}) #0")
