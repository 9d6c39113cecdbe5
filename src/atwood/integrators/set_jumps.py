"""Changes of a set of contacts at events, without Python; see `atwood.integrators.sets`.

What is not clear by the rules there is left to Python, and so is what opens all of them where other programs are then
shorter.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from atwood.arrays import BoolArray, FloatArray, address_of
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once, prologue_at
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Kind
from atwood.expr.core.program import Program
from atwood.integrators.jumps import ROOM, JumpLog, Jumps
from atwood.integrators.protocol import RATES, CompiledRates
from atwood.integrators.sets.record import CAPACITY, ENTRY, FIELDS, ROWS, UNITS
from atwood.integrators.sets.series import LONG

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.embedded.rates import CompiledAccelerations, OwnRates
    from atwood.integrators.protocol import Nearest

_PROGRAMS = tuple(f"{name}_{what}" for name in ("kernel", "nearer", "event") for what in ("prologue", "derived"))

_CHOSEN = ("rates", "data", "project", "project_data")
_LOOSE = ("prologue", "derived", "nearer_prologue", "nearer_derived", "scratch")

JUMP: dict[str, Kind] = {
    **dict.fromkeys(("sets", "table", "shift", "margins", "seen", "states", "near", "before", "values"), ADDRESS),
    **dict.fromkeys(("places", "log", "project", "project_data", "scratch", "event_scratch", *_PROGRAMS), ADDRESS),
    **dict.fromkeys(("rates", "rates_data", "changes", "relations", "set_prologue"), ADDRESS),
    **dict.fromkeys((f"{kind}_{what}" for kind in ("whole", "loose") for what in _CHOSEN), ADDRESS),
    **dict.fromkeys((f"loose_{what}" for what in _LOOSE), ADDRESS),
    **dict.fromkeys(("now", "then", "late", "began", "shortest", "ahead", "rough", "later", "time"), NUMBER),
    **dict.fromkeys(("events", "size", "stride", "logged", "capacity", "stays"), INTEGER),
    **dict.fromkeys(("changed", "others", "relations_at", "chooses", "loose"), INTEGER),
}
"""The memory of changes. `late` is by how much an event was seen after its zero, `then` the time of that zero,
`now` that of the event, which is later where only rounding made it late, `began` when the set did, `shortest` how long
one lasts at least, `time` that of the scene, `stays` whether all may open; `changes`: when parameters change, infinity
last, `relations` the last `others` of them before the first of these times and from each on, `changed` how many times
are over; `chooses` whether there are rates for when all are open, `loose`: as they are now."""

_PLACES = {
    piece: {name: (kind, place) for place, (name, kind) in enumerate(fields.items())}
    for piece, fields in (("own", JUMP), ("sets", FIELDS))
}

LIMITS = ("ahead", "rough", "later")
"""How long impacts may still go on that are summed."""

EVENTS = ("unit", "code", "small", "placed")
"""Of each event: whose it is, what happens, what is zero but for errors, and whether it is that of a gap on places."""

HEAD, MOST_IMPACTS = 4, 8
"""Numbers that begin an entry of the log, and how many impacts there may be in one."""


class SetJump(NamedTuple):
    """A change of a set: the states before and after, those of gaps and slips, and what has happened.

    `stopped` is the first gap that came to rest as impacts accumulate, or -1, and `left` how long these still go on;
    `struck` has a row for each impact, as the log of `atwood.integrators.sets`.
    """

    time: float
    states: FloatArray
    set: FloatArray
    stopped: int
    left: float
    struck: FloatArray


class SetLog(JumpLog):
    """What the log of changes of sets says, of some number of gaps and slips with some number of rows."""

    def __init__(self, entries: FloatArray, size: int, units: int, rows: int) -> None:
        super().__init__(entries, HEAD, size)
        self._ends = HEAD + 2 * size + 3 * units
        self._begins, self._each = self._ends - 3 * units, len(ENTRY) + rows

    def closings(self, was_open: bool) -> list[SetJump]:
        """Return the changes by which something touches, slips or sticks where all was open before."""
        units = (self._ends - self._begins) // 3
        touches: BoolArray = np.logical_or.reduce(self.entries[:, self._begins : self._begins + units], axis=1)
        begins = touches.copy()
        begins[0] &= was_open
        begins[1:] &= ~touches[:-1]
        return self.changes(begins)

    def strikes(self) -> list[tuple[float, int]]:
        """Return times and gaps of the impacts."""
        found = self.entries[:, 3].astype(int)
        return [
            (time, int(row[self._ends + i * self._each]))
            for time, row, count in zip(
                self.time[found > 0].tolist(), self.entries[found > 0], found[found > 0].tolist(), strict=True
            )
            for i in range(count)
        ]

    def changes(self, which: slice | BoolArray = slice(None)) -> list[SetJump]:
        """Return the changes, or some of them."""
        made = []
        for row, states in zip(self.entries[which], self.states[which], strict=True):
            time, stopped, left, struck = row[:HEAD].tolist()
            impacts = row[self._ends : self._ends + int(struck) * self._each].reshape(-1, self._each)
            set_ = row[self._begins : self._ends].reshape(3, -1)
            made.append(SetJump(time, states, set_, int(stopped), left, impacts))
        return made


_SETS = (*("record", "sizes", "solving", "checking", "finding", "shares", "impacts", "series", "stopping", "resolve"),)
_OWN = ("event_location", "event_routines", "set_jumps", *(f"sets/{name}" for name in _SETS))
_FILES = (*(f"integrators/{name}.py" for name in _OWN), "numerics/contact_sets.py")


@once
def _routines() -> Built:
    source = RoutineSource("integrators.set_jump_routines", _FILES)
    exports = ("jump", "resolve", "rates", "project")
    return build_code([], CodeOptions(level=2), exports=exports, routines=source)


_RESOLVE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)


class SetCode:
    """Changes of sets as machine code, for any parameter values.

    Parameters
    ----------
    program
        See `atwood.forms.constrained.contacts_program`.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        _, self.coordinates, self.speeds = (len(group.symbols) for group in program.inputs)
        self.tiers, self.routines = Tiers([Part("contacts", program)]), _routines()


