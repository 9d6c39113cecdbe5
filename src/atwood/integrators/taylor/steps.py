"""Steps of the Taylor-series method, for any system.

The tests have the same steps in NumPy.  What the routines know of a system comes in through
addresses of the two compiled programs of its recurrences, so that they are compiled once and kept.

Convolutions of Taylor coefficients: their terms are written out for each order; only the blocks are a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Lanes, Routine, Value
from atwood.integrators.stepper import (
    PROJECT_ARGUMENTS,
    SAMPLE_ARGUMENTS,
    Memory,
    number_kind,
    write_project_each,
    write_sample,
)
from atwood.integrators.taylor.stepper import (
    HIGHEST,
    LANES,
    LOWEST,
    PARTS,
    RETREAT,
    RETRIES,
    SMALLER,
    WATCHED,
    lanes_of,
    open_routine,
    stride_of,
)

_REACHED, _USED_UP, _TOO_SMALL, _NO_VALUE, _NO_RATES = range(5)
"""How a routine ends."""


def write_routines() -> list[Routine]:
    """Write the routines; ``run``, ``interpolate``, ``sample`` and ``begin`` are called from outside."""
    ends = [_begin(), _run(), _interpolate(), _sample(), _project_each()]
    return [*ends, _evaluate(), _expand(), _misses(), _guarded(), _held(), *write_inner(1)]


def _project_each() -> Routine:
    """Take states, one row each, onto the constraints."""
    r, m, _ = open_routine(1, "project_each", PROJECT_ARGUMENTS, exported=True)
    return write_project_each(r, m)


def write_inner(runs: int) -> list[Routine]:
    """Write what runs that are taken side by side do as one alone: coefficients, the choice of steps, and steps."""
    return [_choose(runs), _largest(runs), _move(runs), *write_convolutions(runs)]


def _evaluate() -> Routine:
    """Find rates and what recurrences need, by tables of addresses, and count: 1 where one is not finite."""
    r, m, (source, target) = open_routine(1, "evaluate", {"source": ADDRESS, "target": ADDRESS})
    code = r.call(m.start, source, m.start_derived, m.scratch, target)
    m.evaluations = m.evaluations + 1
    m.undefined = m.undefined + code.integer()
    r.give(code)
    return r


def _begin() -> Routine:
    """Start anew from a state, with a unit of time in which the fastest unknown changes by its size."""
    r, m, (t, state) = open_routine(1, "begin", {"t": NUMBER, "state": ADDRESS}, exported=True)
    m.t, m.t_old, m.t_new, m.last = t, t, t, 0.0
    # Nothing that is not finite must be left among the coefficients.
    r.clear(m.arrays, m.row("y"))
    blocks = m.pair_blocks * 2 + m.square_blocks
    r.clear(m.table, m.table.at(blocks * stride_of(LANES)))
    r.clear(m.row("y_low"), m.row("new"))
    for row in ("y", "new", "x"):
        r.copy(m.row(row), state, m.size)
    r.give_if(r.call("evaluate", m.session, m.new_in, m.new_out) != 0, _NO_RATES)
    rates, floors, steepest = m.row("rates"), m.row("floors"), r.variable(0.0)
    r.copy(rates, m.row("new_rates"), m.padded)
    with r.count(m.size) as i:
        pace = r.size(rates[i]) / (floors[i] + r.size(state[i]))
        steepest.now = r.most(pace, steepest.now)
    bound = r.least(m.horizon, m.longest)
    m.unit = r.choose(steepest.now > 0.0, r.least(1.0 / steepest.now, bound), bound)
    r.give(_REACHED)
    return r


def _expand() -> Routine:
    """Find the coefficients at the state: 0, or 1 where one is not finite."""
    r, m, _ = open_routine(1, "expand")
    last, tries = m.last, r.variable(0, INTEGER)
    unit = r.variable(r.choose(last > 0.0, last, m.unit))
    r.call(m.prologue, m.known, m.derived, m.scratch, result=None)
    y, rates, values, slopes = m.row("y"), m.row("rates"), m.row(0), m.row(1)
    with r.forever() as attempts:
        now = unit.now
        m.unit = now
        with m.parts() as j:
            values[j] = m.lanes(y, j)
            slopes[j] = m.lanes(rates, j) * now
        failed = r.variable(False, BOOLEAN)
        with r.forever() as orders:
            for k in range(1, HIGHEST):
                with r.when(order(r, m, k, now) != 0):
                    failed.now = True
                    r.leave(orders)
                if k + 1 >= LOWEST:
                    with r.when(m.order == k + 1):
                        r.leave(orders)
            r.leave(orders)
        r.give_if(~failed.now, 0)
        m.undefined = m.undefined + 1
        tries.now = tries.now + 1
        with r.when(tries.now >= RETRIES):
            r.leave(attempts)
        unit.now = now * SMALLER
    r.give(1)
    return r


def order(r: Routine, m: Memory, k: int, unit: Value) -> Value:
    """Find the coefficients of one order, and those of the unknowns of the next; return 1 where one is not finite."""
    pairs, squares, table, lanes = m.pair_blocks, m.square_blocks, m.table, lanes_of(m.runs)
    lists, factors = ([], []) if m.runs == 1 else ([m.factors], [m.factors.at(pairs * 2)])
    rest = [table.at(pairs * (2 * stride_of(lanes))) if m.runs == 1 else table, *factors]
    is_first = (m.order - k) & 1 == 0
    for name, condition in (("both", is_first), ("rest", ~is_first)):
        with r.when(condition):
            r.call(f"{name}{k}", m.pair_sums, pairs, table, *lists, result=None)
    with r.when(squares > 0):
        r.call(f"squares{k}", m.square_sums, squares, *rest, result=None)
    m.order_number, m.order_inverse = float(k), 1.0 / k
    m.order_step, m.order_tick = unit * (1.0 / (k + 1)), unit if k == 1 else 0.0
    row = table.at(lanes * (k - 1))
    for place, target in enumerate((*[row] * (3 if m.runs == 1 else 1), m.row(k + 1))):
        m.order_out.write(place, target, ADDRESS)
    m.order_in.write(3, m.row(k), ADDRESS)
    return r.call(m.recurrence, m.order_in, m.derived, m.scratch, m.order_out)


def _largest(runs: int) -> Routine:
    """Return the largest coefficient of an order, in units of the sizes."""
    r, m, (order,) = open_routine(runs, "largest", {"order": INTEGER}, result=number_kind(runs))
    row, sizes, largest = m.row(order), m.row("sizes"), r.variable(0.0, m.part)
    with m.parts() as j:
        largest.now = r.most(r.size(m.lanes(row, j)) * m.lanes(sizes, j), largest.now)
    r.give(largest.now if runs > 1 else r.largest_lane(largest.now))
    return r


def _choose(runs: int) -> Routine:
    """Return the step that the last coefficients allow, if none is given.

    The rate at which coefficients grow is the logarithm to base 2 of one over its order, good enough for a step: linear
    between powers of two, and finite at zero.
    """
    kind = number_kind(runs)
    r, m, _ = open_routine(runs, "choose", result=kind)
    if runs == 1:
        first = m.first
        with r.when(first > 0.0):
            m.first = 0.0
            r.give(first)
    y, floors, sizes = m.row("y"), m.row("floors"), m.row("sizes")
    with m.parts() as j:
        sizes[j] = 1.0 / (m.lanes(floors, j) + r.size(m.lanes(y, j)))

    def largest(order: Value) -> Value:
        return r.call("largest", m.session, order, result=kind)

    growth = r.value(-1e9, kind)
    for i in range(WATCHED):
        order = m.order - i
        top = largest(order)
        high = r.high(top)
        mantissa = r.of_words((high & (2**20 - 1)) | (1023 << 20), r.low(top))
        logarithm = mantissa + (r.as_number(high >> 20) - 1024.0)
        rate = r.choose(top < 2.0**-1022, -1023.0, logarithm) / order.number()
        growth = r.most(rate, growth)
    power = m.share - growth
    floor = r.floor(power)
    part = power - floor
    factor = part * (part * 0.3398 + 0.6602) + 1.0
    exponent = r.low(floor + (1.5 * 2.0**52 + 1023.0))  # the last bits of such a number are those of the integer
    value = r.variable(factor * r.of_words(exponent << 20, 0), kind)
    if runs == 1:
        reach = m.reach
        with r.when(reach < inf):  # no unknown changes too much for events to be seen
            for number in (1, 2):
                ratio = reach / largest(r.value(number, INTEGER))
                value.now = r.least(ratio if number == 1 else r.sqrt(ratio), value.now)
    r.give(m.unit * value.now)
    return r


def horner(r: Routine, m: Memory, parts: Sequence[Value], share: Value, slopes: bool = True) -> list[list[Value]]:
    """Return polynomials of parts less their first terms at a share of the unit, and slopes, by Horner's scheme."""
    order, zero = m.order, r.value(0.0, m.part)
    values = [r.variable(m.lanes(m.row(order), j), m.part) for j in parts]
    turns, k = [r.variable(zero, m.part) for _ in parts if slopes], r.variable(order - 1, INTEGER)
    with r.forever() as terms:
        row, now = m.row(k.now), [value.now for value in values]
        for turn, one in zip(turns, now, strict=False):
            turn.now = turn.now * share + one
        for j, value, one in zip(parts, values, now, strict=True):
            value.now = one * share + m.lanes(row, j)
        k.now = k.now - 1
        with r.when(k.now <= 0):
            r.leave(terms)
    moved = [value.now * share for value in values]
    return [moved, [turn.now * share + value.now for value, turn in zip(values, turns, strict=False)]]


