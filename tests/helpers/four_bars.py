"""Four-bars in space that stand anywhere: on the ground, on a plate that a drive turns, and on a shaft that is free."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from atwood import Frame, Result, Scene, simulate
from atwood.pipeline import assemble
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.preparation import make_problem
from atwood_library import Disc, Ground, Link, Pivot, RotaryDrive, Weld

__all__ = [
    "UPRIGHT",
    "Seen",
    "Stand",
    "apart",
    "driven",
    "four_bar",
    "governor",
    "plates",
    "run",
    "seen",
    "standing",
    "stands",
    "turned",
]

Triple = tuple[float, float, float]


def turned(angle: float, axis: Triple, vectors: np.ndarray) -> np.ndarray:
    """Return vectors, the last axis of an array, turned about an axis."""
    n = np.array(axis) / np.linalg.norm(axis)
    along = (vectors @ n)[..., None] * n
    return along + math.cos(angle) * (vectors - along) + math.sin(angle) * np.cross(n, vectors)


@dataclass(frozen=True)
class Stand:
    """How a scene stands: turned by an angle about an axis, then moved; the axis of its pivots; scales.

    What a plate stands on may be turned as a whole, by an angle about another axis, and gravity with it.
    """

    angle: float = 0.0
    axis: Triple = (0.0, 0.0, 1.0)
    place: Triple = (0.0, 0.0, 0.0)
    pivot: Triple = (0.0, -1.0, 0.0)
    length: float = 1.0
    mass: float = 1.0
    whole: float = 0.0
    about: Triple = (0.0, 0.0, 1.0)

    def turned(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors of the upright scene as they are in this one."""
        return turned(self.whole, self.about, turned(self.angle, self.axis, vectors))

    @property
    def up(self) -> Triple:
        """Return where the vertical of the upright scene points."""
        return _triple(turned(self.whole, self.about, np.array((0.0, 0.0, 1.0))))

    @property
    def weld(self) -> tuple[float, Triple]:
        """Return angle and axis of both turns together."""
        if not self.whole:
            return self.angle, self.axis
        # The product of the unit quaternions of both.
        (a, v), (b, w) = (
            (math.cos(0.5 * angle), math.sin(0.5 * angle) * np.array(axis) / np.linalg.norm(axis))
            for angle, axis in ((self.whole, self.about), (self.angle, self.axis))
        )
        vector = a * w + b * v + np.cross(v, w)
        return 2.0 * math.atan2(float(np.linalg.norm(vector)), a * b - float(v @ w)), _triple(vector)


def _triple(vector: np.ndarray) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


UPRIGHT = Stand()
IN_ORDER = (0, 1, 2, 3)


def four_bar(scene: Scene, frame: Frame, stand: Stand = UPRIGHT, order: tuple[int, ...] = IN_ORDER) -> Scene:
    """Put a four-bar with links of 1, 2.5, 2 and 2.5 on a frame, its parts in any order."""
    size = stand.length
    bars = {"crank": 1.0, "coupler": 2.5, "rocker": 2.0}
    ends: dict[str, Frame] = {"base.a": frame}
    far = scene.add("far", Weld(displacement=(2.5 * size, 0.0, 0.0)))
    scene.connect(frame, far.a)
    ends["base.b"] = far.b
    for name, length in list(bars.items())[:: 1 if order == IN_ORDER else -1]:
        mass = 0.1 * length * stand.mass
        bar = scene.add(name, Link(length=length * size, mass=mass, axial_moment=1e-3 * stand.mass * size**2))
        ends[f"{name}.a"], ends[f"{name}.b"] = bar.a, bar.b
    joins = [("base.a", "crank.a"), ("crank.b", "coupler.a"), ("coupler.b", "rocker.b"), ("base.b", "rocker.a")]
    for i in order:
        pivot = scene.add(f"pivot{i}", Pivot(axis=stand.pivot))
        scene.connect(ends[joins[i][0]], pivot.a)
        scene.connect(pivot.b, ends[joins[i][1]])
    scene.start.update({"pivot0.angle": 1.0, "pivot0.angular_velocity": 2.0})
    scene.guess.update({"pivot1.angle": -0.7, "pivot3.angle": 1.9})
    return scene


def standing(stand: Stand = UPRIGHT, order: tuple[int, ...] = IN_ORDER, t_end: float = 0.5) -> Scene:
    """Return a four-bar on the ground, without weight."""
    scene = Scene(space="space", t_end=t_end, gravity=0.0)
    ground = scene.add("ground", Ground(position=stand.place))
    base = scene.add("base", Weld(angle=stand.angle, axis=stand.axis))
    scene.connect(ground.frame, base.a)
    return four_bar(scene, base.b, stand, order)


