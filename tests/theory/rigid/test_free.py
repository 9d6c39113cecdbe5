"""Bodies that turn freely: Jacobi's functions, Poinsot's curves and deviations from steady rotation."""

import matplotlib.pyplot as plt
import mpmath
import numpy as np
import pytest
import sympy

import atwood
from atwood import UnsupportedError, UsageError, free_body, free_rotation
from atwood_library.scenes import FreeBody, FreeSymmetricBody, IntermediateAxis, LagrangeTop, RotatingHoopFree

T = sympy.Symbol("t")
I1, I2, I3, E, L, RHO = sympy.symbols("I_1 I_2 I_3 E L rho")
W = [sympy.Function(f"omega_{k}")(T) for k in (1, 2, 3)]
EULER = [(I2 - I3) * W[1] * W[2] / I1, (I3 - I1) * W[2] * W[0] / I2, (I1 - I2) * W[0] * W[1] / I3]
MOMENTS = {I1: sympy.Rational(13, 10), I2: sympy.Rational(2), I3: sympy.Rational(27, 10)}


def spins(sheet: atwood.FormulaSheet, values: dict) -> list:
    """Return the angular velocity of a sheet as functions of time, to 50 digits."""
    rate = sheet["tau"].subs(values).subs(sympy.Symbol("t_0"), 0)
    tau, k = sympy.Symbol("tau"), sympy.Symbol("k")
    square = sheet["k"].subs(values) if "k" in sheet else 1
    found = []
    for name in ("omega_1", "omega_2", "omega_3"):
        size = sheet[name].subs(values)
        wave = next(one for one in size.atoms(sympy.Function) | size.atoms(sympy.core.function.AppliedUndef))

        def at(t, size=size, wave=wave):
            u = mpmath.mpf(sympy.N(rate.subs(T, sympy.Float(str(t), 50)), 50))
            kind = wave.func.__name__
            value = mpmath.ellipfun(kind, u=u, m=mpmath.mpf(sympy.N(square, 50))) if "k" in sheet else None
            if value is None:
                value = mpmath.sech(u) if kind == "sech" else mpmath.tanh(u)
            return mpmath.mpf(sympy.N(size.xreplace({wave: sympy.Symbol("w")}).subs(sympy.Symbol("w"), 1), 50)) * value

        found.append(at)
    assert not {tau, k} - sheet["omega_1"].free_symbols or "k" not in sheet
    return found


@pytest.mark.parametrize("kind", ["asymmetric", "separatrix"])
def test_jacobi_s_functions_solve_euler_s_equations(kind: str) -> None:
    with mpmath.workdps(50):
        energy = sympy.Rational(3, 2)
        square = 2 * energy * MOMENTS[I2] + (sympy.Rational(1, 3) if kind == "asymmetric" else 0)
        values = {**MOMENTS, E: energy, L: sympy.sqrt(square), sympy.Symbol("omega_0"): sympy.sqrt(2 * energy / 2)}
        at = spins(free_body(kind), values)
        t = mpmath.mpf("0.37")
        w = [one(t) for one in at]
        numbers = {own: sympy.Float(str(one), 50) for own, one in zip(W, w, strict=True)}
        for one, rate in zip(at, EULER, strict=True):
            expected = mpmath.mpf(sympy.N(rate.subs(MOMENTS).subs(numbers), 50))
            assert abs(mpmath.diff(one, t, h=mpmath.mpf(10) ** -15) - expected) < mpmath.mpf(10) ** -25
        moments = [mpmath.mpf(one.p) / one.q for one in MOMENTS.values()]
        assert abs(sum(i * x**2 for i, x in zip(moments, w, strict=True)) - 3) < mpmath.mpf(10) ** -45
        whole = sum((i * x) ** 2 for i, x in zip(moments, w, strict=True))
        assert abs(whole - mpmath.mpf(sympy.N(square, 50))) < mpmath.mpf(10) ** -44


def test_polhodes_are_where_the_surfaces_cut() -> None:
    sheet = free_body()
    energy = sum(i * w**2 for i, w in zip((I1, I2, I3), W, strict=True)) / 2
    square = sum((i * w) ** 2 for i, w in zip((I1, I2, I3), W, strict=True))
    for name in ("polhode_1", "polhode_2", "polhode_3"):
        both = sheet[name]
        assert sympy.expand((both.lhs - both.rhs).subs(L, sympy.sqrt(square)).subs(E, energy)) == 0
    momenta = dict(zip(sympy.symbols("L_1:4"), [i * w for i, w in zip((I1, I2, I3), W, strict=True)], strict=True))
    for name in ("energy", "sphere"):
        both = sheet[name].subs(momenta)
        assert sympy.expand((both.lhs - both.rhs).subs(L, sympy.sqrt(square)).subs(E, energy)) == 0


