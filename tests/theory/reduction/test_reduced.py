"""Motions of one coordinate by quadrature, against closed forms and runs."""

import math
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.special import ellipkm1

from atwood import (
    Scene,
    UnsupportedError,
    UsageError,
    equations,
    point_transformation,
    reduced,
    routhian,
    simulate,
)
from atwood_library import Ground, PairPotential, Pivot, PointMass, Potential, Slider
from atwood_library.scenes import SCENES


def against_a_run(scene: Scene, periods: float = 2.0) -> dict[str, float]:
    """Return the largest deviations of a run from the quadrature, of coordinates that the run has."""
    found = reduced(scene)
    result = simulate(scene, t_end=periods * found.period, rtol=1e-13, solver="taylor", outputs=41)
    expected = found.at(result.time)
    return {path: float(np.max(np.abs(expected[path] - result[path]))) for path in expected if path in result}


# -- the pendulum -----------------------------------------------------------------------------------------------------


def pendulum(angle: float, rate: float = 0.0) -> Scene:
    scene = SCENES["simple-pendulum"]()
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": rate})
    return scene


@pytest.mark.sample(4)
@pytest.mark.parametrize("amplitude", [1e-7, 1e-3, 1.0, 2.5, 3.1])
def test_the_period_of_the_pendulum_is_its_elliptic_integral(amplitude: float) -> None:
    scene = pendulum(amplitude)
    found = reduced(scene)
    values = equations(scene)
    length, gravity = (values.values[values.symbol(path)] for path in ("rod.length", "gravity"))
    expected = 4.0 * math.sqrt(length / gravity) * ellipkm1(math.cos(amplitude / 2.0) ** 2)
    assert found.kind == "libration"
    assert found.period == pytest.approx(expected, rel=1e-11)
    assert found.turning_points == pytest.approx((-amplitude, amplitude), rel=1e-9)


def test_a_pendulum_that_goes_over() -> None:
    scene = pendulum(0.3, 9.0)
    found = reduced(scene)
    assert found.kind == "rotation"
    deviation = against_a_run(scene)
    assert deviation["rod.angle"] < 1e-10
    backwards = reduced(pendulum(-0.3, -9.0))
    assert backwards.period == pytest.approx(found.period, rel=1e-12)
    assert backwards.at(found.period)["rod.angle"] == pytest.approx(-0.3 - 2.0 * math.pi, rel=1e-12)


def test_a_pendulum_at_rest_and_on_its_separatrix() -> None:
    still = reduced(pendulum(0.0))
    assert still.kind == "rest"
    values = equations(pendulum(0.0))
    length, gravity = (values.values[values.symbol(path)] for path in ("rod.length", "gravity"))
    assert still.period == pytest.approx(2.0 * math.pi * math.sqrt(length / gravity), rel=1e-9)
    with pytest.raises(Exception, match="separatrix"):
        reduced(pendulum(0.0, 2.0 * math.sqrt(gravity / length)))


# -- tops and hoops ---------------------------------------------------------------------------------------------------


def cubic(scene: Any, found: Any) -> np.ndarray:
    """Return the coefficients of F(u), whose roots are the turning points (Goldstein, equation 5.62)."""
    about, axial = scene.transverse + scene.mass * scene.height**2, scene.axial
    weight = scene.mass * 9.80665 * scene.height
    p_phi, p_psi = found.momenta["top.euler.phi"], found.momenta["top.euler.psi"]
    level = 2.0 * found.energy - p_psi**2 / axial
    square = np.polynomial.Polynomial([p_phi, -p_psi]) ** 2 / about
    return (np.polynomial.Polynomial([level, -2.0 * weight]) * np.polynomial.Polynomial([1.0, 0.0, -1.0]) - square).coef


@pytest.mark.sample(1)
@pytest.mark.parametrize("motion", ["loops", "cusps", "waves", "steady"])
def test_lagrange_s_top_in_its_four_motions(motion: str) -> None:
    scene = SCENES["lagrange-top"](motion=motion, inclination=0.7)
    found = reduced(scene)
    gravity = equations(scene).values[equations(scene).symbol("gravity")]
    assert gravity == pytest.approx(9.80665, abs=5e-3)
    f = np.polynomial.Polynomial(cubic(scene, found))
    f = f + np.polynomial.Polynomial([0.0, 1.0, 0.0, -1.0]) * 2.0 * scene.mass * scene.height * (9.80665 - gravity)
    for angle in found.turning_points:
        u = math.cos(angle)
        assert abs(f(u)) < 1e-12 * np.max(np.abs(f.coef))  # a root of F(u)
    period = found.period
    result = simulate(scene, t_end=3.0 * period, rtol=1e-13, solver="taylor", outputs=7)
    theta, phi, psi = (result[f"top.{name}"] for name in ("theta", "phi", "psi"))
    assert theta[::2] == pytest.approx(np.full(4, theta[0]), abs=1e-10)
    assert np.diff(phi[::2]) == pytest.approx(np.full(3, found.advance["top.euler.phi"]), abs=1e-10)
    assert np.diff(psi[::2]) == pytest.approx(np.full(3, found.advance["top.euler.psi"]), abs=1e-10)
    assert (found.kind == "rest") == (motion == "steady")
    along = found.at(result.time)
    assert along["top.euler.theta"] == pytest.approx(theta, abs=1e-10)
    assert along["top.euler.phi"] - along["top.euler.phi"][0] == pytest.approx(phi - phi[0], abs=1e-10)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["rotating-hoop-driven", "rotating-hoop-free", "pendulum-on-cart"])
