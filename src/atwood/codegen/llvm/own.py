"""Elementary functions and elimination as machine code, of which a process has one copy that all kernels call."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, build_now, once
from atwood.codegen.llvm.engine import LoadedCode
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.llvm.text import ELIMINATION, OWN_FUNCTIONS
from atwood.codegen.routines import own_name
from atwood.expr.core.elementary import FUNCTIONS, compiled


@once
def own_functions() -> LoadedCode:
    """Return the functions by their names as operations, for numbers and for arrays."""
    names = (*FUNCTIONS, "sin_cos")
    exports = [own_name(one) for one in (*names, *(f"{each}_each" for each in FUNCTIONS))]
    source = RoutineSource("codegen.functions", ("expr/core/elementary.py",), (names,))
    code = build_now((), CodeOptions(level=2), exports, source, True).code
    for name in FUNCTIONS:
        kinds = [ctypes.c_double] * OWN_FUNCTIONS[name]
        compiled[name] = ctypes.PYFUNCTYPE(ctypes.c_double, *kinds)(code.addresses[own_name(name)])
    return code


@once
def _functions_of_lanes(lanes: int) -> LoadedCode:
    """Return the functions of so many numbers at once, by their names as operations with that count."""
    names = (*FUNCTIONS, "sin_cos")
    source = RoutineSource("codegen.functions", ("expr/core/elementary.py",), (names, lanes))
    return build_now((), CodeOptions(level=2), [own_name(f"{one}_{lanes}") for one in names], source, True).code


@once
def _elimination() -> LoadedCode:
    source = RoutineSource("codegen.llvm.linear_systems")
    return build_now((), CodeOptions(level=2), [own_name(one) for one in ELIMINATION], source, True).code


def address_of(name: str) -> int:
    """Return where a function is; those of lanes end with their count."""
    if name in ELIMINATION:
        return _elimination().addresses[own_name(name)]
    lanes = name.rpartition("_")[2]
    code = _functions_of_lanes(int(lanes)) if lanes.isdigit() else own_functions()
    return code.addresses[own_name(name)]


@cache
def _each(name: str) -> Any:
    kinds = [ctypes.c_void_p] * (OWN_FUNCTIONS[name] + 1)
    address = own_functions().addresses[own_name(f"{name}_each")]
    return ctypes.PYFUNCTYPE(None, *kinds, ctypes.c_int64)(address)


def on_arrays(name: str, *given: Any) -> FloatArray:
    """Return the values of a function at the entries of arrays, which are spread over each other's shape."""
    spread = np.broadcast_arrays(*given) if len(given) > 1 else given
    arrays = [np.asarray(one, dtype=np.float64, order="C") for one in spread]
    found = np.empty(arrays[0].shape)
    _each(name)(*(one.__array_interface__["data"][0] for one in (*arrays, found)), found.size)
    return found
