"""The routine of a set of contacts: impacts of gaps, and which gaps and slips hold from a moment on.

The rules are those of `atwood.numerics.contact_sets` and `atwood.simulation.contacts.changes`, word by word. States
before are `state`, those after it `next`; the speeds change in place.
"""

from __future__ import annotations

from atwood.codegen.routines import BOOLEAN, INTEGER, NUMBER, Routine, Variable, call_kernel, place_of
from atwood.integrators.event_routines import do_or_return
from atwood.integrators.sets.checking import CHECKING
from atwood.integrators.sets.finding import FINDING
from atwood.integrators.sets.impacts import IMPACTS
from atwood.integrators.sets.record import (
    INSIDE,
    NO_VALUE,
    OPENS,
    STOPS,
    YIELDS,
    Sets,
    choose_slips,
    each_row,
    each_unit,
    give_way,
    is_loose,
    is_still,
    open_routine,
    size_of_slip,
    small_motion,
)
from atwood.integrators.sets.series import SERIES
from atwood.integrators.sets.shares import SHARES
from atwood.integrators.sets.sizes import ASTRAY, BEGINS, FAST
from atwood.integrators.sets.solving import SOLVING
from atwood.integrators.sets.stopping import STOPPING
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS


def _read() -> Routine:
    """Evaluate the program at the present state."""
    r, m, (t,) = open_routine("read_contacts", {"t": NUMBER})
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


def _hold() -> Routine:
    """Take away the rates of the chosen units; what begins to slip in two directions has those of a moment later."""
    r, m, () = open_routine("hold")
    acting, right, forces, rates, size = m.row("acting"), m.row("right"), m.row("forces"), m.row("rates"), m.size
    response, matrix, solution, n = m.result("response"), m.matrix, m.row("solution"), r.variable(0, INTEGER)
    moment, falls = r.variable(0.0), m.row("motions")
    with each_unit(r, m, "chosen") as (k, row, is_pair), r.when((m.unit("next")[k] == float(GOES_ON)) & is_pair):
        fall = size_of_slip(r, row, is_pair, falls)[2]
        with r.when(fall > 0.0):
            soon = BEGINS * m.unit("slow")[k] * m.pace / fall
            moment.now = r.choose(moment.now > 0.0, r.least(moment.now, soon), soon)
    with each_unit(r, m, "chosen") as (k, _, is_pair), each_row(r, m, k) as (_, row):
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
    with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(slip[k] != 0.0):
        way = size_of_slip(r, row, is_pair, m.row("rates"))
        with r.when(~is_still(r, m, k, way[2])):
            give_way(r, m, k, way, 1.0)
        with r.otherwise(), r.when(trigger[k] == float(YIELDS)):
            give_way(r, m, k, size_of_slip(r, row, is_pair, m.row("forces")), -1.0)
    with each_unit(r, m, "chosen") as (k, _, _):
        rests = (slip[k] == 0.0) | (trigger[k] == float(STOPS))
        m.unit("next")[k] = r.choose(rests, float(STICKS), state[k])
        for one in ("_x", "_y"):
            m.unit(f"next{one}")[k] = r.choose(rests, 0.0, m.unit(f"state{one}")[k])
        some.now = some.now | True


def _look_at_begins(r: Routine, m: Sets) -> None:
    """Leave to others what begins to slip in a plane and moves otherwise than it is given, or nowhere: `_turned`."""
    small = small_motion(r, m)
    with each_unit(r, m, "given") as (k, row, is_pair), r.when(m.unit("trigger")[k] == float(YIELDS)):
        a, b, size = size_of_slip(r, row, is_pair, m.row("motions"))
        is_astray = a * m.unit("given_x")[k] + b * m.unit("given_y")[k] < size * ASTRAY
        m.shared = r.choose(is_pair & (is_astray | (size <= small)), 1, m.shared, INTEGER)


