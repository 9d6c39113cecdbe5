"""The routine that changes a set of contacts at an event, and the routines that it calls; see `set_jumps`."""

from __future__ import annotations

from atwood.codegen.routines import ADDRESS, BOOLEAN, CODE, INTEGER, NUMBER, Record, Routine, Value
from atwood.integrators.event_location import ALIKE, FIELDS as LOCATOR, LONGEST, PASSED, SHORT, TINY
from atwood.integrators.event_routines import Search
from atwood.integrators.set_jumps import EVENTS, HEAD, JUMP, MOST_IMPACTS
from atwood.integrators.sets.record import CLOSES, ENTRY, FIELDS, Sets
from atwood.integrators.sets.resolve import write_sets
from atwood.integrators.sets.series import LONG
from atwood.numerics.contact_sets import OPEN


class _Leap(Record):
    """The memory of changes of sets within a routine."""

    def event(self, name: str) -> Value:
        """Return the address of a number for each event."""
        table: Value = self.table
        return table.at(self.events * EVENTS.index(name))


def _open(name: str, exported: bool = False) -> tuple[Routine, _Leap, Search, Sets]:
    more = {"locator": ADDRESS, "t": NUMBER} if exported else {"locator": ADDRESS}
    r = Routine(name, {"place": ADDRESS, **more}, CODE, exported)
    m = _Leap(r.arguments[0], JUMP)
    return r, m, Search(r.arguments[1], LOCATOR), Sets(m.sets, FIELDS)


def _triggers() -> Routine:
    """Say which gaps and slips events belong to that have been found."""
    r, m, search, sets = _open("take_triggers")
    found, trigger = search.row("found"), sets.unit("trigger")
    r.clear(trigger, trigger.at(sets.count))
    with r.count(search.count) as i, r.when(found[i] != 0.0):
        trigger[r.truncated(m.event("unit")[i])] = m.event("code")[i]
    r.give(0)
    return r


def _sharpen() -> Routine:
    """Find by how much an event was seen after its zero, whose time it takes where it had a margin to pass.

    Other times are rounded, and always past the zero.
    """
    r, m, search, _ = _open("sharpen")
    time, y, yp, found, shift, size = search.root, search.y, search.yp, search.row("found"), m.shift, search.size
    now, before, since = search.row("lower"), search.row("upper"), time - m.began
    m.late, m.now, m.then = 0.0, time, time
    r.give_if(~(since > 0.0), 0)
    short, shifted = since * SHORT, search.shifted
    with r.count(size) as j:
        shifted[j] = y[j] - short * yp[j]
    r.call(search.events, time, y, yp, now, search.data)
    r.call(search.events, time - short, shifted, yp, before, search.data)
    least, most = r.variable(1e300), r.variable(-1e300)
    all_, armed, plain = (r.variable(True, BOOLEAN) for _ in range(3))
    with r.count(search.count) as i, r.when(found[i] != 0.0):
        margin = shift[i]
        value = now[i] - margin
        rate = (now[i] - before[i]) / short
        armed.now, plain.now = armed.now & (margin != 0.0), plain.now & (margin == 0.0)
        clear = r.choose(margin == 0.0, value * rate, 0.0 - rate * margin) > 0.0
        all_.now = all_.now & clear & (r.size(value) < since * LONGEST * r.size(rate))
        late = value / rate
        least.now, most.now = r.least(late, least.now), r.most(late, most.now)
    with r.when(all_.now & armed.now & (most.now <= least.now * ALIKE)):
        m.late = least.now
        m.now, m.then = time - least.now, time - least.now
    with r.when(all_.now & plain.now):
        m.late = r.least(least.now, search.after - search.before)
        m.then = time - m.late
    r.give(0)
    return r


def _take() -> Routine:
    """Give the programs the states of gaps and slips that are in rows of the units."""
    r = Routine("take_states", {"place": ADDRESS, "states": ADDRESS}, CODE)
    m, rows = _Leap(r.arguments[0], JUMP), r.arguments[1]
    sets, values = Sets(m.sets, FIELDS), m.values
    count, places, is_loose = sets.count, m.places, r.variable(1, INTEGER)
    with r.count(count) as k:
        is_loose.now = r.choose(rows[k] == float(OPEN), is_loose.now, 0)
        is_slip = sets.unit("slip")[k] != 0.0
        state = r.choose(is_slip, rows[k], rows[k] * 0.5)
        values[r.truncated(places[k])] = state
        way = places[count + k]
        with r.when(way >= 0.0):
            values[r.truncated(way)] = rows[count + k]
    m.loose = is_loose.now
    for name in ("kernel", "nearer", "event"):
        prologue: Value = getattr(m, f"{name}_prologue")
        scratch = m.event_scratch if name == "event" else m.scratch
        r.call(prologue, values, getattr(m, f"{name}_derived"), scratch, result=None)
    r.give(0)
    return r


