"""What the explicit method does at the ends of its steps, in LLVM's language: its start, projections, looks."""

from __future__ import annotations

from atwood.integrators.dop853.layout import prologue
from atwood.integrators.dop853.stepping_code import ROWS
from atwood.integrators.machine_text import exact

__all__ = ["begin_code", "guard_code", "project_code", "watch_code"]

_STRETCH = 1.5
"""The end of a step takes the place of a look that was wanted before, if that makes the way to it longer by no more."""

_PATIENCE = 32
"""After so many steps without a look the motion is looked at, however little it has moved: perhaps what keeps steps
short is what is looked for."""


def begin_code() -> str:
    """Return the function that starts anew from a state: 0, or 4 where that has no finite rates.

    The first step is that of `atwood.integrators.explicit_problem.first_step`.
    """
    return f"""define i32 @begin(ptr %session, double %t, ptr %start) #0 {{
entry:
{prologue()}
  store double %t, ptr %t.at
  store double %t, ptr %t_old.at
  store double %t, ptr %looked.at
  store i64 0, ptr %edgy.at
  store i64 0, ptr %calm.at
  %steps = load i64, ptr %steps.at
  store i64 %steps, ptr %looks.at
  %bytes = mul i64 %n, 8
  %y.index = mul i64 %m, {ROWS["y"]}
  %y = getelementptr double, ptr %arrays, i64 %y.index
  %old.index = mul i64 %m, {ROWS["y_old"]}
  %y_old = getelementptr double, ptr %arrays, i64 %old.index
  call void @llvm.memcpy.p0.p0.i64(ptr %y, ptr %start, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %y_old, ptr %start, i64 %bytes, i1 false)
  %code = call i32 @evaluate(ptr %session, double %t, i64 {ROWS["y"]}, i64 12)
  %has_rates = icmp eq i32 %code, 0
  br i1 %has_rates, label %choose, label %lost
choose:
  %given = load double, ptr %first.at
  %horizon = load double, ptr %horizon.at
  %longest = load double, ptr %longest.at
  %is_near = fcmp olt double %horizon, %longest
  %bound = select i1 %is_near, double %horizon, double %longest
  %is_given = fcmp ogt double %given, 0.0
  br i1 %is_given, label %told, label %estimate
told:
  %is_short = fcmp olt double %given, %longest
  %shorter = select i1 %is_short, double %given, double %longest
  br label %ready
{_first_step()}
ready:
  %next = phi double [ %shorter, %told ], [ %h0, %estimate ], [ %chosen, %second ]
  store double %next, ptr %next.at
  store double 0.0, ptr %likeness.at
  ret i32 0
lost:
  ret i32 4
}}"""


def _first_step() -> str:
    """Return the instructions that estimate the first step from the size of the first two derivatives."""
    return f"""estimate:
  %relative = load double, ptr %relative.at
  %count.n = sitofp i64 %n to double
  %s0 = call double @size0(ptr %arrays, i64 %m, double %relative)
  %m0 = fdiv double %s0, %count.n
  %d0 = call double @llvm.sqrt.f64(double %m0)
  %s1 = call double @size1(ptr %arrays, i64 %m, double %relative)
  %m1 = fdiv double %s1, %count.n
  %d1 = call double @llvm.sqrt.f64(double %m1)
  %moves = fcmp oge double %d0, {exact(1e-5)}
  %turns = fcmp oge double %d1, {exact(1e-5)}
  %ratio = fdiv double %d0, %d1
  %is_finite = fcmp olt double %ratio, 0x7FF0000000000000
  %both = and i1 %moves, %turns
  %usual = and i1 %both, %is_finite
  %part = fmul double %d0, {exact(0.01)}
  %share = fdiv double %part, %d1
  %guess = select i1 %usual, double %share, double {exact(1e-6)}
  %is_within = fcmp olt double %guess, %bound
  %h0 = select i1 %is_within, double %guess, double %bound
  call void @euler(ptr %arrays, i64 %m, double %h0)
  %t1 = fadd double %t, %h0
  %probe = call i32 @evaluate(ptr %session, double %t1, i64 {ROWS["trial"]}, i64 1)
  %s2 = call double @size2(ptr %arrays, i64 %m, double %relative)
  %m2 = fdiv double %s2, %count.n
  %r2 = call double @llvm.sqrt.f64(double %m2)
  %d2 = fdiv double %r2, %h0
  %went = icmp eq i32 %probe, 0
  %curved = fcmp olt double %d2, 0x7FF0000000000000
  %known = and i1 %went, %curved
  br i1 %known, label %second, label %ready
second:
  %is_steeper = fcmp ogt double %d2, %d1
  %steepest = select i1 %is_steeper, double %d2, double %d1
  %inverse = fdiv double {exact(0.01)}, %steepest
  %root1 = call double @llvm.sqrt.f64(double %inverse)
  %root2 = call double @llvm.sqrt.f64(double %root1)
  %root3 = call double @llvm.sqrt.f64(double %root2)
  %little = fmul double %h0, {exact(1e-3)}
  %is_tiny = fcmp ogt double %little, {exact(1e-6)}
  %at_least = select i1 %is_tiny, double %little, double {exact(1e-6)}
  %is_flat = fcmp ole double %steepest, {exact(1e-15)}
  %h1 = select i1 %is_flat, double %at_least, double %root3
  %most = fmul double %h0, {exact(100.0)}
  %is_less = fcmp olt double %most, %h1
  %lesser = select i1 %is_less, double %most, double %h1
  %is_inside = fcmp olt double %lesser, %bound
  %chosen = select i1 %is_inside, double %lesser, double %bound
  br label %ready"""


