"""Memory of a session of an embedded pair: what routines and Python agree on."""

from __future__ import annotations

from collections.abc import Mapping

from atwood.codegen.routines.kinds import ADDRESS, CODE, INTEGER, NUMBER, Kind, Lanes
from atwood.codegen.routines.language import Record, Routine, Value
from atwood.integrators.embedded.tableau import Tableau

LANES = 4
"""How many unknowns a loop works on at a time; rows are padded to a multiple of it with finite numbers."""

NUMBERS = ("t", "t_old", "h", "next", "stop", "relative", "longest", "horizon", "first", "looked", "likeness", "tried")
COUNTS = (
    "size",
    "padded",
    "limit",
    "steps",
    "failures",
    "evaluations",
    "undefined",
    "stiff",
    "is_dense",
    "filled",
    "edgy",
    "calm",
    "event_count",
    "heeds",
    "seen",
    "looks",
)
POINTERS = (
    "function",
    "data",
    "numbers",
    "counts",
    "arrays",
    "events",
    "events_data",
    "values",
    "signs",
    "project",
    "project_data",
    "watch",
    "watch_data",
    "due",
    "guard",
    "guard_data",
)


class Memory:
    """The memory of a session within a routine."""

    def __init__(self, session: Value, pair: Tableau) -> None:
        self.session, self.pair = session, pair
        self.at = Record(session, dict.fromkeys(POINTERS, ADDRESS))
        self.numbers = Record(self.at.numbers, dict.fromkeys(NUMBERS, NUMBER))
        self.counts = Record(self.at.counts, dict.fromkeys(COUNTS, INTEGER))
        self.arrays = self.at.arrays
        self.size, self.padded = self.counts.size, self.counts.padded

    def row(self, row: int | str) -> Value:
        """Return the address of a row of the table of arrays."""
        return self.arrays.at(self.padded * (self.pair.rows[row] if isinstance(row, str) else row))

    def lanes(self, row: Value, j: Value) -> Value:
        """Return the lanes of a row from an unknown on."""
        return row.read(j, Lanes(LANES))


def open_routine(
    pair: Tableau, name: str, more: Mapping[str, Kind] | None = None, result: Kind = CODE, exported: bool = False
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    routine = Routine(name, {"session": ADDRESS, **(more or {})}, result, exported)
    return routine, Memory(routine.arguments[0], pair), routine.arguments[1:]
