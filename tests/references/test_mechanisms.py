"""Linkages, governors, Bricard and Foucault against their geometry, their equations and published values."""

import math

import numpy as np
import pytest

from .bricard import Bricard, chain, joint_3, partner
from .calculus import derivative, integrate
from .foucault import PolarFoucault, SmallFoucault, coriolis_acceleration
from .governor import StiffGovernor, WattGovernor
from .linkages import SpatialSliderCrank, universal_joint
from .rotations import about, about_x, about_y, about_z, angle_between, euler_zyz, from_quaternion, quaternion
from .values import BRICARD, FOUCAULT, STIFF_GOVERNOR


@pytest.mark.parametrize("bend", [0.0, 0.3, -0.7, 1.4])
def test_the_arms_of_a_universal_joint_stay_at_right_angles(bend):
    angle = np.linspace(-9, 9, 37)
    out, ratio, slope = universal_joint(angle, bend)
    driving = np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=-1)  # shaft along x
    across = np.array([-math.sin(bend), math.cos(bend), 0])
    driven = np.cos(out)[:, None] * across + np.sin(out)[:, None] * np.array([0, 0, 1.0])
    assert np.allclose(np.sum(driving * driven, axis=-1), 0, atol=5e-15)
    assert np.all(np.abs(out - angle) < math.pi / 2)
    for a, r, s in zip(angle, ratio, slope, strict=True):
        assert derivative(lambda x: universal_joint(x, bend)[0], a, 1e-3) == pytest.approx(r, abs=1e-10)
        assert derivative(lambda x: universal_joint(x, bend)[1], a, 1e-3) == pytest.approx(s, abs=2e-8)
    assert universal_joint(0.0, bend)[1] == pytest.approx(math.cos(bend))
    assert universal_joint(math.pi / 2, bend)[1] == pytest.approx(1 / math.cos(bend))


@pytest.mark.parametrize("branch", [1, -1])
def test_the_rod_of_a_spatial_slider_crank_keeps_its_length(branch):
    crank = SpatialSliderCrank((0, 0.1, 0.12), (1, 0.2, 0), (0, 0, 1), 0.08, 0.3, (0.02, 0, 0), (1, 0.1, 0), branch)
    for angle in np.linspace(-4, 4, 9):
        pin, s = crank.pin(angle)[0], crank.slider(angle)
        assert np.linalg.norm(pin - crank.slider_point(angle)) == pytest.approx(0.3, rel=1e-14)
        for order in (0, 1):
            slope = derivative(lambda x, order=order: crank.slider(x)[order], angle, 1e-2)
            assert slope == pytest.approx(s[order + 1], abs=1e-11)
            assert np.allclose(
                derivative(lambda x, order=order: crank.pin(x)[order], angle, 1e-2), crank.pin(angle)[order + 1]
            )
    assert np.linalg.norm(crank.pin(0.7)[0] - crank.centre) == pytest.approx(0.08)
    far = SpatialSliderCrank((0, 0, 2), (1, 0, 0), (0, 0, 1), 0.1, 0.3, (0, 0, 0), (1, 0, 0))
    assert np.isnan(far.slider(0.0)[0])


WATT = WattGovernor(ball=1.3, arm=0.4, offset=0.05, sleeve=0.9, link=0.25, shaft=0.02)


def lagrangian(governor, theta, theta_rate, speed):
    s, c = math.sin(theta), math.cos(theta)
    balls = governor.ball * ((governor.arm * theta_rate) ** 2 + ((governor.offset + governor.arm * s) * speed) ** 2)
    sleeve = 0.5 * governor.sleeve * (2 * governor.link * s * theta_rate) ** 2
    height = -2 * governor.ball * governor.arm * c - governor.sleeve * 2 * governor.link * c
    return balls + sleeve + 0.5 * governor.shaft * speed**2 - governor.gravity * height


@pytest.mark.parametrize("speed", [3.0, 7.0, 20.0])
def test_the_equation_of_watts_governor_is_lagranges(speed):
    theta, theta_rate = 0.8, 1.7
    up = WATT.acceleration(theta, theta_rate, speed)

    def momentum(a, v):
        return derivative(lambda x: lagrangian(WATT, a, x, speed), v, 1e-2)

    along = derivative(lambda a: momentum(a, theta_rate), theta, 1e-2) * theta_rate
    along += derivative(lambda v: momentum(theta, v), theta_rate, 1e-2) * up
    assert along == pytest.approx(derivative(lambda a: lagrangian(WATT, a, theta_rate, speed), theta, 1e-2), rel=1e-9)
    rest = WATT.equilibrium(speed)
    assert WATT.acceleration(rest, 0.0, speed) == pytest.approx(0, abs=1e-11)
    assert WATT.speed(rest) == pytest.approx(speed, rel=1e-12)


