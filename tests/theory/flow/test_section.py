"""Poincare sections against motions that are known."""

import math

import numpy as np
import pytest

from atwood import UsageError, poincare_section, simulate
from atwood_library.scenes import DoublePendulum, Oscillators, SimplePendulum


def test_a_periodic_motion_passes_at_one_point() -> None:
    found = poincare_section(
        Oscillators(), "track.parameter rises above 0", ["track.rate", "track.parameter"], t_end=9.0
    )
    amplitude = math.hypot(0.5 * 2.0, 0.3)
    assert found["track.rate"] == pytest.approx(amplitude, rel=1e-9)
    assert found["track.parameter"] == pytest.approx(0.0, abs=1e-9)
    assert np.diff(found.time) == pytest.approx(math.pi, rel=1e-9)


def test_several_motions_are_told_apart() -> None:
    starts = [{"rod.angle": 0.5}, {"rod.angle": 1.5}]
    found = poincare_section(SimplePendulum(), "rod.angle  falls below 0", "rod.angular_velocity", starts=starts)
    for k, angle in enumerate((0.5, 1.5)):
        speed = -2.0 * math.sqrt(9.81) * math.sin(angle / 2.0)
        assert found["rod.angular_velocity"][found.start == k] == pytest.approx(speed, rel=1e-8)
    assert set(found.start) == {0, 1}
    assert found.surface == "rod.angle falls below 0"
    assert len(found) == len(found.to_data()["time"])
    assert found.units["rod.angular_velocity"] == "rad/s"


def test_passages_are_those_that_a_run_records() -> None:
    found = poincare_section(DoublePendulum(), "rod1.angle rises above 0", ["rod2.angle"], t_end=20.0)
    result = simulate(DoublePendulum(), t_end=20.0, rtol=1e-10, record="rod1.angle rises above 0")
    assert found.time == pytest.approx([event.time for event in result.events], abs=1e-9)


def test_what_is_not_there_is_said() -> None:
    with pytest.raises(UsageError, match="no start"):
        poincare_section(DoublePendulum(), "rod1.angle crosses 0", ["rod2.angle"], starts=[])
    with pytest.raises(KeyError, match=r"rod2\.angel"):
        poincare_section(DoublePendulum(), "rod1.angle crosses 0", ["rod2.angel"], t_end=1.0)
