"""What judges a step by a program, as machine code that the methods call after each step that they would keep.

Steps judged by samples, where what could be passed over is a function in Python of which nothing else is known.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_double, c_int, c_void_p

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, NUMBER, Routine, call_kernel, place_of
from atwood.expr.core.program import Program
from atwood.integrators.protocol import StepGuard

_GUARD = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_double, c_void_p, c_void_p, c_void_p)


class GuardCode:
    """A program that judges steps, for any parameter values.

    Parameters
    ----------
    program
        See `compile_guard`.
    tiers
        The code.
    """

    def __init__(self, program: Program, tiers: Tiers) -> None:
        self._program, self._tiers = program, tiers

    def bind(self, parameter_values: ArrayLike, reach: float, shortest: float) -> StepGuard:
        """Return the guard of one session."""
        built = self._tiers.spend(0.0)
        address = built.code.addresses["guard"]
        derived, scratch = built.derive("kernel", self._program, parameter_values)
        data = np.zeros(4)
        data[:2].view(np.uint64)[:] = derived.ctypes.data, scratch.ctypes.data
        data[2:] = reach, shortest
        call, place = _GUARD(address), data.ctypes.data
        keep = built, derived, scratch, data

        def passes(
            t0: float, y0: FloatArray, p0: FloatArray, t1: float, y1: FloatArray, p1: FloatArray, _: object = keep
        ) -> bool:
            rows = [np.ascontiguousarray(one, dtype=np.float64) for one in (y0, p0, y1, p1)]
            a, b, c, d = (one.ctypes.data for one in rows)
            return bool(call(t0, a, b, t1, c, d, place) == 0)

        return StepGuard(address, place, passes, keep)


def compile_guard(program: Program) -> GuardCode:
    """Compile a program that judges steps."""
    routines = RoutineSource("integrators.step_guard")
    return GuardCode(program, Tiers([Part("kernel", program)], ["guard"], routines))


def write_routines(kernel: str = "kernel") -> list[Routine]:
    """Write what judges a step that is long enough, by a program of a name: 0 where it is good, else 1."""
    arguments = {"t0": NUMBER, "y0": ADDRESS, "p0": ADDRESS, "t1": NUMBER, "y1": ADDRESS, "p1": ADDRESS}
    r = Routine("guard", arguments | {"data": ADDRESS}, exported=True)
    t0, y0, p0, t1, y1, p1, data = r.arguments
    r.give_if(t1 - t0 <= data[3], 0)
    inputs, share = [place_of(r, t0), y0, p0, place_of(r, t1), y1, p1, data.at(2)], r.array(1)
    call_kernel(r, kernel, inputs, data.read(0, ADDRESS), data.read(1, ADDRESS), [share])
    r.give((~(share[0] <= 1.0)).code())
    return [r]


SAMPLES = 16
"""Into so many parts a step is divided where functions of the motion are looked at."""

GRID = 20_000
"""Into so many parts a run is divided where functions of time alone are looked at."""

_LONGEST = 4.0
"""A step may be so many times as long as the root of what a function changes by in all over its second derivative."""

_SHORTEST = 1e-9
"""Relative to the run: shorter steps are not judged, so that a function may jump."""


class SampledSteps:
    """Judges steps by samples of functions, and by another guard if there is one.

    Parameters
    ----------
    timed
        ``timed(t)``: the functions of time alone.
    moving
        ``moving(t, y)``: the functions of the motion.
    span
        The times of the run, s.
    other
        What else judges steps.
    """

    def __init__(
        self,
        timed: Callable[[float], FloatArray],
        moving: Callable[[float, FloatArray], FloatArray],
        span: tuple[float, float],
        other: StepGuard | None = None,
    ) -> None:
        self._moving, self._other = moving, other
        self._least = self._most = np.zeros(0)
        self._shortest = _SHORTEST * (span[1] - span[0])
        times = np.linspace(*span, GRID + 1)
        first = timed(span[0])
        rows = np.array([timed(t) for t in times.tolist()]) if len(first) else np.zeros((len(times), 0))
        self._times, self._allowed = times, np.full(GRID + 1, np.inf)
        if rows.size:
            longest = np.min(_allowed(rows, np.ptp(rows, axis=0)), axis=1) * (times[1] - times[0])
            self._allowed[1:-1] = longest

    def guard(self) -> StepGuard:
        """Return what a method is given; it has no compiled function."""
        return StepGuard(0, 0, self.passes, self)

    def passes(self, t0: float, y0: FloatArray, p0: FloatArray, t1: float, y1: FloatArray, p1: FloatArray) -> bool:
        """Return whether a step is good: from time, values and rates at its beginning to those at its end."""
        h = t1 - t0
        if h <= self._shortest:
            return True
        if self._other is not None and not self._other.passes(t0, y0, p0, t1, y1, p1):
            return False
        first, last = np.searchsorted(self._times, (t0, t1))
        if h > np.min(self._allowed[max(0, first - 1) : last + 1], initial=np.inf):
            return False
        shares = np.linspace(0.0, 1.0, SAMPLES + 1)[:, None]
        rest = 1.0 - shares
        values = rest**2 * (1 + 2 * shares) * y0 + shares**2 * (3 - 2 * shares) * y1
        values = values + h * shares * rest * (rest * p0 - shares * p1)
        rows = np.array([self._moving(t0 + h * s, y) for s, y in zip(shares[:, 0].tolist(), values, strict=True)])
        if not rows.size:
            return True
        if not self._least.size:
            self._least, self._most = rows.min(axis=0), rows.max(axis=0)
        self._least, self._most = np.minimum(self._least, rows.min(axis=0)), np.maximum(self._most, rows.max(axis=0))
        return bool(np.all(_allowed(rows, self._most - self._least) >= SAMPLES))


def _allowed(rows: FloatArray, change: FloatArray) -> FloatArray:
    """Return how long a step may be about each inner sample, in distances of samples."""
    bend = np.abs(np.diff(rows, 2, axis=0))
    rounding = 1e-12 * np.max(np.abs(rows), axis=0)
    with np.errstate(all="ignore"):
        found = _LONGEST * np.sqrt(change / np.where(bend > rounding, bend, 0.0))
    return np.where(np.isfinite(found), found, np.inf)
