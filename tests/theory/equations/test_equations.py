"""The equations of scenes against those that a person writes by hand, equal after exact simplification."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import sympy
from sympy import Function, Rational, Symbol, cos, sin
from tests.helpers.lagrangians import LagrangianPoint
from tests.helpers.runs import prepare

from atwood import (
    Component,
    Point,
    Scalar,
    Scene,
    UnsupportedError,
    UsageError,
    assemble,
    connector,
    constraint,
    dot,
    equations,
    parameter,
    potential,
)
from atwood.theory.equations.equations import EquationsOfMotion
from atwood_library import (
    CentralGravity,
    Damper,
    Force,
    Ground,
    Pivot,
    PointMass,
    PointOnCircle,
    Ramp,
    RigidBody,
    RotaryDrive,
    Spring,
)

from ...helpers.smooth import SMOOTH as SCENES

t = Symbol("t")


def of_time(*names: str) -> list[Any]:
    return [Function(name)(t) for name in names]


def same(mine: Any, expected: Any) -> bool:
    """Return whether two expressions are equal, by exact rewriting: without angles' sums and squares of sines."""
    difference = sympy.expand(sympy.sympify(mine - expected).doit(), trig=True)
    difference = difference.replace(
        lambda one: one.is_Pow and one.base.func is sin and one.exp.is_Integer and one.exp > 1,
        lambda one: (1 - cos(one.base.args[0]) ** 2) ** (one.exp // 2) * one.base ** (one.exp % 2),
    )
    if sympy.expand(difference) == 0:
        return True
    return bool(sympy.expand(sympy.numer(sympy.together(sympy.powdenest(difference)))) == 0)


def lagrange(L: Any, coordinates: list[Any], R: Any = 0) -> list[Any]:
    """Return ``d/dt dL/dq' - dL/dq + dR/dq'``."""
    rates = [q.diff(t) for q in coordinates]
    return [
        (L.diff(v).diff(t) - L.diff(q) + sympy.sympify(R).diff(v)).doit()
        for q, v in zip(coordinates, rates, strict=True)
    ]


def check(eq: EquationsOfMotion, L: Any, coordinates: list[Any], forces: list[Any] | None = None, R: Any = 0) -> None:
    """Compare a scene with a Lagrangian that was written by hand: L, momenta, mass matrix and equations."""
    assert list(eq.coordinates) == coordinates
    assert same(eq.lagrangian, L)
    rates = [q.diff(t) for q in coordinates]
    for p, v in zip(eq.momenta, rates, strict=True):
        assert same(p, L.diff(v))
    for i, row in enumerate(rates):
        for j, column in enumerate(rates):
            assert same(eq.mass_matrix[i, j], L.diff(row).diff(column))
    forces = forces or [0] * len(coordinates)
    for mine, by_hand, force in zip(eq.rows, lagrange(L, coordinates, R), forces, strict=True):
        assert same(mine, by_hand - force)


def test_pendulum_second_kind() -> None:
    eq = equations(SCENES["simple-pendulum"]())
    (theta,), (m, l, g) = of_time("theta"), sympy.symbols("m l g")
    check(eq, m * l**2 * theta.diff(t) ** 2 / 2 + m * g * l * cos(theta), [theta])
    assert eq.symbol("rod.angle") == theta
    assert eq.values == {l: 1.0, m: 1.0, g: 9.81}


def test_pendulum_first_kind_has_minus_the_tension_as_multiplier() -> None:
    eq = equations(SCENES["simple-pendulum"](), form="dae")
    (x, z, lam), (m, l, g) = of_time("x", "z", "lambda"), sympy.symbols("m l g")
    assert same(eq.constraints[0], (x**2 + z**2) / (2 * l) - l / 2)
    # m r'' = m g + G^T lambda, and a rod under tension T pulls with -T r/l: lambda = -T
    assert same(eq.rows[0], m * x.diff(t, 2) - lam * x / l)
    assert same(eq.rows[1], m * z.diff(t, 2) + m * g - lam * z / l)
    assert eq.multipliers == (lam,)
    assert "rod.tension` is $-\\lambda$" in eq.markdown()


class Leash(Component):
    """A massless rod with the constraint that a textbook writes."""

    length: float = parameter(1.0, unit="m", above=0.0, doc="Length.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @constraint(reaction="pull", unit="N/m", doc="Multiplier.")
    def fixed(self) -> Scalar:
        """Return ``r^2 - l^2``."""
        r = self.b.position - self.a.position
        return dot(r, r) - self.length * self.length


def test_with_a_constraint_of_ones_own_the_multiplier_is_less_by_twice_the_length() -> None:
    scene = Scene()
    ground, leash, bob = (
        scene.add("ground", Ground()),
        scene.add("leash", Leash(length=0.8)),
        scene.add("bob", PointMass()),
    )
    scene.connect(ground.frame, leash.a)
    scene.connect(leash.b, bob.point)
    eq = equations(scene, form="dae")
    (x, z, lam), (m, l, g) = of_time("x", "z", "lambda"), sympy.symbols("m l g")
    assert same(eq.constraints[0], x**2 + z**2 - l**2)
    # -T r/l = 2 lambda r: lambda = -T/(2 l)
    assert same(eq.rows[0], m * x.diff(t, 2) - 2 * lam * x)
    assert same(eq.rows[1], m * z.diff(t, 2) + m * g - 2 * lam * z)


def test_pendulum_on_a_cart() -> None:
    eq = equations(SCENES["pendulum-on-cart"]())
    (x, theta), (M, m, l, g) = of_time("x", "theta"), sympy.symbols("m_cart m_bob l g")
    v, w = x.diff(t), theta.diff(t)
    L = (M + m) * v**2 / 2 + m * l * v * w * cos(theta) + m * l**2 * w**2 / 2 + m * g * l * cos(theta)
    check(eq, L, [x, theta])


def test_double_pendulum() -> None:
    eq = equations(SCENES["double-pendulum"]())
    a, b = of_time("theta_1", "theta_2")
    m1, m2, l1, l2, g = sympy.symbols("m_1 m_2 l_1 l_2 g")
    v, w = a.diff(t), b.diff(t)
    T = (m1 + m2) * l1**2 * v**2 / 2 + m2 * l2**2 * w**2 / 2 + m2 * l1 * l2 * v * w * cos(a - b)
    check(eq, T + (m1 + m2) * g * l1 * cos(a) + m2 * g * l2 * cos(b), [a, b])
    assert "cos(θ₁ - θ₂)" in eq.text()  # Landau and Lifshitz, section 5, problem 1


def test_double_atwood() -> None:
    eq = equations(SCENES["double-atwood"]())
    assert len(eq.coordinates) == 2
    z1, z2 = eq.coordinates
    m1, m2, m3, g = sympy.symbols("m_1 m_2 m_3 g")
    l1, l2 = eq.symbol("rope1.length"), eq.symbol("rope2.length")
    pulley = -l1 - z1  # lengths run down from pulleys: z1 + zp = -l1, z2 + z3 - 2 zp = -l2
    z3 = 2 * pulley - l2 - z2
    heights = [(m1, z1), (m2, z2), (m3, z3)]
    L = sum(m * z.diff(t) ** 2 / 2 - m * g * z for m, z in heights)
    assert same(sympy.expand(eq.lagrangian - L), 0)
    for mine, by_hand in zip(eq.rows, lagrange(L, [z1, z2]), strict=True):
        assert same(mine, by_hand)


def test_coupled_springs() -> None:
    eq = equations(SCENES["mass-spring-chain"]())
    x1, x2 = of_time("x_1", "x_2")
    m1, m2, k1, k2, k3, a1, a2, a3, wall = sympy.symbols("m_1 m_2 k_1 k_2 k_3 l_0_1 l_0_2 l_0_3 x_right")
    V = k1 * (x1 - a1) ** 2 / 2 + k2 * (x2 - x1 - a2) ** 2 / 2 + k3 * (wall - x2 - a3) ** 2 / 2
    check(eq, m1 * x1.diff(t) ** 2 / 2 + m2 * x2.diff(t) ** 2 / 2 - V, [x1, x2])
    assert "V = ½ k₁ (x₁ - l₀₁)² + ½ k₂ (x₂ - x₁ - l₀₂)² + ½ k₃ (x_right - x₂ - l₀₃)²" in eq.text()


def test_charged_particle() -> None:
    scene = Scene(space="space", gravity=0.0)
    scene.add("charge", LagrangianPoint(mass=2.0, gravity=0.0, charge=0.5, field=8.0))
    eq = equations(scene)
    (x, y, z), (m, e, B) = of_time("x", "y", "z"), sympy.symbols("m e B")
    v = [q.diff(t) for q in (x, y, z)]
    A = [B * z / 2, 0, -B * x / 2]  # B x r / 2 with B along y
    L = m * sum(one**2 for one in v) / 2 + e * sum(a * one for a, one in zip(A, v, strict=True))
    check(eq, L, [x, y, z])
    assert same(eq.momenta[0], m * v[0] + e * A[0])  # p = m v + e A
    assert same(eq.kinetic_energy, m * sum(one**2 for one in v) / 2)
    assert "L₁ = " in eq.text()


def test_two_bodies() -> None:
    scene = Scene(space="plane", gravity=0.0)
    sun, planet = scene.add("sun", PointMass(mass=3.0)), scene.add("planet", PointMass(mass=0.5))
    pull = scene.add("pull", CentralGravity(gravitational_parameter=3.0))
    scene.connect(sun.point, pull.source)
    scene.connect(planet.point, pull.point)
    eq = equations(scene)
    coordinates = list(eq.coordinates)
    x1, z1, x2, z2 = (eq.symbol(f"{body}.position.{axis}") for body in ("sun", "planet") for axis in "xz")
    m1, m2, mu = eq.symbol("sun.mass"), eq.symbol("planet.mass"), eq.symbol("pull.gravitational_parameter")
    r = sympy.sqrt((x2 - x1) ** 2 + (z2 - z1) ** 2)
    T = m1 * (x1.diff(t) ** 2 + z1.diff(t) ** 2) / 2 + m2 * (x2.diff(t) ** 2 + z2.diff(t) ** 2) / 2
    check(eq, T + mu * m2 / r, coordinates)


def hoop(driven: bool) -> Scene:
    """A bead on a hoop that turns about the vertical, as told or freely."""
    scene = Scene(space="space")
    ground, bead = scene.add("ground", Ground()), scene.add("bead", PointMass(mass=0.3))
    ring = scene.add("ring", PointOnCircle(axis=(0.0, 1.0, 0.0), radius=0.4))
    if driven:
        axle, clock = scene.add("axle", RotaryDrive(axis=(0.0, 0.0, 1.0))), scene.add("clock", Ramp(slope=6.0))
        scene.connect(clock.output("value"), axle.input("rotation"))
    else:
        axle = scene.add("axle", Pivot(axis=(0.0, 0.0, 1.0)))
        body = scene.add("body", RigidBody(mass=1.0, moments=(0.05, 0.05, 0.08)))
        scene.connect(axle.b, body.frame)
    scene.connect(ground.frame, axle.a)
    scene.connect(axle.b, ring.a)
    scene.connect(ring.b, bead.point)
    return scene


def test_driven_hoop() -> None:
    eq = equations(hoop(True))
    (theta,) = eq.coordinates
    m, r, g, W = (eq.symbol(path) for path in ("bead.mass", "ring.radius", "gravity", "clock.slope"))
    # the circle's angle is from one of its normals: the bead's height tells from which, and which way round
    height = sympy.simplify(eq.potential_energy / (m * g * r))
    assert height in (sin(theta), -sin(theta), cos(theta), -cos(theta))
    across = 1 - height**2
    L = m * r**2 * (theta.diff(t) ** 2 + W**2 * across) / 2 - m * g * r * height
    check(eq, L, [theta])


def test_free_hoop() -> None:
    eq = equations(hoop(False))
    phi, theta = eq.symbol("axle.angle"), eq.symbol("ring.angle")
    m, r, g, I = (eq.symbol(path) for path in ("bead.mass", "ring.radius", "gravity", "body.moments.z"))
    height = sympy.simplify((eq.potential_energy).subs({eq.symbol("body.mass"): 0}) / (m * g * r))
    assert height in (sin(theta), -sin(theta), cos(theta), -cos(theta))
    L = m * r**2 * (theta.diff(t) ** 2 + phi.diff(t) ** 2 * (1 - height**2)) / 2 + I * phi.diff(t) ** 2 / 2
    check(eq, L - m * g * r * height, [phi, theta])


def test_hoops_of_the_library() -> None:
    m, r, a, g, W = sympy.symbols("m r a g omega")
    (theta,) = of_time("theta")
    L = m * a**2 * (theta.diff(t) ** 2 + W**2 * sin(theta) ** 2) / 2 - m * g * a * cos(theta)
    check(equations(SCENES["rotating-hoop-driven"]()), L, [theta])
    free = equations(SCENES["rotating-hoop-free"]())
    phi, theta = free.symbol("axle.angle"), free.symbol("hoop.angle")
    L = m * r**2 * (theta.diff(t) ** 2 + phi.diff(t) ** 2 * sin(theta) ** 2) / 2 - m * g * r * cos(theta)
    check(free, L, [phi, theta])


def test_kepler_and_two_bodies_of_the_library() -> None:
    eq = equations(SCENES["two-body"]())
    m1, m2, G = sympy.symbols("m_1 m_2 G")
    bodies = [of_time(*(f"{axis}_{i}" for axis in "xyz")) for i in (1, 2)]
    r = sympy.sqrt(sum((b - a) ** 2 for a, b in zip(*bodies, strict=True)))
    T = sum(m * sum(q.diff(t) ** 2 for q in body) / 2 for m, body in zip((m1, m2), bodies, strict=True))
    assert same(eq.lagrangian, T + G * m1 * m2 / r)
    for mine, by_hand in zip(eq.rows, lagrange(T + G * m1 * m2 / r, [*bodies[0], *bodies[1]]), strict=True):
        assert same(mine, by_hand)
    (x, z), (m, k, a, b) = of_time("x", "z"), sympy.symbols("m k_e e_a e_b")
    charges = equations(SCENES["kepler"]())
    distance = sympy.sqrt(x**2 + z**2)
    assert same(charges.lagrangian, m * (x.diff(t) ** 2 + z.diff(t) ** 2) / 2 - k * a * b / distance)
    assert "k_{e}" in charges.markdown()
    assert "gravitational_constant" not in charges.markdown()  # nothing depends on it


def test_spherical_pendulum() -> None:
    eq = equations(SCENES["spherical-pendulum"]())
    (x, y, z, lam), (m, l, g) = of_time("x", "y", "z", "lambda"), sympy.symbols("m l g")
    assert same(eq.lagrangian, m * (x.diff(t) ** 2 + y.diff(t) ** 2 + z.diff(t) ** 2) / 2 - m * g * z)
    assert same(eq.constraints[0], (x**2 + y**2 + z**2 - l**2) / (2 * l))
    for row, q, weight in zip(eq.rows, (x, y, z), (0, 0, m * g), strict=True):
        assert same(row, m * q.diff(t, 2) + weight - lam * q / l)
    assert eq.constraint_jacobian == sympy.Matrix([[x / l, y / l, z / l]])


def test_spherical_pendulum_in_two_angles() -> None:
    scene = Scene(space="space")
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=0.7))
    azimuth, ring = scene.add("azimuth", Pivot(axis="z")), scene.add("ring", PointOnCircle(axis="y", radius=0.9))
    scene.connect(ground.frame, azimuth.a)
    scene.connect(azimuth.b, ring.a)
    scene.connect(ring.b, bob.point)
    eq = equations(scene)
    phi, theta = eq.symbol("azimuth.angle"), eq.symbol("ring.angle")
    m, l, g = eq.symbol("bob.mass"), eq.symbol("ring.radius"), eq.symbol("gravity")
    height = sympy.simplify(eq.potential_energy / (m * g * l))
    L = m * l**2 * (theta.diff(t) ** 2 + phi.diff(t) ** 2 * (1 - height**2)) / 2 - m * g * l * height
    check(eq, L, [phi, theta])


