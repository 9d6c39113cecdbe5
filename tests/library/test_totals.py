"""Momentum, angular momentum, centre of mass, inertia and power of a scene and of models in it."""

import numpy as np
import pytest

import atwood_library as lib
from atwood import Model, Result, ResultError, Scene, simulate
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def cloud(space: str) -> Scene:
    """Return a body off its frame, a rod with mass and a ball that pull at each other, without gravity."""
    scene = Scene(space=space, gravity=0.0)
    box = scene.add(
        "box", lib.RigidBody(mass=2.0, center=(0.1, 0.0, 0.3), moments=(1.0, 1.2, 1.4), products=(0.1, 0.0, 0.2))
    )
    rod, ball = scene.add("rod", lib.Rod(length=0.8, mass=0.6)), scene.add("ball", lib.PointMass(mass=1.1))
    spring = scene.add("spring", lib.Spring(stiffness=3.0))
    scene.connect(rod.b, ball.point)
    scene.connect(rod.a, scene.add("tip", lib.PointMass(mass=0.4)).point)
    scene.connect(box.frame, spring.a)
    scene.connect(rod.a, spring.b)
    scene.add("all", lib.TotalsSensor())
    scene.add("own", lib.TotalsSensor(about="center_of_mass"))
    scene.connect(scene.add("there", lib.TotalsSensor(about="point")).point, ball.point)
    scene.start.update({"box.velocity.x": 0.3, "ball.velocity.z": -0.7, "ball.position.x": 1.5, "ball.position.z": 0.4})
    if space == "space":
        scene.start.update({"box.spin.x": 0.9, "box.spin.y": 0.4, "box.spin.z": -1.2, "ball.velocity.y": 0.2})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_what_nothing_acts_on_keeps_its_totals(form: str) -> None:
    result = simulate(cloud("space"), form=form, t_end=2.0, rtol=1e-11)
    for path in (*(f"momentum.{a}" for a in "xyz"), *(f"angular_momentum.{a}" for a in "xyz"), "mass", "total_energy"):
        values = result.array(path)
        assert np.ptp(values) < 1e-8, path
        assert abs(values[0]) > 1e-3, path
    assert np.max(np.abs(result.array("power"))) < 1e-7
    middle, speed = result.array("center_of_mass.x"), result["momentum.x"][0] / result["mass"][0]
    assert np.max(np.abs(middle - middle[0] - speed * result.time)) < 1e-8


def tensor_by_hand(result: Result, pole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the inertia tensor and the angular momentum at the end about a point, of many points of mass."""
    at = {path: values[-1] for path, values in result.table().items()}

    def vector(path: str) -> np.ndarray:
        return np.array([at[f"{path}.{axis}"] for axis in "xyz"])

    axes = np.column_stack([vector(f"box.{axis}_axis") for axis in "xyz"])
    inertia = np.array([[1.0, 0.1, 0.0], [0.1, 1.2, 0.2], [0.0, 0.2, 1.4]])
    spin = axes @ vector("box.spin")
    tensor, turning = axes @ inertia @ axes.T, axes @ inertia @ axes.T @ spin
    points = [
        (mass, vector(f"{name}.position"), vector(f"{name}.velocity"))
        for mass, name in ((2.0, "box"), (1.1, "ball"), (0.4, "tip"))
    ]
    for m, r, v in points:
        r = r - pole
        tensor = tensor + m * (r @ r * np.eye(3) - np.outer(r, r))
        turning = turning + m * np.cross(r, v)
    return tensor, turning


@pytest.mark.parametrize("form", FORMS)
def test_inertia_about_three_points(form: str) -> None:
    scene = cloud("space")
    scene.set("rod.mass", 0.0)
    result = simulate(scene, form=form, t_end=1.0, rtol=1e-10)
    middle = np.array([result[f"center_of_mass.{axis}"][-1] for axis in "xyz"])
    ball = np.array([result[f"ball.position.{axis}"][-1] for axis in "xyz"])
    for name, pole in (("all", np.zeros(3)), ("own", middle), ("there", ball)):
        tensor, turning = tensor_by_hand(result, pole)
        for n, axis in enumerate("xyz"):
            assert result[f"{name}.moments.{axis}"][-1] == pytest.approx(tensor[n, n], rel=1e-9), name
            assert result[f"{name}.angular_momentum.{axis}"][-1] == pytest.approx(turning[n], abs=1e-9), name
        for axis, (i, j) in zip("xyz", ((0, 1), (0, 2), (1, 2)), strict=True):
            assert result[f"{name}.products.{axis}"][-1] == pytest.approx(tensor[i, j], abs=1e-9), name
    for axis in "xyz":
        assert result[f"moments.{axis}"][-1] == pytest.approx(result[f"own.moments.{axis}"][-1], rel=1e-12)


def test_in_a_plane_turning_is_one_number() -> None:
    result = simulate(cloud("plane"), t_end=2.0, rtol=1e-11)
    assert np.ptp(result.array("angular_momentum")) < 1e-8 < abs(result["angular_momentum"][0])
    assert np.ptp(result.array("own.angular_momentum_in_plane")) < 1e-8
    assert result["moment"][0] == pytest.approx(result["own.moment"][0])


def test_the_power_of_a_drive() -> None:
    result = simulate(SCENES["rotating-hoop-driven"](inclination=1.0), t_end=1.0, rtol=1e-11, outputs=2001)
    power, energy = result.array("power"), result.array("total_energy")
    step = result.time[1] - result.time[0]
    whole = step / 3.0 * (power[0] + power[-1] + 4.0 * np.sum(power[1:-1:2]) + 2.0 * np.sum(power[2:-1:2]))
    assert whole == pytest.approx(energy[-1] - energy[0], rel=1e-8)
    assert np.allclose(energy, result.energy.kinetic + result.energy.potential, rtol=0, atol=1e-9)


def test_a_model_in_a_scene_has_its_own() -> None:
    scene = Scene(gravity=0.0)
    for name, speed in (("left", 1.0), ("right", -2.0)):
        model = scene.add(name, Model())
        model.add("ball", lib.PointMass(mass=1.5))
        scene.start[f"{name}.ball.velocity.x"] = speed
    result = simulate(scene, t_end=0.1)
    assert result["left.momentum.x"][0] == pytest.approx(1.5)
    assert result["right.momentum.x"][0] == pytest.approx(-3.0)
    assert result["momentum.x"][0] == pytest.approx(-1.5)
    assert result["right.kinetic_energy"][-1] == pytest.approx(3.0)
    assert "momentum.x" in result
    for wrong in ("momentum.q", "middle.momentum.x", "momentun.x"):
        with pytest.raises(ResultError):
            result[wrong]
