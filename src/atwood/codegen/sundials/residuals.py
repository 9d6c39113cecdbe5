"""Residual, Jacobian and error weights as SUNDIALS IDA calls them, so that no Python runs between two steps."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.text import (
    SundialsLayout,
    columns_text,
    dense_text,
    residual_text,
    sparse_text,
    sundials_layout,
    weights_text,
)
from atwood.errors import KernelEvaluationError, UsageError
from atwood.expr.core.program import Program

__all__ = ["IdaCallbacks", "IdaData", "compile_ida_callbacks"]

RESIDUAL_TYPE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 4)
"""The signature of IDA's residual: time, y, y', the result, the user's data."""

JACOBIAN_TYPE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_double, *[ctypes.c_void_p] * 8)
"""The signature of IDA's Jacobian: time, cj, y, y', the residual, the matrix, the user's data, three vectors."""

WEIGHTS_TYPE = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 3)
"""The signature of IDA's error weights: y, the weights, the user's data."""

_PROLOGUE = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)


def compile_ida_callbacks(
    residual: Program,
    jacobian: Program,
    rows: ArrayLike,
    columns: ArrayLike,
    size: int,
    sparse: bool = False,
    *,
    is_list: bool = False,
    by_columns: bool = False,
    cache: bool = True,
    layout: SundialsLayout | None = None,
) -> IdaCallbacks:
    """Compile a residual and its Jacobian to functions that IDA calls directly.

    A dense matrix must come with zeros, as IDA hands it over to a direct linear solver; of a sparse one, in
    compressed columns, everything is written.

    Parameters
    ----------
    residual
        Program of (t, y, y') with one output group.
    jacobian
        Program of (t, y, y', cj) with the entries of ``dF/dy + cj dF/dy'`` as one output group.
    rows, columns
        Where each entry is.
    size
        The length of y.
    sparse
        Whether IDA's matrix is sparse.
    is_list
        Whether IDA's matrix is one column with all entries.
    by_columns
        Whether the Jacobian is a program of (t, y, y', cj, direction) with its product with a direction; then the
        matrix is dense and filled column by column.
    cache
        Whether to use the cache on disk.
    layout
        Where SUNDIALS' structures have their arrays; by default as in the libraries that scikit-sundae ships.

    Raises
    ------
    UsageError
        If the programs have other inputs or outputs than these.
    """
    at_rows = np.asarray(rows, dtype=np.int64).ravel()
    at_columns = np.asarray(columns, dtype=np.int64).ravel()
    _check(residual, [1, size, size], size)
    if by_columns and sparse:
        raise UsageError("a Jacobian by columns is full, and needs a dense matrix", where=jacobian.name)
    if by_columns:
        _check(jacobian, [1, size, size, 1, size], size)
    else:
        _check(jacobian, [1, size, size, 1], len(at_rows))
    if at_columns.shape != at_rows.shape or not _inside(at_rows, size) or not _inside(at_columns, size):
        raise UsageError(f"the entries of the Jacobian are not all inside {size} x {size}", where=jacobian.name)
    layout = layout or sundials_layout()
    places: tuple[int, ...] | None
    if by_columns:
        places, more = None, columns_text(layout, size)
    elif is_list:
        places, more = None, dense_text(layout)
    else:
        places, more = _jacobian_for(layout, at_rows, at_columns, size, sparse)
    parts = [Part("residual", residual), Part("jacobian", jacobian, places)]
    built = build_code(
        parts,
        default_options(parts),
        more=residual_text(layout) + weights_text(layout, size) + more,
        exports=("ida_residual", "ida_jacobian", "ida_weights"),
        library=("memcpy",) if sparse else (),
        cached=cache,
    )
    return IdaCallbacks(residual, jacobian, size, len(at_rows), sparse, built)


def _jacobian_for(
    layout: SundialsLayout, rows: NDArray[np.int64], columns: NDArray[np.int64], size: int, sparse: bool
) -> tuple[tuple[int, ...], str]:
    """Return where each entry goes in the matrix's array, and the Jacobian with IDA's signature."""
    if not sparse:
        return tuple((rows + size * columns).tolist()), dense_text(layout)
    order = np.lexsort((rows, columns))
    positions = np.empty(len(order), dtype=np.int64)
    positions[order] = np.arange(len(order))
    starts = np.searchsorted(columns[order], np.arange(size + 1))
    return tuple(positions.tolist()), sparse_text(layout, rows[order], starts)


