"""Programs in Python that tapes compute once they have been walked through a few times, where they are long.

The values have the bits of the walks: linear systems, which NumPy solves there, have no tape.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Sequence
from ctypes import c_int, c_void_p
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arrays import FloatArray, address_of as place
from atwood.codegen.python.backend import CompiledProgram
from atwood.codegen.python.walk import WALKS
from atwood.expr.core.program import Program
from atwood.stages import stage

_EVALUATE = ctypes.CFUNCTYPE(c_int, *[c_void_p] * 5)

_LEAST = 300
"""So many nodes a program has: what has fewer is done sooner by compiled Python than its arrays are made."""


class TapedProgram(CompiledProgram):
    """A program for one state or many; see `CompiledProgram`."""

    @cached_property
    def _has_tape(self) -> bool:
        if self.vectorized or self.program.size < _LEAST or self.program.calls_python:
            return False
        return not any(node.operation == "solve" for node in self.program.nodes)

    @cached_property
    def main(self) -> Callable[..., tuple[list[Any], ...]]:
        """The function of the prologue values and the input groups."""
        if not self._has_tape:
            return self._function("vectorized" if self.vectorized else "fast")
        with stage("code"):
            return _function_of(self.program)

    @cached_property
    def _walks(self) -> dict[str, Iterator[int]]:
        if not self._has_tape:
            return self._patience()
        return {name: iter(range(WALKS)) for name in ("main", "_prologue")}


def _function_of(program: Program) -> Callable[..., tuple[list[Any], ...]]:
    """Return a program as a function of the prologue values and the input groups, which raises if one is infinite."""
    from atwood.codegen.llvm.own import address_of  # LLVM is imported when it is needed
    from atwood.codegen.llvm.tape import tapes_of
    from atwood.codegen.llvm.tiers import evaluator

    tape, _ = tapes_of(program, address_of)
    built = evaluator()
    call = _EVALUATE(built.code.addresses["evaluate"])
    sizes = [len(program.prologue), *(len(group.symbols) for group in program.inputs)]
    results = [len(group.expressions) for group in program.outputs]

    def pointers(arrays: Sequence[FloatArray]) -> ctypes.Array[c_void_p]:
        return (c_void_p * len(arrays))(*map(place, arrays))

    def computed(*groups: Any, _: object = built) -> tuple[list[Any], ...]:
        given = [np.array(group, dtype=np.float64) for group in groups]
        if [len(one) for one in given] != sizes:
            raise ValueError("groups of other sizes")
        found, scratch = [np.empty(count) for count in results], np.empty(tape.scratch)
        inputs, outputs = pointers(given[1:]), pointers(found)
        if call(place(tape.words), inputs, place(given[0]), place(scratch), outputs):
            raise ArithmeticError("a result is not finite")
        return tuple(one.tolist() for one in found)

    return computed
