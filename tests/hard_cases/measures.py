"""How far a run is from its answer, where the answer is no table of values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from atwood import Result

ENERGY = "energy over what is exchanged"
SECOND = "by a second solution; angles in rad, lengths over the extent of the scene"


def energy(result: Result) -> float:
    """Return the drift of the energy balance, relative to what the scene exchanges."""
    return float(result.energy.max_drift)


def estimated(result: Result) -> float:
    """Return the error by a second solution."""
    return float(result.accuracy.reached)


def open_loops(result: Result) -> float:
    """Return by how much the loops are open, relative to the extent of the scene."""
    return float(result.constraint_max["position"])


def closed_form(path: str) -> Callable[[Result], float]:
    """Return the largest distance of a quantity from the scene's closed form."""

    def error(result: Result) -> float:
        exact = result.assembly.source.scene.closed_form(result.time)[path]  # type: ignore[union-attr]
        return float(np.max(np.abs(result[path] - exact)))

    return error


def formula(path: str, exact: Callable[[Any], Any], scale: float = 1.0) -> Callable[[Result], float]:
    """Return the largest distance of a quantity from a function of time, over a scale."""
    return lambda result: float(np.max(np.abs(np.asarray(result[path]) - exact(result.time)))) / scale


def largest(*errors: Callable[[Result], float]) -> Callable[[Result], float]:
    """Return the largest of several errors."""
    return lambda result: max(error(result) for error in errors)
