"""Routines that look at a motion while SUNDIALS IDA goes on; see `atwood.codegen.sundials.lookout`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from atwood.codegen.routines.kernels import call_kernel, place_of
from atwood.codegen.routines.kinds import ADDRESS, BOOLEAN, CODE, INTEGER, NUMBER
from atwood.codegen.routines.language import Record, Routine, Value
from atwood.lazy_dataclasses import dataclass

NOTICED = 98
"""The flag of `LookoutCode.drive` where somebody should look at what was noted; IDA has none of this number."""

_WORKED_ENOUGH = -1
"""IDA's own flag after as many steps as it was allowed to take."""

PAUSED, UNREADABLE = 96, 97
"""Flags of `LookoutCode.fill` beside those: enough steps were taken, and IDA has no value at a time."""

CAPACITY, CARRIED = 24, 6
"""So many looks are noted; of those among which nothing was low the last few are carried on."""

_LATER = 2
"""So many looks that are no longer low must follow those that are, before somebody is asked."""

_ARRAYS: tuple[str, ...] = ("derived", "scratch", "sizes", "values", "slopes", "drifts", "rows", "changes", "matrix")
_ARRAYS += ("pivots", "first", "most", "least", "earlier", "known")
LISTS = ("kept", "row", "column", "one", "other", "product")
FIELDS = (*_ARRAYS, *LISTS, "notes", "best", "state")
STATE = ("next", "count", "is_low", "falls", "later", "move", "whole", "idle", "low", "worn", "best")
AT = {name: number for number, name in enumerate(STATE)}


@dataclass(frozen=True)
class Shape:
    """How many there are of each.

    Attributes
    ----------
    coordinates, speeds, size
        The length of q, of u, and of y.
    conditions, slopes, products
        The number of conditions, of their slopes that are not always zero, and of products of two of these.
    """

    coordinates: int
    speeds: int
    size: int
    conditions: int
    slopes: int
    products: int

    @property
    def note(self) -> int:
        """The length of a note: time, y, y'."""
        return 1 + 2 * self.size


def write_routines(shape: Shape) -> list[Routine]:
    """Write what looks at a state, what sends IDA from look to look, and what fills a table on the way."""
    return [_look(shape), _drive(), _fill(shape)]


def _look(shape: Shape) -> Routine:
    """Write the function that notes a state, and returns whether somebody should look at what was noted."""
    r = Routine("look", {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}, exported=True)
    t, y, yp, given = r.arguments
    data = {name: given.read(k, ADDRESS) for k, name in enumerate(FIELDS)}
    state = Record(data["state"], dict.fromkeys(STATE, NUMBER))
    outputs = [data["values"], data["slopes"], data["drifts"]]  # what is not finite there shows in what follows
    call_kernel(r, "held", [place_of(r, t), y, y.at(shape.coordinates)], data["derived"], data["scratch"], outputs)
    count = r.truncated(state.count)
    note = data["notes"].at(count * shape.note)
    note[0] = t
    r.copy(note.at(1), y, shape.size)
    r.copy(note.at(1 + shape.size), yp, shape.size)
    _measure_slopes(r, data, shape)
    is_low, was_low, is_worn, best = _eliminate(r, data, state, shape)
    with r.when(best > state.best):
        state.best, data["best"][0] = best, t
        r.copy(data["best"].at(1), y, shape.coordinates)
    _plan_next(r, r.arguments, data["sizes"], state, shape)
    had = state.is_low
    has = r.choose(is_low | was_low, 1.0, had)
    later = r.choose(is_low, 0.0, state.later + had)
    noted = count + 1
    is_full = noted >= CAPACITY
    begins = is_low & (state.falls == 0.0)
    asks = ((is_full | (later >= _LATER)) & (has != 0.0)) | is_worn | begins
    state.is_low, state.later, state.falls = has, later, r.choose(is_low, 1.0, 0.0)
    carries = is_full & ~asks
    with r.when(carries):
        r.copy(data["notes"], data["notes"].at((CAPACITY - CARRIED) * shape.note), CARRIED * shape.note)
        r.copy(data["earlier"], data["least"], shape.conditions)
        with r.count(shape.conditions) as i:
            data["least"][i] = np.inf
    state.count = r.choose(carries, CARRIED, noted).number()
    r.give(asks.code())
    return r


def _measure_slopes(r: Routine, data: dict[str, Value], shape: Shape) -> None:
    """Write how much each condition changes, and ``G G^T``."""
    slopes, changes, rows, matrix = (data[name] for name in ("slopes", "changes", "rows", "matrix"))
    r.clear(changes, changes.at(shape.conditions))
    with r.count(shape.slopes) as e:
        row, column = (data[name].read(e, INTEGER) for name in ("row", "column"))
        slope = slopes[e] * data["sizes"][column]
        slopes[e] = slope
        changes[row] = r.most(r.size(slope), changes[row])
    with r.count(shape.conditions) as i:
        rows[i] = r.most(changes[i], rows[i])
    r.clear(matrix, matrix.at(shape.conditions**2))
    with r.count(shape.products) as p:
        one, other, target = (data[name].read(p, INTEGER) for name in ("one", "other", "product"))
        matrix[target] = matrix[target] + slopes[one] * slopes[other]


