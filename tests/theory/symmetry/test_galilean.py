"""The Galilei group: what its generators do to T and to L, and that what is left over is the rate of each quantity."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import sympy

import atwood
from atwood import galilean
from atwood_library import Ground, Link, Pivot, PointMass
from atwood_library.scenes import (
    ChargedParticle,
    DoublePendulum,
    FallingWithDrag,
    FreeBody,
    Kepler,
    LagrangeTop,
    MassSpringChain,
    PendulumOnCart,
    SimplePendulum,
    TwoBody,
)

t = sympy.Symbol("t")


def parts(sheet: atwood.FormulaSheet, name: str) -> tuple[sympy.Expr, ...]:
    """Return the quantity, the changes of T and L, the gauge term and what is left over."""
    return tuple(sheet[name])


def hinged() -> atwood.Scene:
    scene = atwood.Scene()
    ground, hinge, link = scene.add("ground", Ground()), scene.add("hinge", Pivot()), scene.add("link", Link(mass=1.2))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, link.a)
    return scene


def falling() -> atwood.Scene:
    scene = atwood.Scene()
    scene.add("body", PointMass(mass=1.3))
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "scene", [Kepler(), ChargedParticle(), SimplePendulum(), PendulumOnCart(), FallingWithDrag(), hinged()]
)
def test_what_is_left_over_is_the_rate(scene: atwood.Scene) -> None:
    """The rate of each quantity less the equations of motion times displacements, identically."""
    sheet, eq = galilean(scene), atwood.equations(scene, form="dae")
    inverse = eq.mass_matrix.inv()
    for name in sheet:
        value, _, _, _, rate = parts(sheet, name)
        along = inverse * sympy.Matrix([value.diff(u) for u in eq.velocities])
        left = value.diff(t) - along.dot(sympy.Matrix(eq.rows)) - rate
        if name == "h":  # along motions that fulfil the constraints
            left -= sum(g.diff(t) * held for g, held in zip(eq.constraints, eq.multipliers, strict=True))
        assert sympy.simplify(sympy.expand(left.doit())) == 0, name


def test_two_bodies_keep_all_ten() -> None:
    sheet, found = galilean(TwoBody()), atwood.conserved(TwoBody())
    assert len(sheet) == 10
    eq = atwood.equations(TwoBody(), form="dae")
    masses = [eq.symbol(f"body{k}.mass") for k in (1, 2)]
    for axis in "xyz":
        first, second = (eq.coordinates["xyz".index(axis) + 3 * k] for k in (0, 1))
        moment = masses[0] * first + masses[1] * second
        value, kinetic, change, gauge, rate = parts(sheet, f"K_{axis}")
        assert sympy.expand(kinetic - moment.diff(t)) == sympy.expand(change - moment.diff(t)) == 0
        assert sympy.expand(gauge - moment) == rate == 0
        assert sympy.expand(value + found[f"K.{axis}"].expression) == 0
        for letter in "PL":
            value, kinetic, change, gauge, rate = parts(sheet, f"{letter}_{axis}")
            assert kinetic == change == gauge == rate == 0
            assert sympy.expand(value - found[f"{letter}.{axis}"].expression) == 0
    assert sympy.expand(parts(sheet, "h")[0] - found["h"].expression) == 0


def test_gauge_terms_of_uniform_fields_are_those_of_the_books() -> None:
    sheet, eq = galilean(falling()), atwood.equations(falling())
    m, g = eq.symbol("body.mass"), eq.symbol("gravity")
    z = sympy.Function("z")(t)
    assert sympy.expand(parts(sheet, "P_z")[3] + m * g * t) == 0
    assert sympy.expand(parts(sheet, "K_z")[3] - m * z + m * g * t**2 / 2) == 0
    charge, found = galilean(ChargedParticle()), atwood.conserved(ChargedParticle())
    for name in ("P_x", "P_z"):
        value, _, _, gauge, rate = parts(charge, name)
        assert gauge != 0
        assert rate == 0
        assert any(sympy.expand(value - one.expression) == 0 for one in found)


def test_a_body_s_angular_momenta_are_those_in_world_axes() -> None:
    sheet, eq = galilean(FreeBody()), atwood.equations(FreeBody(), form="dae")
    random = np.random.default_rng(3)
    e = random.normal(size=4)
    values = dict(zip(eq.coordinates, [*random.normal(size=3), *(e / np.linalg.norm(e))], strict=True))
    rates = dict(zip(eq.velocities, random.normal(size=6), strict=True))
    turn = atwood.rotation_kinematics("quaternion")["R"]
    turn = turn.subs(dict(zip([sympy.Function(f"q_{k}")(t) for k in range(4)], list(values.values())[3:], strict=True)))
    at = {**eq.values}
    r, v = (np.array([float(one) for one in list(given.values())[:3]]) for given in (values, rates))
    spin = sympy.Matrix(list(rates.values())[3:])
    own = [sympy.Symbol(name) for name in ("I_1", "I_2", "I_3")]
    whole = np.array(turn * sympy.diag(*own).subs(at) * spin, dtype=float).ravel()
    whole += float(eq.symbol("body.mass").subs(at)) * np.cross(r, v)
    for axis, expected in zip("xyz", whole, strict=True):
        assert float(parts(sheet, f"L_{axis}")[0].subs(rates).subs(values).subs(at)) == pytest.approx(expected)


@pytest.mark.sample(0)
def test_both_forms_are_told_alike_and_constraints_leave_their_forces() -> None:
    for scene in (DoublePendulum, PendulumOnCart):
        told = {str(galilean(atwood.assemble(scene(), form=form))) for form in ("reduced", "dae")}
        assert len(told) == 1
    sheet = galilean(PendulumOnCart())
    kept = {name for name in sheet if parts(sheet, name)[4] == 0}
    assert kept == {"P_x", "K_x", "h"}
    line = galilean(MassSpringChain())
    assert [parts(line, name)[4] == 0 for name in line] == [False, False, True]
    eq = atwood.equations(MassSpringChain(), form="dae")
    moment = sum(eq.symbol(f"m{k}.mass") * x for k, x in zip((1, 2), eq.coordinates, strict=True))
    assert sympy.expand(parts(line, "K_s")[3] - moment) == 0
    with pytest.raises(atwood.UnsupportedError, match="would fill a book"):
        galilean(LagrangeTop())


def test_a_boost_by_any_speed_is_what_its_generator_says() -> None:
    """L(x + v t) - L(x) is the rate of v f + m v^2 t/2."""
    fall = falling()
    moved = atwood.point_transformation(
        fall, {"body.position.x": "x + v*t", "body.position.z": "z"}, sympy.symbols("x z")
    )
    v, m = sympy.symbols("v m")
    gauge = v * parts(galilean(fall), "K_x")[3] + m * v**2 * t / 2
    names = {name: sympy.Function(name)(t) for name in "xz"}
    told = moved.lagrangian.subs({sympy.Symbol(f"{name}'"): one.diff(t) for name, one in names.items()})
    told = told.subs({sympy.Symbol(name): one for name, one in names.items()})
    left = told - atwood.equations(fall).lagrangian - gauge.diff(t)
    assert sympy.expand(left.doit()) == 0


@pytest.mark.sample(0)
def test_brackets_of_the_generators_are_galilei_s_algebra() -> None:
    algebra = atwood.bracket_algebra(atwood.hamiltonian(TwoBody()))
    assert algebra.closes
    names = [str(one) for one in algebra.names]
    table = {(a, b): algebra.brackets[i, j] for i, a in enumerate(names) for j, b in enumerate(names)}
    total = sum(sympy.symbols("m_1 m_2"))
    for a, b in combinations("xyz", 2):
        assert table[f"P_{a}", f"P_{b}"] == table[f"K_{a}", f"K_{b}"] == table[f"K_{a}", f"P_{b}"] == 0
    for a in "xyz":
        assert sympy.expand(table[f"K_{a}", f"P_{a}"] - total) == 0
    assert table["L_x", "L_y"] == sympy.Symbol("L_z")
