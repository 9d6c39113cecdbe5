"""What the explicit method does with constraints, in LLVM's language: projections, and looks at the motion."""

from __future__ import annotations

from atwood.integrators.dop853.layout import prologue
from atwood.integrators.dop853.stepping_code import ROWS
from atwood.integrators.machine_text import exact

__all__ = ["project_code", "watch_code"]

_STRETCH = 1.5
"""The end of a step takes the place of a look that was wanted before, if that makes the way to it longer by no more."""


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


def watch_code() -> str:
    """Return the function that looks at the motion in the last step, at the times that what watches it wants.

    The end of a step is looked at instead where it is not much later: its state is there already. It returns 1 where
    something was seen, which `seen` keeps until somebody asks; the looks that are then left in the step are taken when
    the steps go on.
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
{_places()}
  br label %turn
turn:
  %next = load double, ptr %due
  %is_within = fcmp ole double %next, %t_new
  br i1 %is_within, label %choose, label %nothing
choose:
  %looked = load double, ptr %looked.at
  %wait = fsub double %next, %looked
  %most = fmul double %wait, {exact(_STRETCH)}
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
