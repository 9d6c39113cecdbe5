"""Writes the loop over steps of one length that the symplectic methods share."""

from __future__ import annotations

from collections.abc import Callable

from atwood.integrators.gauss.layout import COUNTS, NUMBERS, Layout
from atwood.integrators.gauss.writer import Code
from atwood.late import dataclass

__all__ = ["Step", "run_code"]


@dataclass(frozen=True)
class Step:
    """Names of values in the loop: places of the states, of those before and of rounding; time, length, steps so far.

    Attributes
    ----------
    y, old, rest
        Addresses of the states, of the states before the step, and of what rounding has left of the states.
    t, h
        The time and the length of the step.
    since
        How many steps of this length have been taken.
    """

    y: str
    old: str
    rest: str
    t: str
    h: str
    since: str


def run_code(
    layout: Layout,
    attempt: Callable[[Code, Step], None],
    *,
    failed: Callable[[Code, Step], None] = lambda c, step: None,
    good: Callable[[Code, Step], None] = lambda c, step: None,
) -> str:
    """Return the function that takes steps: 0 at the stop time, 1 at the limit of steps, 2 where a step fails.

    Times are multiples of the step from where it began, so that rounding does not add up.

    Parameters
    ----------
    layout
        Where the numbers of a session stand.
    attempt
        Writes a step, which ends with a branch to ``%good`` or ``%failed``.
    failed, good
        Write what comes after either.
    """
    c, places = Code("i32 @run(ptr %mem)"), layout.places
    numbers = {name: c.at("%mem", places["numbers"] + k) for k, name in enumerate(NUMBERS)}
    counts = {name: c.at("%mem", places["counts"] + k) for k, name in enumerate(COUNTS)}
    y, old, rest = (c.at("%mem", places[name]) for name in ("y", "y_old", "rest"))
    stop, h, origin = (c.put(f"load double, ptr {numbers[name]}") for name in ("stop", "step", "origin"))
    limit = c.put(f"load i64, ptr {counts['limit']}")
    c.do("br label %next")
    c.block("next")
    t = c.put(f"load double, ptr {numbers['t']}")
    c.leave_if(c.put(f"fcmp oge double {t}, {stop}"), 0)
    steps = c.put(f"load i64, ptr {counts['steps']}")
    c.leave_if(c.put(f"icmp sge i64 {steps}, {limit}"), 1)
    since = c.put(f"load i64, ptr {counts['since']}")
    step = Step(y, old, rest, t, h, since)
    attempt(c, step)
    c.block("failed")
    failed(c, step)
    c.count_up(places["counts"] + COUNTS.index("failures"))
    c.do("ret i32 2")
    c.block("good")
    good(c, step)
    following = c.put(f"add i64 {since}, 1")
    number = c.put(f"sitofp i64 {following} to double")
    later = c.put(f"fadd double {origin}, {c.put(f'fmul double {h}, {number}')}")
    c.do(f"store i64 {following}, ptr {counts['since']}")
    c.do(f"store i64 {c.put(f'add i64 {steps}, 1')}, ptr {counts['steps']}")
    c.do(f"store double {t}, ptr {numbers['t_old']}")
    c.do(f"store double {later}, ptr {numbers['t']}")
    return c.text("br label %next")
