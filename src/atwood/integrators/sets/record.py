"""The memory of a set of contacts that its routines share, and how they go through it.

A program gives rates, accelerations, responses and limits; states, forces and speeds are written into this memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Operand, Record, Routine, Value
from atwood.integrators.sets.sizes import SEEN
from atwood.numerics.contact_sets import OPEN, SLACK

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("program", "derived", "scratch", "y", "out", "units", "rows", "matrix", "left"), ADDRESS),
    **dict.fromkeys(("shares", "pattern", "past", "log"), ADDRESS),
    **dict.fromkeys(("finite", "blur", "pace", "tolerance", "inside", "ahead", "rough", "later"), NUMBER),
    **dict.fromkeys(("better_x", "better_y", "lasted", "slack"), NUMBER),
    **dict.fromkeys(("count", "size", "entries", "coordinates", "speeds", "number", "better"), INTEGER),
    **dict.fromkeys(("logged", "known", "stops", "told", "repeats", "shared", "tried", "in_turn"), INTEGER),
}
"""The memory of sets; the files of the routines say what of it is theirs.

`finite` is 0 where limits are of impulses, which finite forces do not have; `blur` and `pace` are multiples of what is
small and slow; `inside` is how deep a gap may be, in multiples of what is small. `ahead` is how long impacts may still
go on that are summed, and then how long they do, `rough` how long where rounding tells the length of their intervals,
`later` how long where these are uneven, `lasted` how long these have gone on; `stops` is 1 where these come to an end
and may still wait for one more, 2 where they come to an end, `told` which gap is said to rest then. `shared` is 1 where
forces of a set that was found are not determined, as rows repeat each other, or where another share might let rest what
begins to slip, and `repeats` where those solved for last are not. `tried` is 0, or which share that holds everything is
taken whatever its forces are here: joints have a part in those that are reported. `in_turn` is 1 where impacts of
several gaps accumulate in turn.
"""

UNITS = {
    name: k
    for k, name in enumerate(
        (
            *("first", "width", "slip", "at", "speed", "poisson", "part", "owner", "small", "slow", "rounding"),
            *("unmoved", "trigger", "state", "state_x", "state_y", "next", "next_x", "next_y", "closed"),
            *("chosen", "given", "given_x", "given_y", "turned_x", "turned_y", "struck", "stopped", "acts", "series"),
            *("found", "found_x", "found_y", "holds", "gone"),
        )
    )
}
"""Of each gap and slip: its first row and their number, its kind and gap, its part, and a number that places of one
part share, what is zero but for errors, and but for rounding, by how little a unit of force moves it where only
rounding does, what has happened, its state and direction before and after, and whether it was closed at that moment;
the rest is work. Of what has impacts that accumulate `series` is 1."""

ROWS = {
    name: k
    for k, name in enumerate(
        (
            *("rates", "wanted", "forces", "motions", "acting", "slot", "right", "solution", "across"),
            *("impulses", "again", "after", "work", "pressed"),
        )
    )
}
"""Numbers of each row: a gap has one, a slip one or two. Impulses that act already, which rub, are `pressed`."""

CLOSES, OPENS, YIELDS, STOPS = range(1, 5)
"""What has happened to a gap or a slip."""

ENTRY = ("unit", "before", "after", "loss")
"""What begins an entry of the log of impacts; impulses of all rows follow."""

NO_VALUE, INSIDE, ENDLESS, GAINS, NO_IMPULSES, NO_SET, FULL, UNDETERMINED = range(1, 9)
"""Why a set is not found: something has no value, a gap begins inside, impacts follow each other without end, energy
would grow, or no impulses, or no set, contradict nothing by the rules here; or the log is full, or how several parts
share a load, which nothing determines, moves something."""

REFUSED = {
    NO_VALUE: "something has no value where it touches",
    INSIDE: "it begins inside",
    ENDLESS: "impacts follow each other without end",
    GAINS: "Newton's law of impact would make energy",
    NO_IMPULSES: "no impulses are found that satisfy the laws of impact and friction",
    NO_SET: "no accelerations are found that satisfy contact and friction",
    FULL: "impacts follow each other without end",
    UNDETERMINED: "friction depends on how forces are shared, which nothing determines",
}
"""The same in words."""

CAPACITY = 64
"""Entries of the log."""


class Sets(Record):
    """The memory of sets within a routine."""

    def unit(self, name: str) -> Value:
        """Return the address of a number for each gap and slip."""
        units: Value = self.units
        return units.at(self.count * UNITS[name])

    def row(self, name: str) -> Value:
        """Return the address of a number for each row."""
        rows: Value = self.rows
        return rows.at(self.size * ROWS[name])

    def result(self, name: str) -> Value:
        """Return the address of results of the program."""
        n, out = self.size, self.out
        each = n * 4 + n * n
        limits = each + n * self.speeds
        places: dict[str, Operand] = {"values": 0, "rates": n, "free": n * 2, "restitution": n * 3, "response": n * 4}
        places |= {"each": each, "limits": limits, "shares": limits + self.count * 4}
        found: Value = out.at(places[name])
        return found


def open_routine(
    name: str, more: Mapping[str, Kind] | None = None, result: Kind | None = CODE, exported: bool = False
) -> tuple[Routine, Sets, list[Value]]:
    """Begin a routine that takes the memory of sets; return it, the memory, and its other arguments."""
    routine = Routine(name, {"place": ADDRESS, **(more or {})}, result, exported)
    return routine, Sets(routine.arguments[0], FIELDS), routine.arguments[1:]


def product_of(r: Routine, count: Operand, a: Value, b: Value) -> Value:
    """Return the scalar product of two arrays."""
    total = r.variable(0.0)
    with r.count(count) as i:
        total.now = total.now + a[i] * b[i]
    return total.now


def norm(r: Routine, x: Value, y: Value) -> Value:
    """Return the size of two values that are square to each other."""
    return r.sqrt(x * x + y * y)


@contextmanager
def each_unit(r: Routine, m: Sets, flag: str) -> Iterator[tuple[Value, Value, Value]]:
    """Go through the units with a flag: their number, first row, and whether they have two rows."""
    flags, firsts, widths = m.unit(flag), m.unit("first"), m.unit("width")
    with r.count(m.count) as k, r.when(flags[k] != 0.0):
        yield k, r.truncated(firsts[k]), widths[k] == 2.0


@contextmanager
def each_row(r: Routine, m: Sets, k: Value) -> Iterator[tuple[Value, Value]]:
    """Go through the rows of a unit: the number within it, and that of the row."""
    first = r.truncated(m.unit("first")[k])
    with r.count(r.truncated(m.unit("width")[k])) as i:
        yield i, first + i


def is_loose(r: Routine, m: Sets, k: Value) -> Value:
    """Tell whether a slip is one at a gap that is open."""
    at = m.unit("at")[k]
    gap = r.truncated(r.most(at, 0.0))
    pressed = m.row("pressed")[r.truncated(m.unit("first")[gap])]
    return (at >= 0.0) & (m.unit("next")[gap] == float(OPEN)) & ~(pressed > 0.0)


def limit_of(r: Routine, m: Sets, k: Value, group: Operand) -> Value:
    """Return the limit of a unit at the present forces: one of limit, static limit, and both backwards."""
    count, size = m.count, m.size
    place = (k * 0 + group) * count + k
    own: Value = m.result("limits")[place] * m.finite
    shares = m.shares.at(place * size)
    return own + product_of(r, size, shares, m.row("forces")) + product_of(r, size, shares, m.row("pressed"))


def copy_states(r: Routine, m: Sets, target: str, source: str) -> None:
    """Copy the states of all units, with their directions."""
    for one in ("", "_x", "_y"):
        r.copy(m.unit(f"{target}{one}"), m.unit(f"{source}{one}"), m.count)


def size_of_slip(r: Routine, row: Value, is_pair: Value, values: Value) -> tuple[Value, Value, Value]:
    """Return a slip's values in both directions, and their size."""
    a, b = values[row], r.choose(is_pair, values[row + is_pair.integer()], 0.0)
    return a, b, norm(r, a, b)


