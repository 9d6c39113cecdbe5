"""The functions with IDA's signatures in LLVM's language, around the kernels of a residual and a Jacobian.

SUNDIALS hands over vectors and matrices as structures of its own.  Where their arrays lie in them follows from the
rules of C and from the width of SUNDIALS' index type, which scikit-sundae states about the libraries that it ships.
"""

from __future__ import annotations

import ctypes
import importlib.util
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.errors import UnsupportedError
from atwood.late import dataclass

__all__ = [
    "SundialsLayout",
    "array_of",
    "columns_text",
    "dense_text",
    "layout_for",
    "residual_text",
    "sparse_text",
    "sundials_layout",
    "weights_text",
]


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


def array_of(name: str, structure: str, offset: int) -> str:
    """Write how to find an array of a structure: through its content, which is its first member."""
    return f"""  %{name}.content = load ptr, ptr %{structure}
  %{name}.place = getelementptr i8, ptr %{name}.content, i64 {offset}
  %{name} = load ptr, ptr %{name}.place
"""


def columns_text(layout: SundialsLayout, size: int) -> str:
    """Write the Jacobian with IDA's signature for a dense matrix, by products with one unit vector after the other."""
    names = ("t.place", "y", "yp", "cj.place", "direction")
    lines = [f"  %inputs = alloca [{len(names)} x ptr]", "  %outputs = alloca [1 x ptr]"]
    lines.append(f"  %direction = alloca [{size} x double]")
    for k, name in enumerate(names):
        lines.append(f"  %input.{k} = getelementptr ptr, ptr %inputs, i64 {k}")
        lines.append(f"  store ptr %{name}, ptr %input.{k}")
    for k, name in ((1, "derived"), (2, "scratch")):
        lines.append(f"  %{name}.place = getelementptr ptr, ptr %data, i64 {k}")
        lines.append(f"  %{name} = load ptr, ptr %{name}.place")
    loop = f"""  br label %clear
clear:
  %k = phi i64 [ 0, %start ], [ %k.next, %clear ]
  %zero.place = getelementptr double, ptr %direction, i64 %k
  store double 0.0, ptr %zero.place
  %k.next = add i64 %k, 1
  %more.zeros = icmp slt i64 %k.next, {size}
  br i1 %more.zeros, label %clear, label %next
next:
  %j = phi i64 [ 0, %clear ], [ %j.next, %next ]
  %bad = phi i32 [ 0, %clear ], [ %bad.next, %next ]
  %one.place = getelementptr double, ptr %direction, i64 %j
  store double 1.0, ptr %one.place
  %column.at = mul i64 %j, {size}
  %column = getelementptr double, ptr %entries, i64 %column.at
  store ptr %column, ptr %outputs
  %code = call i32 @jacobian(ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs)
  store double 0.0, ptr %one.place
  %bad.next = or i32 %bad, %code
  %j.next = add i64 %j, 1
  %more = icmp slt i64 %j.next, {size}
  br i1 %more, label %next, label %end
end:
  ret i32 %bad.next
}}
"""
    start = _jacobian_start(layout).replace("{\n", "{\nstart:\n", 1)
    return start + array_of("entries", "matrix", layout.dense_data) + "\n".join(lines) + "\n" + loop


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


def residual_text(layout: SundialsLayout) -> str:
    """Write the residual with IDA's signature."""
    vectors = "".join(
        array_of(name, structure, layout.vector_data)
        for name, structure in (("y", "yy"), ("yp", "yyp"), ("residual.values", "rr"))
    )
    head = "define i32 @ida_residual(double %t, ptr %yy, ptr %yyp, ptr %rr, ptr %data) #0 {\n"
    return head + _STATE + vectors + _call_text("residual", ("t.place", "y", "yp"), "residual.values", 0)


def _jacobian_start(layout: SundialsLayout) -> str:
    vectors = "".join(array_of(name, structure, layout.vector_data) for name, structure in (("y", "yy"), ("yp", "yyp")))
    return _JACOBIAN + _STATE + _RATE + vectors


def dense_text(layout: SundialsLayout) -> str:
    """Write the Jacobian with IDA's signature for a dense matrix, which lies column after column."""
    call = _call_text("jacobian", ("t.place", "y", "yp", "cj.place"), "entries", 1)
    return _jacobian_start(layout) + array_of("entries", "matrix", layout.dense_data) + call


def sparse_text(layout: SundialsLayout, rows: NDArray[np.int64], starts: NDArray[np.intp]) -> str:
    """Write the Jacobian with IDA's signature for a matrix in compressed columns, with its pattern."""
    integer = f"i{8 * layout.index_bytes}"
    parts = [_constants("pattern.rows", integer, rows), _constants("pattern.starts", integer, starts)]
    parts.append("declare ptr @memcpy(ptr, ptr, i64) #0")
    parts.append(_jacobian_start(layout))
    parts.append(array_of("entries", "matrix", layout.sparse_data))
    parts.append(array_of("values", "matrix", layout.sparse_values))
    parts.append(array_of("starts", "matrix", layout.sparse_pointers))
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


def weights_text(layout: SundialsLayout, size: int) -> str:
    """Write the error weights with IDA's signature: 1 / (relative |y| + absolute), which must all be positive."""
    arrays = array_of("y", "yy", layout.vector_data) + array_of("w", "weights", layout.vector_data)
    return f"""define i32 @ida_weights(ptr %yy, ptr %weights, ptr %data) #0 {{
entry:
{arrays}  %relative.place = getelementptr ptr, ptr %data, i64 3
  %relative = load ptr, ptr %relative.place
  %absolute.place = getelementptr ptr, ptr %data, i64 4
  %absolute = load ptr, ptr %absolute.place
  br label %next
next:
  %k = phi i64 [ 0, %entry ], [ %k.next, %next ]
  %good = phi i1 [ true, %entry ], [ %good.next, %next ]
  %y.k = getelementptr double, ptr %y, i64 %k
  %w.k = getelementptr double, ptr %w, i64 %k
  %r.k = getelementptr double, ptr %relative, i64 %k
  %a.k = getelementptr double, ptr %absolute, i64 %k
  %value = load double, ptr %y.k
  %r = load double, ptr %r.k
  %a = load double, ptr %a.k
  %size = call double @llvm.fabs.f64(double %value)
  %share = fmul double %r, %size
  %error = fadd double %share, %a
  %positive = fcmp ogt double %error, 0.0
  %good.next = and i1 %good, %positive
  %weight = fdiv double 1.0, %error
  store double %weight, ptr %w.k
  %k.next = add i64 %k, 1
  %more = icmp slt i64 %k.next, {size}
  br i1 %more, label %next, label %end
end:
  %code = select i1 %good.next, i32 0, i32 -1
  ret i32 %code
}}
"""
