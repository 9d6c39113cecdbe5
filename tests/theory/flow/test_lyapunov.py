"""Lyapunov exponents against closed forms, and the laws that hold for all of them."""

import math

import numpy as np
import pytest

from atwood import UsageError, lyapunov_exponents
from atwood_library import Drag
from atwood_library.scenes import DoublePendulum, FourBar, Oscillators, SimplePendulum


def test_a_saddle_grows_at_its_rate() -> None:
    scene = Oscillators(kind="inverted", away=0.0, rate=0.0)
    found = lyapunov_exponents(scene, t_end=30.0)
    assert found.exponents == pytest.approx([2.0, -2.0], rel=1e-9)
    assert found.horizon(1e-6) == pytest.approx(math.log(1e6) / 2.0, rel=1e-9)
    assert found.running[len(found.running) // 2] == pytest.approx([2.0, -2.0], rel=1e-9)


def test_friction_damps_all_directions_together() -> None:
    scene = SimplePendulum(mass=0.7)
    drag = scene.add("drag", Drag(linear=0.3))
    scene.connect(drag.point, scene.bob.point)
    found = lyapunov_exponents(scene, t_end=60.0, settle=40.0)
    assert found.exponents == pytest.approx([-0.15 / 0.7] * 2, abs=0.02)
    assert np.sum(found.exponents) == pytest.approx(-0.3 / 0.7, rel=1e-9)
    assert found.horizon() == math.inf
    assert not found.is_chaotic


def test_exponents_of_chaos_come_in_pairs() -> None:
    found = lyapunov_exponents(DoublePendulum(), t_end=200.0)
    assert found.exponents[0] == pytest.approx(-found.exponents[3], abs=0.15)
    assert abs(found.exponents[1]) < 0.1
    assert abs(found.exponents[2]) < 0.1
    assert np.sum(found.exponents) == pytest.approx(0.0, abs=0.02)
    assert 0.7 < found.exponents[0] < 1.2
    assert found.is_chaotic
    assert found.horizon() == pytest.approx(math.log(1e10) / found.exponents[0])
    first = lyapunov_exponents(DoublePendulum(), t_end=20.0, count=1)
    assert first.exponents.shape == (1,)
    assert found.to_data()["exponents"] == list(found.exponents)


def test_deviations_of_closed_loops_are_independent_ones() -> None:
    found = lyapunov_exponents(FourBar(), t_end=3.0, rtol=1e-9)
    assert len(found.exponents) == 2
    with pytest.raises(UsageError, match=r"there are no 3 Lyapunov exponents. It has 2\."):
        lyapunov_exponents(FourBar(), t_end=0.1, count=3)
    with pytest.raises(UsageError, match="nothing is left to be counted"):
        lyapunov_exponents(FourBar(), t_end=0.1, settle=0.2)
