import math

import numpy as np
import pytest

from .calculus import derivative
from .jacobi import amplitude, jacobi, quarter_period
from .pendulum import FourBarRow, PlanePendulum
from .values import FOUR_BAR_ROW


@pytest.mark.parametrize(
    ("angle", "rate"),
    [(0.3, 0.0), (-2.9, 0.4), (-2.9, -0.4), (0.3, 6.0), (2.0, -6.0), (0.3, -7.5), (20.0, 9.0), (-9.0, 0.3), (3.1, 2.0)],
)
def test_the_equation_and_the_start(angle, rate):
    pendulum = PlanePendulum(9.81, angle, rate)
    assert float(pendulum.angle(0.0)) == pytest.approx(angle, rel=1e-14)
    assert float(pendulum.rate(0.0)) == pytest.approx(rate, rel=1e-13, abs=1e-13)
    for t in (-2.0, 0.1, 3.3, 20.0):
        assert derivative(pendulum.angle, t, 5e-3) == pytest.approx(float(pendulum.rate(t)), abs=1e-10)
        assert derivative(pendulum.rate, t, 5e-3) == pytest.approx(-9.81 * math.sin(pendulum.angle(t)), abs=2e-10)
    gain = math.copysign(2 * math.pi, rate) if pendulum.goes_round else 0.0
    assert float(pendulum.angle(0.4 + pendulum.period)) == pytest.approx(float(pendulum.angle(0.4)) + gain, abs=1e-12)


def test_the_amplitude_counts_turns():
    u = np.linspace(-20, 20, 401)
    found = amplitude(u, 0.3)
    assert np.all(np.diff(found) > 0)
    assert np.allclose(np.sin(found), jacobi(u, 0.3)[0], atol=1e-15)
    assert float(amplitude(7 * quarter_period(0.3), 0.3)) == pytest.approx(7 * math.pi / 2)


def test_the_row_of_four_bars_meets_the_published_values():
    row = FourBarRow(2)
    assert row.kappa == pytest.approx(FOUR_BAR_ROW["kappa"], rel=1e-15)
    assert row.period == pytest.approx(FOUR_BAR_ROW["turn"], rel=1e-14)
    for t, (angle, rate) in FOUR_BAR_ROW["values"].items():
        assert float(row.crank_angle(t)) == pytest.approx(angle, rel=2e-14)
        assert float(row.rate(t)) == pytest.approx(rate, rel=1e-13)


def test_the_row_has_the_energy_of_its_rods():
    """Cranks turn about their feet; couplers move without turning."""
    row = FourBarRow(5, angle=0.7, rate=-0.3, length=0.8)
    t = np.linspace(0, 4, 9)
    a, speed = row.crank_angle(t), 0.8 * row.rate(t)
    energy = 6 * (speed**2 / 6 + 9.81 * 0.4 * np.cos(a)) + 5 * (speed**2 / 2 + 9.81 * 0.8 * np.cos(a))
    assert np.allclose(energy, energy[0], rtol=1e-13)
