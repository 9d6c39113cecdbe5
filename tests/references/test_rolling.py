"""Rolling bodies: steady motions, thresholds and any motion against the laws of Newton and Euler."""

import math

import numpy as np
import pytest

from .calculus import derivative
from .rolling import RollingDisc, TurntableBall, hoop, uniform_disc
from .rotations import cross_matrix

ODD = RollingDisc(0.4, 1.7, 0.05, 0.13, 9.81)
STARTS = [
    (ODD, (0.3, 1.2, -0.4), (0.9, 0.3, -8.0)),
    (uniform_disc(0.5, 2.0), (-1.0, 2.1, 0.4), (3.0, -1.0, 2.0)),
    (hoop(1.0, 1.0), (0.0, 0.5, 0.0), (-4.0, 0.0, 1.0)),
]


@pytest.mark.parametrize(("disc", "angles", "rates"), STARTS)
def test_the_motion_fulfils_the_laws_of_newton_and_euler(disc, angles, rates):
    """No slip at the contact; and the force that moves the centre is the one whose moment turns the disc."""
    step, middle = 2e-3, 12
    t = step * np.arange(2 * middle + 1)
    motion = disc.motion(t, angles, rates, centre=(0.7, -0.2))

    def at(values):
        return lambda time: values[round(time / step)]

    here = middle * step
    r, w = motion.orientation[middle], motion.omega[middle]
    velocity = derivative(at(motion.centre), here, step)
    arm = motion.contact[middle] - motion.centre[middle]
    assert np.linalg.norm(arm) == pytest.approx(disc.radius)
    assert motion.contact[middle][2] == pytest.approx(0, abs=1e-15)
    assert abs(arm @ r[:, 2]) < 1e-15
    assert np.allclose(velocity + np.cross(r @ w, arm), 0, atol=1e-9)
    assert np.allclose(derivative(at(motion.orientation), here, step), r @ cross_matrix(w), atol=1e-9)

    omega_world = np.einsum("nij,nj->ni", motion.orientation, motion.omega)
    no_slip = -np.cross(omega_world, motion.contact - motion.centre)
    force = disc.mass * (derivative(at(no_slip), here, step) + np.array([0, 0, disc.gravity]))
    moments = np.array([disc.transverse, disc.transverse, disc.axial])
    momentum = np.einsum("nij,nj->ni", motion.orientation, moments * motion.omega)
    assert np.allclose(derivative(at(momentum), here, step), np.cross(arm, force), atol=2e-9)
    assert force[2] > 0


@pytest.mark.parametrize(("disc", "angles", "rates"), STARTS)
def test_energy_is_kept_and_the_start_is_met(disc, angles, rates):
    motion = disc.motion(np.linspace(0, 3, 31), angles, rates, centre=(0.7, -0.2))
    assert np.allclose(motion.energy, motion.energy[0], rtol=1e-12)
    assert np.allclose(motion.centre[0], [0.7, -0.2, disc.radius * math.sin(angles[1])])
    assert np.allclose(motion.states[[4, 0, 5], 0], angles)


@pytest.mark.parametrize("precession", [0.4, -1.3, 7.0])
def test_a_leaning_wheel_rolls_in_a_circle(precession):
    theta = 1.2
    spin = ODD.steady_spin(theta, precession)
    turn = 2 * math.pi / abs(precession)
    motion = ODD.motion(
        np.linspace(0, turn, 9), (0.2, theta, 0.0), (precession, 0.0, spin - precession * math.cos(theta))
    )
    stable = ODD.lean_frequency_squared(theta, precession, spin) > 0
    assert np.allclose(motion.states[0], theta, atol=1e-12 if stable else 1e-6)
    assert np.allclose(motion.centre[-1], motion.centre[0], atol=1e-11 if stable else 1e-5)
    for path, radius in zip((motion.centre, motion.contact), ODD.circle(theta, precession), strict=True):
        middle = (path[0] + path[4]) / 2
        assert np.allclose(np.linalg.norm(path - middle, axis=1), radius, rtol=1e-10 if stable else 1e-5)
    assert any(rate == pytest.approx(precession) for rate in ODD.steady_precession(theta, spin))


def test_straight_and_upright_rolling():
    assert ODD.steady_precession(math.pi / 2, 5.0)[0] == pytest.approx(0, abs=1e-15)
    motion = ODD.motion(np.linspace(0, 2, 5), (math.pi / 2, math.pi / 2, 0.0), (0.0, 0.0, 5.0))
    assert np.allclose(motion.centre[:, 0], 5.0 * ODD.radius * motion.time)  # phi = pi/2: towards +x
    assert np.allclose(motion.centre[:, 1], 0, atol=1e-14)