def test_the_herpolhode_s_angle() -> None:
    """It is the rate at which the angular velocity goes round L in space, where it changes as in the body."""
    w, rate = sympy.Matrix(W), sympy.Matrix(EULER)
    momentum = sympy.diag(I1, I2, I3) * w
    energy, size = momentum.dot(w) / 2, sympy.sqrt(momentum.dot(momentum))
    rho2 = w.dot(w) - 4 * energy**2 / size**2
    expected = momentum.dot(w.cross(rate)) / size / rho2
    found = free_body()["chi"].subs(RHO, sympy.sqrt(rho2)).subs({E: energy, L: size})
    numbers = {**MOMENTS, **dict(zip(W, map(sympy.Rational, ("3/7", "-2/5", "9/8")), strict=True))}
    assert abs(sympy.N((found - expected).subs(numbers), 50)) < sympy.Float("1e-45", 50)
    assert free_body()["rho"] == w.dot(w) - 4 * E**2 / L**2


def test_deviations_from_steady_rotation_are_those_of_the_linear_equations() -> None:
    sheet, rate = free_body("steady"), sympy.Symbol("Omega")
    for k in range(3):
        still = {one: rate if i == k else 0 for i, one in enumerate(W)}
        matrix = sympy.Matrix(3, 3, lambda i, j: EULER[i].diff(W[j])).subs(still)
        i, j = (n for n in range(3) if n != k)
        square = sympy.expand(matrix[i, j] * matrix[j, i])
        assert sympy.simplify(sheet[f"growth_{k + 1}"] ** 2 - square) == 0
        assert sympy.simplify(sheet[f"frequency_{k + 1}"] ** 2 + square) == 0
        for moments in ((1, 2, 3), (3, 1, 2), (2, 3, 4)):
            values = dict(zip((I1, I2, I3), moments, strict=True))
            assert bool(sheet[f"stable_{k + 1}"].subs(values)) == bool(square.subs(values | {rate: 1}) < 0)


def test_the_middle_axis_as_it_grows() -> None:
    scene = IntermediateAxis(deviation=1e-6)
    result = atwood.simulate(scene, t_end=6.0, rtol=1e-12)
    values = dict(zip((I1, I2, I3), (1, 2, 3), strict=True)) | {sympy.Symbol("Omega"): 1}
    growth = float(free_body("steady")["growth_2"].subs(values))
    assert growth == pytest.approx(1.0 / np.sqrt(3.0))
    assert result["body.spin.x"][-1] == pytest.approx(1e-6 * np.cosh(6.0 * growth), rel=1e-6)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("scene", [FreeBody(), FreeSymmetricBody(), IntermediateAxis()])
def test_along_runs(scene: atwood.Scene, form: str) -> None:
    result = atwood.simulate(scene, t_end=8.0, rtol=1e-11, form=form, outputs=41)
    found = free_rotation(result.assembly)
    run = np.stack([result[f"body.spin.{axis}"] for axis in "xyz"])
    assert found.at(result.time) == pytest.approx(run, abs=1e-8)
    assert result["body.turning_energy"] == pytest.approx(found.energy, rel=1e-9)
    w = np.stack([result[f"body.angular_velocity.{axis}"] for axis in "xyz"])
    up = np.array([result[f"body.angular_momentum.{axis}"][0] for axis in "xyz"]) / found.momentum
    across = w - np.outer(up, up @ w)
    rho, chi = found.herpolhode(result.time)
    assert rho == pytest.approx(np.linalg.norm(across, axis=0), abs=1e-7)
    first = across[:, 0] / rho[0]
    turned = np.unwrap(np.arctan2(np.cross(up, first) @ across, first @ across))
    assert np.unwrap(chi) == pytest.approx(turned, abs=1e-5)


@pytest.mark.parametrize("scene", [FreeBody(), FreeSymmetricBody(), IntermediateAxis()])
def test_orientations_along_runs(scene: atwood.Scene) -> None:
    result = atwood.simulate(scene, t_end=8.0, rtol=1e-11, outputs=41)
    found = free_rotation(result.assembly)
    turned = found.orientation(result.time)
    assert turned @ np.swapaxes(turned, 1, 2) == pytest.approx(np.broadcast_to(np.eye(3), turned.shape), abs=1e-12)
    run = np.array([[result[f"body.{axis}_axis.{k}"] for axis in "xyz"] for k in "xyz"]).transpose(2, 0, 1)
    rest = run[0] @ turned[0].T
    assert np.linalg.det(rest) == pytest.approx(1.0)
    momentum = np.array([result[f"body.angular_momentum.{k}"][0] for k in "xyz"])
    assert rest[:, 2] * found.momentum == pytest.approx(momentum, abs=1e-9)
    assert rest @ turned == pytest.approx(run, abs=1e-5)


