"""Arrays with names, units and dimensions, whatever format they go to, and tables of pandas and xarray made of them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.display import plain
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import needed


@dataclass(frozen=True, eq=False)
class Variable:
    """One array.

    Attributes
    ----------
    path
        Its name: the path of a quantity, or a word such as ``"time"``.
    dimensions
        Names of the dimensions; the variable that has the name of its only dimension says where along it values are.
    values
        Numbers, or text.
    unit, meaning
        SI unit, and one line of meaning; empty for text.
    is_coordinate
        Whether it says where other values belong, as what was varied does.
    """

    path: str
    dimensions: tuple[str, ...]
    values: NDArray[Any]
    unit: str = ""
    meaning: str = ""
    is_coordinate: bool = False


@dataclass(frozen=True, eq=False)
class Dataset:
    """Arrays that belong together.

    Attributes
    ----------
    title
        What it is, in words.
    variables
        The arrays; each path is there once.
    about
        What else is known, as plain data.
    """

    title: str
    variables: tuple[Variable, ...]
    about: Mapping[str, Any]

    @property
    def sizes(self) -> dict[str, int]:
        """The length of each dimension."""
        pairs = (zip(one.dimensions, one.values.shape, strict=True) for one in self.variables)
        return {name: size for pair in pairs for name, size in pair}

    def by_path(self) -> dict[str, Variable]:
        """Return the arrays by path."""
        return {one.path: one for one in self.variables}

    def checksum(self) -> str:
        """Return the SHA-256 of all that it holds, which does not depend on the format."""
        ordered = sorted(self.variables, key=lambda one: one.path)  # some formats keep them in an order of their own
        heads = [(one.path, one.dimensions, one.unit, one.meaning, one.values.shape) for one in ordered]
        found = hashlib.sha256(json.dumps([heads, json.loads(json_text(self.about))], sort_keys=True).encode())
        for one in ordered:
            if one.values.dtype.kind == "U":
                found.update(json.dumps(one.values.tolist()).encode())
            else:
                found.update(np.ascontiguousarray(one.values, dtype="<f8").tobytes())
        return found.hexdigest()

    def verified(self, checksum: str | None) -> Dataset:
        """Return it, if it is what was saved."""
        if checksum != self.checksum():
            raise ValueError("its checksum is that of other contents")
        return self


def unique_name(name: str, taken: set[str]) -> str:
    """Return a name that is not taken yet, with a number behind it if it must be, and take it."""
    found, count = name, 1
    while found in taken:
        count += 1
        found = f"{name}_{count}"
    taken.add(found)
    return found


def json_text(data: Mapping[str, Any]) -> str:
    """Return plain data as JSON; numbers and arrays of numpy are numbers and lists."""
    return json.dumps(data, default=plain)


def of_tables(name: str) -> Any:
    """Return pandas or xarray."""
    return needed(name, "'atwood[data]'", f"tables need {name}, which", name)


def to_xarray(data: Dataset) -> Any:
    """Return arrays as an `xarray.Dataset`, with units and meanings as the attributes of the CF conventions."""
    xarray = of_tables("xarray")
    every = {one.path: (one.dimensions, one.values, _attributes(one)) for one in data.variables}
    coordinates = {one.path: every.pop(one.path) for one in data.variables if one.is_coordinate}
    plain = {key: value for key, value in data.about.items() if isinstance(value, (str, int, float))}
    return xarray.Dataset(every, coordinates, {"title": data.title, "Conventions": "CF-1.11", **plain})


def _attributes(one: Variable) -> dict[str, str]:
    """Return the attributes of an array."""
    every = {"units": one.unit, "long_name": one.meaning, "path": one.path}
    return {name: text for name, text in every.items() if text}
