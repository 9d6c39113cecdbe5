"""Residual and Jacobian with the signatures that SUNDIALS IDA calls, so that no Python runs between two steps.

SUNDIALS hands over vectors and matrices as structures of its own.  Where their arrays lie in them follows from the
rules of C and from the width of SUNDIALS' index type, which scikit-sundae states about the libraries that it ships.
"""

from __future__ import annotations

import ctypes
import importlib.util
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.errors import KernelEvaluationError, UnsupportedError, UsageError
from atwood.expr.program import Program
from atwood.kernels.llvm_build import Built, build_code, default_options
from atwood.kernels.llvm_module import Part

__all__ = ["IdaCallbacks", "IdaData", "SundialsLayout", "compile_ida_callbacks", "layout_for", "sundials_layout"]

RESIDUAL_TYPE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 4)
"""The signature of IDA's residual: time, y, y', the result, the user's data."""

JACOBIAN_TYPE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_double, *[ctypes.c_void_p] * 8)
"""The signature of IDA's Jacobian: time, cj, y, y', the residual, the matrix, the user's data, three vectors."""

_PROLOGUE = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)


@dataclass(frozen=True)
class SundialsLayout:
    """Where the arrays lie in SUNDIALS' structures, in bytes from the start of each ``content``.

    Attributes
    ----------
    index_bytes
        The width of SUNDIALS' index type.
    vector_data, dense_data, sparse_data
        The values of a serial vector, of a dense and of a sparse matrix.
    sparse_room
        The number of entries that a sparse matrix has room for.
    sparse_values, sparse_pointers
        The row of each entry, and where each column starts.
    """

    index_bytes: int
    vector_data: int
    dense_data: int
    sparse_data: int
    sparse_room: int
    sparse_values: int
    sparse_pointers: int


@cache
def sundials_layout() -> SundialsLayout:
    """Return the layout of the structures in the libraries that scikit-sundae ships.

    Raises
    ------
    UnsupportedError
        If scikit-sundae does not say how its libraries were built, or they do not compute with 64-bit floats.
    """
    found = importlib.util.find_spec("sksundae")
    path = Path(found.origin).with_name("py_config.pxi") if found is not None and found.origin else None
    try:
        text = path.read_text() if path is not None else ""
    except OSError:
        text = ""
    settings = dict(re.findall(r"^(\w+)\s*=\s*[\"'](.*)[\"']", text, re.MULTILINE))
    widths = {"int": 4, "int32_t": 4, "long": ctypes.sizeof(ctypes.c_long), "long int": 8, "long long": 8, "int64_t": 8}
    index_bytes = widths.get(settings.get("SUNDIALS_INT_TYPE", ""))
    if index_bytes is None or settings.get("SUNDIALS_FLOAT_TYPE") != "double":
        raise UnsupportedError(
            "scikit-sundae does not say how its SUNDIALS libraries were built, or not with 64-bit floats",
            where=str(path) if path is not None else "",
        )
    return layout_for(index_bytes)


def layout_for(index_bytes: int) -> SundialsLayout:
    """Return the layout for a width of the index type, by the rules of C."""
    index: type[Any] = ctypes.c_int32 if index_bytes == 4 else ctypes.c_int64
    pointer, integer = ctypes.c_void_p, ctypes.c_int

    class Vector(ctypes.Structure):
        _fields_ = (("length", index), ("own_data", integer), ("data", pointer))

    class Dense(ctypes.Structure):
        _fields_ = (("M", index), ("N", index), ("data", pointer))

    class Sparse(ctypes.Structure):
        _fields_ = (
            *[(name, index) for name in ("M", "N", "NNZ", "NP")],
            ("data", pointer),
            ("sparsetype", integer),
            ("indexvals", pointer),
            ("indexptrs", pointer),
        )

    def at(structure: type[ctypes.Structure], name: str) -> int:
        return int(getattr(structure, name).offset)

    return SundialsLayout(
        index_bytes,
        at(Vector, "data"),
        at(Dense, "data"),
        at(Sparse, "data"),
        at(Sparse, "NNZ"),
        at(Sparse, "indexvals"),
        at(Sparse, "indexptrs"),
    )


