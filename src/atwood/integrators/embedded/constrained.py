"""Accelerations of a mechanism whose constraints stay, and what takes its states onto them, as machine code."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.integrators.embedded.rates import rates_source
from atwood.integrators.explicit_problem import CompiledRates

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
        routines = rates_source(q, u, given=len(accelerations.outputs) == 2, projects=True)
        self._built = build_code(parts, default_options(parts), exports=["rates", "project"], routines=routines)

    def bind(self, parameter_values: ArrayLike, projects: bool = True) -> Callable[[], CompiledRates]:
        """Compute once what depends on parameters alone; return what gives each session functions of its own.

        Parameters
        ----------
        parameter_values
            The values in the order of the programs' parameters.
        projects
            Whether there are constraints to be met.
        """
        addresses, room = self._built.code.addresses, 5 + self._built.scratch
        named = zip(("kernel", "nearer"), self.programs, strict=True)
        derived = [self._built.derive(name, program, parameter_values)[0] for name, program in named]

        def rates() -> CompiledRates:
            # The pointers to derived values, scratch and room of each function, and then scratch and room themselves.
            own = np.empty(room + self.room)
            data = own.ctypes.data
            first, second = (one.ctypes.data for one in derived)
            own[:5].view(np.uint64)[:] = first, data + 40, second, data + 40, data + 8 * room
            keep = (self._built, derived, own)
            project = addresses["project"] if projects else 0
            return CompiledRates(addresses["rates"], data, keep, project, data + 16)

        return rates
