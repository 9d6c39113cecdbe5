"""How near a motion is to a singular position at its looks, and just ahead of them, as machine code.

The measure is the smallest singular value of the slopes that are kept, each row in units of the most that it has
changed: by reflections to two diagonals (G. Golub and W. Kahan, *Calculating the singular values and pseudo-inverse of
a matrix*, SIAM J. Numer. Anal. 2, 1965), and by counting eigenvalues of the tridiagonal matrix with these two in turn
beside zeros (J. Demmel and W. Kahan, *Accurate singular values of bidiagonal matrices*, SIAM J. Sci. Stat. Comput. 11,
1990). Of many rows it is the length of the shortest displacement that changes all of them by about as much. What is
judged by it is what `atwood.simulation.singular.monitor` judges, which is asked only where there is something to find.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from typing import TypeAlias

from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    INTEGER,
    NUMBER,
    Lanes,
    Operand,
    Record,
    Routine,
    Value,
    call_kernel,
    place_of,
)

Opened: TypeAlias = Callable[[Value], tuple[dict[str, Value], Record, Record]]
"""Gives the arrays, the state and the sizes of a monitor from the address of its data."""

SMALL = 40
"""Up to so many rows singular values cost little."""

LOW, FALLEN = 0.28, 1e-2
"""Shares of the largest measure so far: a least one below the first is looked at more closely, and what has fallen
below the second at once, since the motion may stay there."""

AHEAD = -0.8, 1.6, 13
"""A position is looked for from so far behind to so far ahead of the last look, in strides between looks, at so many
points: what is just ahead lies between two of them."""

CLEAR, _BETWEEN, _BEHIND = 0.075, 5, 16
"""Nothing is found around the least of the looks where at places in so many parts of the ways to those beside it no
less than this share of the largest measure is left: places, and rest at one, are looked for below two thirds of it.
Behind a position that was passed it may also rise from place to place, which lie closer where it is small."""

HEADS = 2.0
"""It is looked ahead where the measure would be zero in so many strides at the rate at which it has fallen."""

COMES = 2
"""What is returned where nothing is to be found but a position just ahead, at the time `near`; else 1, or 0."""

UNEVEN = 0.5
"""By so large a share steps on both sides of a zero may differ."""

_ROUNDED, _NOTHING = 1e-16, 1e-290

_NEWTON, _NEAR = 16, 1e-9
"""So many steps at most lead from below, up to one so small that the next is rounding, relative to the square."""

_PLACES, _SECTIONS = 8, 20
"""At so many places eigenvalues are counted at once, so often at most: the last interval is as long as rounding."""


def write_measures(opened: Opened) -> list[Routine]:
    """Write what measures states, and what judges looks by it."""
    routines = (_measure, _measures, _between, _leaves, _is_clear, _judge, _heads)
    return [_smallest(), *(write(opened) for write in routines)]


def _smallest() -> Routine:
    """Write the smallest singular value of a matrix, row by row, that has no more rows than columns and is used up."""
    r = Routine("smallest", {"a": ADDRESS, "rows": INTEGER, "columns": INTEGER, "room": ADDRESS}, NUMBER)
    a, rows, columns, room = r.arguments
    squares, sums = room, room.at(rows * 2)
    total = r.variable(0.0)
    with r.count(rows * columns) as i:
        total.now = total.now + a[i]
    r.give_if(~r.is_finite(total.now), nan)
    with r.count(rows) as k:
        row, below = a.at(k * columns), a.at((k + 1) * columns + k)
        half, square = _reflect(r, row.at(k), columns - k, 1)
        squares[k * 2] = square
        with r.when(half > 0.0), r.count(rows, k + 1) as i:
            other, dot = a.at(i * columns), r.variable(0.0)
            with r.count(columns, k) as j:
                dot.now = dot.now + other[j] * row[j]
            share = dot.now / half
            with r.count(columns, k) as j:
                other[j] = other[j] - share * row[j]
        squares[k * 2 + 1] = 0.0
        with r.when(k + 1 < rows):
            half, square = _reflect(r, below, rows - k - 1, columns)
            squares[k * 2 + 1] = square
            with r.when(half > 0.0):
                r.clear(sums, sums.at(columns))
                with r.count(rows, k + 1) as i:
                    other = a.at(i * columns)
                    with r.count(columns, k + 1) as j:
                        sums[j] = sums[j] + other[k] * other[j]
                with r.count(rows, k + 1) as i:
                    other = a.at(i * columns)
                    share = other[k] / half
                    with r.count(columns, k + 1) as j:
                        other[j] = other[j] - share * sums[j]
    r.give(_least_of(r, squares, rows))
    return r


def _reflect(r: Routine, place: Value, count: Value, stride: Value | int) -> tuple[Value, Value]:
    """Make numbers in memory the vector that reflects them into their first place.

    Return half of its square, and the square of what is left there.
    """
    square = r.variable(0.0)
    with r.count(count) as i:
        one = place[i * stride]
        square.now = square.now + one * one
    first, length = place[0], r.sqrt(square.now)
    left = r.choose(first > 0.0, -1.0 * length, length)
    place[0] = first - left
    return square.now - first * left, square.now


def _from_below(r: Routine, squares: Value, rows: Value) -> Value:
    """Write what returns the smallest singular value where Newton's method finds it, else return what it is not below.

    From zero it comes nearer to the least eigenvalue and never beyond; the quotients of the shifted factors know small
    ones to rounding (I. Dhillon and B. Parlett, *Multiple representations to compute orthogonal eigenvectors of
    symmetric tridiagonal matrices*, Linear Algebra Appl. 387, 2004).
    """
    shift = r.variable(0.0)
    with r.count(_NEWTON):
        s, slope, total, least = r.variable(0.0 - shift.now), r.variable(-1.0), r.variable(0.0), r.variable(inf)
        with r.count(rows) as k:
            q = squares[k * 2]
            pivot = q + s.now
            share = squares[k * 2 + 1] / pivot
            least.now = r.least(pivot, least.now)
            total.now = total.now - slope.now / pivot
            slope.now, s.now = share * (q / pivot) * slope.now - 1.0, s.now * share - shift.now
        step = 1.0 / total.now
        with r.when((least.now > 0.0) & (step > 0.0)):
            shift.now = shift.now + step
            with r.when(step <= _NEAR * shift.now):
                r.give(r.sqrt(shift.now))
    return r.sqrt(shift.now) * (1.0 - 1e-9)


def _least_of(r: Routine, squares: Value, rows: Value) -> Value:
    """Write the smallest singular value from the squares of both diagonals in turn, by counts at several places."""
    low, high, before = r.variable(_from_below(r, squares, rows)), r.variable(inf), r.variable(0.0)
    with r.count(rows) as k:
        high.now = r.least(r.sqrt(squares[k * 2] + before.now), high.now)
        before.now = squares[k * 2 + 1]
    least, many = high.now * _ROUNDED, Lanes(_PLACES)
    ahead, places, counts = (r.array(_PLACES) for _ in range(3))
    for number in range(_PLACES):
        ahead[number] = (number + 1) / (_PLACES + 1)
    with r.count(_SECTIONS), r.when(high.now - low.now > least):
        begin, width = low.now, high.now - low.now
        at = begin + width * ahead.read(0, many)
        places.write(0, at)
        pivot, negative = r.variable(0.0 - at, many), r.variable(1.0, many)
        with r.count(rows * 2 - 1) as k:
            now = 0.0 - at - squares[k] / pivot.now
            now = r.choose(r.size(now) < _NOTHING, -_NOTHING, now)
            pivot.now, negative.now = now, negative.now + r.choose(now < 0.0, 1.0, 0.0)
        counts.write(0, negative.now)
        with r.count(_PLACES) as k:
            is_above = counts[k] > rows.number()
            low.now = r.choose(is_above, low.now, places[k])
            high.now = r.choose(is_above & (places[k] < high.now), places[k], high.now)
    return 0.5 * (low.now + high.now)


def _measure(opened: Opened) -> Routine:
    """Write the measure of coordinates at a time."""
    r = Routine("measure", {"t": NUMBER, "q": ADDRESS, "data": ADDRESS}, NUMBER, exported=True)
    t, q, given = r.arguments
    data, state, shape = opened(given)
    work, count = data["work"], data["kept"].read(0, INTEGER)
    _slopes(r, data, shape, t, q)
    with r.when(count == 0):
        r.give(1.0)
    with r.when(state.is_small != 0.0):
        columns = shape.speeds
        end = count * columns
        r.clear(work, work.at(end))
        with r.count(shape.slopes) as e:
            row, column = (data[name].read(e, INTEGER) for name in ("row", "column"))
            place = data["kept"].at(count + 1).read(row, INTEGER)
            with r.when(place >= 0):
                work[place * columns + column] = data["slopes"][e] / _unit(r, data, row)
        r.give(r.call("smallest", work, count, columns, work.at(end), result=NUMBER))
    write_products(r, data, shape)
    r.give(_displacement(r, data, shape, count))
    return r


def _slopes(r: Routine, data: dict[str, Value], shape: Record, t: Value, q: Value) -> None:
    """Write slopes along displacements of the sizes; speeds do not enter."""
    outputs = [data["values"], data["slopes"], data["drifts"]]
    call_kernel(r, shape.held, [place_of(r, t), q, data["sizes"]], data["derived"], data["scratch"], outputs)
    with r.count(shape.slopes) as e:
        data["slopes"][e] = data["slopes"][e] * data["sizes"][data["column"].read(e, INTEGER)]


def write_products(r: Routine, data: dict[str, Value], shape: Record) -> None:
    """Write ``G G^T`` from slopes."""
    slopes, matrix = data["slopes"], data["matrix"]
    r.clear(matrix, matrix.at(shape.conditions * shape.conditions))
    with r.count(shape.products) as p:
        one, other, target = (data[name].read(p, INTEGER) for name in ("one", "other", "product"))
        matrix[target] = matrix[target] + slopes[one] * slopes[other]


def _unit(r: Routine, data: dict[str, Value], row: Value) -> Value:
    unit = data["rows"][row]
    return r.choose(unit > 0.0, unit, 1.0)


def _displacement(r: Routine, data: dict[str, Value], shape: Record, count: Value) -> Value:
    """Write the measure of many rows, by elimination in ``G G^T``."""
    matrix, left, kept = data["matrix"], data["left"], data["kept"].at(1)
    size, length = r.variable(0.0), r.variable(0.0)
    with r.count(count) as a:
        row = kept.read(a, INTEGER)
        wanted = data["right"][row]
        left[row], size.now = wanted * _unit(r, data, row), size.now + wanted * wanted
    with r.count(count) as a:
        pivot = kept.read(a, INTEGER)
        own, known = matrix[pivot * shape.conditions + pivot], left[pivot]
        length.now = length.now + known * known / own
        with r.count(count, a + 1) as b:
            below = kept.read(b, INTEGER)
            row = matrix.at(below * shape.conditions)
            entry = row[pivot]
            with r.when(entry != 0.0):
                factor = entry / own
                left[below] = left[below] - factor * known
                with r.count(b + 1, a + 1) as c:
                    column = kept.read(c, INTEGER)
                    row[column] = row[column] - factor * matrix[column * shape.conditions + pivot]
    return r.sqrt(size.now / length.now)


def _measures(opened: Opened) -> Routine:
    """Write the measure of many states, one row of coordinates each; rows are learned from the first of them."""
    kinds = {"t": ADDRESS, "q": ADDRESS, "states": INTEGER, "known": INTEGER, "least": ADDRESS}
    r = Routine("measures", kinds | {"away": ADDRESS, "data": ADDRESS}, None, exported=True)
    t, q, states, known, least, away, given = r.arguments
    data, _, shape = opened(given)
    changes, rows = data["changes"], data["rows"]
    with r.count(known) as s:
        _slopes(r, data, shape, t[s], q.at(s * shape.coordinates))
        r.clear(changes, changes.at(shape.conditions))
        with r.count(shape.slopes) as e:
            row = data["row"].read(e, INTEGER)
            changes[row] = r.most(r.size(data["slopes"][e]), changes[row])
        with r.count(shape.conditions) as i:
            change = r.most(changes[i], least[i])
            rows[i] = r.most(r.choose(change > 0.0, change, 1.0), rows[i])
    with r.count(states) as s:
        away[s] = r.call("measure", t[s], q.at(s * shape.coordinates), given, result=NUMBER)
    return r


def _judge(opened: Opened) -> Routine:
    """Write the function that tells whether there is something to find at the looks noted, or just ahead of them.

    At an end the last look is judged as well, and nothing is ahead. What has no measure is to be looked at.
    """
    r = Routine("judge", {"data": ADDRESS, "at_end": INTEGER}, exported=True)
    given, at_end = r.arguments
    data, state, shape = opened(given)
    count, notes, best = r.truncated(state.count), data["notes"], data["best"]
    largest = r.variable(r.most(r.call("measure", best[0], best.at(1), given, result=NUMBER), state.largest))
    with r.count(count) as i:
        note = notes.at(i * shape.note)
        with r.when(note[shape.measured] < 0.0):
            note[shape.measured] = r.call("measure", note[0], note.at(1), given, result=NUMBER)
        away = note[shape.measured]
        r.give_if(~r.is_finite(away), 1)
        largest.now = r.most(away, largest.now)
    state.largest = largest.now
    asks, last = r.variable(0, BOOLEAN), count - 1 + at_end
    with r.count(last) as i:
        note = notes.at(i * shape.note)
        before, behind = r.variable(inf), r.variable(inf)
        with r.when(i > 0):
            before.now = notes[(i - 1) * shape.note + shape.measured]
        with r.when(i + 1 < count):
            behind.now = notes[(i + 1) * shape.note + shape.measured]
        away, fallen = note[shape.measured], largest.now * FALLEN
        is_least = away <= r.least(r.least(before.now, behind.now), largest.now * LOW)
        with r.when(is_least & (i + 1 < count)):
            clear = r.call("is_clear", given, i, largest.now)
            behind.now = r.choose(clear != 0, -inf, behind.now)
        is_least = is_least & (away <= behind.now)
        falls = (away <= fallen) & (fallen < before.now) & (before.now < inf)
        asks.now = asks.now | ((note[0] > state.judged) & (is_least | falls))
    r.give_if(asks.now, 1)
    with r.when(last > 0):
        state.judged = notes[(last - 1) * shape.note]
    r.give_if(at_end != 0, 0)
    _look_ahead(r, (data, state, given), shape, notes.at((count - 1) * shape.note))
    r.give(0)
    return r


def _between(opened: Opened) -> Routine:
    """Return the least measure from a look to the next one, on the cubic through both with their rates."""
    r = Routine("between", {"data": ADDRESS, "first": INTEGER}, NUMBER)
    given, first = r.arguments
    data, _, shape = opened(given)
    one, least = data["notes"].at(first * shape.note), r.variable(inf)
    with r.count(_BETWEEN, 1) as k:
        away = _on_way(r, (given, data, shape), one, k.number() / _BETWEEN)
        least.now = r.choose(away >= least.now, least.now, away)
    r.give(least.now)
    return r


def _on_way(r: Routine, of: tuple[Value, dict[str, Value], Record], one: Value, s: Value) -> Value:
    """Return the measure at a share of the way from a look to the next one, on the cubic through both."""
    (given, data, shape), other = of, one.at(of[2].note)
    h, q = other[0] - one[0], data["ahead"]
    write_cubic(r, q, (one.at(1), other.at(1)), (shape.size, shape.coordinates), (h, s))
    return r.call("measure", one[0] + s * h, q, given, result=NUMBER)


def _leaves(opened: Opened) -> Routine:
    """Write the function that tells whether the motion leaves a place that it has passed just before the first look."""
    r = Routine("leaves", {"data": ADDRESS, "limit": NUMBER})
    given, limit = r.arguments
    data, _, shape = opened(given)
    one = data["notes"]
    before = r.variable(one[shape.measured])
    with r.count(_BEHIND + 1, 1) as k:
        share = k.number() / _BEHIND
        away = _on_way(r, (given, data, shape), one, share * share)
        r.give_if(~((away > before.now) | (away > limit)), 0)
        before.now = away
    r.give(1)
    return r


def _is_clear(opened: Opened) -> Routine:
    """Write the function that tells whether nobody would find anything around the least of the looks; see `CLEAR`.

    Before it, or at it, the motion must not head for a position that it would come to before the next look, either.
    """
    r = Routine("is_clear", {"data": ADDRESS, "least": INTEGER, "largest": NUMBER})
    given, least, largest = r.arguments
    data, state, shape = opened(given)
    end, limit = data["notes"][(least + 1) * shape.note], largest * CLEAR
    note = data["notes"].at(least * shape.note)
    with r.when((note[0] == state.behind) & ~(note[shape.measured] > limit)):
        r.give(r.call("leaves", given, limit))
    for back in (0, 1):
        with r.when(least > back):
            one, other = (data["notes"].at((least - back - k) * shape.note) for k in (1, 0))
            before, away = one[shape.measured], other[shape.measured]
            there = other[0] + (other[0] - one[0]) * away / (before - away)
            r.give_if((away < before) & (there <= end), 0)
    r.give_if(~(note[shape.measured] > limit), 0)
    for back in (0, 1):
        with r.when(least >= back):
            r.give_if(~(r.call("between", given, least - back, result=NUMBER) > limit), 0)
    r.give(1)
    return r


def write_cubic(
    r: Routine, target: Value, ends: tuple[Value, Value], of: tuple[Operand, Operand], at: tuple[Value, Value]
) -> None:
    """Write the cubic through two noted states with their rates, which lie so far behind these: so many numbers.

    `at` are the time between both, and the share of it.
    """
    (one, other), (rates, count), (h, s) = ends, of, at
    with r.count(count) as j:
        a, b, v, w = one[j], other[j], one[j + rates] * h, other[j + rates] * h
        rise = b - a
        target[j] = a + s * (v + s * (3.0 * rise - 2.0 * v - w + s * (v + w - 2.0 * rise)))


def _heads(opened: Opened) -> Routine:
    """Write the function that tells whether the measure falls as towards a position that is soon there."""
    r = Routine("heads", {"data": ADDRESS})
    given = r.arguments[0]
    data, state, shape = opened(given)
    count = r.truncated(state.count)
    r.give_if(count < 2, 0)
    one, other = (data["notes"].at((count - k) * shape.note) for k in (2, 1))
    for note in (one, other):
        with r.when(note[shape.measured] < 0.0):
            note[shape.measured] = r.call("measure", note[0], note.at(1), given, result=NUMBER)
    before, away = one[shape.measured], other[shape.measured]
    fall = (before - away) * (HEADS * state.stride / (other[0] - one[0]))
    r.give(((fall > 0.0) & (away <= fall)).code())
    return r


def _look_ahead(r: Routine, of: tuple[dict[str, Value], Record, Value], shape: Record, note: Value) -> None:
    """Write what tells whether the measure falls to zero at an even rate just ahead of a look, and rises again."""
    data, state, given = of
    begin, end, points = AHEAD
    stride, now, rates = state.stride, note[0], note.at(shape.size + shape.coordinates + 1)
    r.give_if(~((stride < inf) & (note[shape.measured] > 0.0)), 0)
    q, away, least = data["ahead"], r.array(points), r.variable(0, INTEGER)
    with r.count(points) as k:
        later = stride * (begin + k.number() * ((end - begin) / (points - 1)))
        with r.count(shape.coordinates) as i:
            q[i] = note[1 + i] + (note[shape.coordinates + (1 + i)] + 0.5 * rates[i] * later) * later
        t = r.least(r.most(now + later, state.start), state.start + state.whole)
        away[k] = r.call("measure", t, q, given, result=NUMBER)
        r.give_if(~r.is_finite(away[k]), 1)
        with r.when((state.passes != 0.0) & (now + later < state.start)):
            away[k] = inf  # what has been passed just now is not ahead
        with r.when(away[k] < away[least.now]):
            least.now = k
    r.give_if((least.now == 0) | (least.now == points - 1), 0)
    one, here, other = (away[least.now + k] for k in (-1, 0, 1))
    higher, lower = r.most(one, other), r.least(one, other)
    uneven = r.size((higher - here) - (here + lower))
    r.give_if(~(uneven < UNEVEN * (higher - here)), 0)
    share = r.choose(one > other, here, 0.0 - here) / (here + lower)
    state.near = now + stride * (begin + (least.now.number() + share) * ((end - begin) / (points - 1)))
    r.give(COMES)
