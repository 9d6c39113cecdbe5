"""Drives and controllers: the cart-pole, the quarter car and Furuta's pendulum, against equations by hand."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from atwood import assemble, simulate
from atwood_library.scenes import CartPole, FurutaPendulum, QuarterCar

FORMS = ["reduced", "dae"]


def cart_pole_by_hand(scene: CartPole, periods: int) -> np.ndarray:
    """Return place, lean and their rates at sample times, from Newton's equations with the force held."""
    big, m, l, g, h = scene.cart_mass, scene.bob_mass, scene.length, scene.gravity, scene.period
    gains = scene.gains()

    def rates(_: float, z: np.ndarray, force: float) -> list[float]:
        s, c = np.sin(z[1]), np.cos(z[1])
        # (M + m) x'' - m l c phi'' = F - m l s phi'^2,  l phi'' - c x'' = g s
        x = (force - m * l * s * z[3] ** 2 + m * g * s * c) / (big + m * s * s)
        return [z[2], z[3], x, (g * s + c * x) / l]

    states = [np.array([0.0, scene.lean, 0.0, 0.0])]
    for _ in range(periods):
        force = float(-gains @ states[-1])
        run = solve_ivp(rates, (0.0, h), states[-1], args=(force,), method="DOP853", rtol=1e-12, atol=1e-13)
        states.append(run.y[:, -1])
    return np.array(states)


@pytest.mark.parametrize("form", FORMS)
def test_a_sampled_regulator_keeps_a_pole_upright(form: str) -> None:
    scene = CartPole()
    expected = cart_pole_by_hand(scene, 50)
    result = simulate(scene, t_end=1.0, form=form, rtol=1e-10, outputs=51)
    assert_allclose(result["rail.displacement"], expected[:, 0], atol=2e-7)
    assert_allclose(result["hinge.angle"] - 0.5 * np.pi, expected[:, 1], atol=2e-7)
    assert len(assemble(scene, form="reduced").reduced.coordinates) == 2


def test_it_comes_to_rest_and_its_gains_are_those_of_the_sampled_model() -> None:
    scene = CartPole()
    result = simulate(scene, samples=1, outputs=7)
    assert abs(result["rail.displacement"][-1]) < 1e-2
    assert abs(result["hinge.angle"][-1] - 0.5 * np.pi) < 1e-2
    a, b = scene.linear_model()
    closed = a - b @ scene.gains()[None, :]  # for a short period nearly that of continuous control
    assert np.all(np.linalg.eigvals(closed).real < 0.0)


def test_300_sample_periods_make_no_program() -> None:
    assembly = assemble(CartPole())
    simulate(assembly, t_end=0.5, samples=1)
    made = len(assembly.shared._made)
    result = simulate(assembly, t_end=6.0, samples=1, outputs=2)
    assert len(assembly.shared._made) == made
    assert result.statistics.steps <= 2 * 300  # a period is one step


@pytest.mark.parametrize("form", FORMS)
def test_a_quarter_car_moves_as_its_road(form: str) -> None:
    scene = QuarterCar()
    result = simulate(scene, t_end=2.0, form=form, rtol=1e-10)
    for path, expected in scene.steady_motion(result.time).items():
        assert_allclose(result[path], expected, rtol=0, atol=2e-7 * max(1.0, float(np.max(np.abs(expected)))))
    assert len(assemble(scene).reduced.coordinates) == 2


def furuta_by_hand(scene: FurutaPendulum) -> Any:
    """Return the rates of Furuta's pendulum (Lagrange's equations; theta from hanging, phi of the arm)."""
    r, m, length, g = scene.arm_length, scene.pendulum_mass, scene.pendulum_length, scene.gravity
    l, j = 0.5 * length, m * length**2 / 3.0
    arm = scene.arm_mass * r * r / 3.0 + m * r * r

    def rates(_: float, z: np.ndarray) -> list[float]:
        _, theta, w, v = z
        s, c = np.sin(theta), np.cos(theta)
        mass = np.array([[arm + j * s * s, m * r * l * c], [m * r * l * c, j]])
        force = [-2.0 * j * s * c * w * v + m * r * l * s * v * v, j * s * c * w * w - m * g * l * s]
        return [w, v, *np.linalg.solve(mass, force)]

    return rates


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_furutas_pendulum_by_lagranges_equations(form: str) -> None:
    scene = FurutaPendulum()
    result = simulate(scene, t_end=2.0, form=form, rtol=1e-10)
    found = solve_ivp(
        furuta_by_hand(scene), (0.0, 2.0), [0.0, 1.0, 2.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13,
        t_eval=result.time,
    )  # fmt: skip
    assert_allclose(result["motor.angle"], found.y[0], atol=2e-6)
    assert_allclose(result["hinge.angle"], found.y[1], atol=2e-6)
    assert result.energy.max_drift < 1e-6
    assert len(assemble(scene).reduced.coordinates) == 2
