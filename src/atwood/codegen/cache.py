"""Compiled code on disk, kept between runs and shared by processes.

Entries are named by a hash of everything that their content depends on, so that a wrong entry is never found rather
than recognised.  What is damaged, cut off, or belongs to somebody else is passed over.  Nothing that goes wrong on
the disk is an error: then there is no cache.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from atwood.lazy_dataclasses import dataclass

_MAGIC = b"atwood cache 1\n"
_SUFFIX = ".kernel"
_CHECKSUM = 32
_LARGEST = 512 * 2**20
_LOOKED_AFTER = ("00", "40", "80", "c0")
"""Room is made when an entry is written whose name begins so, one of 64: all entries are looked at for that, which
takes .16 s where there are 40,000."""


def make_key(parts: Iterable[object]) -> str:
    """Return the name of an entry from everything that its content depends on."""
    return hashlib.sha256("\n".join(repr(part) for part in parts).encode()).hexdigest()


def cache_directory() -> Path:
    """Return where compiled code is kept.

    That is ``ATWOOD_CACHE_DIR`` if it is set, and otherwise what the system has for caches: ``LOCALAPPDATA`` on
    Windows, ``~/Library/Caches`` on macOS, and ``XDG_CACHE_HOME`` or ``~/.cache`` elsewhere.
    """
    chosen = os.environ.get("ATWOOD_CACHE_DIR")
    if chosen:
        return Path(chosen).expanduser()
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return (Path(local) if local else Path.home() / "AppData" / "Local") / "atwood" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "atwood"
    shared = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(shared) if os.path.isabs(shared) else Path.home() / ".cache") / "atwood"


def default_cache() -> Cache | None:
    """Return the user's cache, or None if ``ATWOOD_CACHE=0`` says that there is none."""
    if os.environ.get("ATWOOD_CACHE", "").strip().lower() in ("0", "no", "off", "false"):
        return None
    try:
        return Cache(cache_directory())
    except RuntimeError:  # nobody's home
        return None


@dataclass(frozen=True)
class Cache:
    """A directory of entries.

    Attributes
    ----------
    directory
        Where they lie; it is made when the first is written.
    limit
        The number of bytes that all entries together may take, but for some 64 that were written last.  What was
        not used for longest goes first.
    """

    directory: Path
    limit: int = _LARGEST

    def read(self, key: str) -> bytes | None:
        """Return the content of an entry, or None if there is none that is whole."""
        path = self._path(key)
        try:
            with open(path, "rb", opener=_without_waiting) as file:
                if not _is_own(os.fstat(file.fileno())):
                    return None
                data = file.read()
        except OSError:
            return None
        start = len(_MAGIC) + _CHECKSUM
        content = data[start:]
        if data[:start] != _MAGIC + _checksum(key, content):
            return None
        with contextlib.suppress(OSError):
            os.utime(path)
        return content

    def has(self, key: str) -> bool:
        """Return whether there is an entry, whole or not."""
        return self._path(key).exists()

    def write(self, key: str, content: bytes) -> bool:
        """Add an entry, and return whether that worked.

        Other processes see the whole entry or none.
        """
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(prefix=".new-", dir=self.directory)
        except OSError:
            return False
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(_MAGIC + _checksum(key, content) + content)
            os.replace(name, self._path(key))
        except OSError:
            with contextlib.suppress(OSError):
                os.unlink(name)
            return False
        if key.startswith(_LOOKED_AFTER):
            self._make_room()
        return True

    def _path(self, key: str) -> Path:
        return self.directory / f"{key}{_SUFFIX}"

    def _make_room(self) -> None:
        """Remove what was not used for longest, and what a process that was stopped has left behind."""
        found: list[tuple[float, int, str]] = []
        try:
            with os.scandir(self.directory) as entries:
                for entry in entries:
                    if entry.name.endswith(_SUFFIX) or entry.name.startswith(".new-"):
                        with contextlib.suppress(OSError):
                            about = entry.stat()
                            found.append((about.st_mtime, about.st_size, entry.path))
        except OSError:
            return
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total <= self.limit:
                return
            with contextlib.suppress(OSError):
                os.unlink(path)
            total -= size


def _checksum(key: str, content: bytes) -> bytes:
    return hashlib.sha256(key.encode() + content).digest()


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe does not wait for who would write to it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _is_own(about: os.stat_result) -> bool:
    """Return whether it is a file of usual size of who runs this; the code in it is going to run."""
    if not stat.S_ISREG(about.st_mode) or about.st_size > _LARGEST:
        return False
    return sys.platform == "win32" or about.st_uid in (os.getuid(), 0)
