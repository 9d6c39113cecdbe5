"""What tells a zero ahead, and a motion that comes to rest, on given numbers."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.simulation.singular.crossing import slowest, zero_ahead

TIMES = np.linspace(0.0, 1.2, 13)


@pytest.mark.parametrize("zero", [0.13, 0.4, 0.449, 0.451, 0.98])
@pytest.mark.parametrize("slope", [1e-6, 1.0, 1e6])
def test_a_measure_that_falls_evenly_is_followed_to_its_zero(zero: float, slope: float) -> None:
    assert zero_ahead(TIMES, slope * np.abs(np.sin(TIMES - zero))) == pytest.approx(zero, abs=1e-3)


def test_a_measure_that_turns_back_has_no_zero() -> None:
    assert zero_ahead(TIMES, 0.1 + (TIMES - 0.43) ** 2) is None
    assert zero_ahead(TIMES, (TIMES - 0.43) ** 2) is None  # it only touches zero
    assert zero_ahead(TIMES, TIMES[::-1] - 1.2) is None
    assert zero_ahead(TIMES, np.abs(TIMES - 2.0)) is None
    assert zero_ahead(TIMES, np.full(13, np.nan)) is None


def test_the_slowest_moment_is_where_energy_is_least() -> None:
    speeds = np.array([1e-3, 5.0])[:, None] * (TIMES - 0.437)
    assert slowest(TIMES, speeds, np.array([1e-3, 5.0])) == pytest.approx(0.437, abs=1e-12)
    assert slowest(TIMES, 1.0 + speeds[1:], np.array([1.0])) == pytest.approx(0.237, abs=1e-12)
    assert slowest(TIMES, TIMES[None, :], np.array([1.0])) is None
