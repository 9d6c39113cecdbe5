"""Integrals of affine and quadratic symmetries, against what books say of them and along runs."""

import unicodedata
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy

from atwood import Scene, Symmetry, UsageError, conserved, equations, simulate
from atwood.functions import cos, sin, sqrt
from atwood.theory.symmetry.conserved import Conserved
from atwood_library import Charge, LorentzForce, PointMass, Potential
from atwood_library.scenes import SCENES

t = sympy.Symbol("t")
AXES = "xyz"


def particle(
    energy: Callable[..., Any] | None = None,
    space: str = "plane",
    gravity: float = 0.0,
    scale: float = 1.0,
    name: str = "body",
) -> Scene:
    scene = Scene(space=space, gravity=gravity)
    scene.add(name, PointMass(mass=1.3))
    if energy is not None:
        field = scene.add("field", Potential())
        scene.connect(field.point, scene[name].point)
        scene.set("field.energy_function", energy)
    for axis, place, speed in zip(AXES, (0.8, -0.4, 0.3), (0.1, 0.4, 0.9), strict=True):
        if space == "space" or axis != "y":
            scene.start[f"{name}.position.{axis}"] = scale * place
            scene.start[f"{name}.velocity.{axis}"] = speed
    return scene


def symbols(scene: Scene, name: str = "body") -> tuple[list[Any], list[Any], Any]:
    """Return coordinates, momenta and the mass."""
    eq = equations(scene)
    m = eq.symbol(f"{name}.mass")
    return list(eq.coordinates), [m * q.diff(t) for q in eq.coordinates], m


def holds(found: Conserved, kind: str, *expected: Any) -> None:
    """Check that these are the integrals of a kind, but for factors, and that a run keeps them."""
    own = [one for one in found if one.kind == kind]
    assert all(one.proven for one in own)
    for value in expected:
        ratios = [sympy.cancel(sympy.together(sympy.nsimplify(one.expression / value, rational=True))) for one in own]
        assert any(ratio.is_Number or not ratio.atoms(sympy.core.function.AppliedUndef) for ratio in ratios), value
    assert len(own) == len(expected)


def kept(scene: Scene, found: Conserved) -> None:
    for form in ("reduced", "dae"):
        run = simulate(scene, t_end=1.0, monitor=found, form=form, rtol=1e-10)
        assert run.conserved is not None
        assert run.conserved.max_drift < 1e-6


def test_falling() -> None:
    scene = particle(gravity=9.81)
    found = conserved(scene)
    (_, _), (_, p_z), m = symbols(scene)
    g = equations(scene).symbol("gravity")
    holds(found, "symmetry in time", p_z + m * g * t)
    kept(scene, found)


def test_a_constant_force_of_a_potential() -> None:
    scene = particle(lambda x, y, z, t: 3.0 * x)
    found = conserved(scene)
    _, (p_x, _), _ = symbols(scene)
    holds(found, "symmetry in time", p_x + 3 * t)


def test_a_travelling_potential_keeps_h_less_v_p() -> None:
    scene = particle(lambda x, y, z, t: cos(2.0 * (x - 3.0 * t)))
    found = conserved(scene)
    (x, _), (p_x, p_z), m = symbols(scene)
    h = (p_x**2 + p_z**2) / (2 * m) + sympy.cos(2 * x - 6 * t)
    assert "h" not in found
    holds(found, "affine symmetry", h - 3 * p_x)
    kept(scene, found)


@pytest.mark.parametrize("name", ["body", "a_moon"])
def test_a_turning_potential_keeps_h_less_omega_l(name: str) -> None:
    def saddle(x: Any, y: Any, z: Any, t: Any) -> Any:
        return 0.5 * (x * cos(2.0 * t) + z * sin(2.0 * t)) ** 2 + x * x + z * z

    scene = particle(saddle, name=name)
    found = conserved(scene)
    (x, z), (p_x, p_z), m = symbols(scene, name)
    v = (x * sympy.cos(2 * t) + z * sympy.sin(2 * t)) ** 2 / 2 + x**2 + z**2
    holds(found, "affine symmetry", (p_x**2 + p_z**2) / (2 * m) + v - 2 * (x * p_z - z * p_x))
    kept(scene, found)