def _take_relations() -> Routine:
    """Give the programs the relations that hold from the last change of parameters on."""
    r = Routine("take_relations", {"place": ADDRESS}, CODE)
    m = _Leap(r.arguments[0], JUMP)
    sets, values = Sets(m.sets, FIELDS), m.values
    r.copy(values.at(m.relations_at), m.relations.at(m.changed * m.others), m.others)
    r.call(m.set_prologue, values, sets.derived, sets.scratch, result=None)
    with r.when(m.chooses != 0):
        r.call(m.loose_prologue, values, m.loose_derived, m.loose_scratch, result=None)
        r.call(m.loose_nearer_prologue, values, m.loose_nearer_derived, m.loose_scratch, result=None)
    r.give(0)
    return r


def _rates() -> Routine:
    """Return the rates of the present set; where all are open, by the shorter program."""
    r = Routine("rates", {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}, CODE, exported=True)
    t, y, yp, data = r.arguments
    m = _Leap(data, JUMP)
    with r.when(m.loose != 0):
        r.give(r.call(m.loose_rates, t, y, yp, m.loose_data))
    r.give(r.call(m.whole_rates, t, y, yp, m.whole_data))
    return r


def _project() -> Routine:
    """Take a state onto what the present set holds."""
    r = Routine("project", {"t": NUMBER, "y": ADDRESS, "data": ADDRESS}, CODE, exported=True)
    t, y, data = r.arguments
    m = _Leap(data, JUMP)
    with r.when(m.loose != 0):
        r.give(r.call(m.loose_project, t, y, m.loose_project_data))
    r.give(r.call(m.whole_project, t, y, m.whole_project_data))
    return r


def _meet() -> Routine:
    """Take the coordinates to where what was found to be closed is met."""
    r, m, _, sets = _open("meet_closed")
    closed, states, some = sets.unit("closed"), m.states, r.variable(False, BOOLEAN)
    count, size, y, near = sets.count, m.size, sets.y, m.near
    with r.count(count) as k:
        states[k], states[count + k] = closed[k] * 2.0, 0.0
        some.now = some.now | (closed[k] != 0.0)
    r.give_if(~some.now, 0)
    r.call("take_states", r.arguments[0], states)
    r.copy(near, y, size)
    r.give_if(r.call(m.project, m.then, near, m.project_data) != 0, 1)
    r.copy(y, near, sets.coordinates)
    r.give(0)
    return r


def _arm() -> Routine:
    """Take margins of the events in the new set; 1 where one of them has happened there already."""
    r, m, search, sets = _open("arm")
    shift, values, small = m.shift, search.row("others"), m.event("small")
    with r.count(search.count) as i:
        shift[i] = 0.0
    r.give_if(r.call(search.events, m.now, sets.y, search.yp, values, search.data) != 0, 1)
    rates = sets.row("rates")
    with r.count(search.count) as i:
        value = values[i]
        row = r.truncated(sets.unit("first")[r.truncated(m.event("unit")[i])])
        is_near = r.size(value) <= small[i]
        is_gap = (m.event("code")[i] == float(CLOSES)) & (m.event("placed")[i] != 0.0)
        opens = is_gap & is_near & (rates[row] * m.time > small[i])
        r.give_if((value < small[i] * -PASSED) & ~opens, 1)
        margin = r.choose(opens, r.choose(value > 0.0, 0.0, r.size(value) * 2.0 + TINY), small[i])
        shift[i] = r.choose(is_near, margin, 0.0)
    r.give(0)
    return r


