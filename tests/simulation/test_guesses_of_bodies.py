"""What is said of bodies in a chain puts each of its joints where it belongs, however far they turn."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, assemble
from atwood.simulation.initialization.start import find_start
from atwood_library import Ground, Pivot, RigidBody, Weld


def turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the matrix of a turn (Goldstein, equation 4.62)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", [4, 10, 14, 28])
@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_a_chain_of_hinges_starts_where_its_bodies_are_said_to_be(seed: int, size: float) -> None:
    random = np.random.default_rng(seed)
    scene = Scene(space="space", gravity=0.0)
    at, axes, place = scene.add("ground", Ground()).frame, np.eye(3), np.zeros(3)
    angles = random.uniform(-3.0, 3.0, 4)
    for i, angle in enumerate(angles):
        axis = random.standard_normal(3)
        axis /= np.linalg.norm(axis)
        hinge = scene.add(f"hinge{i}", Pivot(axis=tuple(axis.tolist())))
        body = scene.add(f"body{i}", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
        arm = scene.add(f"arm{i}", Weld(displacement=(size, 0.0, 0.0)))
        scene.connect(at, hinge.a)
        scene.connect(hinge.b, body.frame)
        scene.connect(body.frame, arm.a)
        at, axes = arm.b, axes @ turned(axis, float(angle))
        scene.guess.update({f"body{i}.position.{c}": float(x) for c, x in zip("xyz", place, strict=True)})
        for k, name in enumerate("xyz"):
            scene.guess.update({f"body{i}.{name}_axis.{c}": float(x) for c, x in zip("xyz", axes[:, k], strict=True)})
        place = place + size * axes[:, 0]
    np.testing.assert_allclose(find_start(assemble(scene)).coordinates, angles, atol=1e-9)
