"""The steps of the explicit method of order 8(5,3) in LLVM's language.

The code is that of `atwood.integrators.dop853.reference`, for any number of unknowns and any right-hand side: all that
it knows of a problem comes in through pointers, so that it is compiled once and kept.
"""

from __future__ import annotations

from atwood.integrators.dop853.ends_code import begin_code, guard_code, project_code, watch_code
from atwood.integrators.dop853.layout import COUNTS, NUMBERS, POINTERS, prologue
from atwood.integrators.dop853.reference import APART, GROWTH, RETREAT, SAFETY, SHRINKAGE
from atwood.integrators.dop853.stepping_code import ROWS, loop_code
from atwood.integrators.dop853.tableau import NODES
from atwood.integrators.explicit_problem import CALM, EDGE, STIFF
from atwood.integrators.machine_text import exact, sample_code

__all__ = ["COUNTS", "FUNCTIONS", "NUMBERS", "POINTERS", "step_code"]

FUNCTIONS = ("run", "interpolate", "sample", "begin")


def _evaluations(stages: tuple[int, ...], failed: str) -> str:
    """Return the instructions that take the slopes of stages one after the other."""
    lines = []
    for stage in stages:
        lines.append(f"""  call void @stage{stage}(ptr %arrays, i64 %m, double %h)
  %c{stage} = fmul double %h, {exact(NODES[stage])}
  %t{stage} = fadd double %t, %c{stage}
  %e{stage} = call i32 @evaluate(ptr %session, double %t{stage}, i64 {ROWS["trial"]}, i64 {stage})
  %ok{stage} = icmp eq i32 %e{stage}, 0
  br i1 %ok{stage}, label %after{stage}, label %{failed}
after{stage}:""")
    return "\n".join(lines)


def _evaluate() -> str:
    """Return the function that takes a slope: from a row, to a row, and counts it."""
    return f"""define internal i32 @evaluate(ptr %session, double %t, i64 %from, i64 %to) #0 {{
{prologue()}
  %i = mul i64 %from, %m
  %o = mul i64 %to, %m
  %y = getelementptr double, ptr %arrays, i64 %i
  %yp = getelementptr double, ptr %arrays, i64 %o
  %code = call i32 %function(double %t, ptr %y, ptr %yp, ptr %data)
  %count = load i64, ptr %evaluations.at
  %raised = add i64 %count, 1
  store i64 %raised, ptr %evaluations.at
  %bad = icmp ne i32 %code, 0
  %one = zext i1 %bad to i64
  %lost = load i64, ptr %undefined.at
  %more = add i64 %lost, %one
  store i64 %more, ptr %undefined.at
  ret i32 %code
}}"""


def _run() -> str:
    """Return the function that takes steps.

    It ends with 0 at the stop time, 1 at the limit of steps, 2 if steps get too small, and with 5 after a step in which
    an event may have happened, after which the problem seems stiff and that is heeded, or in which something was seen
    by what watches the motion.
    """
    return f"""define i32 @run(ptr %session) #0 {{
entry:
{prologue()}
  %stop = load double, ptr %stop.at
  %relative = load double, ptr %relative.at
  %longest = load double, ptr %longest.at
  %limit = load i64, ptr %limit.at
  %count = sitofp i64 %n to double
  br label %step
step:
  %t = load double, ptr %t.at
  %reached = fcmp oge double %t, %stop
  br i1 %reached, label %return0, label %going
going:
  %steps = load i64, ptr %steps.at
  %used = icmp sge i64 %steps, %limit
  br i1 %used, label %return1, label %begin
begin:
  %left = call i32 @watched(ptr %session, double %t)
  %is_left = icmp ne i32 %left, 0
  br i1 %is_left, label %return5, label %set_out
set_out:
  call void @shift(ptr %arrays, i64 %m)
  store i64 0, ptr %is_dense.at
  %first = load double, ptr %next.at
  %likeness = load double, ptr %likeness.at
  %size = call double @llvm.fabs.f64(double %t)
  %least = fmul double %size, {exact(10.0 * 2.0**-52)}
  br label %attempt
{_attempt()}
{_acceptance()}
too_small:
  call void @unshift(ptr %arrays, i64 %m)
  ret i32 2
return0:
  ret i32 0
return1:
  ret i32 1
return5:
  ret i32 5
}}"""