def _eliminate(r: Routine, data: dict[str, Value], state: Record, shape: Shape) -> tuple[Value, Value, Value, Value]:
    """Write the elimination; return whether pivots are low, were low, and have fallen far, and their product.

    A pivot is what is left of a condition by those before it, in units of its own. The most that one has been grows, so
    that it can turn out later that it was low.
    """
    matrix, first, most = data["matrix"], data["first"], data["most"]
    count, low, worn = data["kept"].read(0, INTEGER), state.low, state.worn
    fallen, product = [r.variable(0, BOOLEAN) for _ in range(3)], r.variable(1.0)
    kept = data["kept"].at(1)
    with r.count(count) as a:
        pivot = kept.read(a, INTEGER)
        left = matrix[pivot * shape.conditions + pivot]
        data["pivots"][pivot] = left
        with r.when(first[pivot] == 0.0):
            first[pivot] = left
        most[pivot] = r.most(left, most[pivot])
        least = r.least(left, data["least"][pivot])
        data["least"][pivot] = least
        least = r.least(least, data["earlier"][pivot])
        for is_fallen, value, share, known in zip(
            fallen, (left, least, left), (low, low, worn), (most, most, data["known"]), strict=True
        ):
            is_fallen.now = is_fallen.now | ~(value >= share * known[pivot])
        with r.count(count, a + 1) as b:
            row = matrix.at(kept.read(b, INTEGER) * shape.conditions)
            below = row[pivot]
            with r.when(below != 0.0):
                factor = below / left
                with r.count(b + 1, a + 1) as c:
                    column = kept.read(c, INTEGER)
                    row[column] = row[column] - factor * matrix[column * shape.conditions + pivot]
        product.now = left / first[pivot] * product.now
    is_low, was_low, is_worn = (one.now for one in fallen)
    return is_low, was_low, is_worn, product.now


def _plan_next(r: Routine, arguments: Sequence[Value], sizes: Value, state: Record, shape: Shape) -> None:
    """Write when to look next: before something has moved farther than it may."""
    t, y, yp, _ = arguments
    move, largest, total = state.move, (r.variable(0.0), r.variable(0.0)), r.variable(0.0)
    with r.count(shape.speeds) as i:
        shares = [r.size(values[i + shape.coordinates]) / sizes[i] for values in (y, yp)]
        for one, share in zip(largest, shares, strict=True):
            one.now = r.most(share, one.now)
        total.now = total.now + (shares[0] + shares[1])
    speed, pull = (one.now for one in largest)
    below = speed + r.sqrt(speed * speed + 2.0 * pull * move)
    stride = 2.0 * move / below
    moves = (stride < state.whole) & r.is_finite(total.now)
    later = t + r.choose(moves, stride, state.idle)
    state.next = r.choose(later > t, later, np.inf)


_DRIVE = dict.fromkeys(("solve", "steps", "memory"), ADDRESS) | {"t_out": NUMBER}
_DRIVE |= dict.fromkeys(("reached", "y", "yp", "y_at", "yp_at"), ADDRESS) | {"allowed": INTEGER, "data": ADDRESS}
_FILL = dict.fromkeys(("solve", "steps", "dky", "current", "memory", "reached", "y", "yp", "y_at", "yp_at"), ADDRESS)
_FILL |= {"allowed": INTEGER, "data": ADDRESS, "times": ADDRESS, "wanted": INTEGER}
_FILL |= dict.fromkeys(("table", "filled", "end"), ADDRESS)


def _count_steps(r: Routine, steps: Value, memory: Value) -> Callable[[], Value]:
    """Return what writes how many steps IDA has taken since here."""
    count = r.array(1)

    def taken() -> Value:
        r.call(steps, memory, count)
        return count.read(0, INTEGER)

    count.write(0, 0, INTEGER)
    before = taken()
    return lambda: taken() - before


def _drive() -> Routine:
    """Write the function that sends IDA from look to look.

    A look at the very time that is asked for is taken at once: IDA does not hand out a state again that it handed out
    last, whatever has become of the vectors since.
    """
    r = Routine("drive", _DRIVE, exported=True)
    solve, steps, memory, t_out, reached, y, yp, y_at, yp_at, allowed, data = r.arguments
    state = Record(data.read(FIELDS.index("state"), ADDRESS), dict.fromkeys(STATE, NUMBER))
    taken = _count_steps(r, steps, memory)
    with r.forever():
        following = state.next
        looks = following <= t_out
        target = r.choose(looks, following, t_out)
        flag = r.call(solve, memory, target, reached, y, yp, r.value(1, CODE))
        with r.when(~(looks & (flag == 0))):
            r.give(flag)
        with r.when(r.call("look", reached[0], y_at, yp_at, data) != 0):
            r.give(NOTICED)
        with r.when(taken() >= allowed):
            r.give(_WORKED_ENOUGH)
    return r


def _fill(shape: Shape) -> Routine:
    """Write the function that sends IDA on through times and fills a row of a table at each.

    A row is read from the last step that IDA has taken, once no look is due before its time.
    """
    r = Routine("fill", _FILL, exported=True)
    (
        solve,
        steps,
        dky,
        current,
        memory,
        reached,
        y,
        yp,
        y_at,
        yp_at,
        allowed,
        data,
        times,
        wanted,
        table,
        filled,
        end,
    ) = r.arguments
    state = Record(data.read(FIELDS.index("state"), ADDRESS), dict.fromkeys(STATE, NUMBER))
    taken = _count_steps(r, steps, memory)
    r.call(current, memory, end)
    with r.forever():
        i = filled.read(0, INTEGER)
        with r.when(i >= wanted):
            r.give(0)
        t = times[i]
        with r.when((t <= end[0]) & (t < state.next)):
            with r.when(r.call(dky, memory, t, r.value(0, CODE), y) != 0):
                r.give(UNREADABLE)
            r.copy(table.at(i * shape.size), y_at, shape.size)
            filled.write(0, i + 1)
            with r.when(taken() >= allowed):
                r.give(PAUSED)
        with r.otherwise():
            flag = r.call("drive", solve, steps, memory, t, reached, y, yp, y_at, yp_at, allowed, data)
            r.call(current, memory, end)
            with r.when(flag != 0):
                r.give(flag)
    return r
