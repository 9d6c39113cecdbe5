"""Looking at a motion now and then while SUNDIALS IDA goes on, as machine code.

IDA is sent from look to look. At each the slopes of some conditions are worked out, and how much of each of those that
are kept is left by the ones before it: the pivots of ``G G^T``, of which one vanishes where rank is lost. Nobody is
asked anything as long as none of them has fallen to a small share of the most that it has been, and then only where
what was noted, or what is just ahead, is near a singular position (`atwood.codegen.sundials.rank_looks`).

The routines are the same for all mechanisms: how many there are of each is told by their data, as where the program of
conditions is, which begins as a tape.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import address_of, uneven
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    CODE,
    INTEGER,
    NUMBER,
    Operand,
    Record,
    Routine,
    Value,
    call_kernel,
    place_of,
)
from atwood.codegen.sundials.rank_looks import write_measures, write_products
from atwood.errors import UsageError
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

_MODULE = "codegen.sundials.step_monitor"
_FILES = ("codegen/sundials/rank_looks.py",)

_LOOK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)
_JUDGE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int64)
_MEASURES = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, *[ctypes.c_int64] * 2, *[ctypes.c_void_p] * 3)


@dataclass(frozen=True)
class LookRate:
    """When to look.

    Attributes
    ----------
    move
        Between two looks no speed, and no acceleration, moves anything by more of its size.
    whole, idle
        What takes longer than a time, s, rests, and is looked at after another.
    low
        The share of the most that it has been, below which what is left of a condition is low.
    worn
        The share of what it was when the choice of conditions was last looked at, below which that is asked for.
    """

    move: float
    whole: float
    idle: float
    low: float
    worn: float


class MonitorCode:
    """Functions that look at the motion of a mechanism, for any parameters and choice of conditions.

    Parameters
    ----------
    program
        See `compile_monitor`.
    shape, lists
        How many there are of each, and where the slopes are; see `slope_lists`.
    tiers
        The code of the conditions.

    Attributes
    ----------
    drive
        Address of ``int (solve, steps, memory, double t_out, double *reached, y, yp, double *y_at, double *yp_at, long
        allowed, data)``: sends IDA on to a time from look to look, with the addresses of ``IDASolve`` and
        ``IDAGetNumSteps``. It returns `NOTICED`, or IDA's flag.
    fill
        See `~atwood.integrators.protocol.StepMonitor`. It returns the same, or `PAUSED` or `UNREADABLE`.
    look_address, judge_address, measure_address
        Addresses of the functions that take one look, see the same, that judge looks, ``int (data, long at_end)``, and
        of ``double (double t, double *q, data)``: the measure of a state.
    """

    def __init__(self, program: Program, shape: Shape, lists: dict[str, NDArray[np.int64]], tiers: Tiers) -> None:
        self.program, self.shape, self.tiers, built = program, shape, tiers, _routines()
        self._lists, self._keep = lists, built
        self.drive, self.fill = (built.code.addresses[name] for name in ("drive", "fill"))
        self.look_address = built.code.addresses["look"]
        self.look, self.measure_address = _LOOK(self.look_address), built.code.addresses["measure"]
        self.judge_address = built.code.addresses["judge"]
        self.judge, self.measures = _JUDGE(self.judge_address), _MEASURES(built.code.addresses["measures"])

    def bind(
        self, parameter_values: ArrayLike, sizes: ArrayLike, kept: Sequence[int], rate: LookRate, is_small: bool
    ) -> MonitorData:
        """Return the data of one run; they must live as long as it goes on.

        Where there are few conditions the measure is a singular value, and looks can tell whether it is near zero.
        """
        shape, program = self.shape, self.program
        position = np.full(shape.conditions, -1)
        position[list(kept)] = np.arange(len(kept))
        derived, scratch = self.tiers.now.derive("held", program, parameter_values)
        arrays: dict[str, NDArray[Any]] = {
            "derived": derived,
            "scratch": scratch,
            "sizes": np.array(sizes, dtype=float),
            "values": np.empty(shape.conditions),
            "slopes": np.empty(shape.slopes),
            "drifts": np.empty(shape.conditions),
            "rows": np.zeros(shape.conditions),
            "changes": np.empty(shape.conditions),
            "matrix": np.empty(shape.conditions**2),
            "ahead": np.empty(shape.coordinates),
            **{name: np.zeros(shape.conditions) for name in ("pivots", "first", "most", "least", "earlier", "known")},
            "left": np.empty(shape.conditions),
            "work": np.empty(len(kept) * (shape.speeds + 2) + shape.speeds if is_small else 1),
            "right": uneven(shape.conditions),
            "kept": np.array([len(kept), *kept, *position], dtype=np.int64),
            **self._lists,
            "notes": np.empty((CAPACITY, shape.note)),
            "best": np.zeros(1 + shape.coordinates),
            "state": np.zeros(len(STATE)),
        }
        numbers = {"move": rate.move, "whole": rate.whole, "idle": rate.idle, "low": rate.low**2}
        numbers |= {"worn": rate.worn**2, "is_small": float(is_small)}
        arrays["state"][[AT[name] for name in numbers]] = list(numbers.values())
        shared = {name: arrays.pop(name) for name in SHARED}
        ends = [0, *accumulate(one.size for one in arrays.values())]
        places = {name: (slice(*ends[k : k + 2]), one.shape) for k, (name, one) in enumerate(arrays.items())}
        memory = np.concatenate([one.ravel() for one in arrays.values()])
        begins = [address_of(shared[name]) if name in shared else 8 * places[name][0].start for name in FIELDS]
        begins += [*vars(shape).values(), shape.note, shape.measured, 0]
        is_own = np.array([name in places for name in FIELDS] + [False] * len(SIZES))
        return MonitorData(self, shared, places, (np.array(begins, dtype=np.int64), is_own), memory)


class _Views(dict[str, NDArray[Any]]):
    """Arrays within a memory, by name, made when they are asked for."""

    def __init__(self, memory: NDArray[np.float64], places: dict[str, tuple[slice, tuple[int, ...]]]) -> None:
        self._memory, self._places = memory, places

    def __missing__(self, name: str) -> NDArray[Any]:
        place, shape = self._places[name]
        found = self[name] = self._memory[place].reshape(shape)
        return found


class MonitorData:
    """What was noted on the way of one run.

    Parameters
    ----------
    code
        The functions.
    shared
        Arrays that no look changes.
    places
        Where each other array is in the memory, and its shape.
    begins
        Where all of them begin, and which do so from the memory on; behind these, how many there are of each.
    memory
        The numbers of these.

    Attributes
    ----------
    rows
        The most that each condition has changed so far with a displacement of the size that counts; starts where it is
        set.
    due_at
        The address of the time of the next look.
    """

    def __init__(
        self,
        code: MonitorCode,
        shared: dict[str, NDArray[Any]],
        places: dict[str, tuple[slice, tuple[int, ...]]],
        begins: tuple[NDArray[np.int64], NDArray[np.bool_]],
        memory: NDArray[np.float64],
    ) -> None:
        self.code, self._given, self._memory = code, (shared, places, begins), memory
        self._arrays = _Views(memory, places)
        self.rows: NDArray[np.float64] = self._arrays["rows"]
        self._state, begin = self._arrays["state"], address_of(memory)
        self._pointers = begins[0] + begin * begins[1]
        self._take_up(code.tiers.now)
        self.address, self.due_at = address_of(self._pointers), begin + 8 * (places["state"][0].start + AT["next"])

    def spend(self, seconds: float) -> None:
        """Go on with faster code of the conditions, which has the same bits, where that pays; see `Tiers.spend`."""
        self._take_up(self.code.tiers.spend(_OF_LOOKS * seconds))

    def _take_up(self, built: Built) -> None:
        self._built = built
        self._pointers[-1] = built.code.addresses["held"]

    def copied(self) -> MonitorData:
        """Return the same for another run, from what was noted on."""
        return MonitorData(self.code, *self._given, self._memory.copy())

    def restart(self) -> None:
        """Forget what was noted; not how much conditions have changed."""
        self._state[[AT["count"], AT["is_low"], AT["falls"], AT["later"], AT["judges"]]] = 0.0
        self._state[AT["behind"]] = np.nan
        self._arrays["least"][:] = self._arrays["earlier"][:] = np.inf

    def judge_from(self, start: float) -> None:
        """From here on tell by itself what need not be looked at; not before a time."""
        self._state[[AT["judges"], AT["start"], AT["judged"]]] = 1.0, start, -np.inf

    def take_judged(self, until: float) -> None:
        """Learn up to when looks have been judged."""
        self._state[AT["judged"]] = until

    def pass_in_steps(self) -> None:
        """Look for positions just ahead whenever something is low, since steps are to pass these by themselves."""
        self._state[AT["passes"]] = 1.0

    @property
    def judges(self) -> bool:
        """Whether it tells by itself what need not be looked at."""
        return bool(self._state[AT["judges"]])

    def finds_at_end(self) -> bool:
        """Return whether there may be something to find at the looks noted, the last of a motion among them."""
        return not self.judges or self.code.judge(self.address, 1) != 0

    @property
    def largest(self) -> float:
        """The largest measure that a look has had."""
        return float(self._state[AT["largest"]])

    def measures(
        self, t: NDArray[np.float64], q: NDArray[np.float64], known: int, least: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the measure of states of shape (coordinates, states), after the first of them have been learned."""
        t, q, least, away = (np.ascontiguousarray(one) for one in (t, q.T, least, np.empty(len(t))))
        self.code.measures(*map(address_of, (t, q)), len(t), known, *map(address_of, (least, away)), self.address)
        return away

    def settle(self) -> None:
        """Take the last look as that at which the choice of conditions was looked at."""
        self._arrays["known"][:] = self._arrays["pivots"]

    def note(self, t: float, y: NDArray[np.float64], yp: NDArray[np.float64]) -> None:
        """Look at a state that the run starts from, or ends at, unless it has been."""
        count = int(self._state[AT["count"]])
        if count and t <= self._arrays["notes"][count - 1, 0]:
            return
        y, yp = np.ascontiguousarray(y), np.ascontiguousarray(yp)
        self.code.look(t, address_of(y), address_of(yp), self.address)

    def due(self) -> float:
        """Return when the next look is to be taken."""
        return float(self._state[AT["next"]])

    @property
    def has_seen_low(self) -> bool:
        """Whether something was low among what was noted and not taken yet."""
        return bool(self._state[AT["is_low"]])

    @property
    def least_share(self) -> float:
        """The least that the last look left of a condition, as a share of the most that it has been."""
        pivots, most = self._arrays["pivots"], self._arrays["most"]
        with np.errstate(all="ignore"):
            return float(np.sqrt(np.fmin.reduce(pivots / most, initial=1.0)))

    def take(self) -> list[tuple[float, NDArray[np.float64], NDArray[np.float64]]]:
        """Return what was noted, time, y and y' each; it is not asked about again."""
        notes, count, size = self._arrays["notes"], int(self._state[AT["count"]]), self.code.shape.size
        noted = notes[:count].copy()
        carried = noted[-CARRIED:]
        notes[: len(carried)] = carried
        is_still_low = self._state[AT["falls"]]  # so that it is asked again when what comes behind is known
        self._state[[AT["is_low"], AT["later"], AT["count"]]] = is_still_low, 0.0, len(carried)
        self._arrays["least"][:] = self._arrays["earlier"][:] = np.inf
        return [(float(one[0]), one[1 : 1 + size], one[1 + size : -1]) for one in noted]

    @property
    def best(self) -> tuple[float, NDArray[np.float64]]:
        """Time and coordinates of the look at which conditions were farthest from following from each other."""
        return float(self._arrays["best"][0]), self._arrays["best"][1:]


