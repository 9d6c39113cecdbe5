"""Residual, Jacobian and error weights as SUNDIALS IDA calls them, so that no Python runs between two steps."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.ida_routines import FIELDS, callbacks_source
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.errors import UsageError
from atwood.expr.core.program import Program

__all__ = ["IdaCallbacks", "IdaData", "check_groups", "compile_ida_callbacks"]


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
    check_groups(residual, [1, size, size], size)
    if by_columns and sparse:
        raise UsageError("a Jacobian by columns is full, and needs a dense matrix", where=jacobian.name)
    if by_columns:
        check_groups(jacobian, [1, size, size, 1, size], size)
    else:
        check_groups(jacobian, [1, size, size, 1], len(at_rows))
    if at_columns.shape != at_rows.shape or not _inside(at_rows, size) or not _inside(at_columns, size):
        raise UsageError(f"the entries of the Jacobian are not all inside {size} x {size}", where=jacobian.name)
    layout = layout or sundials_layout()
    places, starts = None, np.arange(size + 1)
    if sparse:
        order = np.lexsort((at_rows, at_columns))
        places = np.argsort(order)
        at_rows, starts = at_rows[order], np.searchsorted(at_columns[order], starts)
    elif not (by_columns or is_list):
        places = at_rows + size * at_columns
    parts = [Part("residual", residual), Part("jacobian", jacobian, None if places is None else tuple(places.tolist()))]
    form = "sparse" if sparse else "columns" if by_columns else "dense"
    built = build_code(
        parts,
        default_options(parts),
        exports=("ida_residual", "ida_jacobian", "ida_weights"),
        routines=callbacks_source(layout, size, form, len(at_rows) if sparse else 0),
        cached=cache,
    )
    index = np.int32 if layout.index_bytes == 4 else np.int64
    pattern = (at_rows.astype(index), starts.astype(index)) if sparse else (np.empty(0), np.empty(0))
    return IdaCallbacks(residual, jacobian, size, pattern, built)


class IdaData(ctypes.Structure):
    """The user's data of the callbacks: where each thread has what its functions need.

    It must live as long as IDA may call; `IdaCallbacks.bind` returns it with its arrays attached.
    """

    _fields_ = tuple((name, ctypes.c_void_p) for name in FIELDS)
    arrays: dict[str, NDArray[Any]]
    """What the pointers point to."""

    @property
    def address(self) -> int:
        """What IDA is given as the user's data."""
        return ctypes.addressof(self)

    def set_weights(self, relative: ArrayLike, absolute: ArrayLike) -> None:
        """Make the error weights ``1 / (relative[i] |y[i]| + absolute[i])``."""
        self.arrays["relative"][:] = relative
        self.arrays["absolute"][:] = absolute


class IdaCallbacks:
    """A residual and a Jacobian as IDA calls them; both return 1 (recoverable) where a value is not finite.

    With them comes a function for error weights, which returns -1 where a weight is not positive.

    Parameters
    ----------
    residual, jacobian
        What they compute.
    size
        The length of y.
    pattern
        The row of each entry of a sparse matrix, and where each column starts.
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
        self, residual: Program, jacobian: Program, size: int, pattern: tuple[NDArray[Any], NDArray[Any]], built: Built
    ) -> None:
        self._programs = {"residual": residual, "jacobian": jacobian}
        self._size, self._pattern = size, pattern
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
        arrays: dict[str, NDArray[Any]] = dict(zip(("rows", "starts"), self._pattern, strict=True))
        for name, program in self._programs.items():
            arrays[f"derived_{name}"], arrays["scratch"] = self.built.derive(name, program, parameter_values)
        arrays |= {"relative": np.zeros(self._size), "absolute": np.ones(self._size)}
        data = IdaData(*[arrays[name].ctypes.data for name in FIELDS])
        data.arrays = arrays
        return data


def check_groups(program: Program, inputs: Sequence[int], outputs: int) -> None:
    """Refuse a program with other inputs than these, or another number of results in its only output group."""
    found = [len(group.symbols) for group in program.inputs]
    results = [len(group.expressions) for group in program.outputs]
    if found != list(inputs) or results != [outputs]:
        raise UsageError(
            f"needs input groups of {list(inputs)} and one output group of {outputs}, not {found} and {results}",
            where=program.name,
        )


def _inside(positions: NDArray[np.int64], size: int) -> bool:
    return bool(np.all((positions >= 0) & (positions < size)))
