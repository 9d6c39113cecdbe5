"""Elementary functions as machine code, of which a process has one copy that all kernels call."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, build_now, once
from atwood.codegen.llvm.engine import LoadedCode
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import own_name
from atwood.expr.core.elementary import FUNCTIONS


@once
def own_functions() -> LoadedCode:
    """Return the functions by their names as operations, for numbers and for arrays."""
    names = (*FUNCTIONS, "sin_cos")
    exports = [own_name(one) for one in (*names, *(f"{each}_each" for each in FUNCTIONS))]
    source = RoutineSource("codegen.functions", ("expr/core/elementary.py",), (names,))
    return build_now((), CodeOptions(level=2), exports, source, True).code


@cache
def _each(name: str, count: int) -> Any:
    kinds = [ctypes.c_void_p] * (count + 1)
    return ctypes.CFUNCTYPE(None, *kinds, ctypes.c_int64)(own_functions().addresses[own_name(f"{name}_each")])


def on_arrays(name: str, *given: Any) -> FloatArray:
    """Return the values of a function at the entries of arrays, which are spread over each other's shape."""
    spread = np.broadcast_arrays(*given) if len(given) > 1 else given
    arrays = [np.ascontiguousarray(one, dtype=np.float64) for one in spread]
    found = np.empty(np.shape(spread[0]))
    _each(name, len(given))(*(one.ctypes.data for one in (*arrays, found)), found.size)
    return found
