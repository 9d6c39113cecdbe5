"""Where a session of the explicit method keeps its numbers: what the compiled code and Python agree on."""

from __future__ import annotations

from atwood.integrators.machine_text import unpack

__all__ = ["COUNTS", "NUMBERS", "POINTERS", "prologue"]

NUMBERS = ("t", "t_old", "h", "next", "stop", "relative", "longest", "horizon", "first", "looked", "likeness")
COUNTS = (
    "size",
    "padded",
    "limit",
    "steps",
    "failures",
    "evaluations",
    "undefined",
    "stiff",
    "is_dense",
    "filled",
    "edgy",
    "calm",
    "event_count",
    "heeds",
    "seen",
    "looks",
)
POINTERS = (
    "function",
    "data",
    "numbers",
    "counts",
    "arrays",
    "events",
    "events_data",
    "values",
    "signs",
    "project",
    "project_data",
    "watch",
    "watch_data",
    "due",
    "guard",
    "guard_data",
)


def prologue() -> str:
    """Return the instructions that unpack the pointers of a session, which `%session` points to."""
    sizes = "  %n = load i64, ptr %size.at\n  %m = load i64, ptr %padded.at"
    return f"{unpack(POINTERS, NUMBERS, COUNTS)}\n{sizes}"
