"""Scenes turned and moved: what a mechanism is does not depend on where it stands.

A four-bar in space has three constraints too many, whichever way its plane lies. `turned_four_bars(count)` tries as
many orientations and places as one likes: `python -m tests.scenes.test_turned 200`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from atwood import Frame, Result, Scene, simulate
from atwood_library import Disc, Ground, Link, Pivot, RotaryDrive, Weld

FORMS = ("reduced", "dae")
Triple = tuple[float, float, float]


def turned(angle: float, axis: Triple, vectors: np.ndarray) -> np.ndarray:
    """Return vectors, the last axis of an array, turned about an axis."""
    n = np.array(axis) / np.linalg.norm(axis)
    along = (vectors @ n)[..., None] * n
    return along + math.cos(angle) * (vectors - along) + math.sin(angle) * np.cross(n, vectors)


@dataclass(frozen=True)
class Stand:
    """How a scene stands: turned by an angle about an axis, then moved; the axis of its pivots; scales."""

    angle: float = 0.0
    axis: Triple = (0.0, 0.0, 1.0)
    place: Triple = (0.0, 0.0, 0.0)
    pivot: Triple = (0.0, -1.0, 0.0)
    length: float = 1.0
    mass: float = 1.0


def four_bar(scene: Scene, frame: Frame, stand: Stand = Stand(), order: tuple[int, ...] = (0, 1, 2, 3)) -> Scene:
    """Put a four-bar with links of 1, 2.5, 2 and 2.5 on a frame, its parts in any order."""
    size = stand.length
    bars = {"crank": 1.0, "coupler": 2.5, "rocker": 2.0}
    ends: dict[str, Frame] = {"base.a": frame}
    far = scene.add("far", Weld(displacement=(2.5 * size, 0.0, 0.0)))
    scene.connect(frame, far.a)
    ends["base.b"] = far.b
    for name, length in list(bars.items())[:: 1 if order[0] == 0 else -1]:
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


def standing(stand: Stand = Stand(), order: tuple[int, ...] = (0, 1, 2, 3), t_end: float = 1.0) -> Scene:
    """Return a four-bar on the ground, without weight."""
    scene = Scene(space="space", t_end=t_end, gravity=0.0)
    ground = scene.add("ground", Ground(position=stand.place))
    base = scene.add("base", Weld(angle=stand.angle, axis=stand.axis))
    scene.connect(ground.frame, base.a)
    return four_bar(scene, base.b, stand, order)


def driven(rate: float, stand: Stand, t_end: float = 3.0) -> Scene:
    """Return a four-bar on a plate that turns about the vertical at a given rate."""
    scene = Scene(space="space", t_end=t_end)
    ground = scene.add("ground", Ground())
    drive = scene.add("drive", RotaryDrive(axis=(0.0, 0.0, 1.0), rotation=lambda t: rate * t))
    plate = scene.add("plate", Weld(angle=stand.angle, axis=stand.axis))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, plate.a)
    return four_bar(scene, plate.b, stand)


def governor(stand: Stand, t_end: float = 3.0) -> Scene:
    """Return a four-bar on a shaft that is free to turn."""
    scene = Scene(space="space", t_end=t_end)
    ground, bearing = scene.add("ground", Ground()), scene.add("bearing", Pivot(axis=(0.0, 0.0, 1.0)))
    disc, plate = scene.add("disc", Disc(mass=1.0)), scene.add("plate", Weld(angle=stand.angle, axis=stand.axis))
    scene.connect(ground.frame, bearing.a)
    scene.connect(bearing.b, plate.a)
    scene.connect(bearing.b, disc.frame)
    scene.start["bearing.angular_velocity"] = 2.0
    return four_bar(scene, plate.b, stand)


# -- on the ground ----------------------------------------------------------------------------------------------------

ANGLES = ("pivot1.angle", "pivot3.angle", "pivot3.angular_velocity")


def run(scene: Scene, form: str, rtol: float = 1e-11) -> Result:
    found = simulate(scene, form=form, rtol=rtol, outputs=11)
    assert found.status == "finished"
    return found


def forces(result: Result, joint: str) -> np.ndarray:
    return np.stack([result.array(f"{joint}.force.{axis}") for axis in "xyz"], axis=1)


def missed(found: Result, expected: Result, stand: Stand, joints: tuple[str, ...] = ("pivot0", "pivot2")) -> float:
    """Return by how much a turned run differs, in motion and in reactions, those that are not unique too."""
    gaps = [float(np.max(np.abs(found.array(path) - expected.array(path)))) for path in ANGLES]
    for joint in joints:
        force = turned(stand.angle, stand.axis, forces(expected, joint)) * stand.mass * stand.length
        gaps.append(float(np.max(np.abs(forces(found, joint) - force)) / np.max(np.abs(force))))
    return max(gaps)


def stands(count: int, seed: int = 5) -> Iterator[Stand]:
    """Yield orientations and places: near and far from coordinate planes, near and far from the origin."""
    random = np.random.default_rng(seed)
    for i in range(count):
        angle = random.uniform(-math.pi, math.pi) if i % 2 else 10.0 ** random.uniform(-12.0, 0.0)
        axis, place = random.standard_normal(3), random.standard_normal(3) * 10.0 ** random.uniform(-3.0, 3.0)
        yield Stand(float(angle), tuple(axis.tolist()), tuple(place.tolist()))


EXACT = tuple(
    Stand(math.radians(degrees), axis)
    for degrees in (math.degrees(1e-6), 1.0, 10.0, 30.0, 45.0, 90.0, 180.0)
    for axis in ((0.0, 0.0, 1.0),)
)


@pytest.fixture(scope="module", params=FORMS)
def upright(request: pytest.FixtureRequest) -> tuple[str, Result]:
    return request.param, run(standing(), request.param)


@pytest.mark.parametrize("stand", [EXACT[0], EXACT[3], *stands(2)], ids=lambda stand: f"{stand.angle:.3g}")
def test_a_turned_four_bar_is_the_same(upright: tuple[str, Result], stand: Stand) -> None:
    form, expected = upright
    found = run(standing(stand), form)
    far = max(1.0, float(np.linalg.norm(stand.place)))  # where coordinates are known no better
    assert missed(found, expected, stand) < 1e-8 + 1e-13 * far
    segment, other = found.run.segments[0].plan.finding, expected.run.segments[0].plan.finding
    assert segment.rank - other.rank == len(segment.kept) - len(other.kept)


def turned_four_bars(count: int) -> list[str]:
    """Return what goes wrong with four-bars in some random orientations and places, in words."""
    wrong = []
    for form in FORMS:
        expected = run(standing(), form)
        for i, stand in enumerate(stands(count, seed=17)):
            try:
                found = run(standing(stand), form)
                gap = missed(found, expected, stand)
                if not gap < 1e-8 + 1e-13 * float(np.linalg.norm(stand.place)):
                    wrong.append(f"{form} {i}: differs by {gap:.3g}: {stand}")
            except Exception as error:
                wrong.append(f"{form} {i}: {type(error).__name__}: {error}: {stand}")
    return wrong


if __name__ == "__main__":
    found = turned_four_bars(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    print("\n".join(found) or "all alike")
