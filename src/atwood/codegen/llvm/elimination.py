"""Symmetric elimination on a fixed pattern as machine code, for many states at once.

The code is the same for all patterns: lists of places say what to do. Numbers have one row for each entry and one
column for each state.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_int64, c_void_p
from typing import Any

from atwood.codegen.llvm.build import Built, build_code
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.llvm.routine import Routine
from atwood.codegen.once import once

__all__ = ["LISTS", "elimination_functions"]

LISTS = ("pivot", "begins", "others", "below", "starts", "first", "second", "changed")
"""The lists of places, in the order in which their addresses are given.

Of each step: the unknown that is eliminated; where its part of `others` and `below` begins, and of `first`, `second`
and `changed`, with one more at the end of either. Of each unknown that is touched: its number, and that of the entry
below the pivot. Of each product: which two of the touched are multiplied, and the number of the entry that changes.
"""

_HEAD = "define void @{name}(ptr %lists, ptr %entries, ptr %values, i64 %steps, i64 %size, i64 %states) #0"


@once
def elimination_functions() -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the functions of (lists, entries, values, steps, size, states) that factorise and that solve.

    The first overwrites entries with factors; its values are room for as many rows as a step touches. The second
    overwrites values, right-hand sides, with solutions.
    """
    addresses = _code().code.addresses
    signature = ctypes.CFUNCTYPE(None, c_void_p, c_void_p, c_void_p, c_int64, c_int64, c_int64)
    return signature(addresses["factorise"]), signature(addresses["solve"])


@once
def _code() -> Built:
    text = _factorise() + _solve()
    return build_code([], CodeOptions(level=2), more=text, exports=["factorise", "solve"])


class _Lists:
    """The lists of places, while a routine is being written."""

    def __init__(self, routine: Routine) -> None:
        self._routine = routine
        self._at = {name: routine.load_pointer("%lists", number) for number, name in enumerate(LISTS)}

    def row(self, name: str, *where: str | int) -> str:
        """Return where the row of an entry of a list begins."""
        return self._routine.index("mul", self._routine.load_index(self._at[name], *where), "%states")

    def range(self, name: str, step: str) -> tuple[str, str]:
        """Return where the part of a step begins and ends."""
        r = self._routine
        return r.load_index(self._at[name], step), r.load_index(self._at[name], step, 1)

    def value(self, name: str, where: str) -> str:
        return self._routine.load_index(self._at[name], where)


def _factorise() -> str:
    r = Routine()
    lists = _Lists(r)
    with r.loop(0, "%steps") as step:
        pivot = lists.row("pivot", step.index)
        begin, end = lists.range("begins", step.index)
        with r.loop(begin, end) as k:
            below, share = lists.row("below", k.index), r.index("mul", r.index("sub", k.index, begin), "%states")
            with r.loop(0, "%states") as j:
                value, divisor = r.load("%entries", below, j.index), r.load("%entries", pivot, j.index)
                r.store(r.number("fdiv", value, divisor), "%values", share, j.index)
        first, last = lists.range("starts", step.index)
        with r.loop(first, last) as m:
            one, changed = lists.row("first", m.index), lists.row("changed", m.index)
            other = lists.row("below", begin, lists.value("second", m.index))
            with r.loop(0, "%states") as j:
                product = r.number("fmul", r.load("%values", one, j.index), r.load("%entries", other, j.index))
                left = r.number("fsub", r.load("%entries", changed, j.index), product)
                r.store(left, "%entries", changed, j.index)
        with r.loop(begin, end) as k:
            below, share = lists.row("below", k.index), r.index("mul", r.index("sub", k.index, begin), "%states")
            with r.loop(0, "%states") as j:
                r.store(r.load("%values", share, j.index), "%entries", below, j.index)
    r.do("ret void")
    return r.function(_HEAD.format(name="factorise"))


def _solve() -> str:
    r = Routine()
    lists = _Lists(r)
    with r.loop(0, "%steps") as step:
        _take_off(r, lists, step.index, forwards=True)
    with r.loop(0, r.index("mul", "%size", "%states")) as k:  # the first entries are the diagonal
        r.store(r.number("fdiv", r.load("%values", k.index), r.load("%entries", k.index)), "%values", k.index)
    with r.loop(0, "%steps") as step:
        _take_off(r, lists, r.index("sub", r.index("sub", "%steps", 1), step.index), forwards=False)
    r.do("ret void")
    return r.function(_HEAD.format(name="solve"))


def _take_off(r: Routine, lists: _Lists, step: str, forwards: bool) -> None:
    """Write what one step does to values: the pivot's to the others, or the others' to the pivot."""
    pivot = lists.row("pivot", step)
    with r.loop(*lists.range("begins", step)) as k:
        other, below = lists.row("others", k.index), lists.row("below", k.index)
        target, source = (other, pivot) if forwards else (pivot, other)
        with r.loop(0, "%states") as j:
            product = r.number("fmul", r.load("%entries", below, j.index), r.load("%values", source, j.index))
            r.store(r.number("fsub", r.load("%values", target, j.index), product), "%values", target, j.index)
