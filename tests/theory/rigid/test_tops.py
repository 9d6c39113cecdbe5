"""The heavy symmetric top in letters and of a scene: its cubic, its four motions, steady precession, sleeping."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import sympy

import atwood
from atwood import SymmetricTop, UnsupportedError, UsageError, symmetric_top, top_formulas
from atwood_library.scenes import Gyroscope, HeavyTop, LagrangeTop

T = sympy.Symbol("t")
I1, I3, E, P, S, M, G, H, U = sympy.symbols("I_1 I_3 E p_phi p_psi m g l u")
THETA = sympy.Function("theta")(T)


def test_the_cubic_follows_from_the_energy() -> None:
    sheet = top_formulas()
    rate = sympy.solve(sheet["energy"] - E, THETA.diff(T) ** 2)[0]
    found = (sympy.sin(THETA) ** 2 * rate).subs(sympy.sin(THETA), sympy.sqrt(1 - U**2)).subs(sympy.cos(THETA), U)
    assert sympy.simplify(found - sheet["F"]) == 0
    assert sympy.degree(sympy.expand(sheet["F"]), U) == 3


def test_momenta_are_those_of_the_lagrangian() -> None:
    sheet, book = top_formulas(), atwood.rigid_body(symmetric=True)
    momenta = book["momenta"]
    assert sympy.expand(sheet["p_psi"] - momenta[2]) == 0
    assert sympy.expand(sheet["p_phi"].subs(S, sheet["p_psi"]) - momenta[0]) == 0
    phi, psi = sympy.Function("phi")(T).diff(T), sympy.Function("psi")(T).diff(T)
    rates = {phi: sheet["phi"], psi: sheet["psi"]}
    for momentum, letter in ((sheet["p_phi"], P), (sheet["p_psi"], S)):
        assert sympy.simplify(momentum.subs(rates) - letter) == 0


def test_steady_precession_and_small_deviations() -> None:
    sheet, angle = top_formulas(), sympy.Symbol("theta")
    potential = (P - S * sympy.cos(angle)) ** 2 / (2 * I1 * sympy.sin(angle) ** 2) + M * G * H * sympy.cos(angle)
    slope = potential.diff(angle)
    both = sheet["steady"].subs(U, sympy.cos(angle))
    expected = (both.lhs - both.rhs) / (I1 * sympy.sin(angle) ** 3)
    assert sympy.simplify(sympy.trigsimp(slope - expected)) == 0
    values = {I1: sympy.Rational(1, 40), S: sympy.Rational(1, 2), M: 1, G: sympy.Rational(981, 100)}
    values |= {H: sympy.Rational(1, 10), U: sympy.Rational(3, 5)}
    for name in ("slow", "fast"):
        rate = sheet[name].subs(values)
        momentum = I1 * rate * (1 - U**2) + S * U
        kept = {P: momentum.subs(values)}
        assert abs(sympy.N((both.lhs - both.rhs).subs(sympy.cos(angle), U).subs(kept).subs(values), 50)) < 1e-45
        curved = (potential.diff(angle, 2) / I1).subs(kept).subs(values).subs(angle, sympy.acos(sympy.Rational(3, 5)))
        square = sheet["nutation"].subs(sympy.Symbol("Omega"), rate).subs(values)
        assert abs(sympy.N(curved - square, 50)) < sympy.Float("1e-42", 50)


@pytest.mark.sample(0)
def test_the_sleeping_top() -> None:
    """Of the linear equations of its tip in the plane: z'' - i p_psi/I_1 z' - m g l/I_1 z = 0."""
    sheet, z = top_formulas(), sympy.Symbol("z")
    polynomial = z**2 - S / I1 * z + M * G * H / I1
    for one in sheet["sleeping_frequencies"]:
        assert sympy.simplify(polynomial.subs(z, one)) == 0
    growing = S / (2 * I1) + sympy.I * sheet["sleeping_growth"]
    assert sympy.simplify(polynomial.subs(z, growing)) == 0


@pytest.mark.sample(0)
def test_it_sleeps_from_that_spin_on() -> None:
    top = symmetric_top(LagrangeTop(inclination=0.01))
    values = {I1: top.across, M: top.weight, G: 1, H: 1}
    least = float(sympy.sqrt(top_formulas()["sleeping"].rhs.subs(values)))
    for share, stable in ((1.1, True), (0.9, False)):
        scene = LagrangeTop(inclination=0.01, spin=share * least / top.along)
        result = atwood.simulate(scene, t_end=2.0, rtol=1e-10)
        assert symmetric_top(scene).is_stable_upright is stable
        assert bool(np.max(result["top.theta"]) < 0.05) is stable


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("motion", ["cusps", "loops", "waves", "steady"])
def test_the_four_motions_of_a_scene(motion: str, form: str) -> None:
    scene = LagrangeTop(motion=motion)
    top = symmetric_top(scene)
    assert top.kind == motion
    result = atwood.simulate(scene, form=form, t_end=1.0, rtol=1e-10, outputs=401)
    u, rate = np.cos(result["top.theta"]), -np.sin(result["top.theta"]) * result["top.theta_rate"]
    assert rate**2 == pytest.approx(top.f(u), abs=1e-6)
    assert np.min(u) >= top.roots[0] - 1e-6
    assert np.max(u) <= top.roots[1] + 1e-6
    numbers = {sympy.Symbol(k): v for k, v in top.formulas.numbers.items()} | {M: top.weight, G: 1, H: 1}
    cubic = sympy.Poly(top.formulas["F"].subs(numbers), U)
    assert [float(one) for one in cubic.all_coeffs()] == pytest.approx(np.poly(top.roots) * float(cubic.LC()), rel=1e-6)
    steady = {**numbers, U: top.steady}
    both = top.formulas["steady"]
    assert float(both.lhs.subs(steady)) == pytest.approx(float(both.rhs.subs(steady)), abs=1e-12)
    if motion == "steady":
        assert top.steady == pytest.approx(np.cos(scene.inclination), abs=1e-8)
        assert float(top.formulas["slow"].subs(steady)) == pytest.approx(scene.steady_precession(), rel=1e-6)


