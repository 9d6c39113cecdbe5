"""Lagrange's top and the spherical pendulum: against their equations, published digits, and limits."""

import math

import mpmath as mp
import numpy as np
import pytest

from .calculus import derivative
from .rotations import angle_between, cross_matrix, from_quaternion
from .spherical_pendulum import SphericalPendulum
from .top import LagrangeTop, sleeping_spin, steady_precession_rates
from .values import LAGRANGE_TOP, SPHERICAL_PENDULUM

BODY = (0.025, 0.01, 0.981)  # A, C, m g l
SLOW, FAST = steady_precession_rates(*BODY, math.pi / 5, 45.0)
TOPS = {
    "no loops": ((0.3, math.pi / 4, 0.2), (1.0, 0.0, 40.0)),
    "cusps": ((0.3, math.pi / 6, 0.2), (0.0, 0.0, 50.0)),
    "loops": ((0.3, math.pi / 4, 0.2), (-2.0, 0.0, 40.0)),
    "anywhere": ((2.0, 1.1, -0.7), (3.0, 2.5, -20.0)),
    "falling": ((2.0, 1.1, -0.7), (3.0, -2.5, 30.0)),
    "steady, slow": ((0.0, math.pi / 5, 0.0), (SLOW, 0.0, 45.0 - SLOW * math.cos(math.pi / 5))),
    "steady, fast": ((0.0, math.pi / 5, 0.0), (FAST, 0.0, 45.0 - FAST * math.cos(math.pi / 5))),
    "sleeping": ((0.3, 0.0, 0.5), (0.0, 0.0, 60.0)),
    "upright, too slow": ((0.3, 0.0, 0.5), (0.0, 0.0, 6.0)),
    "through the top": ((0.3, 0.0, 0.5), (0.0, 4.0, 12.0)),
    "through the top, fast": ((0.3, 0.0, 0.5), (0.0, 0.5, 60.0)),
    "through the bottom": ((0.3, math.pi, 0.5), (0.0, 3.0, 5.0)),
    "past the top": ((0.3, 1e-6, 0.5), (0.0, 4.0, 12.0)),
    "nearly flat turn": ((0.3, 2.0, 0.5), (1e-9, 0.0, 1e-8)),
    "no spin, planar": ((0.3, 2.0, 0.5), (0.0, 1.0, 0.0)),
    "no spin, over the top": ((0.3, 2.0, 0.5), (0.0, 15.0, 0.0)),
}


@pytest.mark.parametrize("name", TOPS)
def test_the_equations_of_motion_hold(name):
    a, c, weight = BODY
    top = LagrangeTop(*BODY, *TOPS[name])
    moments = np.array([a, a, c])
    for t in (-0.31, 0.0, 0.05, 0.7, 2.9, 11.1):
        w, r = top.omega(t), top.orientation(t)
        torque = weight * np.cross([0, 0, 1], r.T @ [0, 0, -1.0])
        size = weight + c * float(np.max(np.abs(w))) ** 2
        found = moments * derivative(top.omega, t, 1e-3) - np.cross(moments * w, w)
        assert np.allclose(found, torque, rtol=0, atol=2e-11 * size)
        rates = derivative(top.orientation, t, 1e-3)
        assert np.allclose(rates, r @ cross_matrix(w), rtol=0, atol=1e-10 * (1 + np.max(np.abs(w))))


@pytest.mark.parametrize("name", TOPS)
def test_start_and_constants(name):
    a, c, weight = BODY
    angles, rates = TOPS[name]
    top = LagrangeTop(*BODY, angles, rates)
    t = np.linspace(0, 30, 61)
    w, r = top.omega(t), top.orientation(t)
    phi, theta, psi = (np.array([math.cos(x), math.sin(x)]) for x in angles)
    assert np.allclose(r[0, :, 2], [theta[1] * phi[0], theta[1] * phi[1], theta[0]], atol=1e-14)
    expected_omega = [
        -rates[0] * theta[1] * psi[0] + rates[1] * psi[1],
        rates[0] * theta[1] * psi[1] + rates[1] * psi[0],
        rates[2] + rates[0] * theta[0],
    ]
    assert np.allclose(w[0], expected_omega, atol=1e-12)
    assert np.allclose(np.swapaxes(r, -1, -2) @ r, np.eye(3), atol=1e-13)
    momentum = np.array([a, a, c]) * w
    height = r[:, 2, 2]
    energy = 0.5 * np.sum(momentum * w, axis=-1) + weight * height
    size = 0.5 * float(np.sum(momentum[0] * w[0])) + weight
    assert np.allclose(energy, top.energy, rtol=0, atol=1e-12 * size)
    world = np.einsum("nij,nj->ni", r, momentum)
    assert np.allclose(world[:, 2], top.p_phi, atol=1e-12 * np.linalg.norm(momentum[0]) + 1e-15)
    assert np.allclose(w[:, 2], expected_omega[2], atol=1e-12 * (1 + abs(expected_omega[2])))
    assert np.allclose(top.axis(t), r[:, :, 2], atol=1e-13)
    assert np.allclose(top.cos_theta(t), height, atol=1e-13)


