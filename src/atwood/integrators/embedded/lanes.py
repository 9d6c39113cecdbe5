"""Embedded pairs for many runs side by side: steps as in `atwood.integrators.embedded.steps`, one run in each lane."""

from __future__ import annotations

from functools import partial
from math import inf

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, build_lanes, once
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Routine, Value, addresses, place_of, places_of
from atwood.expr.core.program import Program
from atwood.integrators.embedded.dense_output import write_terms
from atwood.integrators.embedded.looks import EventsOfMany, look_places, places_in_session, room_for, write_look
from atwood.integrators.embedded.stepper import MANY_FIELDS, open_routine
from atwood.integrators.embedded.steps import (
    GROWTH,
    RETREAT,
    SAFETY,
    SHRINKAGE,
    first_step,
    root_of,
    write_inner,
)
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.lanes import LanePlaces, failures, write_batch
from atwood.integrators.protocol import SolverOptions
from atwood.integrators.stepper import WIDTH, Memory, in_lanes
from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class RatesOfMany:
    """Rates of so many runs side by side as machine code.

    Attributes
    ----------
    runs
        Their number.
    built
        The function ``kernel``.
    program
        A program of (t, q, u) with the accelerations, and before them the rates of the coordinates unless these are
        the speeds.
    """

    runs: int
    built: Built
    program: Program


def rates_of_many(program: Program, runs: int) -> RatesOfMany:
    """Compile rates of so many runs side by side.

    Raises
    ------
    UnsupportedError
        If there is no code in lanes for an operation of the program.
    """
    return RatesOfMany(runs, build_lanes([Part("kernel", program)], runs), program)


def write_routines(pair: Tableau, runs: int) -> list[Routine]:
    """Write the routines of sessions of so many runs; ``batch`` is called from outside."""
    memory = partial(Memory, MANY_FIELDS, pair.rows, runs=runs)
    own = [write(pair, runs) for write in (_evaluate, _begin, _step, _read)]
    batch = write_batch(runs, memory, "absolute", looks=True)
    return [*batch, *own, *write_look(pair, runs), *write_inner(pair, runs)]


def _evaluate(pair: Tableau, runs: int) -> Routine:
    """Take slopes from a row to a row; what the rates returned."""
    arguments = {"t": NUMBER, "source": ADDRESS, "target": ADDRESS}
    r, m, (t, source, target) = open_routine(pair, "evaluate", arguments, runs=runs)
    u, accelerations, is_given = source.at(m.coordinates), target.at(m.coordinates), m.given != 0
    with r.when(~is_given):
        r.copy(target, u, m.speeds)
    inputs = addresses(r, [place_of(r, t), source, u])
    outputs = addresses(r, [r.choose(is_given, target, accelerations), accelerations])
    r.give(r.call(m.function, inputs, m.derived, m.scratch, outputs))
    return r


def _begin(pair: Tableau, runs: int) -> Routine:
    """Start the runs of some lanes; what the others have is left alone."""
    r, m, (fresh,) = open_routine(pair, "begin", {"fresh": INTEGER}, INTEGER, runs=runs)
    is_fresh, probe = fresh.conditions(runs), m.row("last")
    t, y, end, trial = m.t, m.row("y"), m.row("end slope"), m.row("trial")
    code = r.call("evaluate", m.session, t, y, probe)
    with m.parts() as j:
        end[j] = r.choose(is_fresh, m.lanes(probe, j), m.lanes(end, j))
    step = first_step(pair, r, m, t, end)
    m.next = r.choose(is_fresh, step, m.next)
    for name in ("likeness", "edgy", "calm", "shortened"):
        setattr(m, name, r.choose(is_fresh, 0.0, getattr(m, name)))
    m.arrived = m.arrived | fresh
    r.clear(trial, trial.at(m.padded))
    r.give(failures(code, fresh))
    return r


def _attempt(pair: Tableau, r: Routine, m: Memory, t: Value, h: Value) -> tuple[Value, Value]:
    """Take a step of each run to `trial`; return the lanes in which a slope has no value, within and at the end."""
    failed, trial = r.variable(0, INTEGER), m.row("trial")
    for stage in range(1, pair.end):
        r.call(f"stage{stage}", m.session, h)
        code = r.call("evaluate", m.session, t + h * pair.nodes[stage], trial, m.row(stage))
        failed.now = failed.now | code.integer()
    r.call(f"stage{pair.end}", m.session, h)
    ended = r.call("evaluate", m.session, t + h, trial, m.row("end slope")).integer()
    return (failed.now | ended if pair.judges_end else failed.now), ended


