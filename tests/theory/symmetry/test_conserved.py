"""What scenes conserve, against what textbooks say, proven on the graph or checked; and what they do not."""

import json

import numpy as np
import pytest
import sympy
from click.testing import CliRunner

from atwood import Scene, Symmetry, UsageError, conserved, equations
from atwood.cli import main
from atwood.theory.symmetry.conserved import Conserved
from atwood_library import Charge, Damper, Ground, PairPotential, PointMass, Rod, Spring
from atwood_library.scenes import SCENES

t = sympy.Symbol("t")


def same(found: object, expected: sympy.Expr) -> bool:
    """Return whether two expressions are equal, by their values at random places."""
    difference = sympy.sympify(found) - expected
    atoms = sorted(difference.atoms(sympy.Derivative), key=str)
    atoms += sorted(difference.atoms(sympy.core.function.AppliedUndef), key=str)
    random = np.random.default_rng(3)
    for _ in range(4):
        numbers = difference
        for one in atoms:
            numbers = numbers.xreplace({one: sympy.Float(random.uniform(0.3, 1.2))})
        numbers = numbers.xreplace({one: sympy.Float(random.uniform(0.3, 1.2)) for one in numbers.free_symbols})
        if abs(float(numbers)) > 1e-12:
            return False
    return True


def letters(scene: Scene, *paths: str) -> list[sympy.Expr]:
    found = equations(scene)
    return [found.symbol(path) for path in paths]


def test_pendulum_on_a_cart() -> None:
    scene = SCENES["pendulum-on-cart"]()
    found = conserved(scene)
    x, theta, big, m, l, g = letters(
        scene, "rail.displacement", "rod.angle", "cart.mass", "bob.mass", "rod.length", "gravity"
    )
    momentum = found["p:rail.displacement"]
    assert momentum.kind == "ignorable coordinate"
    assert momentum.proven
    assert "linear momentum along x" in momentum.meaning
    xd, od = x.diff(t), theta.diff(t)
    assert same(momentum.expression, (big + m) * xd + m * l * od * sympy.cos(theta))
    kinetic = big * xd**2 / 2 + m * (xd**2 + 2 * l * xd * od * sympy.cos(theta) + l**2 * od**2) / 2
    assert same(found["h"].expression, kinetic - m * g * l * sympy.cos(theta))
    assert found["h"].proven
    assert "h = T + V" in found["h"].meaning
    assert found.names == ("h", "p:rail.displacement", "K.x")


def test_of_the_driven_hoop_jacobi_s_integral_is_kept_and_the_energy_is_not() -> None:
    scene = SCENES["rotating-hoop-driven"]()
    found = conserved(scene)
    [angle, m, r, w] = letters(scene, "hoop.angle", "bead.mass", "hoop.radius", "clock.slope")
    [g] = letters(scene, "gravity")
    jacobi = m * r**2 * (angle.diff(t) ** 2 - w**2 * sympy.sin(angle) ** 2) / 2 + m * g * r * sympy.cos(angle)
    assert found.names == ("h",)
    assert same(found["h"].expression, jacobi)
    assert "not T + V" in found["h"].meaning
    assert "T + V is not conserved" in found["h"].meaning
    assert conserved(SCENES["rotating-hoop-free"]()).names == ("h", "p:axle.angle")


def axial(changing: bool) -> Scene:
    """Return a charge in an axial magnetic field, which may change with time, in a plane across it."""
    scene = Scene(gravity=0.0)
    charge = scene.add("charge", Charge(charge=0.7))
    body = scene.add("body", PointMass(mass=1.3))
    scene.connect(charge.point, body.point)
    strength = (lambda time: 0.5 + 0.2 * time**2) if changing else (lambda time: 0.5)
    scene.set("charge.vector_potential", lambda x, y, z, t: (strength(t) * z, 0.0, -strength(t) * x))
    scene.start.update({"body.position.x": 1.0, "body.position.z": 0.2, "body.velocity.x": 0.1, "body.velocity.z": 0.9})
    return scene


@pytest.mark.parametrize("changing", [False, True])
def test_a_charge_in_an_axial_field_keeps_its_canonical_angular_momentum(changing: bool) -> None:
    scene = axial(changing)
    found = conserved(scene)
    x, z, m, e = letters(scene, "body.position.x", "body.position.z", "body.mass", "charge.charge")
    field = sympy.Rational(1, 2) + (t**2 / 5 if changing else 0)
    px, pz = m * x.diff(t) + e * field * z, m * z.diff(t) - e * field * x
    assert found["L"].proven
    assert same(found["L"].expression, x * pz - z * px)
    assert ("h" in found) is not changing
    assert not any(name.startswith(("P", "K")) for name in found.names)