def _move(runs: int) -> Routine:
    """Write the values at the end of a step, what they leave out, and the slope there."""
    r, m, (share,) = open_routine(runs, "move", {"share": number_kind(runs)}, result=None)
    names = ("y", "y_low", "new", "new_low", "slope")
    y, y_low, new, new_low, slopes = (m.row(name) for name in names)
    spread = r.value(share, m.part)

    def end(parts: Sequence[Value]) -> None:
        for j, moved, slope in zip(parts, *horner(r, m, parts, spread), strict=True):
            slopes[j] = slope
            high = m.lanes(y, j)
            total = high + moved
            part = total - high
            lost = (high - (total - part)) + (moved - part)
            low = m.lanes(y_low, j) + lost
            rounded = total + low
            new[j] = rounded
            new_low[j] = low - (rounded - total)

    m.each(end)
    return r


def _misses() -> Routine:
    """Tell whether rates at the end of a step are not the slope of the polynomial."""
    r, m, (h,) = open_routine(1, "misses", {"h": NUMBER}, result=BOOLEAN)
    r.give(r.any_lane(misfit(r, m, h)))
    return r


def misfit(r: Routine, m: Memory, h: Value) -> Value:
    """Return in which lanes rates at the end of a step are not the slope of the polynomial."""
    weight, allowed = h / m.order.number(), m.allowed
    pace, missed = 1.0 / m.unit, r.variable(False, Lanes(m.part.count, is_float=False))
    y, new, slope, rates, floors = (m.row(name) for name in ("y", "new", "slope", "new_rates", "floors"))
    with m.parts() as j:
        apart = r.size(m.lanes(slope, j) * pace - m.lanes(rates, j)) * weight
        size = m.lanes(floors, j) + r.most(r.size(m.lanes(y, j)), r.size(m.lanes(new, j)))
        missed.now = missed.now | ~(apart <= size * allowed)
    return missed.now


