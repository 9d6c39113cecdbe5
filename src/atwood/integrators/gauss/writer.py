"""Writes functions in LLVM's language: instructions with names for their values, and loops."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Code"]


class Code:
    """A function that is being written.

    Parameters
    ----------
    head
        What it returns, its name and its arguments.
    """

    def __init__(self, head: str) -> None:
        self.lines = [f"define {head} #0 {{", "entry:"]
        self.label, self._count = "entry", 0

    def fresh(self) -> int:
        """Return a number that no name has yet."""
        self._count += 1
        return self._count

    def put(self, text: str) -> str:
        """Add an instruction; return the name of its value."""
        name = f"%v{self.fresh()}"
        self.lines.append(f"  {name} = {text}")
        return name

    def do(self, text: str) -> None:
        """Add an instruction without a value."""
        self.lines.append(f"  {text}")

    def block(self, label: str) -> None:
        """Begin a basic block."""
        self.lines.append(f"{label}:")
        self.label = label

    def at(self, base: str, index: int | str, offset: int = 0) -> str:
        """Return the address of a number in an array."""
        if offset and isinstance(index, str):
            index = self.put(f"add i64 {index}, {offset}")
        elif isinstance(index, int):
            index += offset
        return self.put(f"getelementptr double, ptr {base}, i64 {index}")

    def load(self, base: str, index: int | str, offset: int = 0) -> str:
        """Load a number of an array."""
        return self.put(f"load double, ptr {self.at(base, index, offset)}")

    def store(self, value: str, base: str, index: int | str, offset: int = 0) -> None:
        """Store a number into an array."""
        self.do(f"store double {value}, ptr {self.at(base, index, offset)}")

    def count_up(self, place: int) -> None:
        """Raise a count of the session."""
        at = self.at("%mem", place)
        raised = self.put(f"add i64 {self.put(f'load i64, ptr {at}')}, 1")
        self.do(f"store i64 {raised}, ptr {at}")

    def loop(self, count: int, body: Callable[[str], None]) -> None:
        """Add a loop over an index."""
        k, before = self.fresh(), self.label
        index, following, end = f"%i{k}", f"%n{k}", f"end{k}"
        self.do(f"br label %head{k}")
        self.block(f"head{k}")
        self.do(f"{index} = phi i64 [ 0, %{before} ], [ {following}, %body{k}.last ]")
        more = self.put(f"icmp slt i64 {index}, {count}")
        self.do(f"br i1 {more}, label %body{k}, label %{end}")
        self.block(f"body{k}")
        body(index)
        self.do(f"br label %body{k}.last")
        self.block(f"body{k}.last")
        self.do(f"{following} = add i64 {index}, 1")
        self.do(f"br label %head{k}")
        self.block(end)

    def leave_if(self, condition: str, value: int) -> None:
        """Return a code where a condition holds."""
        k = self.fresh()
        self.do(f"br i1 {condition}, label %leave{k}, label %stay{k}")
        self.block(f"leave{k}")
        self.do(f"ret i32 {value}")
        self.block(f"stay{k}")

    def larger(self, a: str, b: str) -> str:
        """Return the larger of two numbers."""
        return self.put(f"select i1 {self.put(f'fcmp ogt double {a}, {b}')}, double {a}, double {b}")

    def text(self, end: str = "ret i32 0") -> str:
        """Return the whole function, with its last instruction."""
        return "\n".join([*self.lines, f"  {end}", "}"])