@pytest.mark.parametrize("name", ["no loops", "cusps", "loops", "anywhere", "past the top"])
def test_period_and_advance_are_the_integrals_they_stand_for(name):
    """The nutation period is twice the integral of du / sqrt(F(u)) between the turning cosines."""
    a, c, weight = BODY
    top = LagrangeTop(*BODY, *TOPS[name])
    with mp.workdps(40):
        alpha = (2 * mp.mpf(top.energy) - mp.mpf(top.p_psi) ** 2 / c) / a
        beta, spin, b = 2 * mp.mpf(weight) / a, mp.mpf(top.p_psi) / a, mp.mpf(top.p_phi) / a

        def power(u):
            return (1 - u * u) * (alpha - beta * u) - (b - spin * u) ** 2

        low, high = (mp.findroot(power, mp.mpf(u)) for u in (top.lower, top.upper))
        third = (alpha + spin**2) / beta - low - high

        def over(x, weight=lambda u: 1):
            u = low + (high - low) * mp.sin(x) ** 2  # the roots at both ends cancel
            return weight(u) / mp.sqrt(beta * (third - u))

        nodes = mp.linspace(0, mp.pi / 2, 9)
        period = 4 * mp.quad(over, nodes)
        assert top.period == pytest.approx(float(period), rel=1e-12)
        if name != "past the top":  # its azimuth jumps too sharply for this integral
            step_result = 4 * mp.quad(lambda x: over(x, lambda u: (b - spin * u) / (1 - u * u)), nodes)
            assert top.precession == pytest.approx(float(step_result), rel=1e-12)
    later = top.axis(top.period + 0.1)
    turned = from_quaternion([math.cos(top.precession / 2), 0, 0, math.sin(top.precession / 2)]) @ top.axis(0.1)
    assert np.allclose(later, turned, atol=1e-12)


@pytest.mark.parametrize("name", LAGRANGE_TOP)
def test_published_values(name):
    case = LAGRANGE_TOP[name]
    top = LagrangeTop(case["transverse"], case["axial"], case["weight_moment"], case["angles"], case["rates"])
    assert np.allclose([top.lower, top.upper, top.third], case["cosines"], rtol=1e-15)
    assert top.period == pytest.approx(case["period"], rel=1e-15)
    assert top.precession == pytest.approx(case["precession"], rel=1e-14)
    for t, (omega, q) in case["values"].items():
        assert np.allclose(top.omega(t), omega, rtol=0, atol=1e-13)
        assert angle_between(top.orientation(t), from_quaternion(q)) < 5e-14


def test_the_four_motions_differ_in_how_the_azimuth_goes():
    signs = {}
    for name in ("no loops", "cusps", "loops", "steady, slow"):
        top = LagrangeTop(*BODY, *TOPS[name])
        t = np.linspace(0, 1, 4001)
        axis, rate = top.axis(t), top.axis_rate(t)
        azimuth = (axis[:, 0] * rate[:, 1] - axis[:, 1] * rate[:, 0]) / (axis[:, 0] ** 2 + axis[:, 1] ** 2)
        signs[name] = (azimuth.min(), azimuth.max())
    assert signs["no loops"][0] > 1e-3
    assert signs["cusps"][0] == pytest.approx(0, abs=1e-12)
    assert signs["loops"][0] < -1
    assert signs["loops"][1] > 1
    assert signs["steady, slow"] == pytest.approx((SLOW, SLOW), rel=1e-12)


