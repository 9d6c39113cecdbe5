"""What looks at a motion while SUNDIALS IDA goes on, in LLVM's language; see `atwood.codegen.sundials.lookout`."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from atwood.codegen.llvm.routine import Routine
from atwood.codegen.llvm.text import literal
from atwood.late import dataclass

__all__ = ["AT", "CAPACITY", "CARRIED", "FIELDS", "NOTICED", "PAUSED", "STATE", "UNREADABLE", "Shape", "lookout_text"]

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
    """How many there are of each, and where the slopes are.

    Attributes
    ----------
    coordinates, speeds, size
        The length of q, of u, and of y.
    conditions
        The number of conditions.
    places
        Row and column of each slope.
    """

    coordinates: int
    speeds: int
    size: int
    conditions: int
    places: tuple[tuple[int, int], ...]

    @property
    def note(self) -> int:
        """The length of a note: time, y, y'."""
        return 1 + 2 * self.size

    @cached_property
    def lists(self) -> dict[str, NDArray[np.int64]]:
        """Row and column of each slope, which two are multiplied, and where in the lower half of ``G G^T``."""
        by_column: dict[int, list[tuple[int, int]]] = {}
        for entry, (row, column) in enumerate(self.places):
            by_column.setdefault(column, []).append((row, entry))
        products = [
            (e, f, i * self.conditions + j)
            for column in by_column.values()
            for i, e in column
            for j, f in column
            if i >= j
        ]
        # There may be none, where no constraint depends on a coordinate.
        entries = np.array(self.places, dtype=np.int64).reshape(-1, 2).T
        pairs = np.array(products, dtype=np.int64).reshape(-1, 3).T
        return dict(zip(LISTS[1:], map(np.ascontiguousarray, (*entries, *pairs)), strict=True))


def lookout_text(shape: Shape) -> str:
    """Write what looks at a state, what sends IDA from look to look, and what fills a table on the way."""
    return _look_text(shape) + _drive_text() + _fill_text(shape)


def _look_text(shape: Shape) -> str:
    """Write the function that notes a state, and returns whether somebody should look at what was noted."""
    r = Routine()
    data = {name: r.load_pointer("%data", number) for number, name in enumerate(FIELDS)}
    state = data["state"]
    _call_held(r, data, shape.coordinates)
    count = r.put(f"fptosi double {r.load(state, AT['count'])} to i64")
    note = r.place(data["notes"], r.index("mul", count, shape.note))
    r.store("%t", note, 0)
    for first, values in ((1, "%y"), (1 + shape.size, "%yp")):
        _copy(r, shape.size, values, r.place(note, first))
    _measure_slopes(r, data, shape)
    low, was_low, worn, best = _eliminate(r, data, shape)
    with r.when(r.put(f"fcmp ogt double {best}, {r.load(state, AT['best'])}")):
        r.store(best, state, AT["best"])
        r.store("%t", data["best"], 0)
        _copy(r, shape.coordinates, "%y", r.place(data["best"], 1))
    _plan_next(r, data, shape)
    is_low = r.put(f"fcmp une double {low}, 0.0")
    had = r.load(state, AT["is_low"])
    found = r.put(f"or i1 {is_low}, {r.put(f'fcmp une double {was_low}, 0.0')}")
    has = r.put(f"select i1 {found}, double 1.0, double {had}")
    later = r.number("fadd", r.load(state, AT["later"]), had)
    later = r.put(f"select i1 {is_low}, double 0.0, double {later}")
    r.store(has, state, AT["is_low"])
    r.store(later, state, AT["later"])
    noted = r.index("add", count, 1)
    full = r.put(f"icmp sge i64 {noted}, {CAPACITY}")
    over = r.put(f"or i1 {full}, {r.put(f'fcmp oge double {later}, {literal(_LATER)}')}")
    asks = r.put(f"and i1 {over}, {r.put(f'fcmp une double {has}, 0.0')}")
    asks = r.put(f"or i1 {asks}, {r.put(f'fcmp une double {worn}, 0.0')}")
    was_high = r.put(f"fcmp oeq double {r.load(state, AT['falls'])}, 0.0")
    begins = r.put(f"and i1 {is_low}, {was_high}")
    asks = r.put(f"or i1 {asks}, {begins}")
    r.store(r.put(f"select i1 {is_low}, double 1.0, double 0.0"), state, AT["falls"])
    carries = r.put(f"and i1 {full}, {r.put(f'xor i1 {asks}, true')}")
    with r.when(carries):
        _copy(r, CARRIED * shape.note, r.place(data["notes"], (CAPACITY - CARRIED) * shape.note), data["notes"])
        _copy(r, shape.conditions, data["least"], data["earlier"])
        with r.loop(0, shape.conditions) as i:
            r.store(literal(np.inf), data["least"], i.index)
    left = r.put(f"select i1 {carries}, i64 {CARRIED}, i64 {noted}")
    r.store(r.put(f"sitofp i64 {left} to double"), state, AT["count"])
    r.do(f"ret i32 {r.put(f'zext i1 {asks} to i32')}")
    return r.function("define i32 @look(double %t, ptr %y, ptr %yp, ptr %data) #0")


