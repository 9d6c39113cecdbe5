"""Euler angles near their poles: both forms say the same, and have no value at the same places."""

import math

import numpy as np
import pytest

import atwood_library as lib
from atwood import Result, Scene, simulate

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


@pytest.mark.parametrize("theta", [0.0, 1e-15, 1e-9, 1e-7, 1e-3, math.pi - 1e-9, math.pi])
def test_both_forms_say_the_same(theta: float) -> None:
    reduced, dae = spun(theta, "reduced"), spun(theta, "dae")
    for name in NAMES:
        one, other = reduced[name][0], dae[name][0]
        assert np.isnan(one) == np.isnan(other), name
        assert np.isnan(one) or one == pytest.approx(other, abs=1e-6), name
        assert np.isfinite(one) or np.isnan(one), name
    off = 1e-10 < theta < math.pi - 1e-10
    assert np.isfinite(reduced["body.phi_rate"][0]) == off
    assert np.isfinite(reduced["top.rate_1"][0]) == off
    if off:
        assert reduced["top.rate_3"][0] == pytest.approx(1.0, abs=1e-6)
        assert reduced["body.psi_rate"][0] == pytest.approx(1.0, abs=1e-6)