class IdaData(ctypes.Structure):
    """The user's data of the callbacks: where each thread has what its functions need.

    It must live as long as IDA may call; `IdaCallbacks.bind` returns it with its arrays attached.
    """

    _fields_ = (
        ("derived_residual", ctypes.c_void_p),
        ("derived_jacobian", ctypes.c_void_p),
        ("scratch", ctypes.c_void_p),
        ("relative", ctypes.c_void_p),
        ("absolute", ctypes.c_void_p),
    )
    arrays: tuple[NDArray[np.float64], ...]
    """What the pointers point to."""

    @property
    def address(self) -> int:
        """What IDA is given as the user's data."""
        return ctypes.addressof(self)

    def set_weights(self, relative: ArrayLike, absolute: ArrayLike) -> None:
        """Make the error weights ``1 / (relative[i] |y[i]| + absolute[i])``."""
        for target, values in zip(self.arrays[-2:], (relative, absolute), strict=True):
            target[:] = values


class IdaCallbacks:
    """A residual and a Jacobian as IDA calls them; both return 1 (recoverable) where a value is not finite.

    With them comes a function for error weights, which returns -1 where a weight is not positive.

    Parameters
    ----------
    residual, jacobian
        What they compute.
    size
        The length of y.
    entries
        The number of entries of the Jacobian that are not always zero.
    sparse
        Whether the matrix is sparse.
    built
        The code; its ``failures`` hold what a function in Python raised, which IDA only sees as a missing value.

    Attributes
    ----------
    residual_address, jacobian_address, weights_address
        The addresses of the functions.
    scratch
        The length of the scratch array.
    from_cache
        Whether nothing had to be compiled.
    """

    def __init__(
        self, residual: Program, jacobian: Program, size: int, entries: int, sparse: bool, built: Built
    ) -> None:
        self.residual = residual
        self.jacobian = jacobian
        self.size = size
        self.entries = entries
        self.sparse = sparse
        self.built = built
        self.residual_address = built.code.addresses["ida_residual"]
        self.jacobian_address = built.code.addresses["ida_jacobian"]
        self.weights_address = built.code.addresses["ida_weights"]
        self.scratch = built.scratch
        self.from_cache = built.from_cache

    def bind(self, parameter_values: ArrayLike) -> IdaData:
        """Return the user's data for values of the parameters; each run needs its own.

        Raises
        ------
        KernelEvaluationError
            If the number of values is wrong.
        """
        values = np.array(parameter_values, dtype=float)
        scratch = np.empty(self.scratch)
        derived: list[NDArray[np.float64]] = []
        for name, program in (("residual", self.residual), ("jacobian", self.jacobian)):
            count = len(program.parameters)
            if values.shape != (count,):
                raise KernelEvaluationError(
                    f"needs {count} parameter values but got an array of shape {values.shape}", where=program.name
                )
            array = np.empty(len(program.prologue))
            prologue = _PROLOGUE(self.built.code.addresses[f"{name}_prologue"])
            prologue(values.ctypes.data, array.ctypes.data, scratch.ctypes.data)
            derived.append(array)
        arrays = (*derived, scratch, np.zeros(self.size), np.ones(self.size))
        data = IdaData(*[array.ctypes.data for array in arrays])
        data.arrays = arrays
        return data


def _check(program: Program, inputs: Sequence[int], outputs: int) -> None:
    found = [len(group.symbols) for group in program.inputs]
    results = [len(group.expressions) for group in program.outputs]
    if found != list(inputs) or results != [outputs]:
        raise UsageError(
            f"needs input groups of {list(inputs)} and one output group of {outputs}, not {found} and {results}",
            where=program.name,
        )


def _inside(positions: NDArray[np.int64], size: int) -> bool:
    return bool(np.all((positions >= 0) & (positions < size)))
