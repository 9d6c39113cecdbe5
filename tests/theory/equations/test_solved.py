"""Accelerations, multipliers and quantities of parts as formulas: a book's, and those of a run."""

from __future__ import annotations

import json
from unicodedata import normalize

import numpy as np
import pytest
import sympy
from click.testing import CliRunner
from sympy import cos, diff, sin

from atwood import ParameterError, Scene, UnsupportedError, equations, simulate
from atwood.cli import main
from atwood_library.scenes import (
    SCENES,
    Atwood,
    ChaplyginSleigh,
    DoubleAtwood,
    DoublePendulum,
    PendulumOnCart,
    RotatingFrame,
    RotatingHoopDriven,
    RotatingHoopFree,
    SimplePendulum,
    Strandbeest,
)

t = sympy.Symbol("t")


def same(one: sympy.Expr, other: sympy.Expr) -> bool:
    return sympy.simplify(one - other) == 0


def values_along(scene: Scene, path: str, form: str = "reduced") -> tuple[np.ndarray, np.ndarray]:
    """Return a quantity along a run, by its formula and as the run gives it."""
    eq = equations(scene, form=form)
    result = simulate(scene, form=form, t_end=0.4, outputs=9, rtol=1e-11)
    formula = eq.quantity(path).subs(eq.values).subs({one: value.subs(eq.values) for one, value in eq.solved.items()})
    stand_ins = sympy.symbols(f"z:{len(eq.coordinates) + len(eq.velocities)}")
    by = dict(zip((*eq.velocities, *eq.coordinates), stand_ins, strict=True))
    function = sympy.lambdify([t, *stand_ins], formula.subs(by), "numpy")
    (segment,) = result.run.segments
    at = np.searchsorted(segment.time, result.time)
    found = function(result.time, *segment.speeds[:, at], *segment.coordinates[:, at])
    return np.broadcast_to(found, result.time.shape), result[path]


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("simple-pendulum", "rod.tension"),
        ("simple-pendulum", "ground.force.x"),
        ("double-pendulum", "rod1.tension"),
        ("double-pendulum", "rod2.tension"),
        ("pendulum-on-cart", "rod.tension"),
        ("pendulum-on-cart", "rail.side_force"),
        ("atwood", "rope.tension"),
        ("double-atwood", "rope2.tension"),
        ("rotating-frame", "observer.coriolis_force.y"),
        ("rotating-hoop-driven", "hoop.radial_force"),
        ("rotating-hoop-free", "hoop.radial_force"),
        ("rotating-frame", "observer.euler_force.x"),
        ("rotating-frame", "observer.translational_force.x"),
        ("rotating-frame", "observer.centrifugal_force.x"),
        ("chaplygin-sleigh", "blade.side_force"),
        ("lagrange-top", "ground.force.x"),
        ("furuta-pendulum", "ground.force.y"),
        ("swinging-atwood", "ground.force.z"),
    ],
)
def test_a_quantity_is_that_of_a_run(name: str, path: str) -> None:
    formula, measured = values_along(SCENES[name](), path)
    assert formula == pytest.approx(measured, rel=1e-6, abs=1e-6)
    assert np.max(np.abs(measured)) > 1e-3


def test_a_multiplier_of_the_dae_form_is_that_of_a_run() -> None:
    formula, measured = values_along(SimplePendulum(), "rod.tension", "dae")
    assert formula == pytest.approx(measured, rel=1e-6)


def test_the_tension_of_a_pendulum_is_the_books() -> None:
    """``S = m (g cos(theta) + l theta'^2)``, with the bob's name at each term."""
    eq = equations(SimplePendulum(), by_part=True, quantities=["rod.tension"])
    (theta,), m, l, g = eq.coordinates, *map(eq.symbol, ("bob.mass", "rod.length", "gravity"))
    assert same(eq.quantity("rod.tension"), m * (g * cos(theta) + l * diff(theta, t) ** 2))
    assert len(eq.written_quantity("rod.tension").terms) == 2
    assert [one.owners for one in eq.written_quantity("rod.tension").terms] == [("bob",), ("bob",)]
    assert normalize("NFD", "rod.tension = m l θ̇²") in eq.text()


def test_the_terms_of_a_reaction_name_the_parts_that_hang_there() -> None:
    """In the upper rod hang both bobs, in the lower one the lower bob."""
    eq = equations(DoublePendulum(), by_part=True)
    upper, lower = (eq.written_quantity(f"rod{k}.tension") for k in (1, 2))
    assert {one.owners for one in lower.terms} == {("bob2",)}
    assert {one.owners for one in upper.terms} == {("bob1",), ("bob2",), ("bob1", "bob2")}


