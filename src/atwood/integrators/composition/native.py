"""Compositions as machine code, to be stepped as the methods of Gauss are."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.expr import Program
from atwood.integrators.composition.steps import composition_source
from atwood.integrators.gauss.layout import POINTERS, Layout
from atwood.integrators.gauss.native import bind_functions
from atwood.integrators.gauss.steps import FUNCTIONS

__all__ = ["CompiledComposition"]


class CompiledComposition:
    """The equations of a separable H with the steps of a composition, for any parameter values and any step.

    Parameters
    ----------
    forces
        Program of (t, q) with p'.
    velocities
        Program of p with q'.
    order
        Of the method, one of `atwood.integrators.composition.coefficients.ORDERS`.
    """

    def __init__(self, forces: Program, velocities: Program, order: int) -> None:
        n = len(forces.inputs[1].symbols)
        self.order, self.layout = order, Layout(n, n, 1, False, False)
        parts = [Part("kernel", forces), Part("flow", velocities)]
        options = CodeOptions(level=2, sincos=default_options(parts).sincos)
        routines = composition_source(self.layout, order)
        self._built = build_code(parts, options, exports=FUNCTIONS, routines=routines)
        self.functions = bind_functions(self._built)
        self._programs = {"kernel": forces, "flow": velocities}

    def memory(self, parameter_values: FloatArray) -> tuple[FloatArray, tuple[object, ...]]:
        """Return the array of a session, and what it leads to."""
        found = [self._built.derive(name, one, parameter_values) for name, one in self._programs.items()]
        memory = np.zeros(self.layout.places["end"])
        pointers = memory[: len(POINTERS)].view(np.uint64)
        for name, (derived, scratch) in zip(("derived", "derived_2"), found, strict=True):
            pointers[POINTERS.index(name)] = derived.ctypes.data
            pointers[POINTERS.index("scratch")] = scratch.ctypes.data
        return memory, (self._built, found)
