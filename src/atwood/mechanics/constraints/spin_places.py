"""Places of a part's connectors at random, where its joints put them, and how they move when a body spins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, evaluate
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import FREE, as_rotation

if TYPE_CHECKING:
    from atwood.mechanics.constraints.shared_spin import Axis


@dataclass(frozen=True, eq=False)
class Place:
    """Where the connectors of a part are and how they move, in numbers.

    Attributes
    ----------
    numbers
        The values of all symbols of its laws.
    lines
        For each connector on a body that may spin: the body, the axis in the world, and the arm from it in the world.
    size
        A length, m.
    """

    numbers: Mapping[Expression, float]
    lines: Mapping[str, tuple[int, FloatArray, FloatArray]]
    size: float

    def motion(self, name: str, body: int) -> tuple[FloatArray, FloatArray]:
        """Return velocity and angular velocity of a connector when a body spins by one radian a second."""
        own, axis, arm = self.lines.get(name, (-1, np.zeros(3), np.zeros(3)))
        return (np.cross(axis, arm), axis) if own == body else (np.zeros(3), np.zeros(3))

    def sizes(self, local: LocalPart) -> list[float]:
        """Return how large a change of each symbol of all connectors would be ordinary."""
        found: list[float] = []
        for one in local.connectors.values():
            found += [self.size] * 3 + [1.0] * len(one.orientation) + [self.size] * 3 + [1.0] * len(one.spin)
        return found

    def moves(self, local: LocalPart, body: int, is_rate: bool) -> list[float]:
        """Return how the symbols of all connectors change when a body spins: places alone, or rates alone."""
        found: list[float] = []
        for name, one in local.connectors.items():
            velocity, spin = self.motion(name, body)
            axes = [np.array([self.numbers[c] for c in axis]) for axis in one.axes or ()]
            turned = [float(c) for axis in axes for c in np.cross(spin, axis)]
            places = [*velocity.tolist(), *turned]
            rates = [*velocity.tolist(), *spin.tolist()[: len(one.spin)]]
            found += [0.0] * len(places) + rates if is_rate else places + [0.0] * len(rates)
        return found


def places_of(
    mechanism: Mechanism,
    path: str,
    local: LocalPart,
    axes: Mapping[int, Axis],
    known: Mapping[Expression, float],
    count: int,
) -> Iterator[Place]:
    """Yield places of a part, at random but as its joints allow."""
    chance = np.random.default_rng(1)
    size = (
        max((float(np.linalg.norm(arm)) for one in axes.values() for arm in one.offsets.values()), default=1.0) or 1.0
    )
    for _ in range(count):
        positions = {name: size * chance.normal(size=3) for name in local.connectors}
        frames = {name: np.linalg.qr(chance.normal(size=(3, 3)))[0] for name in local.connectors}
        frames = {name: one * np.sign(np.linalg.det(one)) for name, one in frames.items()}
        _join(local, positions, frames, {**known, **_coordinates(local, chance, size)})
        numbers = dict(known)
        for name, one in local.connectors.items():
            numbers |= dict(zip(one.position, positions[name].tolist(), strict=True))
            numbers |= dict(zip(one.velocity, (size * chance.normal(size=3)).tolist(), strict=True))
            numbers |= dict(zip(one.orientation, frames[name].T.ravel().tolist(), strict=one.axes is not None))
            numbers |= dict(zip(one.spin, chance.normal(size=len(one.spin)).tolist(), strict=True))
        yield Place(numbers, _lines(mechanism, path, local, axes, frames), size)


def _coordinates(local: LocalPart, chance: np.random.Generator, size: float) -> dict[Expression, float]:
    symbols = [symbol for joint in local.joints for symbol in joint.coordinates]
    return dict(zip(symbols, (size * chance.normal(size=len(symbols))).tolist(), strict=True))


def _join(
    local: LocalPart,
    positions: dict[str, FloatArray],
    frames: dict[str, FloatArray],
    known: Mapping[Expression, float],
) -> None:
    """Put the ends of joints where these have them; the columns of a frame are its axes in the world."""
    graph = next(iter(local.connectors.values())).position[0].graph
    for joint in local.joints:
        a, b, placement = joint.law.options.a, joint.law.options.b, joint.placement
        if a not in positions or b not in positions:
            continue  # the world's own
        shift = np.array(evaluate([graph.convert(c) for c in placement.displacement], known))
        positions[b] = positions[a] + (frames[a] @ shift if placement.axes == "a" else shift)
        if placement.rotation is not None and placement.rotation is not FREE:
            turned = as_rotation(placement.rotation).axes()
            columns = [evaluate([graph.convert(c) for c in axis], known) for axis in turned]
            frames[b] = frames[a] @ np.array(columns).T


def _lines(
    mechanism: Mechanism, path: str, local: LocalPart, axes: Mapping[int, Axis], frames: Mapping[str, FloatArray]
) -> dict[str, tuple[int, FloatArray, FloatArray]]:
    node_of, body_of = mechanism.graph.node_of, mechanism.bodies.body_of
    found = {}
    for name, connector in local.connectors.items():
        node = node_of[path, name]
        body = body_of[node]
        if body not in axes:
            continue
        one = axes[body]
        # Where only a point is on the body, it may be turned in any way.
        to_world = frames[name] @ one.turns[node].T if connector.axes is not None else frames[name]
        found[name] = body, to_world @ one.direction, to_world @ (one.offsets[node] - one.point)
    return found
