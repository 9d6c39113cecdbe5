"""The routine of a set of contacts: impacts of gaps, and which gaps and slips hold from a moment on.

The rules are those of `atwood.numerics.contact_sets` and `atwood.simulation.contacts.changes`, word by word. Where a
set that contradicts nothing is not found by changing the worst state, all that slips is tried both ways; else the
routine says so. That rest has a share is seen from the least forces alone, with ever more of what holds let go.
A program gives rates, accelerations, responses and limits, and the speeds change in place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from math import inf, sqrt

from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    CODE,
    INTEGER,
    NUMBER,
    Kind,
    Operand,
    Record,
    Routine,
    Value,
    Variable,
    call_kernel,
    place_of,
)
from atwood.integrators.event_routines import do_or_return
from atwood.numerics.contact_sets import CLEAR, FIRM, GOES_ON, NOTHING, OPEN, SLACK, STICKS, STILL, SWEEPS, TIGHT, TURNS

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("program", "derived", "scratch", "y", "out", "units", "rows", "matrix", "left"), ADDRESS),
    **dict.fromkeys(("shares", "pattern", "past", "log"), ADDRESS),
    **dict.fromkeys(("finite", "blur", "pace", "tolerance", "inside", "ahead", "rough", "later"), NUMBER),
    **dict.fromkeys(("better_x", "better_y", "lasted", "slack"), NUMBER),
    **dict.fromkeys(("count", "size", "entries", "coordinates", "speeds", "number", "better"), INTEGER),
    **dict.fromkeys(("logged", "known", "stops", "told", "repeats", "shared", "tried"), INTEGER),
}
"""The memory of sets. `finite` is 0 where limits are of impulses, which finite forces do not have; `blur` and `pace`
are multiples of what is small and slow; `inside` is how deep a gap may be, in multiples of what is small; `ahead` is
how long impacts may still go on that are summed, and then how long they do, `rough` how long where rounding tells the
length of their intervals, `later` how long where these are uneven, `lasted` how long these have gone on; `stops` is 1
where these come to an end and may still wait for one more, 2 where they come to an end, `told` which gap is said to
rest then; `shared` is 1 where forces of a
set that was found are not determined, as rows repeat each other, or where another share might let rest what begins to
slip, and `repeats` where those solved for last are not. `tried` is 0, or which share that holds everything is taken
whatever its forces are here: joints have a part in those that are reported."""

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

SPANS = 4, 12
"""At least and at most so many intervals between impacts say how fast these follow each other."""

LONG, BEND = 512, 0.9
"""A sum is looked for among so many intervals, and extrapolated where changes shrink to less than this share.

Rounding makes each interval longer by what a unit of the last digit of a gap takes: the shorter it is the more, and
where intervals shrink by little each, the sum has much of it. At factors of 0.977 the last 256 of 620 come too late.
"""

EVEN = 4.0
"""Intervals of a series shrink by factors that differ by no more than this from their mean."""

STEADY, LATER = 1.5, 0.001
"""Where factors differ by more than the first from their mean, a series is summed later: at this share of its rest."""

LEVEL, SHORT = 0.97, 4.0
"""Intervals that do not shrink, by more than the first, and are so many times those of uneven ones, are rounding."""

SQUEEZED = 30.0
"""Times what is as good as closed: in a gap as narrow as that, impacts of what is squeezed are summed."""

LOSSLESS = 0.01
"""Times how long uneven impacts may go on that are summed: those that lose nothing come to no end but by rounding."""

RECENT = 6
"""So many factors since which a series is steady are enough, whatever came before."""

WAITS = 0.1
"""Of how long impacts may still go on that are summed: so long may those that wait for one more."""

FLATTENS = 0.9
"""Where the newest interval shrinks by less than this share of what all do on average, rounding tells its length."""

ALIKE = 100.0
"""Gaps that come to rest together part at speeds that differ by no larger factor."""

OFTEN = 2
"""A gap with so many impacts in the intervals of a series is part of it; with fewer it only passes near by."""

SEEN = 2.0
"""Times what is slow: what has come to rest may go by that still, or again, where its event is seen."""

BEGINS = 0.05
"""Times what is slow: the fastest of what begins to slip in two directions goes by that, lest rounding turn it."""

ASTRAY = 0.9
"""Cosine of the angle by which what begins to slip may move otherwise than friction holds it back."""

NEAR_REST = 100.0
"""Times what is small and slow, where impacts have accumulated."""

_SETS = 12
"""Times the number of gaps and slips: so many sets are tried."""

ROUNDED = 0.25 * 2.0**-52
"""Of the scene's size: a bounce that is no higher is rounding."""

BLURRED = 512.0
"""Times rounding of a gap by the share of energy that is lost: rounding tells in bounces that are no higher.

Each adds about its rounding to their height; where losses take as much away they would go on for ever.
"""

UNMOVED = 1e-28
"""Of the inverse of the scene's mass: what a unit of force moves by less is moved by rounding, which is squared."""

STEP = 2.0**-26
"""Of coordinates: by so much each is moved to see how its rounding moves a gap."""

FAST = 1e3
"""What bounces no higher than rounding is looked for where forces pull it back by so much times what falls, at most."""

GAIN = 1e-9
"""Of the work of impulses: more than this is energy that an impact would make."""

SHARED = 100.0
"""Times the slack of one inequality: shares that nothing determines come from other equations."""

MOST_SHARES = 500
"""So many shares of forces that nothing determines are tried."""

_SHORT = 1e-20
"""Squares of rows of length one that are no larger are rounding."""

_MOVED = 1e-12
"""Of the largest response: what moves less by an impulse does not move."""


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


def _open(
    name: str, more: Mapping[str, Kind] | None = None, result: Kind | None = CODE, exported: bool = False
) -> tuple[Routine, Sets, list[Value]]:
    routine = Routine(name, {"place": ADDRESS, **(more or {})}, result, exported)
    return routine, Sets(routine.arguments[0], FIELDS), routine.arguments[1:]


def _sum(r: Routine, count: Operand, a: Value, b: Value) -> Value:
    """Return the scalar product of two arrays."""
    total = r.variable(0.0)
    with r.count(count) as i:
        total.now = total.now + a[i] * b[i]
    return total.now


def _norm(r: Routine, x: Value, y: Value) -> Value:
    return r.sqrt(x * x + y * y)


@contextmanager
def _each(r: Routine, m: Sets, flag: str) -> Iterator[tuple[Value, Value, Value]]:
    """Go through the units with a flag: their number, first row, and whether they have two rows."""
    flags, firsts, widths = m.unit(flag), m.unit("first"), m.unit("width")
    with r.count(m.count) as k, r.when(flags[k] != 0.0):
        yield k, r.truncated(firsts[k]), widths[k] == 2.0


@contextmanager
def _rows(r: Routine, m: Sets, k: Value) -> Iterator[tuple[Value, Value]]:
    """Go through the rows of a unit: the number within it, and that of the row."""
    first = r.truncated(m.unit("first")[k])
    with r.count(r.truncated(m.unit("width")[k])) as i:
        yield i, first + i


def _is_loose(r: Routine, m: Sets, k: Value) -> Value:
    """Tell whether a slip is one at a gap that is open."""
    at = m.unit("at")[k]
    gap = r.truncated(r.most(at, 0.0))
    pressed = m.row("pressed")[r.truncated(m.unit("first")[gap])]
    return (at >= 0.0) & (m.unit("next")[gap] == float(OPEN)) & ~(pressed > 0.0)


def _limit(r: Routine, m: Sets, k: Value, group: Operand) -> Value:
    """Return the limit of a unit at the present forces: one of limit, static limit, and both backwards."""
    count, size = m.count, m.size
    place = (k * 0 + group) * count + k
    own: Value = m.result("limits")[place] * m.finite
    shares = m.shares.at(place * size)
    return own + _sum(r, size, shares, m.row("forces")) + _sum(r, size, shares, m.row("pressed"))


# -- linear systems -------------------------------------------------------------------------------------------------


def _solve() -> Routine:
    """Solve the system of the acting rows; where they depend on each other, by least norm."""
    r, m, (count,) = _open("solve_forces", {"count": INTEGER})
    matrix, left, right, solution, size = m.matrix, m.left, m.row("right"), m.row("solution"), m.size
    stride, largest = size + 1, r.variable(0.0)
    m.repeats = 0
    with r.count(count) as i:
        row, own = matrix.at(i * size), left.at(i * stride)
        largest.now = 0.0
        with r.count(count) as j:
            largest.now = r.most(r.size(row[j]), largest.now)
        unit = r.choose(largest.now > 0.0, largest.now, 1.0)
        with r.count(count) as j:
            row[j] = row[j] / unit
            own[j] = row[j]
        right[i] = right[i] / unit
        own[count] = right[i]
    best = r.variable(0, INTEGER)
    with r.count(count) as i:
        largest.now = -1.0
        with r.count(count, i) as k:
            entry = r.size(left[k * stride + i])
            with r.when(entry > largest.now):
                largest.now, best.now = entry, k
        with r.when(~(largest.now > CLEAR)):
            m.repeats = 1
            r.give(r.call("least_forces", r.arguments[0], count))
        pivot, other = left.at(i * stride), left.at(best.now * stride)
        with r.count(count + 1, i) as j:
            a, b = pivot[j], other[j]
            pivot[j] = b
            other[j] = a
        with r.count(count, i + 1) as k:
            row = left.at(k * stride)
            share = row[i] / pivot[i]
            with r.count(count + 1, i + 1) as j:
                row[j] = row[j] - share * pivot[j]
    total = r.variable(0.0)
    with r.count(count) as turn:
        i = count - 1 - turn
        row = left.at(i * stride)
        total.now = 0.0
        with r.count(count, i + 1) as k:
            total.now = total.now + row[k] * solution[k]
        solution[i] = (row[count] - total.now) / row[i]
    r.give(0)
    return r