def test_against_runs(name: str) -> None:
    deviations = against_a_run(SCENES[name]())
    assert deviations
    assert max(deviations.values()) < 1e-10


def test_the_spherical_pendulum_advances() -> None:
    deviations = against_a_run(SCENES["spherical-pendulum"](coordinates="angles"))
    assert set(deviations) == {"rod.parameter_1", "rod.parameter_2"}
    assert max(deviations.values()) < 1e-10


# -- orbits -----------------------------------------------------------------------------------------------------------


def orbit(eccentricity: float, speed_up: float = 1.0) -> Scene:
    """Return a body on a slider that turns about an attracting centre: coordinates r and phi."""
    scene = Scene(gravity=0.0)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    slider, body = scene.add("slider", Slider()), scene.add("body", PointMass(mass=1.5))
    pull = scene.add("pull", PairPotential(law="coulomb", coulomb_constant=1.0, charge_a=1.0, charge_b=-1.5))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, slider.a)
    scene.connect(slider.b, body.point)
    scene.connect(pull.a, ground.frame)
    scene.connect(pull.b, body.point)
    near = 1.0 - eccentricity
    rate = speed_up * math.sqrt((1.0 + eccentricity) / near) / near
    scene.start.update({"slider.displacement": near, "slider.speed": 0.0, "pivot.angle": 0.2})
    scene.start["pivot.angular_velocity"] = rate
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("eccentricity", [0.1, 0.5, 0.9])
def test_kepler_s_orbits_close(eccentricity: float) -> None:
    found = reduced(orbit(eccentricity))
    assert found.coordinate == "slider.displacement"
    assert found.turning_points == pytest.approx((1.0 - eccentricity, 1.0 + eccentricity), rel=1e-11)
    assert found.period == pytest.approx(2.0 * math.pi, rel=1e-11)
    assert found.advance["pivot.b.angle"] == pytest.approx(2.0 * math.pi, rel=1e-11)
    # Kepler's equation: r = 1 - e cos E, t = E - e sin E
    anomaly = np.linspace(0.0, 12.0, 9)
    along = found.at(anomaly - eccentricity * np.sin(anomaly))
    assert along["slider.displacement"] == pytest.approx(1.0 - eccentricity * np.cos(anomaly), rel=1e-9)


def test_a_circle_and_a_hyperbola() -> None:
    circle = reduced(orbit(0.0))
    assert circle.kind == "rest"
    assert circle.period == pytest.approx(2.0 * math.pi, rel=1e-9)
    away = reduced(orbit(0.5, speed_up=1.5))
    assert away.kind == "unbounded"
    assert away.period == math.inf
    with pytest.raises(UnsupportedError, match="does not come back"):
        away.at(1.0)


def test_kepler_in_polar_coordinates_and_two_bodies_in_relative_ones() -> None:
    r, phi = sympy.symbols("r phi", positive=True)
    scene = SCENES["kepler"](eccentricity=0.6, mass=1.3, strength=0.9)
    polar = {"body.position.x": r * sympy.cos(phi), "body.position.z": r * sympy.sin(phi)}
    found = reduced(point_transformation(scene, polar, [r, phi]))
    assert (found.coordinate, found.ignorable) == ("r", ("phi",))
    assert found.turning_points == pytest.approx((0.4, 1.6), rel=1e-10)
    assert found.period == pytest.approx(2.0 * math.pi * math.sqrt(1.3 / 0.9), rel=1e-10)
    assert found.advance["phi"] == pytest.approx(2.0 * math.pi, rel=1e-10)
    result = simulate(scene, t_end=2.0, rtol=1e-13, solver="taylor", outputs=9)
    along = found.at(result.time)
    assert along["r"] * np.cos(along["phi"]) == pytest.approx(result["body.position.x"], abs=1e-10)
    assert found.expression.has(r)
    with pytest.raises(UnsupportedError, match="not ignorable"):
        reduced(point_transformation(scene, {"body.position.x": r + phi, "body.position.z": phi}, [r, phi]))


