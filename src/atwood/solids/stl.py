"""Reading triangles from STL files, ASCII and binary.

Format: 3D Systems, *StereoLithography Interface Specification* (1989). The normals in the file are ignored: the order
of the corners says which way a triangle faces.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from atwood.arguments import FILE, takes
from atwood.arrays import FloatArray
from atwood.errors import ParameterError, UsageError
from atwood.files import check_readable

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

_VERTEX = re.compile(r"^\s*vertex\s+(.*?)\s*$", re.IGNORECASE | re.MULTILINE)
_FACET = re.compile(r"^\s*facet\b", re.IGNORECASE | re.MULTILINE)
_END = re.compile(r"^\s*endsolid\b", re.IGNORECASE | re.MULTILINE)


@takes(ParameterError, path=FILE)
def read_stl(path: str | Path) -> FloatArray:
    """Read the triangles of an STL file.

    Parameters
    ----------
    path
        The file, ASCII or binary; which one is found out.

    Returns
    -------
    ndarray, shape (m, 3, 3)
        Triangle, corner, coordinate, in the unit of the file.

    Raises
    ------
    ParameterError
        If the file cannot be read, is cut short, or is no STL file.
    """
    where = str(path)
    try:
        check_readable(Path(path))
        data = Path(path).read_bytes()
    except UsageError as error:
        raise ParameterError(f"the file cannot be read: {error.message}", where=where, advice=error.advice) from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError(f"the file cannot be read: {reason}", where=where, advice="Check its path.") from error
    # Binary files may begin with the word "solid" as well, so the length decides where it fits exactly.
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else -1
    if count >= 0 and len(data) == _HEADER + count * _RECORD.itemsize:
        return _binary(data, count)
    text = data.decode("utf-8", errors="replace")
    if text.lstrip().lower().startswith("solid") and _looks_like_text(data):
        return _ascii(text, where)
    if count >= 0 and len(data) > _HEADER + count * _RECORD.itemsize and count > 0:
        # Some programs append data of their own behind the triangles.
        return _binary(data, count)
    if count > 0 and not _looks_like_text(data):
        raise ParameterError(
            f"the file is cut short: it says {count} triangles and holds {(len(data) - _HEADER) // _RECORD.itemsize}",
            where=where,
            advice="Export or copy it again.",
        )
    raise ParameterError("this is no STL file", where=where, advice="Give an ASCII or a binary STL file.")


def _binary(data: bytes, count: int) -> FloatArray:
    """Return the triangles of a binary file."""
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=_HEADER)
    return records["corners"].astype(np.float64)


def _looks_like_text(data: bytes) -> bool:
    """Return whether the beginning of a file holds no zero bytes."""
    return b"\0" not in data[:4096]


def _ascii(text: str, where: str) -> FloatArray:
    """Return the triangles of an ASCII file."""
    if not _END.search(text):
        raise ParameterError(
            "the file is cut short: its solid has no end", where=where, advice="Export or copy it again."
        )
    lines = _VERTEX.findall(text)
    facets = len(_FACET.findall(text))
    if len(lines) != 3 * facets:
        raise ParameterError(
            f"the file has {facets} facets but {len(lines)} corners", where=where, advice="A facet has three corners."
        )
    try:
        corners = np.array([[float(word) for word in line.split()] for line in lines], dtype=float)
    except ValueError:
        corners = np.empty(0)
    if corners.size != 9 * facets or (facets and corners.shape[1:] != (3,)):
        bad = next(line for line in lines if not _is_point(line))
        raise ParameterError(f"a corner is written 'vertex {bad}'", where=where, advice="A corner has three numbers.")
    return corners.reshape(-1, 3, 3)


def _is_point(line: str) -> bool:
    """Return whether a line holds three numbers."""
    try:
        return len([float(word) for word in line.split()]) == 3
    except ValueError:
        return False
