"""Looking at a motion now and then while SUNDIALS IDA goes on, as machine code.

IDA is sent from look to look. At each the slopes of some conditions are worked out, and how much of each of those that
are kept is left by the ones before it: the pivots of ``G G^T``, of which one vanishes where rank is lost. Nobody is
asked anything as long as none of them has fallen to a small share of the most that it has been.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines.source import RoutineSource
from atwood.codegen.sundials.lookout_routines import AT, CAPACITY, CARRIED, FIELDS, LISTS, STATE, Shape
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

_LOOK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)


@dataclass(frozen=True)
class Pace:
    """When to look.

    Attributes
    ----------
    move
        Between two looks no speed, and no acceleration, moves anything by more of its size.
    whole, idle
        What takes longer than a time, s, rests, and is looked at after another.
    low
        The share of the most that it has been, below which what is left of a condition is low.
    worn
        The share of what it was when the choice of conditions was last looked at, below which that is asked for.
    """

    move: float
    whole: float
    idle: float
    low: float
    worn: float


class LookoutCode:
    """Functions that look at the motion of a mechanism, for any parameters and choice of conditions.

    Parameters
    ----------
    program
        See `compile_lookout`.
    shape, lists
        How many there are of each, and where the slopes are; see `slope_lists`.
    built
        The code.

    Attributes
    ----------
    drive
        Address of ``int (solve, steps, memory, double t_out, double *reached, y, yp, double *y_at, double *yp_at, long
        allowed, data)``: sends IDA on to a time from look to look, with the addresses of ``IDASolve`` and
        ``IDAGetNumSteps``. It returns `NOTICED`, or IDA's flag.
    fill
        See `~atwood.integrators.compiled_functions.Lookout`. It returns the same, or `PAUSED` or `UNREADABLE`.
    look_address
        Address of the function that takes one look; see the same.
    """

    def __init__(self, program: Program, shape: Shape, lists: dict[str, NDArray[np.int64]], built: Built) -> None:
        self.program, self.shape, self.built = program, shape, built
        self._lists = lists
        self.drive, self.fill = (built.code.addresses[name] for name in ("drive", "fill"))
        self.look_address = built.code.addresses["look"]
        self.look = _LOOK(self.look_address)

    def bind(self, parameter_values: ArrayLike, sizes: ArrayLike, kept: Sequence[int], pace: Pace) -> LookoutData:
        """Return the data of one run; they must live as long as it goes on."""
        shape, program = self.shape, self.program
        derived, scratch = self.built.derive("held", program, parameter_values)
        arrays: dict[str, NDArray[Any]] = {
            "derived": derived,
            "scratch": scratch,
            "sizes": np.array(sizes, dtype=float),
            "values": np.empty(shape.conditions),
            "slopes": np.empty(shape.slopes),
            "drifts": np.empty(shape.conditions),
            "rows": np.zeros(shape.conditions),
            "changes": np.empty(shape.conditions),
            "matrix": np.empty(shape.conditions**2),
            **{name: np.zeros(shape.conditions) for name in ("pivots", "first", "most", "least", "earlier", "known")},
            "kept": np.array([len(kept), *kept], dtype=np.int64),
            **self._lists,
            "notes": np.empty((CAPACITY, shape.note)),
            "best": np.zeros(1 + shape.coordinates),
            "state": np.zeros(len(STATE)),
        }
        numbers = {"move": pace.move, "whole": pace.whole, "idle": pace.idle, "low": pace.low**2}
        numbers["worn"] = pace.worn**2
        arrays["state"][[AT[name] for name in numbers]] = list(numbers.values())
        return LookoutData(self, arrays)


class LookoutData:
    """What was noted on the way of one run.

    Parameters
    ----------
    code
        The functions.
    arrays
        Their data.

    Attributes
    ----------
    rows
        The most that each condition has changed so far with a displacement of the size that counts; starts where it is
        set.
    """

    def __init__(self, code: LookoutCode, arrays: dict[str, NDArray[Any]]) -> None:
        self.code, self._arrays = code, arrays
        self.rows: NDArray[np.float64] = arrays["rows"]
        self._state = arrays["state"]
        pointers = [arrays[name].ctypes.data for name in FIELDS]
        self._pointers = (ctypes.c_void_p * len(pointers))(*pointers)
        self.address = ctypes.addressof(self._pointers)

    def restart(self) -> None:
        """Forget what was noted; not how much conditions have changed."""
        self._state[[AT["count"], AT["is_low"], AT["falls"], AT["later"]]] = 0.0
        self._arrays["least"][:] = self._arrays["earlier"][:] = np.inf

    def settle(self) -> None:
        """Take the last look as that at which the choice of conditions was looked at."""
        self._arrays["known"][:] = self._arrays["pivots"]

    def note(self, t: float, y: NDArray[np.float64], yp: NDArray[np.float64]) -> None:
        """Look at a state that the run starts from, or ends at, unless it has been."""
        count = int(self._state[AT["count"]])
        if count and t <= self._arrays["notes"][count - 1, 0]:
            return
        y, yp = np.ascontiguousarray(y), np.ascontiguousarray(yp)
        self.code.look(t, y.ctypes.data, yp.ctypes.data, self.address)

    def due(self) -> float:
        """Return when the next look is to be taken."""
        return float(self._state[AT["next"]])

    @property
    def due_at(self) -> int:
        """The address of that time."""
        return self._state.ctypes.data + 8 * AT["next"]

    @property
    def has_seen_low(self) -> bool:
        """Whether something was low among what was noted and not taken yet."""
        return bool(self._state[AT["is_low"]])

    @property
    def least_share(self) -> float:
        """The least that the last look left of a condition, as a share of the most that it has been."""
        pivots, most = self._arrays["pivots"], self._arrays["most"]
        with np.errstate(all="ignore"):
            return float(np.sqrt(np.nanmin(pivots / most, initial=1.0)))

    def take(self) -> list[tuple[float, NDArray[np.float64], NDArray[np.float64]]]:
        """Return what was noted, time, y and y' each; it is not asked about again."""
        notes, count, size = self._arrays["notes"], int(self._state[AT["count"]]), self.code.shape.size
        noted = notes[:count].copy()
        carried = noted[-CARRIED:]
        notes[: len(carried)] = carried
        is_still_low = self._state[AT["falls"]]  # so that it is asked again when what comes behind is known
        self._state[[AT["is_low"], AT["later"], AT["count"]]] = is_still_low, 0.0, len(carried)
        self._arrays["least"][:] = self._arrays["earlier"][:] = np.inf
        return [(float(one[0]), one[1 : 1 + size], one[1 + size :]) for one in noted]

    @property
    def best(self) -> tuple[float, NDArray[np.float64]]:
        """Time and coordinates of the look at which conditions were farthest from following from each other."""
        return float(self._arrays["best"][0]), self._arrays["best"][1:]