def test_lagrange_top_in_euler_angles() -> None:
    eq = equations(SCENES["lagrange-top"](), orientation="euler-zxz")
    (phi, theta, psi), (m, I1, I3, g) = of_time("phi", "theta", "psi"), sympy.symbols("m I_1 I_3 g")
    h = eq.symbol("top.center.z")
    A = I1 + m * h**2
    p, n, s = (q.diff(t) for q in (phi, theta, psi))
    # Goldstein, equation 5.52
    L = A * (n**2 + p**2 * sin(theta) ** 2) / 2 + I3 * (s + p * cos(theta)) ** 2 / 2 - m * g * h * cos(theta)
    check(eq, L, [phi, theta, psi])
    assert eq.symbol("top.moments.y") == I1  # equal moments have one symbol
    assert "½ I₃ (φ̇ cos θ + ψ̇)²" in eq.text()


def test_eulers_equations() -> None:
    eq = equations(SCENES["free-body"]())
    I1, I2, I3 = sympy.symbols("I_1 I_2 I_3")
    wx, wy, wz = of_time("omega_x", "omega_y", "omega_z")
    for row, by_hand in zip(
        eq.rows[3:],
        (
            I1 * wx.diff(t) - (I2 - I3) * wy * wz,
            I2 * wy.diff(t) - (I3 - I1) * wz * wx,
            I3 * wz.diff(t) - (I1 - I2) * wx * wy,
        ),  # Goldstein, equation 5.39
        strict=True,
    ):
        assert same(row, by_hand)
    assert same(eq.kinetic_energy, (I1 * wx**2 + I2 * wy**2 + I3 * wz**2 + translation(eq)) / 2)
    e = eq.coordinates[3:]
    assert same(eq.rates[3], -(e[1] * wx + e[2] * wy + e[3] * wz) / 2)


