"""Euler angles at and near their poles: alone, along a run, at a start; both forms say the same."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import atwood_library as lib
from atwood import Result, Scene, Vector, simulate
from atwood.integrators.methods import METHODS
from atwood_library.interfaces.euler_angles import CONVENTIONS, EulerAngles
from atwood_library.scenes import LagrangeTop

NAMES = [f"body.{name}" for name in ("phi", "theta", "psi", "phi_rate", "theta_rate", "psi_rate")]
NAMES += [f"{sensor}.{name}_{n}" for sensor in ("top", "yaw") for name in ("angle", "rate") for n in (1, 2, 3)]
NAMES += ["link.angle", "link.angular_velocity"]


def spun(theta: float, form: str) -> Result:
    """Spin a body about its z axis that is turned by theta from the vertical, on a mount that turns there and back."""
    scene = Scene(space="space", gravity=0.0)
    ground, body = scene.add("ground", lib.Ground()), scene.add("body", lib.RigidBody(moments=(1.0, 1.2, 1.5)))
    there = scene.add("there", lib.Weld(angle=0.7, axis=(0.3, 0.5, 0.8)))
    back = scene.add("back", lib.Weld(angle=-0.7, axis=(0.3, 0.5, 0.8)))
    top = scene.add("top", lib.OrientationSensor())
    yaw = scene.add("yaw", lib.OrientationSensor(convention="zyx"))
    on_side = scene.add("on_side", lib.Weld(angle="90 deg", axis=(0.0, 0.0, 1.0)))
    link = scene.add("link", lib.Link())
    scene.connect(ground.frame, there.a)
    scene.connect(there.b, back.a)
    for sensor in (top, yaw):
        scene.connect(back.b, sensor.a)
        scene.connect(body.frame, sensor.b)
    scene.connect(body.frame, on_side.a)
    scene.connect(on_side.b, link.a)
    scene.start.update({"body.theta": theta, "body.spin.z": 1.0, "body.spin.x": 0.0, "body.spin.y": 0.0})
    return simulate(scene, form=form, t_end=1e-3, outputs=2, rtol=1e-12)


def turned(convention: str, angles: Sequence[float]) -> Any:
    """Return the rotation of three angles: the axes of b are its columns."""
    return Rotation.from_euler(convention.upper(), angles).as_matrix()


def columns(matrix: Any) -> tuple[Vector, Vector, Vector]:
    x, y, z = (Vector(*map(float, column)) for column in np.asarray(matrix).T)
    return x, y, z


@pytest.mark.sample(2)
@pytest.mark.parametrize("theta", [0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-3, math.pi - 1e-9, math.pi])
def test_both_forms_say_the_same(theta: float) -> None:
    reduced, dae = spun(theta, "reduced"), spun(theta, "dae")
    for name in NAMES:
        one, other = reduced[name][0], dae[name][0]
        assert np.isfinite(one) or name.startswith("link"), name
        assert np.isnan(one) == np.isnan(other), name
        assert np.isnan(one) or one == pytest.approx(other, abs=2e-4 if theta == 1e-11 else 1e-6), name
    sign = 1.0 if theta < 1.0 else -1.0
    for first, third in (("body.phi_rate", "body.psi_rate"), ("top.rate_1", "top.rate_3")):
        assert reduced[third][0] + sign * reduced[first][0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("distance", [0.0, 1e-16, 1e-14, 1e-13, 1e-11, 1e-9, 1e-7, 1e-6, 0.1])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_angles_make_the_orientation_they_are_read_from(convention: str, side: int, distance: float) -> None:
    """Read by itself and turned again, an orientation is what it was, as near to a pole as it may be."""
    again = convention[0] == convention[2]
    pole = (math.pi if side > 0 else 0.0) if again else side * math.pi / 2.0
    chance = np.random.default_rng(3)
    frame = turned("xyz", (0.4, -0.7, 1.1))
    for _ in range(5):
        first, third = chance.uniform(-math.pi, math.pi, 2)
        second = pole + (distance if pole <= 0.0 else -distance)
        whole = turned(convention, (first, second, third))
        found = EulerAngles(convention, columns(frame), columns(frame @ whole), Vector(0.0, 0.0, 0.0))
        angles = [float(one) for one in (found.first(), found.second(), found.last())]
        assert turned(convention, angles) == pytest.approx(whole, abs=3e-12)
        at_pole = float(found.pole())
        assert (at_pole != 0.0) == (distance < 1e-12)
        if at_pole:
            assert angles[0] == pytest.approx(0.0, abs=1e-12)
            expected = third + math.copysign(1.0, at_pole) * first
            assert math.remainder(angles[2] - expected, math.tau) == pytest.approx(0.0, abs=1e-11)


@pytest.mark.sample(3)
@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_rates_at_a_pole_share_the_turn(convention: str, form: str) -> None:
    """A body turns about the first axis, with which the third is parallel."""
    again = convention[0] == convention[2]
    for second in (0.0, math.pi) if again else (-math.pi / 2.0, math.pi / 2.0):
        scene = Scene(space="space", gravity=0.0)
        ground, body = scene.add("ground", lib.Ground()), scene.add("body", lib.RigidBody(moments=(1.0, 1.0, 1.0)))
        sensor, axis = scene.add("sensor", lib.OrientationSensor(convention=convention)), np.zeros(3)
        scene.connect(ground.frame, sensor.a)
        scene.connect(body.frame, sensor.b)
        axis["xyz".index(convention[0])] = 2.0
        scene.start.update({f"sensor.angle_{n}": angle for n, angle in enumerate((0.5, second, 0.2), start=1)})
        scene.start.update({f"body.angular_velocity.{name}": axis[n] for n, name in enumerate("xyz")})
        result = simulate(scene, form=form, t_end=8.0, outputs=5, samples=1, rtol=1e-11)
        sign = math.copysign(1.0, result["sensor.pole"][0])
        assert result["sensor.angle_1"] == pytest.approx(0.5 + result.time, abs=1e-7)
        assert result["sensor.angle_3"] == pytest.approx(0.2 + sign * result.time, abs=1e-7)
        assert result["sensor.rate_1"] == pytest.approx(1.0, abs=1e-8)
        assert result["sensor.rate_2"] == pytest.approx(0.0, abs=1e-8)
        assert result["sensor.rate_3"] == pytest.approx(sign, abs=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("down", [False, True])
def test_a_body_on_a_vertical_hinge(form: str, down: bool) -> None:
    """Some twenty turns between two outputs are counted; the difference of the two angles stays, or their sum."""
    scene = Scene(space="space")
    ground, hinge = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot(axis=(0.0, 0.0, 1.0)))
    turn = scene.add("turn", lib.Weld(angle="180 deg" if down else 0.0, axis=(1.0, 0.0, 0.0)))
    body = scene.add("body", lib.RigidBody(moments=(1.0, 1.0, 1.0)))
    for one, other in ((ground.frame, hinge.a), (hinge.b, turn.a), (turn.b, body.frame)):
        scene.connect(one, other)
    scene.start.update({"hinge.angle": 0.3, "hinge.angular_velocity": 40.0})
    result = simulate(scene, form=form, t_end=9.0, outputs=4, samples=1, rtol=1e-11)
    sign = -1.0 if down else 1.0
    moved = result["hinge.angle"] - result["hinge.angle"][0]
    assert moved[-1] == pytest.approx(360.0, rel=1e-9)
    phi, psi = result["body.phi"], result["body.psi"]
    assert phi - phi[0] == pytest.approx(0.5 * moved, abs=1e-6)
    assert psi - psi[0] == pytest.approx(0.5 * sign * moved, abs=1e-6)
    for n, name in enumerate("xyz"):
        matrices = [turned("zyz", angles) for angles in zip(phi, result["body.theta"], psi, strict=True)]
        assert result[f"body.x_axis.{name}"] == pytest.approx([one[n, 0] for one in matrices], abs=1e-9)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_body_that_turns_through_both_poles(form: str) -> None:
    """Samples lie on the poles: the angles read there, and between, are those of the orientation."""
    scene = Scene(space="space", gravity=0.0)
    scene.add("body", lib.RigidBody(moments=(1.0, 1.0, 1.0)))
    scene.start.update({"body.phi": 0.4, "body.theta": -0.5 * math.pi, "body.psi": -0.1})
    scene.start.update({"body.angular_velocity.x": -math.sin(0.4), "body.angular_velocity.y": math.cos(0.4)})
    scene.start["body.angular_velocity.z"] = 0.0
    result = simulate(scene, form=form, t_end=2.0 * math.pi, outputs=17, rtol=1e-11)
    names = [f"body.{name}" for name in ("phi", "theta", "psi")]
    for k in range(17):
        matrix = turned("zyz", [result[name][k] for name in names])
        assert [result[f"body.z_axis.{axis}"][k] for axis in "xyz"] == pytest.approx(matrix[:, 2], abs=1e-9)
        assert [result[f"body.x_axis.{axis}"][k] for axis in "xyz"] == pytest.approx(matrix[:, 0], abs=1e-9)


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("theta", [0.0, 1e-15, 1e-11, 1e-8, 0.3, math.pi])
def test_a_restart_from_what_a_run_says_goes_on_with_it(theta: float, form: str) -> None:
    top = LagrangeTop(inclination=theta, spin=60.0)
    top.start.update({"top.phi": 0.5, "top.psi": 0.2})
    first = simulate(top, form=form, t_end=0.3, outputs=3, rtol=1e-11)
    assert first["top.phi"][0] == pytest.approx(0.5, abs=1e-4)
    assert first["top.x_axis.x"][0] == pytest.approx(turned("zyz", (0.5, theta, 0.2))[0, 0], abs=1e-11)
    for name in ("phi", "theta", "psi", "spin.x", "spin.y", "spin.z"):
        top.start[f"top.{name}"] = first[f"top.{name}"][-1]
    again = simulate(top, form=form, t_end=0.1, outputs=2)
    for name in (f"top.{axis}_axis.{n}" for axis in "xyz" for n in "xyz"):
        assert again[name][0] == pytest.approx(first[name][-1], abs=1e-11)
    for name in ("top.phi", "top.psi", "top.phi_rate", "top.psi_rate"):
        assert np.all(np.isfinite(first[name]))


def test_turns_are_counted_with_every_solver() -> None:
    scene = Scene(space="space", gravity=0.0)
    ground, hinge = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot(axis=(0.0, 0.0, 1.0)))
    link, sensor = scene.add("link", lib.Link(mass=1.0)), scene.add("sensor", lib.AngleSensor(axis=(0.0, 0.0, 1.0)))
    for one, other in ((ground.frame, hinge.a), (hinge.b, link.a), (ground.frame, sensor.a), (link.a, sensor.b)):
        scene.connect(one, other)
    scene.start.update({"hinge.angle": 0.3, "hinge.angular_velocity": 5.0})
    for solver, method in METHODS.items():
        if not method.looks_for_events:
            continue
        given = {"step": 0.01} if method.has_equal_steps else {}
        result = simulate(scene, solver=solver, t_end=4.0, outputs=3, samples=1, **given)
        assert result["sensor.angle"] == pytest.approx(0.3 + 5.0 * result.time, abs=1e-6)
