"""Starts in which everything is said fit together, however much of it follows from the rest."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from atwood import Result, Scene, StartError, assemble, simulate, sin
from atwood.simulation.initialization.start import find_start
from atwood_library import Drive, Ground, Link, Pivot, PointMass, RigidBody, Slider, Weld
from atwood_library.scenes import SCENES

FORMS = ("reduced", "dae")


def four_bar(speed: float) -> Scene:
    """Return a four-bar in space, in the plane x-z, with the speeds of its crank said."""
    scene = Scene(space="space", gravity=0.0)
    ground, far = scene.add("ground", Ground()), scene.add("far", Weld(displacement=(2.5, 0.0, 0.0)))
    scene.connect(ground.frame, far.a)
    lengths = {"crank": 1.0, "coupler": 2.5, "rocker": 2.0}
    bars = [scene.add(name, Link(length=size, mass=size, axial_moment=1e-3)) for name, size in lengths.items()]
    joins = [(ground.frame, bars[0].a), (bars[0].b, bars[1].a), (bars[1].b, bars[2].b), (far.b, bars[2].a)]
    for i, (one, other) in enumerate(joins):
        pivot = scene.add(f"pivot{i}", Pivot())
        scene.connect(one, pivot.a)
        scene.connect(pivot.b, other)
    scene.start["pivot0.angle"] = 1.0
    scene.guess.update({"pivot1.angle": -0.7, "pivot3.angle": 1.9})
    scene.start["pivot0.angular_velocity"] = speed
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("speed", [2.0, 0.0])
def test_speeds_of_rounding_are_none(form: str, speed: float) -> None:
    """All velocities are said, with what rounding leaves across the plane, or of a mechanism at rest."""
    random, scene = np.random.default_rng(1), four_bar(speed)
    moving = simulate(scene, t_end=1e-3, outputs=2)
    for name in ("crank", "coupler", "rocker"):
        for axis in "xyz":
            exact = moving.at(0)[f"{name}.velocity.{axis}"]
            scene.start[f"{name}.velocity.{axis}"] = exact + 1e-15 * random.standard_normal()
    found = simulate(scene, form=form, t_end=0.1, outputs=2, rtol=1e-9)
    assert found.at(0)["pivot0.angular_velocity"] == pytest.approx(speed, abs=1e-12)


def test_speeds_that_are_more_than_rounding_still_contradict() -> None:
    for speed in (2.0, 0.0):
        scene = four_bar(speed)
        scene.start["rocker.velocity.y"] = 1e-9
        with pytest.raises(StartError, match=r"rocker\.velocity\.y"):
            find_start(assemble(scene))


@pytest.mark.parametrize("form", FORMS)
def test_a_prescribed_speed_may_be_said_as_well_as_it_is_known(form: str) -> None:
    """Nothing can change the speed of a drive: what is said of it is compared with what rounding makes of that."""
    for off, is_met in ((3e-13, True), (-3e-13, True), (1e-7, False)):
        scene = Scene(space="plane")
        ground, bob = scene.add("ground", Ground(angle=0.7)), scene.add("bob", PointMass(mass=1.0))
        drive = scene.add("drive", Drive(axis=(0.6, 0.0, 0.8), motion=lambda t: 0.3 + 2.0 * sin(1.7 * t + 0.4)))
        scene.connect(ground.frame, drive.a)
        scene.connect(drive.b, bob.point)
        rate = 3.4 * math.cos(0.4)
        along = 0.6 * math.cos(0.7) - 0.8 * math.sin(0.7)
        scene.start["bob.velocity.x"] = rate * along + off
        if is_met:
            assert simulate(scene, form=form, t_end=0.1, outputs=2).status == "finished"
        else:
            with pytest.raises(StartError, match=r"bob\.velocity\.x"):
                find_start(assemble(scene, form=form))


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_a_speed_that_nothing_can_have_is_measured_as_a_speed(scale: float) -> None:
    """A carriage on a level rail has no speed upwards; what rounding says of it is none in any unit of time."""
    scene = Scene(space="plane", gravity=0.0)
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    body, pivot = scene.add("body", RigidBody(mass=2.0, moments=(0.2, 0.3, 0.2))), scene.add("pivot", Pivot())
    arm = scene.add("arm", Link(length=1.0, mass=0.7))
    for one, other in ((ground.frame, rail.a), (rail.b, body.frame), (body.frame, pivot.a), (pivot.b, arm.a)):
        scene.connect(one, other)
    scene.start.update({"body.position.x": 0.4, "body.velocity.x": 20.0 * scale, "body.velocity.z": -3e-15 * scale})
    scene.start.update({"pivot.angle": 0.5, "pivot.angular_velocity": 7.0 * scale})
    found = simulate(scene, t_end=1e-3 / scale, outputs=2)
    assert found["body.velocity.x"][0] == pytest.approx(20.0 * scale)
    scene.start["body.velocity.z"] = -3e-3 * scale
    with pytest.raises(StartError, match=r"body\.velocity\.z"):
        simulate(scene, t_end=1e-3 / scale, outputs=2)


def test_what_another_run_has_left_of_a_speed_is_a_start() -> None:
    """States are handed on as they are, with numbers whose squares are none."""
    scene = Scene(space="plane", gravity=0.0)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    link = scene.add("link", Link(length=1.0, mass=1.0))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.start.update({"pivot.angle": 0.3, "pivot.angular_velocity": 1.6e-206})
    found = simulate(scene, t_end=0.1, outputs=2)
    assert found["pivot.angle"][-1] == pytest.approx(0.3, abs=1e-15)


# -- what a run said ---------------------------------------------------------------------------------------------------

ROTATING = ("phi", "theta", "psi")


def said_by(result: Result) -> dict[str, float]:
    """Return all positions, orientations and speeds at the end of a run."""
    bodies = [path.removesuffix(".theta") for path in result if path.endswith(".theta")]
    paths = [f"{body}.{name}" for body in bodies for name in ROTATING]
    for path in result:
        last = path.rpartition(".")[2]
        if last in ("angle", "displacement", "angular_velocity", "speed") or re.search(
            r"\.(position|velocity|spin)\.", path
        ):
            paths.append(path)
    return {path: float(result[path][-1]) for path in paths if np.isfinite(result[path][-1])}


RESTARTED = (
    *("four-bar", "slider-crank", "andrews-squeezer", "scott-russell-lift", "bricard", "gyroscope", "heavy-top"),
    *("lagrange-top", "stewart-platform", "double-pendulum-3d", "spherical-pendulum", "benchmark-bicycle", "trebuchet"),
)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", RESTARTED)
def test_what_a_run_says_is_a_start(name: str, form: str) -> None:
    """All of it is said, many times what would do, with the rounding that it has."""
    scene = SCENES[name]()
    end = min(0.1, scene.t_end)
    said = said_by(simulate(scene, form=form, t_end=end, outputs=2))
    again = SCENES[name](t_start=end, t_end=2.0 * end)
    again.start.clear()
    again.start.update(said)
    found = simulate(again, form=form, t_end=end + 1e-6, outputs=2)
    for path, value in said.items():
        assert found[path][0] == pytest.approx(value, rel=1e-7, abs=1e-7), path


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", [name for name in RESTARTED if name != "benchmark-bicycle"])
def test_rounding_at_rest_is_no_contradiction(name: str, form: str) -> None:
    said = said_by(simulate(SCENES[name](), form=form, t_end=1e-6, outputs=2))
    chance = np.random.default_rng(2)
    for size in (1e-16, 1e-14, 1e-12):
        scene = SCENES[name]()
        scene.start.clear()
        for path, value in said.items():
            is_speed = re.search(r"(angular_velocity|speed)$|\.(velocity|spin)\.", path)
            scene.start[path] = size * chance.uniform(-1.0, 1.0) if is_speed else value
        result = simulate(scene, form=form, t_end=1e-6, outputs=2)
        assert np.max(np.abs(result.run.segments[0].speeds[:, 0])) < 1e-7  # of parts of millimetres


def test_speeds_that_would_part_what_is_joined_contradict_each_other() -> None:
    """However slow they are, for a scene that lasts as long."""
    for span in (1.0, 1e9):
        scene = SCENES["double-pendulum"](t_end=span)
        scene.start.update({"rod1.angular_velocity": 1e-3 / span, "bob1.velocity.x": 2e-3 / span})
        scene.start["bob1.velocity.z"] = 0.0
        with pytest.raises(StartError, match="contradict"):
            simulate(scene, t_end=1e-3 * span)
