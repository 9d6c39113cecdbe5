"""LLVM's language for a program as loops: a function for each pattern, and one that goes through the runs.

The positions that cells work on are not in the code but in tables, which are handed over once when the code is loaded.
So the code of a scene with a thousand parts is that of one with a hundred.

The tables of all functions of a module lie in one array of 32-bit integers, and the constants that differ from cell to
cell in one of floats.  At the start of the integers is, for each function, where its own begin.  There are: the number
of runs; for each pattern where its rows begin, where its constants begin, the slot of its first cell, and the
positions that all its cells share; the runs, as pattern, first cell and number of cells; and the rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from atwood.kernels.llvm_solve import Solver
from atwood.kernels.llvm_text import Needs, Writer
from atwood.kernels.llvm_unit import opening, write_unit
from atwood.kernels.rolled import CONSTANTS, SCRATCH, Leaf, Pattern, Rolled

__all__ = ["Tables", "write_rolled", "write_table_functions"]

_ARGUMENTS = (
    "ptr noalias readonly %inputs, ptr noalias readonly %derived, ptr noalias %scratch, ptr noalias readonly %outputs"
)
_PASSED = "ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs"

_FIXED = 3
"""Integers that every pattern has before its shared positions."""


@dataclass
class Tables:
    """What the loops of a module work on.

    Attributes
    ----------
    integers
        The tables of each function.
    constants
        The constants of all functions.
    """

    integers: list[NDArray[np.int32]] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)

    def arrays(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Return the two arrays that the code is given."""
        starts = np.cumsum([len(self.integers), *(len(one) for one in self.integers)])[:-1]
        parts = [starts.astype(np.int32), *self.integers]
        return np.concatenate(parts).astype(np.int32), np.array(self.constants, dtype=float)

    def add(self, rolled: Rolled) -> int:
        """Take up the tables of a function, and return its number."""
        heads = [_FIXED + len(pattern.shared) for pattern in rolled.patterns]
        place = 1 + sum(heads) + 3 * len(rolled.runs)
        head: list[int] = [len(rolled.runs)]
        for pattern in rolled.patterns:
            head += [place, len(self.constants), pattern.base, *pattern.shared]
            place += pattern.table.size
        runs = np.array(rolled.runs, dtype=np.int32).ravel()
        rows = [pattern.table.ravel() for pattern in rolled.patterns]
        self.integers.append(np.concatenate([np.array(head, dtype=np.int32), runs, *rows]))
        self.constants += rolled.constants
        return len(self.integers) - 1


def write_table_functions() -> str:
    """Write where the code finds its tables, and the function that says so."""
    return """@tables.integers = internal global ptr null
@tables.constants = internal global ptr null
define void @use_tables(ptr %integers, ptr %constants) #0 {
  store ptr %integers, ptr @tables.integers
  store ptr %constants, ptr @tables.constants
  ret void
}"""


def write_rolled(name: str, rolled: Rolled, sincos: str, needs: Needs, tables: Tables) -> list[str]:
    """Write a body as loops.

    Parameters
    ----------
    name
        What to call the function.
    rolled
        The body.
    sincos
        The C library's function for sine and cosine together, empty where it has none.
    needs
        What is called.
    tables
        Takes up its tables.
    """
    number = tables.add(rolled)
    parts: list[str] = []
    head = 1
    for k, pattern in enumerate(rolled.patterns):
        parts.append(_write_pattern(f"{name}.{k}", pattern, head, Writer({}, sincos, needs)))
        head += _FIXED + len(pattern.shared)
    return [*parts, _write_runs(name, number, head, len(rolled.patterns))]


def _write_runs(name: str, number: int, head: int, patterns: int) -> str:
    """Write the function that goes through the runs."""
    lines = [
        f"define i32 @{name}({_ARGUMENTS}) #0 {{",
        "start:",
        "  %all = load ptr, ptr @tables.integers",
        f"  %place = getelementptr i32, ptr %all, i64 {number}",
        "  %begin = load i32, ptr %place",
        "  %tables = getelementptr i32, ptr %all, i32 %begin",
        "  %count = load i32, ptr %tables",
        f"  %runs = getelementptr i32, ptr %tables, i64 {head}",
        "  %any = icmp sgt i32 %count, 0",
        "  br i1 %any, label %next, label %end",
        "next:",
        "  %k = phi i32 [ 0, %start ], [ %k.next, %done ]",
        "  %sum = phi double [ 0.0, %start ], [ %sum.next, %done ]",
        "  %at = mul i32 %k, 3",
        "  %run = getelementptr i32, ptr %runs, i32 %at",
        "  %pattern = load i32, ptr %run",
        "  %first.place = getelementptr i32, ptr %run, i64 1",
        "  %first = load i32, ptr %first.place",
        "  %cells.place = getelementptr i32, ptr %run, i64 2",
        "  %cells = load i32, ptr %cells.place",
        "  switch i32 %pattern, label %end [",
        *(f"    i32 {k}, label %pattern.{k}" for k in range(patterns)),
        "  ]",
    ]
    passed = f"{_PASSED}, ptr %tables, i32 %first, i32 %cells"
    for k in range(patterns):
        lines += [
            f"pattern.{k}:",
            f"  %c{k} = call double @{name}.{k}({passed})",
            "  br label %done",
        ]
    choices = ", ".join(f"[ %c{k}, %pattern.{k} ]" for k in range(patterns))
    if patterns:
        lines += ["done:", f"  %checked = phi double {choices}"]
    else:
        lines += ["done:", "  %checked = fadd double 0.0, 0.0"]
    lines += [
        "  %sum.next = fadd double %sum, %checked",
        "  %k.next = add i32 %k, 1",
        "  %more = icmp slt i32 %k.next, %count",
        "  br i1 %more, label %next, label %end",
        "end:",
        "  %total = phi double [ 0.0, %start ], [ %sum, %next ], [ %sum.next, %done ]",
        "  %nothing = fsub double %total, %total",
        "  %undefined = fcmp une double %nothing, 0.0",
        "  %code = zext i1 %undefined to i32",
        "  ret i32 %code",
        "}",
    ]
    return "\n".join(lines)


