"""Many runs of one smooth scene, one after the other in machine code; several batches can run in threads at once.

Many runs of one method in one call: what is between the runs costs no Python.

The function knows nothing of the method: it is given the addresses of two functions that start a run and sample it.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Mapping
from ctypes import c_int, c_void_p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Record, Routine, Value, Variable
from atwood.integrators.protocol import paced
from atwood.lazy_dataclasses import dataclass

NOTICED = 5
ENDS = {0: "reached", 1: "step limit", 2: "too small", 3: "no value between", 4: "no rates", NOTICED: "noticed"}
"""How a run can end; `NOTICED` after a step in which an event may have happened, with its state to go on from alone."""

_FIRST_BUDGET, _MOMENT = 2_000, 0.03
"""Steps of the first call, and for about how long a call should last, in seconds, so that Ctrl-C is heard."""

NO_LIMIT = 2**62


_NAMES = (
    "begin",  # int begin(session, double t, const double *start); 0 unless there are no finite rates
    "sample",  # int sample(session, const double *times, long wanted, double *values, double *rates)
    "session",
    "limit",  # where the session reads up to which count of steps it may go on
    "steps",  # where it counts its steps; further counts follow
    "filled",  # where it says how many samples it has filled
    "counts",  # how many counts there are
    "t",  # the time of the start
    "times",
    "wanted",
    "size",
    "runs",
    "run",  # the run that is next, or under way
    "done",  # its samples so far; -1 where it has not begun
    "base",  # the count of steps at which it began
    "most",  # the steps that it may take
    "budget",  # the steps that this call may take
    "starts",
    "values",
    "rates",  # room for the rates of one run
    "codes",  # for each run, how it ended
    "counted",  # for each run, all counts at its end
    "prologue",  # void prologue(const double *parameters, double *derived, double *scratch); null where they stay
    "parameters",
    "width",  # the number of parameters
    "derived",
    "scratch",
    "tolerances",
    "tolerance",  # where the session reads its absolute tolerances
)
_ADDRESSES = {
    "begin", "sample", "session", "limit", "steps", "filled", "times", "starts", "values", "rates", "codes",
    "counted", "prologue", "parameters", "derived", "scratch", "tolerances", "tolerance",
}  # fmt: skip


FIELDS: dict[str, Kind] = {
    name: ADDRESS if name in _ADDRESSES else NUMBER if name == "t" else INTEGER for name in _NAMES
}
"""What a job holds, 8 bytes each."""


@dataclass(frozen=True)
class BatchPlaces:
    """The addresses that a batch needs of a method's session; see `atwood.integrators.batch.FIELDS`.

    Attributes
    ----------
    begin, sample
        Functions.
    session
        Their first argument.
    limit, steps, filled, tolerance
        Where the session keeps these.
    counts
        How many counts follow each other from `steps` on.
    parameters
        The function that computes what depends on parameters alone, and its two arrays (derived values and scratch);
        zeros where parameters cannot change from run to run.
    tolerance_factor
        By what absolute tolerances are multiplied where the session keeps them.
    keep
        Whatever must live as long as the addresses are used.
    """

    begin: int
    sample: int
    session: int
    limit: int
    steps: int
    filled: int
    tolerance: int
    counts: int
    parameters: tuple[int, int, int] = (0, 0, 0)
    tolerance_factor: float = 1.0
    keep: object = None


class Job:
    """Runs that one compiled function makes, a moment at a time.

    Parameters
    ----------
    times
        Output times, rising, none before the start.
    starts, tolerances
        Start values and absolute tolerances, shape (runs, size).
    factor
        By what absolute tolerances are multiplied where the session keeps them.

    Attributes
    ----------
    values
        Shape (runs, times, size); nan where a run did not come.
    codes
        How each run ended, a key of `ENDS`; -1 for what has not been run.
    seconds
        Time spent in the method.
    """

    def __init__(self, times: FloatArray, starts: FloatArray, tolerances: FloatArray, factor: float) -> None:
        runs, size = starts.shape
        self._starts, self._times = np.ascontiguousarray(starts), np.ascontiguousarray(times)
        self._tolerances = np.ascontiguousarray(factor * np.maximum(tolerances, np.finfo(float).tiny))
        self.values = np.full((runs, len(times), size), np.nan)
        self.codes = np.full(runs, -1, dtype=np.int64)
        self.seconds = 0.0
        self._allowed = _FIRST_BUDGET

    def _fill(self, function: int, fields: Mapping[str, Kind], **given: float) -> None:
        """Take a function, which lets other threads run, and write what it is told."""
        given |= {
            "times": self._times.ctypes.data,
            "wanted": len(self._times),
            "runs": len(self._starts),
            "size": self._starts.shape[1],
            "starts": self._starts.ctypes.data,
            "values": self.values.ctypes.data,
            "codes": self.codes.ctypes.data,
            "tolerances": self._tolerances.ctypes.data,
        }
        self._job = np.zeros(len(fields), dtype=np.int64)
        for place, (name, kind) in enumerate(fields.items()):
            table: NDArray[Any] = self._job.view(np.float64) if kind is NUMBER else self._job
            table[place] = given.get(name, 0)
        self._budget = list(fields).index("budget")
        self._call = ctypes.CFUNCTYPE(c_int, c_void_p)(function)

    def advance(self) -> bool:
        """Go on for a moment; return whether all runs are done."""
        began = time.perf_counter()
        self._job[self._budget] = self._allowed
        is_done: bool = self._call(self._job.ctypes.data) == 0
        taken = time.perf_counter() - began
        self.seconds += taken
        self._allowed = paced(self._allowed, taken, not is_done, _MOMENT, NO_LIMIT)
        if is_done:  # what a run that ended early did not reach may have been half written
            self.values[(self.codes != 0) & (self.codes != NOTICED)] = np.nan
        return is_done


class Batch(Job):
    """Runs that differ in their start, and maybe in their parameters, one after another.

    Parameters
    ----------
    places
        The session that takes the steps.
    t
        Time of the start, s.
    times, starts, tolerances
        See `Job`.
    max_steps
        The steps that each run may take; None for no limit.
    parameters
        Where they change from run to run, shape (runs, parameters).
    """

    def __init__(
        self,
        places: BatchPlaces,
        t: float,
        times: FloatArray,
        starts: FloatArray,
        tolerances: FloatArray,
        max_steps: int | None = None,
        parameters: FloatArray | None = None,
    ) -> None:
        super().__init__(times, starts, tolerances, places.tolerance_factor)
        self._counted = np.zeros((len(starts), places.counts), dtype=np.int64)
        self._first_counts = np.ctypeslib.as_array(
            ctypes.cast(places.steps, ctypes.POINTER(ctypes.c_int64)), (places.counts,)
        ).copy()
        self._rates = np.empty((len(times), starts.shape[1]))
        given: dict[str, float] = {
            **{name: getattr(places, name) for name in ("begin", "sample", "session", "limit", "steps", "filled")},
            "tolerance": places.tolerance,
            "counts": places.counts,
            "t": t,
            "done": -1,
            "most": NO_LIMIT if max_steps is None else max_steps,
            "rates": self._rates.ctypes.data,
            "counted": self._counted.ctypes.data,
        }
        rows = None if parameters is None else np.ascontiguousarray(parameters)
        if rows is not None:
            given |= dict(zip(("prologue", "derived", "scratch"), places.parameters, strict=True))
            given |= {"parameters": rows.ctypes.data, "width": rows.shape[1]}
        self._kept = places, rows
        self._fill(_code().code.addresses["batch"], FIELDS, **given)

    @property
    def done(self) -> int:
        """How many runs are done."""
        return int(self._job[_RUN])

    @property
    def counts(self) -> NDArray[np.int64]:
        """What each run has counted, shape (runs, counts)."""
        counted = self._counted[: self.done]
        found = np.zeros_like(self._counted)
        found[: self.done] = np.diff(counted, axis=0, prepend=self._first_counts[None, :])
        return found

    @property
    def steps(self) -> NDArray[np.int64]:
        """The steps of each run."""
        return self.counts[:, 0]

    @property
    def stiff(self) -> NDArray[np.int64]:
        """How often each run has turned out stiff."""
        return self.counts[:, -1]


_RUN = list(FIELDS).index("run")


_ROUTINES = RoutineSource("integrators.batch")


@once
def _code() -> Built:
    return build_code([], CodeOptions(), exports=["batch"], routines=_ROUTINES)


def write_routines() -> list[Routine]:
    """Write ``int batch(void *job)``: 0 when all runs are done, 1 when its budget of steps is used up.

    How a run ended is what `sample` returned (0 at the end, 1 at the limit of steps, 2 where steps got too small, 3
    where there is no value between two steps), or 4 where it could not begin.
    """
    r = Routine("batch", {"job": ADDRESS}, exported=True)
    job = Record(r.arguments[0], FIELDS)
    steps = job.steps
    call_limit = steps.read(0, INTEGER) + job.budget
    with r.forever():
        k = job.run
        r.give_if(k >= job.runs, 0)
        taken = steps.read(0, INTEGER)
        r.give_if(taken >= call_limit, 1)
        ended = r.variable(0, CODE)
        with r.when(job.done < 0):
            _begin(r, job, k, taken, ended)
        with r.when(ended.now == 0):
            ended.now = _go_on(r, job, k, call_limit)
        job.codes.write(k, ended.now.integer(), INTEGER)
        r.copy(job.counted.at(k * job.counts), steps, job.counts)
        job.run, job.done = k + 1, -1
    return [r]


def _begin(r: Routine, job: Record, k: Value, taken: Value, ended: Variable) -> None:
    """Begin a run from its own start values, with its own tolerances and parameters."""
    prologue, start = job.prologue, k * job.size
    with r.when(~r.is_null(prologue)):
        r.call(prologue, job.parameters.at(k * job.width), job.derived, job.scratch, result=None)
    r.copy(job.tolerance, job.tolerances.at(start), job.size)
    job.base, job.done = taken, 0
    ended.now = r.call(job.begin, job.session, job.t, job.starts.at(start))


def _go_on(r: Routine, job: Record, k: Value, call_limit: Value) -> Value:
    """Go on with a run, as far as its steps and those of the call allow; return how it ended."""
    first, run_limit = job.done, job.base + job.most
    job.limit.write(0, r.least(run_limit, call_limit), INTEGER)
    values = job.values.at(k * (job.wanted * job.size) + first * job.size)
    code = r.call(job.sample, job.session, job.times.at(first), job.wanted - first, values, job.rates)
    job.done = first + job.filled.read(0, INTEGER)
    r.give_if((code == 1) & (job.steps.read(0, INTEGER) < run_limit), 1)
    return code