@pytest.mark.parametrize("free_shaft", [False, True])
def test_watts_governor_swings_with_its_frequency(free_shaft):
    theta = 0.9
    speed, frequency = WATT.speed(theta), WATT.frequency(theta, free_shaft)

    def moment(a):
        return WATT.shaft + 2 * WATT.ball * (WATT.offset + WATT.arm * math.sin(a)) ** 2

    def rates(_, y):
        now = speed * moment(theta) / moment(y[0]) if free_shaft else speed
        return [y[1], WATT.acceleration(y[0], y[1], now)]

    t = np.linspace(0, 2 * math.pi / frequency, 9)
    swing = integrate(rates, [theta, 1e-5 * frequency], t)[:, 0] - theta
    assert np.allclose(swing, 1e-5 * np.sin(frequency * t), atol=1e-9)


def test_a_governor_without_offset_lifts_off_at_its_speed():
    plain = WattGovernor(ball=2.0, arm=0.3)
    lift_off = plain.lift_off_speed()
    assert lift_off == pytest.approx(math.sqrt(9.81 / 0.3))
    assert plain.equilibrium(0.99 * lift_off) == 0
    assert math.cos(plain.equilibrium(1.2 * lift_off)) == pytest.approx(1 / 1.44)  # cos = g / (l O^2)
    assert plain.frequency(0.0, speed=0.0) == pytest.approx(lift_off)
    # Conical pendulum driven at constant speed: O sin(theta).
    assert plain.frequency(0.7) == pytest.approx(plain.speed(0.7) * math.sin(0.7))
    # With the shaft free and without inertia: the spherical pendulum's O sqrt(1 + 3 cos^2).
    assert plain.frequency(0.7, free_shaft=True) == pytest.approx(
        plain.speed(0.7) * math.sqrt(1 + 3 * math.cos(0.7) ** 2)
    )


def test_the_stiff_governor_meets_the_published_values():
    governor = StiffGovernor()
    found = governor.motion(sorted(STIFF_GOVERNOR))
    assert np.allclose(found, [STIFF_GOVERNOR[t] for t in sorted(STIFF_GOVERNOR)], rtol=0, atol=1e-10)
    for beta in (0.1, 0.5, 1.0):
        slope = derivative(lambda b: governor.moment(b)[0], beta, 1e-2)
        assert slope == pytest.approx(governor.moment(beta)[1], rel=1e-11)


def test_the_loop_of_bricards_mechanism_is_closed():
    for a in np.linspace(-0.5, math.pi + 0.5, 23):
        joints, centres, velocities, accelerations, omegas, spins_up, turns = chain(a)
        assert np.allclose(joints[-1], [0, 0, 1], atol=1e-14)
        assert np.allclose(turns[-1] @ about_x(partner(a)[0]), np.eye(3), atol=1e-14)  # the sixth joint, to the ground
        moving = [derivative(lambda x, k=k: chain(x)[k], a, 1e-3) for k in (1, 2, 4)]
        assert np.allclose(moving, [velocities, accelerations, spins_up], atol=2e-9)
        turning = derivative(lambda x: chain(x)[6], a, 1e-3)
        for k in range(5):
            assert np.allclose(turning[k] @ turns[k].T @ centres[k], np.cross(omegas[k], centres[k]), atol=1e-9)


@pytest.mark.sample(0)
def test_bricards_mechanism_meets_the_published_values_and_keeps_its_energy():
    mechanism = Bricard()
    times = np.array([0.0, 0.5, 2.0, 10.0])
    found = mechanism.motion(times)
    a, b, a_rate, b_rate = found[1]
    expected = BRICARD[0.5]
    assert np.allclose([a, b], expected["angles"], atol=1e-12)
    assert np.allclose([a_rate, b_rate], expected["rates"], atol=1e-12)
    position, velocity = joint_3(a, a_rate)
    assert np.allclose(position, expected["joint_3"], atol=1e-12)
    assert np.allclose(velocity, expected["joint_3_velocity"], atol=1e-12)
    closed = [math.cos(a) * (1 + math.sin(b)), -math.cos(b), -math.sin(a) * (1 + math.sin(b))]
    assert np.allclose(position, closed, atol=1e-15)
    energies = [0.5 * m * row[2] ** 2 + v for row in found for m, _, v, _ in [mechanism.coefficients(row[0])]]
    assert np.allclose(energies, energies[0], atol=1e-11)
    _, n, _, v_slope = mechanism.coefficients(0.8)
    assert derivative(lambda x: mechanism.coefficients(x)[0], 0.8, 1e-3) / 2 == pytest.approx(n, rel=1e-9)
    assert derivative(lambda x: mechanism.coefficients(x)[2], 0.8, 1e-3) == pytest.approx(v_slope, rel=1e-9)
    period = mechanism.period()
    assert period == pytest.approx(4.99, abs=0.01)
    there = mechanism.motion([period / 2, period])
    assert np.allclose(there[:, 0], [math.pi, 0], atol=1e-7)
    assert np.allclose(there[:, 2], 0, atol=1e-8)


