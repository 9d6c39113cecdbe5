"""Many runs of one method in one call, in LLVM's language: what is between the runs costs no Python.

The function knows nothing of the method: it is given the addresses of two functions that start a run and sample it.
"""

from __future__ import annotations

__all__ = ["FIELDS", "batch_code"]

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
_CHANGING = {"run", "done", "base"}


def _prologue() -> str:
    lines = []
    for k, name in enumerate(FIELDS):
        lines.append(f"  %{name}.at = getelementptr i64, ptr %job, i64 {k}")
        if name not in _CHANGING:
            kind = "ptr" if name in _ADDRESSES else "double" if name == "t" else "i64"
            lines.append(f"  %{name} = load {kind}, ptr %{name}.at")
    return "\n".join(lines)


_START = """\
start:
  %y.index = mul i64 %k, %size
  %y.at = getelementptr double, ptr %starts, i64 %y.index
  %tol.at = getelementptr double, ptr %tolerances, i64 %y.index
  call void @llvm.memcpy.p0.p0.i64(ptr %tolerance, ptr %tol.at, i64 %bytes, i1 false)
  store i64 %taken, ptr %base.at
  store i64 0, ptr %done.at
  %begun = call i32 %begin(ptr %session, double %t, ptr %y.at)
  %is.begun = icmp eq i32 %begun, 0
  br i1 %is.begun, label %go, label %finish
"""
"""Begins a run from its own start values, with its own tolerances."""

_GO = """\
go:
  %first = load i64, ptr %done.at
  %base.now = load i64, ptr %base.at
  %run.limit = add i64 %base.now, %most
  %is.less = icmp slt i64 %run.limit, %call.limit
  %up.to = select i1 %is.less, i64 %run.limit, i64 %call.limit
  store i64 %up.to, ptr %limit
  %times.left = getelementptr double, ptr %times, i64 %first
  %left = sub i64 %wanted, %first
  %run.index = mul i64 %k, %row
  %first.index = mul i64 %first, %size
  %values.index = add i64 %run.index, %first.index
  %values.left = getelementptr double, ptr %values, i64 %values.index
  %code = call i32 %sample(ptr %session, ptr %times.left, i64 %left, ptr %values.left, ptr %rates)
  %filled.now = load i64, ptr %filled
  %reached = add i64 %first, %filled.now
  store i64 %reached, ptr %done.at
  %is.stopped = icmp eq i32 %code, 1
  br i1 %is.stopped, label %why, label %finish
why:
  %steps.now = load i64, ptr %steps
  %has.all = icmp sge i64 %steps.now, %run.limit
  br i1 %has.all, label %finish, label %pause
"""
"""Goes on with a run, as far as the steps of the run and of the call allow."""

_FINISH = """\
finish:
  %ended = phi i32 [ %begun, %start ], [ %code, %go ], [ 1, %why ]
  %ended.long = sext i32 %ended to i64
  %code.at = getelementptr i64, ptr %codes, i64 %k
  store i64 %ended.long, ptr %code.at
  %c.index = mul i64 %k, %counts
  %c.at = getelementptr i64, ptr %counted, i64 %c.index
  call void @llvm.memcpy.p0.p0.i64(ptr %c.at, ptr %steps, i64 %count.bytes, i1 false)
  %following = add i64 %k, 1
  store i64 %following, ptr %run.at
  store i64 -1, ptr %done.at
  br label %next
"""
"""Notes how a run ended and what it cost."""


def batch_code() -> str:
    """Return the function ``int batch(void *job)``: 0 when all runs are done, 1 when its budget of steps is used up.

    How a run ended is what `sample` returned (0 at the end, 1 at the limit of steps, 2 where steps got too small, 3
    where there is no value between two steps), or 4 where it could not begin.
    """
    return f"""define i32 @batch(ptr %job) #0 {{
entry:
{_prologue()}
  %bytes = mul i64 %size, 8
  %row = mul i64 %wanted, %size
  %count.bytes = mul i64 %counts, 8
  %taken.first = load i64, ptr %steps
  %call.limit = add i64 %taken.first, %budget
  %has.prologue = icmp ne ptr %prologue, null
  br label %next
next:
  %k = load i64, ptr %run.at
  %more = icmp slt i64 %k, %runs
  br i1 %more, label %room, label %all
room:
  %taken = load i64, ptr %steps
  %is.used = icmp sge i64 %taken, %call.limit
  br i1 %is.used, label %pause, label %look
look:
  %so.far = load i64, ptr %done.at
  %is.new = icmp slt i64 %so.far, 0
  br i1 %is.new, label %prepare, label %go
prepare:
  br i1 %has.prologue, label %bind, label %start
bind:
  %p.index = mul i64 %k, %width
  %p.at = getelementptr double, ptr %parameters, i64 %p.index
  call void %prologue(ptr %p.at, ptr %derived, ptr %scratch)
  br label %start
{_START}{_GO}{_FINISH}all:
  ret i32 0
pause:
  ret i32 1
}}
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)"""
