import math

import mpmath as mp
import numpy as np
import pytest

from .jacobi import first_kind, jacobi, quarter_period, third_kind


@pytest.mark.parametrize("mc", [1.0, 0.5, 1e-3, 1e-8, 1e-14, 1e-30])
def test_the_functions_next_to_the_separatrix_too(mc):
    k = quarter_period(mc)
    u = np.append(np.random.default_rng(1).uniform(-3 * k, 3 * k, 12), [0.0, k * (1 - 1e-9)])
    with mp.workdps(50):
        m = 1 - mp.mpf(mc)
        expected = [[float(mp.ellipfun(name, float(x), m=m)) for x in u] for name in ("sn", "cn", "dn")]
        assert float(mp.ellipk(m)) == pytest.approx(k, rel=1e-15)
    found = jacobi(u, mc)
    rounding = 2e-15 + 14e-16 * k  # of u itself, up to 3 K
    assert np.allclose(found, expected, rtol=0, atol=rounding)
    # Next to K, dn is as small as the root of mc and must be right relative to itself.
    assert np.allclose(found[2], expected[2], rtol=2 * rounding, atol=0)


def test_the_separatrix_is_the_limit():
    u = np.linspace(-3, 3, 7)
    assert np.allclose(jacobi(u, 0.0), jacobi(u, 1e-25), atol=1e-15)
    assert quarter_period(0.0) == math.inf
    assert np.allclose(third_kind(-0.7, u, 0.0), third_kind(-0.7, u, 1e-25), atol=1e-14)
    assert np.allclose(third_kind(0.7, u, 0.0), third_kind(0.7, u, 1e-25), atol=1e-14)


@pytest.mark.parametrize("mc", [1.0, 0.5, 1e-3, 1e-6, 0.0])
def test_the_first_kind_is_the_inverse(mc):
    for u in (-1.2, 0.1, 1.4):
        sn, cn, _ = jacobi(u, mc)
        assert first_kind(float(sn), float(cn), mc) == pytest.approx(u, rel=1e-14)


@pytest.mark.sample(2)
@pytest.mark.parametrize("mc", [1.0, 0.5, 1e-3])
@pytest.mark.parametrize("n", [-5000.0, -50.0, -1.0, -0.1, 0.3, 0.99])
def test_the_third_kind_is_its_integral(mc, n):
    k = quarter_period(mc)
    for u in (0.3 * k, 0.99 * k, 2.5 * k, -3.7 * k):
        with mp.workdps(25):
            m = 1 - mp.mpf(mc)
            points = mp.linspace(0, u, 12)

            def density(v, m=m):
                return 1 / (1 - mp.mpf(n) * mp.ellipfun("sn", v, m=m) ** 2)

            expected = float(mp.quad(density, points, maxdegree=8))
        assert float(third_kind(n, u, mc)) == pytest.approx(expected, rel=1e-13)


def test_the_complement_keeps_what_n_next_to_1_would_lose():
    with mp.workdps(40):
        n = 1 - mp.mpf("1e-12")
        expected = float(mp.ellippi(n, mp.mpf("0.5")))
    whole = third_kind(1 - 1e-12, 2 * quarter_period(0.5), 0.5, complement=1e-12)
    assert float(whole) == pytest.approx(2 * expected, rel=1e-13)
