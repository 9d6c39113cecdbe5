"""`trim`: values of inputs and coordinates with which a given state is steady."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from atwood.arguments import PATHS, takes
from atwood.arrays import FloatArray
from atwood.display import fitted
from atwood.errors import ParameterError, SolveError, suggestion
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.numerics.matrices import or_one
from atwood.numerics.newton import Missing, largest, newton
from atwood.pipeline import SCENE
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linear.displacements import Minimal
from atwood.theory.linear.operating_point import (
    AT,
    At,
    OperatingPoint,
    find_operating_point,
    moved_to,
    values_at,
)
from atwood.theory.linear.rest import slopes_at
from atwood.tolerances import tolerances

_STEPS, _FAR = 50, 0.5
"""So many steps at most, each of which turns nothing by more, rad."""


@dataclass(frozen=True, eq=False)
class Trim:
    """A steady state with the inputs that hold it.

    Attributes
    ----------
    inputs
        What has to be added to each input, by path.
    values
        Coordinates and speeds, by path.
    scene
        Name of the scene.
    point
        The state with its equations.
    """

    inputs: Mapping[str, float]
    values: Mapping[str, float]
    scene: str
    point: OperatingPoint = field(repr=False)

    def __str__(self) -> str:
        lines = [f"{self.scene}: trimmed"]
        lines += [f"  input {path} = {value:.9g}" for path, value in self.inputs.items()]
        lines += [f"  {path} = {value:.9g}" for path, value in list(self.values.items())[:7]]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return fitted(str(self))


@takes(scene=SCENE, at=AT, inputs=PATHS, free=PATHS)
def trim(scene: Model | Assembly, *, at: At = None, inputs: Sequence[str] = (), free: Sequence[str] = ()) -> Trim:
    """Find inputs, and coordinates that are not given, with which nothing accelerates.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    at
        The state that is wanted, by path; see `linearize`.
    inputs
        Inputs whose constant value may be chosen. Where several do, their squares add up to the least.
    free
        Coordinates that may move away from what `at` and the scene's start say; the others keep their values.

    Returns
    -------
    Trim
        The values.

    Raises
    ------
    SolveError
        If no values of these inputs and coordinates hold the state.
    ParameterError
        If there is no such input or coordinate.
    """
    point = find_operating_point(scene, at, inputs)
    first = _trial(point, {one.path: 0.0 for one in point.inputs}, _free_numbers(point, free))
    found, left = newton(lambda one: one.missing, _moved, first, np.ones(1), steps=_STEPS, exact=tolerances.MET)
    if left.miss <= tolerances.MET:
        return Trim(found.values, values_at(found.point), point.assembly.flat.name, found.point)
    name = point.scene.equations.speed_names[found.minimal.speeds[int(np.argmax(np.abs(left.value)))]].name
    raise SolveError(
        f"no values of these inputs and coordinates hold the state: {name} goes on changing",
        where=point.assembly.flat.name,
        advice="Let more inputs or coordinates be chosen, or ask for another state.",
    )


@dataclass(frozen=True, eq=False)
class _Trial:
    """A state with values of the inputs, and the accelerations there.

    Attributes
    ----------
    point, values, free
        The state, the values, and the numbers of coordinates that may move.
    minimal, chosen
        Independent coordinates, and which of them are free.
    scale
        How much accelerations change with each value and each free coordinate.
    missing
        The accelerations.
    """

    point: OperatingPoint
    values: Mapping[str, float]
    free: set[int]
    minimal: Minimal
    chosen: list[int]
    scale: FloatArray
    missing: Missing


def _trial(point: OperatingPoint, values: Mapping[str, float], free: set[int]) -> _Trial:
    linear = point.scene
    columns = _value_columns(point)
    current = linear.with_inputs({name: values[path] for path, names in columns.items() for name in names})
    flow = current.flow(point.t, point.q, point.u, point.kept)
    minimal, a, slopes = slopes_at(current, flow, point.kept)
    own = linear.sizes[list(minimal.speeds)]
    by = flow.acceleration[list(minimal.speeds), len(flow.field) + 1 :] / own[:, None]
    gains = [sum((by[:, k] for k in _numbers_of(point, path)), np.zeros(len(own))) for path in values]
    chosen = [i for i, k in enumerate(minimal.displacements) if k in free]
    matrix = np.column_stack([*gains, slopes[:, chosen]])
    size = largest(slopes) + largest(a) or 1.0
    scale = or_one(np.max(np.abs(matrix), axis=0, initial=0.0))
    missing = Missing(a, np.full(len(a), size), lambda: matrix / scale, np.ones(len(a)))
    return _Trial(point, values, free, minimal, chosen, scale, missing)


def _moved(one: _Trial, by: FloatArray) -> _Trial:
    """Return the trial with other values and coordinates; no coordinate moves by more than half a radian."""
    point, linear, step = one.point, one.point.scene, by / one.scale
    values = {path: old + float(value) for (path, old), value in zip(one.values.items(), step, strict=False)}
    turned = step[len(values) :]
    turned = turned * min(1.0, _FAR / max(largest(turned), 1e-300))
    moved = np.zeros(len(linear.tangents))
    for i, value in zip(one.chosen, turned, strict=True):
        moved += one.minimal.shift[:, i] * value * linear.displacement_sizes[one.minimal.displacements[i]]
    q, u = balance_of(point.assembly, "reduced").project(
        point.t, linear.tangents.moved(point.q, moved), point.u, linear.sizes
    )
    return _trial(moved_to(point, q, u), values, one.free)


def _numbers_of(point: OperatingPoint, path: str) -> list[int]:
    first, found = 0, []
    for one in point.inputs:
        if one.path == path:
            found = [first + 3 * k for k in range(len(one.keys))]
        first += 3 * len(one.keys)
    return found


def _value_columns(point: OperatingPoint) -> dict[str, list[str]]:
    return {one.path: [point.scene.inputs[k].name for k in _numbers_of(point, one.path)] for one in point.inputs}


def _free_numbers(point: OperatingPoint, free: Sequence[str]) -> set[int]:
    names = list(point.scene.tangents.names)
    for path in free:
        if path not in names:
            raise ParameterError("there is no such coordinate", where=path, advice=suggestion(path, names))
    return {names.index(path) for path in free}
