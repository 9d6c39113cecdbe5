"""Bodies that float far from the origin, or fast, move against each other as they do near it and at rest."""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import atwood
from atwood import Result, Scene, simulate
from atwood.simulation.dynamics.scales import scene_length
from atwood_library import Ground, Link, Mass1D, Pivot, PointMass, Potential, RigidBody, Spring

REST, START, STIFFNESS = 0.9, 1.2, 4.0

FAST = math.sqrt(STIFFNESS * 1.5)
"""Rate of the vibration of 1 kg against 2 kg, rad/s."""

WAYS: dict[str, dict[str, Any]] = {
    "accuracy": {"accuracy": 1e-8},
    "auto": {},
    "tight": {"rtol": 1e-11},
    "ida": {"solver": "ida", "rtol": 1e-9},
    "taylor": {"solver": "taylor"},
}


def add_pair(scene: Scene, name: str, place: Sequence[float], speed: Sequence[float], way: int = 0) -> Any:
    """Add 1 kg and 2 kg that a spring joins, along one of the axes; return the end of the first."""
    if scene.space == "line":
        parts: Any = [scene.add(f"{name}{k}", Mass1D(mass=float(k))) for k in (1, 2)]
        ends, names = [one.flange for one in parts], [["displacement"], ["speed"]]
    else:
        parts = [scene.add(f"{name}{k}", PointMass(mass=float(k))) for k in (1, 2)]
        axes = "xz" if scene.space == "plane" else "xyz"
        ends, names = [one.point for one in parts], [[f"{what}.{x}" for x in axes] for what in ("position", "velocity")]
    spring = scene.add(f"{name}s", Spring(stiffness=STIFFNESS, natural_length=REST))
    scene.connect(spring.a, ends[0])
    scene.connect(spring.b, ends[1])
    for k, (path, rate) in enumerate(zip(*names, strict=True)):
        for number in (1, 2):
            scene.start[f"{name}{number}.{path}"] = place[k] + (START if (k, number) == (way, 2) else 0.0)
            scene.start[f"{name}{number}.{rate}"] = speed[k]
    return ends[0]


def distance(result: Result, name: str) -> Any:
    axes = [x for x in "xyz" if f"{name}1.position.{x}" in result]
    return np.linalg.norm([result[f"{name}2.position.{x}"] - result[f"{name}1.position.{x}"] for x in axes], axis=0)


def miss(result: Result, name: str = "p") -> float:
    """Return the largest error of the distance of a pair, of which the motion is known."""
    exact = REST + (START - REST) * np.cos(FAST * result.time)
    return float(np.max(np.abs(distance(result, name) - exact)))


@pytest.mark.sample(4)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("space", ["line", "plane", "space"])
@pytest.mark.parametrize("way", WAYS)
def test_two_masses_far_away_vibrate_as_near_the_origin(way: str, space: str, form: str) -> None:
    if way == "taylor" and form == "dae":
        return
    errors = []
    for place, speed in ((0.0, 0.0), (1e6, 0.0), (0.0, 1e5)):
        scene = Scene(space=space, gravity=0.0, t_end=10.0)
        add_pair(scene, "p", (place, 0.4 * place, -place), (speed, -speed, speed))
        result = simulate(scene, form=form, **WAYS[way])
        errors.append(miss(result))
        if way == "accuracy":
            assert result.accuracy.is_met
            assert errors[-1] < 1e-8 * 3.0 * START
    rounding = 3e-9  # a place 1e6 m away is known to 1e-10 m, and a motion through 1e6 m adds some
    assert max(errors[1:]) < 3.0 * errors[0] + rounding


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_several_far_groups_have_extents_of_their_own(form: str, gravity: float) -> None:
    scene = Scene(space="space", gravity=gravity, t_end=5.0)
    add_pair(scene, "near", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    add_pair(scene, "far", (1e6, -2e5, 3e5), (10.0, 3e4, 0.0), way=1)
    result = simulate(scene, form=form, accuracy=1e-7)
    assert result.start.length == pytest.approx(START)
    assert result.accuracy.is_met
    assert max(miss(result, "near"), miss(result, "far")) < 3e-7 * START


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_hinged_bodies_far_away_turn_as_near_the_origin(form: str) -> None:
    angles = []
    for place in (0.0, 1e6):
        scene = Scene(space="plane", gravity=0.0, t_end=3.0)
        one = scene.add("one", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1), center=(0.3, 0.0, 0.0)))
        hinge = scene.add("hinge", Pivot())
        other = scene.add("other", RigidBody(mass=2.0, moments=(0.2, 0.2, 0.2), center=(0.5, 0.0, 0.1)))
        scene.connect(one.frame, hinge.a)
        scene.connect(hinge.b, other.frame)
        scene.start.update({"one.position.x": place, "one.position.z": 0.3 * place, "one.velocity.x": 0.01 * place})
        scene.start.update({"one.velocity.z": 0.0, "one.angle": 0.2, "one.angular_velocity.y": 1.0})
        scene.start.update({"hinge.angle": 0.7, "hinge.angular_velocity": -2.0})
        result = simulate(scene, form=form, rtol=1e-9)
        assert result.start.length < 2.0
        angles.append(result["hinge.angle"])
    assert np.max(np.abs(angles[1] - angles[0])) < 1e-7


