"""Kinds of values of a routine: numbers, integers, conditions, lanes of numbers and addresses."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from atwood.lazy_dataclasses import dataclass


class Scalar(NamedTuple):
    """A kind of one value.

    Attributes
    ----------
    name
        Its name in messages.
    is_float
        Whether its arithmetic is that of floating-point numbers.
    """

    name: str
    is_float: bool = False


@dataclass(frozen=True)
class Lanes:
    """Several neighbouring numbers, or conditions on them, on which an operation works at once.

    Attributes
    ----------
    count
        Their number.
    is_float
        False for conditions, one for each lane.
    """

    count: int
    is_float: bool = True

    @property
    def name(self) -> str:
        """What messages call them."""
        return f"{self.count} lanes of {'numbers' if self.is_float else 'conditions'}"


Kind: TypeAlias = Scalar | Lanes

NUMBER = Scalar("number", is_float=True)
"""A double."""

INTEGER = Scalar("integer")
"""An integer of 64 bits, with sign."""

CODE = Scalar("code")
"""An integer of 32 bits: what a function returns, zero where all went well, or an element of a list of such."""

BOOLEAN = Scalar("condition")
"""True or false."""

ADDRESS = Scalar("address")
"""Where numbers, integers or addresses of 8 bytes each lie, or a function."""
