"""Accelerations of a mechanism whose constraints stay, and what takes its states onto them, as machine code."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_void_p

import numpy as np
from numpy.typing import ArrayLike

from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.integrators.dop853.native import rates_code
from atwood.integrators.explicit_problem import MET, STEPS, CompiledRates
from atwood.integrators.machine_text import exact

__all__ = ["CompiledConstraints"]


class CompiledConstraints:
    """Accelerations and projections as compiled functions, for any parameter values.

    Parameters
    ----------
    accelerations, projection
        See `atwood.forms.constrained.programs.ConstrainedProgram`.

    Raises
    ------
    UnsupportedError
        If a program calls functions in Python.
    """

    def __init__(self, accelerations: Program, projection: Program) -> None:
        for program in (accelerations, projection):
            if any(node.operation == "external" for node in program.nodes):
                raise UnsupportedError(
                    "a program that calls functions in Python has no compiled rates", where=program.name
                )
        parts = [Part("kernel", accelerations), Part("nearer", projection)]
        _, q, u = (len(group.symbols) for group in accelerations.inputs)
        self.programs, self.room = (accelerations, projection), q + 2 * u
        more = rates_code(q, u, given=len(accelerations.outputs) == 2) + _project_code(q, u)
        self._built = build_code(parts, default_options(parts), more=more, exports=["rates", "project"])

    def bind(self, parameter_values: ArrayLike, projects: bool = True) -> Callable[[], CompiledRates]:
        """Compute once what depends on parameters alone; return what gives each session functions of its own.

        Parameters
        ----------
        parameter_values
            The values in the order of the programs' parameters.
        projects
            Whether there are constraints to be met.
        """
        values = np.array(parameter_values, dtype=np.float64)
        addresses, scratch = self._built.code.addresses, np.empty(self._built.scratch)
        derived = [np.empty(len(program.prologue)) for program in self.programs]
        for name, one in zip(("kernel", "nearer"), derived, strict=True):
            prologue = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)(addresses[f"{name}_prologue"])
            prologue(values.ctypes.data, one.ctypes.data, scratch.ctypes.data)

        def rates() -> CompiledRates:
            # The pointers to derived values, scratch and room of each function, and then scratch and room themselves.
            own = np.empty(5 + len(scratch) + self.room)
            data = own.ctypes.data
            first, room = data + 40, data + 40 + 8 * len(scratch)
            own[:5].view(np.uint64)[:] = derived[0].ctypes.data, first, derived[1].ctypes.data, first, room
            keep = (self._built, derived, own)
            project = addresses["project"] if projects else 0
            return CompiledRates(addresses["rates"], data, keep, project, data + 16)

        return rates


def _project_code(coordinates: int, speeds: int) -> str:
    """Return the function that takes steps of Newton's method until one moves nothing; 1 where none does.

    Its data: derived values, scratch, and room for the results of a step.
    """
    n, m = coordinates, speeds
    return f"""
define i32 @project(double %t, ptr %y, ptr %data) #0 {{
entry:
  %time = alloca double
  %inputs = alloca [3 x ptr]
  %outputs = alloca [3 x ptr]
  store double %t, ptr %time
  %derived = load ptr, ptr %data
  %scratch.at = getelementptr ptr, ptr %data, i64 1
  %scratch = load ptr, ptr %scratch.at
  %room.at = getelementptr ptr, ptr %data, i64 2
  %room = load ptr, ptr %room.at
  %u = getelementptr double, ptr %y, i64 {n}
  %in.1 = getelementptr ptr, ptr %inputs, i64 1
  %in.2 = getelementptr ptr, ptr %inputs, i64 2
  store ptr %time, ptr %inputs
  store ptr %y, ptr %in.1
  store ptr %u, ptr %in.2
  %room.u = getelementptr double, ptr %room, i64 {n}
  %room.moved = getelementptr double, ptr %room, i64 {n + m}
  %out.1 = getelementptr ptr, ptr %outputs, i64 1
  %out.2 = getelementptr ptr, ptr %outputs, i64 2
  store ptr %room, ptr %outputs
  store ptr %room.u, ptr %out.1
  store ptr %room.moved, ptr %out.2
  br label %turn
turn:
  %step = phi i64 [ 0, %entry ], [ %step.next, %judge ]
  %code = call i32 @nearer(ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs)
  %bad = icmp ne i32 %code, 0
  br i1 %bad, label %lost, label %take
take:
  call void @llvm.memcpy.p0.p0.i64(ptr %y, ptr %room, i64 {8 * (n + m)}, i1 false)
  br label %size
size:
  %i = phi i64 [ 0, %take ], [ %i.next, %size ]
  %largest = phi double [ 0.0, %take ], [ %largest.next, %size ]
  %one.at = getelementptr double, ptr %room.moved, i64 %i
  %one = load double, ptr %one.at
  %one.size = call double @llvm.fabs.f64(double %one)
  %is_larger = fcmp ogt double %one.size, %largest
  %largest.next = select i1 %is_larger, double %one.size, double %largest
  %i.next = add i64 %i, 1
  %i.more = icmp slt i64 %i.next, {m}
  br i1 %i.more, label %size, label %judge
judge:
  %step.next = add i64 %step, 1
  %is_there = fcmp ole double %largest.next, {exact(MET)}
  %is_last = icmp sge i64 %step.next, {STEPS}
  %ends = or i1 %is_there, %is_last
  br i1 %ends, label %end, label %turn
end:
  br i1 %is_there, label %held, label %lost
held:
  ret i32 0
lost:
  ret i32 1
}}"""
