"""Jumps at events that are made without Python: a state that passes one zero of its own, and goes on with other speeds.

What a jump is tells a program; see `atwood.forms.constrained.impact_program`. Whatever else happens at that moment, or
has happened before ever faster, is left to Python.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Kind
from atwood.expr.core.program import Program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.protocol import CompiledRates, Nearest

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("program", "derived", "scratch", "shift", "seen", "table", "parts"), ADDRESS),
    **dict.fromkeys(("moved", "room", "log", "rates", "rates_data"), ADDRESS),
    "left": NUMBER,
    **dict.fromkeys(("coordinates", "speeds", "gaps", "log_stride", "logged", "capacity"), INTEGER),
}
"""The memory of jumps; `left` is how long they may go on, s, if each is a share of the time before it."""

TABLE = ("row", "small", "slow")
"""Of each event: which row of the program it is, or -1; values and rates that are zero but for errors."""

ENTRY = ("time", "event", "part", "impulse", "before", "after")
"""What begins an entry of the log; states before and after follow."""

_PAST = 64
"""So many jumps before are known at most."""

ROOM = 1 << 17
"""Numbers of a log, which are a megabyte: it is Python's turn where they are full."""

_PLACES = {name: k for k, name in enumerate(FIELDS)}


class Jump(NamedTuple):
    """A jump at an event, by its number: impulse and rates, and the states before and after."""

    time: float
    event: int
    impulse: float
    before: float
    after: float
    states: FloatArray


class JumpLog:
    """What the log of jumps says: times, states before and after with shape (jumps, 2, size), and entries."""

    def __init__(self, entries: FloatArray, before: int, size: int) -> None:
        self.entries, self.time = entries, entries[:, 0]
        self.states = entries[:, before : before + 2 * size].reshape(-1, 2, size)

    def jumps(self) -> list[Jump]:
        """Return the jumps."""
        return [
            Jump(time, int(event), impulse, before, after, states)
            for (time, event, _, impulse, before, after), states in zip(
                self.entries[:, : len(ENTRY)].tolist(), self.states, strict=True
            )
        ]


@once
def _routines() -> Built:
    files = tuple(f"integrators/{name}.py" for name in ("event_location", "event_routines", "jumps", "sets/sizes"))
    source = RoutineSource("integrators.jump_routines", files)
    return build_code([], CodeOptions(level=2), exports=("jump",), routines=source)


class JumpCode:
    """Jumps as machine code, for any parameter values.

    Parameters
    ----------
    program
        A program of (t, q, u, pick).
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        _, self.coordinates, self.speeds, self.gaps = (len(group.symbols) for group in program.inputs)
        self.tiers, self.routines = Tiers([Part("kernel", program)]), _routines()


class Jumps:
    """The jumps of one session.

    Parameters
    ----------
    code
        What they are.
    events, rates
        The events at which they happen, and the rates in between.
    """

    def __init__(self, code: JumpCode, events: EventData, rates: CompiledRates) -> None:
        self.code, self._size, count = code, code.coordinates + code.speeds, events.count
        self._built = code.tiers.spend(0.0)
        self._stride = len(ENTRY) + 2 * self._size
        self._room = ROOM // self._stride
        room = self._size + 4 * code.gaps + 1  # what the program gives, and what it is asked
        counts = (
            len(FIELDS),
            len(code.program.prologue),
            self._built.scratch,
            len(TABLE) * count,
            *[code.gaps] * 2,
            room,
        )
        ends = np.cumsum((*counts, self._stride * (_PAST + self._room)))
        memory = np.zeros(int(ends[-1]))
        pieces = np.split(memory, ends[:-1])
        self._numbers, self._derived, _, table, self._parts, _, _, log = pieces
        self._integers, self._keep = self._numbers.view(np.int64), (memory, events, rates)
        self._table, self._log = table.reshape(len(TABLE), count), log.reshape(-1, self._stride)
        places = (one.ctypes.data for one in pieces[1:])
        names = ("derived", "scratch", "table", "parts", "moved", "room", "log")
        self._set(**dict(zip(names, places, strict=True)), gaps=code.gaps, log_stride=self._stride)
        self._set(coordinates=code.coordinates, speeds=code.speeds, program=self._built.code.addresses["kernel"])
        self._set(shift=events.arrays[1].ctypes.data, seen=events.memory.ctypes.data)
        self._set(rates=rates.function, rates_data=rates.data)
        self.function, self.data = code.routines.code.addresses["jump"], self._numbers.ctypes.data

    def _set(self, **fields: int) -> None:
        for name, value in fields.items():
            self._integers[_PLACES[name]] = value

    def spend(self, seconds: float) -> None:
        """Go on with faster code, which has the same bits, where that pays after steps that took so long."""
        if self.code.tiers.has_better and (built := self.code.tiers.spend(seconds)) is not self._built:
            self._built = built
            self._set(program=built.code.addresses["kernel"])

    def fill(
        self,
        parameter_values: ArrayLike,
        table: ArrayLike,
        parts: ArrayLike,
        left: float,
        past: Sequence[tuple[float, int]],
    ) -> None:
        """Begin again with other parameters, and with jumps that have been: their times and parts."""
        self._derived[:] = self._built.derive("kernel", self.code.program, parameter_values)[0]
        self._table[:], self._parts[:] = table, parts
        known = past[-_PAST:]
        self._log[: len(known), [0, 2]] = np.reshape(known, (-1, 2))
        self._numbers[_PLACES["left"]] = left
        self._told = len(known)
        self._set(logged=self._told, capacity=self._told + self._room)

    def while_open(self, call: Callable[[], Nearest | None]) -> Nearest | None:
        """Call a function of the steps as if all contacts were open; None where these have no programs for that."""
        return None

    def begin(self, t: float) -> None:
        """Learn when the steps begin, where that matters."""

    def change_at(self, times: FloatArray, relations: FloatArray, place: int) -> bool:
        """Learn when parameters change, and to what; return whether that can be on the way."""
        return False

    def rates(self, t: float, y: FloatArray) -> FloatArray | None:
        """Return the rates after the last jump, where these are others than before; else None."""
        return None

    @property
    def last(self) -> tuple[float, FloatArray]:
        """Time and state after the last jump; minus infinity where there has been none."""
        logged = int(self._integers[_PLACES["logged"]])
        entry = self._log[logged - 1]
        return (float(entry[0]) if logged > self._told else -inf), entry[-self._size :].copy()

    def take(self) -> JumpLog:
        """Return the jumps since this was last asked."""
        first, self._told = self._told, int(self._integers[_PLACES["logged"]])
        return JumpLog(self._log[first : self._told].copy(), len(ENTRY), self._size)
