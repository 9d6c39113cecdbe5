"""Taylor series of many runs side by side: steps as in `atwood.integrators.taylor.steps`, one run in each lane."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import inf, log2

import numpy as np

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import INTEGER, Routine, Value
from atwood.integrators.lanes import LanePlaces, failures, write_batch
from atwood.integrators.protocol import SolverOptions
from atwood.integrators.stepper import LANE_FIELDS, Memory
from atwood.integrators.taylor.stepper import (
    DEFECT,
    FIELDS,
    FLOOR,
    HIGHEST,
    LOWEST,
    RETREAT,
    RETRIES,
    ROWS,
    SMALLER,
    TaylorProblem,
    choose_order,
    open_routine,
    share_of_radius,
)
from atwood.integrators.taylor.steps import horner, misfit, order, write_inner


def write_routines(runs: int) -> list[Routine]:
    """Write the routines of sessions of so many runs; ``batch`` is called from outside."""
    memory = partial(Memory, FIELDS | LANE_FIELDS, ROWS, runs=runs)
    own = [_begin(runs), _step(runs), _expand(runs), _read(runs)]
    return [*write_batch(runs, memory, "floors"), *own, *write_inner(runs)]


def _begin(runs: int) -> Routine:
    """Start the runs of some lanes; what is found for the others is what they have."""
    r, m, (fresh,) = open_routine(runs, "begin", {"fresh": INTEGER}, result=INTEGER)
    is_fresh = fresh.conditions(runs)
    y, new, low, rates, floors = (m.row(name) for name in ("y", "new", "y_low", "rates", "floors"))
    m.t_new = m.t
    r.copy(new, y, m.padded)
    code = r.call(m.start, m.new_in, m.start_derived, m.scratch, m.new_out)
    r.copy(rates, m.row("new_rates"), m.padded)
    steepest = r.variable(0.0, m.part)
    with m.parts() as j:
        pace = r.size(m.lanes(rates, j)) / (m.lanes(floors, j) + r.size(m.lanes(y, j)))
        steepest.now = r.most(pace, steepest.now)
        low[j] = r.choose(is_fresh, 0.0, m.lanes(low, j))
    bound, found = r.least(m.horizon, m.longest), steepest.now
    unit = r.choose(found > 0.0, r.least(1.0 / found, bound), bound)
    m.unit, m.last = r.choose(is_fresh, unit, m.unit), r.choose(is_fresh, 0.0, m.last)
    r.give(failures(code, fresh))
    return r


def _expand(runs: int) -> Routine:
    """Find the coefficients at the states; lanes where one is not finite are tried again, with the rest as before."""
    r, m, _ = open_routine(runs, "expand", result=INTEGER)
    last, active = m.last, m.active
    m.unit = r.choose(last > 0.0, last, m.unit)
    r.call(m.prologue, m.known, m.derived, m.scratch, result=None)
    y, rates, values, slopes = m.row("y"), m.row("rates"), m.row(0), m.row(1)
    failed = r.variable(0, INTEGER)
    with r.count(RETRIES):
        now = m.unit
        failed.now = 0
        with m.parts() as j:
            values[j] = m.lanes(y, j)
            slopes[j] = m.lanes(rates, j) * now
        with r.forever() as orders:
            for k in range(1, HIGHEST):
                failed.now = failed.now | failures(order(r, m, k, now), active)
                if k + 1 >= LOWEST:
                    with r.when(m.order == k + 1):
                        r.leave(orders)
            r.leave(orders)
        r.give_if(failed.now == 0, 0)
        m.unit = r.choose(failed.now.conditions(runs), now * SMALLER, now)
    r.give(failed.now)
    return r


def _step(runs: int) -> Routine:
    """Take a step of each run; one that is too long is tried again, shorter, while the others stay."""
    r, m, _ = open_routine(runs, "step", result=INTEGER)
    t, stop = m.t, m.stop_time
    failed = r.variable(r.call("expand", m.session, result=INTEGER), INTEGER)
    waits = r.variable(m.active - failed.now, INTEGER)
    h = r.variable(r.least(r.call("choose", m.session, result=m.part), m.longest), m.part)
    least, step = r.size(t) * (10.0 * 2.0**-52), r.variable(0.0, m.part)
    with r.forever() as attempts:
        ends = t + h.now >= stop
        t_new = r.choose(ends, stop, t + h.now)
        step.now = now = t_new - t
        moves = ((now > least) & (now >= 1e-300)) | (ends & (now > 0.0))
        stuck = waits.now - (waits.now & moves.integer())
        failed.now, waits.now = failed.now + stuck, waits.now - stuck
        m.t_new = t_new
        r.call("move", m.session, now / m.unit, result=None)
        code = r.call(m.start, m.new_in, m.start_derived, m.scratch, m.new_out)
        waits.now = waits.now & (code.integer() | misfit(r, m, now).integer())
        with r.when(waits.now == 0):
            r.leave(attempts)
        h.now = r.choose(waits.now.conditions(runs), now * RETREAT, h.now)
    m.t_old, m.t, m.last, m.taken = t, m.t_new, step.now, m.taken + 1.0
    for source, target in (("new", "y"), ("new_low", "y_low"), ("new_rates", "rates")):
        r.copy(m.row(target), m.row(source), m.padded)
    r.give(failed.now)
    return r


def _read(runs: int) -> Routine:
    """Write states at a time within the last step, of some lanes."""
    r, m, (lanes,) = open_routine(runs, "read", {"lanes": INTEGER}, result=INTEGER)
    y, trial, first, time = m.row("y"), m.row("trial"), m.row(0), m.time
    inside = time != m.t
    within = inside.integer() & lanes
    with r.when(within == 0):
        r.copy(trial, y, m.padded)
        r.give(0)
    share = (time - m.t_old) / m.unit

    def states(parts: Sequence[Value]) -> None:
        for j, moved in zip(parts, horner(r, m, parts, share, slopes=False)[0], strict=True):
            trial[j] = r.choose(inside, m.lanes(first, j) + moved, m.lanes(y, j))

    m.each(states)
    code = r.call(m.start, m.trial_in, m.start_derived, m.scratch, m.trial_out)
    r.give(failures(code, within))
    return r


_FILES = tuple(f"integrators/{name}.py" for name in ("batch", "lanes", "stepper", "taylor/stepper", "taylor/steps"))


@once
def _code(runs: int) -> Built:
    routines = RoutineSource("integrators.taylor.lanes", _FILES, (runs,))
    return build_code([], CodeOptions(level=2), exports=["batch"], routines=routines)


def open_lanes(problem: TaylorProblem, options: SolverOptions, runs: int) -> LanePlaces:
    """Return a session of so many runs side by side."""
    assert problem.wide is not None
    recurrences = problem.wide(runs)
    layout, rtol, chosen = recurrences.layout, options.relative_tolerance, choose_order(options)
    memory, base = layout.allocate()
    derived = np.zeros(len(recurrences.programs.start.prologue) * runs)
    first, (pairs, squares) = layout.places["fields"], layout.blocks
    counts = {"start_derived": derived.ctypes.data, "size": recurrences.size, "padded": layout.padded}
    factors = layout.places["factors"]
    memory.view(np.int64)[factors : factors + len(layout.factors)] = layout.factors
    counts |= {"factors": base + 8 * factors, "order": chosen, "pair_blocks": pairs, "square_blocks": squares}
    for name, whole in counts.items():
        memory.view(np.int64)[first + layout.numbers[name]] = whole
    numbers = {"longest": options.max_step or inf, "horizon": options.horizon, "stop_time": problem.stop_time}
    numbers |= {"share": log2(share_of_radius(chosen, rtol)), "allowed": DEFECT * rtol + FLOOR}
    for name, number in numbers.items():
        at = first + layout.numbers[name]
        memory[at : at + runs] = number
    fresh = memory.copy()

    def clear() -> None:
        memory[:] = fresh

    return LanePlaces(
        batch=_code(runs).code.addresses["batch"],
        session=base + 8 * first,
        lanes=runs,
        prologue=recurrences.addresses["start_prologue"],
        derived=derived.ctypes.data,
        scratch=base + 8 * layout.places["scratch"],
        parameters=problem.parameters,
        tolerance_factor=1.0 / rtol,
        clear=clear,
        keep=(recurrences, memory, derived),
    )