class SetSolver:
    """What becomes of gaps and slips at a moment, by the routine.

    Parameters
    ----------
    code
        What they are.
    pattern
        Which limits read which forces.
    units
        What is known of each gap and slip.
    count
        Number of rows.
    more
        Lengths of further arrays in its memory.
    """

    def __init__(
        self,
        code: SetCode,
        pattern: Sequence[tuple[int, int]],
        units: FloatArray,
        count: int,
        more: Mapping[str, int] | None = None,
    ) -> None:
        own, size, number = code.coordinates + code.speeds, count, units.shape[1]
        self.set_code, self._size, self._units = code, own, units.copy()
        self._each = size + len(ENTRY)
        self._built = code.tiers.spend(0.0)
        lengths = {
            "sets": len(FIELDS),
            "values": len(code.program.parameters),
            "derived": len(code.program.prologue),
            "room": self._built.scratch,
            "y": own,
            "out": len(code.program.results),
            "units": units.size,
            "rows": len(ROWS) * size,
            "matrix": size * size,
            "left": size * (size + 1),
            "shares": 4 * number * size,
            "pattern": 2 * len(pattern),
            "past": 2 * LONG,
            "struck": CAPACITY * self._each,
            **(more or {}),
        }
        ends = np.cumsum(list(lengths.values()))
        self._memory = np.zeros(int(ends[-1]))
        self._pieces = dict(zip(lengths, np.split(self._memory, ends[:-1]), strict=True))
        self._at = {name: one.ctypes.data for name, one in self._pieces.items()}
        self._pieces["pattern"][:] = [one for some in zip(*pattern, strict=True) for one in some]
        self._pieces["units"][:] = units.ravel()
        same = ("derived", "y", "out", "units", "rows", "matrix", "left", "shares", "pattern", "past")
        self._put("sets", {name: self._at[name] for name in same})
        self._put("sets", {"scratch": self._at["room"], "log": self._at["struck"]})
        self._put("sets", {"program": self._built.code.addresses["contacts"]})
        self._put("sets", {"coordinates": code.coordinates, "speeds": code.speeds})
        self._put("sets", {"count": number, "size": size, "entries": len(pattern), "inside": 1.0})
        self._derive = prologue_at(self._built.code.addresses["contacts_prologue"])
        self._resolve = _RESOLVE(code.routines.code.addresses["resolve"])

    def _put(self, piece: str, fields: Mapping[str, float]) -> None:
        numbers = self._pieces[piece]
        integers = numbers.view(np.int64)
        for name, value in fields.items():
            kind, place = _PLACES[piece][name]
            (numbers if kind is NUMBER else integers)[place] = value

    @property
    def _own_units(self) -> FloatArray:
        """What is known of each gap and slip, by the rows of `UNITS`."""
        found: FloatArray = self._pieces["units"].reshape(self._units.shape)
        return found

    def give(
        self, parameter_values: FloatArray, states: FloatArray, near: float, past: Sequence[tuple[float, float]]
    ) -> None:
        """Take other parameters, states of gaps and slips, what is small, and impacts that have been."""
        self._pieces["values"][:] = parameter_values
        self._derive(self._at["values"], self._at["derived"], self._at["room"])
        units = self._own_units
        for name in ("small", "slow"):
            units[UNITS[name]] = near * self._units[UNITS[name]]
        units[UNITS["state"] : UNITS["state"] + 3] = states
        known = past[-LONG:]
        if known:
            self._pieces["past"][: 2 * len(known)] = np.ravel(known)
        self._put("sets", {"known": len(known)})

    def resolve(
        self, t: float, y: FloatArray, triggers: FloatArray, longest: tuple[float, float, float], is_start: bool
    ) -> tuple[SetJump, FloatArray] | None:
        """Return what becomes of gaps and slips at a moment, and which gaps were closed; None where it is not clear.

        `triggers` says of each what has happened, and `longest` how long impacts may go on that are summed.
        """
        units, pieces = self._own_units, self._pieces
        units[UNITS["trigger"]], pieces["y"][:] = triggers, y
        self._put("sets", dict(zip(LIMITS, longest, strict=True)))
        if self._resolve(pieces["sets"].ctypes.data, t, is_start, 1) or self._said("shared"):
            return None
        struck = pieces["struck"][: self._said("logged") * self._each].reshape(-1, self._each).copy()
        stopped = self._said("told") if self._said("stops") else -1
        left = float(pieces["sets"][_PLACES["sets"]["ahead"][1]])
        states = units[UNITS["next"] : UNITS["next"] + 3].copy()
        made = SetJump(t, np.array([y, pieces["y"]]), states, stopped, left, struck)
        return made, units[UNITS["closed"]] != 0.0

    def _said(self, name: str) -> int:
        return int(self._pieces["sets"].view(np.int64)[_PLACES["sets"][name][1]])