def translation(eq: EquationsOfMotion) -> Any:
    return eq.symbol("body.mass") * sum(q.diff(t) ** 2 for q in eq.coordinates[:3])


def test_heavy_top_about_its_tip_in_axes_of_the_body() -> None:
    # With quaternions of size one, products of axes are reduced: no quaternion is left in the inertia about the tip.
    eq = equations(SCENES["lagrange-top"]())
    m, I1, I3 = sympy.symbols("m I_1 I_3")
    h, (wx, wy, wz) = eq.symbol("top.center.z"), of_time("omega_x", "omega_y", "omega_z")
    assert same(eq.kinetic_energy, (I1 + m * h**2) * (wx**2 + wy**2) / 2 + I3 * wz**2 / 2)
    assert eq.mass_matrix == sympy.diag(I1 + m * h**2, I1 + m * h**2, I3)


def test_a_loop_keeps_its_constraints_and_multipliers() -> None:
    eq = equations(SCENES["four-bar"]())
    a, c, b = (eq.symbol(f"{link}.angle") for link in ("crank", "rocker", "coupler"))
    l = {name: eq.symbol(f"{name}.length") for name in ("crank", "coupler", "rocker")}
    d = eq.symbol("right.position.x")
    closing = [
        d + l["rocker"] * cos(c) - l["crank"] * cos(a) - l["coupler"] * cos(b),
        l["rocker"] * sin(c) - l["crank"] * sin(a) - l["coupler"] * sin(b),
    ]
    for mine, by_hand in zip(eq.constraints, closing, strict=True):
        assert same(mine, by_hand)
    jacobian = sympy.Matrix(closing).jacobian([a, c, b])
    assert (eq.constraint_jacobian - jacobian).expand() == sympy.zeros(2, 3)
    free = lagrange(eq.lagrangian, [a, c, b])
    pushes = jacobian.T * sympy.Matrix(eq.multipliers)
    for mine, by_hand, push in zip(eq.rows, free, pushes, strict=True):
        assert same(mine, by_hand - push)


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("name", "paths", "given"),
    [
        ("four-bar", ("rocker.angle", "coupler.angle"), "crank.angle"),
        ("slider-crank", ("connecting_rod.angle",), "crank.angle"),
        (
            "four-bar-row",
            ("crank[1].angle", "crank[2].angle", "coupler[0].angle", "coupler[1].angle"),
            "crank[0].angle",
        ),
    ],
)
def test_loops_in_closed_form_on_request(name: str, paths: tuple[str, ...], given: str) -> None:
    eq = equations(SCENES[name]())
    ways = eq.eliminate(*paths)
    assert len(ways) == 2 ** (len(paths) // 2 or 1)
    numbers = {**eq.values, eq.symbol(given): 0.7}
    known = [*numbers]
    for way in ways:
        values = sympy.lambdify(known, [*way.values()], "math", cse=True)(*numbers.values())
        closing = sympy.lambdify([*known, *way], list(eq.constraints), "math")
        assert closing(*numbers.values(), *values) == pytest.approx([0.0] * len(paths), abs=1e-12)
    assert ways[0] != ways[1]
    with pytest.raises(UsageError, match="cannot follow"):
        eq.eliminate()


def test_loops_without_a_closed_form_say_so() -> None:
    eq = equations(SCENES["bricard"]())
    with pytest.raises(UnsupportedError, match="no closed form") as caught:
        eq.eliminate(
            *(one.path for one in eq.legend if one.kind == "coordinate" and one.path != "hinge1.angle"), "hinge1.angle"
        )
    assert "multipliers" in caught.value.advice


def damped() -> Scene:
    scene = Scene()
    bob, ground = scene.add("bob", PointMass(mass=2.0)), scene.add("ground", Ground())
    spring, damper = (
        scene.add("spring", Spring(stiffness=5.0, natural_length=0.4)),
        scene.add("damper", Damper(damping=0.3)),
    )
    push = scene.add("push", Force(value=lambda time: 3.0 * time, direction=(1.0, 0.0, 0.0)))
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, bob.point)
    scene.connect(bob.point, push.point)
    return scene


