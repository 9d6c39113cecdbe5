"""Routines that all methods of fixed steps share: the loop over steps, and what lies between two of them."""

from __future__ import annotations

from collections.abc import Callable

from atwood.codegen.routines.kinds import ADDRESS, INTEGER, NUMBER
from atwood.codegen.routines.language import Operand, Routine, Value
from atwood.integrators.gauss.layout import Layout, Memory, open_routine
from atwood.integrators.output_times import SAMPLE_ARGUMENTS, write_sample

FILES = ("integrators/gauss/fixed_steps.py", "integrators/gauss/layout.py", "integrators/output_times.py")
"""On these the routines here depend."""


def unless_found(r: Routine, code: Value, given: int = 1) -> None:
    """Return where a call failed."""
    with r.when(code != 0):
        r.give(given)


def copy_numbers(r: Routine, target: Value, source: Value, count: int) -> None:
    """Copy numbers one by one: the arrays may be one."""
    with r.count(count) as i:
        target[i] = source[i]


def run(
    layout: Layout,
    attempt: Callable[[Routine, Memory, Value, Value], Value],
    *,
    failed: Callable[[Routine, Memory], None] = lambda r, m: None,
    good: Callable[[Routine, Memory], None] = lambda r, m: None,
) -> Routine:
    """Take steps: 0 at the stop time, 1 at the limit of steps, 2 where one fails, 4 behind one that is not good.

    Times are multiples of the step from where it began, so that rounding does not add up.
    """
    r, m, _ = open_routine(layout, "run", exported=True)
    stop, h, origin, limit = m.numbers.stop, m.numbers.step, m.numbers.origin, m.counts.limit
    with r.forever():
        t, steps = m.numbers.t, m.counts.steps
        with r.when(t >= stop):
            r.give(0)
        with r.when(steps >= limit):
            r.give(1)
        with r.when(attempt(r, m, t, h) != 0):
            failed(r, m)
            m.counts.failures = m.counts.failures + 1
            r.give(2)
        good(r, m)
        following = m.counts.since + 1
        m.counts.since, m.counts.steps = following, steps + 1
        m.numbers.t_old, m.numbers.t = t, origin + h * following.number()
        with r.when(r.call("judge", m.session) != 0):
            r.give(4)
    return r


def judge(layout: Layout) -> Routine:
    """Ask what judges steps about the last one; 0 where it is good.

    It is asked about what lies around the step, too: the parts of a composition reach beyond it, to both sides.
    """
    r, m, _ = open_routine(layout, "judge")
    guard, data, width = m.pointers.guard, m.pointers.guard_data, layout.width
    with r.when(r.is_null(guard)):
        r.give(0)
    t, t_old, h = m.numbers.t, m.numbers.t_old, m.numbers.step
    begin, begin_rates, end, end_rates = (m.at("ends").at(k * width) for k in range(4))
    before, after = (m.at("around").at(k * width) for k in range(2))

    def ask(*ends: Operand) -> None:
        with r.when(r.call(guard, *ends, data) != 0):
            r.give(4)

    def read(time: Value, state: str, values: Value, rates: Value) -> None:
        with r.when(r.call("speeds", m.session, time, m.at(state), values) != 0):
            r.give(4)
        with r.when(r.call(m.pointers.rates, time, values, rates, m.pointers.rates_data) != 0):
            r.give(4)

    with r.when(m.counts.since == 1):
        read(t_old, "y_old", begin, begin_rates)
    with r.otherwise():
        copy_numbers(r, begin, end, 2 * width)
    with r.count(width) as i:
        before[i] = begin[i] - h * begin_rates[i]
        after[i] = begin[i] + 2.0 * h * begin_rates[i]
    ask(t_old - h, before, begin_rates, t_old + 2.0 * h, after, begin_rates)
    read(t, "y", end, end_rates)
    ask(t_old, begin, begin_rates, t, end, end_rates)
    r.give(0)
    return r


def interpolate(layout: Layout) -> Routine:
    """Write values and rates at a time within the last step, by a step of its own."""
    arguments = {"time": NUMBER, "out": ADDRESS, "yps": ADDRESS}
    r, m, (time, out, yps) = open_routine(layout, "interpolate", arguments, exported=True)
    there = r.array(layout.size)

    def unless_found(code: Value) -> None:
        with r.when(code != 0):
            r.give(3)

    t, t_old = m.numbers.t, m.numbers.t_old
    with r.when(time == t):
        unless_found(r.call("speeds", m.session, time, m.at("y"), out))
    with r.otherwise():
        unless_found(r.call("trial", m.session, t_old, time - t_old, m.at("y_old"), there))
        unless_found(r.call("speeds", m.session, time, there, out))
    unless_found(r.call(m.pointers.rates, time, out, yps, m.pointers.rates_data))
    r.give(0)
    return r


def sample(layout: Layout) -> Routine:
    """Go through output times and fill a table; it ends as `run` does."""
    r, m, _ = open_routine(layout, "sample", SAMPLE_ARGUMENTS, exported=True)
    width: Operand = r.value(layout.width, INTEGER)
    return write_sample(r, m.numbers, m.counts, width)
