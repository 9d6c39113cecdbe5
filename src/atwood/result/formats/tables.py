"""Runs and sweeps as tables of pandas and as datasets of xarray, which are optional."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from atwood.errors import UsageError
from atwood.result.formats.dataset import Dataset, Variable

__all__ = ["needed", "to_xarray"]


def needed(name: str) -> Any:
    """Return a module that is optional.

    Parameters
    ----------
    name
        ``"pandas"`` or ``"xarray"``.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        advice = "pip install 'atwood[data]'"
        raise UsageError(f"tables need {name}, which is not installed", where=name, advice=advice) from error


def to_xarray(data: Dataset) -> Any:
    """Return arrays as an `xarray.Dataset`, with units and meanings as the attributes of the CF conventions.

    Parameters
    ----------
    data
        The arrays.
    """
    xarray = needed("xarray")
    every = {one.path: (one.dimensions, one.values, _attributes(one)) for one in data.variables}
    coordinates = {one.path: every.pop(one.path) for one in data.variables if one.is_coordinate}
    plain = {key: value for key, value in data.about.items() if isinstance(value, (str, int, float))}
    return xarray.Dataset(every, coordinates, {"title": data.title, "Conventions": "CF-1.11", **plain})


def _attributes(one: Variable) -> dict[str, str]:
    """Return the attributes of an array."""
    every = {"units": one.unit, "long_name": one.meaning, "path": one.path}
    return {name: text for name, text in every.items() if text}
