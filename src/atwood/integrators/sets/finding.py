"""Routines that look for states that contradict nothing, as `atwood.numerics.contact_sets` does.

They change `next` of the chosen units; `found` has what one begins from. Where a set is not found by changing the worst
state, all that slips is tried both ways; `shared` is 1 where two ways come to the same motion.
"""

from __future__ import annotations

from itertools import product

from atwood.codegen.routines import BOOLEAN, INTEGER, Routine
from atwood.integrators.sets.record import (
    copy_states,
    each_unit,
    limit_of,
    norm,
    open_routine,
    product_of,
    size_of_slip,
    small_motion,
)
from atwood.integrators.sets.sizes import SHARED
from atwood.numerics.contact_sets import GOES_ON, OPEN, SLACK, STICKS, SWEEPS, TIGHT

_SETS = 12
"""Times the number of gaps and slips: so many sets are tried."""


def _improved() -> Routine:
    """Change the state that contradicts most, until none does; 1 where that does not end."""
    r, m, () = open_routine("improve")
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
    r, m, () = open_routine("find_states")
    state, x, y, given = m.unit("next"), m.unit("next_x"), m.unit("next_y"), m.unit("given")

    def allow(closes: bool) -> None:
        with each_unit(r, m, "chosen") as (k, _, _):
            is_slip, goes = m.unit("slip")[k] != 0.0, (state[k] == float(GOES_ON)) & ((x[k] != 0.0) | (y[k] != 0.0))
            kept = (goes | (~is_slip & (state[k] == 0.0))) if not closes else (state[k] != state[k])
            with r.when(given[k] != 0.0):
                state[k], x[k], y[k] = float(GOES_ON), m.unit("given_x")[k], m.unit("given_y")[k]
            with r.otherwise(), r.when(~kept):
                state[k], x[k], y[k] = float(STICKS), 0.0, 0.0

    copy_states(r, m, "found", "next")
    for closes, slack in product((False, True), (TIGHT, SLACK)):
        m.slack = slack
        copy_states(r, m, "next", "found")
        allow(closes)
        with r.when(r.call("improve", r.arguments[0]) == 0):
            m.shared = r.choose(m.repeats != 0, 1, m.shared, INTEGER)
            r.give(0)
    some, after = r.variable(False, BOOLEAN), m.row("after")
    for way in (1.0, -1.0):  # where slips and gaps move each other; others may be nearer
        allow(True)
        with each_unit(r, m, "chosen") as (k, row, is_pair), r.when((m.unit("slip")[k] != 0.0) & (given[k] == 0.0)):
            a, b, size = size_of_slip(r, row, is_pair, m.row("wanted"))
            has_way = ~is_pair | (size > 0.0)
            unit = r.choose(is_pair & has_way, size * way, 1.0)
            state[k] = r.choose(has_way, float(GOES_ON), float(STICKS))
            x[k], y[k] = r.choose(is_pair, a / unit, way), r.choose(is_pair, b / unit, 0.0)
        with r.when(r.call("improve", r.arguments[0]) == 0):
            small = small_motion(r, m)
            with r.count(m.size) as i, r.when(some.now & (r.size(m.row("motions")[i] - after[i]) > small * SHARED)):
                r.give(1)
            r.copy(after, m.row("motions"), m.size)
            some.now, m.shared = True, 1
            copy_states(r, m, "found", "next")
    with r.when(some.now):
        copy_states(r, m, "next", "found")
        r.give(r.call("meet_states", r.arguments[0]))
    r.call("relax", r.arguments[0])
    r.give(r.call("improve", r.arguments[0]))
    return r


def _relaxed() -> Routine:
    """Choose the states of forces that are projected one by one on what they may be (Jean and Moreau, 1992)."""
    r, m, () = open_routine("relax")
    forces, free, size, response = m.row("forces"), m.row("wanted"), m.size, m.result("response")
    state, x, y = m.unit("next"), m.unit("next_x"), m.unit("next_y")
    fallen, moved, most = r.variable(0.0), r.variable(0.0), r.variable(0.0)
    r.clear(forces, forces.at(size))
    with r.count(size) as i:
        fallen.now = r.most(fallen.now, r.size(free[i]))
    with r.count(SWEEPS):
        moved.now, most.now = 0.0, 0.0
        with each_unit(r, m, "chosen") as (k, row, is_pair):
            first, second = row, row + is_pair.integer()
            own = response[first * size + first] + r.choose(is_pair, response[second * size + second], 0.0)
            step = 1.0 / r.choose(own > 0.0, own, 1.0)
            a, b = (free[i] + product_of(r, size, response.at(i * size), forces) for i in (first, second))
            motion = norm(r, a, r.choose(is_pair, b, 0.0))
            before = r.variable(forces[first]).now, r.variable(forces[second]).now
            push = before[0] - step * a, r.choose(is_pair, before[1] - step * b, 0.0)
            length, given = r.variable(norm(r, *push)).now, m.unit("given")[k] != 0.0
            group = (~is_pair & (push[0] > 0.0)).integer() * 2
            holds = r.choose(m.unit("slip")[k] == 0.0, push[0] > 0.0 - limit_of(r, m, k, 1), length == 0.0, BOOLEAN)
            limit = r.variable(r.most(limit_of(r, m, k, group), 0.0)).now
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


FINDING = (_improved, _find, _relaxed)