@pytest.mark.parametrize(("gauge", "kept"), [("x", "particle.position.x"), ("symmetric", None)])
def test_canonical_momentum_depends_on_the_gauge(gauge: str, kept: str | None) -> None:
    scene = SCENES["charged-particle"](gauge=gauge)
    found = conserved(scene)
    assert [one.name for one in found] == ["h", *([f"p:{kept}", "C"] if kept else ["C", "C_2"])]
    if kept:
        x, z, m, e = letters(scene, kept, "particle.position.z", "particle.mass", "source.charge")
        [b] = letters(scene, "source.vector_potential.magnetic")
        assert same(found[f"p:{kept}"].expression, m * x.diff(t) + e * b * z)


def test_two_bodies_keep_all_ten() -> None:
    scene = SCENES["two-body"]()
    found = conserved(scene)
    assert found.names == ("h", "P.x", "K.x", "P.y", "K.y", "P.z", "K.z", "L.x", "L.y", "L.z")
    assert all(one.proven for one in found)
    assert "e-" not in str(found).replace("one-", "")
    m1, m2, x1, x2 = letters(scene, "body1.mass", "body2.mass", "body1.position.x", "body2.position.x")
    y1, y2 = letters(scene, "body1.position.y", "body2.position.y")
    px = m1 * x1.diff(t) + m2 * x2.diff(t)
    assert same(found["P.x"].expression, px)
    assert same(found["K.x"].expression, m1 * x1 + m2 * x2 - t * px)
    about = sum(m * (x * y.diff(t) - y * x.diff(t)) for m, x, y in ((m1, x1, y1), (m2, x2, y2)))
    assert same(found["L.z"].expression, about)


@pytest.mark.parametrize("orientation", ["quaternion", "euler-zxz"])
def test_lagrange_s_top(orientation: str) -> None:
    scene = SCENES["lagrange-top"]()
    found = conserved(scene, orientation=orientation)
    assert len(found) == 3
    assert all(one.proven for one in found)
    assert "e-" not in str(found).replace("one-", "")
    if orientation == "quaternion":
        assert found.names == ("h", "spin:top.z", "L.z")
        assert found["spin:top.z"].direction == (0.0, 0.0, 1.0)
        return
    eq = equations(scene, orientation=orientation)
    phi, theta, psi, m, h = (
        eq.symbol(f"top.{one}") for one in ("euler.phi", "euler.theta", "euler.psi", "mass", "center.z")
    )
    one, three = eq.symbol("top.moments.x") + m * h**2, eq.symbol("top.moments.z")
    spin = three * (psi.diff(t) + phi.diff(t) * sympy.cos(theta))
    assert same(found["p:top.euler.psi"].expression, spin)
    rest = one * sympy.sin(theta) ** 2 * phi.diff(t)
    assert same(found["p:top.euler.phi"].expression, rest + spin * sympy.cos(theta))


# -- in any direction -------------------------------------------------------------------------------------------------


def rotation(seed: int) -> np.ndarray:
    found, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return found * np.sign(np.linalg.det(found))


def hanging(turn: np.ndarray, shift: np.ndarray) -> Scene:
    """Return a spherical pendulum and a mass on a spring from one pivot, turned and moved as a whole."""
    scene = Scene(space="space", gravity_direction=tuple(turn @ [0.0, 0.0, -1.0]))
    ground = scene.add("ground", Ground(position=tuple(shift)))
    rod, bob = scene.add("rod", Rod(length=1.0)), scene.add("bob", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=20.0, natural_length=0.5))
    other = scene.add("other", PointMass(mass=0.5))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(bob.point, spring.a)
    scene.connect(spring.b, other.point)
    for name, place in (("bob", (0.6, 0.0, -0.8)), ("other", (0.9, 0.2, -1.1))):
        for axis, value in zip("xyz", shift + turn @ place, strict=True):
            where = scene.guess if name == "bob" else scene.start
            where[f"{name}.position.{axis}"] = float(value)
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_scene_turned_in_space_keeps_what_it_kept(seed: int) -> None:
    shift = np.array([0.3, -0.2, 0.5])
    straight, turned = (conserved(hanging(turn, shift)) for turn in (np.eye(3), rotation(seed)))
    assert straight.names == ("h", "L.z")
    assert straight["L.z"].point == pytest.approx((0.3, -0.2, 0.0), abs=1e-9)
    assert [one.kind for one in turned] == [one.kind for one in straight]
    axis, up = np.array(turned[1].direction), rotation(seed) @ [0.0, 0.0, 1.0]
    assert np.abs(axis @ up) == pytest.approx(1.0, abs=1e-9)
    away = np.array(turned[1].point) - shift
    assert np.cross(away, axis) == pytest.approx(np.zeros(3), abs=1e-8)  # the axis goes through the pivot


