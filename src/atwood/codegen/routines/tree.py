"""What a routine becomes: a tree of instructions with structured control flow, which printers read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.codegen.routines.language import Value


class Instruction(NamedTuple):
    """An operation on values; `result` is None where it has none."""

    operation: str
    result: Value | None
    arguments: tuple[Any, ...]


class Call(NamedTuple):
    """A call of a routine by its name, or of a function by its address."""

    result: Value | None
    function: str | Value
    arguments: tuple[Value, ...]


@dataclass(frozen=True, eq=False)
class Branch:
    """What is done where a condition holds, and what otherwise."""

    condition: Value
    then: Block
    otherwise: Block


@dataclass(frozen=True, eq=False)
class Loop:
    """What is done again and again until a jump leaves it."""

    number: int
    body: Block


@dataclass(frozen=True, eq=False)
class Jump:
    """To the end of a loop, or to its next turn."""

    loop: Loop
    leaves: bool


Block = list["Instruction | Call | Branch | Loop | Jump"]
