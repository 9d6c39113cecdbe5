"""Hand-derived twins: textbook equations, written out and solved by an explicit method of order eight."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from atwood.arrays import FloatArray
from atwood.pipeline import simulate
from atwood_library.scenes import DoublePendulum, PendulumOnCart

G = 9.81


def double_pendulum(t: float, y: FloatArray, m1: float, m2: float, l1: float, l2: float) -> list[float]:
    """Landau and Lifshitz, Mechanics, section 5, problem 1, solved for the accelerations."""
    th1, th2, w1, w2 = y
    d = th1 - th2
    c, s = np.cos(d), np.sin(d)
    # (m1+m2) l1 a1 + m2 l2 a2 c + m2 l2 w2^2 s + (m1+m2) g sin th1 = 0;  l2 a2 + l1 a1 c - l1 w1^2 s + g sin th2 = 0
    whole = m1 + m2 * s * s
    f1 = -m2 * l2 * w2 * w2 * s - (m1 + m2) * G * np.sin(th1)
    f2 = l1 * w1 * w1 * s - G * np.sin(th2)
    a1 = (f1 - m2 * c * f2) / (l1 * whole)
    a2 = ((m1 + m2) * f2 - c * f1) / (l2 * whole)
    return [w1, w2, a1, a2]


def pendulum_on_cart(t: float, y: FloatArray, M: float, m: float, l: float) -> list[float]:
    """Landau and Lifshitz, Mechanics, section 5, problem 2, solved for the accelerations."""
    _, th, v, w = y
    c, s = np.cos(th), np.sin(th)
    # (M+m) x'' + m l th'' c - m l w^2 s = 0;  x'' c + l th'' + g s = 0
    a = (m * l * w * w * s + m * G * s * c) / (M + m * s * s)
    return [v, w, a, -(a * c + G * s) / l]


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_double_pendulum(form: str) -> None:
    m1, m2, l1, l2 = 1.3, 0.7, 0.8, 1.1
    scene = DoublePendulum(mass1=m1, mass2=m2, length1=l1, length2=l2)
    scene.start.update(
        {"rod1.angle": 1.2, "rod2.angle": -0.4, "rod1.angular_velocity": 0.5, "rod2.angular_velocity": 1.5}
    )
    result = simulate(scene, form=form, rtol=1e-12, t_end=3.0, outputs=31)
    twin = solve_ivp(
        double_pendulum,
        (0.0, 3.0),
        [1.2, -0.4, 0.5, 1.5],
        "DOP853",
        result.time,
        args=(m1, m2, l1, l2),
        rtol=1e-13,
        atol=1e-13,
    )
    paths = ["rod1.angle", "rod2.angle", "rod1.angular_velocity", "rod2.angular_velocity"]
    for path, expected in zip(paths, twin.y, strict=True):
        assert np.max(np.abs(result.array(path) - expected)) < 3e-8
    # tension of the lower rod from Newton's law along it: T2 = m2 (g cos th2 + l2 w2^2 + l1 (a1 sin d + w1^2 cos d))
    th1, th2, w1, w2 = twin.y
    a1 = np.array([double_pendulum(0.0, y, m1, m2, l1, l2)[2] for y in twin.y.T])
    d = th1 - th2
    tension2 = m2 * (G * np.cos(th2) + l2 * w2**2 + l1 * (w1**2 * np.cos(d) + a1 * np.sin(d)))
    tension1 = m1 * (G * np.cos(th1) + l1 * w1**2) + tension2 * np.cos(d)
    assert np.max(np.abs(result.array("rod2.tension") - tension2)) < 1e-6
    assert np.max(np.abs(result.array("rod1.tension") - tension1)) < 1e-6


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_pendulum_on_cart(form: str) -> None:
    M, m, l = 2.5, 0.6, 0.7
    scene = PendulumOnCart(cart_mass=M, bob_mass=m, length=l)
    scene.start.update({"rod.angle": 2.0, "rail.speed": 0.3, "rod.angular_velocity": -1.0})
    result = simulate(scene, form=form, rtol=1e-12, t_end=4.0, outputs=31)
    twin = solve_ivp(
        pendulum_on_cart,
        (0.0, 4.0),
        [0.0, 2.0, 0.3, -1.0],
        "DOP853",
        result.time,
        args=(M, m, l),
        rtol=1e-13,
        atol=1e-13,
    )
    paths = ["rail.displacement", "rod.angle", "rail.speed", "rod.angular_velocity"]
    for path, expected in zip(paths, twin.y, strict=True):
        assert np.max(np.abs(result.array(path) - expected)) < 3e-8
    # the rail carries both weights and the vertical inertia of the bob
    _, th, _, w = twin.y
    alpha = np.array([pendulum_on_cart(0.0, y, M, m, l)[3] for y in twin.y.T])
    up = (M + m) * G + m * l * (alpha * np.sin(th) + w**2 * np.cos(th))
    assert np.max(np.abs(result.array("rail.side_force") - up)) < 1e-6