def _barely_rising() -> Routine:
    """Mark gaps that rise by no more than rounding before they are back: ``v^2 <= 2 A f`` times that."""
    r, m, () = open_routine("barely_rising")
    struck, rates, rounding, free = m.unit("struck"), m.row("rates"), m.unit("rounding"), m.result("free")
    largest, some = r.variable(0.0), r.variable(False, BOOLEAN)
    with r.count(m.size) as i:
        largest.now = r.most(r.size(free[i]), largest.now)
    with r.count(m.count) as k:
        struck[k], m.unit("given")[k], m.unit("next")[k] = 0.0, 0.0, float(OPEN)
    with each_unit(r, m, "chosen") as (k, row, _), r.when(m.unit("speed")[k] == 0.0):
        rate, is_near = rates[row], rates[row] * rates[row] <= rounding[k] * largest.now * (2.0 * FAST)
        rises = rate > m.unit("slow")[k] * m.pace
        struck[k] = r.choose(rises & is_near, 1.0, 0.0)
        m.unit("next")[k] = r.choose(rises & ~is_near, float(OPEN), float(STICKS))
        some.now = some.now | (rises & is_near)
    r.give_if(~some.now, 0)
    r.copy(m.row("wanted"), free, m.size)
    r.call("meet_states", r.arguments[0])
    with each_unit(r, m, "struck") as (k, row, _):
        pulls = m.result("response")[row * m.size + row] * m.row("forces")[row]
        struck[k] = r.choose(rates[row] * rates[row] <= pulls * rounding[k] * 2.0, 1.0, 0.0)
    r.give(0)
    return r


def _settle() -> Routine:
    """Find the states that hold from now on."""
    r, m, (t,) = open_routine("settle_contacts", {"t": NUMBER})
    chosen, state, x, y = m.unit("chosen"), m.unit("next"), m.unit("next_x"), m.unit("next_y")
    some = r.variable(False, BOOLEAN)
    r.call("touching", r.arguments[0], result=INTEGER)
    r.call("barely_rising", r.arguments[0])
    with each_unit(r, m, "chosen") as (k, row, _):
        passes = (r.size(m.row("rates")[row]) > m.unit("slow")[k] * m.pace) & (m.unit("struck")[k] == 0.0)
        with r.when(passes | (m.unit("trigger")[k] == float(OPENS))):
            chosen[k] = 0.0
    choose_slips(r, m)
    do_or_return(r, "read_contacts", t)
    r.copy(m.row("wanted"), m.result("free"), m.size)
    _going(r, m, some, repeated := r.variable(False, BOOLEAN))
    rests = r.variable(True, BOOLEAN)  # it starts, or has just come to touch or to rest: what can rest does
    with r.count(m.count) as k:
        trigger = m.unit("trigger")[k]
        rests.now = rests.now & (trigger != float(OPENS)) & (trigger != float(YIELDS))
    with r.when(some.now):
        misses = r.call("find_states", r.arguments[0])
        do_or_return(r, "share_forces", rests.now.integer(), misses)
    with r.when(repeated.now):
        _look_at_begins(r, m)
    with r.count(m.count) as k:
        off = (chosen[k] == 0.0) | (state[k] == float(OPEN))
        state[k] = r.choose(off, float(OPEN), state[k])
        still = off | (state[k] == float(STICKS))
        x[k], y[k] = r.choose(still, 0.0, x[k]), r.choose(still, 0.0, y[k])
    with r.count(m.count) as k, r.when(is_loose(r, m, k)):
        state[k], x[k], y[k] = float(OPEN), 0.0, 0.0
    with r.count(m.count) as k:
        is_pair = m.unit("width")[k] == 2.0
        row, rates = r.truncated(m.unit("first")[k]), m.row("rates")
        size, is_back = size_of_slip(r, row, is_pair, rates)[2], rates[row] * x[k] < 0.0
        begins = (state[k] == float(GOES_ON)) & (is_pair | is_back) & is_still(r, m, k, size)
        chosen[k] = r.choose((state[k] == float(STICKS)) | begins, 1.0, 0.0)
    r.give(r.call("hold", r.arguments[0]))
    return r


def _check() -> Routine:
    """Refuse a gap that begins inside, or a freewheel that begins the way that is locked."""
    r, m, () = open_routine("check_inside")
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


def _resolve() -> Routine:
    """Find what becomes of gaps and slips at a moment: the speeds change, and the states after it are written."""
    r, m, (t, checks, sums) = open_routine("resolve", {"t": NUMBER, "checks": INTEGER, "sums": INTEGER}, exported=True)
    m.finite, m.blur, m.pace, m.logged, m.stops, m.shared, m.in_turn = 1.0, 1.0, 1.0, 0, 0, 0, 0
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


_OTHERS = (
    *(*SOLVING, *CHECKING, *FINDING, *SHARES, *IMPACTS, *SERIES, *STOPPING),
    *(_read, _hold, _barely_rising, _settle, _check),
)


def write_sets() -> list[Routine]:
    """Return the routines; they take the address of the memory of sets, and ``resolve`` is the one to be called."""
    return [_resolve(), *(write() for write in _OTHERS)]
