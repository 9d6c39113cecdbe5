"""Many runs of one method in one call: what is between the runs costs no Python.

The function knows nothing of the method: it is given the addresses of two functions that start a run and sample it.
"""

from __future__ import annotations

from atwood.codegen.routines.kinds import ADDRESS, CODE, INTEGER, NUMBER
from atwood.codegen.routines.language import Record, Routine, Value, Variable

FIELDS = (
    "begin",  # int begin(session, double t, const double *start); 0 unless there are no finite rates
    "sample",  # int sample(session, const double *times, long wanted, double *values, double *rates)
    "session",
    "limit",  # where the session reads up to which count of steps it may go on
    "steps",  # where it counts its steps; further counts follow
    "filled",  # where it says how many samples it has filled
    "counts",  # how many counts there are
    "t",  # bits of the time of the start
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
"""What a job holds, 8 bytes each: addresses and integers."""

_ADDRESSES = {
    "begin", "sample", "session", "limit", "steps", "filled", "times", "starts", "values", "rates", "codes",
    "counted", "prologue", "parameters", "derived", "scratch", "tolerances", "tolerance",
}  # fmt: skip


def write_routines() -> list[Routine]:
    """Write ``int batch(void *job)``: 0 when all runs are done, 1 when its budget of steps is used up.

    How a run ended is what `sample` returned (0 at the end, 1 at the limit of steps, 2 where steps got too small, 3
    where there is no value between two steps), or 4 where it could not begin.
    """
    r = Routine("batch", {"job": ADDRESS}, exported=True)
    kinds = {name: ADDRESS if name in _ADDRESSES else NUMBER if name == "t" else INTEGER for name in FIELDS}
    job = Record(r.arguments[0], kinds)
    steps = job.steps
    call_limit = steps.read(0, INTEGER) + job.budget
    with r.forever():
        k = job.run
        with r.when(k >= job.runs):
            r.give(0)
        taken = steps.read(0, INTEGER)
        with r.when(taken >= call_limit):
            r.give(1)
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
    with r.when((code == 1) & (job.steps.read(0, INTEGER) < run_limit)):
        r.give(1)
    return code
