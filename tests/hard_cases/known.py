"""Known values of problems of the literature, and how far a run is from them.

`known.json` has figures alone, by problem, case, time (s) and quantity, in SI units, as doubles; more digits are
trusted than a double holds, except where a case says so. They come from closed forms evaluated with many digits, or
from two independent solutions with them; the cases name their sources.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from atwood import Result

Found = Callable[[Result], NDArray[np.float64]]
"""Reads a quantity from a run: an array over the outputs, or one with a column for each component."""


@cache
def _all() -> dict[str, dict[str, dict[str, dict[str, float | list[float]]]]]:
    return json.loads(Path(__file__).with_name("known.json").read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def known(problem: str, case: str, until: float = np.inf) -> dict[float, dict[str, float | list[float]]]:
    """Return the known values at each time, up to one."""
    return {float(t): values for t, values in _all()[problem][case].items() if float(t) <= until}


def times(problem: str, case: str, until: float = np.inf) -> list[float]:
    """Return the times at which values are known, s."""
    return list(known(problem, case, until))


def path(name: str, factor: float = 1.0, offset: float = 0.0) -> Found:
    """Return what reads a quantity, times a factor and added to an offset."""
    return lambda result: factor * np.asarray(result[name]) + offset


def vector(name: str, axes: str = "xyz") -> Found:
    """Return what reads the components of a vector."""
    return lambda result: np.stack([np.asarray(result[f"{name}.{axis}"]) for axis in axes], axis=-1)


def distance(
    problem: str, case: str, quantities: Mapping[str, Found], until: float = np.inf, scale: float = 1.0
) -> Callable[[Result], float]:
    """Return the largest distance of quantities from their known values, over a scale.

    A quantity whose largest known value is above one is compared as a share of that. The outputs of the run are to be
    the times of the values.
    """
    values = known(problem, case, until)

    def error(result: Result) -> float:
        if not np.array_equal(result.time, list(values)):
            return np.inf
        expected = {name: np.array([row[name] for row in values.values()]) for name in quantities}
        sizes = {name: max(1.0, float(np.max(np.abs(value)))) for name, value in expected.items()}
        apart = {name: np.max(np.abs(found(result) - expected[name])) for name, found in quantities.items()}
        return max(float(value) / sizes[name] for name, value in apart.items()) / scale

    return error
