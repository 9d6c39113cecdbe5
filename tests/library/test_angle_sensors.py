"""Sensors of angles in space, against rotation matrices multiplied out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import atwood_library as lib
from atwood import ParameterError, Scene, assemble, simulate
from atwood_library.interfaces.euler_angles import CONVENTIONS

ANGLES = (0.7, 0.4, -1.1)
RATES = (0.5, -0.3, 0.9)


def about(axis: str, angle: float) -> NDArray[np.float64]:
    """Return the matrix of a right-handed turn about a coordinate axis."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    m = np.eye(3)
    m[j, j] = m[k, k] = np.cos(angle)
    m[k, j], m[j, k] = np.sin(angle), -np.sin(angle)
    return m


def spun(convention: str) -> Scene:
    """Return a body whose Euler angles of a convention, against a turning platform, start at ANGLES with RATES."""
    first, second, third = (about(axis, angle) for axis, angle in zip(convention, ANGLES, strict=True))
    inner = first @ second @ third
    axes = [np.eye(3)["xyz".index(axis)] for axis in convention]
    relative = RATES[0] * axes[0] + RATES[1] * first @ axes[1] + RATES[2] * first @ second @ axes[2]
    outer = about("z", 0.6) @ about("x", -0.8)
    spin = np.array([0.4, 0.2, -0.5])
    scene = Scene(space="space", gravity=0.0)
    platform = scene.add("platform", lib.RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    body = scene.add("body", lib.RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    sensor = scene.add("sensor", lib.OrientationSensor(convention=convention))
    scene.connect(platform.frame, sensor.a)
    scene.connect(sensor.b, body.frame)
    whole = outer @ inner
    for name, matrix, omega in (("platform", outer, outer @ spin), ("body", whole, outer @ (spin + relative))):
        for column in "xz":
            for row in "xyz":
                scene.start[f"{name}.{column}_axis.{row}"] = matrix["xyz".index(row), "xyz".index(column)]
        for row in "xyz":
            scene.start[f"{name}.angular_velocity.{row}"] = omega["xyz".index(row)]
    return scene


@pytest.mark.sample(5)
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_euler_angles_of_every_convention(convention: str) -> None:
    result = simulate(spun(convention), t_end=0.5, rtol=1e-10, outputs=201)
    angles = np.stack([result[f"sensor.angle_{n}"] for n in (1, 2, 3)], axis=1)
    rates = np.stack([result[f"sensor.rate_{n}"] for n in (1, 2, 3)], axis=1)
    assert np.allclose(angles[0], ANGLES, atol=1e-9)
    assert np.allclose(rates[0], RATES, atol=1e-9)
    slopes = np.gradient(angles, result.time, axis=0, edge_order=2)
    assert np.allclose(slopes[1:-1], rates[1:-1], atol=2e-3)


def test_there_are_twelve_conventions() -> None:
    assert len(set(CONVENTIONS)) == 12
    with pytest.raises(ParameterError, match=r"OrientationSensor\.convention: 'zyzy' .*Did you mean"):
        lib.OrientationSensor(convention="zyzy")


def test_a_sensor_changes_nothing() -> None:
    scene = Scene(space="space", gravity=0.0)
    ground, body = scene.add("ground", lib.Ground()), scene.add("body", lib.RigidBody(moments=(1.0, 2.0, 2.5)))
    before = assemble(scene).reduced.rows
    for name, sensor in (("angle", lib.AngleSensor()), ("turn", lib.OrientationSensor())):
        added = scene.add(name, sensor)
        scene.connect(ground.frame, added.a)
        scene.connect(added.b, body.frame)
    after = assemble(scene).reduced.rows
    assert [str(row) for row in after] == [str(row) for row in before]
