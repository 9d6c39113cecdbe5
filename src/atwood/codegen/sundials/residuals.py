"""Residual, Jacobian and error weights as SUNDIALS IDA calls them, so that no Python runs between two steps.

The functions with IDA's signatures around the kernels of a residual and a Jacobian, and what such have in common.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    CODE,
    INTEGER,
    NUMBER,
    Record,
    Routine,
    Scalar,
    Value,
    call_kernel,
    place_of,
)
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
        The code.

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


FIELDS = ("derived_residual", "derived_jacobian", "scratch", "relative", "absolute", "rows", "starts")
"""The pointers of the user's data, in order; the last two lead to the pattern of a sparse matrix."""

RESIDUAL = {"t": NUMBER, "yy": ADDRESS, "yyp": ADDRESS, "rr": ADDRESS, "data": ADDRESS}
JACOBIAN = {"t": NUMBER, "cj": NUMBER} | dict.fromkeys(("yy", "yyp", "rr", "matrix", "data", "a", "b", "c"), ADDRESS)


def callbacks_source(layout: SundialsLayout, size: int, form: str, entries: int) -> RoutineSource:
    """Return what writes residual, Jacobian and error weights."""
    return RoutineSource("codegen.sundials.residuals", (), (layout, size, form, entries))


def write_routines(layout: SundialsLayout, size: int, form: str, entries: int) -> list[Routine]:
    """Write the routines; see `callbacks_source`."""
    return [_residual(layout), write_weights(layout, size, FIELDS), _jacobian(layout, size, form, entries)]


def array_of(structure: Value, offset: int) -> Value:
    """Return an array of one of SUNDIALS' structures: through its content, which is its first member."""
    return structure.read(0, ADDRESS).read(offset // 8, ADDRESS)


def _residual(layout: SundialsLayout) -> Routine:
    r = Routine("ida_residual", RESIDUAL, exported=True)
    t, *vectors, data = r.arguments
    own = Record(data, dict.fromkeys(FIELDS, ADDRESS))
    y, yp, found = (array_of(one, layout.vector_data) for one in vectors)
    r.give(call_kernel(r, "residual", [place_of(r, t), y, yp], own.derived_residual, own.scratch, [found]))
    return r


def _jacobian(layout: SundialsLayout, size: int, form: str, entries: int) -> Routine:
    r = Routine("ida_jacobian", JACOBIAN, exported=True)
    t, cj, yy, yyp, _, matrix, data, *_ = r.arguments
    own = Record(data, dict.fromkeys(FIELDS, ADDRESS))
    inputs = [place_of(r, t), *(array_of(one, layout.vector_data) for one in (yy, yyp)), place_of(r, cj)]
    derived, scratch = own.derived_jacobian, own.scratch
    found = array_of(matrix, layout.sparse_data if form == "sparse" else layout.dense_data)
    if form == "columns":
        _fill_columns(r, size, inputs, (derived, scratch), found)
        return r
    if form == "sparse":
        _copy_pattern(r, layout, matrix, (own.rows, entries), (own.starts, size + 1))
    r.give(call_kernel(r, "jacobian", inputs, derived, scratch, [found]))
    return r


def _fill_columns(r: Routine, size: int, inputs: list[Value], work: tuple[Value, Value], found: Value) -> None:
    """Fill a dense matrix by products with one unit vector after the other."""
    direction, bad = r.array(size), r.variable(0, CODE)
    r.clear(direction, direction.at(size))
    with r.count(size) as j:
        direction[j] = 1.0
        code = call_kernel(r, "jacobian", [*inputs, direction], *work, [found.at(j * size)])
        direction[j] = 0.0
        bad.now = bad.now | code
    r.give(bad.now)


def _copy_pattern(
    r: Routine, layout: SundialsLayout, matrix: Value, rows: tuple[Value, int], starts: tuple[Value, int]
) -> None:
    """Copy the pattern into a matrix in compressed columns; -1 where that has no room."""
    kind = index_kind(layout)
    room = matrix.read(0, ADDRESS).at(layout.sparse_room // 8).read(0, kind)
    r.give_if(room < rows[1], -1)
    r.copy(array_of(matrix, layout.sparse_values), *rows, kind)
    r.copy(array_of(matrix, layout.sparse_pointers), *starts, kind)


def index_kind(layout: SundialsLayout) -> Scalar:
    """Return the kind of SUNDIALS' indices."""
    return CODE if layout.index_bytes == 4 else INTEGER


def write_weights(layout: SundialsLayout, size: int, fields: Sequence[str], attention: int | None = None) -> Routine:
    """Write the error weights, ``1 / (relative |y| + absolute)``; -1 where one is not positive.

    IDA asks for them before every step. On -1 it hands over what it has; so it does where somebody should look.
    """
    r = Routine("ida_weights", {"yy": ADDRESS, "weights": ADDRESS, "data": ADDRESS}, exported=True)
    *vectors, data = r.arguments
    own = Record(data, dict.fromkeys(fields, ADDRESS))
    y, weights = (array_of(one, layout.vector_data) for one in vectors)
    relative, absolute = own.relative, own.absolute
    stops = r.variable(0 if attention is None else own.state[attention] != 0.0, BOOLEAN)
    with r.count(size) as k:
        allowed = relative[k] * r.size(y[k]) + absolute[k]
        weights[k] = 1.0 / allowed
        stops.now = stops.now | ~(allowed > 0.0)
    r.give(r.choose(stops.now, -1, 0, CODE))
    return r