def _least() -> Routine:
    """Find the shortest solution: rows are made square to each other, the largest first; what follows is left out."""
    r, m, (count,) = _open("least_forces", {"count": INTEGER})
    matrix, right, solution, across, size = m.matrix, m.row("right"), m.row("solution"), m.row("across"), m.size
    r.clear(solution, solution.at(count))
    with r.count(count) as i:
        row = matrix.at(i * size)
        length = r.sqrt(_sum(r, count, row, row))
        unit = r.choose(length > 0.0, length, 1.0)
        with r.count(count) as j:
            row[j] = row[j] / unit
        right[i] = right[i] / unit
    best, largest = r.variable(0, INTEGER), r.variable(0.0)
    with r.count(count):
        largest.now = 0.0
        with r.count(count) as k:
            row = matrix.at(k * size)
            square = _sum(r, count, row, row)
            with r.when(square > largest.now):
                largest.now, best.now = square, k
        r.give_if(~(largest.now > _SHORT), 0)
        one, unit = matrix.at(best.now * size), r.sqrt(largest.now)
        value = right[best.now] / unit
        with r.count(count) as j:
            across[j] = one[j] / unit
            solution[j] = solution[j] + value * across[j]
            one[j] = 0.0
        with r.count(count) as k:
            row = matrix.at(k * size)
            with r.count(2):
                share = _sum(r, count, row, across)
                with r.count(count) as j:
                    row[j] = row[j] - share * across[j]
                right[k] = right[k] - share * value
    r.give(0)
    return r


def _copy_states(r: Routine, m: Sets, target: str, source: str) -> None:
    """Copy the states of all units, with their directions."""
    for one in ("", "_x", "_y"):
        r.copy(m.unit(f"{target}{one}"), m.unit(f"{source}{one}"), m.count)


# -- sets -----------------------------------------------------------------------------------------------------------


def _equations() -> Routine:
    """Write the equations of the rows that act in the states that are tried; return their number."""
    r, m, () = _open("contact_equations", result=INTEGER)
    acting, slot, right, matrix, size, count = m.row("acting"), m.row("slot"), m.row("right"), m.matrix, m.size, m.count
    state, ways, free = m.unit("next"), (m.unit("next_x"), m.unit("next_y")), m.row("wanted")
    response, limits, shares = m.result("response"), m.result("limits"), m.shares
    n = r.variable(0, INTEGER)
    acts = m.unit("acts")
    with r.count(m.count) as k:
        acts[k] = r.choose((m.unit("chosen")[k] != 0.0) & (state[k] != float(OPEN)) & ~_is_loose(r, m, k), 1.0, 0.0)
    with _each(r, m, "acts") as (k, _, _), _rows(r, m, k) as (_, row):
        acting[n.now] = row.number()
        slot[row] = n.now.number()
        n.now = n.now + 1
    with _each(r, m, "acts") as (k, _, is_pair):
        back = (~is_pair & (ways[0][k] < 0.0)).integer() * 2
        with _rows(r, m, k) as (i, row):
            place = r.truncated(slot[row])
            own, part = matrix.at(place * size), r.choose(i == 0, ways[0][k], ways[1][k])
            with r.when(state[k] == float(STICKS)):
                with r.count(n.now) as j:
                    own[j] = response[row * size + r.truncated(acting[j])]
                right[place] = 0.0 - free[row]
            with r.otherwise():
                which = back * count + k
                with r.count(n.now) as j:
                    own[j] = part * shares[which * size + r.truncated(acting[j])]
                own[place] = own[place] + 1.0
                pressed = _sum(r, size, shares.at(which * size), m.row("pressed"))
                right[place] = (0.0 - part) * (limits[which] * m.finite + pressed)
    r.give(n.now)
    return r


def _moved() -> Routine:
    """Solve for the forces of the acting rows, and find how all rows move by them."""
    r, m, (count,) = _open("move_by_forces", {"count": INTEGER})
    forces, motions, free, acting, size = m.row("forces"), m.row("motions"), m.row("wanted"), m.row("acting"), m.size
    response, solution = m.result("response"), m.row("solution")
    r.call("solve_forces", r.arguments[0], count)
    r.clear(forces, forces.at(size))
    with r.count(count) as k:
        forces[r.truncated(acting[k])] = solution[k]
    with r.count(size) as i:
        motions[i] = free[i] + _sum(r, size, response.at(i * size), forces)
    r.give(0)
    return r


