"""Runs are sampled as often as what drives them changes, so that its work is right."""

import math

import numpy as np
import pytest

from atwood import Result, Scene, select, simulate, sin
from atwood.pipeline import assemble
from atwood.solve.inputs import samples_needed
from atwood_library import Force, Ground, PointMass, Spring
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def shaken(frequency: float) -> Scene:
    scene = Scene(gravity=0.0, t_end=1.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass())
    push = scene.add("push", Force(value=lambda t: 100.0 * sin(2.0 * math.pi * frequency * t)))
    spring = scene.add("spring", Spring(stiffness=10.0, natural_length=1.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.connect(push.point, bob.point)
    scene.start.update({"bob.position.x": 1.0, "bob.position.z": 0.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene


def needed(scene: Scene) -> int:
    return samples_needed(assemble(scene), 0.0, 1.0)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("frequency", [1.0, 30.0, 100.0, 400.0])
def test_the_work_of_a_fast_drive_is_right(frequency: float, form: str) -> None:
    rtol, drift = (1e-9, 3e-6) if form == "reduced" else (1e-11, 1e-5)
    result: Result = simulate(shaken(frequency), form=form, rtol=rtol, outputs=11)
    assert result.energy.max_drift < drift
    assert np.ptp(result.energy.total) > 0.0
    assert len(result.time) == 11


def test_samples_follow_the_functions_of_time() -> None:
    counts = [needed(shaken(frequency)) for frequency in (1.0, 30.0, 100.0, 400.0)]
    assert counts[0] == 400
    assert counts == sorted(counts)
    assert counts[2:] == [10_000, 10_000]
    assert samples_needed(assemble(SCENES["double-pendulum"]()), 0.0, 10.0) == 0


def test_a_jump_asks_for_no_more_samples() -> None:
    scene = Scene(gravity=0.0, t_end=1.0)
    bob = scene.add("bob", PointMass())
    push = scene.add("push", Force(value=lambda t: select(t < 0.3, 1.0, 0.0)))
    scene.connect(push.point, bob.point)
    assert needed(scene) == 400
