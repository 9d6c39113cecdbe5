"""Bodies that are thrown onto a floor, and others far lighter than what they touch: energy never grows."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, simulate
from atwood_library import Box, BoxContact, Ground, PointContact, PointMass, Slider


def test_where_impacts_of_corners_accumulate_energy_does_not_grow() -> None:
    """Two corners come to rest together, of which one still rises: what it rubbed too much is not given back."""
    scene = Scene(gravity=9.81, space="space", t_end=0.68)
    ground, box = scene.add("ground", Ground()), scene.add("box", Box(length_x=0.4, length_y=0.2, length_z=0.3))
    floor = BoxContact(length=0.4, width=0.2, height=0.3, corners=8, restitution=0.3, friction=0.4)
    contact = scene.add("contact", floor)
    scene.connect(ground.frame, contact.plane)
    scene.connect(box.frame, contact.box)
    scene.start.update({f"box.position.{axis}": value for axis, value in zip("xyz", (0.0, 0.0, 1.0), strict=True)})
    scene.start.update({f"box.velocity.{axis}": value for axis, value in zip("xyz", (0.5, 0.2, 0.0), strict=True)})
    spins = np.random.default_rng(0).normal(0.0, 3.0, 3).tolist()
    scene.start.update({f"box.spin.{axis}": value for axis, value in zip("xyz", spins, strict=True)})
    run = simulate(scene, rtol=1e-11, outputs=11)
    energy = np.asarray(run.energy.total)
    assert any(one.kind == "rests" for one in run.events)
    assert np.max(energy - np.minimum.accumulate(energy)) < 1e-13 * energy[0]


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("share", [1e-6, 1e-12, 1e-14])
def test_friction_acts_on_what_is_far_lighter(form: str, share: float) -> None:
    """A puck on a slab that slides along: both go on with one speed when the puck no longer slips."""
    scene = Scene(gravity=9.81, t_end=0.5)
    ground, rail, slab = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("slab", Box(mass=1.0))
    puck, contact = scene.add("puck", PointMass(mass=share)), scene.add("contact", PointContact(friction=0.3))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, slab.frame)
    scene.connect(slab.frame, contact.plane)
    scene.connect(puck.point, contact.point)
    scene.start.update({"slab.position.x": 0.0, "slab.velocity.x": 1.0, "puck.velocity.x": 0.0, "puck.velocity.z": 0.0})
    scene.start.update({"puck.position.x": 0.0, "puck.position.z": 0.0})
    run = simulate(scene, form=form, rtol=1e-10)
    sticks = next(one.time for one in run.events if one.kind == "sticks")
    assert sticks == pytest.approx(1.0 / (0.3 * 9.81 * (1.0 + share)), abs=1e-9)
    assert run["puck.velocity.x"][-1] == pytest.approx(1.0 / (1.0 + share), abs=1e-12)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("angle", "spin", "speed", "restitution", "friction", "rtol"),
    [
        (0.612709808129998, -2.354341066032835, 0.5731365660907521, 0.3, 0.4, 1e-11),
        (0.6349896734588635, -1.6108597060808556, 1.1137987045537419, 0.7, 0.2, 7.758e-9),
        (1.4813131944375322, 3.7014107202555255, 1.7520882195088112, 0.7, 0.2, 9.934e-12),
    ],
)
def test_a_thrown_box_comes_to_rest_though_rounding_makes_its_bounces(
    angle: float, spin: float, speed: float, restitution: float, friction: float, rtol: float, form: str
) -> None:
    """Corners bounce in turn, unevenly, by 1e-15 m at last; or one slips back as the other strikes."""
    scene = Scene(gravity=9.81, t_end=2.5)
    ground, box = scene.add("ground", Ground()), scene.add("box", Box(mass=1.0, length_x=0.4, length_z=0.3))
    floor = BoxContact(length=0.4, height=0.3, restitution=restitution, friction=friction)
    contact = scene.add("contact", floor)
    scene.connect(ground.frame, contact.plane)
    scene.connect(box.frame, contact.box)
    scene.start.update({"box.position.x": 0.0, "box.position.z": 0.6, "box.velocity.x": speed, "box.velocity.z": 0.0})
    scene.start.update({"box.angle": angle, "box.angular_velocity.y": spin})
    run = simulate(scene, form=form, rtol=rtol, outputs=11, max_seconds=60.0)
    energy = np.asarray(run.energy.total)
    assert run.status == "finished"
    assert len(run.events) < 200
    assert min(abs(energy[-1] - 9.81 * half) for half in (0.15, 0.2)) < 1e-9  # it lies on a side
    assert np.max(energy - np.minimum.accumulate(energy)) < rtol * energy[0]