def test_from_its_constants() -> None:
    top = SymmetricTop(across=0.025, along=0.01, weight=0.981, p_phi=0.43, p_psi=0.5, energy=13.36)
    assert top.roots == pytest.approx(np.sort(top.roots))
    assert top.f(top.roots) == pytest.approx(0.0, abs=1e-9)
    assert -1.0 < top.roots[0] < top.steady < top.roots[1] < 1.0 < top.roots[2]


def test_constants_of_no_motion_and_of_the_sleeping_top() -> None:
    with pytest.raises(UsageError, match="below that of steady precession"):
        SymmetricTop(across=0.025, along=0.01, weight=0.981, p_phi=0.43, p_psi=0.5, energy=13.0).kind  # noqa: B018
    energy = 0.5**2 / 0.02 + 0.981
    sleeping = SymmetricTop(across=0.025, along=0.01, weight=0.981, p_phi=0.5, p_psi=0.5, energy=energy)
    assert sleeping.steady == pytest.approx(1.0, abs=1e-6)
    assert sleeping.is_stable_upright
    slow = SymmetricTop(across=0.025, along=0.01, weight=0.981, p_phi=0.2, p_psi=0.2, energy=0.2**2 / 0.02 + 0.981)
    assert slow.steady == pytest.approx(0.2 / np.sqrt(0.025 * 0.981) - 1.0)
    assert not slow.is_stable_upright


@pytest.mark.sample(0)
def test_the_four_in_one_figure() -> None:
    motions = [atwood.reduced(LagrangeTop(motion=one)) for one in ("loops", "cusps", "waves", "steady")]
    figure = atwood.plot_top_path(motions)
    assert len(figure.axes) == 8
    plt.close(figure)


@pytest.mark.sample(1)
@pytest.mark.parametrize("motion", ["cusps", "loops", "waves", "steady"])
def test_the_path_of_its_constants_is_that_of_a_run(motion: str) -> None:
    scene = LagrangeTop(motion=motion)
    top = symmetric_top(scene)
    result = atwood.simulate(scene, t_end=3.0 * top.period, rtol=1e-11, outputs=601)
    theta, phi, psi = top.angles(np.linspace(0.0, top.period, 201))
    run = np.stack([result[f"top.{name}"] for name in ("theta", "phi", "psi")])
    highest = int(np.argmin(run[0][:201])) if motion != "steady" else 0
    own = result.time[highest : highest + 201]
    found = np.stack([np.interp(own - own[0], np.linspace(0.0, top.period, 201), one) for one in (theta, phi, psi)])
    away = run[:, highest : highest + 201] - run[:, highest : highest + 1]
    assert found[0] == pytest.approx(run[0, highest : highest + 201], abs=2e-4)
    assert found[1] == pytest.approx(away[1], abs=2e-3)
    assert found[2] == pytest.approx(away[2], abs=2e-2)
    h = 1e-5
    for t in (0.2 * top.period, 0.7 * top.period):  # the rates are those of the formulas
        before, now, after = top.angles([t - h, t, t + h]).T
        values = {sympy.Symbol(k): v for k, v in top.formulas.numbers.items()} | {M: top.weight, G: 1, H: 1}
        rates = [float(top.formulas[k].subs(values).subs(THETA, now[0])) for k in ("phi", "psi")]
        assert (after - before)[1:] / (2.0 * h) == pytest.approx(rates, rel=1e-5)
        u = np.cos(now[0])
        assert (np.sin(now[0]) * (after - before)[0] / (2.0 * h)) ** 2 == pytest.approx(float(top.f(u)), abs=1e-5)


@pytest.mark.sample(0)
def test_the_four_motions_in_one_figure_from_their_constants() -> None:
    """At one p_phi and p_psi by the energy, or at one p_psi by p_phi; here of one top."""
    tops = [symmetric_top(LagrangeTop(motion=one)) for one in ("loops", "cusps", "waves", "steady")]
    same = [SymmetricTop(one.across, one.along, one.weight, one.p_phi, one.p_psi, one.energy) for one in tops]
    assert [one.kind for one in same] == ["loops", "cusps", "waves", "steady"]
    figure = atwood.plot_top_path(same)
    assert len(figure.axes) == 8
    for one, axes in zip(same, figure.axes[::2], strict=True):
        (u, f), root = axes.lines[0].get_data(), one.roots[0]
        assert f == pytest.approx(one.f(np.asarray(u)))
        assert axes.lines[2].get_xdata()[0] == pytest.approx(root)
    plt.close(figure)


@pytest.mark.sample(0)
def test_what_is_no_top() -> None:
    with pytest.raises(UnsupportedError, match=r"it is no top on a fixed tip: it has inner_bearing\.angle"):
        symmetric_top(Gyroscope())
    with pytest.raises(UnsupportedError, match="not reduced to one coordinate"):
        symmetric_top(HeavyTop())
