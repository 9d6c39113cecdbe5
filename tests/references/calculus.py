"""Derivatives and integrals for checking that a solution fulfils its equations."""

import numpy as np
from scipy.integrate import solve_ivp

WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Central difference of order 8."""


def derivative(f, t, step):
    """Time derivative of a function of time with values of any shape, at a scalar time."""
    return sum(w * (f(t + k * step) - f(t - k * step)) for k, w in enumerate(WEIGHTS, start=1)) / step


def integrate(rates, start, times):
    """Solution at the times (from 0 on), integrated to about 1e-13: shape (n, states)."""
    done = solve_ivp(rates, (0, times[-1]), start, method="DOP853", t_eval=times, rtol=3e-14, atol=1e-15)
    assert done.success
    return done.y.T