POLAR = {"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}


@pytest.mark.sample(1)
@pytest.mark.parametrize(("e", "strength"), [(0.6, 0.9), (1.5, 0.9), (1.7, -0.8)])
def test_the_conics_of_kepler_as_formulas(e: float, strength: float) -> None:
    """``r = p/(1 + e cos)``, ``p = L^2/(m k)``, ``e^2 = 1 + 2 E L^2/(m k^2)`` (Goldstein, section 3.7)."""
    scene = SCENES["kepler"](eccentricity=e, strength=strength, mass=1.3, semi_major_axis=1.2)
    found, eq = reduced(scene, old=POLAR), equations(scene)
    m, L, E, phi, start = eq.symbol("body.mass"), *sympy.symbols("p_phi E phi phi_0")
    k = -sympy.Mul(*(eq.symbol(f"force.{one}") for one in ("charge_a", "charge_b", "coulomb_constant")))
    values = {one: sympy.Float(value, 60) for one, value in found.formulas.values.items()}
    values |= {phi: sympy.Float(0.3, 60), start: sympy.Float(0)}
    side = 1 if strength > 0.0 else -1
    latus, eccentricity = side * L**2 / (m * k), sympy.sqrt(1 + 2 * E * L**2 / (m * k**2))
    expected = {"semi_latus_rectum": latus, "eccentricity": eccentricity, "semi_major_axis": abs(k / (2 * E))}
    for name, book in expected.items():
        assert abs((found.elements[name] - book).xreplace(values).evalf(50)) < 1e-45
    assert float(found.elements["eccentricity"].xreplace(values)) == pytest.approx(e, rel=1e-9)
    [orbit] = found.orbit.values()
    book = latus / (side + eccentricity * sympy.cos(phi - start))
    assert abs((orbit - book).xreplace(values).evalf(50)) < 1e-44
    run = simulate(scene, t_end=1.0, rtol=1e-12, outputs=5)
    x, z = run["body.position.x"], run["body.position.z"]
    for place, angle in zip(np.hypot(x, z), np.arctan2(z, x), strict=True):
        assert float(orbit.xreplace({**values, phi: sympy.Float(angle)})) == pytest.approx(place, rel=1e-9)
    if e > 1.0:
        assert found.formulas.period is None
        angle = found.scattering_angle.xreplace(values).evalf(50)
        speed = sympy.sqrt(2 * E / m)
        rutherford = 2 * sympy.atan(abs(k) / (m * speed**2 * (L / (m * speed))))  # of the impact parameter L/(m v)
        assert abs(angle - rutherford.xreplace(values).evalf(50)) < 1e-45
        assert "inf" not in repr(found)
    else:
        third = 2 * sympy.pi * sympy.sqrt(m * found.elements["semi_major_axis"] ** 3 / k)  # Kepler's third law
        assert abs((found.formulas.period - third).xreplace(values).evalf(50)) < 1e-44
        assert float(found.formulas.period.xreplace(values)) == pytest.approx(found.period, rel=1e-10)
        assert found.scattering_angle is None


def test_a_space_oscillator_advances_by_half_a_turn() -> None:
    scene = Scene(gravity=0.0)
    field, body = scene.add("field", Potential(energy_function="0.7*(x**2 + z**2)")), scene.add("body", PointMass())
    scene.connect(field.point, body.point)
    scene.start.update({"body.position.x": 1.0, "body.position.z": 0.1, "body.velocity.x": 0.2, "body.velocity.z": 0.9})
    found = reduced(scene, old=POLAR)
    values = {one: sympy.Float(value) for one, value in found.formulas.values.items()}
    [advance] = found.formulas.advance.values()
    assert advance == sympy.pi
    assert float(found.formulas.period.xreplace(values)) == pytest.approx(found.period, rel=1e-10)
    [orbit], phi = found.orbit.values(), sympy.Symbol("phi")
    low, high = found.turning_points
    ends = sorted(float(orbit.xreplace({**values, sympy.Symbol("phi_0"): 0.0, phi: a})) for a in (0.0, math.pi / 2))
    assert ends == pytest.approx([low, high], rel=1e-9)


# -- in symbols -------------------------------------------------------------------------------------------------------


def test_routh_s_procedure_of_the_pendulum_on_a_cart() -> None:
    scene = SCENES["pendulum-on-cart"]()
    found, eq = routhian(scene), equations(scene)
    theta, big, m, l, g = (eq.symbol(path) for path in ("rod.angle", "cart.mass", "bob.mass", "rod.length", "gravity"))
    assert found.ignorable == ("rail.displacement",)
    [p] = found.momenta
    rate = theta.diff(sympy.Symbol("t"))
    whole, across = big + m, m * l * sympy.cos(theta)
    expected = p**2 / (2 * whole) - p * across * rate / whole
    expected += across**2 * rate**2 / (2 * whole) - m * l**2 * rate**2 / 2 - m * g * l * sympy.cos(theta)
    random = np.random.default_rng(2)
    for _ in range(4):
        difference = (found.expression - expected).xreplace({rate: sympy.Float(random.uniform(0.3, 1.5))})
        numbers = {one: sympy.Float(random.uniform(0.3, 1.5)) for one in [theta, *difference.free_symbols]}
        assert abs(float(difference.xreplace(numbers))) < 1e-12
    [equation] = found.equations
    assert equation.has(theta.diff(sympy.Symbol("t"), 2))


@pytest.mark.sample(0)
def test_the_effective_potential_is_the_same_in_symbols_and_numbers() -> None:
    for name, options in (("lagrange-top", {}), ("rotating-hoop-free", {}), ("rotating-hoop-driven", {})):
        scene = SCENES[name](**options)
        found = reduced(scene)
        eq = equations(scene, orientation="euler-zxz" if name == "lagrange-top" else None)
        known = dict(eq.values)
        known |= dict(zip(found.routhian.momenta, found.momenta.values(), strict=True))
        [s] = found.routhian.coordinates
        values = np.array([0.5, 0.9, 1.7])
        symbolic = [float(found.expression.xreplace({s: sympy.Float(v)}).xreplace(known)) for v in values]
        assert found.effective_potential(values) == pytest.approx(symbolic, rel=1e-12)


def test_the_effective_potential_of_a_top_is_a_sum_of_squares() -> None:
    """``(p_phi - p_psi cos)^2/(2 I1 sin^2) + p_psi^2/(2 I3) + m g l cos`` (Goldstein, equation 5.60), three terms."""
    found = routhian(SCENES["lagrange-top"]())
    assert found.ignorable == ("top.euler.phi", "top.euler.psi")
    (theta,), (p, spin) = found.coordinates, found.momenta
    m, l, first, third, g = sympy.symbols("m c_z I_1 I_3 g")
    across = (first + m * l**2) * sympy.sin(theta) ** 2
    book = (p - spin * sympy.cos(theta)) ** 2 / (2 * across) + spin**2 / (2 * third) + m * g * l * sympy.cos(theta)
    assert sympy.simplify(found.effective_potential - book) == 0
    assert len(found.effective_potential.args) == 3
    assert found.effective_potential.has((p - spin * sympy.cos(theta)) ** 2)


# -- questions without an answer --------------------------------------------------------------------------------------


def test_what_cannot_be_reduced_is_refused() -> None:
    with pytest.raises(UnsupportedError, match="not reduced to one coordinate"):
        reduced(SCENES["double-pendulum"]())
    with pytest.raises(UnsupportedError, match="energy function is not conserved"):
        reduced(SCENES["driven-pendulum"]())
    with pytest.raises(UnsupportedError, match="it rolls"):
        reduced(SCENES["rolling-disc"]())
    with pytest.raises(UsageError, match="not ignorable"):
        routhian(SCENES["pendulum-on-cart"](), ["rod.angle"])
    with pytest.raises(UsageError, match="no coordinate"):
        reduced(SCENES["pendulum-on-cart"](), "cart.x")


def test_on_top_of_the_potential_a_separatrix_is_named_and_no_period_is_infinite() -> None:
    top = reduced(SCENES["simple-pendulum"](release_angle=math.pi))
    assert top.is_separatrix
    [told] = [line for line in top.text().splitlines() if line.startswith("period ")]
    assert "none" in told
    assert not reduced(SCENES["simple-pendulum"]()).is_separatrix


def test_two_bodies_start_at_any_angle_of_their_distance() -> None:
    """Body 1 is to the left of body 2 at the start: there the angle is pi, and the distance not negative."""
    places = {
        f"body{one}.position.{axis}": f"{whole} {sign} m_{3 - one}/(m_1 + m_2)*r*{wave}(phi)"
        for one, sign in ((1, "+"), (2, "-"))
        for axis, whole, wave in (("x", "X", "cos"), ("z", "Z", "sin"))
    }
    found = reduced(point_transformation(SCENES["two-body"](space="plane"), places, ["X", "Z", "r", "phi"]), "r")
    assert found.period == pytest.approx(2.0 * math.pi / math.sqrt(3.0), rel=1e-12)
    assert found.turning_points == pytest.approx((0.5, 1.5), rel=1e-9)