def _weighty(stand: Stand, t_end: float) -> Scene:
    down = turned(stand.whole, stand.about, np.array((0.0, 0.0, -1.0)))
    return Scene(space="space", t_end=t_end, gravity_direction=_triple(down))


def driven(stand: Stand, rate: float = 3.0, t_end: float = 0.6) -> Scene:
    """Return a four-bar on a plate that turns about the vertical at a given rate."""
    scene, (angle, axis) = _weighty(stand, t_end), stand.weld
    ground = scene.add("ground", Ground(position=stand.place))
    drive = scene.add("drive", RotaryDrive(axis=stand.up, rotation=lambda t: rate * t))
    plate = scene.add("plate", Weld(angle=angle, axis=axis))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, plate.a)
    return four_bar(scene, plate.b, stand)


def governor(stand: Stand, t_end: float = 0.6) -> Scene:
    """Return a four-bar on a shaft that is free to turn."""
    scene, (angle, axis) = _weighty(stand, t_end), stand.weld
    ground, bearing = scene.add("ground", Ground(position=stand.place)), scene.add("bearing", Pivot(axis=stand.up))
    disc, plate = scene.add("disc", Disc(mass=1.0)), scene.add("plate", Weld(angle=angle, axis=axis))
    scene.connect(ground.frame, bearing.a)
    scene.connect(bearing.b, plate.a)
    scene.connect(plate.b, disc.frame)
    scene.start["bearing.angular_velocity"] = 2.0
    return four_bar(scene, plate.b, stand)


# -- at the start -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Seen:
    """What a scene is at its start: freedoms, redundant constraints by path, accelerations, forces of its pivots."""

    freedom: int
    redundant: tuple[str, ...]
    acceleration: np.ndarray
    forces: np.ndarray


def seen(scene: Scene, form: str) -> Seen:
    """Return what a scene is at its start."""
    assembly = assemble(scene, form=form)
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    at = np.array([start.time]), q[:, None], u[:, None]
    solver = ReactionSolver(assembly, start.time, q, u)
    values = dict(zip((one.path for one in assembly.reactions), solver.at(*at)[0][:, 0], strict=True))
    forces = [[values[f"pivot{k}.force.{axis}"] for axis in "xyz"] for k in range(4)]
    names = [one.name for one in assembly.own_equations.speed_names]
    turning = [i for i, name in enumerate(names) if form == "reduced" and "pivot0" in name]
    own = solver.own_accelerations(*at, plan.finding)[turning, 0]
    paths = tuple(assembly.own_equations.constraints[i].key[0] for i in plan.finding.redundant)
    return Seen(len(u) - plan.finding.rank, paths, own, np.array(forces))


# -- places -----------------------------------------------------------------------------------------------------------


def stands(count: int, seed: int = 5, farthest: float = 6.0) -> Iterator[Stand]:
    """Yield orientations and places: near and far from coordinate planes, near and far from the origin."""
    random = np.random.default_rng(seed)
    for i in range(count):
        angle = random.uniform(-math.pi, math.pi) if i % 2 else 10.0 ** random.uniform(-12.0, 0.0)
        axis, place = random.standard_normal(3), random.standard_normal(3) * 10.0 ** random.uniform(-3.0, farthest)
        yield Stand(float(angle), _triple(axis), _triple(place))


def plates(count: int, seed: int = 23, anywhere: bool = False) -> Iterator[Stand]:
    """Yield angles and places of a plate that turns about the vertical, or about any axis with gravity along it."""
    wholes = stands(count, seed + 1)
    for one, other in zip(stands(count, seed), wholes, strict=True):
        plate = Stand(one.angle, place=one.place)
        yield replace(plate, whole=other.angle, about=other.axis) if anywhere else plate


# -- along runs -------------------------------------------------------------------------------------------------------


def run(scene: Scene, form: str, rtol: float = 1e-12) -> Result:
    """Return a run that went to its end."""
    found = simulate(scene, form=form, rtol=rtol, outputs=13)
    assert found.status == "finished"
    return found


def apart(found: Result, expected: Result, stand: Stand) -> tuple[float, float]:
    """Return by how much a turned run differs, relative to the size: in motion, and in the forces of its pivots."""
    paths = ("pivot1.angle", "pivot3.angle", "pivot3.angular_velocity")
    motion = max(
        float(np.max(np.abs(found.array(path) - there)) / max(1.0, np.max(np.abs(there))))
        for path, there in ((path, expected.array(path)) for path in paths)
    )
    gaps = []
    for pivot in ("pivot0", "pivot1", "pivot2", "pivot3"):
        here, there = (np.stack([one.array(f"{pivot}.force.{x}") for x in "xyz"], 1) for one in (found, expected))
        gaps.append(np.max(np.abs(here - stand.turned(there))) / np.max(np.abs(there)))
    return motion, float(max(gaps))
