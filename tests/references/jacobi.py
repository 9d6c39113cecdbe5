"""Jacobi's elliptic functions and the elliptic integral of the third kind, also next to the separatrix.

All take the complementary parameter mc = 1 - m = k'^2, so that nothing is lost where m is close to 1; mc = 0 gives the
hyperbolic limit. (SciPy's `ellipj` takes m, and for mc = 5e-11 is wrong by 2e-10.)
"""

import math

import numpy as np
from scipy.special import ellipkm1, elliprc, elliprf, elliprj


def quarter_period(mc):
    """K, the quarter period; infinite on the separatrix."""
    return math.inf if mc == 0 else float(ellipkm1(mc))


def jacobi(u, mc):
    """(sn, cn, dn) of u, all relatively exact next to K: R. Bulirsch, Numer. Math. 7 (1965) 78, procedure sncndn."""
    u = np.asarray(u, dtype=float)
    if mc == 0:
        return np.tanh(u), 1 / np.cosh(u), 1 / np.cosh(u)
    u = u - 4 * quarter_period(mc) * np.round(u / (4 * quarter_period(mc)))
    means, roots = [], []
    a, b = 1.0, mc
    while True:
        means.append(a)
        b = math.sqrt(b)
        roots.append(b)
        c = (a + b) / 2
        if abs(a - b) <= 1e-9 * a:
            break
        b *= a
        a = c
    angle = c * u
    sine = np.sin(angle)
    zero = np.abs(angle) < 1e-150
    cot = np.cos(angle) / np.where(zero, 1.0, sine)
    c, dn, a = c * cot, np.ones_like(u), cot
    for mean, root in zip(reversed(means), reversed(roots), strict=True):
        a = a * c
        c = c * dn
        dn = (root + a) / (mean + a)
        a = c / mean
    sn = np.copysign(1 / np.hypot(1.0, c), sine)
    return np.where(zero, u, sn), np.where(zero, 1.0, c * sn), np.where(zero, 1.0, dn)


def first_kind(sn, cn, mc):
    """F: the u between -K and K whose sn and (not negative) cn are given; DLMF 19.25.5."""
    if mc == 0:
        return math.asinh(sn / cn)
    return float(sn * elliprf(cn**2, cn**2 + mc * sn**2, 1.0))


def third_kind(n, u, mc, complement=None):
    """The integral of dv / (1 - n sn^2 v) from 0 to u, for n <= 1; DLMF 19.25.14 and 19.7.9.

    `complement` is 1 - n, for n so close to 1 that it would be lost.
    """
    rest = 1 - n if complement is None else complement
    u = np.asarray(u, dtype=float)
    if mc == 0:
        root = math.sqrt(abs(n))
        bend = root * np.arctan(root * np.tanh(u)) if n < 0 else -root * np.arctanh(root * np.tanh(u))
        return (u + bend) / rest
    period = 2 * quarter_period(mc)
    turns = np.round(u / period)
    u = u - turns * period
    whole = 2 * _third_kind(n, rest, mc, period / 2, 1.0, 0.0, math.sqrt(mc))
    return turns * whole + _third_kind(n, rest, mc, u, *jacobi(u, mc))


def _third_kind(n, rest, mc, u, sn, cn, dn):
    """The same between -K and K."""
    if n >= -0.5:
        return u + n / 3 * sn**3 * elliprj(cn**2, dn**2, 1.0, cn**2 + rest * sn**2)
    # A large negative n is exchanged for one between m and 1, so that no terms of opposite sign meet: DLMF 19.7.9.
    other_rest = mc / rest
    other = _third_kind(1 - other_rest, other_rest, mc, u, sn, cn, dn)
    bend = sn * cn * elliprc(dn**2, (cn**2 + rest * sn**2) * (cn**2 + other_rest * sn**2))
    return ((1 - mc) * u + mc * (-n / rest) * other - n * (1 - other_rest) * bend) / (rest - mc)


def amplitude(u, mc):
    """am u, the angle whose sine is sn u, counted on through the turns."""
    u = np.asarray(u, dtype=float)
    sn, cn, _ = jacobi(u, mc)
    turns = 0.0 if mc == 0 else np.round(u / (4 * quarter_period(mc)))
    return np.arctan2(sn, cn) + 2 * np.pi * turns
