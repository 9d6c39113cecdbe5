"""Files of compressed arrays that unpack to far more than any run gives: they are refused before they are read."""

from __future__ import annotations

import struct
import zipfile
import zlib
from pathlib import Path

__all__ = ["check_unpacked"]

_MOST, _RATIO = 2**30, 100
"""Bytes that may always be unpacked, and how many times its own size more a file may hold."""

_COMPRESSED = 15
"""Kind of a compressed element of MATLAB's format (MAT-File Format, version 5)."""


def check_unpacked(file: Path) -> None:
    """Refuse a file in NumPy's or MATLAB's format that holds too much.

    Parameters
    ----------
    file
        The file.

    Raises
    ------
    ValueError
        If it does.
    """
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
