"""Routines that all methods of fixed steps share: the loop over steps, and what lies between two of them."""

from __future__ import annotations

from collections.abc import Callable

from atwood.codegen.routines.kinds import ADDRESS, INTEGER, NUMBER
from atwood.codegen.routines.language import Operand, Routine, Value
from atwood.integrators.gauss.layout import Layout, Memory, open_routine
from atwood.integrators.output_times import SAMPLE_ARGUMENTS, write_sample

__all__ = ["FILES", "copy_numbers", "interpolate", "run", "sample"]

FILES = ("integrators/gauss/fixed_steps.py", "integrators/gauss/layout.py", "integrators/output_times.py")
"""On these the routines here depend."""


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
    """Take steps: 0 at the stop time, 1 at the limit of steps, 2 where a step fails.

    Times are multiples of the step from where it began, so that rounding does not add up.

    Parameters
    ----------
    layout
        The memory of a session.
    attempt
        Writes a step from a time, of a length; returns 0 where it is found.
    failed, good
        Write what comes after either.
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
    width: Operand = r.value(layout.coordinates + layout.speeds, INTEGER)
    return write_sample(r, m.numbers, m.counts, width)
