"""Calls of a program's functions from a routine (`atwood.codegen.llvm.module` says what these take)."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.codegen.routines.kinds import ADDRESS
from atwood.codegen.routines.language import Routine, Value


def addresses(r: Routine, places: Sequence[Value]) -> Value:
    """Return an array of this call's own that holds addresses."""
    table = r.array(len(places))
    for k, place in enumerate(places):
        table.write(k, place, ADDRESS)
    return table


def place_of(r: Routine, number: Value) -> Value:
    """Return an array of this call's own that holds a number."""
    place = r.array(1)
    place[0] = number
    return place


def call_kernel(
    r: Routine, name: str, inputs: Sequence[Value], derived: Value, scratch: Value, outputs: Sequence[Value]
) -> Value:
    """Call a program; return 0, or 1 where a result is not finite."""
    return r.call(name, addresses(r, inputs), derived, scratch, addresses(r, outputs))
