"""Runs over many periods: what stays constant does, and periods are those of the integrals."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest

from atwood import Result, simulate
from atwood_library.scenes import LagrangeTop

from ..references.top import LagrangeTop as ExactTop

TRANSVERSE, AXIAL, WEIGHT = 0.025, 0.01, 0.981
"""Moments of inertia about the tip (kg m^2), and m g h (N m)."""

PERIODS, IN_EACH = 100, 60


def exact_top(scene: LagrangeTop) -> ExactTop:
    """Return the exact motion of the scene."""
    start = simulate(scene.copy(), t_end=1e-3, outputs=2)
    theta, precession = float(scene.inclination), float(start["top.phi_rate"][0])
    rates = (precession, 0.0, float(scene.spin) - precession * np.cos(theta))
    return ExactTop(TRANSVERSE, AXIAL, WEIGHT, (0.0, theta, 0.0), rates)


def nutation_period(energy: float, p_phi: float, p_psi: float, low: float, high: float) -> float:
    """Return the period from the integral of ``I1 u'^2 = F(u)`` over the cosine of the inclination, there and back.

    Goldstein, Poole and Safko, *Classical Mechanics*, equation 5.62; by quadrature, with nothing of elliptic functions.
    """
    with mp.workdps(30):
        a, b = mp.mpf(p_psi) / TRANSVERSE, mp.mpf(p_phi) / TRANSVERSE
        alpha = (2 * mp.mpf(energy) - mp.mpf(p_psi) ** 2 / AXIAL) / TRANSVERSE
        beta = 2 * mp.mpf(WEIGHT) / TRANSVERSE
        third = (alpha + a * a) / beta - low - high  # the sum of all roots

        def slow(phase: Any) -> Any:
            u = low + (high - low) * mp.sin(phase) ** 2
            return 2 / mp.sqrt(beta * (third - u))

        value = (1 - mp.mpf(low) ** 2) * (alpha - beta * low) - (b - a * low) ** 2
        assert abs(value) < 1e-9 * alpha  # F is zero where the axis turns
        return float(2 * mp.quad(slow, [0, mp.pi / 4, mp.pi / 2]))


def lowest(result: Result) -> np.ndarray:
    """Return the times at which the top is lowest: zeros of its rate, from polynomials through ten samples."""
    t, rate = result.time, np.asarray(result["top.theta_rate"])
    found = []
    for k in np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0)):
        if 4 <= k < len(t) - 6:
            h = t[k + 1] - t[k]
            near = np.polynomial.Polynomial.fit((t[k - 4 : k + 6] - t[k]) / h, rate[k - 4 : k + 6], 9)
            roots = near.roots()
            real = np.real(roots[(np.abs(np.imag(roots)) < 1e-9) & (np.abs(np.real(roots) - 0.5) <= 0.5 + 1e-9)])
            found.append(t[k] + h * real[0])
    return np.array(found)


@pytest.fixture(scope="module")
def runs() -> dict[str, tuple[ExactTop, Result]]:
    """Runs of the four motions as a user asks for them: nothing but a tight tolerance."""
    made = {}
    for motion in ("cusps", "loops", "waves", "steady"):
        scene = LagrangeTop(motion=motion)
        exact = exact_top(scene)
        end = (PERIODS + 1.0) * (0.38 if exact.steady else exact.period)
        made[motion] = exact, simulate(scene, rtol=1e-12, t_end=end, outputs=np.linspace(0.0, end, PERIODS * IN_EACH))
    return made


MOTIONS = ("cusps", "loops", "waves", "steady")


@pytest.mark.sample(3)
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_top_keeps_its_constants_over_a_hundred_nutations(runs: Any, motion: str) -> None:
    exact, result = runs[motion]
    spin = np.stack([result[f"top.spin.{axis}"] for axis in "xyz"])
    upwards = np.stack([result[f"top.{axis}_axis.z"] for axis in "xyz"])
    momentum = np.array([TRANSVERSE, TRANSVERSE, AXIAL])[:, None] * spin
    energy = 0.5 * np.sum(momentum * spin, axis=0) + WEIGHT * upwards[2]
    for values, right in ((np.sum(momentum * upwards, axis=0), exact.p_phi), (momentum[2], exact.p_psi)):
        assert np.max(np.abs(values - right)) < 1e-10 * abs(right)
    assert np.max(np.abs(energy - energy[0])) < 1e-10 * abs(energy[0])
    assert result.energy.max_drift < 1e-10
    # from rtol 1e-10 on a run without loops is given to Taylor series, which is what makes it so accurate
    assert "Taylor" in result.solver


@pytest.mark.parametrize("motion", MOTIONS[:3])
def test_the_nutation_period_is_the_elliptic_integral(runs: Any, motion: str) -> None:
    exact, result = runs[motion]
    times = lowest(result)
    assert len(times) >= PERIODS
    spin, up = result["top.spin.z"][0], np.cos(result["top.theta"])
    assert np.max(np.abs([up.min() - exact.lower, up.max() - exact.upper])) < 2e-3  # samples are not at the turns
    period = nutation_period(exact.energy, exact.p_phi, AXIAL * spin, exact.lower, exact.upper)
    assert abs(period - exact.period) < 1e-13
    assert np.max(np.abs(np.diff(times) - period)) < 1e-9 * period  # each
    assert abs(times[-1] - times[0] - (len(times) - 1) * period) < 1e-9 * period  # and all together


def test_a_steady_top_does_not_nutate(runs: Any) -> None:
    _, result = runs["steady"]
    assert np.ptp(result["top.theta"]) < 1e-11


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_axis_is_where_it_should_be_after_a_hundred_nutations(runs: Any, motion: str) -> None:
    exact, result = runs[motion]
    axis = np.stack([result[f"top.z_axis.{one}"] for one in "xyz"], axis=-1)
    assert np.max(np.abs(axis - exact.axis(result.time))) < 1e-10
