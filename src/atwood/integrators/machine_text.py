"""What explicit methods have in common in LLVM's language: numbers, the memory of a session, and output times."""

from __future__ import annotations

import struct
from collections.abc import Sequence

__all__ = ["WIDTH", "exact", "sample_code", "unpack"]

WIDTH = 4
"""How many numbers loops over all unknowns work on at a time."""


def exact(value: float) -> str:
    """Return a double, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def unpack(pointers: Sequence[str], numbers: Sequence[str], counts: Sequence[str]) -> str:
    """Return the instructions that unpack a session, which is a table of pointers at `%session`.

    Parameters
    ----------
    pointers
        Names of the pointers, among them ``numbers`` and ``counts``.
    numbers, counts
        Names of the numbers and of the counts that these point to. The place of each is its name with ``.at``.
    """
    lines = []
    for k, name in enumerate(pointers):
        lines.append(f"  %{name}.from = getelementptr ptr, ptr %session, i64 {k}")
        lines.append(f"  %{name} = load ptr, ptr %{name}.from")
    for group, names in (("numbers", numbers), ("counts", counts)):
        lines += [f"  %{name}.at = getelementptr i64, ptr %{group}, i64 {k}" for k, name in enumerate(names)]
    return "\n".join(lines)


def sample_code(session: str, prologue: str, width: str) -> str:
    """Return the function that goes through output times and fills a table; it ends as `run` does.

    Parameters
    ----------
    session
        The argument that has the session.
    prologue
        Instructions that give the places ``%stop.at`` and ``%filled.at`` of the time to stop at, and of the number of
        rows that have been filled.
    width
        How many numbers a row has.
    """
    return f"""define i32 @sample(ptr {session}, ptr %times, i64 %wanted, ptr %ys, ptr %yps) #0 {{
entry:
{prologue}
  br label %next
next:
  %i = phi i64 [ 0, %entry ], [ %following, %filled ]
  store i64 %i, ptr %filled.at
  %more = icmp slt i64 %i, %wanted
  br i1 %more, label %go, label %done
go:
  %place = getelementptr double, ptr %times, i64 %i
  %moment = load double, ptr %place
  store double %moment, ptr %stop.at
  %outcome = call i32 @run(ptr {session})
  %reached = icmp eq i32 %outcome, 0
  br i1 %reached, label %read, label %stopped
read:
  %offset = mul i64 %i, {width}
  %y = getelementptr double, ptr %ys, i64 %offset
  %yp = getelementptr double, ptr %yps, i64 %offset
  %code = call i32 @interpolate(ptr {session}, double %moment, ptr %y, ptr %yp)
  %ok = icmp eq i32 %code, 0
  br i1 %ok, label %filled, label %stopped
filled:
  %following = add i64 %i, 1
  br label %next
stopped:
  %reason = phi i32 [ %outcome, %go ], [ %code, %read ]
  ret i32 %reason
done:
  ret i32 0
}}"""