def compile_monitor(program: Program, speeds: int, size: int, places: tuple[ArrayLike, ArrayLike]) -> MonitorCode:
    """Compile what looks at a motion."""
    rows, columns = (np.asarray(one, dtype=np.int64).ravel().tolist() for one in places)
    inputs, outputs = [len(one.symbols) for one in program.inputs], [len(one.expressions) for one in program.outputs]
    if len(inputs) != 3 or inputs[2] != speeds or len(outputs) != 3 or outputs[1] != len(rows):
        raise UsageError(f"needs a program of (t, q, u), not of {inputs} with {outputs}", where=program.name)
    lists = slope_lists(outputs[0], list(zip(rows, columns, strict=True)))
    shape = Shape(inputs[1], speeds, size, outputs[0], len(rows), len(lists["product"]))
    return MonitorCode(program, shape, lists, Tiers([Part("held", program)], is_brief=True))


@once
def _routines() -> Built:
    """Return the code that looks at a motion, whatever moves."""
    exports = ("look", "drive", "fill", "judge", "measure", "measures")
    return build_code([], CodeOptions(level=2), exports=exports, routines=RoutineSource(_MODULE, _FILES, (True,)))


def slope_lists(conditions: int, places: Sequence[tuple[int, int]]) -> dict[str, NDArray[np.int64]]:
    """Return row and column of each slope, which two are multiplied, and where in the lower half of ``G G^T``."""
    by_column: dict[int, list[tuple[int, int]]] = {}
    for entry, (row, column) in enumerate(places):
        by_column.setdefault(column, []).append((row, entry))
    products = [
        (e, f, i * conditions + j) for column in by_column.values() for i, e in column for j, f in column if i >= j
    ]
    # There may be none, where no constraint depends on a coordinate.
    entries = np.array(places, dtype=np.int64).reshape(-1, 2).T
    pairs = np.array(products, dtype=np.int64).reshape(-1, 3).T
    return dict(zip(LISTS[1:], map(np.ascontiguousarray, (*entries, *pairs)), strict=True))


