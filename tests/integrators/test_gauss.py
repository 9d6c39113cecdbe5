"""The methods of Gauss: coefficients, and steps in machine code."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.integrators.symplectic.gauss import ORDERS, tableau


@pytest.mark.parametrize("order", ORDERS)
def test_coefficients_fulfil_the_order_conditions(order):
    """B(2s), C(s) and D(s) of Butcher, which give the order 2s (Hairer, Lubich and Wanner, theorem II.1.5)."""
    found, s = tableau(order), order // 2
    b, c = np.array(found.weights), np.array(found.nodes)
    a = np.array(found.shares) * b
    for k in range(1, order + 1):
        assert np.dot(b, c ** (k - 1)) == pytest.approx(1.0 / k, abs=1e-15)
    for k in range(1, s + 1):
        np.testing.assert_allclose(a @ c ** (k - 1), c**k / k, atol=1e-15)
        np.testing.assert_allclose((b * c ** (k - 1)) @ a, b * (1.0 - c**k) / k, atol=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_the_condition_of_symplecticity_holds_exactly(order):
    shares = np.array(tableau(order).shares)
    assert np.all(shares + shares.T == 1.0)


@pytest.mark.parametrize("order", ORDERS)
def test_stages_go_on_as_their_polynomial(order):
    """The L of one step give those of the next, where f is a polynomial of degree s - 1 of time."""
    found, s = tableau(order), order // 2
    b, c = np.array(found.weights), np.array(found.nodes)
    for k in range(s):
        np.testing.assert_allclose(np.array(found.ahead) @ (b * c**k), b * (1.0 + c) ** k, rtol=1e-11)
