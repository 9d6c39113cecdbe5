"""Formulas of sympy are written as those of equations are, and pages say what results hold."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from unicodedata import normalize

import pytest
import sympy

import atwood
from atwood.theory.formulas.described import page_of
from atwood.theory.formulas.mathml import document, mathml
from atwood.theory.formulas.printers import latex, objects, text
from atwood.theory.formulas.reading import read_formula
from atwood_library.scenes import LagrangeTop

t, x, k = sympy.symbols("t x k", positive=True)
p_phi, omega, m = sympy.symbols("p_phi omega_1 m")
theta = sympy.Function("theta")(t)


@pytest.mark.parametrize(
    ("formula", "plain", "tex"),
    [
        (sympy.Integer(0), "0", "0"),
        (sympy.Rational(-1, 2) * m * theta.diff(t) ** 2, "-½ m θ̇²", r"-\frac{1}{2} m \dot{\theta}^{2}"),
        (p_phi / sympy.sin(theta) ** 2, "p_φ / sin² θ", r"\frac{p_{\phi}}{\sin^{2} \theta}"),
        (sympy.sqrt(x - k), "√(x - k)", r"\sqrt{x - k}"),
        (sympy.sqrt(2) * k * x / 2, "½ √2 k x", r"\frac{1}{2} \sqrt{2} k x"),
        ((2 - sympy.sqrt(2)) * k, "(2 - √2) k", r"\left(2 - \sqrt{2}\right) k"),
        (2 * sympy.pi * omega, "2 π ω₁", r"2 \pi \omega_{1}"),
        (sympy.Integral(x, (x, 0, k)), "∫[0, k] x dx", r"\int_{0}^{k} x \, dx"),
        (sympy.Integral(1 / x, x), "∫ 1 / x dx", r"\int \frac{1}{x} \, dx"),
        (sympy.Piecewise((x, x < k), (0, True)), "(x if k > x else 0)",
         r"\begin{cases} x & k > x \\ 0 & \text{else} \end{cases}"),
        (k >= x, "x ≤ k", r"x \le k"),
        (sympy.Symbol("r'") ** 2, "ṙ²", r"\dot{r}^{2}"),
    ],
)  # fmt: skip
def test_formulas_of_sympy_are_written_as_books_do(formula: sympy.Expr, plain: str, tex: str) -> None:
    read = read_formula(formula)
    assert text.formula(read) == normalize("NFD", plain)
    assert latex.formula(read) == tex
    ElementTree.fromstring(f"<math>{mathml.formula(read).replace('&#x2061;', '')}</math>")


def test_what_is_read_is_the_same_formula() -> None:
    given = (m * x**2 / 2 + sympy.sin(k * x) ** 3 / sympy.sqrt(x + k)) ** 2 - sympy.atan2(x, k) + sympy.exp(-k * x)
    assert (
        sympy.expand(objects.formula(read_formula(given)) - given.subs({x: sympy.Symbol("x"), k: sympy.Symbol("k")}))
        == 0
    )


def test_a_page_says_what_a_result_holds() -> None:
    found = atwood.routhian(LagrangeTop())
    page = page_of(found, "Routhian")
    assert [one.title for one in page.sections][:2] == ["Expression", "Effective potential"]
    assert "top.euler.phi, top.euler.psi" in page.text()
    for written in (found.text(), found.latex(), found.markdown()):
        assert "sin(theta" not in written
    ElementTree.fromstring(document("Routhian", found.html()).split("\n", 1)[1].replace('<meta charset="utf-8">', ""))
