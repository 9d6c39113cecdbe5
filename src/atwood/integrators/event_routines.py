"""Finding where compiled event functions pass through zero, by routines: the rules of `event_location`, word by word.

They ask an interpolant for states and the events for values by their addresses, so that they are compiled once for all
methods and all problems.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan

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
)
from atwood.codegen.tangents import FULL, SECANT, STEEP
from atwood.integrators.event_location import (
    BEGIN,
    FARTHER,
    FIELDS,
    FIRST,
    FOUND,
    HALF,
    LARGEST,
    LAST,
    MOST,
    NEAR_WHOLE,
    NO_STATE,
    NO_VALUE,
    NOISE,
    ROUNDING,
    ROWS,
    SHORTEST,
    STACK,
)
from atwood.integrators.protocol import JUST_HAPPENED


class Search(Record):
    """The memory of a search within a routine."""

    def row(self, name: str) -> Value:
        """Return the address of a row."""
        rows: Value = self.rows
        return rows.at(self.count * ROWS[name])

    def point(self, number: Operand) -> Value:
        """Return the address of a point."""
        rows: Value = self.rows
        return rows.at(self.count * len(ROWS)).at(self.stride * number)

    @property
    def stride(self) -> Value:
        """The length of a point."""
        return self.count * 2 + 1


def _open(
    name: str, more: Mapping[str, Kind] | None = None, result: Kind = CODE, exported: bool = False
) -> tuple[Routine, Search, list[Value]]:
    routine = Routine(name, {"place": ADDRESS, **(more or {})}, result, exported)
    return routine, Search(routine.arguments[0], FIELDS), routine.arguments[1:]


def do_or_return(r: Routine, name: str, *arguments: Operand) -> None:
    """Call a routine with the first argument and others, and return with its code where that is not zero."""
    code = r.call(name, r.arguments[0], *arguments)
    r.give_if(code != 0, code)


def _sign(r: Routine, value: Value) -> Value:
    return r.choose(value > 0.0, 1.0, r.choose(value < 0.0, -1.0, 0.0))


def _flag(r: Routine, condition: Value) -> Value:
    return r.choose(condition, 1.0, 0.0)


def _values(r: Routine, m: Search, time: Value, state: Value, target: str) -> None:
    m.evaluations = m.evaluations + 1
    r.call(m.events, time, state, m.yp, m.row(target), m.data)


def _read() -> Routine:
    """Read state and values at a time, unless they are there."""
    r, m, (time,) = _open("read", {"time": NUMBER})
    r.give_if(time == m.here, 0)
    m.here = nan
    code = r.call(m.interpolate, m.session, time, m.y, m.yp)
    y, yp, known = m.y, m.yp, m.row("known")
    is_bad = r.variable(code != 0, BOOLEAN)
    with r.count(m.size) as i:
        is_bad.now = is_bad.now | ~(r.is_finite(y[i]) & r.is_finite(yp[i]))
    m.root = time
    r.give_if(is_bad.now, NO_STATE)
    _values(r, m, time, y, "known")
    with r.count(m.count) as i, r.when(known[i] != known[i]):
        m.bad = i
        r.give(NO_VALUE)
    m.here = time
    r.give(0)
    return r


def _noise() -> Routine:
    """Write how large values can be that are zero but for rounding, in a step of some width from what was read."""
    r, m, (width,) = _open("noise", {"width": NUMBER})
    y, yp, shifted, turns, size = m.y, m.yp, m.shifted, m.turns, m.size
    noise, known, others = m.row("noise"), m.row("known"), m.row("others")
    with r.count(m.count) as k:
        noise[k] = 0.0
    with r.count(2) as turn:
        with r.count(size) as i:
            by = (r.size(y[i]) + width * r.size(yp[i])) * ROUNDING
            shifted[i] = y[i] + by * turns[turn * size + i]
        _values(r, m, m.here, shifted, "others")
        with r.count(m.count) as k:
            noise[k] = r.most(r.size(others[k] - known[k]) * NOISE, noise[k])
    r.give(0)
    return r


def _point() -> Routine:
    """Write time, values and slopes, the latter over a small part of a width that begins there."""
    r, m, (time, width, p) = _open("point", {"time": NUMBER, "width": NUMBER, "target": ADDRESS})
    do_or_return(r, "read", time)
    known, others, y, yp, shifted, count = m.row("known"), m.row("others"), m.y, m.yp, m.shifted, m.count
    past = width * SECANT
    with r.count(m.size) as i:
        shifted[i] = y[i] + past * yp[i]
    _values(r, m, time + past, shifted, "others")
    p[0] = time
    values, slopes = p.at(1), p.at(count + 1)
    with r.count(count) as k:
        value = known[k]
        slope = (others[k] - value) / past
        values[k] = value
        slopes[k] = r.choose(slope != slope, 0.0, r.least(r.most(slope, -LARGEST), LARGEST))
    r.give(0)
    return r


def _lowest() -> Routine:
    """Return where, as a share, a function is least that may lose its sign between two points; 2 where none may.

    It is the least value of the cubic through both.
    """
    more: dict[str, Kind] = {"a": ADDRESS, "b": ADDRESS, "share": NUMBER}
    r, m, (a, b, share) = _open("lowest", more, result=NUMBER)
    width, count, signs, least = b[0] - a[0], m.count, m.row("dipping"), r.variable(2.0)
    with r.count(count) as i:
        sign = signs[i]
        first, last = sign * a[i + 1], sign * b[i + 1]
        down, up = sign * a[count + i + 1] * width, sign * b[count + i + 1] * width
        is_steep = r.most(r.size(down), r.size(up)) > r.most(first, last) * STEEP
        may = (first + share * down <= 0.0) | (last - share * up <= 0.0) | is_steep
        with r.when((sign != 0.0) & (first > 0.0) & (last > 0.0) & may):
            rise = sign * (b[i + 1] - a[i + 1])
            square, linear = (down + up - rise * 2.0) * 3.0, (rise * 3.0 - down * 2.0 - up) * 2.0
            inside = linear * linear - square * 4.0 * down
            below = r.choose(inside >= 0.0, linear + r.sqrt(inside), 0.0)
            at = r.choose(below != 0.0, down * -2.0 / below, 0.5)
            kept = r.least(r.most(at, 1e-3), 1.0 - 1e-3)
            least.now = r.least(r.choose((at > 0.0) & (at < 1.0), kept, 0.5), least.now)
    r.give(least.now)
    return r


def _dip() -> Routine:
    """Find a time between two others at which an event has the other sign, where both have the known one."""
    r, m, (begin, end) = _open("find_dip", {"begin": NUMBER, "end": NUMBER})
    rough, blind, sign, dipping, some = *map(m.row, ("rough", "blind", "sign", "dipping")), r.variable(False, BOOLEAN)
    m.dip = inf
    with r.count(m.count) as i:
        one = r.choose((rough[i] != 0.0) | (begin < blind[i]), 0.0, sign[i])
        dipping[i] = one
        some.now = some.now | (one != 0.0)
    r.give_if(~(some.now & (begin < end)), 0)
    a, last, kept, stride, whole = m.point(FIRST), m.point(LAST), m.point(BEGIN), m.stride, end - begin
    r.copy(a, last, stride)
    with r.when(last[0] != begin):
        is_known = (kept[0] == begin) & (whole >= (last[0] - begin) * NEAR_WHOLE)
        with r.when(is_known):
            r.copy(a, kept, stride)
        with r.when(~is_known):
            do_or_return(r, "point", begin, whole, a)
    r.copy(kept, a, stride)
    do_or_return(r, "point", end, begin - end, last)
    r.copy(m.point(STACK), last, stride)
    depth, count, share = r.variable(0, INTEGER), r.variable(0, INTEGER), r.variable(FULL)
    with r.forever() as loop:
        deep = depth.now
        r.give_if((deep < 0) | (count.now >= MOST), 0)
        b = m.point(deep + STACK)
        width = b[0] - a[0]
        low = r.call("lowest", r.arguments[0], a, b, share.now, result=NUMBER)
        with r.when((low > 1.0) | (width <= whole * SHORTEST)):
            r.copy(a, b, stride)
            depth.now = deep - 1
            r.repeat(loop)
        p = m.point(deep + (STACK + 1))
        do_or_return(r, "point", a[0] + low * width, 0.0 - width, p)
        with r.count(m.count) as i, r.when((dipping[i] != 0.0) & (dipping[i] * p[i + 1] <= 0.0)):
            m.dip = p[0]
            r.give(0)
        depth.now, count.now, share.now = deep + 1, count.now + 1, HALF
    return r


def _crossings() -> Routine:
    """Write which values have passed zero at a time in a direction that counts; 1 where some have."""
    r, m, (time, values, target) = _open("crossings", {"time": NUMBER, "values": ADDRESS, "target": ADDRESS})
    sign, direction, blind, some = *map(m.row, ("sign", "direction", "blind")), r.variable(False, BOOLEAN)
    with r.count(m.count) as i:
        known, way = sign[i], direction[i]
        counts = (known != 0.0) & ((way == 0.0) | (way == 0.0 - known)) & (time > blind[i])
        crossed = counts & ~(values[i] * known > 0.0)
        target[i] = _flag(r, crossed)
        some.now = some.now | crossed
    r.give(some.now.code())
    return r


def _settle() -> Routine:
    """Read the signs of what is or has just been zero where they are larger than rounding."""
    r, m, (begin,) = _open("settle", {"begin": NUMBER})
    unsure, blind, noise, known, origin, sign = map(m.row, ("unsure", "blind", "noise", "known", "origin", "sign"))
    do_or_return(r, "read", begin)
    r.call("noise", r.arguments[0], m.end - begin)
    left, past = r.variable(False, BOOLEAN), r.variable(m.moment)
    with r.count(m.count) as i:
        blind[i] = r.choose(unsure[i] != 0.0, inf, blind[i])
        left.now = left.now | (unsure[i] != 0.0)
    with r.forever() as loop:
        with r.when(~(left.now & (begin < m.end))):
            r.leave(loop)
        time = r.least(begin + past.now, m.end)
        do_or_return(r, "read", time)
        left.now = False
        with r.count(m.count) as i:
            value, least = known[i], noise[i]
            is_clear = (r.size(value) > least) & (r.size(value - origin[i]) > least)
            with r.when((unsure[i] != 0.0) & is_clear):
                sign[i], blind[i], unsure[i] = _sign(r, value), time, 0.0
            left.now = left.now | (unsure[i] != 0.0)
        with r.when(time >= m.end):
            r.leave(loop)
        past.now = past.now * FARTHER
    r.give(0)
    return r


def _narrow() -> Routine:
    """Find the last time before some event has passed zero and the first after it, within a tolerance.

    Regula falsi on the event functions that have passed zero at the end, with a bisection whenever two guesses together
    did not halve the interval.
    """
    r, m, (begin, end, tolerance) = _open("narrow", dict.fromkeys(("begin", "end", "tolerance"), NUMBER))
    known, lower, upper, crossed, count = *map(m.row, ("known", "lower", "upper", "crossed")), m.count
    r.copy(upper, known, count)  # the end was read last
    first = m.point(BEGIN)
    r.copy(lower, first.at(1), count)
    with r.when(first[0] != begin):
        do_or_return(r, "read", begin)
        r.copy(lower, known, count)
    b, e, width, guesses = r.variable(begin), r.variable(end), r.variable(end - begin), r.variable(0, INTEGER)
    bisects = r.variable(False, BOOLEAN)
    with r.forever() as loop:
        first, last = b.now, e.now
        with r.when(~(last - first > tolerance)):
            r.leave(loop)
        bisects.now = False
        with r.when(guesses.now == 2):
            bisects.now, guesses.now = last - first > width.now * 0.5, 0
            width.now = last - first
        share = _guess(r, m, last, lower, upper, crossed)
        guessed = r.choose(bisects.now, (first + last) * 0.5, first + share * (last - first))
        # Over the root by half the tolerance: the next guess then closes in from the other side.
        middle = r.least(r.most(guessed, first + tolerance * 0.5), last - tolerance * 0.5)
        with r.when(~((first < middle) & (middle < last))):
            r.leave(loop)
        guesses.now = guesses.now + 1
        do_or_return(r, "read", middle)
        is_past = r.call("crossings", r.arguments[0], middle, known, crossed) != 0
        with r.when(is_past):
            e.now = middle
            r.copy(upper, known, count)
        with r.otherwise():
            b.now = middle
            r.copy(lower, known, count)
    m.before, m.after = b.now, e.now
    r.give(0)
    return r


def _guess(r: Routine, m: Search, last: Value, lower: Value, upper: Value, crossed: Value) -> Value:
    """Return the share of the earliest zero of the chords of the event functions that have passed zero at the end."""
    least = r.variable(1.0)
    r.call("crossings", r.arguments[0], last, upper, crossed)
    with r.count(m.count) as i, r.when(crossed[i] != 0.0):
        share = r.choose(lower[i] != upper[i], lower[i] / (lower[i] - upper[i]), 0.5)
        least.now = r.least(r.choose(share != share, 0.5, r.most(share, 0.0)), least.now)
    return least.now


def _learn(r: Routine, m: Search, time: Value) -> None:
    """Take the signs of all values that have one."""
    sign, blind, known = m.row("sign"), m.row("blind"), m.row("known")
    with r.count(m.count) as i, r.when((time > blind[i]) & (known[i] != 0.0)):
        sign[i] = _sign(r, known[i])


def _happening() -> Routine:
    """See what happens at a time, and within rounding of it; `FOUND` where it counts."""
    r, m, (time, after, moment) = _open("happening", dict.fromkeys(("time", "after", "moment"), NUMBER))
    names = ("known", "crossed", "later", "old", "sign", "unsure", "origin", "carried", "fired", "found")
    known, crossed, later, old, sign, unsure, origin, carried, fired, found = map(m.row, names)
    for moment_read, target in ((after, later), (time, crossed)):  # the one that is settled last, as it is read then
        do_or_return(r, "read", moment_read)
        r.call("crossings", r.arguments[0], moment_read, known, target)
    with r.count(m.count) as i:
        before, one = sign[i], (crossed[i] != 0.0) | (later[i] != 0.0)
        old[i], crossed[i] = before, _flag(r, one)
        with r.when(one):
            sign[i], unsure[i], origin[i] = 0.0 - before, 1.0, 0.0
    do_or_return(r, "settle", time)
    is_start, some = time - m.start <= moment, r.variable(False, BOOLEAN)
    with r.count(m.count) as i:
        passed = (crossed[i] != 0.0) & (sign[i] != old[i]) & ((carried[i] != 0.0) | ~is_start)
        later[i] = _flag(r, passed)
        some.now = some.now | passed
    r.give_if(~some.now, 0)
    m.fired_at = time
    with r.count(m.count) as i:
        fired[i], found[i] = later[i], (0.0 - old[i]) * later[i]
    do_or_return(r, "read", time)
    r.give(FOUND)
    return r


def _first_root() -> Routine:
    """Find the first event between two times."""
    r, m, (begin, end) = _open("first_root", {"begin": NUMBER, "end": NUMBER})
    place, from_ = r.arguments[0], r.variable(begin)
    known, sign, crossed, rough, found = map(m.row, ("known", "sign", "crossed", "rough", "found"))

    def divide(until: Operand) -> None:
        """Look on both sides of a dip, if there is one."""
        do_or_return(r, "find_dip", from_.now, until)
        dip = m.dip
        with r.when(dip < inf):
            do_or_return(r, "first_root", from_.now, dip)
            r.give(r.call("first_root", place, dip, end))

    divide(end)
    do_or_return(r, "read", end)
    changed = r.variable(False, BOOLEAN)
    with r.count(m.count) as i:
        changed.now = changed.now | ~(known[i] * sign[i] > 0.0)
    r.give_if(~changed.now, 0)
    tolerance = (r.size(end) + (end - begin)) * (4 * ROUNDING)
    moment = r.most(tolerance * 25.0, m.moment)
    with r.forever():
        do_or_return(r, "read", end)
        with r.when(r.call("crossings", place, end, known, crossed) == 0):
            _learn(r, m, end)  # a zero that is not an event keeps the sign it came with
            r.give(0)
        exact = r.variable(False, BOOLEAN)
        with r.count(m.count) as i:
            found[i] = _sign(r, known[i]) * crossed[i]
            exact.now = exact.now | ((crossed[i] != 0.0) & (rough[i] == 0.0))
        with r.when(~exact.now):
            _learn(r, m, end)
            r.give(FOUND)
        do_or_return(r, "narrow", from_.now, end, tolerance)
        time = m.after
        divide(m.before)
        after = r.least(time + moment, end)  # what follows within rounding belongs to the same moment
        do_or_return(r, "happening", time, after, moment)
        r.give_if(after >= end, 0)
        from_.now = after
    return r


def _search() -> Routine:
    """Find the first event between two times of the last step; its state is what was read last."""
    r, m, (begin, end) = _open("search", {"begin": NUMBER, "end": NUMBER}, exported=True)
    m.settling, m.end, m.here = 0, end, nan
    unsure, blind = m.row("unsure"), m.row("blind")
    some, clear = r.variable(False, BOOLEAN), r.variable(-inf)
    _any(r, m, unsure, some)
    with r.when(some.now):
        do_or_return(r, "settle", begin)
    with r.count(m.count) as i:
        clear.now = r.most(clear.now, blind[i])
    until = r.least(clear.now, end)
    with r.when((begin < until) & (until < end)):
        do_or_return(r, "first_root", begin, until)
        do_or_return(r, "first_root", until, end)
        r.give(0)
    r.give(r.call("first_root", r.arguments[0], begin, end))
    return r


def _any(r: Routine, m: Search, row: Value, some: Variable) -> None:
    with r.count(m.count) as i:
        some.now = some.now | (row[i] != 0.0)


def _restart() -> Routine:
    """Take the signs from a new start of the solution."""
    r, m, (t,) = _open("restart", {"t": NUMBER}, exported=True)
    m.here = nan
    do_or_return(r, "read", t)
    r.call("noise", r.arguments[0], 0.0)
    names = ("known", "noise", "given", "carried", "unsure", "origin", "sign", "blind")
    known, noise, given, carried, unsure, origin, sign, blind = map(m.row, names)
    is_first = m.is_first != 0
    with r.count(m.count) as i:
        value, one = known[i], given[i]
        is_zero, has_happened = r.size(value) <= noise[i], one == float(JUST_HAPPENED)
        is_carried = (r.size(one) == 1.0) & (is_first | is_zero | (one * value > 0.0))
        is_unsure = has_happened | (is_zero & (one == 0.0))
        carried[i], unsure[i] = _flag(r, is_carried), _flag(r, is_unsure)
        origin[i] = r.choose(has_happened, value, 0.0)
        sign[i] = r.choose(is_unsure, 0.0, r.choose(is_carried, one, _sign(r, value)))
        blind[i] = -inf
    m.start, m.settling, m.is_first = t, 1, 0
    m.point(LAST)[0] = m.point(BEGIN)[0] = nan
    r.give(0)
    return r


def write_routines() -> list[Routine]:
    """Return the routines of a search; they take the address of its memory."""
    ends = (_search(), _restart())
    inner = (_read, _noise, _point, _lowest, _dip, _crossings, _settle, _narrow, _happening, _first_root)
    return [*ends, *(write() for write in inner)]
