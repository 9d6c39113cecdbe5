"""Steps of an embedded pair, for any number of unknowns and any right-hand side.

E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, Springer 1993: the
choice of steps in section II.4, the error of two estimates in section II.10.  All that the routines know of a problem
comes in through addresses, so that they are compiled once and kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf, nan, prod

from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Kind, Record, Routine, Value
from atwood.integrators.embedded.dense_output import slopes, weighted, write_dense_output, write_polynomial
from atwood.integrators.embedded.stepper import open_routine
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.event_location import FIELDS as LOCATOR, FOUND, NO_STATE, ROUNDING, ROWS
from atwood.integrators.protocol import CROSSED
from atwood.integrators.stepper import (
    CALM,
    PROJECT_ARGUMENTS,
    SAMPLE_ARGUMENTS,
    STIFF,
    WIDTH,
    Memory,
    write_project_each,
    write_sample,
)

SAFETY = 0.9
GROWTH, SHRINKAGE = 6.0, 3.0
"""A step is at most so many times longer or shorter than the one before."""

APART = 0.01
"""The square of the estimate of fifth order is not taken to be larger by its likeness than this times the third's.

The error is the product of two embedded estimates. Each has its zeros along a motion: where that of fifth order comes
near to one, a step that errs by ten tolerances looks good, above all with few unknowns and where steps are tried again
until one looks good. But the ratio of both, which grows as the square of the step, changes slowly from step to step. So
the estimate is taken to be no smaller than the ratio in the step before makes it.
"""

RETREAT = 0.25
"""The share of a step that is tried where a step had no finite value."""

_PROBE, _TRIED = 1e-6, 100.0
"""Before the first step the share of a run is tried, where the slope at its begin leads less far in it than is allowed,
else so many times what is allowed: how large values are far from the origin says nothing of when slopes change."""

_AWAY = 1e-6
"""The share of what is allowed at a value that counts as allowed at the origin, if less than that is."""

_BEHIND, _ROUGH = 1.001, 0.01
"""A step is taken anew with so many times the length up to an event, where the last term of its dense output is there
larger than this share of what is allowed."""

_STRETCH = 1.5
"""The end of a step takes the place of a look that was wanted before, if that makes the way to it longer by no more."""

_DIGITS = 8
"""Binary digits to which the inverse of an order is known: roots are right to some percent."""

_PATIENCE = 32
"""After so many steps without a look the motion is looked at, however little it has moved: perhaps what keeps steps
short is what is looked for."""

_REACHED, _USED_UP, _TOO_SMALL, _NO_VALUE, _NO_RATES, _NOTICED = range(6)
"""How a routine ends; `_NOTICED` after a step in which an event may have happened, after which the problem seems stiff
and that is heeded, or in which something was seen by what watches the motion."""


def _stage(pair: Tableau, stage: int, runs: int = 1) -> Routine:
    """Write the values at which a slope is taken, or the new values."""
    r, m, (h,) = open_routine(pair, f"stage{stage}", {"h": NUMBER}, runs=runs)
    base, trial, last = m.row("y_old" if stage > pair.end else "y"), m.row("trial"), m.row("last")
    with m.parts() as j:
        value = m.lanes(base, j) + weighted(m, pair.stages[stage - 1], j) * h
        trial[j] = value
        if stage == pair.end - 1:
            last[j] = value
    r.give(0)
    return r


def _sum(r: Routine, m: Memory, square: Callable[[Value], Value]) -> Value:
    """Return the sum of squares over all unknowns."""
    if m.runs == 1:
        total = r.variable(0.0, m.part)
        with m.parts() as j:
            total.now = total.now + square(j)
        return r.sum_of_lanes(total.now)
    totals = [r.variable(0.0, m.part) for _ in range(WIDTH)]  # of the unknowns that have one lane in a run alone
    with r.count(m.padded, step=WIDTH * m.runs) as j:
        for k, one in enumerate(totals):
            one.now = one.now + square(j + k * m.runs)
    return sum((one.now for one in totals[1:]), start=totals[0].now)


def _squares(r: Routine, m: Memory, weights: Mapping[int, float]) -> Value:
    """Return the sum of the squares of an error estimate in units of the tolerances."""
    y, trial, absolute, relative = m.row("y"), m.row("trial"), m.row("absolute"), m.relative

    def square(j: Value) -> Value:
        size = r.most(r.size(m.lanes(y, j)), r.size(m.lanes(trial, j)))
        error = weighted(m, weights, j) / (size * relative + m.lanes(absolute, j))
        return error * error

    return _sum(r, m, square)


def _size(r: Routine, m: Memory, a: Value) -> Value:
    """Return the root of the mean square of a row, in units of what is allowed at y."""
    y, absolute, relative = m.row("y"), m.row("absolute"), m.relative

    def square(j: Value) -> Value:
        scaled = m.lanes(a, j) / (r.size(m.lanes(y, j)) * relative + m.lanes(absolute, j))
        return scaled * scaled

    return r.sqrt(_sum(r, m, square) / m.size.number())


def _pace(r: Routine, m: Memory, a: Value, less: Value | None = None) -> Value:
    """Return a size of a row, or of a difference, in units of what is allowed at the origin.

    What is allowed far from the origin says nothing of the size of a motion there; a millionth of it counts at least.
    """
    y, absolute, relative = m.row("y"), m.row("absolute"), m.relative

    def square(j: Value) -> Value:
        value = m.lanes(a, j) if less is None else m.lanes(a, j) - m.lanes(less, j)
        scaled = value / r.most(m.lanes(absolute, j), r.size(m.lanes(y, j)) * (relative * _AWAY))
        return scaled * scaled

    return r.sqrt(_sum(r, m, square) / m.size.number())


def _distance(r: Routine, m: Memory, a: int | str, b: int | str) -> Value:
    """Return the square of the distance between two rows."""
    first, second = m.row(a), m.row(b)

    def square(j: Value) -> Value:
        apart = m.lanes(first, j) - m.lanes(second, j)
        return apart * apart

    return _sum(r, m, square)


def _evaluate(pair: Tableau) -> Routine:
    """Take a slope from a row to a row, and count it; what the right-hand side returned."""
    r, m, (t, source, target) = open_routine(pair, "evaluate", {"t": NUMBER, "source": ADDRESS, "target": ADDRESS})
    code = r.call(m.function, t, source, target, m.data)
    m.evaluations = m.evaluations + 1
    m.undefined = m.undefined + (code != 0).integer()
    r.give(code)
    return r


def root_of(r: Routine, a: Value, order: int) -> Value:
    """Return the root of an order, by square roots: one for each binary digit of its inverse, eight at most."""
    share, found = 1.0 / order, list[Value]()
    for _ in range(_DIGITS):
        a, share = r.sqrt(a), 2.0 * share
        if share >= 1.0:
            found.append(a)
            share -= 1.0
        if not share:
            break
    return prod(found[1:], start=found[0])


def first_step(pair: Tableau, r: Routine, m: Memory, t: Value, begin: Value) -> Value:
    """Return the first step by the size of the first two derivatives (Hairer, Norsett and Wanner, section II.4).

    The book takes a root of the larger of both, so that its step depends on the unit of time.  Here the time in which
    the slope changes by itself is the unit, or that in which its change leads as far as is allowed, if that is longer;
    how far the change leads in that time is what a power of the step is a share of.

    `begin` is where the slope at the begin lies. What is almost zero, as the speed of what has just begun to slip, asks
    for a step that would not move the time: it is so long that the time tells it to four digits.
    """
    bound = r.least(m.horizon, m.longest)
    told = r.size(t) * (1e4 * ROUNDING)
    y, trial, probe = m.row("y"), m.row("trial"), m.row("last")
    d0, d1 = _pace(r, m, y), _pace(r, m, begin)
    moves, size = d1 * bound > 1.0, r.most(d0, 1.0)
    h0 = r.choose(moves, r.least(size * 0.01, _TRIED) / d1, bound * _PROBE)
    h0 = r.least(r.most(h0, told), bound)
    reach = r.choose(moves, r.most(size / d1, told), h0 * 100.0)
    with m.parts() as j:
        trial[j] = m.lanes(y, j) + m.lanes(begin, j) * h0
    code = r.call("evaluate", m.session, t + h0, trial, probe)
    change = _pace(r, m, probe, begin) / h0
    d2 = r.most(change, d1 * ROUNDING / h0)
    span = r.most(d1 / d2, r.sqrt(1.0 / d2))
    h1 = span * root_of(r, 0.01 / (d2 * span * span), pair.order)
    failed = code != 0 if m.runs == 1 else code.integer().conditions(m.runs)
    known = ~failed & (change < inf) & (h1 > 0.0)
    return r.choose(known, r.least(r.least(reach, r.most(h1, told)), bound), h0)


def _begin(pair: Tableau) -> Routine:
    """Start anew from a state."""
    r, m, (t, start) = open_routine(pair, "begin", {"t": NUMBER, "start": ADDRESS}, exported=True)
    m.t, m.t_old, m.looked, m.likeness = t, t, t, 0.0
    m.edgy, m.calm, m.looks, m.waits, m.crossed = 0, 0, m.steps, 0, 0
    r.copy(m.row("y"), start, m.size)
    r.copy(m.row("y_old"), start, m.size)
    r.give_if(r.call("evaluate", m.session, t, m.row("y"), m.row("end slope")) != 0, _NO_RATES)
    given = m.first
    with r.when(given > 0.0):
        m.next = r.least(given, m.longest)
        r.give(_REACHED)
    m.next = first_step(pair, r, m, t, m.row("end slope"))
    r.give(_REACHED)
    return r


def _look(pair: Tableau) -> Routine:
    """Tell whether an event may have happened in the last step."""
    r, m, (t,) = open_routine(pair, "look", {"t": NUMBER})
    count, values, signs = m.event_count, m.values, m.signs
    with r.when(count > 0):
        code = r.call(m.events, t, m.row("y"), m.row("end slope"), values, m.events_data)
        r.give_if(code != 0, 1)
        with r.count(count) as i, r.when(~(values[i] * signs[i] > 0.0)):
            r.give(1)
    r.give(0)
    return r


def _watched(pair: Tableau) -> Routine:
    """Look at the motion in the last step at the times that what watches it wants; 1 where something is seen.

    The end of a step is looked at instead where it is not much later: its state is there already.  It is looked at,
    too, after many steps that were not.  What is seen stays in `seen` until somebody asks; the looks that are then left
    in the step are taken when the steps go on. What has been passed is left when times behind its begin are asked for.
    """
    r, m, (t_new,) = open_routine(pair, "watched", {"t_new": NUMBER})
    watch, t, steps = m.watch, m.t_old, m.steps
    r.give_if(r.is_null(watch), 0)
    r.give_if(~(t < t_new), 0)
    y, end, trial, last = m.row("y"), m.row("end slope"), m.row("trial"), m.row("last")
    with r.forever():
        due = m.due[0]
        is_within = due <= t_new
        r.give_if(~is_within & (steps - m.looks < _PATIENCE), 0)
        looked, inside = m.looked, r.variable(False, BOOLEAN)
        with r.when(is_within & ~(t_new - looked <= (due - looked) * _STRETCH)):
            is_dense = r.call("densify", m.session) == 0
            with r.when(is_dense):
                share = (due - t) / m.h
                r.call("polynomial", m.session, share)
                r.call("slope", m.session, share)
                inside.now = True
        is_inside = inside.now
        moment = r.choose(is_inside, due, t_new)
        m.looked, m.looks = moment, steps
        places = r.choose(is_inside, trial, y), r.choose(is_inside, last, end)
        code = r.call(watch, moment, *places, m.watch_data)
        with r.when(code == CROSSED):
            m.crossed = 1
            r.give(0)
        with r.when(code != 0):
            m.seen = 1
            r.give(1)
    return r


def _project(pair: Tableau) -> Routine:
    """Take the values at the end of a step onto the constraints; 0, or another number where that fails.

    It comes before the last slope is taken, so that the next step begins with the slope of the state that is kept, and
    the dense output meets the constraints at both ends.
    """
    r, m, (t,) = open_routine(pair, "held", {"t": NUMBER})
    project = m.project
    r.give_if(r.is_null(project), 0)
    r.give(r.call(project, t, m.row("trial"), m.project_data))
    return r


def _guarded(pair: Tableau) -> Routine:
    """Ask what judges steps about one that is good enough otherwise; 0 where it is good."""
    r, m, (t, t_new) = open_routine(pair, "guarded", {"t": NUMBER, "t_new": NUMBER})
    guard = m.guard
    r.give_if(r.is_null(guard), 0)
    ends = (t, m.row("y"), m.row(0), t_new, m.row("trial"), m.row("end slope"))
    r.give(r.call(guard, *ends, m.guard_data))
    return r


def _error(pair: Tableau, runs: int = 1) -> Routine:
    """Return the error of a step in units of what is allowed.

    Of two estimates it is made as in Hairer, Norsett and Wanner, section II.10. Where that of fifth order comes near to
    one of its zeros, the ratio of both in the step before tells how large it is; that of this step is kept as `tried`.
    """
    r, m, (h,) = open_routine(pair, "error", {"h": NUMBER}, result=NUMBER, runs=runs)
    own = _squares(r, m, pair.errors[0])
    if len(pair.errors) == 1:
        r.give(h * r.sqrt(own / m.size.number()))
        return r
    third = _squares(r, m, pair.errors[1])
    h4 = h * h * (h * h)
    before = third * r.least(h4 * m.likeness, APART)
    fifth, spread = r.choose(own < before, before, own), h4 * third
    m.tried = r.choose(spread > 0.0, own / spread, 0.0)
    both = fifth + third * 0.01
    error = h * fifth / r.sqrt(both * m.size.number())
    r.give(r.choose(both == 0.0, 0.0, error))
    return r


def _stability(pair: Tableau, runs: int = 1) -> Routine:
    """Count steps at the edge of stability, of many runs those that are kept; 1 where one has just turned out stiff."""
    more: dict[str, Kind] = {"h": NUMBER} if runs == 1 else {"h": NUMBER, "accepted": INTEGER}
    r, m, (h, *accepted) = open_routine(pair, "stability", more, runs=runs)
    turned, apart = _distance(r, m, "end slope", pair.end - 1), _distance(r, m, "trial", "last")
    is_edgy = (h * r.sqrt(turned / apart) > pair.edge) & (apart > 0.0)
    before, calm_before = m.edgy, m.calm
    edgy, calm = r.choose(is_edgy, before + 1.0, before), r.choose(is_edgy, 0.0, calm_before + 1.0)
    found = is_edgy & (edgy == float(STIFF))
    edgy = r.choose((calm == float(CALM)) | found, 0.0, edgy)
    if runs == 1:
        m.stiff, m.calm, m.edgy = m.stiff + found.integer(), calm, edgy
        r.give(found.code())
        return r
    good = accepted[0].conditions(runs)
    m.edges = m.edges + r.choose(found & good, 1.0, 0.0)
    m.calm, m.edgy = r.choose(good, calm, calm_before), r.choose(good, edgy, before)
    r.give(0)
    return r


def _attempt(pair: Tableau) -> Routine:
    """Try steps until one is good enough, and keep it; `_TOO_SMALL` where none is."""
    r, m, () = open_routine(pair, "attempt")
    t, h, shortened = m.t, r.variable(m.next), r.variable(False, BOOLEAN)
    least, longest = r.size(t) * (10.0 * 2.0**-52), m.longest
    with r.forever() as attempts:
        h.now = r.least(h.now, longest)
        step = h.now
        r.give_if(~((step > least) & (step >= 1e-300)), _TOO_SMALL)

        def retreat() -> None:
            h.now, shortened.now = step * RETREAT, True
            m.failures = m.failures + 1
            r.repeat(attempts)

        slopes(pair, r, m, range(1, pair.end), t, step, retreat)
        r.call(f"stage{pair.end}", m.session, step)
        t_new = t + step

        def arrive() -> None:
            with r.when(r.call("held", m.session, t_new) != 0):
                retreat()
            with r.when(r.call("evaluate", m.session, t_new, m.row("trial"), m.row("end slope")) != 0):
                retreat()

        if pair.judges_end:
            arrive()
        error = r.call("error", m.session, step, result=NUMBER)
        factor = root_of(r, error, pair.order) / SAFETY
        with r.when(~(error <= 1.0)):
            with r.when(~(error < inf)):
                retreat()
            h.now, shortened.now = step * (1.0 / r.least(factor, SHRINKAGE)), True
            m.failures = m.failures + 1
            r.repeat(attempts)
        if not pair.judges_end:
            arrive()
        with r.when(r.call("guarded", m.session, t, t_new) != 0):
            retreat()
        within = r.least(r.choose(factor < 1.0 / GROWTH, 1.0 / GROWTH, factor), SHRINKAGE)
        grown = step / within
        m.next = r.choose((grown > step) & shortened.now, step, grown)
        m.likeness = m.tried
        m.h, m.t_old, m.t = step, t, t_new
        m.steps = m.steps + 1
        r.give(0)
    return r


def _run(pair: Tableau) -> Routine:
    """Take steps until one ends at or after the time to stop at."""
    r, m, () = open_routine(pair, "run", exported=True)
    own, locates = Record(m.locator, LOCATOR), ~r.is_null(m.jump)
    with r.forever() as steps:
        with r.when(m.waits != 0):
            with r.when((m.waits == 1) & (m.stop < own.root)):
                own.told = m.stop
                r.give(_REACHED)
            r.give_if(r.call("leap", m.session) != 0, _NOTICED)
            r.repeat(steps)
        with r.when(m.crossed != 0):
            r.give_if(m.stop <= m.behind[0], _REACHED)
            r.give_if(r.call("begin", m.session, m.behind[1], m.behind.at(2)) != 0, _TOO_SMALL)
        t = m.t
        with r.when(t >= m.stop):
            with r.when(locates):
                own.told = m.stop
            r.give(_REACHED)
        r.give_if(m.steps >= m.limit, _USED_UP)
        r.give_if(r.call("watched", m.session, t) != 0, _NOTICED)
        with r.when(m.crossed != 0):
            r.repeat(steps)
        begin, end, y_old, y, trial = (m.row(one) for one in (0, "end slope", "y_old", "y", "trial"))
        with m.parts() as j:  # few numbers: to call the library for them takes longer
            begin[j] = m.lanes(end, j)
        m.is_dense = 0
        with r.when(r.call("attempt", m.session) != 0):
            r.copy(end, begin, m.padded)
            r.give(_TOO_SMALL)
        stiffens = (r.call("stability", m.session, m.h) != 0) & (m.watches_stiffness != 0)
        with m.parts() as j:
            y_old[j], y[j] = m.lanes(y, j), m.lanes(trial, j)
        t_new = m.t
        is_seen = r.call("watched", m.session, t_new) != 0
        happens = r.call("look", m.session, t_new) != 0
        with r.when(locates & (happens | (r.call("settles", m.session) != 0))):
            r.call("seek", m.session)
        r.give_if((happens & ~locates) | stiffens | is_seen | (m.waits == 2), _NOTICED)
    return r


def _settles(pair: Tableau) -> Routine:
    """Tell whether nothing is known yet of the first step after a start, or parameters change in the last step."""
    r, m, () = open_routine(pair, "settles")
    r.give_if(r.is_null(m.jump), 0)
    own = Record(m.locator, LOCATOR)
    r.give(((own.settling != 0) | (m.t >= own.change)).code())
    return r


def _seek(pair: Tableau) -> Routine:
    """Locate the first event in the last step; it then waits until the run comes there, or until Python asks.

    A change of parameters is one in which nothing has passed zero.
    """
    r, m, () = open_routine(pair, "seek")
    own = Record(m.locator, LOCATOR)
    last = r.least(m.last, own.change)
    until = r.least(m.t, last)
    with r.when(m.t_old < until):
        r.copy(own.kept, own.rows, own.count * len(ROWS))
        found = r.variable(r.call(m.search, m.locator, m.t_old, until).integer(), INTEGER)
        with r.when(found.now == FOUND), r.when(r.call("shorten", m.session, own.root) != 0):
            r.copy(own.rows, own.kept, own.count * len(ROWS))
            found.now = r.call(m.search, m.locator, m.t_old, r.least(m.t, last)).integer()
        m.found = found.now
        m.waits = r.choose(found.now == 0, 0, r.choose(found.now == FOUND, 1, 2, INTEGER), INTEGER)
    with r.when((m.waits == 0) & (m.t >= own.change)):
        places, found = own.rows.at(own.count * ROWS["found"]), r.variable(FOUND, INTEGER)
        r.clear(places, places.at(own.count))
        with r.when(r.call("interpolate", m.session, own.change, own.y, own.yp) != 0):
            found.now = NO_STATE
        own.root, own.here, m.found = own.change, nan, found.now
        m.waits = r.choose(found.now == FOUND, 1, 2, INTEGER)
    r.give(0)
    return r


def _shorten(pair: Tableau) -> Routine:
    """Take the last step anew to just behind an event, where its dense output is rough there; 1 where it was.

    Dense output is of a lower order than the steps, and nothing bounds its error; near the end it is as good as a step.
    """
    r, m, (event,) = open_routine(pair, "shorten", {"event": NUMBER}, exported=True)
    h, short = m.h, (event - m.t_old) * _BEHIND
    r.give_if(~((short < h) & (short > 0.0)), 0)
    r.give_if(r.call("densify", m.session) != 0, 0)
    x, term = short / h, _size(r, m, m.row("dense").at(m.padded * (pair.terms - 1)))
    for power in range(pair.terms):
        term = term * (1.0 - x if power % 2 else x)
    r.give_if(~(term > _ROUGH), 0)
    with r.when(r.call("retake", m.session, short) != 0):
        r.call("retake", m.session, h)
    r.give(1)
    return r


def _retake(pair: Tableau) -> Routine:
    """Take the last step anew with another length; 1 where there is no value."""
    r, m, (h,) = open_routine(pair, "retake", {"h": NUMBER})
    t = m.t_old + h
    r.copy(m.row("y"), m.row("y_old"), m.padded)
    slopes(pair, r, m, range(1, pair.end), m.t_old, h, lambda: r.give(1))
    r.call(f"stage{pair.end}", m.session, h)
    r.give_if(r.call("held", m.session, t) != 0, 1)
    r.give_if(r.call("evaluate", m.session, t, m.row("trial"), m.row("end slope")) != 0, 1)
    r.copy(m.row("y"), m.row("trial"), m.padded)
    m.h, m.t, m.is_dense, m.steps = h, t, 0, m.steps + 1
    r.give(0)
    return r


def _leap(pair: Tableau) -> Routine:
    """Make the jump at the event that waits, and start anew behind it; 1 where Python is to see to it."""
    r, m, () = open_routine(pair, "leap")
    r.give_if(m.waits == 2, 1)
    own = Record(m.locator, LOCATOR)
    m.waits = 2
    r.give_if(r.call(m.jump, m.jump_data, m.locator, own.root) != 0, 1)
    root = own.root  # it may have become earlier
    horizon = r.choose(m.finish > root, m.finish - root, 1.0)
    m.horizon, own.moment = horizon, horizon * (100.0 * ROUNDING)
    m.found = NO_STATE
    r.give_if(r.call("begin", m.session, root, own.y) != 0, 1)
    code = r.call(m.restart, m.locator, root)
    m.found = code.integer()
    r.give_if(code != 0, 1)
    m.waits = 0
    r.give(0)
    return r


def _sample(pair: Tableau) -> Routine:
    """Go through output times and fill a table; it ends as `run` does."""
    r, m, _ = open_routine(pair, "sample", SAMPLE_ARGUMENTS, exported=True)
    return write_sample(r, m, m.size)


def _project_each(pair: Tableau) -> Routine:
    """Take states, one row each, onto the constraints."""
    r, m, _ = open_routine(pair, "project_each", PROJECT_ARGUMENTS, exported=True)
    return write_project_each(r, m)


def write_routines(pair: Tableau) -> list[Routine]:
    """Return the routines of a pair.

    They take the address of a session; see `atwood.integrators.embedded.stepper`.
    """
    ends = (_begin, _run, _sample, _project_each, _shorten)
    inner = (
        _evaluate,
        _attempt,
        _error,
        _stability,
        _project,
        _guarded,
        _look,
        _watched,
        _settles,
        _seek,
        _retake,
        _leap,
    )
    written = [write(pair) for write in (*ends, *inner)]
    return [*written, *(_stage(pair, stage) for stage in range(1, len(pair.nodes))), *write_dense_output(pair)]


def write_inner(pair: Tableau, runs: int) -> list[Routine]:
    """Return what runs that are taken side by side do as one alone."""
    stages = [_stage(pair, stage, runs) for stage in range(1, len(pair.nodes))]
    return [_error(pair, runs), _stability(pair, runs), *stages, write_polynomial(pair, runs)]
