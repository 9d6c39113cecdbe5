"""Routines that all methods of fixed steps share: the loop over steps, and what lies between two of them.

Memory of a session of fixed steps: what routines and Python agree on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import accumulate

from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Kind, Operand, Record, Routine, Value
from atwood.integrators.stepper import SAMPLE_ARGUMENTS, fields_of, open_routine as session_routine, write_sample
from atwood.lazy_dataclasses import dataclass

FILES = ("integrators/symplectic/fixed_steps.py", "integrators/stepper.py")
"""On these the routines here depend."""


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
    stop, h, origin, limit = m.stop, m.step, m.origin, m.limit
    with r.forever():
        t, steps = m.t, m.steps
        r.give_if(t >= stop, 0)
        r.give_if(steps >= limit, 1)
        with r.when(attempt(r, m, t, h) != 0):
            failed(r, m)
            m.failures = m.failures + 1
            r.give(2)
        good(r, m)
        following = m.since + 1
        m.since, m.steps = following, steps + 1
        m.t_old, m.t = t, origin + h * following.number()
        r.give_if(r.call("judge", m.session) != 0, 4)
    return r


def judge(layout: Layout) -> Routine:
    """Ask what judges steps about the last one; 0 where it is good.

    It is asked about what lies around the step, too: the parts of a composition reach beyond it, to both sides.
    """
    r, m, _ = open_routine(layout, "judge")
    guard, data, width = m.guard, m.guard_data, layout.width
    r.give_if(r.is_null(guard), 0)
    t, t_old, h = m.t, m.t_old, m.step
    begin, begin_rates, end, end_rates = (m.at("ends").at(k * width) for k in range(4))
    before, after = (m.at("around").at(k * width) for k in range(2))

    def ask(*ends: Operand) -> None:
        r.give_if(r.call(guard, *ends, data) != 0, 4)

    def read(time: Value, state: str, values: Value, rates: Value) -> None:
        r.give_if(r.call("speeds", m.session, time, m.at(state), values) != 0, 4)
        r.give_if(r.call(m.rates, time, values, rates, m.rates_data) != 0, 4)

    with r.when(m.since == 1):
        read(t_old, "y_old", begin, begin_rates)
    with r.otherwise():
        r.copy(begin, end, 2 * width)
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

    t, t_old = m.t, m.t_old
    with r.when(time == t):
        r.give_if(r.call("speeds", m.session, time, m.at("y"), out) != 0, 3)
    with r.otherwise():
        r.give_if(r.call("trial", m.session, t_old, time - t_old, m.at("y_old"), there) != 0, 3)
        r.give_if(r.call("speeds", m.session, time, there, out) != 0, 3)
    r.give_if(r.call(m.rates, time, out, yps, m.rates_data) != 0, 3)
    r.give(0)
    return r


def sample(layout: Layout) -> Routine:
    """Go through output times and fill a table; it ends as `run` does."""
    r, m, _ = open_routine(layout, "sample", SAMPLE_ARGUMENTS, exported=True)
    width: Operand = r.value(layout.width, INTEGER)
    return write_sample(r, m, width)


FIELDS = fields_of(
    ("derived", "scratch", "rates", "rates_data", "derived_2", "guard", "guard_data"),
    ("t", "t_old", "stop", "step", "origin"),
    ("since",),
)


@dataclass(frozen=True)
class Layout:
    """Where a session keeps its numbers, in one array of doubles.

    Attributes
    ----------
    coordinates, speeds, stages
        Their numbers.
    has_speeds
        Whether the equations give speeds besides the rates of the coordinates.
    takes_speeds
        Whether they take an approximation to them.
    """

    coordinates: int
    speeds: int
    stages: int
    has_speeds: bool
    takes_speeds: bool

    @property
    def size(self) -> int:
        """The number of coordinates and momenta."""
        return 2 * self.coordinates

    @property
    def width(self) -> int:
        """The number of coordinates and speeds."""
        return self.coordinates + self.speeds

    @property
    def places(self) -> dict[str, int]:
        """Where each group begins; ``end`` is the length of the whole."""
        n, m, s = self.size, max(self.speeds, 1), self.stages
        sizes = {"fields": len(FIELDS), "y": n, "y_old": n, "rest": n, "per_size": n}
        sizes |= {"ends": 4 * self.width, "around": 2 * self.width}
        work = {"L": s * n, "G": s * n, "Y": n, "F": n, "V": m, "U": s * m, "scale": n}
        for name in ("main", "aside"):
            sizes |= {f"{name}.{key}": size for key, size in work.items()}
        starts = [0, *accumulate(sizes.values())]
        return dict(zip((*sizes, "end"), starts, strict=True))

    def within(self, key: str) -> int:
        """Return where a group of a work area begins in it."""
        places = self.places
        return places[f"main.{key}"] - places["main.L"]


class Memory(Record):
    """The memory of a session within a routine."""

    session: Value

    def __init__(self, layout: Layout, session: Value) -> None:
        super().__init__(session, FIELDS)
        self.__dict__.update(session=session, groups=layout.places)

    def at(self, group: str) -> Value:
        """Return where a group of numbers begins."""
        return self.session.at(self.__dict__["groups"][group])


def open_routine(
    layout: Layout, name: str, more: Mapping[str, Kind] | None = None, exported: bool = False
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments."""
    return session_routine(partial(Memory, layout), name, more, exported=exported)
