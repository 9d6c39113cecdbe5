"""Which component libraries are installed, read where packages declare it, and what belongs to them.

`importlib.metadata` knows every way in which packages can be installed, but to import it and to have it look through
all of them takes longer than a short run. So the files that nearly every installation has are read directly first.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator

__all__ = ["GROUP", "all_libraries", "declared_libraries", "installed_libraries", "is_within"]

GROUP = "atwood.libraries"
"""The entry point group in which component libraries make themselves known."""


def declared_libraries() -> Iterator[str]:
    """Yield the modules of libraries that are declared in files on the import path; there may be others."""
    for folder in sys.path:
        try:
            names = os.listdir(folder or os.curdir)
        except OSError:  # not a folder
            continue
        for name in names:
            if name.endswith((".dist-info", ".egg-info")):
                try:
                    with open(os.path.join(folder, name, "entry_points.txt"), encoding="utf-8") as file:
                        text = file.read()
                except (OSError, UnicodeDecodeError):
                    continue
                if GROUP in text:
                    yield from _entries(text)


def _entries(text: str) -> Iterator[str]:
    """Yield the values of the group's entries."""
    section = ""
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("[") and stripped.endswith("]"):
            section = stripped[1:-1].strip()
        elif section == GROUP and "=" in stripped and not stripped.startswith(("#", ";")):
            yield stripped.partition("=")[2].strip()


def all_libraries() -> list[str]:
    """Return the modules of all libraries that are installed in any way."""
    from importlib.metadata import entry_points

    return [entry.value for entry in entry_points(group=GROUP)]


def installed_libraries() -> tuple[str, ...]:
    """Return the modules of all libraries, however they are declared."""
    return *declared_libraries(), *all_libraries()


def is_within(module: str, packages: Iterable[str]) -> bool:
    """Return whether a module is one of some packages, or in one of them and no command of it."""
    is_command = module.endswith(".__main__")
    return any(module == one or (module.startswith(f"{one}.") and not is_command) for one in packages)
