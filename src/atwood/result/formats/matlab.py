"""MATLAB's ``.mat`` (version 5): each quantity a variable of its own, such as ``rod1_angle``."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.lazy_modules import scipy
from atwood.result.formats.dataset import Dataset, Variable, json_text, unique_name
from atwood.result.formats.npz import check_unpacked

_LONGEST = 63
"""Letters of a name in MATLAB."""

_WORDS = (
    *("break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if"),
    *("otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while"),
)
"""What no variable may be called."""

_ABOUT = "atwood"


def write_matlab(data: Dataset, file: Path, checksum: str) -> None:
    """Write arrays; those of one dimension are columns, text is a cell array.

    The variable ``atwood`` is a text in JSON, for ``jsondecode``: paths, units and meanings by name, and what else is
    known.
    """
    taken = {_ABOUT, *_WORDS}
    names = [_name(one.path, taken) for one in data.variables]
    heads = [
        {
            "name": name,
            "path": one.path,
            "dimensions": list(one.dimensions),
            "shape": list(one.values.shape),
            "units": one.unit,
            "meaning": one.meaning,
            "is_coordinate": one.is_coordinate,
        }
        for name, one in zip(names, data.variables, strict=True)
    ]
    about = {"title": data.title, "checksum": checksum, "variables": heads, "about": data.about}
    arrays: dict[str, Any] = {name: _column(one.values) for name, one in zip(names, data.variables, strict=True)}
    arrays[_ABOUT] = json_text(about)
    scipy.io.savemat(str(file), arrays, appendmat=False, long_field_names=True, do_compression=True, oned_as="column")


def _name(path: str, taken: set[str]) -> str:
    name = re.sub(r"[^A-Za-z0-9]+", "_", path.replace("'", "_rate")).strip("_")
    name = name if name[:1].isalpha() else f"x{name}"
    return unique_name(name[: _LONGEST - 4], taken)


def _column(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "U":
        return values.astype(object)
    return values.astype(float)


def read_matlab(file: Path) -> tuple[Dataset, str]:
    """Return arrays that were written, and their checksum."""
    check_unpacked(file)
    found = scipy.io.loadmat(str(file), chars_as_strings=True)
    about = json.loads(str(found[_ABOUT].item()))
    variables = []
    for head in about["variables"]:
        values = found[head["name"]].reshape(head["shape"])
        if values.dtype.kind == "O":
            words = [str(one[0]) if np.size(one) else "" for one in values.ravel()]
            values = np.array(words, dtype=np.str_).reshape(values.shape)
        text = head["units"], head["meaning"]
        variables.append(Variable(head["path"], tuple(head["dimensions"]), values, *text, head["is_coordinate"]))
    return Dataset(about["title"], tuple(variables), about["about"]), about["checksum"]
