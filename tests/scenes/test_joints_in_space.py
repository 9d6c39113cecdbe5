"""Every joint of space: both forms give the same motion and the same forces, and energy is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import Scene, simulate

JOINTS: dict[str, tuple[Any, int, dict[str, Any]]] = {
    # name: (joint, degrees of freedom it leaves, how it starts)
    "pivot": (lambda: lib.Pivot(axis=(0.3, 1.0, -0.2)), 1, {"joint.angle": 0.7, "joint.angular_velocity": 1.0}),
    "slider": (lambda: lib.Slider(axis=(1.0, 0.4, -0.3)), 1, {"joint.displacement": 0.2, "joint.speed": 0.5}),
    "cylindrical": (lambda: lib.Cylindrical(axis=(1.0, 0.2, 0.5)), 2, {"joint.angle": 0.3, "joint.speed": 0.4}),
    "screw": (lambda: lib.Screw(axis=(0.1, 0.2, 1.0), pitch=0.7), 1, {"joint.angle": 0.4}),
    "spherical": (lambda: lib.Spherical(), 3, {"body.spin.x": 1.0, "body.spin.y": -0.5, "body.spin.z": 0.8}),
    "universal": (lambda: lib.Universal(), 2, {"joint.angle_a": 0.5, "joint.angle_b": -0.4, "joint.rate_a": 1.0}),
    "planar": (lambda: lib.Planar(axis=(0.2, 0.3, 1.0)), 3, {"joint.displacement_1": 0.1}),
    "free": (lambda: lib.FreeJoint(), 6, {"joint.x": 0.1, "joint.z": -0.2, "body.spin.y": 0.5}),
    "constant-velocity": (lambda: lib.ConstantVelocity(), 2, {"body.spin.x": 0.9, "body.spin.y": -0.4}),
}


def build(name: str) -> tuple[Scene, int]:
    """Return a carrier on a ball joint, and a body that hangs on it by the joint."""
    make, freedom, start = JOINTS[name]
    scene = Scene(space="space")
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.Spherical())
    carrier = scene.add("carrier", lib.RigidBody(mass=2.0, center=(0.1, 0.2, -0.5), moments=(0.3, 0.4, 0.2)))
    weld = scene.add("weld", lib.Weld(displacement=(0.2, -0.1, -0.8), angle=0.3))
    placed = scene.add("joint", make())
    products = (0.01, -0.02, 0.015)
    body = scene.add(
        "body", lib.RigidBody(mass=1.0, center=(0.3, 0.1, -0.2), moments=(0.1, 0.15, 0.12), products=products)
    )
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, carrier.frame)
    scene.connect(carrier.frame, weld.a)
    scene.connect(weld.b, placed.a)
    scene.connect(placed.b, body.frame)
    scene.start.update({"carrier.spin.x": 0.3, "carrier.spin.y": 0.8, **start})
    return scene, 3 + freedom


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", JOINTS)
def test_both_forms_agree(name: str) -> None:
    scene, freedom = build(name)
    reduced, dae = (simulate(scene, form=form, t_end=1.0, rtol=1e-10, outputs=6) for form in ("reduced", "dae"))
    assert reduced.energy.max_drift < 1e-7
    speeds, constraints = len(reduced.assembly.reduced.speeds), len(reduced.assembly.reduced.constraints)
    assert speeds - constraints == freedom
    checked = 0
    for path in reduced.assembly.observables:
        # At the start the carrier is upright, where its first and third Euler angles mean nothing.
        one, other = reduced[path][1:], dae[path][1:]
        if path.endswith((".phi", ".psi")):  # a turn more or less, from where they mean nothing
            one, other = np.exp(1j * one), np.exp(1j * other)
        scale = max(1.0, float(np.max(np.abs(one))))
        np.testing.assert_allclose(other, one, atol=3e-7 * scale, rtol=0.0, err_msg=path)
        checked += 1
    assert checked > 20


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "states"), [("pivot", 1), ("universal", 2), ("slider", 1), ("screw", 1)])
def test_no_more_speeds_than_freedoms(name: str, states: int) -> None:
    scene, _ = build(name)
    reduced = simulate(scene, t_end=0.01, outputs=2).assembly.reduced
    assert len(reduced.speeds) == 3 + states
    assert not reduced.constraints