def test_steady_precession_and_sleeping():
    a, c, weight = BODY
    for rate in (SLOW, FAST):
        assert a * math.cos(math.pi / 5) * rate**2 - c * 45 * rate + weight == pytest.approx(0, abs=1e-13)
    assert steady_precession_rates(*BODY, 0.3, 10.0) == ()
    assert len(steady_precession_rates(*BODY, math.pi / 2, 10.0)) == 1
    threshold = sleeping_spin(*BODY)
    for factor, falls in ((1.001, False), (0.99, True)):
        top = LagrangeTop(*BODY, (0.0, 1e-6, 0.0), (0.0, 0.0, factor * threshold))
        assert (top.lower < 1 - 1e-6) == falls


@pytest.mark.parametrize("name", SPHERICAL_PENDULUM)
def test_published_pendulums(name):
    case = SPHERICAL_PENDULUM[name]
    with mp.workdps(40):
        theta = mp.pi / round(math.pi / case["theta"])
        rate, gravity = mp.mpf(str(case["azimuth_rate"])), mp.mpf(str(case["gravity"]))
        start, velocity = (mp.sin(theta), 0, -mp.cos(theta)), (0, rate * mp.sin(theta), 0)
        pendulum = SphericalPendulum(case["length"], gravity, start, velocity)
    assert pendulum.period == pytest.approx(case["period"], rel=1e-15)
    assert pendulum.azimuth_advance == pytest.approx(case["azimuth_advance"], rel=1e-14)
    turning = [pendulum.z_lowest, pendulum.z_highest]
    assert np.allclose(turning, case["z_turning"], rtol=1e-15, atol=1e-15)
    for t, (position, speed) in case["values"].items():
        assert np.allclose(pendulum.position(t), position, rtol=0, atol=5e-14)
        assert np.allclose(pendulum.velocity(t), speed, rtol=0, atol=2e-13)


@pytest.mark.parametrize(
    ("position", "velocity"),
    [
        ((1.2, 0, -0.9), (0, 2, 0)),
        ((1.2, 0, -0.9), (0, 1e-9, 0)),
        ((1.2, 0, -0.9), (0, 0, 0)),
        ((0.9, 0, -1.2), (1.2, 0, 0.9)),
        ((0, 0, -1.5), (1, -2, 0)),
        ((0, 0, -1.5), (5, 8, 0)),
        ((0, 0, 1.5), (0.5, 0.3, 0)),
        ((0, 0, 1.5), (0, 0, 0)),
        ((0, 0, -1.5), (0, 0, 0)),
        ((0.9, 0, -1.2), (0, math.sqrt(9.81 * 0.9**2 / 1.2), 0)),
        ((0.9, 0, 1.2), (4, 5, -3)),
    ],
)
def test_pendulums_fulfil_their_equation(position, velocity):
    pendulum = SphericalPendulum(1.5, 9.81, position, velocity)
    assert np.allclose(pendulum.position(0.0), position, atol=1e-14)
    assert np.allclose(pendulum.velocity(0.0), velocity, atol=2e-14)
    for t in (-1.3, 0.0, 0.4, 2.0, 17.0):
        r, v = pendulum.position(t), pendulum.velocity(t)
        assert np.allclose(derivative(pendulum.position, t, 5e-3), v, atol=2e-11)
        force = np.array([0, 0, -9.81]) - pendulum.tension(t) * r / 1.5
        assert np.allclose(derivative(pendulum.velocity, t, 5e-3), force, atol=3e-10)
        energy = 0.5 * v @ v + 9.81 * r[2]
        assert energy == pytest.approx(0.5 * np.dot(velocity, velocity) + 9.81 * position[2], abs=1e-12)


def test_a_plane_pendulum_has_the_known_period():
    theta = 2.0
    pendulum = SphericalPendulum(1, 9.81, (math.sin(theta), 0, -math.cos(theta)), (0, 0, 0))
    with mp.workdps(30):
        expected = float(4 * mp.ellipk(mp.sin(mp.mpf(theta) / 2) ** 2) / mp.sqrt(mp.mpf(9.81)))
    # The height has half the period of the swing.
    assert 2 * pendulum.period == pytest.approx(expected, rel=1e-14)


def test_starts_off_the_sphere_are_refused():
    with pytest.raises(ValueError, match="not on the sphere"):
        SphericalPendulum(1, 9.81, (1, 0, 0.1), (0, 1, 0))
    with pytest.raises(ValueError, match="not on the sphere"):
        SphericalPendulum(1, 9.81, (1, 0, 0), (0.1, 1, 0))
