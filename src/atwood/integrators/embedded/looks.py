"""Events of runs side by side: which of them may have met one in a step, and what such a run is handed over with.

The looks are those that a run alone takes (`atwood.codegen.sundials.events`), and at its first step those of the search
for events (`atwood.integrators.event_location`). So a run in which nothing is noticed has no event.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, build_lanes
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Record, Routine, Value, addresses, place_of
from atwood.codegen.sundials.events import may_pass_zero
from atwood.codegen.tangents import SECANT
from atwood.expr.core.program import Program
from atwood.integrators.embedded.stepper import open_routine
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.lanes import LookPlaces
from atwood.integrators.protocol import Handed
from atwood.integrators.stepper import Memory, in_lanes
from atwood.lazy_dataclasses import dataclass

TABLES = ("shifts", "signs", "lasts", "slopes", "values", "others")
"""What is known of each event: what is added to it, its sign, and values and slopes at the last point and now."""

FIELDS: dict[str, Kind] = {"last": NUMBER, "length": NUMBER}
"""What comes before: the time of the last point, and the length over which slopes are taken."""

HANDED = ("t", "t_old", "h", "next", "likeness", "edgy", "calm", "taken", "edges")
"""The fields of a session that a run is handed over with, besides all rows and what is known of its events."""


@dataclass(frozen=True, eq=False)
class EventsOfMany:
    """Values of events of so many runs side by side as machine code: a program of (t, q, u, shift), and the code."""

    program: Program
    built: Built


def events_of_many(program: Program, runs: int) -> EventsOfMany:
    """Compile events of so many runs side by side.

    Raises
    ------
    UnsupportedError
        If there is no code in lanes for an operation of the program.
    """
    return EventsOfMany(program, build_lanes([Part("kernel", program)], runs))


def handed(pair: Tableau, size: int, count: int, numbers: FloatArray) -> Handed:
    """Return what these numbers are, in the order of `places_in_session`."""
    width = numbers_of(pair, size)
    rows = numbers[:width].reshape(pair.rows["all"], size)
    fields = dict(zip(HANDED, numbers[width:].tolist(), strict=False))
    last, length, *_ = numbers[width + len(HANDED) :]
    values, slopes = numbers[width + len(HANDED) + len(FIELDS) :].reshape(2, count)
    return Handed(rows, fields, (float(last), float(length), values, slopes))


def numbers_of(pair: Tableau, size: int) -> int:
    """Return how many numbers of a run the table of arrays has."""
    return pair.rows["all"] * size


def room_for(count: int, runs: int) -> int:
    """Return how many numbers are known of so many events."""
    return (len(FIELDS) + len(TABLES) * count) * runs


def places_in_session(
    pair: Tableau, size: int, padded: int, begin: int, fields: dict[str, int], looks: int, count: int, runs: int
) -> NDArray[np.int64]:
    """Return where in the memory of a session the numbers lie that its first run is handed over with.

    `begin` is where its fields begin, and `looks` where that does which is known of events.
    """
    rows = (np.arange(pair.rows["all"])[:, None] * padded + np.arange(size) * runs).ravel()
    named = [begin + fields[name] for name in HANDED]
    known = looks + runs * np.arange(len(FIELDS))
    first = looks + runs * (len(FIELDS) + TABLES.index("lasts") * count)
    return np.concatenate([rows, named, known, first + runs * np.arange(2 * count)]).astype(np.int64)


def look_places(
    events: EventsOfMany, memory: FloatArray, looks: int, handed: NDArray[np.int64], runs: int
) -> LookPlaces:
    """Return how runs are watched in a session with this memory; see `places_in_session`."""
    derived, scratch = np.zeros(len(events.program.prologue) * runs), np.zeros(events.built.scratch)
    own, known = events.built.code.addresses, memory.ctypes.data + 8 * (looks + len(FIELDS) * runs)
    at = derived.ctypes.data, scratch.ctypes.data
    functions = own["kernel"], own["kernel_prologue"]
    kept = events, memory, derived, scratch
    return LookPlaces(len(events.program.results), known, memory.ctypes.data, handed, *functions, *at, kept)


def write_look(pair: Tableau, runs: int) -> list[Routine]:
    """Write what looks for events after a step, and what takes their values."""
    return [_look(pair, runs), _begin_looks(pair, runs), _values(pair, runs)]


def _open(
    pair: Tableau, runs: int, name: str, more: dict[str, Kind], result: Kind
) -> tuple[Routine, Memory, Record, dict[str, Value], list[Value]]:
    r, m, given = open_routine(pair, name, more, result, runs=runs)
    own, tables = Record(m.looks_at, in_lanes(FIELDS, runs)), m.looks_at.at(len(FIELDS) * runs)
    count = m.event_count * runs
    return r, m, own, {name: tables.at(count * k) for k, name in enumerate(TABLES)}, given


def _values(pair: Tableau, runs: int) -> Routine:
    """Take the values of events at a time and a row to a table."""
    arguments: dict[str, Kind] = {"t": NUMBER, "source": ADDRESS, "target": ADDRESS}
    r, m, _, tables, (t, source, target) = _open(pair, runs, "event_values", arguments, CODE)
    inputs = addresses(r, [place_of(r, t), source, source.at(m.coordinates), tables["shifts"]])
    r.give(r.call(m.events, inputs, m.events_derived, m.events_scratch, addresses(r, [target])))
    return r


def _begin_looks(pair: Tableau, runs: int) -> Routine:
    """Find values and slopes at the begin of the first step of some lanes; the lanes in which they have no value."""
    r, m, own, tables, (fresh, width) = _open(pair, runs, "begin_looks", {"fresh": INTEGER, "width": NUMBER}, INTEGER)
    y, begin, trial, past, is_fresh = m.row("y_old"), m.row(0), m.row("trial"), width * SECANT, fresh.conditions(runs)
    code = r.call("event_values", m.session, m.t_old, y, tables["values"]).integer()
    with m.parts() as j:
        trial[j] = m.lanes(y, j) + m.lanes(begin, j) * past
    missing = r.call("event_values", m.session, m.t_old + past, trial, tables["others"]).integer().conditions(runs)
    with r.count(m.event_count * runs, step=runs) as k:
        value = m.lanes(tables["values"], k)
        slope = r.choose(missing, 0.0, (m.lanes(tables["others"], k) - value) / past)
        for name, now in (("lasts", value), ("slopes", slope)):
            tables[name][k] = r.choose(is_fresh, now, m.lanes(tables[name], k))
    own.length = r.choose(is_fresh, 0.0, own.length)
    r.give(code)
    return r


def _look(pair: Tableau, runs: int) -> Routine:
    """Return the lanes in whose last step an event may have happened, of those whose step was kept."""
    r, m, own, tables, _ = _open(pair, runs, "look", {}, INTEGER)
    kept, width = m.arrived & m.active, m.t - m.t_old
    r.give_if(kept == 0, 0)
    found, fresh = r.variable(0, INTEGER), kept & (m.taken == 1.0).integer()
    with r.when(fresh != 0):
        found.now = r.call("begin_looks", m.session, fresh, width, result=INTEGER) & fresh
    good, y, slope, trial = kept.conditions(runs), m.row("y"), m.row("end slope"), m.row("trial")
    code = r.call("event_values", m.session, m.t, y, tables["values"]).integer()
    length = r.most(width, own.length * 0.5)
    past = length * SECANT
    with m.parts() as j:
        trial[j] = m.lanes(y, j) - m.lanes(slope, j) * past
    missing = r.call("event_values", m.session, m.t - past, trial, tables["others"]).integer().conditions(runs)
    own.length, own.last = r.choose(good, length, own.length), r.choose(good, m.t, own.last)
    found.now = found.now | code
    with r.count(m.event_count * runs, step=runs) as k:
        first, first_slope, value, sign = (m.lanes(tables[name], k) for name in ("lasts", "slopes", "values", "signs"))
        rate = r.choose(missing, 0.0, (value - m.lanes(tables["others"], k)) / past)
        turned = may_pass_zero(r, width, (first, first_slope), (value, rate)) | ~(value * sign > 0.0)
        found.now = found.now | turned.integer()
        for name, before, now in (("lasts", first, value), ("slopes", first_slope, rate)):
            tables[name][k] = r.choose(good, now, before)
    r.give(found.now & kept)
    return r