def _copy(r: Routine, count: int, source: str, target: str) -> None:
    with r.loop(0, count) as i:
        r.store(r.load(source, i.index), target, i.index)


def _call_held(r: Routine, data: dict[str, str], coordinates: int) -> None:
    """Write the call of the program; a value that is not finite shows in what follows."""
    time = r.put("alloca double")
    r.store("%t", time, 0)
    lists = []
    for given in ((time, "%y", r.place("%y", coordinates)), (data["values"], data["slopes"], data["drifts"])):
        lists.append(r.put(f"alloca [{len(given)} x ptr]"))
        for number, one in enumerate(given):
            r.do(f"store ptr {one}, ptr {r.put(f'getelementptr ptr, ptr {lists[-1]}, i64 {number}')}")
    r.put(f"call i32 @held(ptr {lists[0]}, ptr {data['derived']}, ptr {data['scratch']}, ptr {lists[1]})")


def _larger(r: Routine, a: str, b: str) -> str:
    return r.put(f"select i1 {r.put(f'fcmp ogt double {a}, {b}')}, double {a}, double {b}")


def _smaller(r: Routine, a: str, b: str) -> str:
    return r.put(f"select i1 {r.put(f'fcmp olt double {a}, {b}')}, double {a}, double {b}")


def _size(r: Routine, value: str) -> str:
    return r.put(f"call double @llvm.fabs.f64(double {value})")


def _measure_slopes(r: Routine, data: dict[str, str], shape: Shape) -> None:
    """Write how much each condition changes, and ``G G^T``."""
    slopes, changes, rows, matrix = (data[name] for name in ("slopes", "changes", "rows", "matrix"))
    with r.loop(0, shape.conditions) as i:
        r.store(literal(0.0), changes, i.index)
    with r.loop(0, len(shape.places)) as e:
        row, column = (r.load_index(data[name], e.index) for name in ("row", "column"))
        slope = r.number("fmul", r.load(slopes, e.index), r.load(data["sizes"], column))
        r.store(slope, slopes, e.index)
        r.store(_larger(r, _size(r, slope), r.load(changes, row)), changes, row)
    with r.loop(0, shape.conditions) as i:
        r.store(_larger(r, r.load(changes, i.index), r.load(rows, i.index)), rows, i.index)
    with r.loop(0, shape.conditions**2) as i:
        r.store(literal(0.0), matrix, i.index)
    with r.loop(0, len(shape.lists["product"])) as p:
        one, other, target = (r.load_index(data[name], p.index) for name in ("one", "other", "product"))
        product = r.number("fmul", r.load(slopes, one), r.load(slopes, other))
        r.store(r.number("fadd", r.load(matrix, target), product), matrix, target)


