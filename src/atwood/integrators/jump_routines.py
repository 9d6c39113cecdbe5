"""The routine that makes a jump at an event; see `atwood.integrators.jumps`."""

from __future__ import annotations

from math import inf, nan

from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Record, Routine, Value, call_kernel, place_of
from atwood.integrators.event_location import FIELDS as LOCATOR
from atwood.integrators.event_routines import Search
from atwood.integrators.jumps import ENTRY, FIELDS, TABLE
from atwood.integrators.sets.sizes import BLURRED, ROUNDED, STEP

SPANS = 3, 12
"""At least and at most so many intervals between jumps say how fast these follow each other."""

_MOVED = 1e-12
"""Of the largest response: what moves less by an impulse does not move."""

_MORE = 1e-9
"""Of its rate: what leaves faster than it came by more than this gains energy."""

_TINY = 1e-300
"""Makes zero positive."""


def write_routines() -> list[Routine]:
    """Return the routine: the state at an event becomes that after it, and 0 is returned; or 1, and nothing changes."""
    r = Routine("jump", {"place": ADDRESS, "locator": ADDRESS, "t": NUMBER}, exported=True)
    place, locator, t = r.arguments
    m, search = Record(place, FIELDS), Search(locator, LOCATOR)
    size = m.coordinates + m.speeds
    one = _alone(r, m, search)
    row = r.truncated(m.table[one])
    r.give_if(row < 0, 1)
    gaps, y, room = m.gaps, search.y, m.room
    picks = room.at(size + gaps * 3 + 1)
    with r.count(gaps) as i:
        picks[i] = 0.0
    picks[row] = 1.0
    _strike(r, m, t, y, picks)
    before, after, response, impulse = (room.at(size + gaps * k) for k in range(4))
    slow, gains = m.table[search.count * TABLE.index("slow") + one], before[row] + after[row] > after[row] * _MORE
    r.give_if(~((before[row] + slow < 0.0) & (after[row] > slow)) | gains, 1)
    newest = _leave_series(r, m, t, response)
    _leave_rounding(r, m, search, one, newest, (before[row], after[row]))
    # Times are rounded, and always past the zero: the impact is made there, and what follows takes up the rest.
    late = r.least(r.most((search.row("known")[one] - m.shift[one]) / before[row], 0.0), search.after - search.before)
    there = search.shifted
    with r.count(size) as i:
        there[i] = y[i] - late * search.yp[i]
    _strike(r, m, t - late, there, picks)
    r.give_if(r.call(m.rates, t, room, there, m.rates_data) != 0, 1)
    r.copy(search.yp, there, size)
    with r.count(size) as i:
        room[i] = room[i] + late * there[i]
    entry = m.log.at(m.logged * m.log_stride)
    for k, value in enumerate((t, one.number(), m.parts[row], impulse[0], before[row], after[row])):
        entry[k] = value
    r.copy(entry.at(len(ENTRY)), y, size)
    r.copy(y, room, size)
    r.copy(entry.at(size + len(ENTRY)), y, size)
    m.logged = m.logged + 1
    _watch_again(r, m, search, one, t)
    r.give(0)
    return [r]


def _strike(r: Routine, m: Record, t: Value, y: Value, picks: Value) -> None:
    """Make an impact at a state."""
    inputs = [place_of(r, t), y, y.at(m.coordinates), picks]
    r.give_if(call_kernel(r, m.program, inputs, m.derived, m.scratch, [m.room]) != 0, 1)


def _alone(r: Routine, m: Record, search: Search) -> Value:
    """Return the number of the event; what happens beside it, or nearly so, or had a margin, is left to Python."""
    found, known, shift = search.row("found"), search.row("known"), m.shift
    one, many = r.variable(0, INTEGER), r.variable(0, INTEGER)
    with r.count(search.count) as i, r.when(found[i] != 0.0):
        one.now, many.now = i, many.now + 1
    r.give_if((many.now != 1) | (m.logged >= m.capacity), 1)
    which, small = one.now, m.table.at(search.count * TABLE.index("small"))
    r.give_if(shift[which] * 2.0 > small[which], 1)
    with r.count(search.count) as i, r.when((i != which) & ~(known[i] - shift[i] > small[i])):
        r.give(1)
    return which


def _leave_series(r: Routine, m: Record, t: Value, response: Value) -> Value:
    """Leave it to Python where intervals shrink like a geometric series that ends soon, of parts that move together.

    Return the newest interval, infinity where there are few.
    """
    gaps, parts, log, stride = m.gaps, m.parts, m.log, m.log_stride
    largest, moved = r.variable(0.0), m.moved
    with r.count(gaps) as i:
        moved[i] = 0.0
        largest.now = r.most(r.size(response[i]), largest.now)
    with r.count(gaps) as i, r.when(r.size(response[i]) > largest.now * _MOVED):
        moved[r.truncated(parts[i])] = 1.0
    spans, k = r.variable(0, INTEGER), r.variable(m.logged, INTEGER)
    newest, oldest, last, end = r.variable(0.0), r.variable(0.0), r.variable(t), r.variable(nan)
    with r.forever() as loop:
        with r.when(k.now == 0):
            r.leave(loop)
        k.now = k.now - 1
        entry = log.at(k.now * stride)
        time = entry[0]
        with r.when((moved[r.truncated(entry[2])] == 0.0) | (time == end.now)):
            r.repeat(loop)
        end.now = time
        span = last.now - time
        with r.when((spans.now == SPANS[1]) | ((spans.now > 0) & (span <= oldest.now))):
            r.leave(loop)
        oldest.now, newest.now = span, r.choose(spans.now == 0, span, newest.now)
        spans.now, last.now = spans.now + 1, time
    share, power = m.left / (m.left + newest.now), r.variable(1.0 + 1e-9)
    with r.count(spans.now - 1):
        power.now = power.now * share
    ends_soon = newest.now < oldest.now * power.now
    is_series = (spans.now >= SPANS[0]) & (newest.now > 0.0)
    r.give_if(is_series & ends_soon, 1)
    return r.choose(is_series, newest.now, inf)


def _leave_rounding(
    r: Routine, m: Record, search: Search, one: Value, newest: Value, speeds: tuple[Value, Value]
) -> None:
    """Leave it to Python where rounding of the coordinates tells in the bounces of what loses energy."""
    (before, after), y, others, moved = speeds, search.y, search.row("others"), r.variable(0.0)
    height = newest * (0.0 - before) * (1.0 + after / before)
    with r.when((height > 0.0) & (height < inf)):
        with r.count(m.coordinates) as i:
            kept = y[i]
            y[i] = kept + kept * STEP
            r.call(search.events, search.root, y, search.yp, others, search.data)
            moved.now = moved.now + r.size(others[one] - search.row("known")[one])
            y[i] = kept
        r.give_if(height < moved.now * (BLURRED * ROUNDED / STEP), 1)


def _watch_again(r: Routine, m: Record, search: Search, one: Value, t: Value) -> None:
    """Look for events from here on: what has jumped is at zero, and needs no margin where it opens."""
    shift, seen, others, given, count = m.shift, m.seen, search.row("others"), search.row("given"), search.count
    with r.count(count) as i:
        shift[i], given[i] = 0.0, 1.0
    r.call(search.events, t, search.y, search.yp, others, search.data)
    value = others[one]
    shift[one] = r.choose(value > 0.0, 0.0, r.size(value) * 2.0 + _TINY)
    r.clear(seen, seen.at(count * 3 + 3))
    seen[0] = t
    search.is_first = 1
