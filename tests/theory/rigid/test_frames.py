"""Foucault's pendulum: the expansion against its equation, to 50 digits, and against a run."""

import numpy as np
import pytest
import sympy

import atwood
from atwood import foucault_formulas
from atwood_library.scenes import FoucaultPendulum

OMEGA, RATE, BETA, W = sympy.symbols("Omega omega_0 beta w")


def test_the_expansion_of_small_swings() -> None:
    sheet = foucault_formulas()
    rest = {RATE: 1, BETA: sympy.Rational(4, 5)}
    off = []
    for size in (sympy.Rational(1, 1000), sympy.Rational(1, 10000)):
        both = (sheet["frequencies"].lhs - sheet["frequencies"].rhs).subs(rest).subs(OMEGA, size)
        low, high = sorted(one for one in map(sympy.re, sympy.Poly(both, W).nroots(n=60, maxsteps=400)) if one > 0)
        off.append(abs(sheet["small"].subs(rest).subs(OMEGA, size).evalf(60) + (high - low) / 2))
    assert off[0] < sympy.Float("1e-14")
    assert float(off[1] / off[0]) == pytest.approx(1e-5, rel=0.01)  # what is left is of fifth order


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_amplitude_along_a_run(form: str) -> None:
    scene = FoucaultPendulum(length=1.0, amplitude=0.2, rate=0.01)
    result = atwood.simulate(scene, t_end=40.0, rtol=1e-10, outputs=8001, form=form)
    turned = 0.01 * result.time
    x, y = result["bob.position.x"], result["bob.position.y"]
    x, y = x * np.cos(turned) + y * np.sin(turned), y * np.cos(turned) - x * np.sin(turned)  # as seen from the platform
    r = np.hypot(x, y)
    ends = np.flatnonzero((r[1:-1] > r[:-2]) & (r[1:-1] >= r[2:])) + 1
    plane = np.unwrap(2.0 * np.arctan2(y[ends], x[ends])) / 2.0
    rate = np.polyfit(result.time[ends], plane, 1)[0]
    values = {OMEGA: 0.01, BETA: sympy.pi / 2, sympy.Symbol("a"): 0.2, sympy.Symbol("l"): 1.0}
    expected = float(foucault_formulas()["swing"].subs(values))
    assert rate == pytest.approx(expected, rel=2e-3)
    assert abs(rate + 0.01) > 5.0 * abs(rate - expected)