def _eliminate(r: Routine, data: dict[str, str], shape: Shape) -> tuple[str, ...]:
    """Write the elimination; return how many pivots are low, were low, and have fallen far, and their product.

    A pivot is what is left of a condition by those before it, in units of its own. The most that one has been grows, so
    that it can turn out later that it was low.
    """
    matrix, most, kept, width = data["matrix"], data["most"], data["kept"], shape.conditions
    count, low, worn = r.load_index(kept, 0), *(r.load(data["state"], AT[name]) for name in ("low", "worn"))
    with r.loop(0, count, (*(literal(0.0),) * 3, literal(1.0))) as a:
        pivot = r.load_index(kept, 1, a.index)
        left = r.load(matrix, r.index("mul", pivot, width), pivot)
        r.store(left, data["pivots"], pivot)
        with r.when(r.put(f"fcmp oeq double {r.load(data['first'], pivot)}, 0.0")):
            r.store(left, data["first"], pivot)
        r.store(_larger(r, left, r.load(most, pivot)), most, pivot)
        fallen = []
        least = _smaller(r, left, r.load(data["least"], pivot))
        r.store(least, data["least"], pivot)
        least = _smaller(r, least, r.load(data["earlier"], pivot))
        for value, share, known in ((left, low, most), (least, low, most), (left, worn, data["known"])):
            bound = r.number("fmul", share, r.load(known, pivot))
            fallen.append(r.put(f"uitofp i1 {r.put(f'fcmp ult double {value}, {bound}')} to double"))
        first = r.index("add", a.index, 1)
        with r.loop(first, count) as b:
            at = r.index("mul", r.load_index(kept, 1, b.index), width)
            below = r.load(matrix, at, pivot)
            with r.when(r.put(f"fcmp une double {below}, 0.0")):
                factor = r.number("fdiv", below, left)
                with r.loop(first, r.index("add", b.index, 1)) as c:
                    column = r.load_index(kept, 1, c.index)
                    other = r.load(matrix, r.index("mul", column, width), pivot)
                    product = r.number("fmul", factor, other)
                    r.store(r.number("fsub", r.load(matrix, at, column), product), matrix, at, column)
        sums = [r.number("fadd", *pair) for pair in zip(a.carried, fallen, strict=False)]
        share = r.number("fdiv", left, r.load(data["first"], pivot))
        a.following = (*sums, r.number("fmul", share, a.carried[3]))
    return a.carried


def _plan_next(r: Routine, data: dict[str, str], shape: Shape) -> None:
    """Write when to look next: before something has moved farther than it may."""
    state = data["state"]
    move, whole, idle = (r.load(state, AT[name]) for name in ("move", "whole", "idle"))
    with r.loop(0, shape.speeds, (literal(0.0),) * 3) as i:
        size, found = r.load(data["sizes"], i.index), []
        for values, before in zip(("%y", "%yp"), i.carried, strict=False):
            share = r.number("fdiv", _size(r, r.load(values, shape.coordinates, i.index)), size)
            found.append((_larger(r, share, before), share))
        total = r.number("fadd", i.carried[2], r.number("fadd", found[0][1], found[1][1]))
        i.following = (found[0][0], found[1][0], total)
    speed, pull, total = i.carried
    twice = r.number("fmul", r.number("fmul", literal(2.0), pull), move)
    square = r.number("fadd", r.number("fmul", speed, speed), twice)
    below = r.number("fadd", speed, r.put(f"call double @llvm.sqrt.f64(double {square})"))
    stride = r.number("fdiv", r.number("fmul", literal(2.0), move), below)
    moves = r.put(f"fcmp olt double {stride}, {whole}")
    finite = r.put(f"fcmp ord double {r.number('fsub', total, total)}, 0.0")
    stride = r.put(f"select i1 {r.put(f'and i1 {moves}, {finite}')}, double {stride}, double {idle}")
    later = r.number("fadd", "%t", stride)
    later = r.put(f"select i1 {r.put(f'fcmp ogt double {later}, %t')}, double {later}, double {literal(np.inf)}")
    r.store(later, state, AT["next"])


