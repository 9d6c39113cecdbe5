"""Impacts of constraints that a mode adds: what holds both ways takes an impulse of either sign."""

import numpy as np
import pytest

from atwood import Scene, SolveError, simulate
from atwood_library import PointMass

from ..helpers.latches import Latch
from ..helpers.runs import FORMS, free_scene


def two_masses(speed: float, space: str, **latch: object) -> Scene:
    """A mass of 1 kg passes one of 3 kg at rest after 0.5 s."""
    scene = free_scene(space=space, t_end=1.0)
    one, two = scene.add("one", PointMass(mass=1.0)), scene.add("two", PointMass(mass=3.0))
    hook = scene.add("latch", Latch(**latch))
    scene.connect(hook.a, two.point)
    scene.connect(hook.b, one.point)
    scene.start.update({"one.position.x": -0.5 * speed, "one.velocity.x": speed, "one.velocity.z": 0.3})
    scene.start.update({"two.position.x": 0.0, "two.velocity.x": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("speed", "space", "limit"), [(2.0, "plane", 1e3), (-2.0, "space", 1e3), (-2.0, "plane", 5.0)])
def test_a_latch_takes_an_impulse_of_either_sign(form: str, speed: float, space: str, limit: float) -> None:
    result = simulate(two_masses(speed, space, limit=limit), form=form, rtol=1e-10, outputs=11)
    (latched,) = result.events
    assert latched.impact
    assert latched.time == pytest.approx(0.5, abs=1e-9)
    one, two = result["one.velocity.x"], result["two.velocity.x"]
    assert np.max(np.abs(one + 3.0 * two - speed)) < 1e-9
    assert (one[-1], two[-1]) == pytest.approx((0.25 * speed, 0.25 * speed), abs=1e-9)
    assert result["one.velocity.z"][-1] == pytest.approx(0.3, abs=1e-9)  # the hook holds along x alone
    # What a plastic impact takes: half the reduced mass, 3/4 kg, times the relative speed squared.
    assert result.energy.work[-1] == pytest.approx(-0.375 * speed**2, abs=1e-8)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("speed", "bears"), [(2.0, "pull"), (-2.0, "push"), (2.0, "push"), (-2.0, "pull")])
def test_what_is_one_sided_takes_one_sign_only(form: str, speed: float, bears: str) -> None:
    scene = two_masses(speed, "plane", bears=bears)
    # The hook slows b down: its force on it is against the speed.
    if (speed > 0.0) == (bears == "pull"):
        assert simulate(scene, form=form).events[0].impact
        return
    with pytest.raises(SolveError, match="one-sided") as caught:
        simulate(scene, form=form)
    assert caught.value.where == "latch"