def test_rayleigh_function_loads_and_the_terms_of_each_part() -> None:
    eq = equations(damped())
    (x, z), (m, k, c, a, g) = of_time("x", "z"), sympy.symbols("m k c l_0 g")
    r = sympy.sqrt(x**2 + z**2)
    stretching = (x * x.diff(t) + z * z.diff(t)) / r
    R = c * stretching**2 / 2
    L = m * (x.diff(t) ** 2 + z.diff(t) ** 2) / 2 - m * g * z - k * (r - a) ** 2 / 2
    assert same(eq.rayleigh_function, R)
    assert eq.generalized_forces == (3 * t, 0)
    check(eq, L, [x, z], [3 * t, 0], R)
    assert "½ k (√(x² + z²) - l₀)²" in eq.text()
    spring, damper, bob = (eq.terms(path) for path in ("spring", "damper", "bob"))
    assert same(spring.potential_energy, k * (r - a) ** 2 / 2)
    assert spring.kinetic_energy == 0
    assert same(damper.rayleigh_function, R)
    assert same(bob.rows[1], m * z.diff(t, 2) + m * g)
    total = [sum(one) for one in zip(*(eq.terms(p).rows for p in ("spring", "damper", "bob", "push")), strict=True)]
    for mine, row in zip(total, eq.rows, strict=True):
        assert same(mine, row)
    with pytest.raises(UsageError, match="no such part") as caught:
        eq.terms("sprung")
    assert "spring" in caught.value.advice