def compile_lookout(program: Program, speeds: int, size: int, places: tuple[ArrayLike, ArrayLike]) -> LookoutCode:
    """Compile what looks at a motion."""
    rows, columns = (np.asarray(one, dtype=np.int64).ravel().tolist() for one in places)
    inputs, outputs = [len(one.symbols) for one in program.inputs], [len(one.expressions) for one in program.outputs]
    if len(inputs) != 3 or inputs[2] != speeds or len(outputs) != 3 or outputs[1] != len(rows):
        raise UsageError(f"needs a program of (t, q, u), not of {inputs} with {outputs}", where=program.name)
    lists = slope_lists(outputs[0], list(zip(rows, columns, strict=True)))
    shape = Shape(inputs[1], speeds, size, outputs[0], len(rows), len(lists["product"]))
    part = Part("held", program)
    routines = RoutineSource("codegen.sundials.lookout_routines", (), (shape,))
    built = build_code([part], default_options([part]), exports=["look", "drive", "fill"], routines=routines)
    return LookoutCode(program, shape, lists, built)


def slope_lists(conditions: int, places: Sequence[tuple[int, int]]) -> dict[str, NDArray[np.int64]]:
    """Return row and column of each slope, which two are multiplied, and where in the lower half of ``G G^T``."""
    by_column: dict[int, list[tuple[int, int]]] = {}
    for entry, (row, column) in enumerate(places):
        by_column.setdefault(column, []).append((row, entry))
    products = [
        (e, f, i * conditions + j) for column in by_column.values() for i, e in column for j, f in column if i >= j
    ]
    # There may be none, where no constraint depends on a coordinate.
    entries = np.array(places, dtype=np.int64).reshape(-1, 2).T
    pairs = np.array(products, dtype=np.int64).reshape(-1, 3).T
    return dict(zip(LISTS[1:], map(np.ascontiguousarray, (*entries, *pairs)), strict=True))
