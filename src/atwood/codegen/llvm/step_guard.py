"""What judges a step by a program, as machine code that the methods call after each step that they would keep."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_double, c_int, c_void_p
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.expr.core.program import Program

__all__ = ["GuardCode", "GuardData", "compile_guard"]

_PROLOGUE = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)
_GUARD = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_double, c_void_p, c_void_p, c_void_p)

_TEXT = (
    """define i32 @guard(double %t0, ptr %y0, ptr %p0, double %t1, ptr %y1, ptr %p1, ptr %data) #0 {
entry:
  %first = alloca double
  %second = alloca double
  %share = alloca double
  %inputs = alloca [7 x ptr]
  %outputs = alloca ptr
  %floor.at = getelementptr double, ptr %data, i64 3
  %floor = load double, ptr %floor.at
  %h = fsub double %t1, %t0
  %is.short = fcmp ole double %h, %floor
  br i1 %is.short, label %good, label %ask
ask:
  store double %t0, ptr %first
  store double %t1, ptr %second
"""
    + "\n".join(
        f"""  %in{i} = getelementptr ptr, ptr %inputs, i64 {i}
  store ptr {name}, ptr %in{i}"""
        for i, name in enumerate(("%first", "%y0", "%p0", "%second", "%y1", "%p1", "%reach.at"))
    ).replace("  %in0", "  %reach.at = getelementptr double, ptr %data, i64 2\n  %in0", 1)
    + """
  store ptr %share, ptr %outputs
  %derived = load ptr, ptr %data
  %scratch.at = getelementptr ptr, ptr %data, i64 1
  %scratch = load ptr, ptr %scratch.at
  %code = call i32 @kernel(ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs)
  %found = load double, ptr %share
  %passes = fcmp ole double %found, 1.0
  br i1 %passes, label %good, label %bad
good:
  ret i32 0
bad:
  ret i32 1
}
"""
)


class GuardData(NamedTuple):
    """The guard of one session; see `atwood.integrators.compiled_functions.StepGuard`."""

    function: int
    data: int
    passes: Callable[[float, FloatArray, FloatArray, float, FloatArray, FloatArray], bool]
    keep: object


class GuardCode:
    """A program that judges steps, for any parameter values.

    Parameters
    ----------
    program
        See `compile_guard`.
    built
        The code.
    """

    def __init__(self, program: Program, built: Built) -> None:
        self._program, self._built = program, built

    def bind(self, parameter_values: ArrayLike, reach: float, shortest: float) -> GuardData:
        """Return the guard of one session.

        Parameters
        ----------
        parameter_values
            The values in the order of the program's parameters.
        reach
            The program's last input.
        shortest
            Steps that are no longer than this are not judged, s.
        """
        addresses, program = self._built.code.addresses, self._program
        values = np.array(parameter_values, dtype=np.float64)
        derived, scratch = np.empty(max(1, len(program.prologue))), np.empty(max(1, self._built.scratch))
        _PROLOGUE(addresses["kernel_prologue"])(values.ctypes.data, derived.ctypes.data, scratch.ctypes.data)
        data = np.zeros(4)
        data[:2].view(np.uint64)[:] = derived.ctypes.data, scratch.ctypes.data
        data[2:] = reach, shortest
        call, place = _GUARD(addresses["guard"]), data.ctypes.data
        keep = self._built, derived, scratch, data

        def passes(
            t0: float, y0: FloatArray, p0: FloatArray, t1: float, y1: FloatArray, p1: FloatArray, _: object = keep
        ) -> bool:
            rows = [np.ascontiguousarray(one, dtype=np.float64) for one in (y0, p0, y1, p1)]
            a, b, c, d = (one.ctypes.data for one in rows)
            return bool(call(t0, a, b, t1, c, d, place) == 0)

        return GuardData(addresses["guard"], place, passes, keep)


def compile_guard(program: Program) -> GuardCode:
    """Compile a program that judges steps.

    Parameters
    ----------
    program
        See `atwood.simulation.problem.curved_laws.watched_program`.
    """
    part = Part("kernel", program)
    return GuardCode(program, build_code([part], default_options([part]), more=_TEXT, exports=["guard"]))
