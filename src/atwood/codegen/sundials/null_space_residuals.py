"""Residual, Jacobian and error weights of a mechanism with loops as IDA calls them, for any choice of coordinates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.null_space import ATTENTION, FIELDS, LIMIT, RATE, NullSpaceShape, null_space_source
from atwood.codegen.sundials.residuals import EXPORTS, Callbacks, UserData, check_groups
from atwood.errors import UsageError
from atwood.expr.core.program import Program


def compile_null_space_callbacks(
    stack: Program,
    derivatives: Program,
    jacobian: tuple[ArrayLike, ArrayLike],
    pattern: tuple[ArrayLike, ArrayLike],
    shape: NullSpaceShape,
    sparse: bool = False,
    *,
    cache: bool = True,
    layout: SundialsLayout | None = None,
) -> NullSpaceCallbacks:
    """Compile what the reduced form of a mechanism with loops is made of to functions that IDA calls."""
    jacobian_rows, jacobian_columns, rows, columns = (
        np.asarray(x, dtype=np.int64).ravel() for x in (*jacobian, *pattern)
    )
    check_groups(stack, [1, shape.size, shape.size], shape.stack + len(jacobian_rows))
    check_groups(derivatives, [1, shape.size, shape.size, 1, shape.rates], len(rows))
    placed = np.concatenate([np.arange(shape.stack), shape.stack + jacobian_rows * shape.speeds + jacobian_columns])
    parts = [
        Part("residual", stack, tuple(placed.tolist())),
        Part("jacobian", derivatives, tuple((columns * shape.stack + rows).tolist())),
    ]
    routines = null_space_source(layout or sundials_layout(), shape, sparse)
    built = build_code(parts, default_options(parts), exports=EXPORTS, routines=routines, cached=cache)
    return NullSpaceCallbacks({"residual": stack, "jacobian": derivatives}, shape, built)


class NullSpaceData(UserData):
    """The user's data of one session, with the choice of dependent coordinates; see `UserData`."""

    @property
    def choice(self) -> NDArray[np.int64]:
        """Which coordinates are dependent, as lists of numbers; may be changed between two steps."""
        return self.arrays["choice"]

    @property
    def rate(self) -> float:
        """The factor cj of the last Jacobian."""
        return float(self.arrays["state"][RATE])

    def take_attention(self) -> bool:
        """Return whether a Jacobian found the choice to be a poor one since this was last asked."""
        state = self.arrays["state"]
        found, state[ATTENTION] = bool(state[ATTENTION]), 0.0
        return found


class NullSpaceCallbacks(Callbacks):
    """The functions of a mechanism with loops, for any choice of dependent coordinates; see `Callbacks`.

    The weights return -1, at which IDA hands over what it has, also where the last Jacobian found the choice to be a
    poor one.
    """

    def __init__(self, programs: Mapping[str, Program], shape: NullSpaceShape, built: Built) -> None:
        super().__init__(programs, shape.size, built)
        self.shape = shape

    def bind(self, parameter_values: ArrayLike, choice: ArrayLike, sizes: ArrayLike, limit: float) -> NullSpaceData:
        """Return the user's data for values of the parameters; each run needs its own."""
        arrays = self._arrays(parameter_values) | {
            "choice": np.array(choice, dtype=np.int64),
            "work": np.zeros(self.shape.work["end"]),
            "sizes": np.array(sizes, dtype=float),
            "state": np.zeros(3),
        }
        arrays["state"][LIMIT] = limit
        if arrays["choice"].shape != (self.shape.choice["end"],) or arrays["sizes"].shape != (self.shape.speeds,):
            raise UsageError("the choice or the sizes have another length than the mechanism")
        return NullSpaceData(FIELDS, arrays)