def choose_slips(r: Routine, m: Sets) -> None:
    """Choose the slips that may rub where some gaps are closed."""
    chosen, at = m.unit("chosen"), m.unit("at")
    with r.count(m.count) as k, r.when(m.unit("slip")[k] != 0.0):
        gap = r.truncated(r.most(at[k], 0.0))
        chosen[k] = r.choose((at[k] < 0.0) | (chosen[gap] != 0.0), 1.0, 0.0)


def small_motion(r: Routine, m: Sets) -> Value:
    """Return how much is no motion, but rounding."""
    moved, fallen = r.variable(0.0), r.variable(0.0)
    with r.count(m.size) as i:
        moved.now = r.most(moved.now, r.size(m.row("motions")[i]))
        fallen.now = r.most(fallen.now, r.size(m.row("wanted")[i]))
    return r.variable((moved.now + fallen.now) * SLACK).now


def give_way(r: Routine, m: Sets, k: Value, way: tuple[Value, Value, Value], sign: float) -> None:
    """Let a slip go on the way of some values, or against it."""
    a, b, length = way
    unit = r.choose(length > 0.0, length, 1.0) * sign
    m.unit("given")[k] = r.choose(length > 0.0, 1.0, 0.0)
    m.unit("given_x")[k], m.unit("given_y")[k] = a / unit, b / unit


def is_still(r: Routine, m: Sets, k: Value, size: Value) -> Value:
    """Tell whether a slip is at rest; what has come to rest is as slow as its event sees."""
    return ~(size > r.choose(m.unit("trigger")[k] == float(STOPS), SEEN, 1.0) * m.unit("slow")[k] * m.pace)