def _write_pattern(name: str, pattern: Pattern, head: int, writer: Writer) -> str:
    """Write the loop over cells of one pattern."""
    width = pattern.table.shape[1]
    solver = Solver({})
    checked = [k for k, outcome in enumerate(pattern.outcomes) if outcome.targets]
    shared = _write_shared(pattern, head, writer)
    before, writer.lines = writer.lines, []
    for leaf in pattern.leaves:
        if leaf.column >= 0:
            position = _position(writer, leaf.column)
            writer.values[leaf.node.index] = _read(writer, leaf, position)
    for unit in pattern.units:
        write_unit(writer, solver, unit)
    sums: list[tuple[int, str]] = []
    for k, outcome in enumerate(pattern.outcomes):
        value = writer.value(outcome.node)
        if outcome.slot >= 0:
            place = writer.put(f"getelementptr double, ptr %cell, i64 {outcome.slot}")
            writer.lines.append(f"  store double {value}, ptr {place}")
        for pointer, column in outcome.targets:
            writer.pointers.add(pointer)
            place = writer.put(f"getelementptr double, ptr %{pointer}, i32 {_position(writer, column)}")
            writer.lines.append(f"  store double {value}, ptr {place}")
        if k in checked:
            sums.append((k, writer.put(f"fadd double %sum.{k}, {value}")))
    total = "0.0"
    after: list[str] = []
    for n, (_, value) in enumerate(sums):
        after.append(f"  %total.{n} = fadd double {total}, {value}")
        total = f"%total.{n}"
    lines = [
        f"define internal double @{name}({_ARGUMENTS}, ptr noalias readonly %tables, i32 %first, i32 %cells) #0 {{",
        "start:",
        *opening(writer),
        *shared,
        *before,
        "  br label %next",
        "next:",
        "  %i = phi i32 [ %first, %start ], [ %i.next, %next ]",
        *(f"  %sum.{k} = phi double [ 0.0, %start ], [ {value}, %next ]" for k, value in sums),
        f"  %row.at = mul i32 %i, {width}",
        "  %row = getelementptr i32, ptr %rows, i32 %row.at",
        f"  %cell.at = mul i32 %i, {pattern.handed}",
        "  %cell = getelementptr double, ptr %handed, i32 %cell.at",
        *writer.lines,
        "  %i.next = add i32 %i, 1",
        "  %more = icmp slt i32 %i.next, %end",
        "  br i1 %more, label %next, label %done",
        "done:",
        *after,
        f"  ret double {total}",
        "}",
    ]
    return "\n".join(lines)


def _write_shared(pattern: Pattern, head: int, writer: Writer) -> list[str]:
    """Write what is done before the loop: where the tables are, and values that all cells share."""
    lines = [
        "  %end = add i32 %first, %cells",
        f"  %head = getelementptr i32, ptr %tables, i64 {head}",
        "  %rows.at = load i32, ptr %head",
        "  %rows = getelementptr i32, ptr %tables, i32 %rows.at",
        "  %base.place = getelementptr i32, ptr %head, i64 2",
        "  %base = load i32, ptr %base.place",
        "  %handed = getelementptr double, ptr %scratch, i32 %base",
    ]
    if any(leaf.pointer == CONSTANTS and leaf.column >= 0 for leaf in pattern.leaves):
        lines += [
            "  %constants.all = load ptr, ptr @tables.constants",
            "  %constants.place = getelementptr i32, ptr %head, i64 1",
            "  %constants.at = load i32, ptr %constants.place",
            f"  %{CONSTANTS} = getelementptr double, ptr %constants.all, i32 %constants.at",
        ]
    for leaf in pattern.leaves:
        if leaf.column < 0 and leaf.uniform >= 0:
            place = writer.put(f"getelementptr i32, ptr %head, i64 {_FIXED + leaf.uniform}")
            position = writer.put(f"load i32, ptr {place}")
            writer.values[leaf.node.index] = _read(writer, leaf, position)
    return lines


def _position(writer: Writer, column: int) -> str:
    """Read a position from the cell's row."""
    place = writer.put(f"getelementptr i32, ptr %row, i64 {column}")
    return writer.put(f"load i32, ptr {place}, !invariant.load !0")


def _read(writer: Writer, leaf: Leaf, position: str) -> str:
    """Read a value at a position."""
    if leaf.pointer not in (SCRATCH, CONSTANTS, "derived"):
        writer.pointers.add(leaf.pointer)
    place = writer.put(f"getelementptr double, ptr %{leaf.pointer}, i32 {position}")
    fixed = "" if leaf.pointer == SCRATCH else ", !invariant.load !0"
    return writer.put(f"load double, ptr {place}{fixed}")
