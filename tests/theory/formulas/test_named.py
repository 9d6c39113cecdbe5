"""Names for sub-expressions in formulas: they stand wherever what they name does, and nothing else changes."""

import pytest
import sympy
from click.testing import CliRunner

import atwood
from atwood import UsageError
from atwood.cli import main
from atwood.theory.formulas.page import formulas_of
from atwood.theory.formulas.printers import objects, text
from atwood.theory.formulas.tree import cost
from atwood_library.scenes import DoublePendulum

NAMES = {"mu": "m1 + m2", "s": "sin(theta2 - theta1)", "Delta": sympy.sympify("m_1 + s**2*m_2")}


def formulas(page):
    return [one for section in page.sections for line in section.lines for one in formulas_of(line)]


def test_formulas_with_names_are_the_same_formulas_and_shorter():
    found = atwood.equations(DoublePendulum(), solved=True, by_part=True)
    before, after = formulas(found._page), formulas(found.named(NAMES))
    meant = dict(zip(NAMES, map(objects.formula, after[-3:]), strict=True))
    for one, other in zip(before, after, strict=False):
        written = objects.formula(other)
        for name in reversed(NAMES):
            written = written.subs(sympy.Symbol(name), meant[name])
        assert sympy.expand(objects.formula(one) - written) == 0, text.formula(other)
        assert cost(other) <= cost(one)
        assert {owner for term in one.terms for owner in term.owners} == {o for t in other.terms for o in t.owners}
    kinetic, (first, second) = after[0], [one for one in after if "Δ" in text.formula(one)]
    assert text.formula(kinetic).startswith("½ μ l₁² θ̇₁²")
    assert text.formula(first).endswith("/ (Δ l₁)")
    assert text.formula(second).endswith("/ (Δ l₂)")


def test_names_are_there_in_every_language_and_on_the_command_line():
    command = ["modes", "simple-pendulum", "--symbolic", "--named", "omega_0=sqrt(g/l)"]
    for option, said in (
        ("", "ω₀"),
        ("--latex", r"\omega_{0}"),
        ("--html", "<msub><mi>ω</mi><mrow><mn>0</mn></mrow></msub>"),
    ):
        done = CliRunner().invoke(main, [*command, *filter(None, [option])], catch_exceptions=False)
        frequencies = done.stdout.lower().partition("angular frequencies")[2].partition("transformation")[0]
        assert said in frequencies
        assert "√" not in frequencies.replace(said, "")
        assert "sqrt" not in frequencies


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"mu": "m1 - m2"}, "stands in no formula"),
        ({"g": "m1 + m2"}, "stands for something already"),
        ({"M": "m1 + m2"}, "stands for something already"),
        ({"mu": "m1 + m3"}, "no formula has m3"),
        ({"mu": "m1 +"}, "is no formula"),
        ({"mu": "m1 - m1 + 2"}, "has no letters"),
        ({"a b": "m1"}, "names cannot be"),
    ],
)
def test_names_that_say_nothing_are_refused(names, said):
    with pytest.raises(UsageError, match=said):
        atwood.equations(DoublePendulum()).named(names)
