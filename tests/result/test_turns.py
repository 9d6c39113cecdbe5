"""Angles that are known within one turn are counted, however far apart the samples are."""

import math

import numpy as np
import pytest

from atwood import simulate
from atwood_library.scenes import DoublePendulum, LagrangeTop, SimplePendulum


@pytest.mark.parametrize("samples", [1, 50, 400])
def test_a_pendulum_that_swings_does_not_turn_over(samples: int) -> None:
    """Some 75 swings between the samples, or one and a half, or a fifth."""
    scene = SimplePendulum(release_angle=2.0)
    result = simulate(scene, form="dae", t_end=200.0, samples=samples, outputs=5)
    assert np.max(np.abs(result["rod.angle"])) < 2.1
    assert result["rod.angle"] == pytest.approx(scene.closed_form(result.time)["rod.angle"], abs=0.05)


def test_turns_of_a_pendulum_that_goes_over_are_counted() -> None:
    """The rate is the same at all samples, which are a period apart, and another in between."""
    scene = SimplePendulum(release_angle=0.0)
    scene.start["rod.angular_velocity"] = 7.0
    fine = simulate(scene, t_end=40.0, rtol=1e-11)
    turn = np.interp(2.0 * math.pi, fine["rod.angle"], fine.time)
    result = simulate(scene, form="dae", t_end=30.0 * turn, outputs=np.arange(31) * turn, samples=1, rtol=1e-9)
    assert result["rod.angle"] == pytest.approx(2.0 * math.pi * np.arange(31), abs=0.5)


def test_both_forms_count_alike() -> None:
    found = [
        simulate(DoublePendulum(), form=form, t_end=12.0, outputs=4, samples=1, rtol=1e-11)
        for form in ("reduced", "dae")
    ]
    assert found[1]["rod2.angle"] == pytest.approx(found[0]["rod2.angle"], abs=1e-3)


def test_precession_is_counted_over_long_times() -> None:
    coarse = simulate(LagrangeTop(), t_end=40.0, outputs=3, samples=1, rtol=1e-10)
    fine = simulate(LagrangeTop(), t_end=40.0, outputs=3, samples=20_000, rtol=1e-10)
    assert coarse["top.phi"] == pytest.approx(fine["top.phi"], abs=1e-6)
    assert coarse["top.psi"] == pytest.approx(fine["top.psi"], abs=1e-6)
