"""The way over a singular position that is just ahead, as machine code: found, judged and passed within a run's steps.

It is what `atwood.simulation.singular.branches` does for a position ahead: an arc from a look well before it, laid so
that the position is in its middle, the measure along it, and what tells a position that is passed from one that is not.
Where anything is in doubt nothing is done, and whoever called is asked as if nothing had been tried.
"""

from __future__ import annotations

import ctypes
from math import inf, nan
from typing import Any

import numpy as np

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Kind, Record, Routine, Value
from atwood.codegen.sundials.rank_looks import COMES, write_cubic
from atwood.codegen.sundials.step_monitor import opened, restart_looks
from atwood.integrators.protocol import CROSSED
from atwood.simulation.singular.arc_routine import ARC, SWEPT, misses, write_sweeps

REACH = 0.2
"""An arc begins so far before the place, in what moves most, if it can."""

CENTRED = 0.06
"""So far from its middle an arc may pass the place, relative to half its length; its points keep twice that away."""

BEYOND = 2.5
"""The motion is guessed so far behind the last look, in strides."""

NARROWER = 0.3
"""A place is looked for once more in so large a share of an arc, where nothing else bends the measure."""

CLOSE = 0.1
"""Where less than this share of the largest measure is left behind a place, another one is perhaps just ahead."""

_LONGEST, _SHORTEST, _SAFELY = 0.5, 0.25, 0.1
"""Where an arc over the place is not accurate, another one before it leads to so large a share of the way: about what
makes the error of the next so much smaller than it may be, as the twelfth power of the length."""

_TRIES = 8
"""So often an arc is laid anew around the place."""

_ROOT_STEPS, _ROOTED = 60, 1e-15
"""So many steps of false position at most, and how long the last interval is: rounding of numbers of size one."""

POINTS = 12
"""Points of Gauss and Legendre of an arc."""

WAY: dict[str, Kind] = {
    **dict.fromkeys(("arc", "look", "measure", "judge", "monitor", "points", "series", "behind", "log"), ADDRESS),
    **dict.fromkeys(("count", "capacity"), INTEGER),
    **dict.fromkeys(("accurate", "slow", "singular", "fits", "until", "start", "far"), NUMBER),
}
"""What a way is found with: an arc, functions of the monitor and its data, points and what gives coefficients from
values at them, where a state behind the place is written, behind the times of begin and end, what was passed, how many
of these and how many have room, and what decides; until when. The start of an arc, and how far it is from the place at
its ends, are noted on the way."""

PASSED = ("time", "start", "end", "error", "away")
"""What is kept of each place that was passed, before the sizes of conditions, and coefficients of the arc."""


@once
def singular_routines() -> Built:
    """Return sweeps of arcs, and what passes singular positions, as machine code."""
    files = (
        *("simulation/singular/arc_routine.py", "integrators/protocol.py"),
        *(f"codegen/sundials/{name}.py" for name in ("step_monitor", "rank_looks")),
    )
    source = RoutineSource("simulation.singular.crossing_routine", files)
    return build_code([], CodeOptions(level=2), exports=["settle", "sign_change", "watch"], routines=source)


_SIGN_CHANGE = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 3)


def sign_change(away: np.ndarray[Any, Any], x: np.ndarray[Any, Any], series: np.ndarray[Any, Any]) -> float | None:
    """Return where a measure at the points falls to zero to rise again; None if it does not."""
    function: Any = _SIGN_CHANGE(singular_routines().code.addresses["sign_change"])
    found = float(function(*(one.ctypes.data for one in (np.ascontiguousarray(away), x, series))))
    return None if np.isnan(found) else found


def write_routines() -> list[Routine]:
    """Write sweeps, and what passes a singular position."""
    solved = (_series, _sign_change, _root, _state, _guess, _closest, _lay, _keep, _around, _cross, _watch)
    return [*write_sweeps(), *(write() for write in solved)]


def _series() -> Routine:
    """Return the value of a series of Legendre polynomials whose coefficients are so far apart (C. Clenshaw)."""
    r = Routine("series", {"at": ADDRESS, "stride": INTEGER, "count": INTEGER, "x": NUMBER}, NUMBER)
    at, stride, count, x = r.arguments
    value, after = r.variable(0.0), r.variable(0.0)
    with r.count(count - 1) as i:
        k = count - 1 - i
        n = k.number()
        now = at[k * stride] + (2.0 * n + 1.0) * x * value.now / (n + 1.0) - (n + 1.0) / (n + 2.0) * after.now
        after.now, value.now = value.now, now
    r.give(at[0] + x * value.now - 0.5 * after.now)
    return r


