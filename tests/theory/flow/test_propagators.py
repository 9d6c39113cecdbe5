"""Steps of linear equations: their order, and steps that are as long as they may be."""

import numpy as np
import pytest
from scipy.linalg import expm

from atwood import SolveError
from atwood.theory.flow.tangent_flow import orthonormal_growth
from atwood.theory.flow.variational_equations import POINTS, find_steps, node_times, propagators


def turning(times: np.ndarray) -> np.ndarray:
    """The matrices of Mathieu's equation, x'' = -(2 + cos t) x, at times."""
    found = np.zeros((len(times), 2, 2))
    found[:, 0, 1], found[:, 1, 0] = 1.0, -(2.0 + np.cos(times))
    return found


def across(edges: np.ndarray) -> np.ndarray:
    pieces = np.stack([edges[:-1], edges[1:]], axis=1)
    matrices = turning(node_times(pieces).ravel()).reshape(-1, POINTS, 2, 2)
    found = np.eye(2)
    for step in propagators(matrices, np.diff(edges)):
        found = step @ found
    return found


def test_the_order_is_twelve() -> None:
    exact = across(np.linspace(0.0, 8.0, 129))
    errors = [np.max(np.abs(across(np.linspace(0.0, 8.0, count + 1)) - exact)) for count in (4, 8)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * POINTS, abs=1.0)


def test_constant_matrices_give_exponentials() -> None:
    random = np.random.default_rng(3)
    matrix = random.normal(size=(5, 5))
    found = propagators(np.broadcast_to(matrix, (1, POINTS, 5, 5)), np.array([0.3]))[0]
    assert found == pytest.approx(expm(0.3 * matrix), rel=1e-12, abs=1e-12)


def test_steps_are_halved_where_they_must_be() -> None:
    def pulse(times: np.ndarray) -> np.ndarray:
        return (1.0 / (1e-4 + (times - 0.3) ** 2))[:, None, None] * 0.01

    steps = find_steps(pulse, np.array([0.0, 1.0]), np.ones(1), 1e-12, "pulse")
    exact = np.exp(0.01 / 1e-2 * (np.arctan(0.7 / 1e-2) + np.arctan(0.3 / 1e-2)))
    assert np.prod(steps.propagators) == pytest.approx(exact, rel=1e-11)
    lengths = np.diff(steps.edges)
    assert lengths[np.searchsorted(steps.edges, 0.3) - 1] < 0.1 * np.max(lengths)


def test_what_moves_too_fast_is_said() -> None:
    random = np.random.default_rng(5)
    with pytest.raises(SolveError, match="noise: neighbouring motions move too fast"):
        find_steps(lambda t: 1e9 * random.normal(size=(len(t), 1, 1)), np.array([0.0, 1.0]), np.ones(1), 1e-12, "noise")


def test_growth_of_axes_does_not_overflow() -> None:
    steps = np.broadcast_to(np.diag([np.e**5, np.e**-5, 1.0]), (400, 3, 3))
    logs = orthonormal_growth(steps, np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0])
    assert np.sum(logs[1:], axis=0) / 399 == pytest.approx([5.0, 0.0, -5.0], abs=0.05)
    assert np.sum(logs) == pytest.approx(0.0, abs=1e-9)
