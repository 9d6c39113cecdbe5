"""Canonical transformations: boosts, flows, generating functions of the four kinds, new coordinates of scenes."""

import math
from typing import Any

import pytest
import sympy

from atwood import (
    Scene,
    UnsupportedError,
    UsageError,
    canonical_transformation,
    equations,
    fundamental_brackets,
    generated_transformation,
    hamiltonian,
    point_transformation,
)
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library import Ground, PointMass, Spring
from atwood_library.scenes import SCENES

q, p, Q, P, t, v, m, w = sympy.symbols("q p Q P t v m omega")
ONE = ((q,), (p,))


def same(a: Any, b: Any) -> bool:
    return vanishes([a - b]).holds


def oscillator() -> tuple[Any, Any, Any]:
    scene = Scene(space="line", gravity=0.0)
    ground, body = scene.add("ground", Ground()), scene.add("body", PointMass(mass=2.0))
    spring = scene.add("spring", Spring(stiffness=3.0, natural_length=0.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, body.point)
    scene.start["body.position.x"] = 1.0
    eq = equations(scene)
    return hamiltonian(scene), eq.symbol("body.mass"), eq.symbol("spring.stiffness")


def test_a_boost_adds_its_momentum_to_the_hamiltonian() -> None:
    scene = Scene(gravity=0.0)
    scene.add("body", PointMass(mass=1.3))
    h = hamiltonian(scene)
    (x, z), (px, pz) = h.coordinates, h.momenta
    X, Z, PX, PZ = sympy.symbols("X Z P_X P_Z")
    found = canonical_transformation(h, {X: x + v * t, Z: z}, {PX: px, PZ: pz})
    assert found.is_canonical
    assert found.verdict.proven
    assert same(found.hamiltonian, (PX**2 + PZ**2) / (2 * sympy.Symbol("m")) + v * PX)


def test_the_oscillator_s_flow_is_canonical() -> None:
    c, s = sympy.cos(w * t), sympy.sin(w * t)
    flow = canonical_transformation(ONE, {Q: q * c + p / (m * w) * s}, {P: p * c - m * w * q * s})
    assert flow.is_canonical
    assert flow.verdict.proven
    assert flow.matrix.shape == (2, 2)
    assert not canonical_transformation(
        ONE, {Q: q * c + p / (m * w) * s}, {P: p * c - 1.001 * m * w * q * s}
    ).is_canonical
    damped = sympy.exp(-t / 5)
    assert not canonical_transformation(ONE, {Q: damped * q}, {P: damped * p}).is_canonical
    assert canonical_transformation(ONE, {Q: damped * q}, {P: p / damped}).is_canonical


def test_generating_functions_of_the_four_kinds() -> None:
    one = generated_transformation(q * Q, 1, ONE, [Q], [P])
    assert (one.new_coordinates, one.new_momenta) == ((p,), (-q,))
    two = generated_transformation(q * P + t * P**2 / 2 + sympy.sin(q), 2, ONE, [Q], [P])
    assert same(two.new_momenta[0], p - sympy.cos(q))
    assert same(two.new_coordinates[0], q + t * (p - sympy.cos(q)))
    three = generated_transformation(-p * sympy.log(Q), 3, ONE, [Q], [P])
    assert same(three.new_coordinates[0], sympy.exp(q))
    assert same(three.new_momenta[0], p * sympy.exp(-q))
    four = generated_transformation(p * P, 4, ONE, [Q], [P])
    assert (four.new_coordinates, four.new_momenta) == ((p,), (-q,))
    for made in (one, two, three, four):
        assert made.is_canonical, made


def test_the_oscillator_in_action_and_angle() -> None:
    h, mass, stiffness = oscillator()
    rate = sympy.sqrt(stiffness / mass)
    [x] = h.coordinates
    found = generated_transformation(mass * rate * x**2 / 2 / sympy.tan(Q), 1, h, [Q], [P])
    assert found.is_canonical
    assert same(found.hamiltonian, rate * P)


def test_a_generating_function_that_depends_on_time() -> None:
    h, mass, stiffness = oscillator()
    [x], [momentum] = h.coordinates, h.momenta
    found = generated_transformation((x + v * t) * P, 2, h, [Q], [P])
    assert same(found.new_coordinates[0].xreplace({x: q}), q + v * t)
    assert same(found.hamiltonian, P**2 / (2 * mass) + stiffness * (Q - v * t) ** 2 / 2 + v * P)
    assert momentum not in found.hamiltonian.free_symbols


def test_polar_angles_are_told_in_all_quadrants() -> None:
    x, y, px, py = sympy.symbols("x y p_x p_y", real=True)
    R, angle, U, V = sympy.symbols("R alpha U V")
    polar = sympy.sqrt(x**2 + y**2) * U + sympy.atan2(y, x) * V
    found = generated_transformation(polar, 2, ((x, y), (px, py)), [R, angle], [U, V])
    assert float(found.new_coordinates[1].subs({x: -1, y: -1})) == pytest.approx(-0.75 * math.pi, rel=1e-15)
    assert same(found.new_momenta[1], x * py - y * px)


@pytest.mark.parametrize(
    ("new_q", "new_p"),
    [
        (sympy.log(sympy.sin(p) / q), q * sympy.cot(p)),
        (
            sympy.log(1 + sympy.sqrt(q) * sympy.cos(p)),
            2 * (1 + sympy.sqrt(q) * sympy.cos(p)) * sympy.sqrt(q) * sympy.sin(p),
        ),
    ],
)
def test_what_is_found_of_the_way_back_leads_back(new_q: Any, new_p: Any) -> None:
    """Goldstein, chapter 9, exercises: sympy's equations are also met, as it says, where sin p and q are zero."""
    found = canonical_transformation(ONE, {Q: new_q}, {P: new_p})
    assert found.is_canonical
    for place in (
        {Q: sympy.Rational(1, 10), P: sympy.Rational(3, 10)},
        {Q: sympy.Rational(1, 5), P: sympy.Rational(7, 10)},
    ):
        back = {old: one.subs(place).evalf(50) for old, one in found.inverse.items()}
        assert abs(new_q.subs(back).evalf(50) - place[Q]) < 1e-40
        assert abs(new_p.subs(back).evalf(50) - place[P]) < 1e-40


def test_questions_without_an_answer() -> None:
    with pytest.raises(UsageError, match="kind 2 is one of q and P"):
        generated_transformation(q * Q, 2, ONE, [Q], [P])
    with pytest.raises(UsageError, match="undetermined"):
        generated_transformation(q + P, 2, ONE, [Q], [P])
    with pytest.raises(UsageError, match="kind cannot be 5"):
        generated_transformation(q * Q, 5, ONE, [Q], [P])
    with pytest.raises(UsageError, match="new coordinates"):
        canonical_transformation(ONE, {Q: q, P: p}, {})
    h, _, _ = oscillator()
    [x], [momentum] = h.coordinates, h.momenta
    with pytest.raises(UsageError, match="not canonical"):
        _ = canonical_transformation(h, {Q: 2 * x}, {P: momentum}).hamiltonian
    with pytest.raises(UsageError, match="no Hamiltonian"):
        _ = canonical_transformation(ONE, {Q: q}, {P: p}).hamiltonian
    with pytest.raises(UnsupportedError, match="not known"):
        _ = canonical_transformation(h, {Q: x + sympy.sin(x)}, {P: momentum / (1 + sympy.cos(x))}).hamiltonian


# -- scenes in other coordinates --------------------------------------------------------------------------------------


def test_kepler_in_polar_coordinates() -> None:
    scene = SCENES["kepler"]()
    r, phi = sympy.symbols("r phi", positive=True)
    old = {"body.position.x": r * sympy.cos(phi), "body.position.z": r * sympy.sin(phi)}
    found = point_transformation(scene, old, [r, phi])
    mass = equations(scene).symbol("body.mass")
    product = sympy.Mul(*(equations(scene).symbol(f"force.{n}") for n in ("charge_a", "charge_b", "coulomb_constant")))
    pr, pphi = found.momenta
    assert same(found.hamiltonian, pr**2 / (2 * mass) + pphi**2 / (2 * mass * r**2) + product / r)
    assert found.ignorable == (phi,)
    assert same(found.definitions[1], mass * r**2 * found.velocities[1])
    brackets = fundamental_brackets([r, phi], [pr, pphi], ((r, phi), (pr, pphi)))
    assert brackets == sympy.Matrix([[0, 0, 1, 0], [0, 0, 0, 1], [-1, 0, 0, 0], [0, -1, 0, 0]])


@pytest.mark.sample(0)
def test_a_rotating_frame() -> None:
    scene = SCENES["kepler"]()
    X, Z = sympy.symbols("X Z")
    c, s = sympy.cos(w * t), sympy.sin(w * t)
    found = point_transformation(scene, {"body.position.x": X * c - Z * s, "body.position.z": X * s + Z * c}, [X, Z])
    mass = equations(scene).symbol("body.mass")
    product = sympy.Mul(*(equations(scene).symbol(f"force.{n}") for n in ("charge_a", "charge_b", "coulomb_constant")))
    px, pz = found.momenta
    energy = (px**2 + pz**2) / (2 * mass) + product / sympy.sqrt(X**2 + Z**2)
    assert same(found.hamiltonian, energy - w * (X * pz - Z * px))  # H - omega L
    assert not found.hamiltonian.has(t)


def test_centre_of_mass_and_relative_coordinates() -> None:
    scene = SCENES["two-body"]()
    m1, m2 = (equations(scene).symbol(f"body{n}.mass") for n in (1, 2))
    old, new = {}, []
    for axis in "xyz":
        center, apart = sympy.symbols(f"C_{axis} r_{axis}")
        new += [center, apart]
        old[f"body1.position.{axis}"] = center - m2 / (m1 + m2) * apart
        old[f"body2.position.{axis}"] = center + m1 / (m1 + m2) * apart
    found = point_transformation(scene, old, new)
    assert found.ignorable == tuple(new[::2])
    constant = equations(scene).symbol("force.gravitational_constant")
    distance = sympy.sqrt(sum(one**2 for one in new[1::2]))
    kinetic = sum(one**2 for one in found.momenta[::2]) / (2 * (m1 + m2))
    kinetic += sum(one**2 for one in found.momenta[1::2]) * (m1 + m2) / (2 * m1 * m2)
    assert same(found.hamiltonian, kinetic - constant * m1 * m2 / distance)


def test_coordinates_that_are_missing_or_too_few() -> None:
    scene, r = SCENES["kepler"](), sympy.Symbol("r")
    with pytest.raises(UsageError, match=r"leave out body\.position\.z"):
        point_transformation(scene, {"body.position.x": r}, [r, Q])
    with pytest.raises(UsageError, match="do not determine"):
        point_transformation(scene, {"body.position.x": r + Q, "body.position.z": r + Q}, [r, Q])
    with pytest.raises(UsageError, match="no coordinate"):
        point_transformation(scene, {"body.position.y": r, "body.position.z": Q}, [r, Q])


@pytest.mark.parametrize("arc", [sympy.asin, sympy.acos])
def test_the_action_of_the_oscillator_generates_its_action_and_angle(arc: Any) -> None:
    """``F(q, P)``, the integral of sqrt(2 P - q^2), has an arc in it; Q is the angle and P = (p^2 + q^2)/2."""
    sign = 1 if arc is sympy.asin else -1
    root = sympy.sqrt(2 * P - q**2)
    found = generated_transformation(q * root / 2 + sign * P * arc(q / sympy.sqrt(2 * P)), 2, ((q,), (p,)), [Q], [P])
    assert found.is_canonical
    at = {q: sympy.Rational(3, 10), p: sympy.Rational(2, 5)}
    assert abs(float(found.new_momenta[0].subs(at)) - 0.125) < 1e-15
    angle = math.atan2(0.3, 0.4)
    assert abs(float(found.new_coordinates[0].subs(at)) - (angle if sign == 1 else angle - math.pi / 2.0)) < 1e-14


@pytest.mark.sample(0)
def test_a_generating_function_may_be_an_integral() -> None:
    x = sympy.Symbol("x")
    found = generated_transformation(sympy.Integral(sympy.sqrt(2 * P - x**2), (x, 0, q)), 2, ((q,), (p,)), [Q], [P])
    assert found.is_canonical
    assert sympy.expand(found.new_momenta[0] - (p**2 + q**2) / 2) == 0
    at = {q: sympy.Rational(3, 10), p: sympy.Rational(2, 5)}
    assert abs(float(found.new_coordinates[0].subs(at).evalf()) - math.atan2(0.3, 0.4)) < 1e-12