def test_what_is_bound_to_a_place_counts_from_there() -> None:
    """A field, or a spring to the world, says where the bodies are; then they do not float."""
    for law in (Potential(energy_function="1e-6*x^2"), Spring(stiffness=1.0, natural_length=1e4)):
        scene = Scene(space="line", gravity=0.0, t_end=1.0)
        end = add_pair(scene, "p", (1e4,), (0.0,))
        scene.add("law", law)
        if isinstance(law, Spring):
            ground = scene.add("ground", Ground())
            scene.connect(law.a, ground.frame)
            scene.connect(law.b, end)
        else:
            scene.connect(law.point, end)
        assembly = atwood.assemble(scene)
        assert scene_length(assembly) >= 1e4
        assert simulate(assembly).first_plan.relative_share == 1.0


def test_near_groups_and_plans_in_files_are_as_before() -> None:
    scene = Scene(space="line", gravity=0.0, t_end=1.0)
    add_pair(scene, "p", (0.0,), (0.0,))
    assert simulate(scene).first_plan.relative_share == 1.0
    scene.start.update({"p1.displacement": 1e6, "p2.displacement": 1e6 + START})
    result = simulate(scene)
    again = pickle.loads(pickle.dumps(result))
    assert again.first_plan.relative_share == result.first_plan.relative_share < 1e-5


def test_sweeps_are_as_right_as_single_runs() -> None:
    scene = Scene(space="plane", gravity=0.0, t_end=10.0)
    add_pair(scene, "p", (1e6, -2e5), (0.0, 0.0))
    found = atwood.sweep(scene, {"ps.stiffness": [STIFFNESS, 2.0 * STIFFNESS]}, quantities=["ps.length"], rtol=1e-9)
    for rate, values in ((FAST, found["ps.length"][0]), (math.sqrt(2.0) * FAST, found["ps.length"][1])):
        assert abs(values[..., -1] - REST - (START - REST) * math.cos(10.0 * rate)) < 1e-7


@pytest.mark.parametrize("space", ["plane", "space"])
def test_linkages_that_float_far_from_each_other_start_where_they_are_said(space: str) -> None:
    """Pairs of bodies on hinges, 0.3 m long and up to 800 m apart: one body of each is placed, its angle guessed."""
    scene, places = Scene(space=space), {"a": -3.0, "b": 7.5, "c": 800.0}
    for name, x in places.items():
        for body in ("1", "2"):
            scene.add(name + body, RigidBody(mass=1.0, moments=(0.02, 0.02, 0.02)))
            scene.add(f"{name}arm{body}", Link(length=0.15))
        hinge = scene.add(name, Pivot())
        scene.connect(scene[f"{name}1"].frame, scene[f"{name}arm1"].a)
        scene.connect(scene[f"{name}arm1"].b, hinge.a)
        scene.connect(hinge.b, scene[f"{name}arm2"].a)
        scene.connect(scene[f"{name}arm2"].b, scene[f"{name}2"].frame)
        scene.start.update({f"{name}1.position.x": x, f"{name}1.position.z": 1.2})
        scene.guess[f"{name}.angle"] = 0.7
    start = simulate(scene, t_end=0.01, outputs=2)
    for name, x in places.items():
        assert float(start[f"{name}1.position.x"][0]) == pytest.approx(x, rel=1e-12)
        assert float(start[f"{name}1.position.z"][0]) == pytest.approx(1.2, rel=1e-12)
        assert float(start[f"{name}.angle"][0]) == pytest.approx(0.7, abs=0.3)
