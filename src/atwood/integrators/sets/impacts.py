"""Routines for impacts of the gaps that touch, with friction.

Impulses are found as forces are, with `finite` 0, and `log` has an entry for each gap that is struck.
"""

from __future__ import annotations

from math import inf

from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, Routine, Value
from atwood.integrators.event_routines import do_or_return
from atwood.integrators.sets.record import (
    CAPACITY,
    CLOSES,
    ENDLESS,
    ENTRY,
    FULL,
    GAINS,
    NO_IMPULSES,
    Sets,
    choose_slips,
    each_row,
    each_unit,
    open_routine,
    product_of,
)
from atwood.integrators.sets.sizes import APART, GAIN
from atwood.numerics.contact_sets import STICKS


def _push() -> Routine:
    """Change speeds and rates by impulses."""
    r, m, (impulses,) = open_routine("push", {"impulses": ADDRESS})
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
    r, m, () = open_routine("touching", result=INTEGER)
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
    with r.when(held.now), r.count(m.count) as j, r.when(m.unit("at")[j] == k.number()), each_row(r, m, j) as (_, i):
        held.now = held.now & (response[i * m.size + i] <= m.unit("unmoved")[j])
    return held.now


def _impulses() -> Routine:
    """Find the impulses of the chosen units, and add them to those that there are."""
    r, m, () = open_routine("find_impulses")
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
    r, m, () = open_routine("strike")
    place, size, rates, free = r.arguments[0], m.size, m.row("rates"), m.row("wanted")
    impulses, again, share = m.row("impulses"), m.row("again"), m.result("restitution")
    response, gap, poisson = m.result("response"), m.unit("slip"), m.unit("poisson")
    r.copy(free, rates, size)
    r.clear(impulses, impulses.at(size))
    r.clear(again, again.at(size))
    with each_unit(r, m, "chosen") as (k, row, _), r.when((gap[k] == 0.0) & (poisson[k] == 0.0)):
        free[row] = free[row] - share[row] * r.most(0.0 - rates[row], 0.0)
    do_or_return(r, "find_impulses")
    more = r.variable(False, BOOLEAN)
    with each_unit(r, m, "chosen") as (k, row, _), r.when((gap[k] == 0.0) & (poisson[k] != 0.0)):
        again[row] = share[row] * impulses[row]
        more.now = more.now | (again[row] > 0.0)
    with r.when(more.now):
        with r.count(size) as i:
            impulses[i] = impulses[i] + again[i]
        with r.count(size) as i:
            free[i] = free[i] + product_of(r, size, response.at(i * size), impulses)
        r.copy(m.row("pressed"), again, size)
        do_or_return(r, "find_impulses")
        r.clear(m.row("pressed"), m.row("pressed").at(size))
    do_or_return(r, "account")
    r.call("push", place, impulses)
    r.give(0)
    return r


def work_of(r: Routine, by: Value, before: Value, after: Value) -> tuple[Value, Value]:
    """Return the work that an impulse does between two rates, and the size of its terms."""
    return by * (before + after) * 0.5, r.size(by) * (r.size(before) + r.size(after)) * 0.5


def _account() -> Routine:
    """Refuse impulses that make energy, and log the impacts of gaps that approach."""
    r, m, () = open_routine("account")
    size, rates, impulses, after, work = m.size, m.row("rates"), m.row("impulses"), m.row("after"), m.row("work")
    response, log, total, sizes = m.result("response"), m.log, r.variable(0.0), r.variable(0.0)
    worst = r.variable(-inf)
    with r.count(size) as i:
        by, before = impulses[i], rates[i]
        after[i] = before + product_of(r, size, response.at(i * size), impulses)
        work[i], size_of_work = work_of(r, by, before, after[i])
        total.now, sizes.now = total.now + work[i], sizes.now + size_of_work
    with r.when(total.now > sizes.now * GAIN):
        with each_unit(r, m, "chosen") as (k, row, _), r.when((m.unit("slip")[k] == 0.0) & (work[row] > worst.now)):
            worst.now, m.number = work[row], k
        r.give(GAINS)
    with each_unit(r, m, "struck") as (k, row, _), r.when(0.0 - rates[row] > m.unit("slow")[k] * m.pace):
        r.give_if(m.logged >= CAPACITY, FULL)
        entry = log.at(m.logged * (size + len(ENTRY)))
        loss = r.variable(0.0 - work[row])
        rubs = each_unit(r, m, "chosen")
        with rubs as (j, _, _), r.when(m.unit("at")[j] == k.number()), each_row(r, m, j) as (_, i):
            loss.now = loss.now - work[i]
        entry[0], entry[1], entry[2], entry[3] = k.number(), rates[row], after[row], loss.now
        r.copy(entry.at(len(ENTRY)), impulses, size)
        m.logged = m.logged + 1
    r.give(0)
    return r


def _collide() -> Routine:
    """Let what approaches collide, until nothing does."""
    r, m, () = open_routine("collide")
    chosen, struck = m.unit("chosen"), m.unit("struck")
    coming = r.variable(False, BOOLEAN)
    with r.count(CAPACITY):
        r.call("touching", r.arguments[0], result=INTEGER)
        with each_unit(r, m, "chosen") as (k, row, _), r.when(m.in_turn != 0):  # one after the other
            is_now = (m.unit("state")[k] == float(STICKS)) | (m.unit("trigger")[k] != 0.0)
            is_near = m.result("values")[row] <= m.unit("rounding")[k] * APART
            chosen[k] = r.choose(is_now | is_near, 1.0, 0.0)
        coming.now = False
        with r.count(m.count) as k:
            struck[k] = chosen[k]
        with each_unit(r, m, "chosen") as (k, row, _):
            coming.now = coming.now | (m.row("rates")[row] < 0.0 - m.unit("slow")[k] * m.pace)
        r.give_if(~coming.now, 0)
        with r.count(m.count) as k, r.when(m.unit("speed")[k] != 0.0):
            chosen[k] = 1.0
        choose_slips(r, m)
        do_or_return(r, "strike")
    r.give(ENDLESS)
    return r


IMPACTS = (_push, _touch, _impulses, _strike, _account, _collide)
