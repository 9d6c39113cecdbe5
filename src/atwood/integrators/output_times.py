"""The routine of a session that goes through output times, which all explicit methods share."""

from __future__ import annotations

from collections.abc import Callable

from atwood.codegen.routines.kinds import ADDRESS, INTEGER
from atwood.codegen.routines.language import Operand, Record, Routine, Value

SAMPLE_ARGUMENTS = {"times": ADDRESS, "wanted": INTEGER, "ys": ADDRESS, "yps": ADDRESS}
"""What the routine takes behind its session."""


def write_sample(r: Routine, numbers: Record, counts: Record, width: Operand) -> Routine:
    """Write the body of ``sample``: fill a table with values and rates at output times; it ends as ``run`` does."""
    session, times, wanted, ys, yps = r.arguments
    i = r.variable(0, INTEGER)
    with r.forever():
        now = i.now
        counts.filled = now
        with r.when(now >= wanted):
            r.give(0)
        moment, place = times[now], now * width
        numbers.stop = moment
        steps: tuple[Callable[[], Value], ...] = (
            lambda: r.call("run", session),
            lambda: r.call("interpolate", session, moment, ys.at(place), yps.at(place)),
        )
        for step in steps:
            code = step()
            with r.when(code != 0):
                r.give(code)
        i.now = now + 1
    return r
