"""Forces of a part: loads, potentials and Rayleigh functions against each other, on numbers and on expressions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.checking.samples import Finding
from atwood.consistency.joints import Unknown, attempt
from atwood.consistency.trials import Pose, Trial, nudged
from atwood.expr import Expression, Graph, evaluate
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.forces import local_gradients
from atwood.model.declare.connectors import JointCoordinate, Motion
from atwood.model.declare.law_results import Load
from atwood.model.declare.laws import Law
from atwood.model.local.bound import ParameterTable
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.laws import localize
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import from_axes
from atwood.model.values.space import Vector, cross

TOLERANCE = 1e-5
"""Relative: differences of energies are good to some 1e-9, and mistakes of laws are far larger."""

Wrench = NDArray[np.float64]
"""Force and torque on each connector along its ways to move, one after another."""


def wrong_forces(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each comparison of forces and energies, what is wrong, or None."""
    acting = [law for law in trial.component._laws.values() if law.holds_in(trial.space.name) and law.acts_in(mode)]
    for law in acting:
        try:
            if law.kind == "dissipation":
                yield _of_dissipation(trial, law)
                yield from _anchored(trial, law, of_velocities=True)
            elif law.kind == "potential":
                yield from _anchored(trial, law)
            elif law.kind == "force":
                yield from _of_loads(trial, law, acting)
        except Unknown:
            continue


def in_motion(trial: Trial, poses: Mapping[str, Pose] | None = None, speed: float = 1.0) -> Any:
    """Return the component on numbers, with connectors that move as in the trial, so many times as fast."""
    found: dict[str, Motion] = {}
    for name, pose in (poses or trial.poses).items():
        found[name] = trial.motion(name, pose, trial.velocities[name] * speed, trial.angular_velocities[name] * speed)
    joint_references = {name: (value, rate * speed) for name, (value, rate) in trial.joint_references.items()}
    return replace(trial, joint_references=joint_references).bound(0.0, poses or trial.poses, found)


def energy_forces(trial: Trial, law: Law) -> Wrench:
    """Return the forces of an energy: minus its differences along each way in which each connector can move."""
    found = []
    for name, pose in trial.poses.items():
        for column in range(trial.freedoms(name)):
            size = 1e-5 * (trial.length if column < len(trial.space.basis) else 1.0)
            ends = []
            for by in (size, -size):
                poses = {**trial.poses, name: nudged(pose, column, by, trial.space)}
                numbers = attempt(getattr(in_motion(trial, poses), law.name))
                ends.append(numbers[0] if numbers else np.nan)  # what is no number is told by another test
            found.append((ends[1] - ends[0]) / (2.0 * size))
    return np.array(found)


def load_forces(trial: Trial, law: Law) -> Wrench:
    """Return the loads of a law as forces on each connector along its ways to move."""
    try:
        loads = list(getattr(in_motion(trial), law.name)())
        totals: dict[str, tuple[Vector, Vector]] = {}
        for one in loads:
            assert isinstance(one, Load)
            force, torque = totals.get(one.at.name, (Vector(), Vector()))
            totals[one.at.name] = force + one.force, torque + one.torque
    except Exception as error:  # what is amiss is said when the law is read
        raise Unknown from error
    found: list[float] = []
    for name in trial.poses:
        force, torque = totals.get(name, (Vector(), Vector()))
        components = [*trial.space.components(force)]
        if trial.freedoms(name) > len(trial.space.basis):
            components += trial.space.turn_components(torque)
        found += [float(one) for one in components]
    return np.array(found)


def _speeds(trial: Trial) -> Wrench:
    """Return the velocities of connectors along their ways to move."""
    found: list[float] = []
    for name in trial.poses:
        found += [float(one) for one in trial.space.components(trial.velocities[name])]
        if trial.freedoms(name) > len(trial.space.basis):
            found += trial.space.turn_components(trial.angular_velocities[name])
    return np.array(found)


