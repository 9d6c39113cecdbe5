"""Routines for shares of forces that nothing determines.

That rest has a share is seen from the least forces alone, with ever more of what holds let go: `holds` lists what has
to stay, and `gone` which of it is let go.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt

from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Routine, Value, Variable
from atwood.integrators.event_routines import do_or_return
from atwood.integrators.sets.record import (
    NO_SET,
    UNDETERMINED,
    Sets,
    copy_states,
    each_row,
    each_unit,
    is_loose,
    limit_of,
    norm,
    open_routine,
    product_of,
    size_of_slip,
    small_motion,
)
from atwood.integrators.sets.sizes import SHARED
from atwood.numerics.contact_sets import CLEAR, FIRM, GOES_ON, NOTHING, OPEN, SLACK, STICKS

MOST_SHARES = 500
"""So many shares of forces that nothing determines are tried."""


def _direction() -> Routine:
    """Take the longest of some rows as a direction of size one, and what is along it from all; 1 where none is left."""
    r, m, (rows, count, target, least) = open_routine(
        "take_direction", {"rows": INTEGER, "count": INTEGER, "target": ADDRESS, "least": NUMBER}
    )
    matrix, size, best, largest = m.matrix, m.size, r.variable(0, INTEGER), r.variable(0.0)
    with r.count(rows) as i:
        length = r.sqrt(product_of(r, count, matrix.at(i * size), matrix.at(i * size)))
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
        share = product_of(r, count, row, direction)
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
    r, m, () = open_routine("determined")
    r.give_if(m.repeats == 0, 0)
    place, matrix, size, acting, every = r.arguments[0], m.matrix, m.size, m.row("acting"), m.row("solution")
    response, top, largest, known = m.result("response"), r.variable(0.0), r.variable(0.0), r.variable(0, INTEGER)
    count, left, stride = r.call("contact_equations", place, result=INTEGER), m.left, size + 1
    r.clear(every, every.at(size))
    with each_unit(r, m, "chosen") as (k, _, _), each_row(r, m, k) as (_, i):
        top.now = r.most(_alike(m, k, i), top.now)
    with each_unit(r, m, "chosen") as (k, _, _), each_row(r, m, k) as (_, i):
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
    with each_unit(r, m, "acts") as (k, row, _), r.when(m.unit("slip")[k] == 0.0):
        share = way[r.truncated(m.row("slot")[row])]
        with r.when(~(forces[row] > most.now * SLACK)):
            more.now, less.now = more.now & (share >= -CLEAR), less.now & (share <= CLEAR)
        with r.when(r.size(share) > sqrt(CLEAR)):
            owner = m.unit("owner")[k]
            first.now, last.now = r.least(owner, first.now), r.most(owner, last.now)
    return (more.now | less.now) & (first.now < last.now)


def _share() -> Routine:
    """Let all rest, or let go what need not hold, where nothing determines forces; see `find_states` and `_shared`.

    Where `misses` says that no set was found, rest may be one all the same.
    """
    r, m, (rests, misses) = open_routine("share_forces", {"rests": INTEGER, "misses": INTEGER})
    place, state, repeats = r.arguments[0], m.unit("next"), r.variable(m.repeats, INTEGER)
    small = small_motion(r, m)
    goes, moves = r.variable(False, BOOLEAN), r.variable(False, BOOLEAN)
    with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(m.unit("given")[k] == 0.0):
        is_moved = size_of_slip(r, row, is_pair, m.row("motions"))[2] > small
        goes.now, moves.now = goes.now | (state[k] != float(STICKS)), moves.now | is_moved
    tries = r.variable((goes.now & (rests != 0)) | (misses != 0), BOOLEAN)
    r.give_if(~tries.now & (repeats.now == 0), 0)
    copy_states(r, m, "found", "next")
    with r.when(tries.now):
        with each_unit(r, m, "chosen") as (k, _, _), r.when(m.unit("given")[k] == 0.0):
            state[k], m.unit("next_x")[k], m.unit("next_y")[k] = float(STICKS), 0.0, 0.0
        r.call("meet_states", place)
        tries.now = m.repeats != 0
        with r.when(tries.now), r.when(r.call("determined", place) == 0):
            m.shared = 1
            r.give_if(r.call("let_go", place) == 0, 0)
        r.give_if(misses != 0, NO_SET)
        copy_states(r, m, "next", "found")
        r.call("meet_states", place)
    r.give_if(repeats.now == 0, 0)
    do_or_return(r, "determined")
    with r.when(tries.now & ~moves.now):  # friction that is at its limit may say how the load is shared
        n = r.variable(0, INTEGER)
        _list(r, m, n, lambda k: m.unit("given")[k] == 0.0)
        r.call("weighted_forces", place)
        r.give_if(r.call("is_lawful", place, n.now) == 0, 0)
    with (
        each_unit(r, m, "chosen") as (k, row, is_pair),
        r.when((m.unit("given")[k] == 0.0) & (state[k] == float(GOES_ON))),
    ):
        is_moved = size_of_slip(r, row, is_pair, m.row("motions"))[2] > small
        state[k] = r.choose(is_moved, float(GOES_ON), float(STICKS))
    r.give(r.call("let_go", place) * UNDETERMINED)
    return r


def _list(r: Routine, m: Sets, n: Variable, is_one: Callable[[Value], Value]) -> None:
    """Add chosen units to those that hold, and count them."""
    with each_unit(r, m, "chosen") as (k, _, _), r.when(is_one(k)):
        m.unit("holds")[n.now] = k.number()
        n.now = n.now + 1


def _let_go() -> Routine:
    """Let go ever more of what holds until least forces contradict no law, slips first; 1 where none do."""
    r, m, () = open_routine("let_go")
    place, state, holds, gone = r.arguments[0], m.unit("next"), m.unit("holds"), m.unit("gone")
    n, many, tried, last = (r.variable(0, INTEGER) for _ in range(4))
    top, most = r.variable(0.0), r.variable(0.0)
    with r.count(m.count) as k, each_row(r, m, k) as (_, i):
        top.now = r.most(_alike(m, k, i), top.now)
    with each_unit(r, m, "chosen") as (k, _, _), r.when((m.unit("slip")[k] == 1.0) & (state[k] == float(STICKS))):
        most.now = 0.0
        with each_row(r, m, k) as (_, i):
            most.now = r.most(_alike(m, k, i), most.now)
        state[k] = r.choose(most.now > top.now * NOTHING, float(STICKS), float(OPEN))  # joints hold it
    _list(r, m, n, lambda k: (m.unit("slip")[k] == 1.0) & (state[k] == float(STICKS)) & ~is_loose(r, m, k))
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
    r, m, () = open_routine("weighted_forces")
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
        motions[i] = m.row("wanted")[i] + product_of(r, size, response.at(i * size), forces)
    r.give(0)
    return r


def _rank() -> Routine:
    """Return how many rows of what sticks are independent."""
    r, m, (least,) = open_routine("rank_of_rows", {"least": NUMBER}, result=INTEGER)
    acting, response, size, n = m.row("acting"), m.result("response"), m.size, r.variable(0, INTEGER)
    top, known, alike = r.variable(0.0), r.variable(0, INTEGER), m.row("solution")
    with each_unit(r, m, "chosen") as (k, _, _):
        sticks = (m.unit("next")[k] == float(STICKS)) & ~is_loose(r, m, k)
        with r.when(sticks), each_row(r, m, k) as (_, row):
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
    """Tell whether forces hold what is listed, within the limits of what sticks, and move nothing else against a law.

    It is 1 where they do not.
    """
    r, m, (n,) = open_routine("is_lawful", {"n": INTEGER})
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
        a, _, force = size_of_slip(r, row, is_pair, forces)
        back = (~is_pair & is_slip & (a > 0.0)).integer() * 2
        static = limit_of(r, m, k, back + 1)
        over = r.choose(is_slip, force - static, 0.0 - static - a)
        sticks = (m.unit("next")[k] == float(STICKS)) & ~is_loose(r, m, k)
        moved = size_of_slip(r, row, is_pair, motions)[2]
        is_beyond = sticks & (over > most.now * (SHARED * SLACK)) & (m.tried == 0)
        r.give_if((moved > moves.now * (SHARED * SLACK)) | is_beyond, 1)
    with each_unit(r, m, "chosen") as (k, row, is_pair):  # no gap closes, and what begins to slip goes its way
        a, b, _ = size_of_slip(r, row, is_pair, motions)
        x, y, begins = m.unit("next_x")[k], m.unit("next_y")[k], m.unit("given")[k] == 0.0
        along = r.most(a * x + b * y, 0.0)
        closes, astray = 0.0 - a, norm(r, a - along * x, b - along * y)
        goes = begins & (m.unit("next")[k] == float(GOES_ON)) & ~is_loose(r, m, k)
        beyond = r.choose(m.unit("slip")[k] == 0.0, closes, r.choose(goes, astray, 0.0))
        r.give_if(beyond > moves.now * (SHARED * SLACK), 1)
    with r.when(m.tried > 1):
        m.tried = m.tried - 1
        r.give(1)
    m.tried = 0
    r.give(0)
    return r


SHARES = (_direction, _determined, _share, _let_go, _weighted, _rank, _lawful)
