"""Where SUNDIALS keeps numbers.

It hands over vectors and matrices as structures of its own.  Where their arrays lie in them follows from the
rules of C and from the width of SUNDIALS' index type, which scikit-sundae states about the libraries that it ships.
"""

from __future__ import annotations

import ctypes
import importlib.util
import re
from functools import cache
from pathlib import Path
from typing import Any

from atwood.errors import UnsupportedError
from atwood.lazy_dataclasses import dataclass


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


INDEX_BYTES = {
    **dict.fromkeys(("int", "int32_t"), 4),
    **dict.fromkeys(("long int", "long long", "long long int", "int64_t"), 8),
    "long": ctypes.sizeof(ctypes.c_long),
}
"""How wide the types are that indices may have."""


def build_settings(package: Path) -> dict[str, str]:
    """Return how SUNDIALS was built, as scikit-sundae recorded it; nothing where it did not."""
    try:
        text = (package / "py_config.pxi").read_text(encoding="utf-8")
    except OSError:
        return {}
    return dict(re.findall(r"^(\w+)\s*=\s*[\"'](.*)[\"']", text, re.MULTILINE))


@cache
def sundials_layout() -> SundialsLayout:
    """Return the layout of the structures in the libraries that scikit-sundae ships."""
    found = importlib.util.find_spec("sksundae")
    package = Path(found.origin).parent if found is not None and found.origin else None
    settings = {} if package is None else build_settings(package)
    index_bytes = INDEX_BYTES.get(settings.get("SUNDIALS_INT_TYPE", ""))
    if index_bytes is None or settings.get("SUNDIALS_FLOAT_TYPE") != "double":
        raise UnsupportedError(
            "scikit-sundae does not say how its SUNDIALS libraries were built, or not with 64-bit floats",
            where=str(package or ""),
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