@pytest.mark.parametrize("gauge", ["x", "z", "symmetric"])
def test_pseudo_momenta_whatever_the_gauge(gauge: str) -> None:
    """Of m v' = q (E + v x B): m x' + q B z and m z' - q B x - q E t."""
    scene = SCENES["charged-particle"](gauge=gauge)
    found = conserved(scene)
    eq = equations(scene)
    x, z = eq.coordinates
    m, e = eq.symbol("particle.mass"), eq.symbol("source.charge")
    b, field = (eq.symbol(f"source.{path}") for path in ("vector_potential.magnetic", "scalar_potential.electric_z"))
    first, second = m * x.diff(t) + e * b * z, m * z.diff(t) - e * b * x - e * field * t
    for expected in (first, second):
        assert any(sympy.expand(one.expression - expected) == 0 for one in found)
    kept(scene, found)


@pytest.mark.sample(2)
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e4])
def test_the_monopole_s_three_angular_momenta(scale: float) -> None:
    """J = m r x v - e g r/|r| (Goldstein, chapter 3, exercise)."""
    scene = particle(space="space", scale=scale)
    push = scene.add("push", LorentzForce(charge=0.7))
    scene.connect(push.point, scene.body.point)
    scene.set(
        "push.magnetic_field",
        lambda x, y, z, t: tuple(2.0 * one / sqrt(x * x + y * y + z * z) ** 3 for one in (x, y, z)),
    )
    found = conserved(scene)
    r, p, _ = symbols(scene)
    e = equations(scene).symbol("push.charge")
    size = sympy.sqrt(sum(one**2 for one in r))
    about = sympy.Matrix(r).cross(sympy.Matrix(p))
    holds(found, "affine symmetry", *(about[k] - 2 * e * r[k] / size for k in range(3)))
    if scale == 1.0:
        kept(scene, found)


def test_a_gauge_that_is_no_polynomial() -> None:
    """A uniform field whose vector potential has the gradient of a cubic function added."""
    scene = particle()
    charge = scene.add("charge", Charge(charge=0.7))
    scene.connect(charge.point, scene.body.point)
    scene.set("charge.vector_potential", lambda x, y, z, t: (2.0 * z + 2.0 * x * z, 0.0, x * x))
    found = conserved(scene)
    (x, z), (m_x, m_z), _ = symbols(scene)
    e = equations(scene).symbol("charge.charge")
    every = [sympy.nsimplify(one.expression, rational=True) for one in found]
    for expected in (m_x + 2 * e * z, m_z - 2 * e * x):
        assert any(sympy.expand(one - expected) == 0 for one in every)


def test_the_double_atwood_machine() -> None:
    scene = SCENES["double-atwood"]()
    found = conserved(scene)
    eq = equations(scene)
    one, two = (q.diff(t) for q in eq.coordinates)
    m1, m2, m3 = (eq.symbol(f"m{k}.mass") for k in (1, 2, 3))
    # p1 F2 - p2 F1 with the momenta p and the constant forces F of both coordinates.
    l = eq.lagrangian
    p, f = [l.diff(one), l.diff(two)], [l.diff(q) for q in eq.coordinates]
    [steady] = [one for one in found if one.kind == "affine symmetry"]
    ratio = sympy.cancel(steady.expression / (p[0] * f[1] - p[1] * f[0]))
    assert not ratio.has(one, two)
    assert ratio.free_symbols <= {m1, m2, m3, eq.symbol("gravity")}
    kept(scene, found)


def test_laplace_runge_and_lenz() -> None:
    scene = SCENES["kepler"]()
    found = conserved(scene)
    eq = equations(scene)
    x, z = eq.coordinates
    m = eq.symbol("body.mass")
    k = -eq.symbol("force.charge_a") * eq.symbol("force.charge_b") * eq.symbol("force.coulomb_constant")
    p_x, p_z = m * x.diff(t), m * z.diff(t)
    about, r = x * p_z - z * p_x, sympy.sqrt(x**2 + z**2)
    holds(found, "quadratic in momenta", p_z * about - m * k * x / r, -p_x * about - m * k * z / r)
    kept(scene, found)