def _look() -> str:
    """Return the function that tells whether an event may have happened in the last step."""
    return f"""define internal i32 @look(ptr %session, double %t) #0 {{
entry:
{prologue()}
  %watched = load i64, ptr %event_count.at
  %is_watched = icmp sgt i64 %watched, 0
  br i1 %is_watched, label %ask, label %nothing
ask:
  %y.index = mul i64 %m, {ROWS["y"]}
  %y = getelementptr double, ptr %arrays, i64 %y.index
  %yp.index = mul i64 %m, 12
  %yp = getelementptr double, ptr %arrays, i64 %yp.index
  %code = call i32 %events(double %t, ptr %y, ptr %yp, ptr %values, ptr %events_data)
  %has_values = icmp eq i32 %code, 0
  br i1 %has_values, label %compare, label %something
compare:
  %i = phi i64 [ 0, %ask ], [ %following, %compare ]
  %value.at = getelementptr double, ptr %values, i64 %i
  %value = load double, ptr %value.at
  %sign.at = getelementptr double, ptr %signs, i64 %i
  %sign = load double, ptr %sign.at
  %product = fmul double %value, %sign
  %is_same = fcmp ogt double %product, 0.0
  %following = add i64 %i, 1
  %is_more = icmp slt i64 %following, %watched
  %goes_on = and i1 %is_same, %is_more
  br i1 %goes_on, label %compare, label %end
end:
  %changed = xor i1 %is_same, true
  %answer = zext i1 %changed to i32
  ret i32 %answer
something:
  ret i32 1
nothing:
  ret i32 0
}}"""


def _attempt() -> str:
    """Return the instructions that try steps until one is good enough."""
    return f"""attempt:
  %wanted = phi double [ %first, %set_out ], [ %shorter, %again ]
  %rejected = phi i1 [ false, %set_out ], [ true, %again ]
  %long = fcmp olt double %wanted, %longest
  %h = select i1 %long, double %wanted, double %longest
  %moves = fcmp ogt double %h, %least
  %is_normal = fcmp oge double %h, {exact(1e-300)}
  %usable = and i1 %moves, %is_normal
  br i1 %usable, label %stages, label %too_small
stages:
{_evaluations(tuple(range(1, 12)), "retreat")}
  call void @stage12(ptr %arrays, i64 %m, double %h)
  %fifth.own = call double @squares5(ptr %arrays, i64 %m, double %relative)
  %third = call double @squares3(ptr %arrays, i64 %m, double %relative)
  %h2 = fmul double %h, %h
  %h4 = fmul double %h2, %h2
  %alike = fmul double %h4, %likeness
  %is_apart = fcmp olt double %alike, {exact(APART)}
  %likely = select i1 %is_apart, double %alike, double {exact(APART)}
  %fifth.before = fmul double %third, %likely
  %is_small = fcmp olt double %fifth.own, %fifth.before
  %fifth = select i1 %is_small, double %fifth.before, double %fifth.own
  %less = fmul double %third, {exact(0.01)}
  %both = fadd double %fifth, %less
  %product = fmul double %both, %count
  %length = call double @llvm.sqrt.f64(double %product)
  %above = fmul double %h, %fifth
  %quotient = fdiv double %above, %length
  %exact = fcmp oeq double %both, 0.0
  %error = select i1 %exact, double 0.0, double %quotient
  %r1 = call double @llvm.sqrt.f64(double %error)
  %r2 = call double @llvm.sqrt.f64(double %r1)
  %r3 = call double @llvm.sqrt.f64(double %r2)
  %factor = fdiv double %r3, {exact(SAFETY)}
  %good = fcmp ole double %error, 1.0
  br i1 %good, label %last, label %judge
judge:
  %finite = fcmp olt double %error, 0x7FF0000000000000
  br i1 %finite, label %reject, label %retreat
last:
  %t_new = fadd double %t, %h
  %p12 = call i32 @held(ptr %session, double %t_new)
  %meets = icmp eq i32 %p12, 0
  br i1 %meets, label %renew, label %retreat
renew:
  %e12 = call i32 @evaluate(ptr %session, double %t_new, i64 {ROWS["trial"]}, i64 12)
  %ok12 = icmp eq i32 %e12, 0
  br i1 %ok12, label %judged, label %retreat
judged:
  %passed = call i32 @guarded(ptr %session, double %t, double %t_new)
  %passes = icmp eq i32 %passed, 0
  br i1 %passes, label %accept, label %retreat
{_rejection()}"""


