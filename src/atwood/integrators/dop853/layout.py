"""Where a session of the explicit method keeps its numbers: what the compiled code and Python agree on."""

from __future__ import annotations

__all__ = ["COUNTS", "NUMBERS", "POINTERS", "prologue"]

NUMBERS = ("t", "t_old", "h", "next", "stop", "relative", "longest", "horizon", "first")
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
)
POINTERS = ("function", "data", "numbers", "counts", "arrays", "events", "events_data", "values", "signs")


def _fields(names: tuple[str, ...], group: str) -> str:
    """Return the instructions that find the places of numbers or counts."""
    return "\n".join(f"  %{name}.at = getelementptr i64, ptr %{group}, i64 {k}" for k, name in enumerate(names))


def prologue() -> str:
    """Return the instructions that unpack the pointers of a session, which `%session` points to."""
    lines = []
    for k, name in enumerate(POINTERS):
        lines.append(f"  %{name}.from = getelementptr ptr, ptr %session, i64 {k}")
        lines.append(f"  %{name} = load ptr, ptr %{name}.from")
    lines += [_fields(NUMBERS, "numbers"), _fields(COUNTS, "counts")]
    lines += ["  %n = load i64, ptr %size.at", "  %m = load i64, ptr %padded.at"]
    return "\n".join(lines)
