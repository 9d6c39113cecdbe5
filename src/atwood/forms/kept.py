"""What is made once from a frozen value, and kept with it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Key(Generic[T]):
    """Under which something of one type is kept; no two keys are equal.

    Parameters
    ----------
    name
        What it is, in words.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return f"<{self.name}>"


class Kept:
    """What was made from one value. It is not part of the value, and is made again for a copy."""

    def __init__(self) -> None:
        self._made: dict[Hashable, Any] = {}

    def get(self, key: Key[T], make: Callable[[], T], *about: Hashable) -> T:
        """Return what was made under a key, making it if it is not there."""
        known = self._made.get(key)
        if known is not None and known[0] == about:
            found: T = known[1]
            return found
        made = make()
        self._made[key] = about, made
        return made