def _log() -> Routine:
    """Write what has happened into the log, and remember impacts."""
    r, m, _, sets = _open("log_jump")
    size, count, past = m.size, sets.count, sets.past
    entry = m.log.at(m.logged * m.stride)
    stopped = r.choose(sets.stops == 0, -1, sets.told, INTEGER)
    entry[0], entry[1], entry[2], entry[3] = m.now, stopped.number(), sets.ahead, sets.logged.number()
    r.copy(entry.at(HEAD), m.before, size)
    r.copy(entry.at(size + HEAD), sets.y, size)
    r.copy(entry.at(size * 2 + HEAD), sets.unit("next"), count * 3)
    r.copy(entry.at(size * 2 + count * 3 + HEAD), sets.log, sets.logged * (sets.size + len(ENTRY)))
    m.logged = m.logged + 1
    with r.count(sets.logged) as i:
        struck = r.truncated(sets.log[i * (sets.size + len(ENTRY))])
        with r.when(sets.known == LONG):
            with r.count((LONG - 1) * 2) as j:
                past[j] = past[j + 2]
            sets.known = LONG - 1
        last = past.at(sets.known * 2)
        last[0], last[1] = m.then, sets.unit("part")[struck]
        sets.known = sets.known + 1
    r.give(0)
    return r


def _jump() -> Routine:
    """Change the set at an event: the state becomes that after it; 1 where that is left to Python, and all stays.

    Where nothing has passed zero, parameters change as the set may.
    """
    r, m, search, sets = _open("jump", exported=True)
    place, locator, t = r.arguments
    size, y, states, count = m.size, sets.y, sets.unit("next"), sets.count
    r.give_if((m.logged >= m.capacity) | (t - m.began <= m.shortest), 1)
    found, happens = search.row("found"), r.variable(False, BOOLEAN)
    with r.count(search.count) as i:
        happens.now = happens.now | (found[i] != 0.0)
    changes = ~happens.now
    r.copy(m.margins, m.shift, search.count)
    r.call("take_triggers", place, locator)
    m.late, m.now, m.then = 0.0, t, t
    with r.when(changes):
        m.changed = m.changed + 1
        r.call("take_relations", place)
    with r.otherwise():
        r.call("sharpen", place, locator)
    with r.when(search.told > m.now):  # a state behind the event was read from the step before
        _back(r, m, search, changes)
    with r.count(size) as j:
        y[j], m.before[j] = search.y[j] - m.late * search.yp[j], search.y[j] - (t - m.now) * search.yp[j]
    sets.ahead, sets.rough, sets.later = m.ahead, m.rough, m.later
    with r.when(r.call("resolve", m.sets, m.then, r.value(0, INTEGER), r.value(1, INTEGER)) != 0):
        _back(r, m, search, changes)
    some = r.variable(False, BOOLEAN)
    with r.count(count) as k:
        some.now = some.now | (states[k] != float(OPEN))
    with r.when(~(some.now | (m.stays != 0)) | (sets.logged > MOST_IMPACTS) | (sets.shared != 0)):
        _back(r, m, search, changes)
    with r.when(r.call("meet_closed", place, locator) != 0):
        _back(r, m, search, changes)
    r.call("take_states", place, states)
    with r.when(r.call(m.rates, m.now, y, m.near, m.rates_data) != 0):
        _back(r, m, search, changes)
    rest = m.late - (t - m.now)
    with r.count(size) as j:
        y[j] = y[j] + rest * m.near[j]
    with r.when(r.call("arm", place, locator) != 0):
        _back(r, m, search, changes)
    r.call("log_jump", place, locator)
    r.copy(search.y, y, size)
    r.copy(sets.unit("state"), states, count * 3)
    m.began, search.root = m.now, m.now
    given, seen = search.row("given"), m.seen
    with r.count(search.count) as i:
        given[i] = 1.0
    r.clear(seen, seen.at(search.count * 3 + 3))
    seen[0] = m.now
    search.is_first = 1
    with r.when(changes):
        search.change = m.changes[m.changed]
    r.give(0)
    return r


def _back(r: Routine, m: _Leap, search: Search, changes: Value) -> None:
    """Leave it to Python, with the states, margins and relations of before."""
    with r.when(changes):
        m.changed = m.changed - 1
        r.call("take_relations", r.arguments[0])
    r.call("take_states", r.arguments[0], Sets(m.sets, FIELDS).unit("state"))
    r.copy(m.shift, m.margins, search.count)
    r.give(1)


def write_routines() -> list[Routine]:
    """Return the routine ``jump``, and what it calls; it takes the address of its memory, a search, and a time.

    And the rates of sets; they take that memory for their data.
    """
    return [
        *write_sets(),
        *(write() for write in (_triggers, _sharpen, _take, _take_relations, _meet, _arm, _log, _jump)),
        _rates(),
        _project(),
    ]