def _sign_change() -> Routine:
    """Return where a measure at the points falls to zero to rise again; nan if it does not.

    What falls to zero and rises again is smooth if its sign changes there: the right one of two places for that is the
    one with which coefficients die away.
    """
    r = Routine("sign_change", dict.fromkeys(("away", "points", "series"), ADDRESS), NUMBER, exported=True)
    away, x, series = r.arguments
    least, total, smoothest, found = r.variable(0, INTEGER), r.variable(0.0), r.variable(inf), r.variable(nan)
    with r.count(POINTS) as i:
        total.now = total.now + away[i]
        with r.when(away[i] < away[least.now]):
            least.now = i
    with r.when((least.now == 0) | (least.now == POINTS - 1) | ~r.is_finite(total.now)):
        r.give(nan)
    coefficients = r.array(POINTS)
    with r.count(least.now + 2, least.now) as first:
        with r.count(POINTS) as k:
            total.now = 0.0
            with r.count(POINTS) as i:
                total.now = total.now + series[k * POINTS + i] * r.choose(i < first, 0.0 - away[i], away[i])
            coefficients[k] = total.now
        tail = r.size(coefficients[POINTS - 2]) + r.size(coefficients[POINTS - 1])
        with r.when(tail < smoothest.now):
            smoothest.now = tail
            found.now = r.call("root", coefficients, x[first - 1], x[first], result=NUMBER)
    r.give(found.now)
    return r


def _root() -> Routine:
    """Return where a series is zero between two places of which it has the signs - and +.

    By false position, the end that stays being given half its weight (M. Dowell and P. Jarratt, *A modified regula
    falsi method*, BIT 11, 1971).
    """
    r = Routine("root", {"series": ADDRESS, "below": NUMBER, "above": NUMBER}, NUMBER)
    series, *ends = r.arguments
    below, above = (r.variable(one) for one in ends)

    def value(x: Value) -> Value:
        return r.call("series", series, r.value(1, INTEGER), r.value(POINTS, INTEGER), x, result=NUMBER)

    low, high, last = r.variable(value(ends[0])), r.variable(value(ends[1])), r.variable(0.0)
    x = r.variable(ends[0])
    with r.count(_ROOT_STEPS):
        with r.when(~(above.now - below.now > _ROOTED)):
            r.give(x.now)
        a, b, p, q = below.now, above.now, low.now, high.now
        x.now = r.choose((p < 0.0) & (q > 0.0), (a * q - b * p) / (q - p), 0.5 * (a + b))
        now = value(x.now)
        with r.when(now == 0.0):
            r.give(x.now)
        with r.when(now < 0.0):
            below.now, low.now, high.now = x.now, now, r.choose(last.now < 0.0, 0.5 * q, q)
        with r.otherwise():
            above.now, high.now, low.now = x.now, now, r.choose(last.now > 0.0, 0.5 * p, p)
        last.now = now
    r.give(x.now)
    return r


def _state() -> Routine:
    """Write the state of an arc at a place from -1 to 1."""
    r = Routine("state", {"arc": ADDRESS, "x": NUMBER, "target": ADDRESS}, None)
    arc, x, target = r.arguments
    m = Record(arc, ARC)
    with r.count(m.unknowns) as j:
        target[j] = r.call("series", m.integrated.at(j), m.unknowns, m.points + 1, x, result=NUMBER)
    return r


def _open(given: Value) -> tuple[Record, Record, dict[str, Value], Record, Record]:
    """Return the way, its arc, and the arrays, the state and the sizes of the monitor."""
    way = Record(given, WAY)
    return way, Record(way.arc, ARC), *opened(way.monitor)


def _guess() -> Routine:
    """Write states at the points of an arc from what was noted around them, or the first one where that is too little.

    Between two looks it is the cubic through both with their rates.
    """
    r = Routine("guess", {"data": ADDRESS})
    _, arc, data, monitor, shape = _open(r.arguments[0])
    notes, width, count = data["notes"], arc.unknowns, r.truncated(monitor.count)
    last, times, is_known = notes.at((count - 1) * shape.note), arc.times, r.variable(0, BOOLEAN)
    with r.when(count > 1):
        before = notes[(count - 2) * shape.note]
        is_near = times[POINTS - 1] <= last[0] + BEYOND * (last[0] - before)
        is_known.now = (notes[0] <= times[0]) & is_near
    with r.count(POINTS) as i:
        state, after = arc.states.at(i * width), r.variable(1, INTEGER)
        r.copy(state, arc.first, width)
        with r.when(is_known.now):
            with r.count(count - 1, 1) as k:
                after.now = r.choose(notes[k * shape.note] < times[i], k + 1, after.now)
            other = notes.at(after.now * shape.note)
            one = notes.at((after.now - 1) * shape.note)
            h = other[0] - one[0]
            s = (times[i] - one[0]) / h
            write_cubic(r, state, (one.at(1), other.at(1)), (width, width), (h, s))
    r.give(0)
    return r


