"""CSV files that any program can read, each with a file beside it that holds its checksum and what is no number.

``run.csv`` has headings and numbers and nothing else; ``run.csv.json`` has its SHA-256 and the rest. While a file is
replaced, the one beside it knows the contents before as well, so that whoever is stopped in between leaves a pair.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from atwood.files import write_atomically
from atwood.result.formats.dataset import json_text

_REPLACING = Lock()
"""Threads that save one file replace it and what is beside it one after another."""


def _beside(file: Path) -> Path:
    return file.with_name(f"{file.name}.json")


def digest(data: Any) -> str:
    """Return the SHA-256 of plain data, whatever the order of its names."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _write(file: Path, entries: list[dict[str, Any]]) -> None:
    text = json.dumps({"of": file.name, "contents": entries, "checksum": digest(entries)})
    write_atomically(_beside(file), lambda part: part.write_text(text + "\n", encoding="utf-8"))


def _read(file: Path) -> list[dict[str, Any]]:
    data = json.loads(_beside(file).read_text(encoding="utf-8"))
    if data["checksum"] != digest(data["contents"]):
        raise ValueError(f"the checksum in {_beside(file).name} is that of other contents")
    found: list[dict[str, Any]] = data["contents"]
    return found


def write_with_companion(file: Path, rows: Iterable[Iterable[object]], about: Mapping[str, Any]) -> None:
    """Write rows as a CSV file, and beside it its checksum and what else is known."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    content = text.getvalue().encode()
    entry = {"sha256": hashlib.sha256(content).hexdigest(), "about": json.loads(json_text(about))}
    with _REPLACING:
        try:
            before = _read(file)[:1] if file.is_file() else []
        except (OSError, ValueError, KeyError, TypeError):  # there was none, or it is damaged
            before = []
        _write(file, [entry, *before])
        try:
            write_atomically(file, lambda part: part.write_bytes(content))
        finally:
            if not file.exists():
                _beside(file).unlink(missing_ok=True)
        if before:
            _write(file, [entry])


def read_with_companion(file: Path) -> tuple[str, Mapping[str, Any] | None]:
    """Return the text of a CSV file and what is known besides; None where there is no file beside it."""
    plain = file.read_bytes().replace(b"\r\n", b"\n")
    if not _beside(file).exists():
        return plain.decode(), None
    found = hashlib.sha256(plain).hexdigest()
    for entry in _read(file):
        if entry["sha256"] == found:
            about: Mapping[str, Any] = entry["about"]
            return plain.decode(), about
    raise ValueError(f"it is cut off or changed: its checksum is not the one in {_beside(file).name}")
