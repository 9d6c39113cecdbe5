"""Motion in space that by symmetry stays in a plane or on a line.

A motion that starts parallel to a plane stays so if at every place that such motion can reach, whatever the speeds
parallel to the plane are, no acceleration leads out of it. That is looked at at the start and at places near by, chosen
at random; what the clock and switches decide is chosen at random too (`generic_switches`), so that a push that
comes later is not overlooked. Where forces are analytic functions of the state, what holds at all places near by holds
everywhere. The symmetry may be an unstable one: then the least push in space leads away from the plane for good.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import least_norm
from atwood.numerics.newton import Missing, newton
from atwood.numerics.rank import decompose, null_space
from atwood.simulation.initialization.start import Start, find_start
from atwood.theory.symmetry.generic import Bodies, LooseScene
from atwood.tolerances import tolerances

_NEAR = 1e-12
"""Relative to the scene's sizes: what leads out of the plane by less at places near by, where accelerations are solved
for, is rounding; at the start it is `tolerances.MET`."""

_PLACED = 1e-10
"""The same for a place that is all but found, and which further steps take no nearer."""

_SAMPLES, _SAMPLES_WITH_SWITCHES = 6, 24
_REACHES = (0.6, 0.2, 0.05)
"""How far places near by are, in radians and lengths of the scene; nearer ones where constraints do not let it."""

_LARGEST = 120
"""Scenes with more speeds are not looked at: it would take longer than they do to assemble."""

_AXES = np.eye(3)


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A plane or a line that a motion stays parallel to.

    Attributes
    ----------
    space
        ``"plane"`` or ``"line"``.
    direction
        Unit normal of the plane, or unit vector along the line, in world axes.
    """

    space: Literal["plane", "line"]
    direction: FloatArray

    @property
    def name(self) -> str:
        """What it is called: ``"in the plane x-z"``, ``"on a line along z"``."""
        along = [axis for axis, unit in zip("xyz", _AXES, strict=True) if abs(self.direction @ unit) > 1.0 - 1e-12]
        numbers = ", ".join(f"{component + 0.0:.4g}" for component in self.direction)
        if self.space == "line":
            return f"on a line along {along[0] if along else f'({numbers})'}"
        return f"in the plane {'-'.join('xyz'.replace(along[0], ''))}" if along else f"in a plane square to ({numbers})"


def find_symmetries(assembly: Assembly, start: Start) -> tuple[Symmetry, ...]:
    """Return the line and the plane that a motion in space stays parallel to; those that there are.

    Nothing is claimed where it cannot be made sure of, or where nothing moves.
    """
    if not assembly.mechanism.space.is_spatial or not 0 < len(assembly.reduced.speeds) <= _LARGEST:
        return ()
    if assembly.balance("reduced").mass_product is not None:
        return ()
    try:
        scene = LooseScene(assembly, start)
        others = [LooseScene(other, find_start(other)) for other in _other_modes(assembly)]
        found = []
        for space in ("line", "plane"):
            for one in _candidates(scene, space):
                if _stays(scene, one) and all(_stays(other, one) for other in others):
                    found.append(one)
                    break
    except (AtwoodError, np.linalg.LinAlgError):
        return ()
    return tuple(found)


def _other_modes(assembly: Assembly) -> Iterator[Assembly]:
    """Yield the scene with each part that has modes in another one."""
    for path, mode in assembly.modes.items():
        for other in assembly.flat.parts[path].component.modes:
            if other != mode:
                yield assembly.other_mode({**assembly.modes, path: other}, {})


# -- where it may stay -----------------------------------------------------------------------------------------------