def test_the_orientation_of_steady_rotation() -> None:
    steady = free_rotation(moments=(1, 2, 3), spin=(0, 0.7, 0))
    first, later = steady.orientation([0.0, 2.0])
    c, s = np.cos(1.4), np.sin(1.4)
    assert later @ first.T == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), abs=1e-12)
    assert first @ [0, 1, 0] == pytest.approx([0, 0, 1])


@pytest.mark.parametrize("moments", [(1, 2, 3), (3, 1, 2), (2, 1, 3), (3, 2, 1), (1, 1, 1.6), (1.6, 1, 1), (1, 1.6, 1)])
@pytest.mark.parametrize("spin", [(0.4, -1.0, 0.7), (-1.2, 0.3, -0.1), (0.1, 0.9, -1.3)])
def test_any_order_of_axes(moments: tuple, spin: tuple) -> None:
    found = free_rotation(moments=moments, spin=spin)
    assert found.at(0.0)[:, 0] == pytest.approx(spin, abs=1e-13)
    h, i, t = 1e-4, np.array(moments, dtype=float), np.array([0.9])
    rate = (found.at(t + h) - found.at(t - h))[:, 0] / (2 * h)
    w = found.at(t)[:, 0]
    assert i * rate == pytest.approx(np.cross(i * w, w), abs=1e-6)
    assert found.at(found.period)[:, 0] == pytest.approx(spin, abs=1e-12)


def test_kinds() -> None:
    assert free_rotation(moments=(1, 2, 3), spin=(0, 1, 0)).kind == "steady"
    assert free_rotation(moments=(1, 2, 3), spin=(0, 1, 0)).at([0.0, 5.0])[1].tolist() == [1.0, 1.0]
    separatrix = free_rotation(moments=(1, 2, 3), spin=(1.0, 0.3, 1.0 / np.sqrt(3.0)))
    assert separatrix.kind == "separatrix"
    assert separatrix.period == np.inf
    ends = abs(separatrix.at(60.0)[:, 0])
    assert ends == pytest.approx([0.0, np.sqrt(separatrix.energy), 0.0], abs=1e-9)  # omega_0^2 = 2 E/I_2
    assert free_rotation(moments=(1, 1, 1.6), spin=(1, 0, 3)).kind == "symmetric"
    assert free_rotation(FreeBody()).kind == "asymmetric"
    assert free_rotation(FreeBody()).formulas.title == "Free body: asymmetric"


def test_the_symmetric_body_s_rates() -> None:
    scene, sheet = FreeSymmetricBody(), free_body("symmetric")
    nu, precession = scene.rates()
    momentum = scene.along * scene.spin / np.cos(scene.inclination)
    values = {I1: 1.0, I3: 1.6, sympy.Symbol("omega_3"): 3.0, sympy.Symbol("theta"): 0.5, L: momentum}
    assert float(sheet["nu"].subs(values)) == pytest.approx(nu)
    assert float(sheet["phi"].subs(values)) == pytest.approx(precession)
    assert float(sheet["phi_L"].subs(values)) == pytest.approx(precession)
    assert free_rotation(scene).period == pytest.approx(2.0 * np.pi / nu)
    result = atwood.simulate(scene, rtol=1e-11)
    assert result["body.psi_rate"][1:] == pytest.approx(-nu, rel=1e-8)
    assert result["body.phi_rate"][1:] == pytest.approx(precession, rel=1e-8)
    assert "φ̇ = I₃ ω₃ / (I₁ cos θ)" in sheet.text()


def test_pictures_and_refusals(tmp_path) -> None:
    for scene in (FreeBody(), FreeSymmetricBody()):
        figure = atwood.plot_free_rotation(free_rotation(scene), file=tmp_path / "free.svg")
        assert len(figure.axes) == 2
        plt.close(figure)
    with pytest.raises(UnsupportedError, match="a torque acts on it"):
        free_rotation(LagrangeTop())
    with pytest.raises(UnsupportedError, match="moments of inertia are 0, 0 and 0"):
        free_rotation(RotatingHoopFree())
    with pytest.raises(UsageError, match="a body is needed"):
        free_rotation()
    with pytest.raises(UsageError, match="do not say a motion"):
        free_rotation(moments=(1, 2, 3))
