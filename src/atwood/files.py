"""Files: where one may be written, and how it appears whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from atwood.errors import UsageError

T = TypeVar("T")


def by_suffix(target: Path, known: Mapping[str, T], advice: str = "") -> T:
    """Return what a suffix stands for; refuse a file whose suffix stands for nothing."""
    suffix = target.suffix.lower()
    if suffix not in known:
        problem = f"the suffix {target.suffix!r} is not known" if suffix else "the name has no suffix"
        raise UsageError(problem, where=str(target), advice=advice or f"Use {' or '.join(known)}.")
    return known[suffix]


def check_target(target: Path, suffixes: Iterable[str], advice: str = "") -> None:
    """Refuse a file with another suffix, or in a directory that does not exist."""
    by_suffix(target, dict.fromkeys(suffixes), advice)
    check_directory(target)


def check_directory(target: Path) -> None:
    """Refuse a file in a directory that does not exist."""
    try:
        if not target.parent.is_dir():
            raise UsageError("there is no such directory", where=str(target.parent), advice="Make it first.")
        _refuse_others(target)
    except (OSError, ValueError) as error:  # too long a name, a directory that is closed
        raise UsageError(f"it cannot be written ({_reason(error)})", where=str(target), advice=_ANOTHER) from None


def check_readable(source: Path) -> None:
    """Refuse a file that does not exist."""
    try:
        _refuse_others(source)
        if not source.is_file():
            raise UsageError("there is no such file", where=str(source), advice="Look at its name and directory.")
    except (OSError, ValueError) as error:
        raise UsageError(f"it cannot be read ({_reason(error)})", where=str(source), advice=_ANOTHER) from None


def _refuse_others(file: Path) -> None:
    if file.is_dir():
        raise UsageError("this is a directory", where=str(file), advice="Give the name of a file.")
    if file.exists() and not file.is_file():
        raise UsageError("this is a pipe or a device and no file", where=str(file), advice=_ANOTHER)


def read_checked(source: Path, read: Callable[[Path], T], what: str, advice: str) -> T:
    """Read a file that Atwood saved."""
    check_readable(source)
    try:
        return read(source)
    except UsageError:
        raise
    except Exception as error:  # of a damaged file, its readers raise whatever comes
        raise UsageError(
            f"this is no {what} that Atwood saved, or it is damaged ({type(error).__name__}: {error})",
            where=str(source),
            advice=advice,
        ) from error


def write_atomically(target: Path, write: Callable[[Path], object]) -> None:
    """Write a file next to its place and move it there once it is complete.

    Whoever is stopped in between leaves what was there before. It is written in a directory that nobody else can write
    to, under a name that nobody can foresee; so of several who write one file at once the last one stays, whole. A file
    that was there before gives it its permissions. A link is replaced by the file, and what it leads to stays.
    """
    check_directory(target)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{target.stem[:50]}.", suffix=".part", dir=target.parent) as room:
            part = Path(room, f"part{target.suffix}")
            write(part)
            if target.is_file() and not target.is_symlink():
                shutil.copymode(target, part)
            os.replace(part, target)
    except OSError as error:
        raise UsageError(f"it cannot be written ({_reason(error)})", where=str(target), advice=_ANOTHER) from error


_ANOTHER = "Give another name or directory."


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)
