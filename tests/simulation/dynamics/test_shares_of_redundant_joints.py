"""What redundant joints bear: it balances the loads, and is of least size, however the scene is turned."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, assemble
from atwood.numerics.matrices import least_size
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state
from atwood_library import Cylindrical, Ground, RigidBody, Slider, Weld

FORMS = ("reduced", "dae")
MAKE = {"bush": Cylindrical, "guide": Slider}
PLACES = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.4, 0.1, 0.5))


def test_a_column_that_is_rounding_has_no_say() -> None:
    rows = np.array([[1.0, 0.0, 1e-16], [0.5, 1.0, -2e-16], [1.0, 1.0, 3e-16], [0.0, 2.0, -5e-16]])
    given = np.array([[1.0, -2.0]])
    found = least_size(rows[None], np.array([0, 1]), given)[0]
    exact = np.linalg.pinv(rows[:, :2].T) @ rows[:2, :2].T @ given[0]
    np.testing.assert_allclose(found, exact, rtol=1e-12)


def shaft(kind: str, count: int, angle: float) -> Scene:
    """Return a body on guides along its z axis, on a base that is turned; its weight turns with it."""
    scene = Scene(space="space")
    n = np.array((0.3, -1.2, 0.7)) / np.linalg.norm((0.3, -1.2, 0.7))
    cross = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    axes = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    scene.gravity_direction = tuple((axes @ (0.48, 0.6, -0.64)).tolist())
    base = scene.add("base", Weld(angle=angle, axis=tuple(n.tolist())))
    scene.connect(scene.add("ground", Ground()).frame, base.a)
    body = scene.add("body", RigidBody(mass=2.0, center=(0.0, 0.0, 0.3), moments=(0.3, 0.4, 0.2)))
    for i, place in enumerate(PLACES[:count]):
        # Mounted askew, so that the axes of the joints are computed.
        askew = {"angle": 1.1 + i, "axis": (0.2, 0.9 - i, 0.4)}
        low, high = (scene.add(f"{name}{i}", Weld(displacement=place, **askew)) for name in ("low", "high"))
        m = np.array(askew["axis"]) / np.linalg.norm(askew["axis"])
        c, s = np.cos(askew["angle"]), np.sin(askew["angle"])
        z = np.array((0.0, 0.0, 1.0))
        own = c * z - s * np.cross(m, z) + (1.0 - c) * (m @ z) * m
        joint = scene.add(f"joint{i}", MAKE[kind](axis=tuple(own.tolist())))
        for a, b in ((base.b, low.a), (low.b, joint.a), (joint.b, high.b), (high.a, body.frame)):
            scene.connect(a, b)
    return scene


def borne(scene: Scene, form: str) -> tuple[dict[str, float], float]:
    """Return the reactions of the joints, and the root of the sum of their squares (lengths are about 1 m)."""
    assembly = assemble(scene, form=form)
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    solver = ReactionSolver(assembly, 0.0, q, u)
    values = solver.at(np.array([0.0]), q[:, None], u[:, None])[0][:, 0]
    found = {one.path: float(v) for one, v in zip(assembly.reactions, values, strict=True)}
    along = solver.balance_along(np.array([0.0]), q[:, None], u[:, None])
    return found, float(np.linalg.norm(along.multipliers))


@pytest.mark.sample(2)
@pytest.mark.parametrize("angle", [0.0, 0.3, 2.1])
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("form", FORMS)
def test_bushes_bear_the_weight_between_them(form: str, count: int, angle: float) -> None:
    scene = shaft("bush", count, angle)
    found, _ = borne(scene, form)
    across = 2.0 * 9.81 * np.hypot(0.48, 0.6)
    # The axes of the bushes are those of their frames: their forces add up in the world's axes.
    total = np.sum([[found[f"low{i}.force.{x}"] for x in "xyz"] for i in range(count)], axis=0)
    assert np.linalg.norm(total) == pytest.approx(across, rel=1e-9)


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", list(MAKE))
@pytest.mark.parametrize("form", FORMS)
def test_shares_are_of_least_size_however_a_scene_is_turned(form: str, kind: str) -> None:
    sizes = [borne(shaft(kind, 3, angle), form)[1] for angle in (0.0, 0.3, 2.1)]
    np.testing.assert_allclose(sizes, sizes[0], rtol=1e-8)
