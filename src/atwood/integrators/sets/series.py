"""The routine that finds how long impacts go on that follow each other ever faster.

`past` has the times of impacts and their parts. `stops` is not 0 where a series ends, `ahead` how long it goes on, and
`series` marks its gaps.
"""

from __future__ import annotations

from math import inf

from atwood.codegen.routines import BOOLEAN, INTEGER, NUMBER, Routine, Value, Variable
from atwood.integrators.sets.record import CLOSES, Sets, each_row, open_routine
from atwood.integrators.sets.sizes import BLURRED, NEAR_REST, ROUNDED, STEP
from atwood.numerics.contact_sets import STICKS

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

IN_TURN = 1.02
"""The same of impacts of gaps in turn, whose intervals may swing about their mean for long: these are alike or not."""

ACCUMULATE = 0.5
"""Impacts of gaps in turn accumulate where as many take less than this share of the time that those before took."""

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

_MOVED = 1e-12
"""Of the largest response: what moves less by an impulse does not move."""


def _series() -> Routine:
    """Find in how long impacts that follow each other ever faster have come to an end; see `_Moment.left_of`."""
    r, m, (t,) = open_routine("series", {"t": NUMBER}, result=None)
    closing, response = r.variable(-1, INTEGER), m.result("response")
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
    spans = r.array(LONG)
    count, others, late, early = _intervals(r, m, spans, t, (closing.now, moved, largest.now * _MOVED))
    newest = (spans[0] + r.choose(count.now > 1, spans[1], 0.0)) * 0.5
    with r.when(others & ~_is_alike(r, spans, count.now, RECENT)):  # in turn, each after an interval of its own
        count.now = r.truncated(count.now.number() * 0.5)
        with r.count(count.now) as k:
            spans[k] = spans[k * 2] + spans[k * 2 + 1]
    m.in_turn = (others & (late < early * ACCUMULATE)).integer()
    with r.when(m.in_turn != 0), r.when(~_is_alike(r, spans, count.now, RECENT // 2)):  # they swing
        size = r.least(newest, late * (1.0 / (RECENT * SQUEEZED))) * r.size(m.row("rates")[row])
        r.give_if(size > m.unit("small")[closing.now])
        left = late * late / (early - late)
        m.stops = r.choose(left > m.ahead * WAITS, 1, 2, INTEGER)
        m.ahead, m.blur, m.pace, m.lasted = left, NEAR_REST, NEAR_REST, late + early
        _mark_series(r, m, t)
        r.give()
    r.give_if((count.now < SPANS[0]) | ~(spans[0] > 0.0))
    _end_series(r, m, (spans, count.now, others), (t, closing.now, largest.now * _MOVED))
    with r.when(m.stops != 0):
        _mark_series(r, m, t)
    r.give()
    return r


def _intervals(
    r: Routine, m: Sets, spans: Value, t: Value, closing: tuple[Value, Value, Value]
) -> tuple[Variable, Value, Value, Value]:
    """Find the intervals between impacts as long as they shrink, the last first, and return how many these are.

    Also whether one of the last was of another gap that does not rest, and how long the last took, and as many before.
    `closing` is the gap that closes, its responses, and what moves less does not move with it.
    """
    past, turn, seen, moved = m.past, r.variable(m.known, INTEGER), r.variable(0, INTEGER), closing[1]
    count, last, end, counts = r.variable(0, INTEGER), r.variable(t), r.variable(inf), r.variable(False, BOOLEAN)
    shrinks, others, is_own = r.variable(True, BOOLEAN), r.variable(False, BOOLEAN), r.variable(True, BOOLEAN)
    late, whole, own = r.variable(0.0), r.variable(0.0), m.unit("part")[closing[0]]
    rests = r.variable(False, BOOLEAN)
    with r.forever() as loop:
        with r.when((turn.now == 0) | ~shrinks.now & (seen.now >= 2 * RECENT)):
            r.leave(loop)
        turn.now = turn.now - 1
        time, part = past[turn.now * 2], past[turn.now * 2 + 1]
        counts.now, rests.now = False, part == own
        with r.count(m.count) as k, r.when(m.unit("part")[k] == part):
            rests.now = rests.now | (m.unit("slip")[k] == 0.0) & (m.unit("state")[k] == float(STICKS))
            with each_row(r, m, k) as (_, i):
                counts.now = counts.now | (r.size(moved[i]) > closing[2])
        is_own.now = is_own.now | counts.now & (time == end.now) & rests.now
        with r.when(~counts.now | (time == end.now)):
            r.repeat(loop)
        others.now = others.now | (seen.now < SPANS[0]) & ~is_own.now
        end.now, seen.now, is_own.now = time, seen.now + 1, rests.now
        span = last.now - time
        newer, older = (spans[r.choose(count.now > by, count.now - 1 - by, 0, INTEGER)] for by in range(2))
        least = r.choose(others.now, r.least(newer, older), newer)
        shrinks.now = shrinks.now & (count.now < LONG) & ~((count.now > 0) & (span <= least * LEVEL))
        with r.when(shrinks.now):
            spans[count.now] = span
            count.now = count.now + 1
        last.now = time
        late.now = r.choose(seen.now == RECENT, t - time, late.now)
        whole.now = r.choose(seen.now == 2 * RECENT, t - time, whole.now)
    others.now = others.now | (seen.now < SPANS[0]) & ~is_own.now
    return count, others.now, late.now, whole.now - late.now


def _is_alike(r: Routine, spans: Value, number: Value, count: int) -> Value:
    """Tell whether so many of the last intervals are shorter than those before by one factor."""
    least, most = r.variable(inf), r.variable(0.0)
    with r.count(r.choose(number > count + 1, count + 1, number, INTEGER), 1) as k:
        ratio = spans[k - 1] / spans[k]
        least.now, most.now = r.least(ratio, least.now), r.most(ratio, most.now)
    return (number >= min(count + 1, SPANS[0])) & (most.now <= least.now * IN_TURN)


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


def _end_series(
    r: Routine, m: Sets, intervals: tuple[Value, Value, Value], closing: tuple[Value, Value, Value]
) -> None:
    """Stop what has a series of intervals, the last first, that ends soon.

    Impacts that only happen to be near each other are no series: each interval shrinks about as the one before.
    """
    spans, number, in_turn = intervals
    steady = r.choose(in_turn, IN_TURN, STEADY)
    cube, typical = spans[0] / spans[SPANS[0] - 1], r.variable(0.5)
    with r.count(60):  # the cube root: the mean factor of three intervals
        typical.now = typical.now - (typical.now - cube / (typical.now * typical.now)) * (1.0 / 3.0)
    even, long = r.variable(1, INTEGER), r.variable(1, INTEGER)
    with r.count(number, 1) as k:
        factor = spans[k - 1] / spans[k] / typical.now
        is_even, is_steady = ((factor <= by) & (factor * by >= 1.0) for by in (EVEN, steady))
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
    flattens = (1.0 - spans[0] / spans[1] < FLATTENS * (1.0 - share.now)) & ~in_turn
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
    r, m, (t, k) = open_routine("gap_rounding", {"t": NUMBER, "unit": INTEGER}, NUMBER)
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


SERIES = (_series, _gap_rounding)
