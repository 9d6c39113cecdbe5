"""Forces, potentials and Rayleigh functions that act in some modes of a component only."""

import math

import numpy as np
import pytest

from atwood import Scene, simulate, sin
from atwood_library import Force, Ground, PointMass, PointOnLine, Slider

from ..helpers.contacts import Cushion, DryContact
from ..helpers.runs import FORMS, free_scene, run_both

MASS, LIMIT = 2.0, 3.0


def block_on_a_rail(space: str = "plane", pull: object = 0.0, starts: str = "sticks", speed: float = 0.0) -> Scene:
    """Return a block of 2 kg on a rail along x, with dry friction of 3 N and a pull along x."""
    scene = Scene(space=space)
    ground, block = scene.add("ground", Ground()), scene.add("block", PointMass(mass=MASS))
    rail = scene.add("rail", PointOnLine() if space == "space" else Slider())
    contact = scene.add("contact", DryContact(limit=LIMIT, starts=starts))
    force = scene.add("force", Force(value=pull))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, block.point)
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, block.point)
    scene.connect(force.point, block.point)
    scene.start.update({"block.position.x": 0.0})
    if starts != "sticks":
        scene.start["block.velocity.x"] = speed
    return scene


@pytest.mark.parametrize(("form", "space"), [("reduced", "plane"), ("dae", "plane"), ("dae", "space")])
def test_a_block_sticks_until_it_is_pulled_too_hard(form: str, space: str) -> None:
    result = simulate(block_on_a_rail(space, pull=lambda t: 2.0 * t), form=form, t_end=3.0, rtol=1e-10, outputs=31)
    (slips,) = result.events
    assert (slips.law, slips.target) == ("lets_go_ahead", "slips_ahead")
    assert slips.time == pytest.approx(LIMIT / 2.0, abs=1e-9)
    since = np.maximum(result.time - LIMIT / 2.0, 0.0)
    assert np.max(np.abs(result.array("block.velocity.x") - since**2 / MASS)) < 1e-8  # m v' = 2 t - 3
    holds = result.time < LIMIT / 2.0
    assert np.allclose(result.array("contact.grip")[holds], -2.0 * result.time[holds], atol=1e-8)
    assert np.all(result.array("contact.grip")[result.time > LIMIT / 2.0] == 0.0)
    # Friction takes 3 N over the whole way; the pull gives 2 t v.
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_a_sliding_block_comes_to_rest_and_stays(form: str) -> None:
    scene = block_on_a_rail(starts="slips_back", speed=-3.0)
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10, outputs=31)
    assert [one.law for one in result.events] == ["stops_back"]
    assert result.events[0].time == pytest.approx(3.0 * MASS / LIMIT, abs=1e-9)
    assert result.array("block.position.x")[-1] == pytest.approx(-MASS * 9.0 / (2.0 * LIMIT), abs=1e-8)
    assert result.energy.work[-1] == pytest.approx(-0.5 * MASS * 9.0, rel=1e-8)


def test_sticking_and_slipping_in_turn_is_alike_in_both_forms() -> None:
    def pulled() -> Scene:
        return block_on_a_rail(pull=lambda t: 6.0 * sin(2.0 * t))

    reduced, dae = run_both(pulled, t_end=6.0, rtol=1e-10, outputs=61)
    assert [one.law for one in reduced.events] == [one.law for one in dae.events]
    assert {"lets_go_ahead", "lets_go_back", "stops_ahead", "stops_back"} <= {one.law for one in dae.events}
    assert reduced.events[0].time == pytest.approx(math.asin(LIMIT / 6.0) / 2.0, abs=1e-9)
    assert np.max(np.abs(reduced.array("block.position.x") - dae.array("block.position.x"))) < 1e-8


def thrown(**cushion: float) -> Scene:
    """Return a mass of 1 kg that flies along x at 2 m/s towards a wall."""
    scene = free_scene()
    mass, wall = scene.add("mass", PointMass(mass=1.0)), scene.add("wall", Cushion(**cushion))
    scene.connect(mass.point, wall.b)
    scene.start.update({"mass.position.x": 0.0, "mass.position.z": 0.0, "mass.velocity.x": 2.0, "mass.velocity.z": 0.5})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_an_elastic_wall_throws_back(form: str) -> None:
    result = simulate(thrown(), form=form, t_end=2.0, rtol=1e-10, outputs=41)
    touches, goes = result.events
    assert touches.time == pytest.approx(0.5, abs=1e-9)
    assert goes.time - touches.time == pytest.approx(math.pi / 10.0, abs=1e-7)  # half a period of sqrt(k/m) = 10/s
    assert result.array("mass.velocity.x")[-1] == pytest.approx(-2.0, abs=2e-7)
    assert result.array("mass.velocity.z")[-1] == pytest.approx(0.5, abs=1e-12)
    assert result.energy.max_drift < 1e-6


def test_a_viscous_wall_takes_energy_while_it_is_touched() -> None:
    result = simulate(thrown(damping=4.0), t_end=2.0, rtol=1e-10, outputs=41)
    touches, goes = result.events
    # x'' + 4 x' + 100 x = 0 with x = 0, x' = 2: it is back where it touched after half a period.
    w = math.sqrt(100.0 - 4.0)
    assert goes.time - touches.time == pytest.approx(math.pi / w, abs=1e-9)
    assert result.array("mass.velocity.x")[-1] == pytest.approx(-2.0 * math.exp(-2.0 * math.pi / w), abs=1e-7)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_energy_that_comes_with_a_mode_is_work(form: str) -> None:
    result = simulate(thrown(preload=5.0, store=3.0), form=form, t_end=0.6, rtol=1e-10, outputs=13)
    assert [one.target for one in result.events] == ["touching"]
    assert result.energy.work[0] == 0.0
    assert result.energy.work[-1] == pytest.approx(3.0, rel=1e-9)
    assert result.energy.max_drift < 1e-8
