"""Many runs of one smooth scene side by side, one in each lane of the vectors of a machine, from a queue.

A lane whose run has ended takes the next one, so that all stay full until the queue is empty. Nothing passes from one
lane to another: each has a time, a step, an end and failures of its own, and what one needs more often than its
neighbours is done for all, with no effect on the others. So a run has the bits that it has alone.

A method adds three routines to the one that is written here, each for a session of so many runs:
``begin(session, int64 lanes)`` starts the runs of these lanes at `t` and `y`, ``step(session)`` takes a step of every
run, and ``read(session, int64 lanes)`` writes states at `time`, within the last step, to `trial`. Each returns the
lanes with a run that failed. Lanes are integers with a bit for each.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Record, Routine, Value, place_in
from atwood.integrators.batch import NO_LIMIT, NOTICED, Job
from atwood.integrators.stepper import Memory
from atwood.lazy_dataclasses import dataclass

_TOO_SMALL, _USED_UP, _NO_VALUE, _NO_RATES = 2, 1, 3, 4

FIELDS: dict[str, Kind] = {
    "session": ADDRESS,
    "begins": ADDRESS,  # for each run, the time of its start
    "horizons": ADDRESS,  # for each run, where they differ
    "firsts": ADDRESS,  # the first output time behind it
    "times": ADDRESS,
    "wanted": INTEGER,
    "size": INTEGER,
    "runs": INTEGER,
    "run": INTEGER,  # the run that is taken next from the queue
    "most": NUMBER,  # the steps that each run may take
    "budget": INTEGER,  # the steps that this call may take
    "starts": ADDRESS,
    "values": ADDRESS,
    "codes": ADDRESS,  # for each run, how it ended
    "counted": ADDRESS,  # for each run, steps and turns to stiffness
    "prologue": ADDRESS,  # void prologue(const double *parameters, double *derived, double *scratch)
    "parameters": ADDRESS,
    "width": INTEGER,  # the number of parameters that runs have of their own
    "rows": ADDRESS,  # parameters by lanes
    "derived": ADDRESS,
    "scratch": ADDRESS,
    "tolerances": ADDRESS,
    "held": ADDRESS,  # the run of each lane
    "shown": ADDRESS,  # how many output times it has passed
    "events": INTEGER,
    "known": ADDRESS,  # for each run, shifts and signs of events
    "looked": ADDRESS,  # where the session has them
    "room": ADDRESS,  # where all its memory begins
    "places": ADDRESS,  # where in it lie the numbers that a run is handed over with
    "kept": INTEGER,  # how many these are
    "left": ADDRESS,  # for each run, these numbers when it was noticed
    "events_prologue": ADDRESS,
    "events_derived": ADDRESS,
    "events_scratch": ADDRESS,
}
"""What a job holds, 8 bytes each."""


@dataclass(frozen=True, eq=False)
class LookPlaces:
    """How runs are watched for events that are taken side by side.

    Attributes
    ----------
    count
        The number of events.
    known
        Where the session has shifts and signs of them.
    room, places
        Where its memory begins, and where in it lie the numbers that a run is handed over with.
    kernel, prologue, derived, scratch
        The function that takes their values, that which computes what depends on parameters alone, and its arrays.
    keep
        Whatever must live as long as the addresses are used.
    """

    count: int
    known: int
    room: int
    places: NDArray[np.int64]
    kernel: int
    prologue: int
    derived: int
    scratch: int
    keep: object


@dataclass(frozen=True)
class Watched:
    """What runs know of events when they begin, one row each: what is added to the values, and their signs."""

    shifts: FloatArray
    signs: FloatArray


@dataclass(frozen=True)
class LanePlaces:
    """What a batch in lanes needs of a method.

    Attributes
    ----------
    batch
        The address of the function that makes the runs.
    session
        That of its session.
    lanes
        How many runs it takes side by side.
    prologue, derived, scratch
        The function that computes what depends on parameters alone, and its arrays.
    parameters
        How many of these there are.
    tolerance_factor
        By what absolute tolerances are multiplied where the session keeps them.
    clear
        Makes the session new.
    keep
        Whatever must live as long as the addresses are used.
    looks
        What events are watched by, if there are any.
    """

    batch: int
    session: int
    lanes: int
    prologue: int
    derived: int
    scratch: int
    parameters: FloatArray
    tolerance_factor: float
    clear: Callable[[], None]
    keep: object
    looks: LookPlaces | None = None


class LaneBatch(Job):
    """Runs that differ in their start, and maybe in their parameters, side by side; see `atwood.integrators.batch`.

    `t` may be a time for each run, and `horizons` and the `firsts` of its output times differ from run to run.
    """

    def __init__(
        self,
        places: LanePlaces,
        t: float | FloatArray,
        times: FloatArray,
        starts: FloatArray,
        tolerances: FloatArray,
        max_steps: int | None = None,
        parameters: FloatArray | None = None,
        horizons: FloatArray | None = None,
        firsts: NDArray[np.int64] | None = None,
        watched: Watched | None = None,
    ) -> None:
        super().__init__(times, starts, tolerances, places.tolerance_factor)
        places.clear()
        begins = np.ascontiguousarray(np.broadcast_to(t, len(starts)), dtype=np.float64)
        spans = None if horizons is None else np.ascontiguousarray(horizons)
        shown = np.zeros(len(starts), dtype=np.int64) if firsts is None else firsts
        self._ends = np.zeros((len(starts), 2), dtype=np.int64)
        rows = np.repeat(places.parameters, places.lanes)
        own = None if parameters is None else np.ascontiguousarray(parameters)
        held = np.zeros((2, places.lanes), dtype=np.int64)
        looks = self._looks(places, watched)
        self._kept = places, own, rows, held, begins, spans, shown, looks
        self._fill(
            places.batch,
            FIELDS,
            session=places.session,
            begins=begins.ctypes.data,
            horizons=0 if spans is None else spans.ctypes.data,
            firsts=shown.ctypes.data,
            most=float(NO_LIMIT if max_steps is None else max_steps),
            counted=self._ends.ctypes.data,
            prologue=places.prologue,
            parameters=0 if own is None else own.ctypes.data,
            width=0 if own is None else own.shape[1],
            rows=rows.ctypes.data,
            derived=places.derived,
            scratch=places.scratch,
            held=held.ctypes.data,
            shown=held[1].ctypes.data,
            **looks,
        )

    def _looks(self, places: LanePlaces, watched: Watched | None) -> dict[str, int]:
        """Return what a job is told of events, which it is asked to notice."""
        looks = places.looks
        if looks is None or watched is None:
            return {}
        self.left = np.empty((len(watched.signs), len(looks.places)))
        self._known = np.ascontiguousarray(np.concatenate([watched.shifts, watched.signs], axis=1))
        return {
            "events": looks.count,
            "known": self._known.ctypes.data,
            "looked": looks.known,
            "room": looks.room,
            "places": looks.places.ctypes.data,
            "kept": len(looks.places),
            "left": self.left.ctypes.data,
            "events_prologue": looks.prologue,
            "events_derived": looks.derived,
            "events_scratch": looks.scratch,
        }

    @property
    def steps(self) -> NDArray[np.int64]:
        """The steps of each run."""
        return self._ends[:, 0]

    @property
    def stiff(self) -> NDArray[np.int64]:
        """How often each run has turned out stiff."""
        return self._ends[:, 1]


def write_batch(runs: int, memory: Callable[[Value], Memory], tolerances: str, looks: bool = False) -> list[Routine]:
    """Write ``int batch(void *job)``: 0 when all runs are done, 1 when its budget of steps is used up.

    A method that `looks` for events has a further routine ``look(session)``, which returns the lanes in whose last step
    one may have happened. Such a run ends, and what the session knows of it is kept.
    """
    r = Routine("batch", {"job": ADDRESS}, exported=True)
    job = Record(r.arguments[0], FIELDS)
    m = memory(job.session)
    turn = r.variable(0, INTEGER)
    with r.forever() as turns:
        with r.when((m.active != 2**runs - 1) & (job.run < job.runs)):
            r.call("load", r.arguments[0], result=None)
            r.repeat(turns)
        due = (m.t >= m.stop).integer() & m.active
        with r.when(due != 0):
            r.call("show", r.arguments[0], due, result=None)
            r.repeat(turns)
        r.give_if(m.active == 0, 0)
        r.give_if(turn.now >= job.budget, 1)
        turn.now = turn.now + 1
        late = (m.taken >= job.most).integer() & m.active
        with r.when(late != 0):
            r.call("end", r.arguments[0], late, r.value(_USED_UP, INTEGER), result=None)
            r.repeat(turns)
        failed = r.call("step", m.session, result=INTEGER)
        with r.when(failed != 0):
            r.call("end", r.arguments[0], failed, r.value(_TOO_SMALL, INTEGER), result=None)
        if looks:
            with r.when(job.events > 0):
                noticed = r.call("look", m.session, result=INTEGER)
                with r.when(noticed != 0):
                    r.call("keep", r.arguments[0], noticed, result=None)
                    r.call("end", r.arguments[0], noticed, r.value(NOTICED, INTEGER), result=None)
    own = [_load(runs, memory, tolerances), _show(runs, memory), _end(runs, memory)]
    return [r, *own, _keep(runs, memory)] if looks else [r, *own]


def _open(
    memory: Callable[[Value], Memory], name: str, more: dict[str, Kind]
) -> tuple[Routine, Record, Memory, list[Value]]:
    r = Routine(name, {"job": ADDRESS, **more}, None)
    job = Record(r.arguments[0], FIELDS)
    return r, job, memory(job.session), r.arguments[1:]


def _load(runs: int, memory: Callable[[Value], Memory], tolerances: str) -> Routine:
    """Give the next runs to the lanes that have none, and start them."""
    r, job, m, _ = _open(memory, "load", {})
    before, fresh = m.active, r.variable(0, INTEGER)
    with r.count(runs) as lane:
        bit = r.value(1, INTEGER) << lane
        k = job.run
        with r.when(((before & bit) == 0) & (k < job.runs)):
            job.run = k + 1
            job.held.write(lane, k, INTEGER)
            fresh.now = fresh.now | bit
            for row, source in ((m.row("y"), job.starts), (m.row(tolerances), job.tolerances)):
                with r.count(job.size) as i:
                    row[i * runs + lane] = source[k * job.size + i]
            with r.count(job.width) as i:
                job.rows[i * runs + lane] = job.parameters[k * job.width + i]
            first = job.firsts.read(k, INTEGER)
            job.shown.write(lane, first, INTEGER)
            for name, value in (("t", job.begins[k]), ("stop", job.times[first]), ("taken", 0.0), ("edges", 0.0)):
                place_in(m, name)[lane] = value
            with r.when(~r.is_null(job.horizons)):
                place_in(m, "horizon")[lane] = job.horizons[k]
            with r.count(job.events * 2) as i:
                job.looked[i * runs + lane] = job.known[k * (job.events * 2) + i]
    m.active = before | fresh.now
    r.call(job.prologue, job.rows, job.derived, job.scratch, result=None)
    with r.when(job.events > 0):
        r.call(job.events_prologue, job.rows, job.events_derived, job.events_scratch, result=None)
    failed = r.call("begin", m.session, fresh.now, result=INTEGER)
    with r.when(failed != 0):
        r.call("end", r.arguments[0], failed, r.value(_NO_RATES, INTEGER), result=None)
    r.give()
    return r


def _show(runs: int, memory: Callable[[Value], Memory]) -> Routine:
    """Write the state of each of these lanes at its next output time; end the runs that come to their last."""
    r, job, m, (due,) = _open(memory, "show", {"due": INTEGER})
    m.time = m.stop
    failed = r.call("read", m.session, due, result=INTEGER)
    trial, wanted, size = m.row("trial"), job.wanted, job.size
    finished, good = r.variable(0, INTEGER), due - failed
    with r.count(runs) as lane:
        bit = r.value(1, INTEGER) << lane
        with r.when((good & bit) != 0):
            k, i = job.held.read(lane, INTEGER), job.shown.read(lane, INTEGER)
            target = job.values.at((k * wanted + i) * size)
            with r.count(size) as j:
                target[j] = trial[j * runs + lane]
            job.shown.write(lane, i + 1, INTEGER)
            with r.when(i + 1 >= wanted):
                finished.now = finished.now | bit
            with r.otherwise():
                place_in(m, "stop")[lane] = job.times[i + 1]
    for lanes, code in ((failed, _NO_VALUE), (finished.now, 0)):
        with r.when(lanes != 0):
            r.call("end", r.arguments[0], lanes, r.value(code, INTEGER), result=None)
    r.give()
    return r


def _end(runs: int, memory: Callable[[Value], Memory]) -> Routine:
    """Note how the runs of these lanes have ended, and free the lanes."""
    r, job, m, (lanes, code) = _open(memory, "end", {"lanes": INTEGER, "code": INTEGER})
    with r.count(runs) as lane, r.when((lanes & (r.value(1, INTEGER) << lane)) != 0):
        k = job.held.read(lane, INTEGER)
        job.codes.write(k, code, INTEGER)
        for number, name in enumerate(("taken", "edges")):
            job.counted.write(k * 2 + number, r.truncated(place_in(m, name)[lane]), INTEGER)
    m.active = m.active - lanes
    r.give()
    return r


def _keep(runs: int, memory: Callable[[Value], Memory]) -> Routine:
    """Keep what the session knows of the runs of these lanes."""
    r, job, _, (lanes,) = _open(memory, "keep", {"lanes": INTEGER})
    with r.count(runs) as lane, r.when((lanes & (r.value(1, INTEGER) << lane)) != 0):
        left = job.left.at(job.held.read(lane, INTEGER) * job.kept)
        with r.count(job.kept) as i:
            left[i] = job.room[job.places.read(i, INTEGER) + lane]
    r.give()
    return r


def failures(code: Value, lanes: Value) -> Value:
    """Return in which of these lanes a compiled function has said that a result is not finite."""
    assert code.kind is CODE
    return code.integer() & lanes
