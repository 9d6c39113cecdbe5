"""Moments of a run at which parameters change and states may jump: no Python runs between the stretches.

At each the state may be taken onto constraints, a function changes it and the parameters, and the steps begin anew. The
routine knows of the method only two functions, one that starts a stretch and one that samples it. What does not go so
is left: the run then stands at the end of the last stretch that came out well.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from ctypes import c_int, c_void_p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, address_of
from atwood.codegen.llvm.build import RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Kind, Record, Routine
from atwood.integrators.batch import BatchPlaces
from atwood.lazy_dataclasses import dataclass

ADDRESSES = (
    *("begin", "sample", "session", "limit", "steps", "filled", "horizon", "times", "values", "rates", "moments"),
    *("first", "which", "relations", "held", "parameters", "project", "project_data", "update", "update_data"),
    *("saved", "prologue", "derived", "second_prologue", "second_derived", "scratch"),
)

INTEGERS = ("size", "counts", "count", "now", "row", "changes", "budget", "pause", "held_at", "held_count", "others")

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(ADDRESSES, ADDRESS),
    "end": NUMBER,
    **dict.fromkeys(INTEGERS, INTEGER),
}
"""What a job holds. `times`, `values`: samples, of which `first` says where each stretch begins; `moments`: when that
is; `which`: what the function is told of each, 0 for nothing to do, -1 for Python; `changes`: whether the run stands at
a moment whose changes are still to be made; `pause`: at how many it returns; `held`: discrete states from each on."""

DONE, USED_UP, ASKS, PAUSES, REFUSED = 0, 1, 10, 11, 12
"""What the routine returns besides the codes of steps."""

_PLACES = {name: k for k, name in enumerate(FIELDS)}
_BUDGET = 20_000
"""Steps of one call: a few hundredths of a second, so that limits are looked at and Ctrl-C is heard."""


@dataclass(frozen=True, eq=False)
class Changes:
    """What happens at the moments of a run.

    Attributes
    ----------
    times
        The moments, the start among them, s.
    first, samples
        Where the samples of each stretch begin, and all of their times; each has those at both its ends.
    which
        What `update` is told at each; see `FIELDS`.
    relations
        Values of the last parameters from each moment on, shape (moments, number).
    parameters
        Those of the first stretch, which are changed.
    held
        Where discrete states are among them, and how many there are.
    update
        Addresses of a function that changes states, and of its data; zeros where there is none.
    prologues
        Functions that compute what depends on parameters alone, and where that is kept.
    scratch
        Their scratch.
    project
        Addresses of a function that takes a state onto constraints, and of its data.
    end
        The end of the run, s.
    keep
        Whatever must live as long as the addresses are used.
    """

    times: FloatArray
    first: NDArray[np.int64]
    samples: FloatArray
    which: NDArray[np.int64]
    relations: FloatArray
    parameters: FloatArray
    held: tuple[int, int]
    update: tuple[int, int]
    prologues: tuple[tuple[int, int], ...]
    scratch: int
    project: tuple[int, int]
    end: float
    keep: object = None


class Moments:
    """A run through its moments, a while at a time.

    Parameters
    ----------
    places
        The session that takes the steps, which has begun at the first of the moments.
    horizon
        Where it keeps the typical length of a run.
    changes
        What happens.
    start
        Its first state.
    ran
        Told for how long, in seconds, steps have been taken.

    Attributes
    ----------
    values
        States at the samples, shape (samples, unknowns).
    held
        Discrete states from each moment on.
    """

    def __init__(
        self, places: BatchPlaces, horizon: int, changes: Changes, start: FloatArray, ran: Callable[[float], None]
    ) -> None:
        self._ran = ran
        rows, count, size = len(changes.samples), len(changes.times), len(start)
        self.changes, self._places = changes, places
        self.values, self.held = np.empty((rows, size)), np.empty((count, changes.held[1]))
        own, held = changes.held
        self.values[0], self.held[0] = start, changes.parameters[own : own + held]
        rates = np.empty((int(np.diff(changes.first).max()), size))
        self._saved = np.zeros(places.counts, dtype=np.int64)
        self._counts = np.ctypeslib.as_array((ctypes.c_int64 * places.counts).from_address(places.steps))
        arrays = {
            "times": changes.samples,
            "values": self.values,
            "rates": rates,
            "moments": changes.times,
            "first": changes.first,
            "which": changes.which,
            "relations": changes.relations,
            "held": self.held,
            "parameters": changes.parameters,
            "saved": self._saved,
        }
        given: dict[str, float] = {name: address_of(one) for name, one in arrays.items()}
        named = ("begin", "sample", "session", "limit", "steps", "filled", "counts")
        given |= {name: getattr(places, name) for name in named} | {"horizon": horizon, "end": changes.end}
        given |= dict(zip(("update", "update_data"), changes.update, strict=True))
        given |= dict(zip(("project", "project_data"), changes.project, strict=True))
        for name, (prologue, derived) in zip(("", "second_"), changes.prologues, strict=False):
            given |= {f"{name}prologue": prologue, f"{name}derived": derived}
        others = changes.relations.shape[1]
        given |= {"size": size, "count": count, "row": 1, "scratch": changes.scratch, "others": others}
        given |= dict(zip(("held_at", "held_count"), changes.held, strict=True))
        self._job = np.zeros(len(FIELDS), dtype=np.int64)
        numbers = self._job.view(np.float64)
        for name, value in given.items():
            (numbers if FIELDS[name] is NUMBER else self._job)[_PLACES[name]] = value
        self._keep = arrays, places
        self._function = _function()

    def advance(self, ask: Callable[[int, FloatArray, FloatArray], bool], most: int) -> int:
        """Go on for a while; where the routine asks, a function changes state and parameters at a moment by its number.

        It returns whether it could. No more than so many moments are passed.
        Return a code: `DONE`, `USED_UP` and `PAUSES` where it is to go on, and others where the rest is to be left.
        """
        job = self._job
        job[_PLACES["pause"]] = self.now + most
        while True:
            job[_PLACES["budget"]] = _BUDGET
            began = time.perf_counter()
            code = self._function(job.ctypes.data)
            self._ran(time.perf_counter() - began)
            if code == ASKS:
                at = self.now
                if not ask(at, self.values[self.changes.first[at]], self.changes.parameters):
                    return REFUSED
                self.changes.which[at] = 0
                continue
            if code in (USED_UP, PAUSES):
                return code
            if code != DONE:  # the stretch before ended well
                self._counts[:] = self._saved
            return int(code)

    @property
    def now(self) -> int:
        """The number of the stretch that it is in, or comes to."""
        return int(self._job[_PLACES["now"]])

    @property
    def filled(self) -> int:
        """How many samples there are."""
        return int(self._job[_PLACES["row"]])


@once
def _function() -> Callable[[int], int]:
    built = build_code(
        [], CodeOptions(level=2), exports=["pass_moments"], routines=RoutineSource("integrators.moments")
    )
    function: Any = ctypes.CFUNCTYPE(c_int, c_void_p)(built.code.addresses["pass_moments"])
    function.keep = built
    return function  # type: ignore[no-any-return]


def write_routines() -> list[Routine]:
    """Write ``int pass_moments(void *job)``."""
    r = Routine("pass_moments", {"job": ADDRESS}, exported=True)
    job = Record(r.arguments[0], FIELDS)
    most = job.steps.read(0, INTEGER) + job.budget
    with r.forever():
        with r.when(job.changes == 0):
            _sample(r, job, most)
        _change(r, job)
        r.give_if((job.steps.read(0, INTEGER) >= most) | (job.now >= job.pause), PAUSES)
    return [r]


def _sample(r: Routine, job: Record, most: object) -> None:
    """Go to the end of a stretch, and stand behind it."""
    k, row, size = job.now, job.row, job.size
    end = job.first.read(k + 1, INTEGER)
    job.limit.write(0, most, INTEGER)  # type: ignore[arg-type]
    code = r.call(job.sample, job.session, job.times.at(row), end - row, job.values.at(row * size), job.rates)
    job.row = row + job.filled.read(0, INTEGER)
    r.give_if(code != 0, code)
    r.give_if(k + 1 == job.count, DONE)
    r.copy(job.saved, job.steps, job.counts)
    job.now, job.changes = k + 1, 1
    state = job.values.at(end * size)
    r.copy(state, job.values.at((end - 1) * size), size)
    with (
        r.when(~r.is_null(job.project)),
        r.when(r.call(job.project, job.moments[k + 1], state, job.project_data) != 0),
    ):
        r.give(REFUSED)
    r.give_if(job.which.read(k + 1, INTEGER) < 0, ASKS)


def _change(r: Routine, job: Record) -> None:
    """Begin the next stretch with what has changed."""
    k, parameters = job.now, job.parameters
    t, row, held, which = job.moments[k], job.first.read(k, INTEGER), parameters.at(job.held_at), job.which
    state = job.values.at(row * job.size)
    r.copy(held.at(job.held_count), job.relations.at(k * job.others), job.others)
    chain = which.read(k, INTEGER)
    with (
        r.when(chain > 0),
        r.when(r.call(job.update, t, state, parameters, job.others, chain, job.update_data) != 0),
    ):
        r.give(REFUSED)
    r.copy(job.held.at(k * job.held_count), held, job.held_count)
    for name in ("", "second_"):
        prologue, derived = getattr(job, f"{name}prologue"), getattr(job, f"{name}derived")
        with r.when(~r.is_null(prologue)):
            r.call(prologue, parameters, derived, job.scratch, result=None)
    job.horizon.write(0, job.end - t)
    r.give_if(r.call(job.begin, job.session, t, state) != 0, REFUSED)
    job.changes, job.row = 0, row + 1