class SetJumps(SetSolver, Jumps):
    """The changes of sets of one session.

    Parameters
    ----------
    code, pattern, units, count
        As of `SetSolver`.
    events, rates, given
        The events at which they happen, the rates in between, and the addresses of functions that compute what depends
        on parameters alone, of the rates and of the projection, of where that is kept, and of their scratch.
    places
        Where states and directions of each are among the parameters; -1 where there is none.
    stays
        Whether a set in which all are open is one of them.
    loose
        Shorter programs for that set, and rates by them; None where steps do not go on with these.

    Attributes
    ----------
    compiled
        The rates that steps take: those of whichever set there is.
    """

    def __init__(
        self,
        code: SetCode,
        pattern: Sequence[tuple[int, int]],
        units: FloatArray,
        count: int,
        events: EventData,
        rates: CompiledRates,
        given: tuple[tuple[int, ...], tuple[int, ...], int],
        places: FloatArray,
        stays: bool,
        loose: tuple[CompiledAccelerations, OwnRates] | None = None,
    ) -> None:
        own, number = code.coordinates + code.speeds, units.shape[1]
        self._stride = HEAD + 2 * own + 3 * number + MOST_IMPACTS * (count + len(ENTRY))
        self._room = max(64, ROOM // self._stride)
        more = {
            "own": len(JUMP),
            "table": len(EVENTS) * events.count,
            "margins": events.count,
            "states": 2 * number,
            "near": own,
            "before": own,
            "places": 2 * number,
            "log": self._stride * self._room,
        }
        super().__init__(code, pattern, units, count, more)
        self._keeps: tuple[object, ...] = events, rates
        self._pieces["places"][:] = places.ravel()
        self._put(
            "own", {"events": events.count, "size": own, "stride": self._stride, "capacity": self._room, "stays": stays}
        )
        self._loose, self.compiled = loose, rates
        if loose is not None:
            own_rates = loose[1]
            for name, prologue, place in zip(
                ("loose", "loose_nearer"), own_rates.prologues, own_rates.places, strict=True
            ):
                self._put("own", {f"{name}_prologue": prologue, f"{name}_derived": place})
            self._put("own", {"loose_scratch": own_rates.scratch, "chooses": True})
            self.compiled = self._choosing(rates, loose[1].rates)
        self._place(events, self.compiled, given)
        self._rates = RATES(self.compiled.function), self.compiled.data
        self._put("own", {"set_prologue": self._built.code.addresses["contacts_prologue"]})
        self.function, self.data = code.routines.code.addresses["jump"], self._at["own"]

    def _place(
        self, events: EventData, rates: CompiledRates, given: tuple[tuple[int, ...], tuple[int, ...], int]
    ) -> None:
        """Say where everything is."""
        prologues, kept, scratch = given
        at = self._at
        named = ("sets", "table", "margins", "states", "near", "before", "values", "places", "log")
        self._put("own", {name: at[name] for name in named} | {"shift": events.arrays[1].ctypes.data})
        self._put("own", {"seen": events.memory.ctypes.data, "event_derived": events.arrays[0].ctypes.data})
        self._put("own", dict(zip(("event_prologue", "event_scratch"), events.prologue, strict=True)))
        self._put("own", {"rates": rates.function, "rates_data": rates.data})
        self._put("own", {"project": rates.project, "project_data": rates.project_data, "scratch": scratch})
        for name, prologue, place in zip(("kernel", "nearer"), prologues, kept, strict=True):
            self._put("own", {f"{name}_prologue": prologue, f"{name}_derived": place})

    def _choosing(self, *both: CompiledRates) -> CompiledRates:
        """Return rates that are, by the present set, those for all sets or those for when all are open."""
        for kind, one in zip(("whole", "loose"), both, strict=True):
            addresses = one.function, one.data, one.project, one.project_data
            self._put("own", {f"{kind}_{what}": place for what, place in zip(_CHOSEN, addresses, strict=True)})
        code, data, own = self.set_code.routines.code.addresses, self._at["own"], self._memory

        def faster(seconds: float) -> CompiledRates | None:
            made = [None if one.faster is None else one.faster(seconds) for one in both]
            if not any(made):
                return None
            return self._choosing(*(new or old for new, old in zip(made, both, strict=True)))

        kept = own, self.set_code, *(one.keep for one in both)
        is_quick = any(one.faster is not None for one in both)
        return CompiledRates(code["rates"], data, kept, code["project"], data, faster if is_quick else None)

    def give(
        self, parameter_values: FloatArray, states: FloatArray, near: float, past: Sequence[tuple[float, float]]
    ) -> None:
        """Take other parameters and states, as `SetSolver.give` does; rates for when all are open have them, too."""
        super().give(parameter_values, states, near, past)
        self._put("own", {"loose": not states[0].any()})
        if self._loose is not None:
            code, own = self._loose
            code.fill(own, parameter_values)

    def _got(self, name: str) -> int:
        return int(self._pieces["own"].view(np.int64)[_PLACES["own"][name][1]])

    def begin_again(self, table: FloatArray, scales: tuple[float, ...]) -> None:
        """Take the events of another run, from what was given on.

        Scales are how long a set lasts at least, how long impacts may go on that are summed, as a rule, where rounding
        tells in them, and where they are uneven, and the time of the scene.
        """
        self._pieces["table"][:] = table.ravel()
        self._put("own", {"logged": 0, **dict(zip(("shortest", *LIMITS, "time"), scales, strict=True))})
        self._told = 0

    def spend(self, seconds: float) -> None:
        """Go on with faster code, which has the same bits, where that pays after steps that took so long."""
        tiers = self.set_code.tiers
        if tiers.has_better and (built := tiers.spend(seconds)) is not self._built:
            self._keeps, self._built = (*self._keeps, self._built), built
            self._put("sets", {"program": built.code.addresses["contacts"]})

    def while_open(self, call: Callable[[], Nearest | None]) -> Nearest | None:
        """Call a function of the steps as if all contacts were open; None where these have no programs for that."""
        if self._loose is None:
            return None
        loose = self._got("loose")
        self._put("own", {"loose": True})
        try:
            return call()
        finally:
            self._put("own", {"loose": loose})

    def begin(self, t: float) -> None:
        """Learn when the present set begins."""
        self._put("own", {"began": t})

    def change_at(self, times: FloatArray, relations: FloatArray, place: int) -> bool:
        """Learn when parameters change, and what those from a place on are before and from each of the times on."""
        self._changes = np.concatenate([times, [inf]]), np.array(relations, order="C")
        changes, rows = map(address_of, self._changes)
        many = {"others": relations.shape[1], "relations_at": place}
        self._put("own", {"changes": changes, "relations": rows, "changed": 0, **many})
        return True

    def rates(self, t: float, y: FloatArray) -> FloatArray:
        """Return the rates in the present set."""
        function, data = self._rates
        found, state = np.empty(self._size), np.array(y)
        function(t, state.ctypes.data, found.ctypes.data, data)
        return found

    @property
    def last(self) -> tuple[float, FloatArray]:
        """Time and state after the last change; minus infinity where there has been none."""
        logged = self._got("logged")
        entry = self._pieces["log"].reshape(-1, self._stride)[logged - 1]
        after = HEAD + self._size
        return (float(entry[0]) if logged else -inf), entry[after : after + self._size].copy()

    def take(self) -> SetLog:
        """Return the changes since this was last asked."""
        first, self._told = self._told, self._got("logged")
        entries = self._pieces["log"].reshape(-1, self._stride)[first : self._told].copy()
        return SetLog(entries, self._size, self._units.shape[1], self._each - len(ENTRY))
