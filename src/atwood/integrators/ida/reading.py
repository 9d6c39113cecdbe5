"""Reading IDA's last step without Python: what a search for events by routines asks for states."""

from __future__ import annotations

import ctypes
from math import nan

import numpy as np

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Record, Routine
from atwood.integrators.protocol import State

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("read", "memory", "y", "yp", "y_at", "yp_at", "known", "known_rates"), ADDRESS),
    "newest": NUMBER,
    "size": INTEGER,
}
"""The memory: ``IDAGetDky``, what it is given, where it puts states, and the state that is known, at `newest`."""

_KNOWN = len(FIELDS)


def write_routines() -> list[Routine]:
    """Return the routine: values and rates at a time within the last step; 3 where there are none."""
    given = {"session": ADDRESS, "time": NUMBER, "y_out": ADDRESS, "yp_out": ADDRESS}
    r = Routine("interpolate", given, CODE, exported=True)
    session, time, *out = r.arguments
    m = Record(session, FIELDS)
    with r.when(time == m.newest):
        for target, source in zip(out, (m.known, m.known_rates), strict=True):
            r.copy(target, source, m.size)
        r.give(0)
    read, memory, size = m.read, m.memory, m.size
    for order, (target, vector, place) in enumerate(zip(out, (m.y, m.yp), (m.y_at, m.yp_at), strict=True)):
        r.give_if(r.call(read, memory, time, r.value(order, CODE), vector) != 0, 3)
        r.copy(target, place, size)
    r.give(0)
    return [r]


@once
def _routines() -> Built:
    source = RoutineSource("integrators.ida.reading")
    return build_code([], CodeOptions(level=2), exports=("interpolate",), routines=source)


class StepReader:
    """What reads the last step of one session.

    Parameters
    ----------
    size
        The number of unknowns.
    addresses
        Those of ``IDAGetDky``, of IDA's memory, its two vectors, and of their numbers.
    keep
        What must live as long.

    Attributes
    ----------
    interpolation
        The addresses of the function that reads, and of its memory.
    """

    def __init__(self, size: int, addresses: tuple[int, ...], keep: object) -> None:
        self._memory = memory = np.zeros(_KNOWN + 2 * size)
        self._state, self._keep = memory[_KNOWN:].reshape(2, size), keep
        begin = memory.ctypes.data + 8 * _KNOWN
        whole = memory.view(np.int64)
        whole[: len(addresses) + 2] = *addresses, begin, begin + 8 * size
        whole[list(FIELDS).index("size")] = size
        self.hold(None)
        self.interpolation = _routines().code.addresses["interpolate"], memory.ctypes.data

    def hold(self, state: State | None) -> None:
        """Give back a state at its time as it is; none where there is none."""
        self._memory[list(FIELDS).index("newest")] = nan if state is None else state[0]
        if state is not None:
            self._state[:] = state[1:]


def address_in(library: object, name: str) -> int:
    """Return the address of a function of a library."""
    return ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0