def _met() -> Routine:
    """Find the directions that cones of two rows take, and forces and motions of the states that are tried."""
    r, m, () = _open("meet_states")
    place, motions, size = r.arguments[0], m.row("motions"), m.size
    state, x, y, given = m.unit("next"), m.unit("next_x"), m.unit("next_y"), m.unit("given")
    turned = m.unit("turned_x"), m.unit("turned_y")
    count = r.variable(r.call("contact_equations", place, result=INTEGER), INTEGER)
    r.call("move_by_forces", place, count.now)
    most, some = r.variable(0.0), r.variable(False, BOOLEAN)

    def is_cone(k: Value, is_pair: Value) -> Value:
        return is_pair & (state[k] == float(GOES_ON)) & (given[k] == 0.0) & ~_is_loose(r, m, k)

    with r.count(TURNS):
        most.now, some.now = 0.0, False
        with _each(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            some.now = True
            a, b = motions[row], motions[row + 1]
            length = _norm(r, a, b)
            unit = r.choose(length > 0.0, length, 1.0)
            r.give_if(~(a * x[k] + b * y[k] > 0.0), 0)
            turned[0][k], turned[1][k] = a / unit, b / unit
            most.now = r.most(r.size(a / unit - x[k]), r.most(r.size(b / unit - y[k]), most.now))
        r.give_if(~some.now | (most.now <= STILL), 0)
        with _each(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            x[k], y[k] = turned[0][k], turned[1][k]
        count.now = r.call("contact_equations", place, result=INTEGER)
        with _each(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            _turn(r, m, k, row, count.now, size)
        r.call("move_by_forces", place, count.now)
    r.give(0)
    return r


def _turn(r: Routine, m: Sets, k: Value, row: Value, count: Value, size: Value) -> None:
    """Add to the equations of a cone how its direction turns with the forces."""
    x, y, forces, motions = m.unit("next_x")[k], m.unit("next_y")[k], m.row("forces"), m.row("motions")
    response, acting, right, matrix = m.result("response"), m.row("acting"), m.row("right"), m.matrix
    first, second, across = response.at(row * size), response.at((row + 1) * size), m.row("across")
    with r.count(size) as j:
        across[j] = x * second[j] - y * first[j]
    share = _limit(r, m, k, 0) / _norm(r, motions[row], motions[row + 1])
    before = _sum(r, size, across, forces)
    for i, part in ((0, 0.0 - y), (1, x)):
        slot = r.truncated(m.row("slot")[row + i])
        own = matrix.at(slot * size)
        with r.count(count) as j:
            own[j] = own[j] + share * part * across[r.truncated(acting[j])]
        right[slot] = right[slot] + share * part * before


class _Worst:
    """The state that contradicts most while it is looked for."""

    def __init__(self, r: Routine, m: Sets) -> None:
        self.r, self.m, self.miss = r, m, r.variable(m.slack)
        m.number = -1

    def consider(self, k: Value, miss: Value, state: int, x: Operand = 0.0, y: Operand = 0.0) -> None:
        """Take note of a state that would not contradict, where the present one does so more than others."""
        with self.r.when(miss > self.miss.now):
            self.miss.now = miss
            self.m.number, self.m.better, self.m.better_x, self.m.better_y = k, state, x, y


def _contradiction() -> Routine:
    """Find the unit whose state contradicts most, and the state it has then; -1 where none does."""
    r, m, () = _open("contradiction")
    forces, motions, free, size = m.row("forces"), m.row("motions"), m.row("wanted"), m.size
    response, worst = m.result("response"), _Worst(r, m)
    pushes, moves, total = r.variable(0.0), r.variable(0.0), r.variable(0.0)
    with _each(r, m, "chosen") as (k, _, _):
        pushes.now = r.most(r.size(_limit(r, m, k, 0)), pushes.now)
        with _rows(r, m, k) as (_, row):
            pushes.now = r.most(r.size(forces[row]), pushes.now)
            by = response.at(row * size)
            total.now = 0.0
            with r.count(size) as j:
                total.now = total.now + r.size(by[j] * forces[j])
            moves.now = r.most(r.size(free[row]), r.most(total.now, moves.now))
    push, move = (r.choose(one.now > 0.0, one.now, 1.0) for one in (pushes, moves))
    with _each(r, m, "chosen") as (k, row, is_pair), r.when(~_is_loose(r, m, k)):
        second = row + is_pair.integer()
        f = forces[row] / push, r.choose(is_pair, forces[second] / push, 0.0)
        a = motions[row] / move, r.choose(is_pair, motions[second] / move, 0.0)
        with r.when(m.unit("slip")[k] == 0.0):
            _check_gap(r, m, worst, k, f[0], a[0], _limit(r, m, k, 1) / push)
        with r.otherwise():
            _check_slip(r, m, worst, k, (f, a, push, is_pair))
    r.give(0)
    return r


def _check_gap(r: Routine, m: Sets, worst: _Worst, k: Value, f: Value, a: Value, static: Value) -> None:
    with r.when(m.unit("next")[k] == float(STICKS)):
        worst.consider(k, 0.0 - f - static, OPEN)
        worst.consider(k, a, OPEN)  # rows that depend on each other cannot all stick
    worst.consider(k, 0.0 - a, STICKS)


def _check_slip(
    r: Routine,
    m: Sets,
    worst: _Worst,
    k: Value,
    at: tuple[tuple[Value, Value], tuple[Value, Value], Value, Value],
) -> None:
    """See by how much the state of a slip contradicts each law; see `atwood.numerics.contact_sets`."""
    f, a, push, is_pair = at
    state, x, y, given = m.unit("next")[k], m.unit("next_x")[k], m.unit("next_y")[k], m.unit("given")[k] != 0.0
    goes, sticks = state == float(GOES_ON), state == float(STICKS)
    back = (~is_pair & r.choose(goes, x < 0.0, f[0] > 0.0, BOOLEAN)).integer() * 2
    limit, static = _limit(r, m, k, back) / push, _limit(r, m, k, back + 1) / push
    reads, shares = r.variable(False, BOOLEAN), m.shares.at((back * m.count + k) * m.size)
    with r.count(m.size) as j:
        reads.now = reads.now | (shares[j] != 0.0)
    alone = (m.unit("at")[k] < 0.0) & ~reads.now
    idle = alone & (r.most(limit, static) <= 0.0)
    with r.when(idle):
        worst.consider(k, r.choose(state == float(OPEN), 0.0, 1.0), OPEN)
    size, motion = _norm(r, *f), _norm(r, *a)
    with r.when(~idle & sticks):
        unit = r.choose(size > 0.0, size, 1.0)
        way = r.choose(size > 0.0, 0.0 - f[0] / unit, 1.0), 0.0 - f[1] / unit
        worst.consider(k, size - static, GOES_ON, *way)
        worst.consider(k, motion, GOES_ON, *way)
    with r.when(~idle & goes):
        with r.when(alone):
            worst.consider(k, 0.0 - limit, OPEN)
        with r.when(~given):
            worst.consider(k, _norm(r, f[0] + limit * x, f[1] + limit * y), STICKS)
            along = a[0] * x + a[1] * y
            with r.when(along <= 0.0):
                worst.consider(k, 0.0 - along, STICKS)
            with r.otherwise():
                worst.consider(k, _norm(r, a[0] - along * x, a[1] - along * y), GOES_ON, a[0] / motion, a[1] / motion)
    with r.when(~idle & ~goes & ~sticks):
        miss = r.most(r.most(limit, static), r.choose(reads.now, 1.0, 0.0))
        with r.when(given):
            worst.consider(k, miss, GOES_ON, m.unit("given_x")[k], m.unit("given_y")[k])
        with r.otherwise():
            worst.consider(k, miss, STICKS)


def _improved() -> Routine:
    """Change the state that contradicts most, until none does; 1 where that does not end."""
    r, m, () = _open("improve")
    state, x, y = m.unit("next"), m.unit("next_x"), m.unit("next_y")
    with r.count((m.count + 1) * _SETS):
        r.call("meet_states", r.arguments[0])
        r.call("contradiction", r.arguments[0])
        number = m.number
        r.give_if(number < 0, 0)
        state[number] = m.better.number()
        x[number], y[number] = m.better_x, m.better_y
    r.give(1)
    return r


def _find() -> Routine:
    """Find states of the chosen units that contradict nothing, near to those that are given; 1 where there are none."""
    r, m, () = _open("find_states")
    state, x, y, given = m.unit("next"), m.unit("next_x"), m.unit("next_y"), m.unit("given")

    def allow(closes: bool) -> None:
        with _each(r, m, "chosen") as (k, _, _):
            is_slip, goes = m.unit("slip")[k] != 0.0, (state[k] == float(GOES_ON)) & ((x[k] != 0.0) | (y[k] != 0.0))
            kept = (goes | (~is_slip & (state[k] == 0.0))) if not closes else (state[k] != state[k])
            with r.when(given[k] != 0.0):
                state[k], x[k], y[k] = float(GOES_ON), m.unit("given_x")[k], m.unit("given_y")[k]
            with r.otherwise(), r.when(~kept):
                state[k], x[k], y[k] = float(STICKS), 0.0, 0.0

    _copy_states(r, m, "found", "next")
    for closes, slack in product((False, True), (TIGHT, SLACK)):
        m.slack = slack
        _copy_states(r, m, "next", "found")
        allow(closes)
        with r.when(r.call("improve", r.arguments[0]) == 0):
            m.shared = r.choose(m.repeats != 0, 1, m.shared, INTEGER)
            r.give(0)
    some, after, small = r.variable(False, BOOLEAN), m.row("after"), _small_motion(r, m)
    for way in (1.0, -1.0):  # where slips and gaps move each other; others may be nearer
        allow(True)
        with _each(r, m, "chosen") as (k, row, is_pair), r.when((m.unit("slip")[k] != 0.0) & (given[k] == 0.0)):
            a, b, size = _size_of_slip(r, row, is_pair, m.row("wanted"))
            unit = r.choose(is_pair & (size > 0.0), size * way, 1.0)
            state[k] = float(GOES_ON)
            x[k], y[k] = r.choose(is_pair, a / unit, way), r.choose(is_pair, b / unit, 0.0)
        with r.when(r.call("improve", r.arguments[0]) == 0):
            with r.count(m.size) as i, r.when(some.now & (r.size(m.row("motions")[i] - after[i]) > small * SHARED)):
                r.give(1)
            r.copy(after, m.row("motions"), m.size)
            some.now, m.shared = True, 1
            _copy_states(r, m, "found", "next")
    with r.when(some.now):
        _copy_states(r, m, "next", "found")
        r.give(r.call("meet_states", r.arguments[0]))
    r.call("relax", r.arguments[0])
    r.give(r.call("improve", r.arguments[0]))
    return r


def _relaxed() -> Routine:
    """Choose the states of forces that are projected one by one on what they may be (Jean and Moreau, 1992)."""
    r, m, () = _open("relax")
    forces, free, size, response = m.row("forces"), m.row("wanted"), m.size, m.result("response")
    state, x, y = m.unit("next"), m.unit("next_x"), m.unit("next_y")
    fallen, moved, most = r.variable(0.0), r.variable(0.0), r.variable(0.0)
    r.clear(forces, forces.at(size))
    with r.count(size) as i:
        fallen.now = r.most(fallen.now, r.size(free[i]))
    with r.count(SWEEPS):
        moved.now, most.now = 0.0, 0.0
        with _each(r, m, "chosen") as (k, row, is_pair):
            first, second = row, row + is_pair.integer()
            own = response[first * size + first] + r.choose(is_pair, response[second * size + second], 0.0)
            step = 1.0 / r.choose(own > 0.0, own, 1.0)
            a, b = (free[i] + _sum(r, size, response.at(i * size), forces) for i in (first, second))
            motion = _norm(r, a, r.choose(is_pair, b, 0.0))
            before = r.variable(forces[first]).now, r.variable(forces[second]).now
            push = before[0] - step * a, r.choose(is_pair, before[1] - step * b, 0.0)
            length, given = r.variable(_norm(r, *push)).now, m.unit("given")[k] != 0.0
            group = (~is_pair & (push[0] > 0.0)).integer() * 2
            holds = r.choose(m.unit("slip")[k] == 0.0, push[0] > 0.0 - _limit(r, m, k, 1), length == 0.0, BOOLEAN)
            limit = r.variable(r.most(_limit(r, m, k, group), 0.0)).now
            holds = r.variable(holds | ((m.unit("slip")[k] != 0.0) & ~given & ~(length > limit)), BOOLEAN).now
            unit = r.choose(length > 0.0, length, 1.0)
            way = (
                r.variable(r.choose(given, m.unit(f"given_{axis}")[k], 0.0 - part / unit)).now
                for axis, part in zip("xy", push, strict=True)
            )
            x[k], y[k] = way
            with r.when(m.unit("slip")[k] == 0.0):
                forces[first], state[k] = r.choose(holds, push[0], 0.0), r.choose(holds, float(STICKS), float(OPEN))
            with r.otherwise():
                sticks = holds | (~given & (motion <= SLACK * fallen.now))
                state[k] = r.choose(sticks, float(STICKS), float(GOES_ON))
                with r.when(is_pair):
                    forces[second] = r.choose(holds, push[1], 0.0 - limit * y[k])
                forces[first] = r.choose(holds, push[0], 0.0 - limit * x[k])
            for row, old in zip((first, second), before, strict=True):
                moved.now = r.most(moved.now, r.size(forces[row] - old))
                most.now = r.most(most.now, r.size(forces[row]))
        r.give_if(moved.now <= SLACK * most.now, 0)
    r.give(0)
    return r


# -- shares of forces -----------------------------------------------------------------------------------------------


def _direction() -> Routine:
    """Take the longest of some rows as a direction of size one, and what is along it from all; 1 where none is left."""
    r, m, (rows, count, target, least) = _open(
        "take_direction", {"rows": INTEGER, "count": INTEGER, "target": ADDRESS, "least": NUMBER}
    )
    matrix, size, best, largest = m.matrix, m.size, r.variable(0, INTEGER), r.variable(0.0)
    with r.count(rows) as i:
        length = r.sqrt(_sum(r, count, matrix.at(i * size), matrix.at(i * size)))
        with r.when(length > largest.now):
            largest.now, best.now = length, i
    r.give_if(~(largest.now > least), 1)
    with r.count(count) as j:
        target[j] = matrix[best.now * size + j] / largest.now
    with r.count(rows) as i:
        _make_square(r, matrix.at(i * size), target, count)
    r.give(0)
    return r


def _make_square(r: Routine, row: Value, direction: Value, count: Value) -> None:
    """Take from a row what is along a direction, and once more, against rounding."""
    with r.count(2):
        share = _sum(r, count, row, direction)
        with r.count(count) as j:
            row[j] = row[j] - share * direction[j]


def _alike(m: Sets, k: Value, row: Value) -> Value:
    """Return how a row of a unit moves by its own force, where lengths and angles are compared; see `sizes_of`."""
    unit = m.unit("rounding")[k]
    response: Value = m.result("response")[row * m.size + row]
    return response / (unit * unit)


def _determined() -> Routine:
    """Refuse a set in which shares of forces between parts that nothing determines move something.

    Null vectors of the equations for forces that do are looked for; see `atwood.numerics.contact_sets._judged`.
    """
    r, m, () = _open("determined")
    r.give_if(m.repeats == 0, 0)
    place, matrix, size, acting, every = r.arguments[0], m.matrix, m.size, m.row("acting"), m.row("solution")
    response, top, largest, known = m.result("response"), r.variable(0.0), r.variable(0.0), r.variable(0, INTEGER)
    count, left, stride = r.call("contact_equations", place, result=INTEGER), m.left, size + 1
    r.clear(every, every.at(size))
    with _each(r, m, "chosen") as (k, _, _), _rows(r, m, k) as (_, i):
        top.now = r.most(_alike(m, k, i), top.now)
    with _each(r, m, "chosen") as (k, _, _), _rows(r, m, k) as (_, i):
        own = response[i * size + i]
        every[i] = r.choose(_alike(m, k, i) > top.now * NOTHING, r.sqrt(r.size(own)), 0.0)

    def scale(row: Value, of: Value) -> None:
        """Divide a row by what its columns are scaled by; zero where joints hold what it is of."""
        with r.count(count) as j:
            unit = every[r.truncated(acting[j])]
            row[j] = r.choose(of > 0.0, row[j] / r.choose(unit > 0.0, unit, 1.0), 0.0)

    with r.count(count) as i:
        row = matrix.at(i * size)
        scale(row, every[r.truncated(acting[i])])
        largest.now = 0.0
        with r.count(count) as j:
            largest.now = r.most(r.size(row[j]), largest.now)
        with r.count(count) as j:
            row[j] = row[j] / r.choose(largest.now > 0.0, largest.now, 1.0)
    with r.count(count):
        is_left = r.call("take_direction", place, count, count, left.at(known.now * stride), CLEAR) == 0
        known.now = known.now + is_left.integer()
    with r.count(size) as i:
        row = matrix.at(i * size)
        with r.count(count) as j:
            row[j] = response[i * size + r.truncated(acting[j])] / r.choose(every[i] > 0.0, every[i], 1.0)
        scale(row, every[i])
        with r.count(known.now) as k:
            _make_square(r, row, left.at(k * stride), count)
    with r.count(count, known.now):
        r.give_if(r.call("take_direction", place, size, count, left, sqrt(CLEAR)) != 0, 0)
        r.give_if(_is_shared_by_parts(r, m, left), UNDETERMINED)
    r.give(0)
    return r


def _is_shared_by_parts(r: Routine, m: Sets, way: Value) -> Value:
    """Tell whether forces of several parts may change along a direction: what is not pressed is only pressed more."""
    forces, most, first, last = m.row("forces"), r.variable(0.0), r.variable(inf), r.variable(-inf)
    more, less = r.variable(True, BOOLEAN), r.variable(True, BOOLEAN)
    with r.count(m.size) as i:
        most.now = r.most(r.size(forces[i]), most.now)
    with _each(r, m, "acts") as (k, row, _), r.when(m.unit("slip")[k] == 0.0):
        share = way[r.truncated(m.row("slot")[row])]
        with r.when(~(forces[row] > most.now * SLACK)):
            more.now, less.now = more.now & (share >= -CLEAR), less.now & (share <= CLEAR)
        with r.when(r.size(share) > sqrt(CLEAR)):
            owner = m.unit("owner")[k]
            first.now, last.now = r.least(owner, first.now), r.most(owner, last.now)
    return (more.now | less.now) & (first.now < last.now)


def _share() -> Routine:
    """Let all rest, or let go what need not hold, where nothing determines forces; see `find_states` and `_shared`."""
    r, m, (rests,) = _open("share_forces", {"rests": INTEGER})
    place, state, repeats = r.arguments[0], m.unit("next"), r.variable(m.repeats, INTEGER)
    small = _small_motion(r, m)
    goes, moves = r.variable(False, BOOLEAN), r.variable(False, BOOLEAN)
    with _each(r, m, "chosen") as (k, row, is_pair), r.when(m.unit("given")[k] == 0.0):
        is_moved = _size_of_slip(r, row, is_pair, m.row("motions"))[2] > small
        goes.now, moves.now = goes.now | (state[k] != float(STICKS)), moves.now | is_moved
    tries = r.variable(goes.now & (rests != 0), BOOLEAN)
    r.give_if(~tries.now & (repeats.now == 0), 0)
    _copy_states(r, m, "found", "next")
    with r.when(tries.now):
        with _each(r, m, "chosen") as (k, _, _), r.when(m.unit("given")[k] == 0.0):
            state[k], m.unit("next_x")[k], m.unit("next_y")[k] = float(STICKS), 0.0, 0.0
        r.call("meet_states", place)
        tries.now = m.repeats != 0
        with r.when(tries.now):
            m.shared = 1
            r.give_if(r.call("let_go", place) == 0, 0)
        _copy_states(r, m, "next", "found")
        r.call("meet_states", place)
    r.give_if(repeats.now == 0, 0)
    with r.when(tries.now & ~moves.now):  # friction that is at its limit may say how the load is shared
        n = r.variable(0, INTEGER)
        _list(r, m, n, lambda k: m.unit("given")[k] == 0.0)
        r.call("weighted_forces", place)
        r.give_if(r.call("is_lawful", place, n.now) == 0, 0)
    with _each(r, m, "chosen") as (k, row, is_pair), r.when((m.unit("given")[k] == 0.0) & (state[k] == float(GOES_ON))):
        is_moved = _size_of_slip(r, row, is_pair, m.row("motions"))[2] > small
        state[k] = r.choose(is_moved, float(GOES_ON), float(STICKS))
    r.give(r.call("let_go", place) * UNDETERMINED)
    return r


def _list(r: Routine, m: Sets, n: Variable, is_one: Callable[[Value], Value]) -> None:
    """Add chosen units to those that hold, and count them."""
    with _each(r, m, "chosen") as (k, _, _), r.when(is_one(k)):
        m.unit("holds")[n.now] = k.number()
        n.now = n.now + 1


def _small_motion(r: Routine, m: Sets) -> Value:
    """Return how much is no motion, but rounding."""
    moved, fallen = r.variable(0.0), r.variable(0.0)
    with r.count(m.size) as i:
        moved.now = r.most(moved.now, r.size(m.row("motions")[i]))
        fallen.now = r.most(fallen.now, r.size(m.row("wanted")[i]))
    return r.variable((moved.now + fallen.now) * SLACK).now


def _let_go() -> Routine:
    """Let go ever more of what holds until least forces contradict no law, slips first; 1 where none do."""
    r, m, () = _open("let_go")
    place, state, holds, gone = r.arguments[0], m.unit("next"), m.unit("holds"), m.unit("gone")
    n, many, tried, last = (r.variable(0, INTEGER) for _ in range(4))
    top, most = r.variable(0.0), r.variable(0.0)
    with r.count(m.count) as k, _rows(r, m, k) as (_, i):
        top.now = r.most(_alike(m, k, i), top.now)
    with _each(r, m, "chosen") as (k, _, _), r.when((m.unit("slip")[k] == 1.0) & (state[k] == float(STICKS))):
        most.now = 0.0
        with _rows(r, m, k) as (_, i):
            most.now = r.most(_alike(m, k, i), most.now)
        state[k] = r.choose(most.now > top.now * NOTHING, float(STICKS), float(OPEN))  # joints hold it
    _list(r, m, n, lambda k: (m.unit("slip")[k] == 1.0) & (state[k] == float(STICKS)))
    _list(r, m, n, lambda k: (m.unit("slip")[k] == 0.0) & (state[k] == float(STICKS)))
    least = r.variable(r.call("rank_of_rows", place, CLEAR, result=INTEGER), INTEGER)

    def put(what: int) -> None:
        with r.count(many.now) as i:
            state[r.truncated(holds[r.truncated(gone[i])])] = float(what)

    with r.forever() as sizes:
        with r.when((many.now > n.now) | (tried.now >= MOST_SHARES)):
            r.leave(sizes)
        with r.count(many.now) as i:
            gone[i] = i.number()
        with r.forever() as choices:
            put(OPEN)
            with r.when(r.call("rank_of_rows", place, FIRM, result=INTEGER) == least.now):
                r.call("meet_states", place)
                with r.when(m.repeats != 0):
                    r.call("weighted_forces", place)
                r.give_if(r.call("is_lawful", place, n.now) == 0, 0)
            put(STICKS)
            tried.now, last.now = tried.now + 1, -1
            with r.count(many.now) as i:
                last.now = r.choose(gone[i] < (n.now - many.now + i).number(), i, last.now, INTEGER)
            with r.when((last.now < 0) | (tried.now >= MOST_SHARES)):
                r.leave(choices)
            first = r.variable(gone[last.now] + 1.0)
            with r.count(many.now, last.now) as i:
                gone[i] = first.now + (i - last.now).number()
        many.now = many.now + 1
    r.give(1)
    return r


def _weighted() -> Routine:
    """Find the least forces that are reported: squares count as much as rows move by their own forces."""
    r, m, () = _open("weighted_forces")
    size, acting, solution = m.size, m.row("acting"), m.row("solution")
    response, forces, motions = m.result("response"), m.row("forces"), m.row("motions")
    count = r.variable(r.call("contact_equations", r.arguments[0], result=INTEGER), INTEGER).now

    def unit(j: Value) -> Value:
        row = r.truncated(acting[j])
        own = response[row * size + row]
        return r.choose(own > 0.0, r.sqrt(r.size(own)), 1.0)

    with r.count(count) as i, r.count(count) as j:
        m.matrix[i * size + j] = m.matrix[i * size + j] / unit(j)
    r.call("solve_forces", r.arguments[0], count)
    with r.count(count) as j:
        forces[r.truncated(acting[j])] = solution[j] / unit(j)
    with r.count(size) as i:
        motions[i] = m.row("wanted")[i] + _sum(r, size, response.at(i * size), forces)
    r.give(0)
    return r


def _rank() -> Routine:
    """Return how many rows of what sticks are independent."""
    r, m, (least,) = _open("rank_of_rows", {"least": NUMBER}, result=INTEGER)
    acting, response, size, n = m.row("acting"), m.result("response"), m.size, r.variable(0, INTEGER)
    top, known, alike = r.variable(0.0), r.variable(0, INTEGER), m.row("solution")
    with _each(r, m, "chosen") as (k, _, _):
        sticks = (m.unit("next")[k] == float(STICKS)) & ~_is_loose(r, m, k)
        with r.when(sticks), _rows(r, m, k) as (_, row):
            acting[n.now] = row.number()
            alike[row] = _alike(m, k, row)
            top.now = r.most(alike[row], top.now)
            n.now = n.now + 1
    with r.count(n.now) as i, r.count(n.now) as j:
        a, b = r.truncated(acting[i]), r.truncated(acting[j])
        own, other = response[a * size + a], response[b * size + b]
        moves = (alike[a] > top.now * NOTHING) & (alike[b] > top.now * NOTHING)
        unit = r.sqrt(r.choose(moves, own, 1.0)) * r.sqrt(r.choose(moves, other, 1.0))
        m.matrix[i * size + j] = r.choose(moves, response[a * size + b] / unit, 0.0)
    with r.count(n.now), r.when(r.call("take_direction", r.arguments[0], n.now, n.now, m.left, least) == 0):
        known.now = known.now + 1
    r.give(known.now)
    return r


def _lawful() -> Routine:
    """Tell whether forces hold what is listed, within the limits of what sticks; 1 where they do not."""
    r, m, (n,) = _open("is_lawful", {"n": INTEGER})
    forces, motions, free, size, most = m.row("forces"), m.row("motions"), m.row("wanted"), m.size, r.variable(0.0)
    moves, total = r.variable(0.0), r.variable(0.0)
    with r.count(size) as i:
        most.now, total.now = r.most(r.size(forces[i]), most.now), r.size(free[i])
        with r.count(size) as j:
            total.now = total.now + r.size(m.result("response")[i * size + j] * forces[j])
        moves.now = r.most(total.now, moves.now)
    with r.count(n) as i:
        k = r.truncated(m.unit("holds")[i])
        row, is_pair, is_slip = r.truncated(m.unit("first")[k]), m.unit("width")[k] == 2.0, m.unit("slip")[k] != 0.0
        a, _, force = _size_of_slip(r, row, is_pair, forces)
        back = (~is_pair & is_slip & (a > 0.0)).integer() * 2
        static = _limit(r, m, k, back + 1)
        over = r.choose(is_slip, force - static, 0.0 - static - a)
        sticks = (m.unit("next")[k] == float(STICKS)) & ~_is_loose(r, m, k)
        moved = _size_of_slip(r, row, is_pair, motions)[2]
        is_beyond = sticks & (over > most.now * (SHARED * SLACK)) & (m.tried == 0)
        r.give_if((moved > moves.now * (SHARED * SLACK)) | is_beyond, 1)
    with r.when(m.tried > 1):
        m.tried = m.tried - 1
        r.give(1)
    m.tried = 0
    r.give(0)
    return r


# -- moments --------------------------------------------------------------------------------------------------------


def _read() -> Routine:
    """Evaluate the program at the present state."""
    r, m, (t,) = _open("read_contacts", {"t": NUMBER})
    y, shares, pattern, size, count, entries = m.y, m.shares, m.pattern, m.size, m.count, m.entries
    inputs = [place_of(r, t), y, y.at(m.coordinates)]
    r.give_if(call_kernel(r, m.program, inputs, m.derived, m.scratch, [m.out]) != 0, NO_VALUE)
    found = m.result("shares")
    r.clear(shares, shares.at(count * size * 4))
    with r.count(4) as group, r.count(entries) as e:
        place = (group * count + r.truncated(pattern[e])) * size + r.truncated(pattern[entries + e])
        shares[place] = found[group * entries + e]
    r.copy(m.row("rates"), m.result("rates"), size)
    r.give(0)
    return r


def _push() -> Routine:
    """Change speeds and rates by impulses."""
    r, m, (impulses,) = _open("push", {"impulses": ADDRESS})
    size, speeds, rates, response, each = m.size, m.speeds, m.row("rates"), m.result("response"), m.result("each")
    u = m.y.at(m.coordinates)
    with r.count(size) as i:
        by = impulses[i]
        with r.when(by != 0.0):
            own = each.at(i * speeds)
            with r.count(speeds) as j:
                u[j] = u[j] + own[j] * by
            with r.count(size) as j:
                rates[j] = rates[j] + response[j * size + i] * by
    r.give(0)
    return r


def _touch() -> Routine:
    """Choose the gaps that are closed, or at zero; return whether there are some."""
    r, m, () = _open("touching", result=INTEGER)
    chosen, state, values, rates = m.unit("chosen"), m.unit("state"), m.result("values"), m.row("rates")
    some = r.variable(0, INTEGER)
    with r.count(m.count) as k:
        row = r.truncated(m.unit("first")[k])
        closed = state[k] == float(STICKS)
        in_series = m.unit("series")[k] != 0.0
        blur, pace = r.choose(in_series, m.blur, 1.0), r.choose(in_series, m.pace, 1.0)
        closes = m.unit("trigger")[k] == float(CLOSES)  # far from the origin it is off by more than what is small
        is_near = closed | closes | (values[row] <= m.unit("small")[k] * blur)
        is_slow = (m.unit("speed")[k] == 0.0) | closed | (rates[row] <= m.unit("slow")[k] * pace)
        is_one = (m.unit("slip")[k] == 0.0) & is_near & is_slow
        chosen[k] = r.choose(is_one, 1.0, 0.0)
        with r.when(is_one), r.when(_is_inert(r, m, k, row)):
            chosen[k] = 0.0
        some.now = some.now + (chosen[k] != 0.0).integer()
    r.give(some.now)
    return r


def _is_inert(r: Routine, m: Sets, k: Value, row: Value) -> Value:
    """Tell whether joints hold a gap and all that slips there; see `_Moment._is_inert` in `changes`."""
    response, held, slow = m.result("response"), r.variable(False, BOOLEAN), m.unit("slow")[k]
    still = (m.row("rates")[row] >= 0.0 - slow) & (m.result("free")[row] >= 0.0 - slow * slow / m.unit("small")[k])
    held.now = still & (response[row * m.size + row] <= m.unit("unmoved")[k])
    with r.when(held.now), r.count(m.count) as j, r.when(m.unit("at")[j] == k.number()), _rows(r, m, j) as (_, i):
        held.now = held.now & (response[i * m.size + i] <= m.unit("unmoved")[j])
    return held.now


def _choose_slips(r: Routine, m: Sets) -> None:
    """Choose the slips that may rub where some gaps are closed."""
    chosen, at = m.unit("chosen"), m.unit("at")
    with r.count(m.count) as k, r.when(m.unit("slip")[k] != 0.0):
        gap = r.truncated(r.most(at[k], 0.0))
        chosen[k] = r.choose((at[k] < 0.0) | (chosen[gap] != 0.0), 1.0, 0.0)


def _impulses() -> Routine:
    """Find the impulses of the chosen units, and add them to those that there are."""
    r, m, () = _open("find_impulses")
    state, given, impulses, forces = m.unit("next"), m.unit("given"), m.row("impulses"), m.row("forces")
    with r.count(m.count) as k:
        state[k], given[k], m.unit("next_x")[k], m.unit("next_y")[k] = float(STICKS), 0.0, 0.0, 0.0
    m.finite = 0.0
    code = r.call("find_states", r.arguments[0])
    m.finite = 1.0
    r.give_if(code != 0, NO_IMPULSES)
    do_or_return(r, "determined")
    with r.count(m.size) as i:
        impulses[i] = impulses[i] + forces[i]
    r.give(0)
    return r


def _strike() -> Routine:
    """Let the chosen gaps collide, by Newton's or Poisson's law, with friction."""
    r, m, () = _open("strike")
    place, size, rates, free = r.arguments[0], m.size, m.row("rates"), m.row("wanted")
    impulses, again, share = m.row("impulses"), m.row("again"), m.result("restitution")
    response, gap, poisson = m.result("response"), m.unit("slip"), m.unit("poisson")
    r.copy(free, rates, size)
    r.clear(impulses, impulses.at(size))
    r.clear(again, again.at(size))
    with _each(r, m, "chosen") as (k, row, _), r.when((gap[k] == 0.0) & (poisson[k] == 0.0)):
        free[row] = free[row] - share[row] * r.most(0.0 - rates[row], 0.0)
    do_or_return(r, "find_impulses")
    more = r.variable(False, BOOLEAN)
    with _each(r, m, "chosen") as (k, row, _), r.when((gap[k] == 0.0) & (poisson[k] != 0.0)):
        again[row] = share[row] * impulses[row]
        more.now = more.now | (again[row] > 0.0)
    with r.when(more.now):
        with r.count(size) as i:
            impulses[i] = impulses[i] + again[i]
        with r.count(size) as i:
            free[i] = free[i] + _sum(r, size, response.at(i * size), impulses)
        r.copy(m.row("pressed"), again, size)
        do_or_return(r, "find_impulses")
        r.clear(m.row("pressed"), m.row("pressed").at(size))
    do_or_return(r, "account")
    r.call("push", place, impulses)
    r.give(0)
    return r


def _work_of(r: Routine, by: Value, before: Value, after: Value) -> tuple[Value, Value]:
    """Return the work that an impulse does between two rates, and the size of its terms."""
    return by * (before + after) * 0.5, r.size(by) * (r.size(before) + r.size(after)) * 0.5


def _account() -> Routine:
    """Refuse impulses that make energy, and log the impacts of gaps that approach."""
    r, m, () = _open("account")
    size, rates, impulses, after, work = m.size, m.row("rates"), m.row("impulses"), m.row("after"), m.row("work")
    response, log, total, sizes = m.result("response"), m.log, r.variable(0.0), r.variable(0.0)
    worst = r.variable(-inf)
    with r.count(size) as i:
        by, before = impulses[i], rates[i]
        after[i] = before + _sum(r, size, response.at(i * size), impulses)
        work[i], size_of_work = _work_of(r, by, before, after[i])
        total.now, sizes.now = total.now + work[i], sizes.now + size_of_work
    with r.when(total.now > sizes.now * GAIN):
        with _each(r, m, "chosen") as (k, row, _), r.when((m.unit("slip")[k] == 0.0) & (work[row] > worst.now)):
            worst.now, m.number = work[row], k
        r.give(GAINS)
    with _each(r, m, "struck") as (k, row, _), r.when(0.0 - rates[row] > m.unit("slow")[k] * m.pace):
        r.give_if(m.logged >= CAPACITY, FULL)
        entry = log.at(m.logged * (size + len(ENTRY)))
        loss = r.variable(0.0 - work[row])
        rubs = _each(r, m, "chosen")
        with rubs as (j, _, _), r.when(m.unit("at")[j] == k.number()), _rows(r, m, j) as (_, i):
            loss.now = loss.now - work[i]
        entry[0], entry[1], entry[2], entry[3] = k.number(), rates[row], after[row], loss.now
        r.copy(entry.at(len(ENTRY)), impulses, size)
        m.logged = m.logged + 1
    r.give(0)
    return r


def _collide() -> Routine:
    """Let what approaches collide, until nothing does."""
    r, m, () = _open("collide")
    chosen, struck = m.unit("chosen"), m.unit("struck")
    coming = r.variable(False, BOOLEAN)
    with r.count(CAPACITY):
        r.call("touching", r.arguments[0], result=INTEGER)
        coming.now = False
        with r.count(m.count) as k:
            struck[k] = chosen[k]
        with _each(r, m, "chosen") as (k, row, _):
            coming.now = coming.now | (m.row("rates")[row] < 0.0 - m.unit("slow")[k] * m.pace)
        r.give_if(~coming.now, 0)
        with r.count(m.count) as k, r.when(m.unit("speed")[k] != 0.0):
            chosen[k] = 1.0
        _choose_slips(r, m)
        do_or_return(r, "strike")
    r.give(ENDLESS)
    return r


def _hold() -> Routine:
    """Take away the rates of the chosen units; what begins to slip in two directions has those of a moment later."""
    r, m, () = _open("hold")
    acting, right, forces, rates, size = m.row("acting"), m.row("right"), m.row("forces"), m.row("rates"), m.size
    response, matrix, solution, n = m.result("response"), m.matrix, m.row("solution"), r.variable(0, INTEGER)
    moment, falls = r.variable(0.0), m.row("motions")
    with _each(r, m, "chosen") as (k, row, is_pair), r.when((m.unit("next")[k] == float(GOES_ON)) & is_pair):
        fall = _size_of_slip(r, row, is_pair, falls)[2]
        with r.when(fall > 0.0):
            soon = BEGINS * m.unit("slow")[k] * m.pace / fall
            moment.now = r.choose(moment.now > 0.0, r.least(moment.now, soon), soon)
    with _each(r, m, "chosen") as (k, _, is_pair), _rows(r, m, k) as (_, row):
        share = r.choose((m.unit("next")[k] == float(GOES_ON)) & is_pair, moment.now, 0.0)
        acting[n.now], right[n.now] = row.number(), falls[row] * share - rates[row]
        n.now = n.now + 1
    r.give_if(n.now == 0, 0)
    with r.count(n.now) as i:
        row = r.truncated(acting[i])
        with r.count(n.now) as j:
            matrix[i * size + j] = response[row * size + r.truncated(acting[j])]
    r.call("solve_forces", r.arguments[0], n.now)
    r.clear(forces, forces.at(size))
    with r.count(n.now) as i:
        forces[r.truncated(acting[i])] = solution[i]
    r.call("push", r.arguments[0], forces)
    r.give(0)
    return r


def _size_of_slip(r: Routine, row: Value, is_pair: Value, values: Value) -> tuple[Value, Value, Value]:
    """Return a slip's values in both directions, and their size."""
    a, b = values[row], r.choose(is_pair, values[row + is_pair.integer()], 0.0)
    return a, b, _norm(r, a, b)


def _give(r: Routine, m: Sets, k: Value, way: tuple[Value, Value, Value], sign: float) -> None:
    """Let a slip go on the way of some values, or against it."""
    a, b, length = way
    unit = r.choose(length > 0.0, length, 1.0) * sign
    m.unit("given")[k] = r.choose(length > 0.0, 1.0, 0.0)
    m.unit("given_x")[k], m.unit("given_y")[k] = a / unit, b / unit


def _is_still(r: Routine, m: Sets, k: Value, size: Value) -> Value:
    """Tell whether a slip is at rest; what has come to rest is as slow as its event sees."""
    return ~(size > r.choose(m.unit("trigger")[k] == float(STOPS), SEEN, 1.0) * m.unit("slow")[k] * m.pace)


def _stop() -> Routine:
    """Stop what touches with impacts that have accumulated; what bounced rubs as much. What has stuck goes on to.

    What would make energy waits for an impact to come, or where the series has nearly ended, does not rub.
    """
    r, m, () = _open("stop")
    chosen, slow, rates, given = m.unit("chosen"), m.unit("slow"), m.row("rates"), m.unit("given")
    series = m.unit("series")
    r.call("touching", r.arguments[0], result=INTEGER)
    with _each(r, m, "chosen") as (k, _, _), r.when(m.unit("series")[k] == 0.0):
        chosen[k] = 0.0  # it is near by, and has no such impacts
    coming = r.variable(0.0)
    with _each(r, m, "chosen") as (_, row, _):
        coming.now = r.most(0.0 - rates[row], coming.now)
    with _each(r, m, "chosen") as (k, row, _), r.when(rates[row] > r.most(coming.now * ALIKE, slow[k] * m.pace)):
        chosen[k] = 0.0  # it only passes: its impacts have not come to an end
    r.copy(m.unit("stopped"), chosen, m.count)
    m.told, state = -1, m.unit("state")
    with _each(r, m, "chosen") as (k, _, _):
        with r.when(m.told < 0):
            m.told = k
        with r.when((state[k] == float(OPEN)) & (state[m.told] != float(OPEN))):  # and was not closed all along
            m.told = k
    m.pace, m.finite = 1.0, 0.0
    _choose_slips(r, m)
    with r.count(m.count) as k, r.when(m.unit("slip")[k] != 0.0):
        still = m.unit("state")[k] == float(STICKS)
        chosen[k] = r.choose(still, 1.0, r.choose(m.unit("at")[k] >= 0.0, chosen[k], 0.0))
    r.clear(given, given.at(m.count))
    with _each(r, m, "chosen") as (k, row, is_pair):
        slides = (m.unit("slip")[k] != 0.0) & (m.unit("state")[k] != float(STICKS))
        way = _size_of_slip(r, row, is_pair, rates)
        with r.when(slides & ~_is_still(r, m, k, way[2])):
            _give(r, m, k, way, 1.0)
    r.copy(m.row("wanted"), rates, m.size)
    with r.when(r.call("end_impacts", r.arguments[0]) != 0):
        with r.when(m.stops == 1):
            m.stops, m.blur, m.pace, m.finite = 0, 1.0, 1.0, 1.0
            r.clear(series, series.at(m.count))
            r.give(0)
        with r.count(m.count) as k, r.when((m.unit("slip")[k] != 0.0) & (m.unit("state")[k] != float(STICKS))):
            chosen[k], given[k] = 0.0, 0.0
        r.call("end_impacts", r.arguments[0])
    m.finite = 1.0
    r.give(r.call("push", r.arguments[0], m.row("forces")))
    return r


def _end_impacts() -> Routine:
    """Find impulses that take away the rates of what is chosen, and rub as much; say where they make energy."""
    r, m, () = _open("end_impacts")
    chosen, rates, given, turned = m.unit("chosen"), m.row("rates"), m.unit("given"), r.variable(False, BOOLEAN)
    with r.forever() as loop:
        with r.count(m.count) as k:
            state = r.choose(given[k] != 0.0, float(GOES_ON), float(STICKS))
            m.unit("next")[k] = r.choose(chosen[k] != 0.0, state, float(OPEN))
            for one in "xy":
                m.unit(f"next_{one}")[k] = r.choose(given[k] != 0.0, m.unit(f"given_{one}")[k], 0.0)
        r.call("meet_states", r.arguments[0])
        turned.now = False
        with _each(r, m, "given") as (k, row, is_pair):
            a, b, _ = _size_of_slip(r, row, is_pair, m.row("motions"))
            with r.when(a * m.unit("given_x")[k] + b * m.unit("given_y")[k] <= 0.0):
                given[k], turned.now = 0.0, True
        with r.when(~turned.now):
            r.leave(loop)
    work, size = r.variable(0.0), r.variable(0.0)
    with r.count(m.size) as i:
        done, size_of_work = _work_of(r, m.row("forces")[i], rates[i], m.row("motions")[i])
        work.now, size.now = work.now + done, size.now + size_of_work
    r.give_if(work.now > size.now * GAIN, GAINS)
    r.give(0)
    return r


def _going(r: Routine, m: Sets, some: Variable, repeated: Variable) -> None:
    """Find the directions of the slips that go on already, and of those that begin to, which is as their event says.

    It also finds whether the forces of what has held until something begins to slip were not determined.
    """
    given, trigger, slip, state = m.unit("given"), m.unit("trigger"), m.unit("slip"), m.unit("state")
    yields = r.variable(False, BOOLEAN)
    with r.count(m.count) as k:
        given[k] = 0.0
        yields.now = yields.now | (trigger[k] == float(YIELDS))
    with r.when(yields.now):  # the forces in the states before
        with r.count(m.count) as k:
            m.unit("struck")[k], m.unit("chosen")[k] = m.unit("chosen")[k], 1.0
            given[k] = 1.0
            for one in ("", "_x", "_y"):
                m.unit(f"next{one}")[k] = m.unit(f"state{one}")[k]
        r.call("meet_states", r.arguments[0])
        repeated.now = m.repeats != 0
        with r.count(m.count) as k:
            m.unit("chosen")[k], given[k] = m.unit("struck")[k], 0.0
    with _each(r, m, "chosen") as (k, row, is_pair), r.when(slip[k] != 0.0):
        way = _size_of_slip(r, row, is_pair, m.row("rates"))
        with r.when(~_is_still(r, m, k, way[2])):
            _give(r, m, k, way, 1.0)
        with r.otherwise(), r.when(trigger[k] == float(YIELDS)):
            _give(r, m, k, _size_of_slip(r, row, is_pair, m.row("forces")), -1.0)
    with _each(r, m, "chosen") as (k, _, _):
        rests = (slip[k] == 0.0) | (trigger[k] == float(STOPS))
        m.unit("next")[k] = r.choose(rests, float(STICKS), state[k])
        for one in ("_x", "_y"):
            m.unit(f"next{one}")[k] = r.choose(rests, 0.0, m.unit(f"state{one}")[k])
        some.now = some.now | True


def _look_at_begins(r: Routine, m: Sets) -> None:
    """Leave to others what begins to slip in a plane and moves otherwise than it is given, or nowhere: `_turned`."""
    small = _small_motion(r, m)
    with _each(r, m, "given") as (k, row, is_pair), r.when(m.unit("trigger")[k] == float(YIELDS)):
        a, b, size = _size_of_slip(r, row, is_pair, m.row("motions"))
        is_astray = a * m.unit("given_x")[k] + b * m.unit("given_y")[k] < size * ASTRAY
        m.shared = r.choose(is_pair & (is_astray | (size <= small)), 1, m.shared, INTEGER)


def _barely_rising() -> Routine:
    """Mark gaps that rise by no more than rounding before they are back: ``v^2 <= 2 A f`` times that."""
    r, m, () = _open("barely_rising")
    struck, rates, rounding, free = m.unit("struck"), m.row("rates"), m.unit("rounding"), m.result("free")
    largest, some = r.variable(0.0), r.variable(False, BOOLEAN)
    with r.count(m.size) as i:
        largest.now = r.most(r.size(free[i]), largest.now)
    with r.count(m.count) as k:
        struck[k], m.unit("given")[k], m.unit("next")[k] = 0.0, 0.0, float(OPEN)
    with _each(r, m, "chosen") as (k, row, _), r.when(m.unit("speed")[k] == 0.0):
        rate, is_near = rates[row], rates[row] * rates[row] <= rounding[k] * largest.now * (2.0 * FAST)
        rises = rate > m.unit("slow")[k] * m.pace
        struck[k] = r.choose(rises & is_near, 1.0, 0.0)
        m.unit("next")[k] = r.choose(rises & ~is_near, float(OPEN), float(STICKS))
        some.now = some.now | (rises & is_near)
    r.give_if(~some.now, 0)
    r.copy(m.row("wanted"), free, m.size)
    r.call("meet_states", r.arguments[0])
    with _each(r, m, "struck") as (k, row, _):
        pulls = m.result("response")[row * m.size + row] * m.row("forces")[row]
        struck[k] = r.choose(rates[row] * rates[row] <= pulls * rounding[k] * 2.0, 1.0, 0.0)
    r.give(0)
    return r


def _settle() -> Routine:
    """Find the states that hold from now on."""
    r, m, (t,) = _open("settle_contacts", {"t": NUMBER})
    chosen, state, x, y = m.unit("chosen"), m.unit("next"), m.unit("next_x"), m.unit("next_y")
    some = r.variable(False, BOOLEAN)
    r.call("touching", r.arguments[0], result=INTEGER)
    r.call("barely_rising", r.arguments[0])
    with _each(r, m, "chosen") as (k, row, _):
        passes = (r.size(m.row("rates")[row]) > m.unit("slow")[k] * m.pace) & (m.unit("struck")[k] == 0.0)
        with r.when(passes | (m.unit("trigger")[k] == float(OPENS))):
            chosen[k] = 0.0
    _choose_slips(r, m)
    do_or_return(r, "read_contacts", t)
    r.copy(m.row("wanted"), m.result("free"), m.size)
    _going(r, m, some, repeated := r.variable(False, BOOLEAN))
    rests = r.variable(True, BOOLEAN)  # it starts, or has just come to touch or to rest: what can rest does
    with r.count(m.count) as k:
        trigger = m.unit("trigger")[k]
        rests.now = rests.now & (trigger != float(OPENS)) & (trigger != float(YIELDS))
    with r.when(some.now):
        r.give_if(r.call("find_states", r.arguments[0]) != 0, NO_SET)
        do_or_return(r, "determined")
        do_or_return(r, "share_forces", rests.now.integer())
    with r.when(repeated.now):
        _look_at_begins(r, m)
    with r.count(m.count) as k:
        off = (chosen[k] == 0.0) | (state[k] == float(OPEN))
        state[k] = r.choose(off, float(OPEN), state[k])
        is_still = off | (state[k] == float(STICKS))
        x[k], y[k] = r.choose(is_still, 0.0, x[k]), r.choose(is_still, 0.0, y[k])
    with r.count(m.count) as k, r.when(_is_loose(r, m, k)):
        state[k], x[k], y[k] = float(OPEN), 0.0, 0.0
    with r.count(m.count) as k:
        is_pair = m.unit("width")[k] == 2.0
        row, rates = r.truncated(m.unit("first")[k]), m.row("rates")
        size, is_back = _size_of_slip(r, row, is_pair, rates)[2], rates[row] * x[k] < 0.0
        begins = (state[k] == float(GOES_ON)) & (is_pair | is_back) & _is_still(r, m, k, size)
        chosen[k] = r.choose((state[k] == float(STICKS)) | begins, 1.0, 0.0)
    r.give(r.call("hold", r.arguments[0]))
    return r


def _check() -> Routine:
    """Refuse a gap that begins inside, or a freewheel that begins the way that is locked."""
    r, m, () = _open("check_inside")
    values, rates = m.result("values"), m.row("rates")
    with r.count(m.count) as k, r.when((m.unit("slip")[k] == 0.0) & (m.unit("state")[k] == float(OPEN))):
        row = r.truncated(m.unit("first")[k])
        is_speed = m.unit("speed")[k] != 0.0
        value, small = (
            r.choose(is_speed, rates[row], values[row]),
            r.choose(is_speed, m.unit("slow")[k], m.unit("small")[k]),
        )
        with r.when(value < 0.0 - small * m.inside):
            m.number = k
            r.give(INSIDE)
    r.give(0)
    return r


def _series() -> Routine:
    """Find in how long impacts that follow each other ever faster have come to an end; see `_Moment.left_of`."""
    r, m, (t,) = _open("series", {"t": NUMBER}, result=None)
    closing, past, response = r.variable(-1, INTEGER), m.past, m.result("response")
    m.stops = 0
    with r.count(m.count) as i:
        k = m.count - 1 - i
        is_one = (m.unit("trigger")[k] == float(CLOSES)) & (m.unit("speed")[k] == 0.0)
        closing.now = r.choose(is_one, k, closing.now)
    r.give_if((closing.now < 0) | (m.known < SPANS[0]))
    row, largest = r.truncated(m.unit("first")[closing.now]), r.variable(0.0)
    moved = response.at(row * m.size)
    with r.count(m.size) as j:
        largest.now = r.most(r.size(moved[j]), largest.now)
    spans, turn = r.array(LONG), r.variable(m.known, INTEGER)
    count, last, end, counts = r.variable(0, INTEGER), r.variable(t), r.variable(inf), r.variable(False, BOOLEAN)
    with r.forever() as loop:
        with r.when((turn.now == 0) | (count.now == LONG)):
            r.leave(loop)
        turn.now = turn.now - 1
        time, part = past[turn.now * 2], past[turn.now * 2 + 1]
        counts.now = False
        with r.count(m.count) as k, r.when(m.unit("part")[k] == part), _rows(r, m, k) as (_, i):
            counts.now = counts.now | (r.size(moved[i]) > largest.now * _MOVED)
        with r.when(~counts.now | (time == end.now)):
            r.repeat(loop)
        end.now = time
        span = last.now - time
        newer = spans[r.choose(count.now > 0, count.now - 1, 0, INTEGER)]
        with r.when((count.now > 0) & (span <= newer * LEVEL)):
            r.leave(loop)
        spans[count.now] = span
        count.now, last.now = count.now + 1, time
    r.give_if((count.now < SPANS[0]) | ~(spans[0] > 0.0))
    _end_series(r, m, spans, count.now, (t, closing.now, largest.now * _MOVED))
    with r.when(m.stops != 0):
        _mark_series(r, m, t)
    r.give()
    return r


def _mark_series(r: Routine, m: Sets, t: Value) -> None:
    """Mark the gaps that rest where impacts accumulate: those that close, are closed, or have impacts of it."""
    series, past, often = m.unit("series"), m.past, r.variable(0, INTEGER)
    with r.count(m.count) as k:
        often.now = 0
        with r.count(m.known) as i:
            is_one = (past[i * 2 + 1] == m.unit("part")[k]) & (past[i * 2] >= t - m.lasted)
            often.now = often.now + is_one.integer()
        closes = (m.unit("trigger")[k] == float(CLOSES)) & (m.unit("speed")[k] == 0.0)
        is_in = closes | (m.unit("state")[k] == float(STICKS)) | (often.now >= OFTEN)
        series[k] = r.choose((m.unit("slip")[k] == 0.0) & is_in, 1.0, 0.0)


def _end_series(r: Routine, m: Sets, spans: Value, number: Value, closing: tuple[Value, Value, Value]) -> None:
    """Stop what has a series of intervals, the last first, that ends soon.

    Impacts that only happen to be near each other are no series: each interval shrinks about as the one before.
    """
    cube, typical = spans[0] / spans[SPANS[0] - 1], r.variable(0.5)
    with r.count(60):  # the cube root: the mean factor of three intervals
        typical.now = typical.now - (typical.now - cube / (typical.now * typical.now)) * (1.0 / 3.0)
    even, long = r.variable(1, INTEGER), r.variable(1, INTEGER)
    with r.count(number, 1) as k:
        factor = spans[k - 1] / spans[k] / typical.now
        is_even, is_steady = ((factor <= by) & (factor * by >= 1.0) for by in (EVEN, STEADY))
        is_near = (even.now == k) & (k < SPANS[1])
        even.now = r.choose(is_near & is_even, k + 1, even.now)
        long.now = r.choose((long.now == k) & is_steady, k + 1, long.now)
    r.give_if(even.now < SPANS[0])
    oldest, share = spans[even.now - 1], r.variable(typical.now)
    ratio, power = spans[0] / oldest, r.variable(1.0)
    with r.count(60):  # the root of the factor from the oldest to the newest, by Newton's method
        power.now = 1.0
        with r.count(even.now - 2):
            power.now = power.now * share.now
        share.now = share.now - (share.now - ratio / power.now) / (even.now - 1).number()
    rest = r.choose(share.now < 1.0, spans[0] * share.now / (1.0 - share.now), inf)
    lasted = r.variable(0.0)
    with r.count(even.now) as k:
        lasted.now = lasted.now + spans[k]
    is_elastic, pull = _bouncing(r, m, lasted.now, *closing)
    r.give_if(is_elastic & ((share.now <= LEVEL) | (spans[0] > m.later * LOSSLESS)))
    speed = r.size(m.row("rates")[r.truncated(m.unit("first")[closing[1]])])
    is_squeezed = speed > pull * lasted.now
    restitution, blur = m.result("restitution")[r.truncated(m.unit("first")[closing[1]])], r.variable(0.0)
    lost = 1.0 - restitution
    with r.when((share.now > LEVEL) & ~is_squeezed & (lost > 0.0)):
        blur.now = r.call("gap_rounding", r.arguments[0], closing[0], closing[1], result=NUMBER)
    is_blurred = spans[0] * speed * lost < blur.now * BLURRED
    is_level = (share.now > LEVEL) & (spans[0] < m.later * SHORT) & ~is_squeezed | is_blurred
    left = r.choose(is_level, spans[0], rest)
    flattens = 1.0 - spans[0] / spans[1] < FLATTENS * (1.0 - share.now)
    is_steady = long.now >= r.choose(even.now < RECENT + 1, even.now, RECENT + 1, INTEGER)
    longest = r.choose(is_steady, r.choose(flattens, m.rough, m.ahead), m.later)
    is_closed = (rest < inf) & (spans[0] * speed < m.unit("small")[closing[1]] * SQUEEZED)
    stays = (left < inf) & (speed * share.now <= m.unit("slow")[closing[1]])  # it would rest untold
    with r.when(r.choose(is_squeezed, is_closed, (left < longest) | stays | is_blurred, BOOLEAN)):
        m.stops = r.choose(left > m.ahead * WAITS, 1, 2, INTEGER)
        m.ahead, m.blur, m.pace, m.lasted = left, NEAR_REST, NEAR_REST, lasted.now
        sum_ = _sum_of_series(r, spans, long.now)
        longer = r.most(2.0 / r.choose(lost > 0.0, lost, 1.0), float(LONG))
        most = r.choose(is_level, spans[0] * r.choose(is_elastic, 1.0, longer), left * 2.0)
        with r.when((sum_ >= 0.0) & (sum_ <= most)):
            m.ahead = sum_


def _gap_rounding() -> Routine:
    """Return by how much rounding of the coordinates moves a gap."""
    r, m, (t, k) = _open("gap_rounding", {"t": NUMBER, "unit": INTEGER}, NUMBER)
    y, total = m.y, r.variable(0.0)
    value = m.result("values")[r.truncated(m.unit("first")[k])]
    with r.count(m.coordinates) as i:
        kept = y[i]
        with r.when(kept != 0.0):
            y[i] = kept + kept * STEP
            code = r.call("read_contacts", r.arguments[0], t)
            there = m.result("values")[r.truncated(m.unit("first")[k])]
            total.now = total.now + r.choose(code == 0, r.size(there - value), 0.0)
            y[i] = kept
    r.call("read_contacts", r.arguments[0], t)
    r.give(r.most(total.now * (ROUNDED / STEP), m.unit("rounding")[k]))
    return r


def _bouncing(r: Routine, m: Sets, lasted: Value, t: Value, closes: Value, least: Value) -> tuple[Value, Value]:
    """Tell whether impacts of a series lose nothing, and how fast what they move falls, at most."""
    is_elastic, pull, bounces = r.variable(True, BOOLEAN), r.variable(0.0), r.variable(False, BOOLEAN)
    past, moved = m.past, m.result("response").at(r.truncated(m.unit("first")[closes]) * m.size)
    with r.count(m.count) as k, r.when(m.unit("slip")[k] == 0.0):
        row = r.truncated(m.unit("first")[k])
        bounces.now = k == closes
        with r.count(m.known) as i:
            is_one = (past[i * 2 + 1] == m.unit("part")[k]) & (past[i * 2] >= t - lasted)
            bounces.now = bounces.now | is_one
        with r.when(bounces.now & (r.size(moved[row]) > least)):
            is_elastic.now = is_elastic.now & (m.result("restitution")[row] >= 1.0)
            pull.now = r.most(r.size(m.result("free")[row]), pull.now)
    return is_elastic.now, pull.now


def _sum_of_series(r: Routine, spans: Value, count: Value) -> Value:
    """Return how long a series goes on; see `atwood.simulation.contacts.changes.sum_of_series`."""
    sums, since, best, nearest = r.array(LONG), r.variable(0.0), r.variable(inf), r.variable(inf)
    with r.count(count - 1) as k:
        span = spans[k]
        share = span / spans[k + 1]
        sums[k] = span * share / (1.0 - share) - since.now
        since.now = since.now + span
    with r.count(count - 3) as k:
        change, before = sums[k] - sums[k + 1], sums[k + 1] - sums[k + 2]
        bends = (change * before > 0.0) & (r.size(change) < r.size(before) * BEND)
        sums[k] = sums[k] + r.choose(bends, change * change / (before - change), 0.0)
    with r.when(count > 3):
        best.now = sums[0]
    with r.count(count - 5) as k:
        apart = r.most(r.size(sums[k] - sums[k + 1]), r.size(sums[k + 1] - sums[k + 2]))
        with r.when(apart < nearest.now):
            nearest.now, best.now = apart, sums[k]
    return best.now


def _resolve() -> Routine:
    """Find what becomes of gaps and slips at a moment: the speeds change, and the states after it are written."""
    r, m, (t, checks, sums) = _open("resolve", {"t": NUMBER, "checks": INTEGER, "sums": INTEGER}, exported=True)
    m.finite, m.blur, m.pace, m.logged, m.stops, m.shared = 1.0, 1.0, 1.0, 0, 0, 0
    do_or_return(r, "read_contacts", t)
    series, pressed = m.unit("series"), m.row("pressed")
    r.clear(series, series.at(m.count))
    r.clear(pressed, pressed.at(m.size))
    with r.when(sums != 0):
        r.call("series", r.arguments[0], t, result=None)
    with r.when(checks != 0):
        do_or_return(r, "check_inside")
    with r.when(m.stops != 0):
        r.call("stop", r.arguments[0])
    r.call("touching", r.arguments[0], result=INTEGER)
    r.copy(m.unit("closed"), m.unit("chosen"), m.count)
    with r.when(m.stops != 0):
        r.copy(m.unit("closed"), m.unit("stopped"), m.count)  # others may pass near by
    do_or_return(r, "collide")
    do_or_return(r, "settle_contacts", t)
    r.give(0)
    return r


def write_sets() -> list[Routine]:
    """Return the routines; they take the address of the memory of sets, and ``resolve`` is the one to be called."""
    sets = (_solve, _least, _equations, _moved, _met, _contradiction, _improved, _find, _direction, _determined)
    shares = (_relaxed, _share, _let_go, _weighted, _rank, _lawful)
    impacts = (_impulses, _strike, _account, _collide, _stop, _end_impacts, _series, _gap_rounding)
    moments = (_read, _push, _touch, _hold, _barely_rising, _settle, _check)
    return [_resolve(), *(write() for write in (*sets, *shares, *impacts, *moments))]