def _candidates(scene: LooseScene, space: str) -> Iterator[Symmetry]:
    """Yield the lines or planes that the start does not speak against, those of the world's axes first."""
    t, q, u = scene.start.time, scene.start.coordinates, scene.start.speeds
    scene.exactly()
    length = scene.start.length
    _, now = scene.at(t, q, u)
    later = scene.accelerations(t, q, u)
    pace = _pace(scene, now, later)
    if pace == 0.0:
        return
    shifts = np.concatenate([now.velocities / pace, later.velocities / pace**2]) / length
    turns = np.concatenate([now.spins / pace, later.spins / pace**2])
    if space == "line":
        if np.max(np.abs(turns), initial=0.0) > tolerances.MET:
            return
        tried = [_longest(shifts)]
    elif np.max(np.abs(turns), initial=0.0) > tolerances.MET:
        tried = [_longest(turns)]
    else:
        found = decompose(shifts, np.full(len(shifts), tolerances.MET))
        apart = (now.places - now.places[:1]) / length
        across = [np.cross(found.right[0], one) for one in apart]
        tried = [*_AXES[[1, 0, 2]], *across] if found.rank == 1 else [found.right[2]] if found.rank == 2 else []
    for one in tried:
        size = float(np.linalg.norm(one))
        if size > 1e-6:
            symmetry = Symmetry("line" if space == "line" else "plane", _rounded(one / size))
            if not _leads_out(symmetry, shifts, turns, tolerances.MET):
                yield symmetry


def _pace(scene: LooseScene, now: Bodies, later: Bodies) -> float:
    """Return how fast the scene moves at the start, 1/s; zero if it rests and stays at rest."""
    length = scene.start.length
    rates = [np.abs(now.velocities).ravel() / length, np.abs(now.spins).ravel()]
    rates += [np.sqrt(np.abs(later.velocities).ravel() / length), np.sqrt(np.abs(later.spins).ravel())]
    fastest = float(np.max(np.concatenate(rates), initial=0.0))
    weight = np.sqrt(abs(scene.assembly.flat.gravity) / length)
    return fastest if fastest > 1e-6 * weight else 0.0


def _longest(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors[int(np.argmax(np.linalg.norm(vectors, axis=1)))])


def _rounded(direction: FloatArray) -> FloatArray:
    """Return a unit vector, its largest component positive; along an axis of the world if it is but for rounding."""
    direction = direction * np.sign(direction[int(np.argmax(np.abs(direction)))])
    for unit in _AXES:
        if np.linalg.norm(direction - unit) < 10.0 * tolerances.MET:
            return unit
    direction = np.where(np.abs(direction) < 1e-12, 0.0, direction)
    return np.asarray(direction / np.linalg.norm(direction))


def _outward(one: Symmetry) -> tuple[FloatArray, FloatArray]:
    """Return the directions, as rows, along which no point may move, and about which nothing may turn."""
    across = null_space(one.direction[None]).T
    return (one.direction[None], across) if one.space == "plane" else (across, _AXES)


def _leads_out(one: Symmetry, shifts: FloatArray, turns: FloatArray, tolerance: float) -> bool:
    """Return whether scaled velocities or accelerations lead out of the plane or off the line."""
    points, axes = _outward(one)
    size = max(1.0, float(np.max(np.abs(shifts), initial=0.0)), float(np.max(np.abs(turns), initial=0.0)))
    out = [np.abs(shifts @ points.T).ravel(), np.abs(turns @ axes.T).ravel()]
    return bool(np.max(np.concatenate(out), initial=0.0) > tolerance * size)


# -- whether it stays ------------------------------------------------------------------------------------------------


def _stays(scene: LooseScene, one: Symmetry) -> bool:
    """Return whether nothing leads out of the plane or off the line, at the start and near by."""
    random = np.random.default_rng(20070614)
    t, q = scene.start.time, scene.start.coordinates
    scene.exactly()
    _, first = scene.at(t, q, np.zeros(len(scene.sizes)))
    _, moving = scene.at(t, q, scene.start.speeds)
    pace = _pace(scene, moving, scene.accelerations(t, q, scene.start.speeds)) or 1.0
    count = _SAMPLES if scene.loosened.is_plain else _SAMPLES_WITH_SWITCHES
    span = max(scene.assembly.flat.t_end - t, 0.0)
    for number in range(count):
        moment = t + span * float(random.uniform()) if number else t
        scene.exactly()
        place = _place(scene, one, moment, first, random)
        if place is None:
            return False
        speeds = _speeds(scene, one, moment, place, pace, random)
        if speeds is None:
            return False
        if number and not scene.loosened.is_plain:
            scene.loosely(moment, place, speeds, random, number - 1)
        later = scene.accelerations(moment, place, speeds)
        _, now = scene.at(moment, place, speeds)
        rates = np.concatenate([now.velocities / scene.start.length, now.spins])
        size = pace**2 + float(np.max(np.abs(rates), initial=0.0)) ** 2
        if _leads_out(one, later.velocities / scene.start.length / size, later.spins / size, _NEAR):
            return False
    return True


