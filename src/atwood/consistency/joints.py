"""Joints against the constraints that they solve, and against the observables that have their coordinates' names."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from atwood.consistency.trials import (
    STEP,
    Pose,
    Trial,
    contradiction_at,
    in_components,
    nudged,
    rate_of,
    rotation_between,
)
from atwood.errors import DeclarationError
from atwood.expr import Scalar
from atwood.model.declare.connectors import Motion
from atwood.model.declare.laws import Law, scalars
from atwood.model.values.rotation import FREE
from atwood.numerics.rank import rank

TOLERANCE = 1e-6
"""Of values against each other, by their sizes; differences are good to some 1e-10, and mistakes are far larger."""


class Unknown(Exception):
    """A law has no value at a random state, or none on numbers; so nothing can be said there."""


def attempt(law: Callable[[], Any]) -> list[float]:
    """Return what a law gives as numbers."""
    try:
        found = [float(one) for one in scalars(law())]
    except Exception as error:  # whatever a law of somebody's own can raise; what is amiss is said when it is read
        raise Unknown from error
    if not all(map(math.isfinite, found)):
        raise Unknown
    return found


def wrong_joint(trial: Trial, law: Law, mode: str) -> Iterator[DeclarationError]:
    """Yield errors for a joint that contradicts other laws of its component."""
    poses_at = _followed(trial, law)
    moving = trial.moving(poses_at)
    poses = poses_at(0.0)
    solved = [
        one
        for one in trial.component.laws("constraint")
        if one.name in law.options.solves and one.holds_in(trial.space.name) and one.acts_in(mode)
    ]
    slopes = _slopes(trial, law, solved, poses, moving)
    wrong = False
    for one in solved:
        for error in _unsolved(trial, law, one, poses, moving, slopes[one.name]):
            wrong = True
            yield error
    if not wrong:
        yield from _wrong_freedom(trial, law, poses, [row for rows in slopes.values() for row in rows])
    yield from _wrong_coordinates(trial, law, poses_at, moving)


def _followed(trial: Trial, law: Law) -> Callable[[float], dict[str, Pose]]:
    known: dict[float, dict[str, Pose]] = {}

    def poses_at(t: float) -> dict[str, Pose]:
        if t not in known:
            try:
                known[t] = trial.joined(law, t)
            except Exception as error:  # see `attempt`
                raise Unknown from error
        return known[t]

    return poses_at


def _mover(law: Law) -> str:
    return str(law.options.a if law.options.b == "world" else law.options.b)


def _slopes(
    trial: Trial, law: Law, solved: Sequence[Law], poses: Mapping[str, Pose], moving: Mapping[str, Motion]
) -> dict[str, np.ndarray]:
    """Return how constraints change with each way in which the joint's end can move: a row for each scalar.

    What changes alike both ways, as a square does, has no slope, and holds nothing.
    """
    mover, directions = _mover(law), len(trial.space.basis)
    columns: dict[str, list[np.ndarray]] = {one.name: [] for one in solved}
    sizes: dict[str, np.ndarray] = {one.name: np.zeros(1) for one in solved}
    for column in range(trial.freedoms(mover)) if solved else ():
        by = 1e-4 * (trial.length if column < directions else 1.0)
        ends = [
            _values(trial, solved, {**poses, mover: nudged(poses[mover], column, way * by, trial.space)}, moving)
            for way in (1.0, -1.0)
        ]
        for one, up, down in zip(solved, *ends, strict=True):
            columns[one.name].append((np.array(up) - np.array(down)) / 2e-4)
            sizes[one.name] = np.maximum(sizes[one.name], np.maximum(np.abs(up), np.abs(down)) / 1e-4)
    found = {name: np.array(made).T for name, made in columns.items()}
    for name, rows in found.items():
        found[name] = np.where(np.abs(rows) > TOLERANCE * sizes[name][:, None], rows, 0.0) if rows.size else rows
    for one in solved:
        if found[one.name].size and not found[one.name].any():  # it depends on velocities alone
            found[one.name] = _velocity_jacobian(trial, mover, one, poses, moving)
    return found


def _velocity_jacobian(
    trial: Trial, mover: str, constraint: Law, poses: Mapping[str, Pose], moving: Mapping[str, Motion]
) -> np.ndarray:
    """Return the same for a constraint on velocities, along these."""
    space, held = trial.space, moving[mover]
    velocity, spin = held.velocity, held.angular_velocity
    assert velocity is not None
    assert spin is not None
    columns = []
    for column in range(trial.freedoms(mover)):
        ends = []
        for by in (0.5, -0.5):
            if column < len(space.basis):
                motion = trial.motion(mover, poses[mover], velocity + space.basis[column] * (by * trial.length), spin)
            else:
                motion = trial.motion(
                    mover, poses[mover], velocity, spin + space.turn_axes[column - len(space.basis)] * by
                )
            ends.append(_value(trial, constraint, poses, {**moving, mover: motion}))
        columns.append(np.array(ends[0]) - np.array(ends[1]))
    return np.array(columns).T


def _value(trial: Trial, law: Law, poses: Mapping[str, Pose], moving: Mapping[str, Motion]) -> list[float]:
    """Return a law's scalars where connectors are somewhere, with the velocities that are given."""
    return _values(trial, (law,), poses, moving)[0]