def test_the_tensor_of_the_oscillator() -> None:
    scene = particle(lambda x, y, z, t: 1.5 * (x * x + z * z))
    found = conserved(scene)
    (x, z), (p_x, p_z), m = symbols(scene)
    holds(found, "quadratic in momenta", p_x**2 + 3 * m * x**2, p_x * p_z + 3 * m * x * z)
    bent = conserved(particle(lambda x, y, z, t: 1.5 * x * x + 1.6 * z * z + 0.1 * x * z * z))
    assert bent.names == ("h",)


def test_a_force_with_the_inverse_cube_is_dilated_in_time() -> None:
    scene = particle(lambda x, y, z, t: 1.5 / (x * x + z * z))
    found = conserved(scene)
    (x, z), (p_x, p_z), m = symbols(scene)
    h = (p_x**2 + p_z**2) / (2 * m) + sympy.Rational(3, 2) / (x**2 + z**2)
    virial = x * p_x + z * p_z
    holds(found, "symmetry in time", h * t - virial / 2, h * t**2 - virial * t + m * (x**2 + z**2) / 2)
    kept(scene, found)


@pytest.mark.sample(0)
def test_the_spin_of_a_rolling_ball() -> None:
    scene = SCENES["rolling-ball"]()
    found = conserved(scene)
    spin = found["S:ball.z"]
    assert spin.proven
    assert spin.direction == (0.0, 0.0, 1.0)
    run = simulate(scene, t_end=1.0)
    ledger = found.along(run)
    own = ledger["S:ball.z"]
    values = np.array([run[f"ball.angular_velocity.{axis}"] for axis in AXES])
    assert np.ptp(own.values) < 1e-6 * np.max(np.abs(values))


def test_what_is_a_polynomial_in_others_is_left_out() -> None:
    free = conserved(particle())
    assert {one.kind for one in free} == {"energy function", "ignorable coordinate", "boost", "angular momentum"}
    assert conserved(SCENES["double-pendulum"]()).names == ("h",)


def test_a_stated_symmetry_that_is_none_is_refused_with_what_is_left_over() -> None:
    scene = particle(gravity=9.81)
    with pytest.raises(UsageError, match="-m g is left over"):
        conserved(scene, Symmetry({"body.position.z": 1}))
    g, m = equations(scene).symbol("gravity"), equations(scene).symbol("body.mass")
    stated = conserved(scene, Symmetry({"body.position.z": 1}, f=-m * g * t, name="p"))
    assert stated["p"].proven


def around() -> dict[str, Any]:
    x, z = (sympy.Function(name)(t) for name in "xz")
    return {"particle.position.x": -z, "particle.position.z": x}


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("scene", "generator", "left"),
    [
        ("simple-pendulum", {"rod.angle": 1}, "-m g l sin θ"),
        ("kepler", {"body.position.x": 1}, "k_e e_a e_b x / (x² + z²)³ᐟ²"),
        ("charged-particle", around(), "q E_z x"),
        ("pendulum-on-cart", {"rod.angle": 1}, "-m_bob l ẋ θ̇ sin θ - m_bob g l sin θ"),
        ("rotating-hoop-driven", {"hoop.angle": 1}, "m g a sin θ + m ω² a² cos θ sin θ"),
        ("mass-spring-chain", {"m1.displacement": 1, "m2.displacement": 1}, "-k₁ x₁ - k₃ x₂ + k₁ l₀₁ - k₃ l₀₃"),
        ("falling-with-drag", {"ball.position.x": 1}, "-b ẋ + b w_x"),
    ],
)
def test_each_refusal_names_the_term(scene: str, generator: dict[str, Any], left: str) -> None:
    with pytest.raises(UsageError) as refused:
        conserved(SCENES[scene](), Symmetry(generator))
    said, expected = (unicodedata.normalize("NFD", one) for one in (str(refused.value), left))
    assert f"L changes by more than df/dt: {expected}" in said
    assert "is left over" in said