def _closest() -> Routine:
    """Return when an arc passes closest to a singular position, nan if never; see to how far away it is at its ends."""
    r = Routine("closest", {"data": ADDRESS}, NUMBER)
    given = r.arguments[0]
    way, arc, _, _, _ = _open(given)
    away, state, start = r.array(POINTS), arc.held, way.start
    middle, half = r.variable(0.0), r.variable(NARROWER)  # in halves of the arc
    with r.count(3) as k:  # where it is laid to be, or in the whole and once more near by
        with r.count(POINTS) as i:
            x = middle.now + half.now * way.points[i]
            r.call("state", way.arc, x, state, result=None)
            away[i] = r.call(way.measure, start + arc.half * (x + 1.0), state, way.monitor, result=NUMBER)
        root = r.call("sign_change", away, way.points, way.series, result=NUMBER)
        is_there, is_near = r.is_finite(root), half.now < 1.0
        with r.when(is_near & is_there):
            way.far = r.most(away[0], away[POINTS - 1])
            r.give(start + arc.half * (middle.now + half.now * root + 1.0))
        with r.when(~is_there & (k > 0)):
            r.give(nan)
        middle.now, half.now = r.choose(is_near, 0.0, root), r.choose(is_near, 1.0, NARROWER)
    r.give(nan)
    return r


def _lay() -> Routine:
    """Find the arc from the start to a time; whether there is none, or none that is accurate."""
    r = Routine("lay", {"data": ADDRESS, "end": NUMBER})
    given, end = r.arguments
    way, arc, _, _, _ = _open(given)
    arc.half, arc.error = 0.5 * (end - way.start), 0.0
    with r.count(POINTS) as i:
        arc.times[i] = way.start + arc.half * (way.points[i] + 1.0)
    with r.count(POINTS, 1) as i, r.when(~(arc.times[i] > arc.times[i - 1])):
        r.give(1)
    r.call("guess", given)
    r.give_if(r.call("settle", way.arc) != SWEPT, 1)
    r.give((~(arc.error < way.accurate)).code())
    return r


def _keep() -> Routine:
    """Keep an arc with the time of the place that it passes, nan for none; 1 where there is no room."""
    r = Routine("keep", {"data": ADDRESS, "time": NUMBER})
    given, time = r.arguments
    way, arc, data, _, shape = _open(given)
    numbers = (POINTS + 1) * arc.unknowns
    entry = way.log.at(way.count * (shape.conditions + numbers + len(PASSED)))
    r.give_if(way.count >= way.capacity, 1)
    for k, one in enumerate((time, way.start, way.start + 2.0 * arc.half, arc.error, way.far)):
        entry[k] = one
    r.copy(entry.at(len(PASSED)), data["rows"], shape.conditions)
    r.copy(entry.at(shape.conditions + len(PASSED)), arc.integrated, numbers)
    way.count = way.count + 1
    r.give(0)
    return r


def _around() -> Routine:
    """Lay an arc around the place, perhaps behind others, and return when it passes that; nan where there is none."""
    r = Routine("around", {"data": ADDRESS}, NUMBER)
    given = r.arguments[0]
    way, arc, _, monitor, _ = _open(given)
    near = r.variable(monitor.near)
    with r.count(_TRIES):
        with r.when(r.call("lay", given, 2.0 * near.now - way.start) != 0):  # perhaps half of the way is not too long
            whole, share = near.now - way.start, r.variable(_LONGEST)
            with r.forever() as shares:
                third = share.now * share.now * share.now
                left = third * third * (third * third)
                is_short = ~(arc.error * left > _SAFELY * way.accurate)
                with r.when(is_short | (share.now <= _SHORTEST)):
                    r.leave(shares)
                share.now = 0.9 * share.now
            end = way.start + whole * r.least(1.0 - share.now, 2.0 * share.now)
            with r.when(r.call("lay", given, end) != 0):
                r.give(nan)
            with r.when(r.call("keep", given, nan) != 0):
                r.give(nan)
            r.call("state", way.arc, 1.0, arc.first, result=None)
            way.start = end
            with r.when(misses(r, arc, end, arc.first, arc.unknowns)):
                r.give(nan)
        with r.otherwise():
            now = r.call("closest", given, result=NUMBER)
            with r.when(~(now > way.start)):
                r.give(nan)
            with r.when(~(r.size(now - near.now) > CENTRED * (near.now - way.start))):
                r.give(now)
            near.now = now
    r.give(nan)
    return r