def test_each_term_says_on_hovering_where_it_comes_from() -> None:
    shown = equations(SCENES["double-pendulum"]())._repr_html_()
    assert 'title="bob1, bob2"' in shown
    assert 'title="bob2"' in shown
    rod = equations(SCENES["simple-pendulum"](), form="dae")._repr_html_()
    assert 'title="rod">' in rod


def test_values_in_place_of_symbols() -> None:
    scene = SCENES["pendulum-on-cart"](cart_mass=2.0, bob_mass=1.0, length=0.7)
    eq = equations(scene, parameters="values")
    (theta,) = of_time("theta")
    assert eq.values == {}
    assert eq.rows[1].free_symbols == {t}
    assert same(eq.mass_matrix[0, 0], 3)
    assert float(eq.mass_matrix[1, 1]) == pytest.approx(0.49, rel=1e-15)
    assert "6.867 sin θ" in eq.text()
    assert same(eq.mass_matrix[0, 1].subs(theta, 0), sympy.Float(0.7))


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "form", "orientation"),
    [
        ("double-pendulum", "reduced", "quaternion"),
        ("four-bar", "reduced", "quaternion"),
        ("slider-crank", "dae", "quaternion"),
        ("lagrange-top", "reduced", "euler-zxz"),
        ("heavy-top", "reduced", "quaternion"),
        ("double-pendulum-3d", "reduced", "quaternion"),
        ("rolling-disc", "reduced", "quaternion"),
        ("driven-pendulum", "reduced", "quaternion"),
    ],
)
def test_the_python_that_it_writes_gives_the_same_accelerations(name: str, form: str, orientation: str) -> None:
    assembly = assemble(SCENES[name](), form=form, orientation=orientation)
    names: dict[str, Any] = {}
    exec(compile(equations(assembly).python(), name, "exec"), names)
    prepared = prepare(SCENES[name](), form)
    time, q, u = prepared.time, prepared.q, prepared.u
    if orientation != "quaternion":
        q, u = np.array([0.3, 0.8, -0.4]), np.array([0.5, -0.7, 2.0])
        a = names["accelerations"](time, q, u)
        energy = sympy.lambdify([*equations(assembly).coordinates], 0)  # what is compared is the row itself
        assert energy(*q) == 0
        rows = [row.subs(equations(assembly).values) for row in equations(assembly).rows]
        states = {
            **dict(zip(equations(assembly).accelerations, a, strict=True)),
            **dict(zip(equations(assembly).velocities, u, strict=True)),
            **dict(zip(equations(assembly).coordinates, q, strict=True)),
        }
        assert max(abs(float(row.subs(list(states.items())))) for row in rows) < 1e-12
        return
    found = names["accelerations"](time, q, u)
    mine = found[0] if isinstance(found, tuple) else found
    expected, _ = prepared.plan.balance.accelerate(time, q, u, prepared.plan.kept)
    assert mine == pytest.approx(expected, rel=1e-10, abs=1e-10)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "form"), [(name, form) for name in SCENES for form in ("reduced", "dae")])