def _guarded() -> Routine:
    """Ask what judges steps about each part of one; 0 where all are good."""
    r, m, (t, h) = open_routine(1, "guarded", {"t": NUMBER, "h": NUMBER})
    guard, unit = m.guard, m.unit
    r.give_if(r.is_null(guard), 0)
    first, pace = m.row(0), 1.0 / unit
    trial, slopes, kept, kept_slopes = (m.row(name) for name in ("trial", "trial_rates", "kept", "kept_rates"))
    r.copy(kept, m.row("y"), m.size)
    r.copy(kept_slopes, m.row("rates"), m.size)
    begin = r.variable(t)
    with r.count(PARTS + 1, start=1) as i:
        since = i.number() * (1.0 / PARTS) * h
        end, share = t + since, r.value(since / unit, m.part)

        def states(parts: Sequence[Value], share: Value = share) -> None:
            for j, moved, slope in zip(parts, *horner(r, m, parts, share), strict=True):
                trial[j] = m.lanes(first, j) + moved
                slopes[j] = slope * pace

        m.each(states)
        code = r.call(guard, begin.now, kept, kept_slopes, end, trial, slopes, m.guard_data)
        r.give_if(code != 0, 1)
        r.copy(kept, trial, m.size)
        r.copy(kept_slopes, slopes, m.size)
        begin.now = end
    r.give(0)
    return r


