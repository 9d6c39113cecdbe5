"""`trim`: values of inputs and coordinates with which a given state is steady."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from atwood.analysis.linear.rest import slopes_at
from atwood.arguments import TEXT, each, takes
from atwood.errors import SolveError
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.showing import fitted
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linearization.operating_point import (
    AT,
    At,
    OperatingPoint,
    find_operating_point,
    moved_to,
    values_at,
)

__all__ = ["Trim", "trim"]


_STEPS = 50
_MET = 1e-11


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


@takes(scene=SCENE, at=AT, inputs=each(TEXT, "paths, as a list of texts", single=True), free=each(TEXT, "paths"))
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
    linear, found = point.scene, {one.path: 0.0 for one in point.inputs}
    numbers = _free_numbers(point, free)
    balance = balance_of(point.assembly, "reduced")
    columns = _value_columns(point)
    for _ in range(_STEPS):
        current = linear.with_inputs({name: found[path] for path, names in columns.items() for name in names})
        flow = current.flow(point.t, point.q, point.u, point.kept)
        minimal, a, slopes = slopes_at(current, flow, point.kept)
        own = linear.sizes[list(minimal.speeds)]
        by = flow.acceleration[list(minimal.speeds), len(flow.field) + 1 :] / own[:, None]
        gains = (
            np.stack([sum((by[:, k] for k in _numbers_of(point, path)), np.zeros(len(own))) for path in found], axis=1)
            if found
            else np.zeros((len(own), 0))
        )
        chosen = [i for i, k in enumerate(minimal.displacements) if k in numbers]
        matrix = np.hstack([gains, slopes[:, chosen]])
        size = float(np.max(np.abs(slopes), initial=0.0)) + float(np.max(np.abs(a), initial=0.0)) or 1.0
        if float(np.max(np.abs(a), initial=0.0)) <= _MET * size:
            return Trim(found, values_at(point), point.assembly.flat.name, point)
        scale = np.max(np.abs(matrix), axis=0, initial=0.0)
        scale[scale == 0.0] = 1.0
        step = -np.linalg.lstsq(matrix / scale, a, rcond=1e-10)[0] / scale
        moved = np.zeros(len(linear.tangents))
        by_angle = step[len(found) :]
        by_angle = by_angle * min(1.0, 0.5 / max(float(np.max(np.abs(by_angle), initial=0.0)), 1e-300))
        for i, value in zip(chosen, by_angle, strict=True):
            k = minimal.displacements[i]
            moved += minimal.shift[:, i] * value * linear.displacement_sizes[k]
        for path, value in zip(found, step, strict=False):
            found[path] += float(value)
        q, u = balance.project(point.t, linear.tangents.moved(point.q, moved), point.u, linear.sizes)
        point = moved_to(point, q, u)
    left = linear.equations.speed_names[minimal.speeds[int(np.argmax(np.abs(a)))]].name
    raise SolveError(
        f"no values of these inputs and coordinates hold the state: {left} goes on changing",
        where=point.assembly.flat.name,
        advice="Let more inputs or coordinates be chosen, or ask for another state.",
    )


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
    from atwood.errors import ParameterError, suggestion

    names = list(point.scene.tangents.names)
    for path in free:
        if path not in names:
            raise ParameterError("there is no such coordinate", where=path, advice=suggestion(path, names))
    return {names.index(path) for path in free}