def test_every_scene_is_written_down_in_no_time(name: str, form: str) -> None:
    eq = equations(SCENES[name](), form=form)
    page = eq.markdown()
    assert page.startswith(f"# {eq.name}")
    if eq.is_readable:
        assert page.count("\\begin{aligned}") >= 4
        assert len(eq.to_dict()["rows"]) == len(eq.expressions.velocities)
    else:
        assert eq.structure.sentence in page
        assert eq.structure.svg().startswith("<svg")


def test_what_is_too_large_to_read_shows_its_structure() -> None:
    eq = equations(SCENES["chain"](links=40))
    assert not eq.is_readable
    assert eq.structure.pattern.shape == (40, 40)
    assert eq.structure.pattern.all()
    text = eq.text()
    assert "40 coordinates" in text
    assert text.count("█") == 1600
    held = equations(SCENES["chain"](links=40), form="dae")
    assert held.structure.constraints == 40
    assert not held.structure.pattern[80:, 80:].any()
    assert np.count_nonzero(held.structure.pattern[:80, :80]) == 80  # a point mass has a diagonal mass matrix
    assert np.count_nonzero(held.structure.pattern[80:, :80]) == 2 + 39 * 4
    with pytest.raises(UnsupportedError, match="would fill a book"):
        _ = equations(SCENES["chain"](links=400)).rows


