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
from atwood.codegen.routines.kernels import call_kernel, place_of
from atwood.codegen.routines.kinds import ADDRESS, NUMBER
from atwood.codegen.routines.language import Routine
from atwood.codegen.routines.source import RoutineSource
from atwood.expr.core.program import Program

_GUARD = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_double, c_void_p, c_void_p, c_void_p)


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
        """Return the guard of one session."""
        address = self._built.code.addresses["guard"]
        derived, scratch = self._built.derive("kernel", self._program, parameter_values)
        data = np.zeros(4)
        data[:2].view(np.uint64)[:] = derived.ctypes.data, scratch.ctypes.data
        data[2:] = reach, shortest
        call, place = _GUARD(address), data.ctypes.data
        keep = self._built, derived, scratch, data

        def passes(
            t0: float, y0: FloatArray, p0: FloatArray, t1: float, y1: FloatArray, p1: FloatArray, _: object = keep
        ) -> bool:
            rows = [np.ascontiguousarray(one, dtype=np.float64) for one in (y0, p0, y1, p1)]
            a, b, c, d = (one.ctypes.data for one in rows)
            return bool(call(t0, a, b, t1, c, d, place) == 0)

        return GuardData(address, place, passes, keep)


def compile_guard(program: Program) -> GuardCode:
    """Compile a program that judges steps."""
    part = Part("kernel", program)
    routines = RoutineSource("codegen.llvm.step_guard")
    return GuardCode(program, build_code([part], default_options([part]), exports=["guard"], routines=routines))


def write_routines() -> list[Routine]:
    """Write what judges a step that is long enough: 0 where it is good, else 1."""
    arguments = {"t0": NUMBER, "y0": ADDRESS, "p0": ADDRESS, "t1": NUMBER, "y1": ADDRESS, "p1": ADDRESS}
    r = Routine("guard", arguments | {"data": ADDRESS}, exported=True)
    t0, y0, p0, t1, y1, p1, data = r.arguments
    with r.when(t1 - t0 <= data[3]):
        r.give(0)
    inputs, share = [place_of(r, t0), y0, p0, place_of(r, t1), y1, p1, data.at(2)], r.array(1)
    call_kernel(r, "kernel", inputs, data.read(0, ADDRESS), data.read(1, ADDRESS), [share])
    r.give((~(share[0] <= 1.0)).code())
    return [r]