def test_accelerations_of_the_double_pendulum_are_the_books() -> None:
    """With ``Delta = theta1 - theta2`` over ``l (m1 + m2 sin(Delta)^2)``; no more terms than a book has."""
    eq = equations(DoublePendulum())
    one, two = eq.coordinates
    m1, m2, l1, l2, g = map(eq.symbol, ("bob1.mass", "bob2.mass", "rod1.length", "rod2.length", "gravity"))
    delta, w1, w2 = one - two, diff(one, t), diff(two, t)
    below = m1 + m2 * sin(delta) ** 2
    book = (
        -m2 * l1 * w1**2 * sin(delta) * cos(delta)
        + m2 * g * sin(two) * cos(delta)
        - m2 * l2 * w2**2 * sin(delta)
        - (m1 + m2) * g * sin(one)
    ) / (l1 * below)
    found = eq.solved[eq.accelerations[0]]
    at = {w1: 0.7, w2: -0.4, one: 0.9, two: -0.3, m1: 1.3, m2: 0.7, l1: 1.1, l2: 0.6, g: 9.81}
    assert sympy.N((found - book).subs(at), 40) == pytest.approx(0.0, abs=1e-14)
    assert sympy.expand(sympy.expand_trig((found - book) * l1 * below)).rewrite(cos).simplify() == 0
    assert len(eq.lines_solved[0].formula.terms) == 1
    above, _ = (node for node, _ in eq.lines_solved[0].formula.terms[0].factors)
    assert len(above.terms) <= 4


def test_machines_of_atwood() -> None:
    eq = equations(Atwood())
    (a,), (m1, m2, g) = eq.accelerations, map(eq.symbol, ("m1.mass", "m2.mass", "gravity"))
    assert same(eq.solved[a], (m2 - m1) * g / (m1 + m2)) or same(eq.solved[a], (m1 - m2) * g / (m1 + m2))
    twice = equations(DoubleAtwood())
    for row in twice.rows:
        assert same(row.subs(twice.solved), 0)


@pytest.mark.parametrize(
    ("scene", "turn"),
    [(RotatingHoopDriven(), "clock.slope"), (RotatingHoopFree(), "axle.angle")],
    ids=["driven", "free"],
)
def test_a_hoop_presses_on_its_bead_along_the_radius_and_across(scene: Scene, turn: str) -> None:
    """``m (g cos(theta) - a theta'^2 - a w^2 sin(theta)^2)``, and ``m a (2 w theta' cos(theta) + w' sin(theta))``."""
    eq = equations(scene)
    m, a, g = map(eq.symbol, ("bead.mass", "hoop.radius", "gravity"))
    theta, w = eq.symbol("hoop.angle"), eq.symbol(turn) if turn == "clock.slope" else diff(eq.symbol(turn), t)
    radial, across = eq.quantity("hoop.radial_force"), eq.quantity("hoop.axial_force")
    assert same(radial, m * (g * cos(theta) - a * diff(theta, t) ** 2 - a * w**2 * sin(theta) ** 2))
    assert same(across, m * a * (2 * w * diff(theta, t) * cos(theta) + diff(w, t) * sin(theta)))


def test_the_forces_of_a_frame_add_up_to_the_acceleration_in_it() -> None:
    """``m x'' = F_Coriolis + F_centrifugal + F_Euler + F_translation``, each a formula with letters."""
    eq = equations(RotatingFrame())
    x, y = eq.coordinates
    m, omega, alpha = (
        eq.symbol(path) for path in ("puck.mass", "turntable.rotation.rate", "turntable.rotation.speed_up")
    )
    turned = omega + alpha * t
    forces = {kind: eq.quantity(f"observer.{kind}_force.x") for kind in ("coriolis", "centrifugal", "euler")}
    assert same(forces["coriolis"], 2 * m * turned * diff(y, t))
    assert same(forces["centrifugal"], m * turned**2 * x)
    assert same(forces["euler"], m * alpha * y)
    total = sum(forces.values()) + eq.quantity("observer.translational_force.x")
    assert same(total, m * eq.solved[eq.accelerations[0]])


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_blade_of_a_sleigh_presses_and_does_no_work(form: str) -> None:
    """``lambda = -m I omega v/(I + m c^2)`` with the speed v along the blade; both forms have the same."""
    eq = equations(ChaplyginSleigh(), form=form)
    x, z, theta = eq.coordinates
    m, c, moment = (eq.symbol(f"sleigh.{one}") for one in ("mass", "center.x", "moments.y"))
    along = diff(x, t) * cos(theta) + diff(z, t) * sin(theta)
    (pressing,) = eq.multipliers
    assert same(eq.solved[pressing], -m * moment * diff(theta, t) * along / (moment + m * c**2))
    assert eq.constraint_powers == (0,)
    for row in eq.rows:
        assert same(row.subs(eq.solved), 0)


def test_what_would_fill_a_page_and_what_there_is_not_is_refused() -> None:
    with pytest.raises(UnsupportedError, match="hang together, and solved they would fill a page"):
        _ = equations(Strandbeest()).solved
    for ask in (lambda eq: eq.solved, lambda eq: eq.quantity("ground0.force.x")):
        with pytest.raises(UnsupportedError, match="too many to be solved"):
            ask(equations(SCENES["stewart-platform"]()))
    with pytest.raises(ParameterError, match="no such quantity"):
        equations(PendulumOnCart()).quantity("rod.tensio")


def test_the_command_line_has_them() -> None:
    arguments = ["equations", "pendulum-on-cart", "--solved", "--quantity", "rod.tension"]
    text = CliRunner().invoke(main, arguments, catch_exceptions=False).output
    assert "Accelerations and multipliers" in text
    assert normalize("NFD", "rod.tension = -m_bob ẍ sin θ") in text
    data = json.loads(CliRunner().invoke(main, [*arguments, "--json"], catch_exceptions=False).output)
    assert len(data["solved"]) == 2
    assert "rod.tension" in data["quantities"]
    assert r"\text{rod.tension}" in CliRunner().invoke(main, [*arguments, "--latex"], catch_exceptions=False).output
