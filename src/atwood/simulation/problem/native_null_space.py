"""Compiled functions of a mechanism with loops, which follow changes of its dependent coordinates."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import field

from atwood.arrays import FloatArray
from atwood.codegen.sundials.null_space_residuals import NullSpaceCallbacks, NullSpaceData, compile_null_space_callbacks
from atwood.forms.null_space import NullSpaceProgram
from atwood.integrators.compiled_functions import NativeCallbacks
from atwood.integrators.protocol import LinearSolver
from atwood.late import dataclass
from atwood.simulation.dynamics.partitioning import POOR
from atwood.simulation.problem.partition_arrays import choice_lists, null_space_shape

__all__ = ["CompiledNullSpace", "compile_null_space"]


def compile_null_space(program: NullSpaceProgram, linear_solver: LinearSolver) -> NullSpaceCallbacks:
    """Return the compiled functions for a matrix of one kind."""
    return compile_null_space_callbacks(
        program.stack,
        program.derivatives,
        (program.jacobian_rows, program.jacobian_columns),
        (program.rows, program.columns),
        null_space_shape(program),
        sparse=linear_solver == "sparse",
    )


@dataclass
class CompiledNullSpace:
    """The compiled functions of a scene with its parameters, for as many sessions as ask for them.

    Attributes
    ----------
    program
        What they compute.
    parameter_values
        The values of the parameters.
    sizes
        The size of each speed.
    """

    program: NullSpaceProgram
    parameter_values: FloatArray
    sizes: FloatArray
    _sessions: weakref.WeakSet[NullSpaceData] = field(default_factory=weakref.WeakSet)

    def callbacks(
        self,
        code: NullSpaceCallbacks,
        dependent: tuple[tuple[int, ...], tuple[int, ...]],
        review: Callable[[float, FloatArray], bool],
    ) -> NativeCallbacks:
        """Return the functions for one session.

        Parameters
        ----------
        code
            What `compile_null_space` gave.
        dependent
            The choice at first: dependent displacements, and dependent speeds.
        review
            Looks at them anew at a time and a state, and returns whether others were chosen.
        """
        places, speeds = dependent
        data = code.bind(self.parameter_values, choice_lists(self.program, speeds, places), self.sizes, POOR)
        self._sessions.add(data)

        def attend(t: float, y: FloatArray) -> bool | None:
            return review(t, y) if data.take_attention() else None

        return NativeCallbacks(
            code.residual_address,
            code.jacobian_address,
            data.address,
            code.weights_address,
            data.set_weights,
            attend=attend,
            last_rate=lambda: data.rate,
            keep=(code, data),
            data_bytes=data.bytes,
        )

    def choose(self, places: tuple[int, ...], speeds: tuple[int, ...]) -> None:
        """Make other displacements and speeds the dependent ones, in all sessions."""
        lists = choice_lists(self.program, speeds, places)
        for data in self._sessions:
            data.choice[:] = lists