def _values(
    trial: Trial, laws: Sequence[Law], poses: Mapping[str, Pose], moving: Mapping[str, Motion]
) -> list[list[float]]:
    motions = {
        name: trial.motion(name, pose, moving[name].velocity, moving[name].angular_velocity)
        for name, pose in poses.items()
    }
    bound = trial.bound(0.0, poses, motions)
    return [attempt(getattr(bound, law.name)) for law in laws]


def _unsolved(
    trial: Trial,
    law: Law,
    constraint: Law,
    poses: Mapping[str, Pose],
    moving: Mapping[str, Motion],
    slopes: np.ndarray,
) -> Iterator[DeclarationError]:
    """Yield an error if a constraint is not zero where the joint puts its end."""
    values = _value(trial, constraint, poses, moving)
    apart = max([1.0, *(abs(c) / trial.length for pose in poses.values() for c in pose.position)])
    for value, row in zip(values, slopes, strict=True):
        rounding = 1e-12 * apart * max(1.0, trial.length)  # of a constraint that holds in this space by itself
        if abs(value) > TOLERANCE * float(np.abs(row).sum()) * apart + rounding:
            cls = type(trial.component)
            yield DeclarationError(
                f"it says that it solves {constraint.name!r}, which is {value:.3g} and not zero where it places "
                f"{_mover(law)!r}{_at(trial, law)}{contradiction_at(cls, law.name, constraint.name)}",
                where=f"{trial.part.path}.{law.name}",
                advice="Mend the placement or the constraint: it must hold for all values of the joint's coordinates."
                + (" On a line, directions are along it." if trial.space.line is not None else ""),
            )
            return


def _wrong_freedom(
    trial: Trial, law: Law, poses: Mapping[str, Pose], rows: Sequence[np.ndarray]
) -> Iterator[DeclarationError]:
    """Yield an error if the joint leaves fewer ways to move than the constraints that it solves."""
    mover = _mover(law)
    freedoms = trial.freedoms(mover)
    left = _rank(_tangents(trial, law, poses))
    held = _rank(rows)
    if left + held >= freedoms:
        return
    cls, named = type(trial.component), [repr(name) for name in law.options.solves]
    what = f"and the constraints that it solves ({', '.join(named)}) hold {held}" if named else "and it solves none"
    yield DeclarationError(
        f"of {freedoms} ways in which {mover!r} can move it holds {freedoms - left}, {what}"
        f"{contradiction_at(cls, law.name, *law.options.solves)}",
        where=f"{trial.part.path}.{law.name}",
        advice="Name in solves every constraint that keeps what the joint keeps, or give it more coordinates: "
        "else the two forms describe different mechanisms.",
    )


def _tangents(trial: Trial, law: Law, poses: Mapping[str, Pose]) -> list[np.ndarray]:
    """Return the ways in which the joint lets its end move."""
    mover, space = _mover(law), trial.space
    values = trial.coordinates_at(0.0)
    units = {one.name: one.options.unit for one in trial.component.laws("observable")}

    def difference(ends: Sequence[Pose]) -> np.ndarray:
        moved = np.array(in_components(ends[0].position - ends[1].position, space)) / trial.length
        turned = rotation_between(ends[1], ends[0], space) if trial.is_frame(mover) else []
        return np.array([*moved, *turned]) / 2e-4

    def placed(values: Mapping[str, float], start: Mapping[str, Pose]) -> Pose:
        try:
            return trial.joined(law, 0.0, values, start)[mover]
        except Exception as error:  # see `attempt`
            raise Unknown from error

    found = []
    for name in law.options.coordinates:
        by = 1e-4 * (trial.length if units.get(name) == "m" else 1.0)
        found.append(difference([placed({**values, name: values[name] + s * by}, poses) for s in (1.0, -1.0)]))
    placement = trial.placement(law, 0.0, poses, values)
    assert placement is not None
    if placement.rotation is None or placement.rotation is FREE:
        for column in range(len(space.basis), trial.freedoms(mover)):
            turned = [{**poses, mover: nudged(poses[mover], column, s * 1e-4, space)} for s in (1.0, -1.0)]
            found.append(difference([placed(values, start) for start in turned]))
    return found