def _of_dissipation(trial: Trial, law: Law) -> Finding | None:
    """Refuse a Rayleigh function that is negative, or gives forces that drive: they have to take power away."""
    values = [attempt(getattr(in_motion(trial, speed=speed), law.name))[0] for speed in (1.0, 1.001, 0.999)]
    power = (values[1] - values[2]) / 0.002  # v . dR/dv, which is what the forces take
    scale = abs(values[0]) + abs(power)
    for what, value in (("it is negative", values[0]), ("its forces drive instead of braking", power)):
        if value < -TOLERANCE * scale:
            message = f"{what} ({value:.3g} W): a Rayleigh function is half the power that is lost"
            return Finding("failure", "dissipation", law.name, trial.space.name, message)
    return None


def _of_loads(trial: Trial, law: Law, acting: list[Law]) -> Iterator[Finding | None]:
    """Compare loads with potentials, with what is observed of energies, and with each other."""
    loads, space = load_forces(trial, law), trial.space.name
    size = float(np.abs(loads).max(initial=0.0))
    if size == 0.0:
        return
    for other in acting:
        if other.kind == "potential":
            forces = energy_forces(trial, other)
            for off, what in ((loads + forces, "undo"), (loads - forces, "are once more")):
                if np.abs(off).max() < TOLERANCE * size:
                    message = f"its loads {what} the forces of the potential {other.name!r}, which acts by itself"
                    yield Finding("failure", "forces", law.name, space, message)
                    return
    yield None
    still = None if trial.inputs else _loads_at_rest(trial, law)
    if still is not None and np.abs(still - loads).max() < TOLERANCE * size:
        for other in trial.component.laws("observable"):
            if other.options.unit == "J" and other.holds_in(space):
                yield _of_observed_energy(trial, law, other, loads)
    elif still is not None and np.abs(still).max() < TOLERANCE * size:
        yield _of_friction(trial, law)
    yield from _resultant(trial, law, loads)


def _loads_at_rest(trial: Trial, law: Law) -> Wrench | None:
    still = {name: Vector() for name in trial.velocities}
    try:
        return load_forces(replace(trial, velocities=still, angular_velocities=still), law)
    except Unknown:
        return None


def _of_observed_energy(trial: Trial, law: Law, energy: Law, loads: Wrench) -> Finding | None:
    """Refuse loads that are another multiple of the forces of an energy that the part reports than one."""
    try:
        factor = _multiple(loads, energy_forces(trial, energy))
        if factor is None or abs(factor - 1.0) < 1e-4:
            return None
        wider = replace(trial, poses={name: _farther(pose) for name, pose in trial.poses.items()})
        again = _multiple(load_forces(wider, law), energy_forces(wider, energy))
    except Unknown:
        return None
    if again is None or abs(again - factor) > 1e-4 * abs(factor):
        return None  # two things of their own, which are in line here
    message = f"its loads are {factor:.4g} times the forces of the energy {energy.name!r}, minus its derivatives"
    if abs(factor + 1.0) < 1e-4:
        message = (
            f"its loads are the derivatives of the energy {energy.name!r} with the wrong sign: they have to be minus"
        )
    return Finding("failure", "forces", law.name, trial.space.name, message)


def _multiple(loads: Wrench, forces: Wrench) -> float | None:
    """Return by which factor loads are larger than forces, or None if they are no multiple of these."""
    square = float(forces @ forces)
    factor = float(loads @ forces) / square if square > 0.0 else 0.0
    is_one = factor != 0.0 and np.abs(loads - factor * forces).max() < TOLERANCE * np.abs(loads).max()
    return factor if is_one else None


def _farther(pose: Pose) -> Pose:
    return replace(pose, position=pose.position * 1.3)


def _of_friction(trial: Trial, law: Law) -> Finding | None:
    """Note loads that come with velocities alone and give power to all of them."""
    names = list(trial.velocities)
    for number in range(2 ** min(len(names) + 1, 5)):
        signs = [1.0 if number >> i & 1 else -1.0 for i in range(len(names))]
        others = signs[1:] + signs[:1]
        moving = replace(
            trial,
            velocities={name: trial.velocities[name] * sign for name, sign in zip(names, signs, strict=True)},
            angular_velocities={
                name: trial.angular_velocities[name] * sign for name, sign in zip(names, others, strict=True)
            },
        )
        try:
            loads = load_forces(moving, law)
        except Unknown:
            return None
        speeds = _speeds(moving)
        if not float(loads @ speeds) > 1e-3 * float(np.linalg.norm(loads) * np.linalg.norm(speeds)):
            return None
    message = "its loads, which come with velocities, give power to every motion that was tried: is a sign wrong?"
    return Finding("note", "forces", law.name, trial.space.name, message)