def _rejection() -> str:
    """Return the instructions that shorten a step."""
    return f"""reject:
  %small = fcmp olt double %factor, {exact(SHRINKAGE)}
  %by = select i1 %small, double %factor, double {exact(SHRINKAGE)}
  %share = fdiv double 1.0, %by
  br label %again
retreat:
  br label %again
again:
  %part = phi double [ %share, %reject ], [ {exact(RETREAT)}, %retreat ]
  %shorter = fmul double %h, %part
  %failures = load i64, ptr %failures.at
  %failed = add i64 %failures, 1
  store i64 %failed, ptr %failures.at
  br label %attempt"""


def _acceptance() -> str:
    """Return the instructions that keep a step and choose the next one."""
    return f"""accept:
  %low = fcmp olt double %factor, {exact(1.0 / GROWTH)}
  %at_least = select i1 %low, double {exact(1.0 / GROWTH)}, double %factor
  %high = fcmp ogt double %at_least, {exact(SHRINKAGE)}
  %within = select i1 %high, double {exact(SHRINKAGE)}, double %at_least
  %grown = fdiv double %h, %within
  %exceeds = fcmp ogt double %grown, %h
  %hold = and i1 %exceeds, %rejected
  %next = select i1 %hold, double %h, double %grown
  store double %next, ptr %next.at
  store double %h, ptr %h.at
  %spread = fmul double %h4, %third
  %is_known = fcmp ogt double %spread, 0.0
  %likeness.known = fdiv double %fifth.own, %spread
  %likeness.new = select i1 %is_known, double %likeness.known, double 0.0
  store double %likeness.new, ptr %likeness.at
  store double %t, ptr %t_old.at
  store double %t_new, ptr %t.at
  %stepped = add i64 %steps, 1
  store i64 %stepped, ptr %steps.at
{_stability()}
  call void @accept(ptr %arrays, i64 %m)
  %watched = call i32 @watched(ptr %session, double %t_new)
  %look = call i32 @look(ptr %session, double %t_new)
  %happens = icmp ne i32 %look, 0
  %heeding = load i64, ptr %heeds.at
  %is_heeding = icmp ne i64 %heeding, 0
  %stiffens = and i1 %found, %is_heeding
  %is_seen = icmp ne i32 %watched, 0
  %is_event = or i1 %happens, %stiffens
  %is_noted = or i1 %is_event, %is_seen
  br i1 %is_noted, label %return5, label %step"""


def _stability() -> str:
    """Return the instructions that count steps at the edge of stability."""
    return f"""  %turned = call double @slopes(ptr %arrays, i64 %m)
  %apart = call double @values(ptr %arrays, i64 %m)
  %rate2 = fdiv double %turned, %apart
  %rate = call double @llvm.sqrt.f64(double %rate2)
  %reach = fmul double %h, %rate
  %at_edge = fcmp ogt double %reach, {exact(EDGE)}
  %differs = fcmp ogt double %apart, 0.0
  %is_edgy = and i1 %at_edge, %differs
  %edgy.old = load i64, ptr %edgy.at
  %edgy.up = add i64 %edgy.old, 1
  %is_full = icmp eq i64 %edgy.up, {STIFF}
  %found = and i1 %is_edgy, %is_full
  %found.count = zext i1 %found to i64
  %stiff.old = load i64, ptr %stiff.at
  %stiff.new = add i64 %stiff.old, %found.count
  store i64 %stiff.new, ptr %stiff.at
  %calm.old = load i64, ptr %calm.at
  %calm.up = add i64 %calm.old, 1
  %calm.new = select i1 %is_edgy, i64 0, i64 %calm.up
  store i64 %calm.new, ptr %calm.at
  %is_calm = icmp eq i64 %calm.new, {CALM}
  %edgy.kept = select i1 %is_edgy, i64 %edgy.up, i64 %edgy.old
  %forget = or i1 %is_calm, %found
  %edgy.new = select i1 %forget, i64 0, i64 %edgy.kept
  store i64 %edgy.new, ptr %edgy.at"""


