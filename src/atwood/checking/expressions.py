"""Laws and updates on expressions against the same on numbers: values, and derivatives against differences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from atwood.checking.forces import energy_forces, in_motion, load_forces, ways
from atwood.checking.samples import Finding
from atwood.consistency.joints import Unknown
from atwood.consistency.trials import Trial
from atwood.expr import Expression, Graph, evaluate
from atwood.mechanics.dynamics.forces import local_gradients
from atwood.model.declare.connectors import JointCoordinate
from atwood.model.declare.law import Law
from atwood.model.local.bound import ParameterTable
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.laws import localize
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import from_axes
from atwood.model.values.vector import Vector

TOLERANCE = 1e-5
"""Relative: differences on numbers are good to some 1e-9, and mistakes of laws are far larger."""


def wrong_on_expressions(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each energy and load, how expressions differ from numbers, or None."""
    if any(isinstance(one, JointCoordinate) for one in trial.component.connectors().values()):
        return  # what takes hold of a joint is read with the joint: in scenes
    acting = [law for law in trial.component._laws.values() if law.holds_in(trial.space.name) and law.acts_in(mode)]
    energies = [law for law in acting if law.kind == "potential"]
    if not energies and not any(law.kind == "force" for law in acting):
        return
    local, numbers = _localized(trial, mode)
    space = trial.space.name
    try:
        if local.potentials:
            wanted = sum(energy_forces(trial, law) for law in energies)
            found = sum(_forces(trial, local, value, numbers) for value in local.potentials)
            yield _compared(wanted, found, energies, "the force of its energy", space)
        loads = [law for law in acting if law.kind == "force"]
        if local.loads and loads:
            wanted = sum(load_forces(trial, law) for law in loads)
            graph = next(iter(numbers)).graph
            parts = [graph.convert(c) for load in local.loads for c in (*load.force, *load.torque)]
            made = np.array(evaluate(parts, numbers))
            total = np.abs(made).sum()
            same = abs(total - sum(_size(trial, law) for law in loads)) <= TOLERANCE * (total + 1e-30)
            yield None if same else _finding(loads, "its loads", space)
    except (Unknown, KeyError):
        return


def _size(trial: Trial, law: Law) -> float:
    loads = list(getattr(in_motion(trial), law.name)())
    return float(sum(abs(float(c)) for load in loads for c in (*load.force, *load.torque)))


def _localized(trial: Trial, mode: str) -> tuple[LocalPart, dict[Expression, float]]:
    """Return the part on its symbols, and numbers for them."""
    part = Part(trial.part.path, trial.component, trial.part.values, {n: v for n, (v, _) in trial.inputs.items()})
    line = tuple(trial.space.line) if trial.space.line is not None else (1.0, 0.0, 0.0)
    flat = FlatScene(
        "check", trial.space.name, line, 0.0, (0.0, 0.0, -1.0), None, 0.0, 1.0, {part.path: part}, (), {}, {}, {}
    )
    graph = Graph()
    time, table = graph.symbol("t"), ParameterTable(graph, space=trial.space.name)
    carried: Any = {(part.path, name): body for name, body in trial.bodies.items()}
    line_signs = {(part.path, a, b): side for (a, b), side in trial.line_signs.items()}
    modes = {part.path: mode} if mode else {}
    local = localize(flat, trial.space, time, table, modes, line_signs, carried)[part.path]
    numbers: dict[Expression, float] = {**table.values, time: 0.0}
    for name, one in local.connectors.items():
        pose = trial.poses[name]
        numbers.update(zip(one.position, map(float, trial.space.components(pose.position)), strict=True))
        numbers.update(zip(one.velocity, map(float, trial.space.components(trial.velocities[name])), strict=True))
        spin = trial.angular_velocities[name]
        if one.angle is not None:
            numbers.update(zip((*one.orientation, *one.spin), (pose.angle, -spin.y), strict=True))
        elif one.axes is not None:
            numbers.update(zip(one.orientation, (float(c) for axis in pose.axes for c in axis), strict=True))
            numbers.update(zip(one.spin, spin, strict=True))
    return local, numbers


def _forces(trial: Trial, local: LocalPart, value: Expression, numbers: dict[Expression, float]) -> Any:
    """Return the forces that the engine finds by differentiating an energy."""
    found: list[float] = []
    for name, gradients, torques in local_gradients(local, value, value.graph.constant(-1.0)):
        found += evaluate(gradients, numbers)
        torque = evaluate(torques, numbers)
        if len(torque) == 3:
            torque = [float(c) for c in from_axes(trial.poses[name].axes, Vector(*torque))]
        found += torque[: ways(trial, name) - len(gradients)]
    return np.array(found)


def _compared(wanted: Any, found: Any, laws: Sequence[Law], what: str, space: str) -> Finding | None:
    size = float(np.abs(wanted).max(initial=0.0)) + float(np.abs(found).max(initial=0.0))
    if not size or np.abs(wanted - found).max() <= TOLERANCE * size:
        return None
    return _finding(laws, what, space)


def _finding(laws: Sequence[Law], what: str, space: str) -> Finding:
    message = (
        f"{what} comes out otherwise on expressions than on numbers: branch with atwood.select and not with if, and "
        "see to the derivatives of external functions"
    )
    return Finding("failure", "derivatives", laws[0].name if len(laws) == 1 else "", space, message)


def wrong_updates(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each update law, what is wrong with what it returns, or None."""
    for law in trial.component.laws("update"):
        if law.holds_in(trial.space.name) and law.acts_in(mode):
            specs = trial.component.state_specs()
            count = sum(len(specs[name].names(trial.part.values)) for name in law.options.sets)
            text = _wrong(trial, law.name, count)
            yield Finding("failure", "updates", law.name, trial.space.name, text) if text else None


def _wrong(trial: Trial, name: str, count: int) -> str:
    """Return what is wrong, in words, or nothing."""
    try:
        given = getattr(in_motion(trial), name)()
    except Exception as error:  # whatever a law of somebody's own can raise
        return f"it raises {type(error).__name__}: {error}"
    values = list(_flat(given))
    if len(values) != count:
        return f"it returns {len(values)} values where it sets {count}"
    for value in values:
        try:
            if math.isfinite(float(value)):
                continue
        except (TypeError, ValueError):
            return f"it returns {value!r} where a number is wanted"
        return f"it returns {float(value)!r}, which no state can be"
    return ""


def _flat(given: Any) -> Iterator[Any]:
    """Yield the values in what an update returned."""
    if isinstance(given, Iterable) and not isinstance(given, str):
        for one in given:
            yield from _flat(one)
    else:
        yield given