def _rank(rows: Sequence[np.ndarray]) -> int:
    """Return how many rows are independent, each by its own size."""
    sized = [row / np.abs(row).max() for row in rows if row.size and np.abs(row).max() > 0.0]
    return rank(np.array(sized), np.full(len(sized), TOLERANCE)) if sized else 0


def _wrong_coordinates(
    trial: Trial, law: Law, poses_at: Callable[[float], dict[str, Pose]], moving: Mapping[str, Motion]
) -> Iterator[DeclarationError]:
    """Yield errors for observables that differ from the coordinate of their name, or from its rate."""
    laws = {one.name: one for one in trial.component.laws("observable")}
    for name in law.options.coordinates:
        one = laws.get(name)
        if one is None or not one.holds_in(trial.space.name):
            continue
        wanted, rate = trial.coordinates[name]
        (value,) = _value(trial, one, poses_at(0.0), moving)
        off = value - wanted
        if one.options.periodic:
            off = math.remainder(off, math.tau)
        size = max(abs(wanted), abs(value), trial.length if one.options.unit == "m" else 1.0)
        cls = type(trial.component)
        if abs(off) > TOLERANCE * size:
            yield DeclarationError(
                f"the observable {name!r} is {value:.6g} {one.options.unit} where the joint coordinate of that name "
                f"is {wanted:.6g}{contradiction_at(cls, law.name, name)}",
                where=f"{trial.part.path}.{law.name}",
                advice="An observable with the name of a coordinate is that coordinate: mend one of them.",
            )
        elif one.options.rate in laws:
            (told,) = _value(trial, laws[one.options.rate], poses_at(0.0), moving)
            if abs(told - rate) > TOLERANCE * max(abs(told), abs(rate), size):
                yield _rate_error(trial, one, told, rate)


def wrong_rates(trial: Trial, joint: Law | None) -> Iterator[DeclarationError]:
    """Yield errors for observables whose rates are not their derivatives."""
    laws = {one.name: one for one in trial.component.laws("observable") if one.holds_in(trial.space.name)}
    known = joint.options.coordinates if joint is not None else ()  # `wrong_joint` has looked at these
    rated = [one for one in laws.values() if one.options.rate in laws and one.name not in known]
    if not rated:
        return
    poses_at = _followed(trial, joint) if joint is not None else trial.at
    moving = trial.moving(poses_at)
    for law in rated:
        try:
            (value,) = _value(trial, law, poses_at(0.0), moving)
            around = []
            for k in (-2, -1, 1, 2):
                poses = poses_at(k * STEP)
                bound = trial.bound(k * STEP, poses)
                (near,) = attempt(getattr(bound, law.name))
                around.append(value + math.remainder(near - value, math.tau) if law.options.periodic else near)
            (told,) = _value(trial, laws[law.options.rate], poses_at(0.0), moving)
        except (Unknown, ValueError):
            continue  # it reads reactions or velocities, or is a vector
        rate = rate_of(around)
        if abs(told - rate) > TOLERANCE * max(abs(told), abs(rate), abs(value), 1e-3):
            yield _rate_error(trial, law, told, rate)


def _rate_error(trial: Trial, law: Law, told: float, rate: Scalar) -> DeclarationError:
    cls = type(trial.component)
    return DeclarationError(
        f"its rate {law.options.rate!r} is {told:.6g} where its derivative is {rate:.6g}"
        f"{contradiction_at(cls, law.name, law.options.rate)}",
        where=f"{trial.part.path}.{law.name}",
        advice="Turns are counted, and speeds at the start are found, by the rate: mend one of them.",
    )


def _at(trial: Trial, law: Law) -> str:
    values = ", ".join(f"{name} = {trial.coordinates[name][0]:.3g}" for name in law.options.coordinates)
    return f" at {values}" if values else ""
