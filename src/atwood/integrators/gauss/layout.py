"""Memory of a session of fixed steps: what routines and Python agree on."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate

from atwood.codegen.routines.kinds import ADDRESS, INTEGER, NUMBER, Kind
from atwood.codegen.routines.language import Record, Routine, Value
from atwood.lazy_dataclasses import dataclass

POINTERS = ("derived", "scratch", "rates", "rates_data", "derived_2", "guard", "guard_data")
NUMBERS = ("t", "t_old", "stop", "step", "origin")
COUNTS = ("limit", "steps", "failures", "evaluations", "undefined", "filled", "since")


@dataclass(frozen=True)
class Layout:
    """Where a session keeps its numbers, in one array of doubles.

    Attributes
    ----------
    coordinates, speeds, stages
        Their numbers.
    has_speeds
        Whether the equations give speeds besides the rates of the coordinates.
    takes_speeds
        Whether they take an approximation to them.
    """

    coordinates: int
    speeds: int
    stages: int
    has_speeds: bool
    takes_speeds: bool

    @property
    def size(self) -> int:
        """The number of coordinates and momenta."""
        return 2 * self.coordinates

    @property
    def width(self) -> int:
        """The number of coordinates and speeds."""
        return self.coordinates + self.speeds

    @property
    def places(self) -> dict[str, int]:
        """Where each group begins; ``end`` is the length of the whole."""
        n, m, s = self.size, max(self.speeds, 1), self.stages
        sizes = {"pointers": len(POINTERS), "numbers": len(NUMBERS), "counts": len(COUNTS)}
        sizes |= {"y": n, "y_old": n, "rest": n, "per_size": n}
        sizes |= {"ends": 4 * self.width, "around": 2 * self.width}
        work = {"L": s * n, "G": s * n, "Y": n, "F": n, "V": m, "U": s * m, "scale": n}
        for name in ("main", "aside"):
            sizes |= {f"{name}.{key}": size for key, size in work.items()}
        starts = [0, *accumulate(sizes.values())]
        return dict(zip((*sizes, "end"), starts, strict=True))

    def within(self, key: str) -> int:
        """Return where a group of a work area begins in it."""
        places = self.places
        return places[f"main.{key}"] - places["main.L"]


class Memory:
    """The memory of a session within a routine."""

    def __init__(self, mem: Value, layout: Layout) -> None:
        self.session, self._places = mem, layout.places
        self.pointers = Record(mem.at(self._places["pointers"]), dict.fromkeys(POINTERS, ADDRESS))
        self.numbers = Record(mem.at(self._places["numbers"]), dict.fromkeys(NUMBERS, NUMBER))
        self.counts = Record(mem.at(self._places["counts"]), dict.fromkeys(COUNTS, INTEGER))

    def at(self, group: str) -> Value:
        """Return where a group of numbers begins."""
        return self.session.at(self._places[group])


def open_routine(
    layout: Layout,
    name: str,
    more: Mapping[str, Kind] | None = None,
    exported: bool = False,
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    routine = Routine(name, {"mem": ADDRESS, **(more or {})}, exported=exported)
    return routine, Memory(routine.arguments[0], layout), routine.arguments[1:]
