"""Routines with loops in LLVM's language, written step by step: what straight-line code cannot express.

Indices are integers of 64 bits, numbers are doubles.  Nothing lives in memory that does not have to: what a loop
carries from turn to turn is handed on in registers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field

from atwood.late import dataclass

__all__ = ["Loop", "Routine"]


@dataclass
class Loop:
    """A loop while its body is being written.

    Attributes
    ----------
    index
        The name of the number of the turn.
    carried
        The names of what earlier turns handed on.
    following
        What this turn hands on; to be set in the body where something is carried.
    """

    index: str
    carried: tuple[str, ...]
    following: tuple[str, ...] = ()


@dataclass
class Routine:
    """The body of a function.

    Attributes
    ----------
    lines
        The instructions so far.
    """

    lines: list[str] = field(default_factory=list)
    _count: int = 0

    def put(self, instruction: str) -> str:
        """Write an instruction, and return the name of its value."""
        self._count += 1
        name = f"%r{self._count}"
        self.lines.append(f"  {name} = {instruction}")
        return name

    def do(self, instruction: str) -> None:
        """Write an instruction without a value."""
        self.lines.append(f"  {instruction}")

    def index(self, operation: str, a: str | int, b: str | int) -> str:
        """Write ``add``, ``sub`` or ``mul`` of two indices."""
        return self.put(f"{operation} i64 {a}, {b}")

    def number(self, operation: str, a: str, b: str) -> str:
        """Write ``fadd``, ``fsub``, ``fmul`` or ``fdiv`` of two numbers."""
        return self.put(f"{operation} double {a}, {b}")

    def place(self, array: str, *offsets: str | int) -> str:
        """Return the address of an element of an array of numbers or indices; offsets are added up."""
        total: str | int = offsets[0]
        for offset in offsets[1:]:
            total = self.index("add", total, offset)
        return self.put(f"getelementptr double, ptr {array}, i64 {total}")

    def load(self, array: str, *offsets: str | int) -> str:
        """Read a number."""
        return self.put(f"load double, ptr {self.place(array, *offsets)}")

    def load_index(self, array: str, *offsets: str | int) -> str:
        """Read an index."""
        return self.put(f"load i64, ptr {self.place(array, *offsets)}")

    def load_pointer(self, array: str, offset: int) -> str:
        """Read an address."""
        return self.put(f"load ptr, ptr {self.put(f'getelementptr ptr, ptr {array}, i64 {offset}')}")

    def store(self, value: str, array: str, *offsets: str | int) -> None:
        """Write a number."""
        self.do(f"store double {value}, ptr {self.place(array, *offsets)}")

    @contextmanager
    def loop(self, start: str | int, end: str | int, carried: Sequence[str] = ()) -> Iterator[Loop]:
        """Write a loop over ``start <= index < end``.

        After it, `Loop.carried` names what the last turn handed on.

        Parameters
        ----------
        start, end
            The range of the index.
        carried
            Numbers that the first turn starts with.
        """
        self._count += 1
        label = f"l{self._count}"
        names = tuple(f"%{label}.c{k}" for k in range(len(carried)))
        made = Loop(f"%{label}.i", names)
        self.lines += [f"  br label %{label}.enter", f"{label}.enter:", f"  br label %{label}", f"{label}:"]
        self.lines.append(f"  {made.index} = phi i64 [ {start}, %{label}.enter ], [ %{label}.n, %{label}.next ]")
        at = len(self.lines)
        self.lines += [f"  %{label}.m = icmp slt i64 {made.index}, {end}"]
        self.lines += [f"  br i1 %{label}.m, label %{label}.body, label %{label}.end", f"{label}.body:"]
        yield made
        if len(made.following) != len(names):
            raise ValueError("a loop must hand on as many values as it carries")
        self.lines += [f"  br label %{label}.next", f"{label}.next:", f"  %{label}.n = add i64 {made.index}, 1"]
        self.lines += [f"  br label %{label}", f"{label}.end:"]
        self.lines[at:at] = [
            f"  {name} = phi double [ {first}, %{label}.enter ], [ {later}, %{label}.next ]"
            for name, first, later in zip(names, carried, made.following, strict=True)
        ]

    @contextmanager
    def when(self, condition: str) -> Iterator[None]:
        """Write what is done only if something holds."""
        self._count += 1
        label = f"w{self._count}"
        self.lines += [f"  br i1 {condition}, label %{label}.then, label %{label}.end", f"{label}.then:"]
        yield
        self.lines += [f"  br label %{label}.end", f"{label}.end:"]

    def function(self, head: str) -> str:
        """Return the whole function, with its first line up to the brace given."""
        return "\n".join([f"{head} {{", "entry:", *self.lines, "}", ""])