def _densify() -> str:
    """Return the function that makes the dense output of the last step, unless it is there; 1 where there is none."""
    return f"""define internal i32 @densify(ptr %session) #0 {{
entry:
{prologue()}
  %known = load i64, ptr %is_dense.at
  %ready = icmp ne i64 %known, 0
  br i1 %ready, label %done, label %more
more:
  %t = load double, ptr %t_old.at
  %h = load double, ptr %h.at
{_evaluations((13, 14, 15), "failed")}
  call void @dense(ptr %arrays, i64 %m, double %h)
  store i64 1, ptr %is_dense.at
  ret i32 0
done:
  ret i32 0
failed:
  ret i32 1
}}"""


def _interpolate() -> str:
    """Return the function that writes values and rates at a time within the last step; 3 where there are none."""
    return f"""define i32 @interpolate(ptr %session, double %time, ptr %y_out, ptr %yp_out) #0 {{
entry:
{prologue()}
  %bytes = mul i64 %n, 8
  %t_new = load double, ptr %t.at
  %t = load double, ptr %t_old.at
  %h = load double, ptr %h.at
  %slope.index = mul i64 %m, 12
  %end.slope = getelementptr double, ptr %arrays, i64 %slope.index
  %end.index = mul i64 %m, {ROWS["y"]}
  %end.y = getelementptr double, ptr %arrays, i64 %end.index
  %trial.index = mul i64 %m, {ROWS["trial"]}
  %trial.y = getelementptr double, ptr %arrays, i64 %trial.index

  %is_end = fcmp oeq double %time, %t_new
  br i1 %is_end, label %at_end, label %inside
at_end:
  call void @llvm.memcpy.p0.p0.i64(ptr %y_out, ptr %end.y, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %yp_out, ptr %end.slope, i64 %bytes, i1 false)
  ret i32 0
inside:
  %lacks = call i32 @densify(ptr %session)
  %is_dense = icmp eq i32 %lacks, 0
  br i1 %is_dense, label %value, label %failed
value:
  %since = fsub double %time, %t
  %x = fdiv double %since, %h
  call void @polynomial(ptr %arrays, i64 %m, double %x)
  call void @llvm.memcpy.p0.p0.i64(ptr %y_out, ptr %trial.y, i64 %bytes, i1 false)
  %code = call i32 %function(double %time, ptr %trial.y, ptr %yp_out, ptr %data)
  %count = load i64, ptr %evaluations.at
  %raised = add i64 %count, 1
  store i64 %raised, ptr %evaluations.at
  %ok = icmp eq i32 %code, 0
  br i1 %ok, label %fine, label %failed
fine:
  ret i32 0
failed:
  ret i32 3
}}"""


def step_code() -> str:
    """Return the functions, to be added to a module of `atwood.codegen.llvm.module`, which declares what all use.

    They take a pointer to the pointers of a session, in the order of `POINTERS`; numbers and counts are in the order of
    `NUMBERS` and `COUNTS`.
    """
    parts = [
        loop_code(),
        _evaluate(),
        begin_code(),
        _look(),
        project_code(),
        watch_code(),
        guard_code(),
        _run(),
        _densify(),
        _interpolate(),
        sample_code("%session", prologue(), "%n"),
    ]
    return "\n".join([*parts, "declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)"])
