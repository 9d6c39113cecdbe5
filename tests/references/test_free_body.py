"""The exact motion of a free body: against its equations, 45-digit values, and elementary functions."""

import math
from itertools import permutations

import numpy as np
import pytest

from .calculus import derivative, integrate
from .free_body import FreeBody, PlateSeparatrix
from .rotations import about, angle_between, cross_matrix, from_quaternion
from .values import EULER_TOP

STARTS = [
    ((1, 2, 3), (1, 0, 1)),
    ((1, 2, 3), (2, 0.3, 0.1)),
    ((1, 2, 3), (0.2, 0.3, -1.5)),
    ((1, 2, 3), (1.73205, 0, 1)),
    ((1, 2, 3), (1e-6, 1, 0)),
    ((1, 2, 3), (1e-7, -1e-9, 1)),
    ((1, 2, 2.9999), (0.4, 1, -0.3)),
    ((1, 1, 1.7), (0.4, 1, -0.3)),
    ((1, 1.7, 1.7), (0.4, 1, -0.3)),
    ((3, 5, 8), (2, 0, 1)),
    ((3, 5, 8), (-2, 0, 1)),
    ((8, 5, 3), (-1, 0, -2)),
    ((1, 2, 3), (0, 2, 0)),
    ((2, 2, 2), (1, 2, 3)),
]
TURN = about(np.array([2.0, -1, 2]) / 3, 0.8)


@pytest.mark.parametrize(("moments", "omega"), STARTS)
def test_the_equations_of_motion_hold(moments, omega):
    body = FreeBody(moments, omega, TURN)
    i = np.array(moments, dtype=float)
    step = 0.02 / np.linalg.norm(omega)
    for t in (-3.7, 0.0, 1.0, 11.3, 48.9):
        w = body.omega(t)
        assert np.allclose(i * derivative(body.omega, t, step), np.cross(i * w, w), atol=2e-12 * np.max(i) * (w @ w))
        rates = derivative(body.orientation, t, step)
        assert np.allclose(rates, body.orientation(t) @ cross_matrix(w), atol=2e-11 * np.linalg.norm(w))


@pytest.mark.parametrize(("moments", "omega"), STARTS)
def test_start_and_constants(moments, omega):
    body = FreeBody(moments, omega, TURN)
    t = np.linspace(-30, 100, 57)
    w, r = body.omega(t), body.orientation(t)
    assert np.allclose(body.omega(0.0), omega, rtol=0, atol=4e-15)
    assert angle_between(body.orientation(0.0), TURN) < 4e-15
    assert w.shape == (57, 3)
    assert np.allclose(np.swapaxes(r, -1, -2) @ r, np.eye(3), atol=1e-14)
    assert np.allclose(0.5 * np.sum(body.moments * w**2, axis=-1), body.energy, rtol=1e-13)
    world = np.einsum("nij,nj->ni", r, body.moments * w)
    assert np.allclose(world, body.momentum_world, atol=1e-13 * body.momentum)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_axes_may_come_in_any_order(order):
    """A cyclic change of axes is a rotation; an odd one becomes one when one axis is turned round."""
    order = list(order)
    matrix = np.eye(3)[:, order]
    matrix[:, 2] *= np.linalg.det(matrix)
    moments, omega = np.array([1.0, 2, 3]), np.array([0.4, 1.1, -0.7])
    plain = FreeBody(moments, omega)
    turned = FreeBody(moments[order], matrix.T @ omega, matrix)
    t = np.linspace(0, 40, 17)
    assert np.allclose(turned.omega(t) @ matrix.T, plain.omega(t), atol=2e-14)
    assert np.max(angle_between(turned.orientation(t) @ matrix.T, plain.orientation(t))) < 1e-13


def test_against_an_integration():
    moments, omega = np.array([1.3, 0.9, 1.9]), np.array([0.8, -0.5, 1.4])

    def rates(_, y):
        w, q = y[:3], y[3:]
        return np.concatenate(
            [np.cross(moments * w, w) / moments, 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])]
        )

    times = np.linspace(0, 20, 9)
    found = integrate(rates, [*omega, 1, 0, 0, 0], times)
    body = FreeBody(moments, omega)
    assert np.allclose(body.omega(times), found[:, :3], atol=1e-12)
    assert np.max(angle_between(body.orientation(times), from_quaternion(found[:, 3:]))) < 1e-12


@pytest.mark.parametrize("name", ["generic", "near_separatrix", "tennis_racket_perturbed"])
def test_values_of_45_digits(name):
    case = EULER_TOP[name]
    body = FreeBody(case["moments"], case["omega"])
    for t, (omega, q) in case["values"].items():
        assert np.allclose(body.omega(t), omega, rtol=0, atol=4e-14)
        assert angle_between(body.orientation(t), from_quaternion(q)) < 6e-14


def test_values_on_the_separatrix():
    case = EULER_TOP["separatrix_sech"]
    plate = PlateSeparatrix(1, 2, math.sqrt(3))
    for t, (omega, q) in case["values"].items():
        assert np.allclose(plate.omega(t), omega, rtol=0, atol=4e-14)
        assert angle_between(plate.orientation(t), from_quaternion(q)) < 6e-14


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_the_separatrix_of_a_plate_fulfils_its_equations(speed):
    plate = PlateSeparatrix(3, 5, speed, TURN)
    i = plate.moments
    assert i[2] == i[0] + i[1]
    for t in (-4.0, -0.3, 0.0, 2.0, 9.0):
        w = plate.omega(t)
        assert np.allclose(i * derivative(plate.omega, t, 0.02), np.cross(i * w, w), atol=1e-11)
        rates = derivative(plate.orientation, t, 0.02)
        assert np.allclose(rates, plate.orientation(t) @ cross_matrix(w), atol=1e-11)


def test_doubles_that_lie_on_the_separatrix():
    body, plate = FreeBody((3, 5, 8), (2, 0, 1), TURN), PlateSeparatrix(3, 5, 2, TURN)
    t = np.linspace(-20, 100, 25)
    assert body.mc == 0
    assert body.period == math.inf
    assert np.allclose(body.omega(t), plate.omega(t), rtol=0, atol=1e-14)
    assert np.max(angle_between(body.orientation(t), plate.orientation(t))) < 1e-13
    on_the_way = FreeBody((3, 5, 8), [float(x) for x in PlateSeparatrix(3, 5, 2).omega(0.7)])
    assert 0 <= on_the_way.mc < 1e-14


def test_flips_about_the_middle_axis():
    body = FreeBody((1, 2, 3), (1e-3, 1, 2e-3))
    t = np.linspace(0, 60, 6001)
    middle = body.omega(t)[:, 1]
    crossings = t[:-1][np.diff(np.sign(middle)) != 0]
    assert np.allclose(np.diff(crossings), body.flip_time, atol=0.02)
    assert np.allclose(body.omega(t + body.flip_time)[:, 1], -middle, atol=1e-12)
    assert np.allclose(body.omega(t + body.period), body.omega(t), atol=1e-12)


def test_a_decimal_is_not_its_double():
    """Next to the separatrix the difference of 4e-17 between a decimal and its double shows after fifty seconds."""
    decimal, double = FreeBody((1, 2, 3), ("1.73205", "0", "1")), FreeBody((1, 2, 3), (1.73205, 0, 1))
    gap = np.max(np.abs(decimal.omega(50.0) - double.omega(50.0)))
    assert 1e-11 < gap < 1e-8
