"""Elementary functions as routines, for one number or for lanes of them (`atwood.expr.core.elementary`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Lanes, Routine, own_name
from atwood.expr.core.elementary import (
    FUNCTIONS,
    atan2_far,
    cos_far,
    exp_far,
    log_far,
    power_far,
    sin_cos,
    sin_cos_far,
    sin_far,
    tan_far,
)

_FAR: Mapping[str, Callable[..., tuple[Any, ...]]] = {
    "sin": sin_far,
    "cos": cos_far,
    "sin_cos": sin_cos_far,
    "tan": tan_far,
    "atan": atan2_far,
    "atan2": atan2_far,
    "exp": exp_far,
    "log": log_far,
    "pow": power_far,
}
"""What functions call for arguments that are rare."""


def write_routines(names: Sequence[str], lanes: int = 0, each: bool = True) -> list[Routine]:
    """Return functions by their names as operations, and what they call.

    Each takes numbers and returns one; ``sin_cos`` takes two addresses besides and fills them.  With lanes a function
    is called with the addresses of what it takes and fills, so many numbers each, and its name ends with their count.

    Parameters
    ----------
    names
        Their names as operations, and ``sin_cos``.
    lanes
        On how many numbers at once they work, if not on one.
    each
        Whether those that return one number have another for the entries of arrays, with ``_each`` in its name; with
        lanes, whether what they call is written, too.
    """
    far = dict.fromkeys(_FAR[one] for one in names if one in _FAR)
    found = [_function(one, lanes) for one in names]
    if lanes:
        return [*(_far(one) for one in far if each), *found]
    return [*(_far(one) for one in far), *found, *(_each(one) for one in found if each and one.result is NUMBER)]


def _each(function: Routine) -> Routine:
    """Return the routine that calls a function for the entries of arrays."""
    places = {f"{one.name}": ADDRESS for one in function.arguments}
    r = Routine(f"{function.name}_each", {**places, "found": ADDRESS, "count": INTEGER}, None, exported=True)
    *given, found, count = r.arguments
    with r.count(count) as k:
        found[k] = r.call(function, *(one[k] for one in given))
    r.give()
    return r


def _far(function: Callable[..., tuple[Any, ...]]) -> Routine:
    r = Routine(own_name(function.__name__), {"given": ADDRESS, "results": ADDRESS}, None)
    given, results = r.arguments
    count = function.__code__.co_argcount - 1
    for k, one in enumerate(function(r, *(given[k] for k in range(count)))):
        results[k] = one
    r.give()
    return r


def _function(name: str, lanes: int) -> Routine:
    call = sin_cos if name == "sin_cos" else FUNCTIONS[name]
    count = call.__code__.co_argcount - 1
    places = ["first", "second"][: 2 if name == "sin_cos" else 1 if lanes else 0]
    taken = dict.fromkeys(["x", "y"][:count], ADDRESS if lanes else NUMBER)
    r = Routine(
        own_name(f"{name}_{lanes}" if lanes else name),
        taken | dict.fromkeys(places, ADDRESS),
        None if places else NUMBER,
        exported=True,
    )
    given, filled = r.arguments[:count], r.arguments[count:]
    found = call(r, *([one.read(0, Lanes(lanes)) for one in given] if lanes else given))
    if not filled:
        r.give(found[0])
        return r
    for place, one in zip(filled, found, strict=True):
        place[0] = one
    r.give()
    return r
