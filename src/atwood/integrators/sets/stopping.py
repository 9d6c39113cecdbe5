"""Routines that stop what has impacts that have accumulated; `stopped` marks it."""

from __future__ import annotations

from atwood.codegen.routines import BOOLEAN, INTEGER, Routine
from atwood.integrators.sets.impacts import work_of
from atwood.integrators.sets.record import (
    GAINS,
    choose_slips,
    each_unit,
    give_way,
    is_still,
    open_routine,
    size_of_slip,
)
from atwood.integrators.sets.series import ALIKE
from atwood.integrators.sets.sizes import GAIN
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS


def _stop() -> Routine:
    """Stop what touches with impacts that have accumulated; what bounced rubs as much. What has stuck goes on to.

    What would make energy waits for an impact to come, or where the series has nearly ended, does not rub.
    """
    r, m, () = open_routine("stop")
    chosen, slow, rates, given = m.unit("chosen"), m.unit("slow"), m.row("rates"), m.unit("given")
    series = m.unit("series")
    r.call("touching", r.arguments[0], result=INTEGER)
    with each_unit(r, m, "chosen") as (k, _, _), r.when(m.unit("series")[k] == 0.0):
        chosen[k] = 0.0  # it is near by, and has no such impacts
    coming = r.variable(0.0)
    with each_unit(r, m, "chosen") as (_, row, _):
        coming.now = r.most(0.0 - rates[row], coming.now)
    with each_unit(r, m, "chosen") as (k, row, _), r.when(rates[row] > r.most(coming.now * ALIKE, slow[k] * m.pace)):
        chosen[k] = 0.0  # it only passes: its impacts have not come to an end
    r.copy(m.unit("stopped"), chosen, m.count)
    m.told, state = -1, m.unit("state")
    with each_unit(r, m, "chosen") as (k, _, _):
        with r.when(m.told < 0):
            m.told = k
        with r.when((state[k] == float(OPEN)) & (state[m.told] != float(OPEN))):  # and was not closed all along
            m.told = k
    m.pace, m.finite = 1.0, 0.0
    choose_slips(r, m)
    with r.count(m.count) as k, r.when(m.unit("slip")[k] != 0.0):
        still = m.unit("state")[k] == float(STICKS)
        chosen[k] = r.choose(still, 1.0, r.choose(m.unit("at")[k] >= 0.0, chosen[k], 0.0))
    r.clear(given, given.at(m.count))
    with each_unit(r, m, "chosen") as (k, row, is_pair):
        slides = (m.unit("slip")[k] != 0.0) & (m.unit("state")[k] != float(STICKS))
        way = size_of_slip(r, row, is_pair, rates)
        with r.when(slides & ~is_still(r, m, k, way[2])):
            give_way(r, m, k, way, 1.0)
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
    r, m, () = open_routine("end_impacts")
    chosen, rates, given, turned = m.unit("chosen"), m.row("rates"), m.unit("given"), r.variable(False, BOOLEAN)
    with r.forever() as loop:
        with r.count(m.count) as k:
            state = r.choose(given[k] != 0.0, float(GOES_ON), float(STICKS))
            m.unit("next")[k] = r.choose(chosen[k] != 0.0, state, float(OPEN))
            for one in "xy":
                m.unit(f"next_{one}")[k] = r.choose(given[k] != 0.0, m.unit(f"given_{one}")[k], 0.0)
        r.call("meet_states", r.arguments[0])
        turned.now = False
        with each_unit(r, m, "given") as (k, row, is_pair):
            a, b, _ = size_of_slip(r, row, is_pair, m.row("motions"))
            with r.when(a * m.unit("given_x")[k] + b * m.unit("given_y")[k] <= 0.0):
                given[k], turned.now = 0.0, True
        with r.when(~turned.now):
            r.leave(loop)
    work, size = r.variable(0.0), r.variable(0.0)
    with r.count(m.size) as i:
        done, size_of_work = work_of(r, m.row("forces")[i], rates[i], m.row("motions")[i])
        work.now, size.now = work.now + done, size.now + size_of_work
    r.give_if(work.now > size.now * GAIN, GAINS)
    r.give(0)
    return r


STOPPING = (_stop, _end_impacts)