NOTICED = 98
"""The flag of `MonitorCode.drive` where somebody should look at what was noted; IDA has none of this number."""

_WORKED_ENOUGH = -1
"""IDA's own flag after as many steps as it was allowed to take."""

PAUSED, UNREADABLE = 96, 97
"""Flags of `MonitorCode.fill` beside those: enough steps were taken, and IDA has no value at a time."""

CAPACITY, CARRIED = 24, 6
"""So many looks are noted; of those among which nothing was low the last few are carried on."""

_OF_LOOKS = 0.1
"""Of the time that steps take looks take no more than about this share."""

_LATER = 2
"""So many looks that are no longer low must follow those that are, before somebody is asked."""

_ARRAYS: tuple[str, ...] = ("derived", "scratch", "sizes", "values", "slopes", "drifts", "rows", "changes", "matrix")
_ARRAYS += ("ahead", "pivots", "first", "most", "least", "earlier", "known", "left", "work", "right")
LISTS = ("kept", "row", "column", "one", "other", "product")
SHARED = ("derived", "sizes", "right", *LISTS)
FIELDS = (*_ARRAYS, *LISTS, "notes", "best", "state")
STATE: tuple[str, ...] = ("next", "count", "is_low", "falls", "later", "move", "whole", "idle", "low", "worn", "best")
STATE += ("is_small", "judges", "judged", "start", "largest", "stride", "near", "passes", "behind")
SIZES = ("coordinates", "speeds", "size", "conditions", "slopes", "products", "note", "measured", "held")
"""Behind the addresses of the arrays: how many there are of each, see `Shape`, and the address of the conditions."""

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
        """The length of a note: time, y, y', and its measure, below zero until it is asked for."""
        return 2 + 2 * self.size

    @property
    def measured(self) -> int:
        """Where a note has its measure."""
        return 1 + 2 * self.size