def project_code() -> str:
    """Return the function that takes the values at the end of a step onto the constraints; 0, or 1 where it cannot.

    It comes before the last slope is taken, so that the next step begins with the slope of the state that is kept, and
    the dense output meets the constraints at both ends.
    """
    return f"""define internal i32 @held(ptr %session, double %t) #0 {{
entry:
{prologue()}
  %is_free = icmp eq ptr %project, null
  br i1 %is_free, label %nothing, label %ask
ask:
  %index = mul i64 %m, {ROWS["trial"]}
  %y = getelementptr double, ptr %arrays, i64 %index
  %code = call i32 %project(double %t, ptr %y, ptr %project_data)
  ret i32 %code
nothing:
  ret i32 0
}}"""


def guard_code() -> str:
    """Return the function that asks what judges steps about one that is good enough otherwise; 0 where it is good."""
    rows = {"y0": ROWS["y"], "p0": 0, "y1": ROWS["trial"], "p1": 12}
    places = "\n".join(
        f"  %{name}.index = mul i64 %m, {row}\n  %{name} = getelementptr double, ptr %arrays, i64 %{name}.index"
        for name, row in rows.items()
    )
    return f"""define internal i32 @guarded(ptr %session, double %t0, double %t1) #0 {{
entry:
{prologue()}
  %is_free = icmp eq ptr %guard, null
  br i1 %is_free, label %nothing, label %ask
ask:
{places}
  %code = call i32 %guard(double %t0, ptr %y0, ptr %p0, double %t1, ptr %y1, ptr %p1, ptr %guard_data)
  ret i32 %code
nothing:
  ret i32 0
}}"""


def watch_code() -> str:
    """Return the function that looks at the motion in the last step, at the times that what watches it wants.

    The end of a step is looked at instead where it is not much later: its state is there already. It is looked at, too,
    after many steps that were not. It returns 1 where something was seen, which `seen` keeps until somebody asks; the
    looks that are then left in the step are taken when the steps go on.
    """
    return f"""define internal i32 @watched(ptr %session, double %t_new) #0 {{
entry:
{prologue()}
  %is_alone = icmp eq ptr %watch, null
  br i1 %is_alone, label %nothing, label %begin
begin:
  %t = load double, ptr %t_old.at
  %is_behind = fcmp olt double %t, %t_new
  br i1 %is_behind, label %enter, label %nothing
enter:
  %h = load double, ptr %h.at
  %steps = load i64, ptr %steps.at
{_places()}
  br label %turn
turn:
  %next = load double, ptr %due
  %is_within = fcmp ole double %next, %t_new
  br i1 %is_within, label %choose, label %wait
wait:
  %before = load i64, ptr %looks.at
  %taken = sub i64 %steps, %before
  %is_late = icmp sge i64 %taken, {_PATIENCE}
  br i1 %is_late, label %at_end, label %nothing
choose:
  %looked = load double, ptr %looked.at
  %stretch = fsub double %next, %looked
  %most = fmul double %stretch, {exact(_STRETCH)}
  %gap = fsub double %t_new, %looked
  %is_near = fcmp ole double %gap, %most
  br i1 %is_near, label %at_end, label %inside
inside:
  %lacks = call i32 @densify(ptr %session)
  %is_dense = icmp eq i32 %lacks, 0
  br i1 %is_dense, label %read, label %at_end
read:
  %since = fsub double %next, %t
  %share = fdiv double %since, %h
  call void @polynomial(ptr %arrays, i64 %m, double %share)
  call void @slope(ptr %arrays, i64 %m, double %share, double %h)
  br label %look
at_end:
  br label %look
look:
  %moment = phi double [ %next, %read ], [ %t_new, %at_end ]
  %values.at = phi ptr [ %trial, %read ], [ %y, %at_end ]
  %slopes.at = phi ptr [ %last, %read ], [ %yp, %at_end ]
  store double %moment, ptr %looked.at
  store i64 %steps, ptr %looks.at
  %asks = call i32 %watch(double %moment, ptr %values.at, ptr %slopes.at, ptr %watch_data)
  %is_seen = icmp ne i32 %asks, 0
  br i1 %is_seen, label %keep, label %turn
keep:
  store i64 1, ptr %seen.at
  ret i32 1
nothing:
  ret i32 0
}}"""


def _places() -> str:
    """Return the instructions that find the rows of values and slopes: those at the end, and those in between."""
    rows = {"y": ROWS["y"], "yp": 12, "trial": ROWS["trial"], "last": ROWS["last"]}
    lines = []
    for name, row in rows.items():
        lines += [
            f"  %{name}.index = mul i64 %m, {row}",
            f"  %{name} = getelementptr double, ptr %arrays, i64 %{name}.index",
        ]
    return "\n".join(lines)
