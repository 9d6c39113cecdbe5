"""Residual, Jacobian and error weights as SUNDIALS IDA calls them, so that no Python runs between two steps."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.sundials.ida_routines import FIELDS, callbacks_source
from atwood.codegen.sundials.layout import SundialsLayout, sundials_layout
from atwood.errors import UsageError
from atwood.expr.core.program import Program

EXPORTS = ("ida_residual", "ida_jacobian", "ida_weights")
"""The names of the functions that IDA calls."""


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
        exports=EXPORTS,
        routines=callbacks_source(layout, size, form, len(at_rows) if sparse else 0),
        cached=cache,
    )
    index = np.int32 if layout.index_bytes == 4 else np.int64
    pattern = {"rows": at_rows.astype(index), "starts": starts.astype(index)}
    return IdaCallbacks({"residual": residual, "jacobian": jacobian}, size, pattern, built)


class UserData:
    """The user's data of IDA's functions in one session: pointers to arrays. They must live as long as IDA may call.

    Parameters
    ----------
    fields
        The names of the arrays, in the order of the pointers.
    arrays
        The arrays by name, ``relative`` and ``absolute`` among them.

    Attributes
    ----------
    address, bytes
        What IDA is given as the user's data, and how long they are.
    """

    def __init__(self, fields: Sequence[str], arrays: Mapping[str, NDArray[Any]]) -> None:
        self.arrays = arrays
        self._pointers = (ctypes.c_void_p * len(fields))(*[arrays[name].ctypes.data for name in fields])
        self.address, self.bytes = ctypes.addressof(self._pointers), ctypes.sizeof(self._pointers)

    def set_weights(self, relative: ArrayLike, absolute: ArrayLike) -> None:
        """Make the error weights ``1 / (relative[i] |y[i]| + absolute[i])``."""
        self.arrays["relative"][:] = relative
        self.arrays["absolute"][:] = absolute


class Callbacks:
    """Residual, Jacobian and error weights as IDA calls them.

    The first two return 1 (recoverable) where a value is not finite, the last -1 where a weight is not positive.

    Parameters
    ----------
    programs
        The parts of the module.
    size
        The length of y.
    built
        The code; its ``failures`` hold what a function in Python raised, which IDA only sees as a missing value.

    Attributes
    ----------
    residual_address, jacobian_address, weights_address
        The addresses of the functions.
    from_cache
        Whether nothing had to be compiled.
    """

    def __init__(self, programs: Mapping[str, Program], size: int, built: Built) -> None:
        self._programs, self._size, self.built = programs, size, built
        self.residual_address, self.jacobian_address, self.weights_address = (
            built.code.addresses[name] for name in EXPORTS
        )
        self.from_cache = built.from_cache

    def _arrays(self, parameter_values: ArrayLike) -> dict[str, NDArray[Any]]:
        """Return the arrays of a session that all have: those of the programs, and tolerances."""
        arrays: dict[str, NDArray[Any]] = {"relative": np.zeros(self._size), "absolute": np.ones(self._size)}
        for name, program in self._programs.items():
            arrays[f"derived_{name}"], arrays["scratch"] = self.built.derive(name, program, parameter_values)
        return arrays


class IdaCallbacks(Callbacks):
    """The functions of a residual and a Jacobian, with the pattern of a sparse matrix; see `Callbacks`."""

    def __init__(
        self, programs: Mapping[str, Program], size: int, pattern: Mapping[str, NDArray[Any]], built: Built
    ) -> None:
        super().__init__(programs, size, built)
        self._pattern = pattern

    def bind(self, parameter_values: ArrayLike) -> UserData:
        """Return the user's data for values of the parameters; each run needs its own.

        Raises
        ------
        KernelEvaluationError
            If the number of values is wrong.
        """
        return UserData(FIELDS, {**self._arrays(parameter_values), **self._pattern})


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
