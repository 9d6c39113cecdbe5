"""Whole runs by hand in C: an explicit method, SUNDIALS' IDA, and the solution that all are measured against."""

from __future__ import annotations

import ctypes
import subprocess
import time
from collections.abc import Callable
from ctypes import c_double, c_int, c_long, c_void_p
from pathlib import Path
from typing import Any

import by_hand
import numpy as np
from mechanisms import GRAVITY, FloatArray, Mechanism

from atwood.integrators.ida.library import library
from atwood.integrators.ida.setup import measured_tuning
from atwood.integrators.protocol import FIXED_SIZE

__all__ = ["PLAIN", "IdaRun", "Run", "Tuning", "explicit_run", "ggl_order", "reference", "tuned"]

Run = Callable[[], tuple[float, FloatArray]]
"""A whole run: seconds, and what is compared at the end."""

Tuning = tuple[float, float, float]
"""Newton coefficient, least growth of a step, change of the step that asks for a new Jacobian; 0: what IDA has."""

PLAIN: Tuning = (0.0, 0.0, 0.0)
"""IDA as it comes."""


def tuned(unknowns: int) -> Tuning:
    """Return what Atwood tells IDA about so many unknowns, some of which are algebraic."""
    return measured_tuning(unknowns, True, unknowns >= FIXED_SIZE)


def _defines(mechanism: Mechanism) -> dict[str, object]:
    file = {1: "pendulum", 2: "double_pendulum"}.get(mechanism.links, "chain")
    return {"MECHANISM": f'"{file}.c"'} | ({"LINKS": mechanism.links} if file == "chain" else {})


def _parameters(mechanism: Mechanism) -> FloatArray:
    """Return the parameters of the accelerations by hand."""
    n, l, m = mechanism.links, mechanism.length, mechanism.mass
    if n <= 2:
        return np.array([l, m] * n + [GRAVITY])
    return np.array([l] * n + [1.0 / l] * n + [1.0 / m] * n + [GRAVITY])


def explicit_run(mechanism: Mechanism, tolerance: float, flags: str) -> Run | None:
    """Return a run with the method of order 8(5,3), relative and absolute tolerance alike; None without a compiler."""
    code = by_hand.load("explicit", flags, _defines(mechanism))
    if code is None:
        return None
    integrate = code.integrate
    integrate.argtypes = [c_double, c_double, c_double, c_void_p, c_void_p, c_void_p]
    p, counts, n = _parameters(mechanism), np.zeros(3, dtype=c_long), mechanism.links
    start = np.concatenate([mechanism.angles_at_start(), np.zeros(n)])
    y = start.copy()
    arguments = (mechanism.t_end, tolerance, tolerance, p.ctypes.data, y.ctypes.data, counts.ctypes.data)

    def run() -> tuple[float, FloatArray]:
        y[:] = start
        began = time.perf_counter()
        failed = integrate(*arguments)
        spent = time.perf_counter() - began
        if failed:
            raise SystemExit(f"{mechanism.name}: the explicit method by hand failed at {tolerance:g}")
        return spent, mechanism.from_angles(y)

    run.keep = code, p, counts  # type: ignore[attr-defined]  # C has only their addresses
    return run


def reference(mechanism: Mechanism, tolerance: float = 1e-20) -> FloatArray | None:
    """Return the end by extrapolation in 128 bits (long double where C has none); None without a compiler."""
    code = None
    for number in ("_Float128", '"long double"'):
        try:
            code = by_hand.load("reference", "-O2", _defines(mechanism) | {"REAL": number.strip('"')})
        except subprocess.CalledProcessError:
            tolerance = 1e-15
            continue
        break
    if code is None:
        return None
    code.reference.argtypes = [c_double, c_double, c_void_p, c_int, c_void_p]
    code.reference.restype = c_long
    p = _parameters(mechanism)
    y = np.concatenate([mechanism.angles_at_start(), np.zeros(mechanism.links)])
    if code.reference(mechanism.t_end, tolerance, p.ctypes.data, len(p), y.ctypes.data) < 0:
        raise SystemExit(f"{mechanism.name}: no reference")
    return mechanism.from_angles(y)


def ggl_order(links: int, band: bool) -> FloatArray:
    """Return where each unknown of (p, v, lambda, mu) is in the order of the program by hand."""
    if not band:
        return np.arange(6 * links)
    pairs = 6 * np.repeat(np.arange(links), 2) + np.tile([0, 1], links)
    alone = 6 * np.arange(links)
    return np.concatenate([pairs, pairs + 2, alone + 4, alone + 5])


class IdaRun:
    """A whole run of the stabilised DAE by hand.

    Parameters
    ----------
    mechanism
        What moves.
    start
        Consistent y and y', in the order (p, v, lambda, mu).
    relative, absolute
        Tolerances; the absolute ones in the same order.
    flags
        How to compile.
    tuning
        What IDA is told.
    band
        Link after link with a band solver, and not with a dense one.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        start: tuple[FloatArray, FloatArray],
        relative: float,
        absolute: FloatArray,
        flags: str,
        tuning: Tuning = PLAIN,
        band: bool = False,
    ) -> None:
        n = mechanism.links
        self._mechanism, self._where = mechanism, ggl_order(n, band)
        found = _ida(n, flags, band)
        if found is None:
            raise RuntimeError("no C compiler")
        self._integrate = found.integrate
        self._integrate.argtypes = [c_double, c_double, *[c_void_p] * 6]
        self._start = self._placed(start[0]), self._placed(start[1])
        self._y, self._yp = (value.copy() for value in self._start)
        self._counts = np.zeros(4, dtype=c_long)
        p = np.array([mechanism.length] * n + [mechanism.mass] * n + [GRAVITY])
        allowed = self._placed(absolute)
        told = np.array(tuning)
        self._keep = found, p, allowed, told
        arrays = (allowed, told, p, self._y, self._yp, self._counts)
        self._arguments: tuple[Any, ...] = (mechanism.t_end, relative, *(array.ctypes.data for array in arrays))

    def _placed(self, values: FloatArray) -> FloatArray:
        made = np.empty(len(values))
        made[self._where] = values
        return made

    def __call__(self) -> tuple[float, FloatArray]:
        """Run; return seconds and what is compared at the end."""
        self._y[:], self._yp[:] = self._start
        began = time.perf_counter()
        flag = self._integrate(*self._arguments)
        spent = time.perf_counter() - began
        if flag not in (0, 1):  # 1: it has come to its stop time
            raise ArithmeticError(f"IDA stopped with flag {flag}")
        return spent, self._mechanism.from_positions(self._y[self._where])

    @property
    def steps(self) -> int:
        """The steps of the last run."""
        return int(self._counts[0])

    @property
    def seconds(self) -> float:
        """What the last run took without making and freeing IDA's memory."""
        return 1e-9 * int(self._counts[3])


def _ida(links: int, flags: str, band: bool) -> ctypes.CDLL | None:
    sundials = library()
    names = ["core", "ida", "nvecserial"] + [f"sun{kind}{'band' if band else 'dense'}" for kind in ("matrix", "linsol")]
    files: list[Path] = []
    for name in names:
        files += [path for path in sundials.folder.iterdir() if f"sundials_{name}-" in path.name]
    if len(files) != len(names):
        raise SystemExit(f"not all of SUNDIALS' libraries are in {sundials.folder}")
    index = "int32_t" if ctypes.sizeof(sundials.index_type) == 4 else "int64_t"
    defines: dict[str, object] = {"LINKS": links, "INDEX": index}
    return by_hand.load("ida", flags, defines | ({"BAND": None} if band else {}), files)
