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
