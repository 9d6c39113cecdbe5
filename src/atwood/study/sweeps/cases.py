"""The runs of a sweep: which values each has, as a grid or as a list."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import show
from atwood.errors import UsageError
from atwood.forms.other_values import change_scene
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model, owner_of
from atwood.model.compose.scene import Scene
from atwood.model.local.flatten import flatten

COMBINATIONS = ("grid", "list")

_OWN = ("t_start", "t_end", "space", "line_axis")


@dataclass(frozen=True, eq=False)
class Axis:
    """What is varied, and through which values.

    Attributes
    ----------
    path
        Of a parameter, or of a start value.
    is_start
        Whether it is a start value.
    given
        The values as they were given.
    values
        The same in SI units; text for what is no number.
    """

    path: str
    is_start: bool
    given: tuple[Any, ...]
    values: NDArray[Any]

    def at(self, places: NDArray[np.intp]) -> Axis:
        """Return some of the values, in some order."""
        return Axis(self.path, self.is_start, tuple(self.given[k] for k in places.tolist()), self.values[places])


@dataclass(frozen=True, eq=False)
class Cases:
    """The runs of a sweep.

    Attributes
    ----------
    axes
        What is varied.
    shape
        Of the grid: the number of values of each axis; one number for a list.
    """

    axes: tuple[Axis, ...]
    shape: tuple[int, ...]

    @property
    def count(self) -> int:
        """The number of runs."""
        return math.prod(self.shape)

    @cached_property
    def places(self) -> tuple[NDArray[np.intp], ...]:
        """For each axis, which of its values each run has; the last axis of a grid changes fastest."""
        runs = np.arange(self.count)
        if len(self.shape) == 1:
            return (runs,) * len(self.axes)
        return tuple(np.unravel_index(runs, self.shape))

    def column(self, axis: int) -> NDArray[Any]:
        """Return the values of an axis, one for each run, in SI units."""
        found: NDArray[Any] = self.axes[axis].values[self.places[axis]]
        return found

    def of(self, run: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return parameters and start values of one run, as they were given."""
        found: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
        for axis, places in zip(self.axes, self.places, strict=True):
            found[axis.is_start][axis.path] = axis.given[places[run]]
        return found

    def part(self, runs: NDArray[np.intp]) -> Cases:
        """Return some of the runs, as a list."""
        axes = zip(self.axes, self.places, strict=True)
        return Cases(tuple(axis.at(places[runs]) for axis, places in axes), (len(runs),))


def make_cases(scene: Model, vary: Mapping[str, Any] | None, start: Mapping[str, Any] | None, combine: str) -> Cases:
    """Put the runs of a sweep together, and check every value."""
    axes = [_axis(scene.copy(), path, values, False) for path, values in (vary or {}).items()]
    axes += [_axis(scene.copy(), path, values, True) for path, values in (start or {}).items()]
    if not axes:
        raise UsageError("nothing is varied", advice="Give values by path, such as {'rod1.length': [0.5, 1.0]}.")
    lengths = [len(axis.given) for axis in axes]
    if combine == "grid":
        return Cases(tuple(axes), tuple(lengths))
    if len(set(lengths)) > 1:
        said = ", ".join(f"{axis.path} has {len(axis.given)}" for axis in axes)
        raise UsageError(f"the lists differ in length: {said}", advice="Use combine='grid', or give as many of each.")
    return Cases(tuple(axes), (lengths[0],))


def _axis(trial: Model, path: str, values: Any, is_start: bool) -> Axis:
    if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)):
        raise UsageError(
            f"{show(values)} is no list of values", where=path, advice="Give a list of values, or an array."
        )
    if isinstance(values, np.ndarray) and values.ndim != 1:
        raise UsageError(f"its values have the shape {values.shape} and not one dimension", where=str(path))
    given = tuple(values.tolist() if isinstance(values, np.ndarray) else values)
    if not given:
        raise UsageError("it has no values", where=path, advice="Give a list of values, or an array.")
    if is_start and isinstance(values, np.ndarray) and values.dtype.kind == "f" and np.all(np.isfinite(values)):
        return Axis(path, True, given, values.astype(float))
    if not is_start and isinstance(values, np.ndarray) and values.dtype.kind == "f" and np.all(np.isfinite(values)):
        # What a number may be is a range: its ends are checked.
        ends = [float(one) for one in (np.min(values), np.max(values))]
        if all(type(found := _parameter_value(trial, path, one)) is float and found == one for one in ends):
            return Axis(path, False, given, values.astype(float))
    read = [_start_value(trial, path, one) if is_start else _parameter_value(trial, path, one) for one in given]
    is_number = all(isinstance(one, (int, float)) for one in read)
    column = np.array(read, dtype=float) if is_number else np.array([str(one) for one in read])
    return Axis(path, is_start, given, column)


def _parameter_value(trial: Model, path: str, value: Any) -> Any:
    """Return the value of a parameter in SI units, after it has been checked."""
    if path in _OWN:
        raise UsageError("this is the same for all runs of a sweep", where=path, advice="Give it to sweep itself.")
    trial.set(path, value)
    part, name = owner_of(trial, path)
    return part._value(name)


def _start_value(trial: Model, path: str, value: Any) -> float:
    if value is None:
        raise UsageError("it has no value in one of the runs", where=path, advice="Give a number, or text with a unit.")
    if isinstance(trial, Scene) and isinstance(value, (int, float)):
        trial.start[path] = value
        return float(value)
    change_scene(trial, {}, {path: value}, {})
    return flatten(trial).start[path]
