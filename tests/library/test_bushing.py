"""Bushings: natural frequencies, large turns, conservation, and the plane and the line as special cases."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

import atwood_library as lib
from atwood import Scene, simulate

from ..helpers.runs import FORMS

STIFFNESS, TURNING = (40.0, 90.0, 25.0), (3.0, 1.5, 2.2)
MASS, MOMENTS = 2.0, (0.2, 0.31, 0.17)


def mounted(space: str = "space", **settings: object) -> Scene:
    """Return a body on a bushing from the ground, without weight."""
    scene = Scene(space=space, gravity=0.0, **({"line_axis": (1.0, 0.0, 0.0)} if space == "line" else {}))
    ground, block = scene.add("ground", lib.Ground()), scene.add("block", lib.RigidBody(mass=MASS, moments=MOMENTS))
    given = {"stiffness": STIFFNESS, "turning_stiffness": TURNING, **settings}
    mount = scene.add("mount", lib.Bushing(**given))
    scene.connect(ground.frame, mount.a)
    scene.connect(mount.b, block.frame)
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("number", range(6))
def test_six_natural_frequencies(number: int, form: str) -> None:
    """Along and about each axis it is a linear oscillator of its own, however far it turns."""
    scene = mounted()
    axis, turns = "xyz"[number % 3], number >= 3
    if turns:
        n = math.sqrt(TURNING[number - 3] / MOMENTS[number - 3])
        scene.start.update({f"block.spin.{axis}": 2.9 * n})  # to 2.9 rad, just short of half a turn
    else:
        n = math.sqrt(STIFFNESS[number] / MASS)
        scene.start.update({f"block.velocity.{axis}": 0.3 * n})
    period = 2.0 * math.pi / n
    result = simulate(scene, form=form, t_end=2.0 * period, rtol=1e-10, outputs=33)
    path, size = (f"mount.rotation.{axis}", 2.9) if turns else (f"mount.displacement.{axis}", 0.3)
    assert np.allclose(result[path], size * np.sin(n * result.time), atol=5e-8 * size)
    assert result.energy.max_drift < 2e-6


def test_energy_and_momenta_are_kept_in_large_turns_between_two_free_bodies() -> None:
    scene = Scene(space="space", gravity=0.0)
    one = scene.add("one", lib.RigidBody(mass=1.0, moments=(0.3, 0.2, 0.25)))
    other = scene.add("other", lib.RigidBody(mass=MASS, moments=MOMENTS))
    mount = scene.add(
        "mount",
        lib.Bushing(
            stiffness=STIFFNESS,
            turning_stiffness=TURNING,
            free_displacement=(0.2, -0.1, 0.3),
            free_rotation=(0.1, 0.4, -0.2),
        ),
    )
    scene.connect(one.frame, mount.a)
    scene.connect(mount.b, other.frame)
    spins = {"one.spin.x": 1.5, "one.spin.y": -2.0, "other.spin.z": 3.0, "other.velocity.y": 0.4}
    scene.start.update({"one.position.x": 0.0, **spins})
    result = simulate(scene, t_end=4.0, rtol=1e-11, outputs=41)
    turned = np.linalg.norm([result[f"mount.rotation.{axis}"] for axis in "xyz"], axis=0)
    assert np.max(turned) > 1.1
    assert result.energy.max_drift < 1e-8

    def vector(path: str) -> np.ndarray:
        return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=1)

    momentum = 1.0 * vector("one.velocity") + MASS * vector("other.velocity")
    about = vector("one.angular_momentum") + vector("other.angular_momentum")
    about += np.cross(vector("one.position"), vector("one.velocity"))
    about += MASS * np.cross(vector("other.position"), vector("other.velocity"))
    assert np.allclose(momentum, momentum[0], atol=1e-9)
    assert np.allclose(about, about[0], atol=1e-9)


def test_both_forms_agree_with_dampers() -> None:
    scene = mounted(damping=(1.0, 2.0, 0.5), turning_damping=(0.1, 0.05, 0.2), free_rotation=(0.3, 0.0, 0.1))
    scene.start.update({"block.velocity.x": 1.0, "block.spin.x": 3.0, "block.spin.y": -4.0})
    runs = [simulate(scene, form=form, t_end=2.0, rtol=1e-10, outputs=9) for form in FORMS]
    for path in ("mount.displacement.x", "mount.rotation.x", "mount.rotation.z", "ground.force.x", "ground.torque.z"):
        assert np.allclose(runs[0][path], runs[1][path], atol=1e-7), path
    for one in runs:
        assert one.energy.max_drift < 1e-6
    # What the ground exerts is what the bushing passes on: spring and damper along x, whatever the frame does.
    push = -(STIFFNESS[0] * runs[0]["mount.displacement.x"] + 1.0 * runs[0]["block.velocity.x"])
    assert np.allclose(runs[0]["ground.force.x"], push, atol=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_in_a_plane_two_displacements_and_a_rotation_that_counts_turns(form: str) -> None:
    scene = mounted("plane", free_rotation=(0.0, -2.0, 0.0))
    n = math.sqrt(TURNING[1] / MOMENTS[1])
    scene.start.update({"block.angle": 12.0, "block.velocity.z": 0.2})
    result = simulate(scene, form=form, t_end=4.0, rtol=1e-10, outputs=21)
    # Free at -2 about y, which is +2 counter-clockwise.
    assert np.allclose(result["mount.angle"], 2.0 + 10.0 * np.cos(n * result.time), atol=1e-6)
    n_z = math.sqrt(STIFFNESS[2] / MASS)
    assert np.allclose(result["mount.displacement.z"], 0.2 / n_z * np.sin(n_z * result.time), atol=1e-7)
    assert result.energy.max_drift < 2e-6


def test_a_turn_about_y_is_the_same_in_plane_and_space() -> None:
    runs = []
    for space, spin in (("plane", {"block.angular_speed": 3.0}), ("space", {"block.spin.y": -3.0})):
        scene = mounted(space, turning_damping=(0.0, 0.2, 0.0), free_rotation=(0.0, 0.3, 0.0), damping=(1.0, 1.0, 2.0))
        scene.start.update({"block.velocity.x": 0.5, **spin})
        runs.append(simulate(scene, t_end=2.0, rtol=1e-10, outputs=9))
    assert np.allclose(runs[0]["mount.angle"], -runs[1]["mount.rotation.y"], atol=1e-8)
    assert np.allclose(runs[0]["block.position.x"], runs[1]["block.position.x"], atol=1e-8)


def test_on_a_line_one_spring() -> None:
    scene = mounted("line", free_displacement=(0.1, 5.0, 5.0))
    scene.start["block.position.x"] = 0.4
    result = simulate(scene, t_end=2.0, rtol=1e-10, outputs=9)
    exact = 0.1 + 0.3 * np.cos(math.sqrt(STIFFNESS[0] / MASS) * result.time)
    assert np.allclose(result["block.position.x"], exact, atol=1e-8)


def test_it_stops_before_half_a_turn() -> None:
    scene = mounted(turning_stiffness=(0.01, 0.01, 0.01))
    scene.start.update({"block.spin.x": 2.0})
    result = simulate(scene, t_end=5.0, outputs=11)
    assert [one.law for one in result.events] == ["comes_to_half_a_turn"]
    assert result["mount.rotation.x"][-1] == pytest.approx(0.999 * math.pi, rel=1e-6)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_shaft_of_two_stiffnesses_is_unstable_between_its_frequencies(space: str, form: str) -> None:
    """In the frame that turns with the mount a mass feels centrifugal and Coriolis forces (Goldstein, section 4.10)."""
    mass, k, turning = 1.5, (6.0, 6.0, 20.0), 2.6
    scene = Scene(space=space, gravity=0.0)
    ground, bob = scene.add("ground", lib.Ground()), scene.add("bob", lib.PointMass(mass=mass))
    shaft = scene.add("shaft", lib.RotaryDrive(axis=(0.0, -1.0, 0.0), rotation=lambda t: turning * t))
    mount = scene.add("mount", lib.Bushing(stiffness=k, turning_stiffness=(0.0, 0.0, 0.0)))
    scene.connect(ground.frame, shaft.a)
    scene.connect(shaft.b, mount.a)
    scene.connect(mount.b, bob.point)
    # Counter-clockwise is about -y: at rest on the turning shaft at x = 0.1, it moves along z.
    scene.start.update({"bob.position.x": 0.1, "bob.velocity.z": turning * 0.1})
    result = simulate(scene, form=form, t_end=4.0, rtol=1e-10, outputs=9)
    motion = np.array(
        [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [turning**2 - k[0] / mass, 0.0, 0.0, 2.0 * turning],
            [0.0, turning**2 - k[2] / mass, -2.0 * turning, 0.0],
        ]
    )
    assert max(np.linalg.eigvals(motion).real) > 0.5
    exact = np.array([scipy.linalg.expm(motion * t) @ [0.1, 0.0, 0.0, 0.0] for t in result.time])
    found = np.stack([result["mount.displacement.x"], result["mount.displacement.z"]], axis=1)
    assert np.allclose(found, exact[:, :2], atol=1e-7)
    assert result.energy.max_drift < 1e-6
