"""The start of the Taylor-series method in LLVM's language, and what is asked about its steps."""

from __future__ import annotations

from atwood.integrators.machine_text import exact
from atwood.integrators.taylor.problem import PARTS
from atwood.integrators.taylor.stepping_code import ROWS, STRIDE

__all__ = ["begin_code", "guarded_code"]


def begin_code(prologue: str) -> str:
    """Return the function that starts anew from a state: 0, or 4 where that has no finite rates.

    The unit of time is that in which the fastest unknown changes by its size, and no longer than the run.

    Parameters
    ----------
    prologue
        Instructions that unpack the pointers of a session.
    """
    return f"""define i32 @begin(ptr %session, double %t, ptr %state) #0 {{
entry:
{prologue}
  store double %t, ptr %t.at
  store double %t, ptr %t_old.at
  store double %t, ptr %t_new.at
  store double 0.0, ptr %last.at
  %bytes = mul i64 %n, 8
  %row.bytes = mul i64 %m, 8
{_cleared()}
{_placed()}
  %code = call i32 @evaluate(ptr %session, ptr %new_in, ptr %new_out)
  %has_rates = icmp eq i32 %code, 0
  br i1 %has_rates, label %found, label %lost
found:
  call void @llvm.memcpy.p0.p0.i64(ptr %row.rates, ptr %row.new_rates, i64 %row.bytes, i1 false)
  br label %each
{_unit()}
lost:
  ret i32 4
}}
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)"""


def _cleared() -> str:
    """Return the instructions that clear all coefficients: nothing that is not finite must be left."""
    return f"""  %x.count = mul i64 %m, {ROWS["y"]}
  %x.bytes = mul i64 %x.count, 8
  call void @llvm.memset.p0.i64(ptr %arrays, i8 0, i64 %x.bytes, i1 false)
  %pairs = load i64, ptr %pair_blocks.at
  %squares = load i64, ptr %square_blocks.at
  %both = mul i64 %pairs, 2
  %blocks = add i64 %both, %squares
  %table.bytes = mul i64 %blocks, {8 * STRIDE}
  call void @llvm.memset.p0.i64(ptr %table, i8 0, i64 %table.bytes, i1 false)"""


def _placed() -> str:
    """Return the instructions that find the rows, and write the state where steps begin."""
    lines = []
    for name in ("y", "y_low", "new", "rates", "new_rates", "floors"):
        lines.append(f"  %{name}.index = mul i64 %m, {ROWS[name]}")
        lines.append(f"  %row.{name} = getelementptr double, ptr %arrays, i64 %{name}.index")
    lines.append("  call void @llvm.memset.p0.i64(ptr %row.y_low, i8 0, i64 %row.bytes, i1 false)")
    lines += [
        f"  call void @llvm.memcpy.p0.p0.i64(ptr {place}, ptr %state, i64 %bytes, i1 false)"
        for place in ("%row.y", "%row.new", "%arrays")
    ]
    return "\n".join(lines)


def _unit() -> str:
    """Return the instructions that find the unit of time."""
    return f"""each:
  %i = phi i64 [ 0, %found ], [ %following, %each ]
  %steepest = phi double [ 0.0, %found ], [ %steeper, %each ]
  %rate.at = getelementptr double, ptr %row.rates, i64 %i
  %rate = load double, ptr %rate.at
  %rate.size = call double @llvm.fabs.f64(double %rate)
  %floor.at = getelementptr double, ptr %row.floors, i64 %i
  %floor = load double, ptr %floor.at
  %value.at = getelementptr double, ptr %state, i64 %i
  %value = load double, ptr %value.at
  %value.size = call double @llvm.fabs.f64(double %value)
  %size = fadd double %floor, %value.size
  %pace = fdiv double %rate.size, %size
  %is.steeper = fcmp ogt double %pace, %steepest
  %steeper = select i1 %is.steeper, double %pace, double %steepest
  %following = add i64 %i, 1
  %is.more = icmp slt i64 %following, %n
  br i1 %is.more, label %each, label %chosen
chosen:
  %horizon = load double, ptr %horizon.at
  %longest = load double, ptr %longest.at
  %is.near = fcmp olt double %horizon, %longest
  %bound = select i1 %is.near, double %horizon, double %longest
  %moves = fcmp ogt double %steeper, 0.0
  %inverse = fdiv double {exact(1.0)}, %steeper
  %is.shorter = fcmp olt double %inverse, %bound
  %shorter = select i1 %is.shorter, double %inverse, double %bound
  %unit = select i1 %moves, double %shorter, double %bound
  store double %unit, ptr %unit.at
  ret i32 0"""


def guarded_code(prologue: str) -> str:
    """Return the function that asks what judges steps about each quarter of one; 0 where all are good."""
    names = {"y": "y", "rates": "rates", "trial": "trial", "slope": "trial_rates"}
    names |= {"kept": "kept", "kept.rates": "kept_rates"}
    rows = "\n".join(
        f"  %{name}.index = mul i64 %m, {ROWS[row]}\n  %{name} = getelementptr double, ptr %arrays, i64 %{name}.index"
        for name, row in names.items()
    )
    return f"""define internal i32 @guarded(ptr %session, double %t, double %h) #0 {{
entry:
{prologue}
{rows}
  %is.free = icmp eq ptr %guard, null
  br i1 %is.free, label %good, label %begin
begin:
  %bytes = mul i64 %n, 8
  %unit = load double, ptr %unit.at
  call void @llvm.memcpy.p0.p0.i64(ptr %kept, ptr %y, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %kept.rates, ptr %rates, i64 %bytes, i1 false)
  br label %part
part:
  %i = phi i64 [ 1, %begin ], [ %following, %passed ]
  %t0 = phi double [ %t, %begin ], [ %t1, %passed ]
  %number = sitofp i64 %i to double
  %share = fmul double %number, {exact(1.0 / PARTS)}
  %since = fmul double %share, %h
  %t1 = fadd double %t, %since
  %units = fdiv double %since, %unit
  %pace = fdiv double 1.0, %unit
  call void @inside(ptr %arrays, i64 %m, i64 %p, double %units, double %pace)
  %code = call i32 %guard(double %t0, ptr %kept, ptr %kept.rates, double %t1, ptr %trial, ptr %slope, ptr %guard_data)
  %ok = icmp eq i32 %code, 0
  br i1 %ok, label %passed, label %bad
passed:
  call void @llvm.memcpy.p0.p0.i64(ptr %kept, ptr %trial, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %kept.rates, ptr %slope, i64 %bytes, i1 false)
  %following = add i64 %i, 1
  %is.done = icmp sgt i64 %following, {PARTS}
  br i1 %is.done, label %good, label %part
good:
  ret i32 0
bad:
  ret i32 1
}}"""