def _held() -> Routine:
    """Take the end of a step onto the constraints, if there are any, with the rates there; 0 where that can be done."""
    r, m, (t,) = open_routine(1, "held", {"t": NUMBER})
    project = m.project
    r.give_if(r.is_null(project), 0)
    r.give_if(r.call(project, t, m.row("new"), m.project_data) != 0, 1)
    r.give(r.call("evaluate", m.session, m.new_in, m.new_out))
    return r


def _run() -> Routine:
    """Take steps until one ends at or after the time to stop at."""
    r, m, _ = open_routine(1, "run", exported=True)
    h, t_new = r.variable(0.0), r.variable(0.0)
    with r.forever():
        t = m.t
        r.give_if(t >= m.stop, _REACHED)
        r.give_if(m.steps >= m.limit, _USED_UP)
        r.give_if(r.call("expand", m.session) != 0, _TOO_SMALL)
        h.now = r.least(r.call("choose", m.session, result=NUMBER), m.longest)
        least, stop = r.size(t) * (10.0 * 2.0**-52), m.stop_time
        with r.forever() as attempts:
            ends = t + h.now >= stop
            t_new.now = r.choose(ends, stop, t + h.now)
            step = t_new.now - t
            r.give_if(~(((step > least) & (step >= 1e-300)) | (ends & (step > 0.0))), _TOO_SMALL)
            m.t_new = t_new.now
            r.call("move", m.session, step / m.unit, result=None)
            fits = r.variable(r.call("evaluate", m.session, m.new_in, m.new_out) == 0, BOOLEAN)
            with r.when(fits.now):
                fits.now = ~r.call("misses", m.session, step, result=BOOLEAN)
            with r.when(fits.now):
                fits.now = r.call("guarded", m.session, t, step) == 0
            with r.when(fits.now):
                fits.now = r.call("held", m.session, t_new.now) == 0
            with r.when(fits.now):
                r.leave(attempts)
            h.now = step * RETREAT
            m.failures = m.failures + 1
        m.t_old, m.t, m.last = t, t_new.now, t_new.now - t
        m.steps = m.steps + 1
        for source, target in (("new", "y"), ("new_low", "y_low"), ("new_rates", "rates")):
            r.copy(m.row(target), m.row(source), m.padded)
    return r


def _interpolate() -> Routine:
    """Write values and rates at a time within the last step."""
    arguments = {"time": NUMBER, "y_out": ADDRESS, "yp_out": ADDRESS}
    r, m, (time, y_out, yp_out) = open_routine(1, "interpolate", arguments, exported=True)
    with r.when(time == m.t):
        r.copy(y_out, m.row("y"), m.size)
        r.copy(yp_out, m.row("rates"), m.size)
        r.give(_REACHED)
    m.time = time
    first, trial = m.row(0), m.row("trial")
    share = r.value((time - m.t_old) / m.unit, m.part)

    def states(parts: Sequence[Value]) -> None:
        for j, moved in zip(parts, horner(r, m, parts, share, slopes=False)[0], strict=True):
            trial[j] = m.lanes(first, j) + moved

    m.each(states)
    code = r.call("evaluate", m.session, m.trial_in, m.trial_out)
    r.copy(y_out, trial, m.size)
    r.copy(yp_out, m.row("trial_rates"), m.size)
    r.give_if(code != 0, _NO_VALUE)
    r.give(_REACHED)
    return r


def _sample() -> Routine:
    """Go through output times and fill a table; it ends as `run` does."""
    r, m, _ = open_routine(1, "sample", SAMPLE_ARGUMENTS, exported=True)
    return write_sample(r, m, m.size)


_CHAINS = 4
"""Sums that the terms of a convolution are spread over, so that additions do not wait for each other."""


def write_convolutions(runs: int = 1) -> list[Routine]:
    """Write what adds up the products of an order in all blocks of a table.

    ``both3`` does so for pairs at order 3, and begins their sums of order 4, whose factors are read on the way: that
    saves half of the reading. ``rest4`` goes on with these. ``squares3`` is for values with themselves.
    """
    kinds: tuple[tuple[str, Callable[..., Value | None]], ...] = (
        ("both", _both),
        ("rest", _rest),
        ("squares", _squares),
    )
    return [_blocks(name, runs, write, order) for name, write in kinds for order in range(1, HIGHEST)]


