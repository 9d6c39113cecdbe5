"""A sound call of a public function, of which one argument is then spoilt."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Call:
    """A function with sound arguments.

    Attributes
    ----------
    name
        What it is called.
    function
        The function.
    good
        Sound arguments; a text that begins with ``@`` is a file in a directory of the call's own.
    kinds
        Kind of each argument that is tried.
    also
        Further bad values of an argument.
    said_as
        Other words by which an error may name an argument.
    has_names
        Whether it takes arguments by name, of which one may be wrong.
    """

    name: str
    function: Callable[..., Any]
    good: Mapping[str, Any]
    kinds: Mapping[str, str]
    also: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    said_as: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    has_names: bool = True

    def make(self, directory: Path, **bad: Any) -> Any:
        """Make the call with other arguments."""
        good = {name: value for name, value in self.good.items() if name not in bad}
        for name, value in good.items():
            if isinstance(value, str) and value.startswith("@"):
                good[name] = directory / value[1:]
        return self.function(**good, **bad)
