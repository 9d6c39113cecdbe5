"""Each term says which parts it comes from, and what the parts' own terms add up to is the whole."""

from __future__ import annotations

import pytest
import sympy
from click.testing import CliRunner

from atwood import equations, hamiltonian
from atwood.cli import main
from atwood.theory.formulas.printers import objects
from atwood_library.scenes import ChargedParticle, DoublePendulum, PendulumOnCart, RollingDisc, SliderCrank

from ...helpers.smooth import SMOOTH as SCENES

SCENES_AND_FORMS = [
    *((name, form) for name in ("double-pendulum", "pendulum-on-cart", "slider-crank") for form in ("reduced", "dae")),
    ("rotating-hoop-driven", "reduced"),
    ("charged-particle", "reduced"),
    ("quarter-car", "reduced"),
    ("double-atwood", "reduced"),
]


@pytest.mark.sample(7)
@pytest.mark.parametrize(("name", "form"), SCENES_AND_FORMS)
def test_the_terms_of_the_parts_add_up_to_the_whole(name: str, form: str) -> None:
    eq = equations(SCENES[name](), form=form)
    parts = [eq.terms(path) for path in eq.assembly.mechanism.locals_]
    assert sympy.expand(sum(one.lagrangian for one in parts) - eq.lagrangian, trig=True) == 0
    for k, row in enumerate(eq.rows):
        assert sympy.expand(sum(one.rows[k] for one in parts) - row, trig=True) == 0


@pytest.mark.sample(3)
@pytest.mark.parametrize(("name", "form"), SCENES_AND_FORMS)
def test_a_term_names_the_parts_without_which_it_would_be_another(name: str, form: str) -> None:
    """What the parts have that a term names, and they alone, adds up to its coefficient of what moves."""
    eq = equations(SCENES[name](), form=form, by_part=True)
    written = eq.written_by_part
    paths = list(eq.assembly.mechanism.locals_)
    own = {path: eq.terms(path) for path in paths}
    checked = 0
    for k, row in enumerate(written.rows):
        assert objects.formula(row) == eq.rows[k]
        for term in row.terms:
            assert term.owners
            rest = sympy.expand(sum(own[path].rows[k] for path in paths if path not in term.owners), trig=True)
            one = sympy.expand(objects.formula(type(row)((term,))), trig=True)
            assert not set(sympy.Add.make_args(rest)) & set(sympy.Add.make_args(one)) - {sympy.S.Zero}
            checked += 1
    assert checked


def test_a_shared_term_names_both_parts_in_text_latex_and_html() -> None:
    eq = equations(DoublePendulum(), by_part=True)
    assert "½ (m₁ + m₂) l₁² θ̇₁²" in eq.text()
    line = next(one for one in eq.text().splitlines() if "T = " in one)
    assert line.endswith("[bob1, bob2]")
    assert r"&& \text{bob1, bob2}" in eq.latex()
    assert r"&& \text{bob1, bob2}" in eq.markdown()
    assert "[bob1, bob2]</small>" in eq._repr_html_()
    plain = equations(DoublePendulum())
    assert "[bob1" not in plain.text() + plain.latex() + plain.markdown()
    assert "<small>" not in plain._repr_html_()


def test_forces_of_constraints_and_of_the_hamiltonian_have_parts() -> None:
    text = equations(SliderCrank(), form="dae", by_part=True).text()
    assert "[pivot2]" in text
    assert "[guide]" in text
    h = hamiltonian(PendulumOnCart(), by_part=True).text()
    assert "[cart, bob]" in h
    assert "[bob]" in h
    assert "source" in hamiltonian(ChargedParticle(), by_part=True).latex()


def test_terms_in_the_momenta_name_the_parts_without_which_they_would_be_others() -> None:
    """Of the double pendulum the lower bob alone gives ``p2^2 / (2 m2 l2^2)``, whatever the upper one is."""
    h = hamiltonian(DoublePendulum(), by_part=True)
    p1, p2 = h.momenta
    others = h.formulas.notation.symbols
    masses = {one.path: objects.letter(one) for one in others.values() if one.path.endswith(".mass")}
    kinetic = [term for term in h.formula.terms if objects.formula(type(h.formula)((term,))).has(p1, p2)]
    assert [term.owners for term in kinetic] == [("bob1", "bob2"), ("bob2",)]
    for term in kinetic:
        one = objects.formula(type(h.formula)((term,)))
        assert {f"{path}.mass" for path in term.owners} == {path for path, m in masses.items() if one.has(m)}


def test_equations_that_are_no_sum_over_parts_are_left_without() -> None:
    eq = equations(RollingDisc(), by_part=True)
    assert all(not term.owners for row in eq.written_by_part.rows for term in row.terms)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("double-pendulum",), "[bob1, bob2]"),
        (("double-pendulum", "--latex"), r"\text{bob1, bob2}"),
        (("simple-pendulum", "--hamiltonian"), "[bob]"),
    ],
)
def test_the_command_line_has_it(arguments: tuple[str, ...], said: str) -> None:
    assert said in CliRunner().invoke(main, ["equations", *arguments, "--by-part"], catch_exceptions=False).output
