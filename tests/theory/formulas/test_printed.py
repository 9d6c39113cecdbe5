"""Formulas as a person writes them: with at most the terms of the book, and nothing that is not said what it is."""

from __future__ import annotations

import re
import unicodedata

import pytest
import sympy

from atwood import Scene, conserved, equations, hamiltonian
from atwood_library import MutualPotential, PointMass
from atwood_library.scenes import (
    DoubleAtwood,
    DoublePendulum,
    HeavyTop,
    LagrangeTop,
    NBody,
    RollingDisc,
    TwoBody,
)


def line(text: str, head: str) -> str:
    """Return the line of a page that begins so."""
    lines = [one.strip() for one in unicodedata.normalize("NFC", text).splitlines()]
    return next(one for one in lines if one.startswith(head))


def test_squares_of_the_double_atwood_machine_have_their_first_term_added() -> None:
    text = equations(DoubleAtwood()).text()
    assert line(text, "T =") == "T = ½ m₁ ż₁² + ½ m₂ ż₂² + ½ m₃ (2 ż₁ + ż₂)²"


def test_momenta_of_a_top_are_in_terms_of_each_other() -> None:
    eq = equations(LagrangeTop(), orientation="euler-zxz")
    text = eq.text()
    assert line(text, "p_φ =") == "p_φ = J₁ φ̇ sin² θ + p_ψ cos θ"
    assert line(text, "J₁ =") == "J₁ = m c_z² + I₁"
    assert line(text, "T =") == "T = ½ J₁ (φ̇² sin² θ + θ̇²) + ½ I₃ (φ̇ cos θ + ψ̇)²"
    phi = eq.velocities[0]
    p = dict(zip("ab", (eq.momenta[0], eq.momenta[2]), strict=True))
    J = sympy.Symbol("I_1") + sympy.Symbol("m") * sympy.Symbol("c_z") ** 2
    angle = eq.coordinates[1]
    book = J * phi * sympy.sin(angle) ** 2 + p["b"] * sympy.cos(angle)
    assert sympy.expand((p["a"] - book).rewrite(sympy.exp)) == 0
    assert not eq.momenta[0].has(sympy.Symbol("p_psi"))


def test_momenta_stay_as_they_are_where_that_is_shorter() -> None:
    assert "p_θ₂ cos" not in equations(DoublePendulum()).text()


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_distances_of_bodies_have_names(form: str) -> None:
    text = equations(NBody(), form=form).text()
    assert line(text, "V =") == "V = -G m₁ m₂ / |r₁ - r₂| - G m₁ m₃ / |r₁ - r₃| - G m₂ m₃ / |r₂ - r₃|"
    assert line(text, "|r₁ - r₂|² =") == "|r₁ - r₂|² = (x₁ - x₂)² + (y₁ - y₂)² + (z₁ - z₂)²"
    if form == "reduced":
        row = line(text, "m₁ ẍ₁")
        assert row == "m₁ ẍ₁ - G m₁ m₂ (x₂ - x₁) / |r₁ - r₂|³ - G m₁ m₃ (x₃ - x₁) / |r₁ - r₃|³ = 0"
    assert r"\left|\mathbf{r}_{\mathrm{1}} - \mathbf{r}_{\mathrm{2}}\right|" in equations(NBody()).markdown()


def test_distances_follow_the_letters_and_the_order_of_bodies() -> None:
    scene = Scene(space="space", gravity=0.0)
    bodies = [scene.add(name, PointMass(mass=1.0 + k)) for k, name in enumerate(("moon", "sun", "earth"))]
    force = scene.add("force", MutualPotential(count=3))
    for k in (2, 0, 1):
        scene.connect(force.point[k], bodies[k].point)
    assert "|r₁ - r₃|" in equations(scene).text()
    text = equations(scene, symbols={"moon": "M", "sun": "S", "earth": "E"}).text()
    assert "|r_M - r_S|" in text
    assert "|r_S - r_E|" in text
    assert "|r" not in equations(scene, symbols={"moon": "M", "sun.position.x": "X"}).text().replace("|r_M", "")


def test_what_is_no_distance_has_no_such_name() -> None:
    assert "|r" not in equations(DoublePendulum()).text()
    assert "|r₁ - r₂|" in equations(TwoBody()).text()


def defined(text: str) -> None:
    """Assert that each name of the form s₁ is said what it is."""
    used = set(re.findall(r"\bs_\{?\d+\}?|s[₀-₉]+", text))
    said = set(re.findall(r"(s_\{?\d+\}?|s[₀-₉]+) (?:&)?= ", text))
    assert used <= said


@pytest.mark.sample(0)
def test_every_name_is_said_what_it_is() -> None:
    for scene, orientation in ((HeavyTop(), "euler-zxz"), (RollingDisc(), None)):
        eq = equations(scene, orientation=orientation)
        for written in (eq.latex(), eq.text(), eq.markdown(), eq._repr_html_().replace("=$", "= ")):
            defined(written)
        assert "s_{" in eq.latex()
    for one in conserved(RollingDisc()):
        defined(one.text())
        defined(one.latex())
    defined(hamiltonian(HeavyTop()).text())