def write_routines(looks: bool) -> list[Routine]:
    """Write what looks at a state, what sends IDA from look to look, and what fills a table on the way.

    The last alone where nobody looks; its data are then the length of y.
    """
    return [*write_measures(opened), _look(), _drive(), _fill(True)] if looks else [_fill(False)]


@once
def table_filler() -> Built:
    """Return the code that fills a table without looking at the motion."""
    return build_code([], CodeOptions(level=2), exports=["fill"], routines=RoutineSource(_MODULE, _FILES, (False,)))


def opened(given: Value) -> tuple[dict[str, Value], Record, Record]:
    """Return the arrays, the state and the sizes of a monitor from the address of its data."""
    data = {name: given.read(k, ADDRESS) for k, name in enumerate(FIELDS)}
    kinds = dict.fromkeys(SIZES, INTEGER) | {"held": ADDRESS}
    return data, Record(data["state"], dict.fromkeys(STATE, NUMBER)), Record(given.at(len(FIELDS), ADDRESS), kinds)


def _look() -> Routine:
    """Write the function that notes a state, and returns whether somebody should look at what was noted."""
    r = Routine("look", {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}, exported=True)
    t, y, yp, given = r.arguments
    data, state, shape = opened(given)
    outputs = [data["values"], data["slopes"], data["drifts"]]  # what is not finite there shows in what follows
    call_kernel(r, shape.held, [place_of(r, t), y, y.at(shape.coordinates)], data["derived"], data["scratch"], outputs)
    count = r.truncated(state.count)
    note = data["notes"].at(count * shape.note)
    note[0], note[shape.measured] = t, -1.0
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
    passes = state.judges * state.passes != 0.0
    begins = is_low & (state.falls == 0.0) & ~passes
    asks = ((is_full | (later >= _LATER)) & (has != 0.0)) | is_worn | begins
    state.is_low, state.later, state.falls = has, later, r.choose(is_low, 1.0, 0.0)
    carries = is_full & ~asks
    with r.when(carries):
        r.copy(data["notes"], data["notes"].at(shape.note * (CAPACITY - CARRIED)), shape.note * CARRIED)
        r.copy(data["earlier"], data["least"], shape.conditions)
        with r.count(shape.conditions) as i:
            data["least"][i] = np.inf
    state.count = r.choose(carries, CARRIED, noted).number()
    is_asked = r.variable(asks, BOOLEAN)
    with r.when(is_low & ~asks & passes):
        is_asked.now = r.call("heads", given) != 0
    asks = is_asked.now
    with r.when(asks & (state.judges != 0.0)):
        found = r.call("judge", given, r.value(0, INTEGER))
        with r.when(found == 0):
            _forget(r, data, state, shape)
        r.give(found)
    r.give(asks.code())
    return r


