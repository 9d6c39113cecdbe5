"""NumPy's ``.npz``: an array for each name, and what else is known as text in JSON.

Files of compressed arrays that unpack to far more than any run gives are refused before they are read.
"""

from __future__ import annotations

import json
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from atwood.result.formats.dataset import Dataset, Variable, json_text, unique_name

_ABOUT = "atwood"


def write_npz(data: Dataset, file: Path, checksum: str) -> None:
    """Write arrays."""
    taken = {_ABOUT, "file", "allow_pickle"}  # which numpy takes for its own
    names = [unique_name(one.path, taken) for one in data.variables]
    heads = [
        [name, one.path, one.dimensions, one.unit, one.meaning, one.is_coordinate]
        for name, one in zip(names, data.variables, strict=True)
    ]
    about = {"title": data.title, "checksum": checksum, "variables": heads, "about": data.about}
    arrays: dict[str, Any] = {name: one.values for name, one in zip(names, data.variables, strict=True)}
    with file.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays, **{_ABOUT: np.array(json_text(about))})


def read_npz(file: Path) -> tuple[Dataset, str]:
    """Return arrays that were written, and their checksum."""
    check_unpacked(file)
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as found:  # a damaged file is closed, too
        about = json.loads(str(found[_ABOUT]))
        heads = about["variables"]
        variables = (
            Variable(path, tuple(dimensions), found[name], unit, meaning, is_coordinate)
            for name, path, dimensions, unit, meaning, is_coordinate in heads
        )
        return Dataset(about["title"], tuple(variables), about["about"]), about["checksum"]


_MOST, _RATIO = 2**30, 100
"""Bytes that may always be unpacked, and how many times its own size more a file may hold."""

_COMPRESSED = 15
"""Kind of a compressed element of MATLAB's format (MAT-File Format, version 5)."""


def check_unpacked(file: Path) -> None:
    """Refuse a file in NumPy's or MATLAB's format that holds too much."""
    packed, total = file.stat().st_size, 0
    if 1032 * packed < _MOST:  # no byte stands for more than 1032
        return
    most = max(_MOST, _RATIO * packed)
    if file.suffix.lower() == ".npz":
        with zipfile.ZipFile(file) as entries:
            total = sum(entry.file_size for entry in entries.infolist())
    else:
        with file.open("rb") as stream:
            stream.seek(128)
            while len(head := stream.read(8)) == 8 and total <= most:
                kind, size = struct.unpack("<II", head)
                rest, unpacker = stream.read(size), zlib.decompressobj()
                while kind == _COMPRESSED and rest and total <= most and not unpacker.eof:
                    total += len(unpacker.decompress(rest, 2**20))
                    rest = unpacker.unconsumed_tail
    if total > most:
        raise ValueError(f"it unpacks to more than {most / 2**30:g} GB")