def _resultant(trial: Trial, law: Law, loads: Wrench) -> Iterator[Finding | None]:
    """Note loads that do not cancel: what they push against is not among the connectors."""
    force, torque = _sum(trial, loads)
    size = float(np.abs(loads).max())
    for what, total, scale in (("resultant force", force, size), ("resultant torque", torque, size * _reach(trial))):
        if np.abs(total).max(initial=0.0) > 1e-6 * scale:
            message = f"its loads have a {what}, so that they act against the world: is a reaction missing?"
            yield Finding("note", "reactions", law.name, trial.space.name, message)
            return


def _sum(trial: Trial, loads: Wrench) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sum of forces and of torques about the origin."""
    force, torque, at = Vector(), Vector(), 0
    for name, pose in trial.poses.items():
        count = len(trial.space.basis)
        one = trial.space.vector(tuple(loads[at : at + count]))
        at += count
        own = loads[at : at + trial.freedoms(name) - count]
        at += len(own)
        angular_velocities = Vector(*own) if len(own) == 3 else Vector(0.0, -own[0], 0.0) if len(own) else Vector()
        force, torque = force + one, torque + cross(pose.position, one) + angular_velocities
    return np.array([float(c) for c in force]), np.array([float(c) for c in torque])


def _reach(trial: Trial) -> float:
    return max([trial.length, *(abs(float(c)) for pose in trial.poses.values() for c in pose.position)])


def _anchored(trial: Trial, law: Law, of_velocities: bool = False) -> Iterator[Finding | None]:
    """Note an energy that changes when the whole is moved and turned, or that feels a motion of the whole."""
    if of_velocities:
        drift, spin = Vector(0.3, -0.5, 0.4), Vector(0.2, 0.6, -0.3)
        drift = trial.space.vector(trial.space.components(drift)) * trial.length
        spin = spin if trial.space.is_spatial else Vector(0.0, spin.y, 0.0) if trial.frames else Vector()
        velocities = {name: drift + _in_space(trial, cross(spin, pose.position)) for name, pose in trial.poses.items()}
        joint_references = {name: (value, 0.0) for name, (value, _) in trial.joint_references.items()}
        whole = replace(
            trial,
            velocities=velocities,
            angular_velocities=dict.fromkeys(trial.poses, spin),
            joint_references=joint_references,
        )
        value = attempt(getattr(in_motion(whole), law.name))[0]
        usual = attempt(getattr(in_motion(trial), law.name))[0]
        changed = abs(value) > 1e-6 * (abs(usual) + abs(value))
        what = "it takes power from a motion of the whole scene"
    else:
        forces = energy_forces(trial, law)
        force, torque = _sum(trial, forces)
        size = float(np.abs(forces).max(initial=0.0))
        changed = bool(np.abs(force).max() > 1e-5 * size)
        changed |= trial.space.has_rotation and bool(np.abs(torque).max() > 1e-5 * size * _reach(trial))
        what = "it changes when the whole scene is moved or turned"
    if changed and not trial.joint_references:
        message = f"{what}: it acts against the world"
        yield Finding("note", "reactions", law.name, trial.space.name, message)
    else:
        yield None


def _in_space(trial: Trial, vector: Vector) -> Vector:
    return trial.space.vector(trial.space.components(vector))


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
    flat = FlatScene("check", trial.space, 0.0, (0.0, 0.0, -1.0), None, 0.0, 1.0, {part.path: part}, (), {}, {}, {})
    table = ParameterTable(Graph(), trial.space)
    carried: Any = {(part.path, name): body for name, body in trial.bodies.items()}
    line_signs = {(part.path, a, b): side for (a, b), side in trial.line_signs.items()}
    modes = {part.path: mode} if mode else {}
    local = localize(flat, table, modes, line_signs, carried)[part.path]
    numbers: dict[Expression, float] = {**table.values, table.time: 0.0}
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
        found += torque[: trial.freedoms(name) - len(gradients)]
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