def _step(pair: Tableau, runs: int) -> Routine:
    """Try a step of each run, and keep those that are good; the others are tried again, shorter, in the next call."""
    r, m, _ = open_routine(pair, "step", None, INTEGER, runs=runs)
    t, active, arrived = m.t, m.active, m.arrived.conditions(runs)
    begin, end, y, y_old, trial = (m.row(one) for one in (0, "end slope", "y", "y_old", "trial"))
    with m.parts() as j:
        begin[j] = r.choose(arrived, m.lanes(end, j), m.lanes(begin, j))
    m.is_dense = 0
    h = r.least(m.next, m.longest)
    stuck = active - (active & ((h > r.size(t) * (10.0 * 2.0**-52)) & (h >= 1e-300)).integer())
    failed, ended = _attempt(pair, r, m, t, h)
    error = r.call("error", m.session, h, result=m.part)
    factor = root_of(r, error, pair.order) / SAFETY
    has_value = ~failed.conditions(runs) & (error < inf)
    waits = active - stuck
    accepted = waits & (has_value & ~ended.conditions(runs) & (error <= 1.0)).integer()
    good = accepted.conditions(runs)
    within = r.least(r.choose(factor < 1.0 / GROWTH, 1.0 / GROWTH, factor), SHRINKAGE)
    grown, shortened = h / within, m.shortened > 0.0
    usual = r.choose((grown > h) & shortened, h, grown)
    shorter = r.choose(has_value & ~(error <= 1.0), h * (1.0 / r.least(factor, SHRINKAGE)), h * RETREAT)
    m.next, m.shortened = r.choose(good, usual, shorter), r.choose(good, 0.0, 1.0)
    m.likeness = r.choose(good, m.tried, m.likeness)
    r.call("stability", m.session, h, accepted)
    m.arrived = accepted
    with m.parts() as j:
        now = m.lanes(y, j)
        y_old[j] = r.choose(good, now, m.lanes(y_old, j))
        y[j] = r.choose(good, m.lanes(trial, j), now)
    m.t_old, m.h = r.choose(good, t, m.t_old), r.choose(good, h, m.h)
    m.t, m.taken = r.choose(good, t + h, t), m.taken + r.choose(good, 1.0, 0.0)
    r.give(stuck)
    return r


def _read(pair: Tableau, runs: int) -> Routine:
    """Write states at a time within the last step, of some lanes."""
    r, m, (lanes,) = open_routine(pair, "read", {"lanes": INTEGER}, INTEGER, runs=runs)
    y, trial, time = m.row("y"), m.row("trial"), m.time
    inside = time != m.t
    within, failed = inside.integer() & lanes, r.variable(0, INTEGER)
    with r.when(within == 0):
        r.copy(trial, y, m.padded)
        r.give(0)
    h = m.h
    with r.when(m.is_dense == 0):
        for stage in range(pair.end + 1, len(pair.nodes)):
            r.call(f"stage{stage}", m.session, h)
            code = r.call("evaluate", m.session, m.t_old + h * pair.nodes[stage], trial, m.row(stage))
            failed.now = failed.now | code.integer()
        write_terms(pair, m, h)
        m.is_dense = 1
    r.call("polynomial", m.session, (time - m.t_old) / h)
    code = r.call("evaluate", m.session, time, trial, m.row("last"))
    with m.parts() as j:
        trial[j] = r.choose(inside, m.lanes(trial, j), m.lanes(y, j))
    r.give((failed.now | code.integer()) & within)
    return r


_FILES = (
    *(f"integrators/embedded/{name}.py" for name in ("dense_output", "looks", "steps", "stepper", "tableau")),
    *(f"integrators/{name}.py" for name in ("batch", "event_location", "lanes", "stepper")),
    *(f"codegen/{name}.py" for name in ("sundials/events", "tangents")),
)


@once
def _code(pair: Tableau, runs: int) -> Built:
    routines = RoutineSource("integrators.embedded.lanes", _FILES, (pair, runs))
    return build_code([], CodeOptions(level=2), exports=["batch"], routines=routines)


def open_lanes(
    rates: RatesOfMany, values: FloatArray, events: EventsOfMany | None, options: SolverOptions, pair: Tableau
) -> LanePlaces:
    """Return a session of runs side by side with these parameters, as far as a run has none of its own."""
    runs, program = rates.runs, rates.program
    _, q, u = (len(group.symbols) for group in program.inputs)
    padded = -(-(q + u) // WIDTH) * WIDTH * runs
    fields = in_lanes(MANY_FIELDS, runs)
    places, begin = places_of(fields), pair.rows["all"] * padded
    count = 0 if events is None else len(events.program.results)
    looks = begin + sum(1 if kind in (ADDRESS, INTEGER) else runs for kind in fields.values())
    memory = np.zeros(looks + room_for(count, runs))
    derived, scratch = np.zeros(len(program.prologue) * runs), np.zeros(rates.built.scratch)
    rows = memory[:begin].reshape(-1, padded)
    rows[pair.rows["absolute"]] = 1.0
    code = rates.built.code.addresses
    whole = {"arrays": memory.ctypes.data, "function": code["kernel"], "derived": derived.ctypes.data}
    whole |= {"scratch": scratch.ctypes.data, "size": q + u, "padded": padded, "coordinates": q * runs}
    whole |= {"speeds": u * runs, "given": len(program.outputs) - 1}
    watch = None
    if events is not None:
        handed = places_in_session(pair, q + u, padded, begin, places, looks, count, runs)
        watch = look_places(events, memory, looks, handed, runs)
        whole |= {"looks_at": memory.ctypes.data + 8 * looks, "events_derived": watch.derived}
        whole |= {"events_scratch": watch.scratch, "events": watch.kernel, "event_count": count}
    for name, value in whole.items():
        memory.view(np.int64)[begin + places[name]] = value
    numbers = {"relative": options.relative_tolerance, "longest": options.max_step or inf, "horizon": options.horizon}
    for name, number in numbers.items():
        memory[begin + places[name] :][:runs] = number
    fresh = memory.copy()

    def clear() -> None:
        memory[:] = fresh

    return LanePlaces(
        batch=_code(pair, runs).code.addresses["batch"],
        session=memory.ctypes.data + 8 * begin,
        lanes=runs,
        prologue=code["kernel_prologue"],
        derived=derived.ctypes.data,
        scratch=scratch.ctypes.data,
        parameters=values,
        tolerance_factor=1.0,
        clear=clear,
        keep=(rates, memory, derived, scratch),
        looks=watch,
    )