def _fastest(r: Routine, data: dict[str, Value], arc: Record, state: Value) -> Value:
    """Return the largest speed of a state, in units of the scene's sizes."""
    n, fastest = arc.coordinates, r.variable(0.0)
    with r.count(arc.unknowns - n) as j:
        fastest.now = r.most(r.size(state[n + j]) / data["sizes"][j], fastest.now)
    return fastest.now


def _cross() -> Routine:
    """Find the way over the singular position that a look has found ahead, and keep it; 1 where there is none."""
    r = Routine("cross", {"data": ADDRESS})
    given = r.arguments[0]
    way, arc, data, monitor, shape = _open(given)
    width, state = arc.unknowns, arc.held
    fastest, begin = r.variable(0.0), r.variable(data["notes"], ADDRESS)
    with r.count(r.truncated(monitor.count)) as i:
        note = data["notes"].at(i * shape.note)
        speed = _fastest(r, data, arc, note.at(1))
        fastest.now = r.most(speed, fastest.now)
        begin.now = r.choose(speed * (monitor.near - note[0]) >= REACH, note, begin.now)
    way.start = begin.now[0]
    r.copy(arc.first, begin.now.at(1), width)
    r.give_if(~(way.start < monitor.near) | misses(r, arc, way.start, arc.first, width), 1)
    now = r.call("around", given, result=NUMBER)
    r.give_if(~r.is_finite(now), 1)
    end = way.start + 2.0 * arc.half
    r.call("state", way.arc, (now - way.start) / arc.half - 1.0, state, result=None)
    speed = _fastest(r, data, arc, state)
    for x in (-1.0, 1.0):
        r.call("state", way.arc, x, arc.later, result=None)
        fastest.now = r.most(_fastest(r, data, arc, arc.later), fastest.now)
    is_slow = ~(speed * speed >= way.slow * fastest.now * fastest.now)
    left = r.call(way.measure, now, state, way.monitor, result=NUMBER)
    r.give_if(is_slow | ~(left < way.singular * way.far) | ~(end <= way.until), 1)
    with r.count(shape.conditions) as i, r.when(~(r.size(data["values"][i] / data["rows"][i]) < way.fits)):
        r.give(1)
    behind, rates = way.behind.at(2), arc.rates
    r.copy(behind, arc.later, width)  # as it is at the end
    r.give_if(misses(r, arc, end, behind, width), 1)
    r.give_if(r.call(arc.function, end, behind, rates, arc.function_data) != 0, 1)
    r.give_if(r.call("keep", given, now) != 0, 1)
    way.behind[0], way.behind[1] = begin.now[0], end  # before the looks of the way are forgotten
    restart_looks(r, (way.look, way.monitor), (data, monitor, shape.conditions), (end, behind, rates))
    r.give(0)
    return r


def _watch() -> Routine:
    """Take a look, and pass the singular position that is just ahead, and others right behind it; else as it says."""
    arguments: dict[str, Kind] = {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}
    r = Routine("watch", arguments, exported=True)
    t, y, yp, given = r.arguments
    way, _, data, monitor, shape = _open(given)
    code, begin = r.variable(r.call(way.look, t, y, yp, way.monitor).integer(), INTEGER), r.variable(inf)
    with r.forever() as places:
        kept = way.count
        with r.when(code.now != COMES):
            r.leave(places)
        with r.when(r.call("cross", given) != 0):
            way.count = kept
            r.leave(places)
        begin.now = r.least(begin.now, way.behind[0])
        way.behind[0] = begin.now
        away = r.call(way.measure, way.behind[1], way.behind.at(2), way.monitor, result=NUMBER)
        data["notes"][shape.measured] = away
        code.now = 0
        with r.when(away < CLOSE * monitor.largest):
            code.now = r.call(way.judge, way.monitor, r.value(0, INTEGER)).integer()
    r.give(r.choose(begin.now < inf, CROSSED, code.now, INTEGER).code())
    return r