@pytest.mark.sample(0)
def test_formulas_that_are_too_long_have_names_for_what_they_share() -> None:
    eq = equations(SCENES["chain"](links=13))
    assert not eq.is_readable
    assert eq.shared
    rows = eq.rows
    assert len(rows) == 13
    by_name = dict(reversed(eq.shared))
    full = rows[12]
    for name, value in reversed(eq.shared):
        full = full.subs(name, value)
    assert not full.free_symbols & set(by_name)
    # the last link: m l (...) with all that hangs above it, at rest and level
    still = dict.fromkeys(eq.accelerations, 0) | dict.fromkeys(eq.velocities, 0)
    m, l, g = eq.symbol("bob[12].mass"), eq.symbol("rod[12].length"), eq.symbol("gravity")
    assert same(full.subs(still), m * g * l * sin(eq.coordinates[12]))


def test_long_formulas_break_into_lines_and_name_their_brackets() -> None:
    page = equations(SCENES["chain"](links=5)).markdown()
    assert "## Abbreviations" in page
    assert "S_{1} &= m_{" in page
    assert max(map(len, page.splitlines())) < 700


def test_parts_with_words_for_names_are_numbered_alike_in_all_letters() -> None:
    eq = equations(SCENES["four-bar"]())
    found = {one.path: one.name for one in eq.legend}
    assert [found[f"{link}.angle"] for link in ("crank", "rocker", "coupler")] == ["theta_1", "theta_2", "theta_3"]
    assert [found[f"{link}.mass"] for link in ("crank", "rocker", "coupler")] == ["m_1", "m_2", "m_3"]
    assert found["coupler.length"] == "l_3"