@pytest.mark.parametrize("name", FOUCAULT)
def test_foucaults_pendulum_meets_the_published_values(name):
    case = FOUCAULT[name]
    rate = case["rotation"] * math.sin(math.radians(case["latitude"]))
    swing = SmallFoucault(math.sqrt(case["gravity"] / case["length"]), rate, (case["x"], 0.0))
    assert swing.turning_rate == pytest.approx(case["turning_rate"], rel=1e-14)
    assert swing.frequency == pytest.approx(case["frequency"], rel=1e-15)
    for t, position in case["values"].items():
        assert np.allclose(swing.position(t), position, rtol=0, atol=1e-13 * case["x"])


def test_foucaults_small_oscillation_fulfils_its_equation():
    w0, rate, latitude = 3.1, 0.05, math.radians(50)
    swing = SmallFoucault(w0, rate * math.sin(latitude), (0.1, -0.2), (0.3, 0.4))
    assert np.allclose(swing.position(0.0), [0.1, -0.2])
    assert np.allclose(swing.velocity(0.0), [0.3, 0.4])
    for t in (0.0, 3.0, 40.0):
        v = swing.velocity(t)
        assert np.allclose(derivative(swing.position, t, 0.02), v, atol=1e-11)
        force = -(w0**2) * swing.position(t) + coriolis_acceleration(rate, latitude, [*v, 0.0])[:2]
        assert np.allclose(derivative(swing.velocity, t, 0.02), force, atol=1e-11)


def test_the_pendulum_at_the_pole_fulfils_its_equation():
    length, rate = 1.5, 0.4
    pendulum = PolarFoucault(length, 9.81, rate, (0.9, 0, -1.2), (0, 0.1, 0))
    assert np.allclose(pendulum.position(0.0), [0.9, 0, -1.2])
    assert np.allclose(pendulum.velocity(0.0), [0, 0.1, 0])
    for t in (0.0, 2.0, 30.0):
        r, v = pendulum.position(t), pendulum.velocity(t)
        assert np.allclose(derivative(pendulum.position, t, 0.01), v, atol=1e-10)
        forces = np.array([0, 0, -9.81]) + coriolis_acceleration(rate, math.pi / 2, v)
        forces = forces + rate**2 * np.array([r[0], r[1], 0])
        rest = derivative(pendulum.velocity, t, 0.01) - forces  # what the rod does: along it
        assert np.allclose(np.cross(rest, r), 0, atol=1e-9)


def test_small_and_large_foucault_pendulums_meet_where_both_hold():
    rate, x = 0.05, 1e-5
    small = SmallFoucault(math.sqrt(9.81), rate, (x, 0.0))
    large = PolarFoucault(1.0, 9.81, rate, (x, 0, -math.sqrt(1 - x * x)), (0, 0, 0))
    t = np.linspace(0, 20, 11)
    # The large one has the centrifugal force O^2 x in addition, which takes the frequency back to w0.
    bare = SmallFoucault(math.sqrt(9.81 - rate**2), rate, (x, 0.0))
    assert np.allclose(large.position(t)[:, :2], bare.position(t), atol=1e-13)
    assert not np.allclose(large.position(t)[:, :2], small.position(t), atol=1e-13)


def test_rotations():
    for turn, axis in ((about_x, 0), (about_y, 1), (about_z, 2)):
        ahead = np.cross(np.eye(3)[axis], np.eye(3)[axis - 1])
        assert np.allclose(turn(0.3) @ np.eye(3)[axis - 1], math.cos(0.3) * np.eye(3)[axis - 1] + math.sin(0.3) * ahead)
    r = euler_zyz(0.4, 1.1, -2.0)
    assert np.allclose(r[:, 2], [math.sin(1.1) * math.cos(0.4), math.sin(1.1) * math.sin(0.4), math.cos(1.1)])
    for angle in (1e-9, 0.3, 3.1):
        turned = r @ about(np.array([2.0, -1, 2]) / 3, angle)
        assert angle_between(r, turned) == pytest.approx(angle, rel=1e-6)
        assert np.allclose(from_quaternion(quaternion(turned)), turned, atol=1e-15)
    assert quaternion(about_x(math.pi)) == pytest.approx([0, 1, 0, 0], abs=1e-15)
