"""The equations written by hand in C, compiled when they are needed."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from ctypes import c_double, c_int, c_long, c_void_p
from functools import cache
from pathlib import Path

import numpy as np

from atwood.arrays import FloatArray

__all__ = ["KERNEL", "Loop", "compiler", "load"]

HERE = Path(__file__).resolve().parent / "hand"

KERNEL = ctypes.CFUNCTYPE(c_int, *[c_void_p] * 4)
"""The signature of every kernel: inputs, parameters, scratch, outputs."""


@cache
def compiler() -> str | None:
    """Return the C compiler, or None."""
    return next((found for name in ("gcc", "clang", "cc") if (found := shutil.which(name))), None)


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="atwood-benchmarks-")


def load(
    name: str, flags: str, defines: Mapping[str, object] | None = None, libraries: Sequence[Path] = ()
) -> ctypes.CDLL | None:
    """Compile a file and load it; None without a compiler.

    Parameters
    ----------
    name
        The file without its ending.
    flags
        How to compile.
    defines
        Macros; None defines one without a value.
    libraries
        Shared libraries that it calls.
    """
    found = compiler()
    if found is None:
        return None
    made = [f"-D{key}" if value is None else f"-D{key}={value}" for key, value in (defines or {}).items()]
    text = re.sub(r"[^A-Za-z0-9]+", "_", "".join([name, *made, flags]))
    target = Path(_folder().name) / f"{text}.so"
    if not target.exists():
        command = [found, *flags.split(), "-std=gnu11", "-Wall", "-Wextra", "-shared", "-fPIC", *made]
        command += [str(HERE / f"{name}.c"), "-o", str(target), *map(str, libraries)]
        command += [f"-Wl,-rpath,{folder}" for folder in sorted({str(path.parent) for path in libraries})]
        subprocess.run([*command, "-lm"], check=True)
    return ctypes.CDLL(str(target))


class Loop:
    """Times a kernel over several states, from C, and hands out its values.

    Parameters
    ----------
    flags
        How to compile.
    states
        For each state one array for each input group.
    outputs
        The number of results.
    """

    def __init__(self, flags: str, states: Sequence[Sequence[FloatArray]], outputs: int) -> None:
        library = load("loop", flags)
        if library is None:
            raise RuntimeError("no C compiler")
        self._call = library.time_calls
        self._call.restype = c_double
        self._call.argtypes = [c_void_p, c_void_p, c_long, c_long, c_void_p, c_void_p, c_void_p, c_long]
        self.empty = ctypes.cast(library.nothing, c_void_p).value or 0
        self._states = [[np.ascontiguousarray(group, dtype=float) for group in state] for state in states]
        flat = [group.ctypes.data for state in self._states for group in state]
        self._pointers = (c_void_p * len(flat))(*flat)
        self.values = np.zeros(outputs)
        self._outputs = (c_void_p * 1)(self.values.ctypes.data)

    def seconds(self, address: int, parameters: FloatArray, scratch: int = 0, calls: int = 1) -> float:
        """Return the seconds of one call, the average of many."""
        room = np.empty(max(scratch, 1))
        count, groups = len(self._states), len(self._states[0])
        spent = self._call(
            address,
            ctypes.addressof(self._pointers),
            count,
            groups,
            parameters.ctypes.data,
            room.ctypes.data,
            ctypes.addressof(self._outputs),
            calls,
        )
        return float(spent) / calls

    def at_first(self, address: int, parameters: FloatArray, scratch: int = 0) -> FloatArray:
        """Return the values at the first state."""
        self.values[:] = np.nan
        self.seconds(address, parameters, scratch)
        return self.values.copy()