def _drive_text() -> str:
    """Write the function that sends IDA from look to look.

    A look at the very time that is asked for is taken at once: IDA does not hand out a state again that it handed out
    last, whatever has become of the vectors since.
    """
    state, following = FIELDS.index("state"), AT["next"]
    arguments = "ptr %solve, ptr %steps, ptr %memory, double %t_out, ptr %reached, ptr %y, ptr %yp, ptr %y_at, "
    return f"""define i32 @drive({arguments}ptr %yp_at, i64 %allowed, ptr %data) #0 {{
entry:
  %count = alloca i64
  store i64 0, ptr %count
  %s0 = call i32 %steps(ptr %memory, ptr %count)
  %before = load i64, ptr %count
  %state.at = getelementptr ptr, ptr %data, i64 {state}
  %state = load ptr, ptr %state.at
  %next.at = getelementptr double, ptr %state, i64 {following}
  br label %turn
turn:
  %next = load double, ptr %next.at
  %looks = fcmp ole double %next, %t_out
  %target = select i1 %looks, double %next, double %t_out
  %flag = call i32 %solve(ptr %memory, double %target, ptr %reached, ptr %y, ptr %yp, i32 1)
  %well = icmp eq i32 %flag, 0
  %goes = and i1 %looks, %well
  br i1 %goes, label %look, label %arrived
arrived:
  ret i32 %flag
look:
  %t = load double, ptr %reached
  %asks = call i32 @look(double %t, ptr %y_at, ptr %yp_at, ptr %data)
  %asked = icmp ne i32 %asks, 0
  br i1 %asked, label %noticed, label %judge
noticed:
  ret i32 {NOTICED}
judge:
  %s1 = call i32 %steps(ptr %memory, ptr %count)
  %now = load i64, ptr %count
  %taken = sub i64 %now, %before
  %tired = icmp sge i64 %taken, %allowed
  br i1 %tired, label %pause, label %turn
pause:
  ret i32 {_WORKED_ENOUGH}
}}
"""


def _fill_text(shape: Shape) -> str:
    """Write the function that sends IDA on through times and fills a row of a table at each.

    A row is read from the last step that IDA has taken, once no look is due before its time.
    """
    state, following = FIELDS.index("state"), AT["next"]
    functions = (
        "ptr %solve, ptr %steps, ptr %dky, ptr %current, ptr %memory, ptr %reached, ptr %y, ptr %yp, ptr %y_at, "
    )
    tables = "ptr %yp_at, i64 %allowed, ptr %data, ptr %times, i64 %wanted, ptr %table, ptr %filled, ptr %end"
    drive = "ptr %solve, ptr %steps, ptr %memory, double %t, ptr %reached, ptr %y, ptr %yp, ptr %y_at, ptr %yp_at, "
    return f"""define i32 @fill({functions}{tables}) #0 {{
entry:
  %count = alloca i64
  store i64 0, ptr %count
  %s0 = call i32 %steps(ptr %memory, ptr %count)
  %before = load i64, ptr %count
  %c0 = call i32 %current(ptr %memory, ptr %end)
  %state.at = getelementptr ptr, ptr %data, i64 {state}
  %state = load ptr, ptr %state.at
  %next.at = getelementptr double, ptr %state, i64 {following}
  br label %turn
turn:
  %i = load i64, ptr %filled
  %more = icmp slt i64 %i, %wanted
  br i1 %more, label %one, label %done
done:
  ret i32 0
one:
  %t.at = getelementptr double, ptr %times, i64 %i
  %t = load double, ptr %t.at
  %known = load double, ptr %end
  %next = load double, ptr %next.at
  %inside = fcmp ole double %t, %known
  %early = fcmp olt double %t, %next
  %reads = and i1 %inside, %early
  br i1 %reads, label %read, label %go
{_row_text(shape)}go:
  %flag = call i32 @drive({drive}i64 %allowed, ptr %data)
  %c1 = call i32 %current(ptr %memory, ptr %end)
  %well = icmp eq i32 %flag, 0
  br i1 %well, label %turn, label %arrived
arrived:
  ret i32 %flag
}}
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
"""


def _row_text(shape: Shape) -> str:
    """Write what reads a row from the last step, and whether enough steps were taken then."""
    return f"""read:
  %code = call i32 %dky(ptr %memory, double %t, i32 0, ptr %y)
  %lost = icmp ne i32 %code, 0
  br i1 %lost, label %unreadable, label %keep
unreadable:
  ret i32 {UNREADABLE}
keep:
  %place = mul i64 %i, {shape.size}
  %row = getelementptr double, ptr %table, i64 %place
  call void @llvm.memcpy.p0.p0.i64(ptr %row, ptr %y_at, i64 {8 * shape.size}, i1 false)
  %following = add i64 %i, 1
  store i64 %following, ptr %filled
  %s1 = call i32 %steps(ptr %memory, ptr %count)
  %now = load i64, ptr %count
  %taken = sub i64 %now, %before
  %tired = icmp sge i64 %taken, %allowed
  br i1 %tired, label %pause, label %turn
pause:
  ret i32 {PAUSED}
"""