@pytest.mark.parametrize(
    ("disc", "squares"),
    [
        (uniform_disc(0.5, 2.0), (9.81 / (3 * 0.5), 4 * 9.81 / (5 * 0.5))),
        (hoop(0.5, 2.0), (9.81 / (4 * 0.5), 2 * 9.81 / (3 * 0.5))),
    ],
)
def test_thresholds_are_the_textbook_ones(disc, squares):
    assert disc.upright_rolling_threshold() ** 2 == pytest.approx(squares[0])
    assert disc.upright_spinning_threshold() ** 2 == pytest.approx(squares[1])


@pytest.mark.parametrize("motion_kind", ["rolling", "spinning"])
def test_thresholds_divide_what_stays_up_from_what_falls(motion_kind):
    for factor, stays in ((1.05, True), (0.95, False)):
        rate = factor * ODD.upright_spinning_threshold() if motion_kind == "spinning" else 0.0
        speed = factor * ODD.upright_rolling_threshold() if motion_kind == "rolling" else 0.0
        assert (ODD.lean_frequency_squared(math.pi / 2, rate, speed) > 0) == stays
        motion = ODD.motion(np.linspace(0, 12, 1201), (0.0, math.pi / 2 + 1e-5, 0.0), (rate, 0.0, speed))
        assert (np.max(np.abs(motion.states[0] - math.pi / 2)) < 5e-3) == stays


@pytest.mark.parametrize(("theta", "precession"), [(1.2, 7.0), (0.6, 3.0), (math.pi / 2 - 0.1, 0.3)])
def test_small_oscillations_have_the_frequency_of_the_formula(theta, precession):
    spin = ODD.steady_spin(theta, precession)
    square = ODD.lean_frequency_squared(theta, precession, spin)
    assert square > 0
    frequency, amplitude = math.sqrt(square), 1e-5
    t = np.linspace(0, 2 * math.pi / frequency, 17)
    # Start on the steady motion with a push in theta only: phi' and w_3 follow theta.
    push = (precession, amplitude * frequency, spin - precession * math.cos(theta))
    lean = ODD.motion(t, (0.0, theta, 0.0), push).states[0] - theta
    assert np.allclose(lean, amplitude * np.sin(frequency * t), atol=1e-4 * amplitude)


def test_a_ball_on_a_turntable_fulfils_its_laws():
    """v - r w x e_z = O e_z x p at the contact; I w' = -r e_z x F with F = m v'."""
    radius, mass, rate = 0.1, 0.3, 2.1
    moment = 0.4 * mass * radius**2
    ball = TurntableBall(radius, mass, moment, rate, (0.5, -0.2), (0.3, 0.1), spin=1.5)
    assert ball.circling == pytest.approx(2 / 7 * rate)
    up = np.array([0, 0, 1.0])
    for t in (0.0, 1.0, 7.7):
        p, v = np.append(ball.position(t), 0), np.append(ball.velocity(t), 0)
        assert np.allclose(derivative(ball.position, t, 0.01), v[:2], atol=1e-12)
        assert np.allclose(v + np.cross(ball.omega_world(t), -radius * up), rate * np.cross(up, p), atol=1e-14)
        force = mass * np.append(derivative(ball.velocity, t, 0.01), 0)
        turning = moment * derivative(ball.omega_world, t, 0.01)
        assert np.allclose(turning, np.cross(-radius * up, force), atol=1e-12)
    assert np.allclose(ball.position(0.0), [0.5, -0.2])
    assert np.allclose(ball.velocity(0.0), [0.3, 0.1])


def test_the_energy_formula_is_that_of_a_body():
    disc = ODD
    theta, theta_rate, precession, spin = 1.1, 0.4, -2.0, 3.0
    w = np.array([-precession * math.sin(theta), theta_rate, spin])
    speed = np.array([0, -disc.radius * spin, disc.radius * theta_rate])
    moments = np.array([disc.transverse, disc.transverse, disc.axial])
    expected = 0.5 * disc.mass * speed @ speed + 0.5 * w @ (moments * w)
    expected += disc.mass * disc.gravity * disc.radius * math.sin(theta)
    assert disc.energy(theta, theta_rate, precession, spin) == pytest.approx(expected)