def restart_looks(
    r: Routine, look: tuple[Value, Value], of: tuple[dict[str, Value], Record, Value], begin: tuple[Value, Value, Value]
) -> None:
    """Write what begins to look anew from a state behind a position, as `MonitorData.restart` and others do.

    `look` are the addresses of the function that looks and of its data, `of` the arrays, the state and the number of
    conditions, and `begin` time, values and rates.
    """
    data, state, conditions = of
    for name in ("count", "is_low", "falls", "later", "judges"):
        setattr(state, name, 0.0)
    with r.count(conditions) as i:
        data["least"][i] = data["earlier"][i] = np.inf
    r.call(look[0], *begin, look[1])
    r.copy(data["known"], data["pivots"], conditions)
    state.judges, state.start, state.behind, state.judged = 1.0, begin[0], begin[0], -np.inf


def _forget(r: Routine, data: dict[str, Value], state: Record, shape: Record) -> None:
    """Write what becomes of looks among which there is nothing to find; see `MonitorData.take` and `settle`."""
    count, notes = r.truncated(state.count), data["notes"]
    with r.when(count > CARRIED):
        with r.count(shape.note * CARRIED) as i:
            notes[i] = notes[(count - CARRIED) * shape.note + i]
        state.count = CARRIED
    state.is_low, state.later = state.falls, 0.0
    with r.count(shape.conditions) as i:
        data["least"][i] = data["earlier"][i] = np.inf
        data["known"][i] = data["pivots"][i]


def _measure_slopes(r: Routine, data: dict[str, Value], shape: Record) -> None:
    """Write how much each condition changes, and ``G G^T``."""
    slopes, changes, rows = (data[name] for name in ("slopes", "changes", "rows"))
    r.clear(changes, changes.at(shape.conditions))
    with r.count(shape.slopes) as e:
        row, column = (data[name].read(e, INTEGER) for name in ("row", "column"))
        slope = slopes[e] * data["sizes"][column]
        slopes[e] = slope
        changes[row] = r.most(r.size(slope), changes[row])
    with r.count(shape.conditions) as i:
        rows[i] = r.most(changes[i], rows[i])
    write_products(r, data, shape)


def _eliminate(r: Routine, data: dict[str, Value], state: Record, shape: Record) -> tuple[Value, Value, Value, Value]:
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


def _plan_next(r: Routine, arguments: Sequence[Value], sizes: Value, state: Record, shape: Record) -> None:
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
    state.stride = stride  # without end where nothing moves
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
        r.give_if(~(looks & (flag == 0)), flag)
        r.give_if(r.call("look", reached[0], y_at, yp_at, data) != 0, NOTICED)
        r.give_if(taken() >= allowed, _WORKED_ENOUGH)
    return r


def _fill(looks: bool) -> Routine:
    """Write the function that sends IDA on through times and fills a row of a table at each.

    A row is read from the last step that IDA has taken, once no look is due before its time.
    """
    r = Routine("fill", _FILL if looks else _FILL | {"data": INTEGER}, exported=True)
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
    size: Operand = data
    state = None
    if looks:
        _, state, shape = opened(data)
        size = shape.size
    taken = _count_steps(r, steps, memory)
    r.call(current, memory, end)
    with r.forever():
        i = filled.read(0, INTEGER)
        r.give_if(i >= wanted, 0)
        t = times[i]
        is_read = t <= end[0]
        with r.when(is_read if state is None else is_read & (t < state.next)):
            r.give_if(r.call(dky, memory, t, r.value(0, CODE), y) != 0, UNREADABLE)
            r.copy(table.at(i * size), y_at, size)
            filled.write(0, i + 1)
            r.give_if(taken() >= allowed, PAUSED)
        with r.otherwise():
            if state is None:
                flag = r.call(solve, memory, t, reached, y, yp, r.value(1, CODE))
            else:
                flag = r.call("drive", solve, steps, memory, t, reached, y, yp, y_at, yp_at, allowed, data)
            r.call(current, memory, end)
            r.give_if(flag != 0, flag)
    return r
