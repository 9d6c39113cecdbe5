"""Residual, Jacobian and error weights of a mechanism with loops as IDA calls them, for any choice of coordinates."""

from __future__ import annotations

import ctypes

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.codegen.sundials.null_space import ATTENTION, FIELDS, LIMIT, RATE, NullSpaceShape, null_space_source
from atwood.codegen.sundials.residuals import check_groups
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.late import dataclass

__all__ = ["NullSpaceCallbacks", "NullSpaceData", "compile_null_space_callbacks"]
_EXPORTS = ("ida_residual", "ida_jacobian", "ida_weights")


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
    """Compile what the reduced form of a mechanism with loops is made of to functions that IDA calls.

    Parameters
    ----------
    stack
        Program of (t, y, y') with kinematic rows, balances, constraints, their rates, and their slopes.
    derivatives
        Program of (t, y, y', cj, multipliers) with the entries of the derivatives of all but the Jacobian.
    jacobian, pattern
        Row and column of each slope, and of each derivative.
    shape
        How many there are of each.
    sparse
        Whether IDA's matrix is sparse; its pattern is full.
    cache
        Whether to use the cache on disk.
    layout
        Where SUNDIALS' structures have their arrays; by default as in the libraries that scikit-sundae ships.

    Raises
    ------
    UsageError
        If the programs have other inputs or outputs than these.
    """
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
    built = build_code(parts, default_options(parts), exports=_EXPORTS, routines=routines, cached=cache)
    return NullSpaceCallbacks(stack, derivatives, shape, built)


class _Pointers(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in FIELDS)


@dataclass(frozen=True, eq=False)
class NullSpaceData:
    """The user's data of the callbacks of one session; it must live as long as IDA may call.

    Attributes
    ----------
    address
        What IDA is given as the user's data.
    choice
        Which coordinates are dependent, as lists of numbers; may be changed between two steps.
    """

    address: int
    choice: NDArray[np.int64]
    _pointers: _Pointers
    _arrays: dict[str, NDArray[np.generic]]

    @property
    def bytes(self) -> int:
        """How long the user's data are; they hold nothing but pointers."""
        return ctypes.sizeof(self._pointers)

    def set_weights(self, relative: ArrayLike, absolute: ArrayLike) -> None:
        """Make the error weights ``1 / (relative[i] |y[i]| + absolute[i])``."""
        self._arrays["relative"][:] = relative
        self._arrays["absolute"][:] = absolute

    @property
    def rate(self) -> float:
        """The factor cj of the last Jacobian."""
        return float(self._arrays["state"][RATE])

    def take_attention(self) -> bool:
        """Return whether a Jacobian found the choice to be a poor one since this was last asked."""
        state = self._arrays["state"]
        found, state[ATTENTION] = bool(state[ATTENTION]), 0.0
        return found


class NullSpaceCallbacks:
    """Residual, Jacobian and error weights as IDA calls them, for any choice of dependent coordinates.

    Residual and Jacobian return 1 (recoverable) where a value is not finite. The weights return -1, at which IDA
    hands over what it has, where a weight is not positive or the last Jacobian found the choice to be a poor one.

    Parameters
    ----------
    stack, derivatives
        What they are made of.
    shape
        How many there are of each.
    built
        The code.

    Attributes
    ----------
    residual_address, jacobian_address, weights_address
        The addresses of the functions.
    from_cache
        Whether nothing had to be compiled.
    """

    def __init__(self, stack: Program, derivatives: Program, shape: NullSpaceShape, built: Built) -> None:
        self.programs = {"residual": stack, "jacobian": derivatives}
        self.shape = shape
        self.built = built
        self.from_cache = built.from_cache
        self.residual_address, self.jacobian_address, self.weights_address = (
            built.code.addresses[name] for name in _EXPORTS
        )

    def bind(self, parameter_values: ArrayLike, choice: ArrayLike, sizes: ArrayLike, limit: float) -> NullSpaceData:
        """Return the user's data for values of the parameters; each run needs its own.

        Parameters
        ----------
        parameter_values
            The values in the order of the programs' parameters.
        choice
            Which coordinates are dependent, as the lists that `NullSpaceShape.choice` names.
        sizes
            The size of each speed.
        limit
            How much of a dependent coordinate one of the independent ones may move, both by their sizes, before the
            choice counts as poor.

        Raises
        ------
        KernelEvaluationError
            If the number of values is wrong.
        """
        arrays: dict[str, NDArray[np.generic]] = {}
        for name, program in self.programs.items():
            arrays[f"derived_{name}"], arrays["scratch"] = self.built.derive(name, program, parameter_values)
        chosen = np.array(choice, dtype=np.int64)
        arrays["choice"] = chosen
        arrays["relative"], arrays["absolute"] = np.zeros(self.shape.size), np.ones(self.shape.size)
        arrays["work"], arrays["sizes"] = np.zeros(self.shape.work["end"]), np.array(sizes, dtype=float)
        arrays["state"] = state = np.zeros(3)
        state[LIMIT] = limit
        if chosen.shape != (self.shape.choice["end"],) or arrays["sizes"].shape != (self.shape.speeds,):
            raise UsageError("the choice or the sizes have another length than the mechanism")
        pointers = _Pointers(*[arrays[name].ctypes.data for name in FIELDS])
        return NullSpaceData(ctypes.addressof(pointers), chosen, pointers, arrays)