def _blocks(name: str, runs: int, write: Callable[..., Value | None], order: int) -> Routine:
    """Write a routine for all blocks: of one run they follow each other; else a list says where factors lie.

    Sums that are begun stand behind those of all blocks.
    """
    lists = {} if runs == 1 else {"factors": ADDRESS}
    r = Routine(f"{name}{order}", {"sums": ADDRESS, "blocks": INTEGER, "table": ADDRESS, **lists}, result=None)
    sums, blocks, table, *given = r.arguments
    lanes, count = lanes_of(runs), 1 if name == "squares" else 2
    with r.count(blocks) as b:
        first = b * count
        at = [given[0].read(first + i, INTEGER) if given else (first + i) * stride_of(lanes) for i in range(count)]
        begun = sums.at((blocks + b) * lanes)
        more = [] if name == "squares" else [begun]
        total = write(r, *(table.at(one) for one in at), lanes, order, *more)
        sums.write(b * lanes, 0.0 if total is None else total, Lanes(lanes))
    return r


def _row(block: Value, lanes: int, order: int) -> Value:
    """Return the row of an order in a block."""
    return block.read(lanes * (order - 1), Lanes(lanes))


def _with(r: Routine, total: Value | None, a: Value, b: Value) -> Value:
    """Return a sum with one product more."""
    return a * b if total is None else a * b + total


def _add(chains: list[Value], number: int, a: Value, b: Value) -> None:
    """Add a product to a sum by its number there."""
    if number < _CHAINS:
        chains.append(a * b)
    else:
        chains[number % _CHAINS] = a * b + chains[number % _CHAINS]


def _joined(chains: list[Value]) -> Value | None:
    """Return a sum; None if it has no terms."""
    while len(chains) > 1:
        pairs = [chains[i : i + 2] for i in range(0, len(chains), 2)]
        chains = [one[0] + one[1] if len(one) == 2 else one[0] for one in pairs]
    return chains[0] if chains else None


def _both(r: Routine, left: Value, right: Value, lanes: int, order: int, begun: Value) -> Value | None:
    """Return the convolutions of two values at an order, and begin those of the next.

    The rows of the order before have just been written by parts, and are the last that can be read: what they are in
    is added last.
    """
    now, following = list[Value](), list[Value]()
    above = _row(right, lanes, order - 1) if order > 2 else None
    for j in range(2, order):
        a = _row(left, lanes, j)
        assert above is not None
        _add(following, j - 2, a, above)
        if j < order - 1:
            above = _row(right, lanes, order - j)
            _add(now, j - 2, a, above)
    later = _joined(following)
    if later is not None:
        begun.write(0, later)
    return _ended(r, _joined(now), left, right, lanes, order)


def _rest(r: Routine, left: Value, right: Value, lanes: int, order: int, begun: Value) -> Value | None:
    """Return the convolutions of two values at an order, where they were begun at the order before."""
    return _ended(r, begun.read(0, Lanes(lanes)) if order > 3 else None, left, right, lanes, order)


def _ended(r: Routine, total: Value | None, left: Value, right: Value, lanes: int, order: int) -> Value | None:
    """Return convolutions with their first and last products."""
    ends = {1: (), 2: (1,)}.get(order, (1, order - 1))
    for j in ends:
        total = _with(r, total, _row(left, lanes, j), _row(right, lanes, order - j))
    return total


def _squares(r: Routine, left: Value, lanes: int, order: int) -> Value | None:
    """Return the convolutions of values with themselves: each product occurs twice but the middle.

    What the rows of the order before are in is added last.
    """
    chains = list[Value]()
    for j in range(2, (order + 1) // 2):
        _add(chains, j - 2, _row(left, lanes, j), _row(left, lanes, order - j))
    half = _joined(chains)
    total = None if half is None else half + half
    if order % 2 == 0:
        middle = _row(left, lanes, order // 2)
        total = _with(r, total, middle, middle)
    if order > 2:
        first, last = _row(left, lanes, 1), _row(left, lanes, order - 1)
        total = _with(r, total, first + first, last)
    return total