def test_names_do_not_clash() -> None:
    scene = Scene()
    for name in ("t", "g", "x", "m", "lambda_", "theta_1"):
        scene.add(name, PointMass())
    names = [one.name for one in equations(scene).legend]
    assert len(set(names)) == len(names)
    assert "t" not in names


class Oddly(Component):
    """A point with parameters that are called as much else is."""

    q: float = parameter(2.0, unit="N/m", doc="A stiffness.")
    t: float = parameter(3.0, unit="N", doc="A force.")
    u: float = parameter(0.5, unit="N/m^2", doc="A slope.")
    M: float = parameter(0.7, unit="N", doc="Another force.")
    pi: float = parameter(0.2, unit="N", doc="One more.")
    point: Point = connector(Point, "The point.")

    @potential
    def energy(self) -> Scalar:
        """Return a potential."""
        x, z = self.point.position.x, self.point.position.z
        return self.q * x * x + self.t * x + self.u * x * x * x + (self.M + self.pi) * z


def test_names_that_mean_something_else_are_kept_apart() -> None:
    scene = Scene(gravity=0.0)
    bob, law = scene.add("bob", PointMass()), scene.add("law", Oddly())
    scene.connect(bob.point, law.point)
    eq = equations(scene)
    x, _ = eq.coordinates
    assert same(eq.rows[0].subs(eq.values), x.diff(t, 2) + 4 * x + 3 + 1.5 * x**2)
    assert eq.symbol("law.t") != t
    assert eq.symbol("law.pi") != sympy.pi
    names: dict[str, Any] = {}
    exec(compile(eq.python(), "oddly", "exec"), names)
    assert names["accelerations"](7.0, [0.5, 0.0], [0.0, 0.0]) == pytest.approx([-2.0 - 3.0 - 0.375, -0.9])


def test_sympy_is_not_imported_before_somebody_asks_for_it() -> None:
    code = (
        "import sys, atwood; from atwood_library.scenes import DoublePendulum\n"
        "eq = atwood.equations(DoublePendulum()); eq.markdown(); eq.latex(); eq.text(); eq.python(); eq._repr_html_()\n"
        "assert 'sympy' not in sys.modules\n"
        "eq.rows; assert 'sympy' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_arguments_are_checked() -> None:
    with pytest.raises(UsageError, match="parameters cannot be 'numbers'"):
        equations(SCENES["simple-pendulum"](), parameters="numbers")


def test_fractions_are_exact() -> None:
    # a uniform rod about its end: m l^2/3, not 0.3333
    eq = equations(SCENES["slider-crank"]())
    numbers = {number for row in eq.mass_matrix for number in row.atoms(sympy.Number)}
    assert all(number.is_Rational for number in numbers)
    assert Rational(1, 3) in numbers
