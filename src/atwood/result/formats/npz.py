"""NumPy's ``.npz``: an array for each name, and what else is known as text in JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from atwood.result.formats.dataset import Dataset, Variable, json_text, unique_name
from atwood.result.formats.packed import check_unpacked

__all__ = ["read_npz", "write_npz"]

_ABOUT = "atwood"


def write_npz(data: Dataset, file: Path, checksum: str) -> None:
    """Write arrays.

    Parameters
    ----------
    data
        The arrays.
    file
        Where to.
    checksum
        Kept beside them.
    """
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
    """Return arrays that were written, and their checksum.

    Parameters
    ----------
    file
        The file.
    """
    check_unpacked(file)
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as found:  # a damaged file is closed, too
        about = json.loads(str(found[_ABOUT]))
        heads = about["variables"]
        variables = (
            Variable(path, tuple(dimensions), found[name], unit, meaning, is_coordinate)
            for name, path, dimensions, unit, meaning, is_coordinate in heads
        )
        return Dataset(about["title"], tuple(variables), about["about"]), about["checksum"]