def compile_ida_callbacks(
    residual: Program,
    jacobian: Program,
    rows: ArrayLike,
    columns: ArrayLike,
    size: int,
    sparse: bool = False,
    *,
    cache: bool = True,
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
    cache
        Whether to use the cache on disk.

    Raises
    ------
    UsageError
        If the programs have other inputs or outputs than these.
    """
    at_rows = np.asarray(rows, dtype=np.int64).ravel()
    at_columns = np.asarray(columns, dtype=np.int64).ravel()
    _check(residual, [1, size, size], size)
    _check(jacobian, [1, size, size, 1], len(at_rows))
    if at_columns.shape != at_rows.shape or not _inside(at_rows, size) or not _inside(at_columns, size):
        raise UsageError(f"the entries of the Jacobian are not all inside {size} x {size}", where=jacobian.name)
    layout = sundials_layout()
    order = np.lexsort((at_rows, at_columns))
    if sparse:
        positions = np.empty(len(order), dtype=np.int64)
        positions[order] = np.arange(len(order))
        more = _sparse_text(layout, at_rows[order], np.searchsorted(at_columns[order], np.arange(size + 1)))
    else:
        positions = at_rows + size * at_columns
        more = _dense_text(layout)
    parts = [Part("residual", residual), Part("jacobian", jacobian, tuple(positions.tolist()))]
    built = build_code(
        parts,
        default_options(parts),
        more=_residual_text(layout) + more,
        exports=("ida_residual", "ida_jacobian"),
        library=("memcpy",) if sparse else (),
        cached=cache,
    )
    return IdaCallbacks(residual, jacobian, size, len(order), sparse, built)


class IdaData(ctypes.Structure):
    """The user's data of the callbacks: where each thread has what its functions need.

    It must live as long as IDA may call; `IdaCallbacks.bind` returns it with its arrays attached.
    """

    _fields_ = (
        ("derived_residual", ctypes.c_void_p),
        ("derived_jacobian", ctypes.c_void_p),
        ("scratch", ctypes.c_void_p),
    )
    arrays: tuple[NDArray[np.float64], ...]


class IdaCallbacks:
    """A residual and a Jacobian as IDA calls them; both return 1 (recoverable) where a value is not finite.

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
        The code.

    Attributes
    ----------
    residual_address, jacobian_address
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
        data = IdaData(derived[0].ctypes.data, derived[1].ctypes.data, scratch.ctypes.data)
        data.arrays = (*derived, scratch)
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


def _array_of(name: str, structure: str, offset: int) -> str:
    """Write how to find an array of a structure: through its content, which is its first member."""
    return f"""  %{name}.content = load ptr, ptr %{structure}
  %{name}.place = getelementptr i8, ptr %{name}.content, i64 {offset}
  %{name} = load ptr, ptr %{name}.place
"""


def _call_text(kernel: str, inputs: Sequence[str], output: str, derived: int) -> str:
    """Write the call of a kernel with pointers to its arrays."""
    lines = [f"  %inputs = alloca [{len(inputs)} x ptr]", "  %outputs = alloca [1 x ptr]"]
    for k, name in enumerate(inputs):
        lines.append(f"  %input.{k} = getelementptr ptr, ptr %inputs, i64 {k}")
        lines.append(f"  store ptr %{name}, ptr %input.{k}")
    for k, name in ((derived, "derived"), (2, "scratch")):
        lines.append(f"  %{name}.place = getelementptr ptr, ptr %data, i64 {k}")
        lines.append(f"  %{name} = load ptr, ptr %{name}.place")
    lines.append(f"  store ptr %{output}, ptr %outputs")
    lines.append(f"  %code = call i32 @{kernel}(ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs)")
    return "\n".join([*lines, "  ret i32 %code", "}", ""])


_STATE = "  %t.place = alloca double\n  store double %t, ptr %t.place\n"
_RATE = "  %cj.place = alloca double\n  store double %cj, ptr %cj.place\n"
_JACOBIAN = (
    "define i32 @ida_jacobian(double %t, double %cj, ptr %yy, ptr %yyp, ptr %rr, ptr %matrix, ptr %data, "
    "ptr %v1, ptr %v2, ptr %v3) #0 {\n"
)


def _residual_text(layout: SundialsLayout) -> str:
    """Write the residual with IDA's signature."""
    vectors = "".join(
        _array_of(name, structure, layout.vector_data)
        for name, structure in (("y", "yy"), ("yp", "yyp"), ("residual.values", "rr"))
    )
    head = "define i32 @ida_residual(double %t, ptr %yy, ptr %yyp, ptr %rr, ptr %data) #0 {\n"
    return head + _STATE + vectors + _call_text("residual", ("t.place", "y", "yp"), "residual.values", 0)


def _jacobian_start(layout: SundialsLayout) -> str:
    vectors = "".join(
        _array_of(name, structure, layout.vector_data) for name, structure in (("y", "yy"), ("yp", "yyp"))
    )
    return _JACOBIAN + _STATE + _RATE + vectors


def _dense_text(layout: SundialsLayout) -> str:
    """Write the Jacobian with IDA's signature for a dense matrix, which lies column after column."""
    call = _call_text("jacobian", ("t.place", "y", "yp", "cj.place"), "entries", 1)
    return _jacobian_start(layout) + _array_of("entries", "matrix", layout.dense_data) + call


def _sparse_text(layout: SundialsLayout, rows: NDArray[np.int64], starts: NDArray[np.intp]) -> str:
    """Write the Jacobian with IDA's signature for a matrix in compressed columns, with its pattern."""
    integer = f"i{8 * layout.index_bytes}"
    parts = [_constants("pattern.rows", integer, rows), _constants("pattern.starts", integer, starts)]
    parts.append("declare ptr @memcpy(ptr, ptr, i64) #0")
    parts.append(_jacobian_start(layout))
    parts.append(_array_of("entries", "matrix", layout.sparse_data))
    parts.append(_array_of("values", "matrix", layout.sparse_values))
    parts.append(_array_of("starts", "matrix", layout.sparse_pointers))
    parts.append(f"""  %room.place = getelementptr i8, ptr %entries.content, i64 {layout.sparse_room}
  %room = load {integer}, ptr %room.place
  %small = icmp slt {integer} %room, {len(rows)}
  br i1 %small, label %refuse, label %accept
refuse:
  ret i32 -1
accept:
  %copied.rows = call ptr @memcpy(ptr %values, ptr @pattern.rows, i64 {len(rows) * layout.index_bytes})
  %copied.starts = call ptr @memcpy(ptr %starts, ptr @pattern.starts, i64 {len(starts) * layout.index_bytes})
""")
    parts.append(_call_text("jacobian", ("t.place", "y", "yp", "cj.place"), "entries", 1))
    return "\n".join(parts)


def _constants(name: str, integer: str, values: NDArray[Any]) -> str:
    listed = ", ".join(f"{integer} {value}" for value in values.tolist())
    return f"@{name} = internal constant [{len(values)} x {integer}] [{listed}]"
