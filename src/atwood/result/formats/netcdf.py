"""NetCDF-3 with the attributes of the CF conventions, as xarray, MATLAB, Julia and ncdump read it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.lazy_modules import scipy
from atwood.result.formats.dataset import Dataset, Variable, json_text, unique_name


def write_netcdf(data: Dataset, file: Path, checksum: str) -> None:
    """Write arrays; text becomes arrays of characters."""
    taken: set[str] = set()
    names = {one.path: _name(one.path, taken) for one in data.variables}
    dimensions = {name: names.get(name, name) for name in data.sizes}
    beside = [one for one in data.variables if one.is_coordinate and one.dimensions != (one.path,)]
    to: Any
    with scipy.io.netcdf_file(str(file), "w", version=2) as to:
        to.title, to.Conventions = data.title.encode(), b"CF-1.11"
        to.atwood, to.checksum = json_text(data.about).encode(), checksum.encode()
        for name, size in data.sizes.items():
            to.createDimension(dimensions[name], size)
        for one in data.variables:
            variable = _created(to, names[one.path], [dimensions[name] for name in one.dimensions], one.values)
            variable.path = one.path.encode()
            if one.unit:
                variable.units = one.unit.encode()
            if one.meaning:
                variable.long_name = one.meaning.encode()
            along = [names[other.path] for other in beside if set(other.dimensions) <= set(one.dimensions)]
            if along and not one.is_coordinate:
                variable.coordinates = " ".join(along).encode()


def _created(to: Any, name: str, dimensions: list[str], values: NDArray[Any]) -> Any:
    if values.dtype.kind == "U":
        letters = np.char.encode(values, "utf-8")
        width = max(letters.dtype.itemsize, 1)
        letters = letters.astype(f"S{width}")
        along = f"characters_{width}"
        if along not in to.dimensions:
            to.createDimension(along, width)
        variable = to.createVariable(name, "c", (*dimensions, along))
        variable[:] = letters.view("S1").reshape(*values.shape, width)
        variable._Encoding = b"utf-8"
        return variable
    kind = "i" if values.dtype.kind == "i" and np.all(np.abs(values) < 2**31) else "d"
    variable = to.createVariable(name, kind, tuple(dimensions))
    variable[:] = values
    return variable


def _name(path: str, taken: set[str]) -> str:
    """Return a name that NetCDF and its readers take, for instance ``rod_0.angle`` for ``rod[0].angle``."""
    return unique_name(re.sub(r"[^A-Za-z0-9_.]", "_", path.replace("]", "")), taken)


def read_netcdf(file: Path) -> tuple[Dataset, str | None]:
    """Return arrays that were written, and their checksum; files of old versions have none."""
    source: Any
    with scipy.io.netcdf_file(str(file), "r", mmap=False) as source:
        about = json.loads(source.atwood.decode())
        checksum = source.checksum.decode() if hasattr(source, "checksum") else None
        paths = {name: one.path.decode() for name, one in source.variables.items()}
        beside = {name for one in source.variables.values() for name in _text(one, "coordinates").split()}
        found = []
        for name, one in source.variables.items():
            dimensions, values = tuple(one.dimensions), np.array(one[:])
            if one.typecode() == "c":
                dimensions, values = dimensions[:-1], _words(values)
            elif one.typecode() == "i":
                values = values.astype(np.int64)
            else:
                values = values.astype(np.float64)
            along = tuple(paths.get(dimension, dimension) for dimension in dimensions)
            is_coordinate = name in beside or along == (paths[name],)
            found.append(
                Variable(paths[name], along, values, _text(one, "units"), _text(one, "long_name"), is_coordinate)
            )
        return Dataset(_text(source, "title"), tuple(found), about), checksum


def _text(of: Any, name: str) -> str:
    found: str = getattr(of, name, b"").decode()
    return found


def _words(letters: NDArray[Any]) -> NDArray[Any]:
    """Return text from an array of characters, whose last dimension goes along each text."""
    rows = np.ascontiguousarray(letters).reshape(-1, letters.shape[-1])
    words = [b"".join(row.tolist()).rstrip(b"\0").decode("utf-8") for row in rows]
    return np.array(words, dtype=np.str_).reshape(letters.shape[:-1])
