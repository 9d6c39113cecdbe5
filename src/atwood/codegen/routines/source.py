"""Where routines are written: what names their machine code in the cache without printing them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.codegen.routines.language import Routine

_PACKAGE = Path(__file__).parents[2]


@dataclass(frozen=True)
class RoutineSource:
    """A function that writes routines, and the files on which they depend.

    Attributes
    ----------
    module
        The module with the function ``write_routines``, within the package; it is imported only to write them.
    files
        The other source files of the package that decide what it writes, without those of the language.
    arguments
        What it is called with.
    """

    module: str
    files: tuple[str, ...] = ()
    arguments: tuple[object, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """What the routines depend on."""
        return (self.module, _hash((self.module.replace(".", "/") + ".py", *self.files)), self.arguments)

    def write(self) -> Sequence[Routine]:
        """Write the routines."""
        found: Sequence[Routine] = import_module(f"atwood.{self.module}").write_routines(*self.arguments)
        return found


@cache
def _hash(files: tuple[str, ...]) -> str:
    total = sha256()
    for name in files:
        total.update((_PACKAGE / name).read_bytes())
    return total.hexdigest()
