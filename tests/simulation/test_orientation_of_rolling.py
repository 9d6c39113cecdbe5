"""Rolling bodies beside bodies whose orientation has other coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Result, Scene, simulate
from atwood_library import Bushing, Ground, RigidBody, RollingDisc, RollingSphere, Spherical

AXES = tuple(f"{part}.{axis}_axis.{along}" for part in ("wheel", "rider") for axis in "xz" for along in "xyz")


def ridden(rolls: type[RollingDisc] | type[RollingSphere]) -> Scene:
    """Return a rolling body with a body on a ball joint in it, and a third that a bushing holds to both."""
    scene = Scene(space="space", gravity=9.81)
    ground, rolling = scene.add("ground", Ground()), scene.add("rolling", rolls(radius=0.4))
    bodies = [
        scene.add(name, RigidBody(mass=mass, moments=(0.05, 0.08, 0.06), center=center))
        for name, mass, center in (("wheel", 2.0, (0.0, 0.0, 0.0)), ("rider", 0.5, (0.1, 0.05, -0.2)))
    ]
    ball, bushing = scene.add("ball", Spherical()), scene.add("bushing", Bushing(turning_stiffness=(3.0, 2.0, 1.0)))
    scene.connect(ground.frame, rolling.a)
    scene.connect(rolling.b, bodies[0].frame)
    scene.connect(bodies[0].frame, ball.a)
    scene.connect(ball.b, bodies[1].frame)
    scene.connect(bodies[0].frame, bushing.a)
    scene.connect(bushing.b, bodies[1].frame)
    scene.start.update({"wheel.angular_velocity.y": 4.0, "wheel.angular_velocity.z": 1.0})
    scene.start["rider.angular_velocity.x"] = 2.0
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("orientation", ["euler-zyx", "euler-xyz"])
@pytest.mark.parametrize("rolls", [RollingDisc, RollingSphere])
def test_rolling_beside_euler_angles(rolls: type[RollingDisc] | type[RollingSphere], orientation: str) -> None:
    """The constants of what rolls are found in the coordinates that the others have."""

    def run(coordinates: str) -> Result:
        return simulate(ridden(rolls), orientation=coordinates, t_end=0.2, rtol=1e-9, outputs=3, solver="ida-sundae")

    quaternions, angles = run("quaternion").table(AXES), run(orientation).table(AXES)
    for path in AXES:
        assert np.max(np.abs(quaternions[path] - angles[path])) < 1e-6, path