@pytest.mark.parametrize("seed", [1, 2])
def test_what_falls_keeps_its_momentum_across(seed: int) -> None:
    down = rotation(seed) @ [0.0, 0.0, -1.0]
    scene = Scene(space="space", gravity_direction=tuple(down))
    one = scene.add("one", PointMass(mass=1.0))
    two = scene.add("two", PointMass(mass=2.0))
    force = scene.add("force", PairPotential(gravitational_constant=1.0))
    scene.connect(force.a, one.point)
    scene.connect(force.b, two.point)
    scene.start["two.position.x"] = 1.0
    found = conserved(scene)
    across = np.array([one.direction for one in found if one.kind == "linear momentum"])
    assert across.shape == (2, 3)
    assert across @ down == pytest.approx(np.zeros(2), abs=1e-9)
    assert sum(one.kind == "boost" for one in found) == 2
    [about] = [one for one in found if one.kind == "angular momentum"]
    assert abs(np.dot(about.direction, down)) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.sample(2)
@pytest.mark.parametrize("away", [100.0, 1e4, -3e6])
def test_far_from_the_origin_nothing_else_is_conserved(away: float) -> None:
    shift = np.array([away, 0.5 * away, 3.0])
    found = conserved(hanging(np.eye(3), shift))
    assert found.names == ("h", "L.z")
    assert found["L.z"].point == pytest.approx((away, 0.5 * away, 0.0), rel=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("size", "mass", "constant"), [(1e-9, 1e-26, 1.0), (1e11, 1e30, 6.67e-11)])
def test_atoms_and_planets(size: float, mass: float, constant: float) -> None:
    scene = SCENES["two-body"](mass1=2.0 * mass, mass2=mass, constant=constant, semi_major_axis=size)
    assert conserved(scene).names == ("h", "P.x", "K.x", "P.y", "K.y", "P.z", "K.z", "L.x", "L.y", "L.z")


# -- what is not conserved --------------------------------------------------------------------------------------------


def test_what_is_damped_or_pushed_later_is_not_conserved() -> None:
    scene = SCENES["two-body"]()
    damper = scene.add("damper", Damper(damping=0.2))
    scene.connect(damper.a, scene.body1.point)
    scene.connect(damper.b, scene.body2.point)
    found = conserved(scene)
    assert "h" not in found
    assert {"P.x", "K.z", "L.y"} <= set(found.names)
    assert any("neither the energy function" in note for note in found.notes)
    from atwood_library import Force, Pulse

    pushed = SCENES["two-body"]()
    source = pushed.add("source", Pulse(amplitude=1.0, width=1e-3, start_time=3.0))
    force = pushed.add("push", Force(direction="x"))
    pushed.connect(source.output("value"), force.input("value"))
    pushed.connect(force.point, pushed.body1.point)
    assert {"P.x", "K.x", "h", "L.z"}.isdisjoint(conserved(pushed).names)
    assert {"P.y", "P.z", "K.y"} <= set(conserved(pushed).names)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["four-bar", "rolling-ball", "chaplygin-sleigh", "slider-crank"])
def test_loops_and_rolling_keep_their_energy(name: str) -> None:
    found = conserved(SCENES[name]())
    assert "h" in found
    assert all(one.evidence for one in found)


def test_large_scenes_are_checked_which_is_said() -> None:
    found = conserved(SCENES["chain"](links=30))
    assert found.names == ("h",)
    assert not found["h"].proven
    assert "too large" in found["h"].evidence
    assert "random states" in found["h"].evidence


# -- symmetries that are stated ---------------------------------------------------------------------------------------


