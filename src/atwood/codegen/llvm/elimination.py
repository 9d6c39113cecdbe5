"""Symmetric elimination on a fixed pattern as machine code, for many states at once.

The code is the same for all patterns: lists of places say what to do. Numbers have one row for each entry and one
column for each state.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_int64, c_void_p
from typing import Any

from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, Operand, Routine, Value

LISTS = ("pivot", "begins", "others", "below", "starts", "first", "second", "changed")
"""The lists of places, in the order in which their addresses are given.

Of each step: the unknown that is eliminated; where its part of `others` and `below` begins, and of `first`, `second`
and `changed`, with one more at the end of either. Of each unknown that is touched: its number, and that of the entry
below the pivot. Of each product: which two of the touched are multiplied, and the number of the entry that changes.
"""


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
    routines = RoutineSource("codegen.llvm.elimination")
    return build_code([], CodeOptions(level=2), exports=["factorise", "solve"], routines=routines)


def write_routines() -> list[Routine]:
    """Write the routines that factorise and that solve."""
    return [_factorise(), _solve()]


class _Work:
    """The arguments of a routine while it is being written, and rows of its arrays."""

    def __init__(self, name: str) -> None:
        arguments = dict.fromkeys(("lists", "entries", "values"), ADDRESS)
        self.r = r = Routine(name, arguments | dict.fromkeys(("steps", "size", "states"), INTEGER), None, exported=True)
        lists, self.entries, self.values, self.steps, self.size, self.states = r.arguments
        self._lists = {name: lists.read(k, ADDRESS) for k, name in enumerate(LISTS)}

    def listed(self, name: str, where: Operand) -> Value:
        """Return an entry of a list."""
        return self._lists[name].read(where, INTEGER)

    def range(self, name: str, step: Value) -> tuple[Value, Value]:
        """Return where the part of a step ends and begins, as loops take it."""
        return self.listed(name, step + 1), self.listed(name, step)

    def row(self, array: Value, number: Value) -> Value:
        """Return a row of numbers, one for each state."""
        return array.at(number * self.states)


def _factorise() -> Routine:
    w = _Work("factorise")
    r = w.r
    with r.count(w.steps) as step:
        pivot, (end, begin) = w.row(w.entries, w.listed("pivot", step)), w.range("begins", step)
        with r.count(end, begin) as k:
            below, share = w.row(w.entries, w.listed("below", k)), w.row(w.values, k - begin)
            with r.count(w.states) as j:
                share[j] = below[j] / pivot[j]
        with r.count(*w.range("starts", step)) as m:
            one, changed = w.row(w.values, w.listed("first", m)), w.row(w.entries, w.listed("changed", m))
            other = w.row(w.entries, w.listed("below", begin + w.listed("second", m)))
            with r.count(w.states) as j:
                changed[j] = changed[j] - one[j] * other[j]
        with r.count(end, begin) as k:
            below, share = w.row(w.entries, w.listed("below", k)), w.row(w.values, k - begin)
            with r.count(w.states) as j:
                below[j] = share[j]
    return r


def _solve() -> Routine:
    w = _Work("solve")
    r = w.r
    with r.count(w.steps) as step:
        _take_off(w, step, forwards=True)
    with r.count(w.size * w.states) as k:  # the first entries are the diagonal
        w.values[k] = w.values[k] / w.entries[k]
    with r.count(w.steps) as step:
        _take_off(w, w.steps - 1 - step, forwards=False)
    return r


def _take_off(w: _Work, step: Value, forwards: bool) -> None:
    """Write what one step does to values: the pivot's to the others, or the others' to the pivot."""
    r, pivot = w.r, w.row(w.values, w.listed("pivot", step))
    with r.count(*w.range("begins", step)) as k:
        other, below = w.row(w.values, w.listed("others", k)), w.row(w.entries, w.listed("below", k))
        target, source = (other, pivot) if forwards else (pivot, other)
        with r.count(w.states) as j:
            target[j] = target[j] - below[j] * source[j]