def _place(scene: LooseScene, one: Symmetry, t: float, first: Bodies, random: np.random.Generator) -> FloatArray | None:
    """Return a place near the start that motion parallel to the plane leads to; None if none is found."""
    still = np.zeros(len(scene.sizes))
    now, bodies = scene.at(t, scene.start.coordinates, still)
    free = null_space(np.concatenate([now.jacobian[scene.holonomic], _slopes(one, bodies)]) * scene.sizes)
    moved = partial(scene.kinematic_map.moved, t)

    def look(q: FloatArray) -> Missing:
        now, bodies = scene.at(t, q, still)
        misses = np.concatenate([now.value[scene.holonomic], _misses(one, bodies, first)])
        slopes = np.concatenate([now.jacobian[scene.holonomic], _slopes(one, bodies)])
        shifts = bodies.by_place.shape[0] * len(_outward(one)[0])
        return Missing(misses, scene.row_units(t, q, slopes * scene.sizes, shifts), lambda: slopes)

    for reach in _REACHES:
        step = reach * scene.sizes * (free @ random.uniform(-1.0, 1.0, free.shape[1]))
        q = moved(scene.start.coordinates, step)
        q, left = newton(look, moved, q, scene.sizes, steps=20, met=_PLACED, exact=_NEAR)
        if left.miss < _PLACED:
            return q
    return None


def _speeds(
    scene: LooseScene, one: Symmetry, t: float, q: FloatArray, pace: float, random: np.random.Generator
) -> FloatArray | None:
    """Return speeds parallel to the plane that meet all constraints; None if there are none."""
    now, bodies = scene.at(t, q, np.zeros(len(scene.sizes)))
    points, axes = _outward(one)
    explicit_rate = np.concatenate(
        [now.explicit_rate, (bodies.velocities @ points.T).ravel(), (bodies.spins @ axes.T).ravel()]
    )
    slopes = np.concatenate([now.jacobian, _slopes(one, bodies)]) * scene.sizes
    u = least_norm(slopes, -explicit_rate)
    if np.max(np.abs(slopes @ u + explicit_rate), initial=0.0) > _NEAR * max(
        float(np.max(np.abs(explicit_rate), initial=0.0)), 1e-300
    ):
        return None
    free = null_space(slopes)
    return np.asarray(scene.sizes * (u + pace * (free @ random.uniform(-1.0, 1.0, free.shape[1]))))


def _slopes(one: Symmetry, bodies: Bodies) -> FloatArray:
    """Return what the speeds do to the distance from the plane or line and to what turns out of it, row by row."""
    points, axes = _outward(one)
    count = bodies.by_place.shape[2]
    found = [
        np.einsum("ki,bij->bkj", points, bodies.by_place).reshape(-1, count),
        np.einsum("ki,bij->bkj", axes, bodies.by_spin).reshape(-1, count),
    ]
    return np.concatenate(found)


def _misses(one: Symmetry, bodies: Bodies, first: Bodies) -> FloatArray:
    """Return by how much bodies have left the plane or line, and turned out of it, in the order of `_slopes`."""
    points, axes = _outward(one)
    away = (bodies.places - first.places) @ points.T
    # What the axes of a body were at first, and are now, as rows; of a plane only its normal has to stay.
    kept = one.direction[None] if one.space == "plane" else _AXES
    in_body = np.einsum("bij,kj->bki", first.axes, kept)
    seen = np.einsum("bki,bij->bkj", in_body, bodies.axes)
    turned = np.sum(np.cross(np.broadcast_to(kept, seen.shape), seen), axis=1) / (1.0 if len(kept) == 1 else 2.0)
    return np.concatenate([away.ravel(), (turned @ axes.T).ravel()])