def lenz(scene: Scene, factor: float = 1.0) -> list[Symmetry]:
    """Return the symmetries of the Laplace-Runge-Lenz vector in the plane, ``A = p x L - m k r/r``."""
    x, z, m = letters(scene, "body.position.x", "body.position.z", "body.mass")
    one, two = letters(scene, "force.charge_a", "force.charge_b")
    k = -one * two * letters(scene, "force.coulomb_constant")[0]
    place, v = [x, z], [x.diff(t), z.diff(t)]
    r = sympy.sqrt(x**2 + z**2)
    dot, square = x * v[0] + z * v[1], v[0] ** 2 + v[1] ** 2
    found = []
    for s in range(2):
        moved = [m * (2 * v[i] * place[s] - place[i] * v[s] - (dot if i == s else 0)) for i in range(2)]
        f = m**2 * (square * place[s] - dot * v[s]) + m * k * place[s] / r
        paths = ("body.position.x", "body.position.z")
        generator = {path: factor * one for path, one in zip(paths, moved, strict=True)}
        found.append(Symmetry(generator, factor * f, name=f"A.{'xz'[s]}"))
    return found


@pytest.mark.parametrize("factor", [1, sympy.Rational(1, 2)])
def test_the_laplace_runge_lenz_vector(factor: sympy.Expr) -> None:
    scene = SCENES["kepler"](mass=1.4, strength=0.8)
    found = conserved(scene, lenz(scene, factor))
    x, z, m = letters(scene, "body.position.x", "body.position.z", "body.mass")
    one, two, three = letters(scene, "force.charge_a", "force.charge_b", "force.coulomb_constant")
    k, r = -one * two * three, sympy.sqrt(x**2 + z**2)
    about = m * (x * z.diff(t) - z * x.diff(t))
    # p x L with L across the plane: (p_z L, -p_x L) for L counter-clockwise
    vector = m * z.diff(t) * about - m * k * x / r, -m * x.diff(t) * about - m * k * z / r
    for name, expected in zip(("A.x", "A.z"), vector, strict=True):
        assert found[name].proven
        assert same(found[name].expression, factor * expected)  # with half the generator, half the vector


def test_a_symmetry_that_is_none_says_where_it_fails() -> None:
    scene = SCENES["kepler"]()
    with pytest.raises(UsageError, match=r"no symmetry.*body\.position\.x = "):
        conserved(scene, [Symmetry({"body.position.x": 1.0})])
    wrong = lenz(scene)[0]
    with pytest.raises(UsageError, match="no symmetry"):
        conserved(scene, [Symmetry(wrong.generator, 0.9 * wrong.f)])
    with pytest.raises(UsageError, match="no coordinate"):
        conserved(scene, [Symmetry({"body.position.y": 1.0})])
    with pytest.raises(UsageError, match="no symbol of the scene"):
        conserved(scene, [Symmetry({"body.position.x": sympy.Symbol("lambda_9")})])


def test_what_falls_in_a_uniform_field_has_a_momentum_with_f() -> None:
    scene = Scene()
    scene.add("ball", PointMass(mass=2.0))
    m, g = letters(scene, "ball.mass", "gravity")
    found = conserved(scene, [Symmetry({"ball.position.z": 1}, -m * g * t, name="lifted")])
    [z] = letters(scene, "ball.position.z")
    assert found["lifted"].proven
    assert same(found["lifted"].expression, m * z.diff(t) + m * g * t)


# -- how it is shown --------------------------------------------------------------------------------------------------


def test_on_the_command_line() -> None:
    outcome = CliRunner().invoke(main, ["conserved", "pendulum-on-cart", "--json"])
    assert outcome.exit_code == 0, outcome.output
    found = json.loads(outcome.output)
    assert [one["name"] for one in found["conserved"]] == ["h", "p:rail.displacement", "K.x"]
    assert all(one["proven"] for one in found["conserved"])
    shown = CliRunner().invoke(main, ["conserved", "lagrange-top", "--orientation", "euler-zxz"]).output
    assert "p:top.euler.phi" in shown
    assert "ψ̇" in shown


def test_items_are_found_by_name_and_number() -> None:
    found = conserved(SCENES["kepler"]())
    assert isinstance(found, Conserved)
    assert found[0] is found["h"]
    assert "L" in found
    assert found["L"].latex().count(r"\dot") == 2
    with pytest.raises(UsageError, match=r"Conserved are h, L"):
        _ = found["nothing"]


def test_without_weight_nothing_is_rounding() -> None:
    """Accelerations that are zero but for rounding say nothing of the energy, nor of an axis beside the pivot."""
    found = conserved(SCENES["simple-pendulum"](gravity=0.0))
    assert {one.name for one in found} == {"h", "p:rod.angle"}
    assert all(one.proven for one in found)
    assert "e-" not in str(found).replace("one-", "")
