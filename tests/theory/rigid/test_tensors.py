"""Inertia tensors in letters: those of books, of `atwood.solids`, and what Steiner's theorem makes of them."""

import numpy as np
import pytest
import sympy

from atwood import UsageError, inertia_tensor, solids

m, a, b, c, h, l = sympy.symbols("m a b c h l")
NUMBERS = {m: 1.7, a: 0.9, b: 0.6, c: 0.4, h: 1.3, l: 2.1}

SOLIDS = {
    "rod": solids.rod(2.1, mass=1.7),
    "ring": solids.disc(0.9, inner_radius=0.9, mass=1.7),
    "disc": solids.disc(0.9, mass=1.7),
    "annulus": solids.disc(0.9, inner_radius=0.6, mass=1.7),
    "box": solids.box(0.9, 0.6, 0.4, mass=1.7),
    "cylinder": solids.cylinder(0.9, 1.3, mass=1.7),
    "tube": solids.tube(0.9, 0.6, 1.3, mass=1.7),
    "ball": solids.sphere(0.9, mass=1.7),
    "spherical shell": solids.spherical_shell(0.9, mass=1.7),
    "cone": solids.cone(0.9, 1.3, mass=1.7),
    "ellipsoid": solids.ellipsoid(0.9, 0.6, 0.4, mass=1.7),
}


@pytest.mark.sample(4)
@pytest.mark.parametrize("shape", SOLIDS)
def test_as_solids(shape: str) -> None:
    found = np.array(inertia_tensor(shape)["I"].subs(NUMBERS), dtype=float)
    assert found == pytest.approx(SOLIDS[shape].inertia, rel=1e-14)
    place = np.array([0.3, -0.2, 0.7])
    centre = np.array(inertia_tensor(shape)["centre"].subs(NUMBERS), dtype=float).ravel()
    about = np.array(inertia_tensor(shape, about=(0.3, -0.2, 0.7))["I"].subs(NUMBERS), dtype=float)
    assert about == pytest.approx(SOLIDS[shape].inertia_about(SOLIDS[shape].centre + place - centre), rel=1e-13)


@pytest.mark.parametrize(
    ("shape", "about", "along", "across"),
    [
        ("rod", (0, 0, "l/2"), 0, m * l**2 / 3),
        ("cone", "origin", 3 * m * a**2 / 10, 3 * m * (a**2 + 4 * h**2) / 20),
        ("half ball", "origin", 2 * m * a**2 / 5, 2 * m * a**2 / 5),
        ("cylinder", (0, 0, "h/2"), m * a**2 / 2, m * (a**2 / 4 + h**2 / 3)),
        ("disc", (0, "a", 0), 3 * m * a**2 / 2, None),
        ("ball", (0, 0, "a"), 2 * m * a**2 / 5, 7 * m * a**2 / 5),
    ],
)
def test_moments_of_books(shape: str, about: object, along: sympy.Expr, across: sympy.Expr | None) -> None:
    tensor = inertia_tensor(shape, about)["I"]
    assert sympy.expand(tensor[2, 2] - along) == 0
    if across is not None:
        assert sympy.expand(tensor[0, 0] - across) == 0
        assert sympy.expand(tensor[1, 1] - across) == 0


def test_half_ball_and_plate_by_integration() -> None:
    r, z = sympy.symbols("r z", positive=True)
    radius = sympy.Symbol("a", positive=True)

    def mean(f: sympy.Expr) -> sympy.Expr:  # over discs of radius sqrt(a^2 - z^2)
        edge = sympy.sqrt(radius**2 - z**2)
        return sympy.integrate(sympy.integrate(2 * sympy.pi * r * f, (r, 0, edge)).expand(), (z, 0, radius))

    volume = mean(sympy.Integer(1))
    centre = mean(z) / volume
    across = mean(r**2 / 2 + (z - centre) ** 2) / volume
    sheet = inertia_tensor("half ball")
    assert sympy.simplify(sheet["centre"][2].subs(a, radius) - centre) == 0
    assert sympy.simplify((sheet["I"][0, 0] / m).subs(a, radius) - across) == 0
    assert inertia_tensor("plate")["I"] == sympy.diag(m * b**2 / 12, m * a**2 / 12, m * (a**2 + b**2) / 12)


def test_principal_axes_about_an_edge() -> None:
    sheet = inertia_tensor("box", ("a/2", 0, "c/2"))
    values = {**NUMBERS, sympy.Symbol("alpha"): float(sheet["alpha"].subs(NUMBERS))}
    axes = np.array(sheet["axes"].subs(values), dtype=float)
    moments = np.array(sheet["moments"].subs(values), dtype=float).ravel()
    tensor = np.array(sheet["I"].subs(NUMBERS), dtype=float)
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(tensor, abs=1e-14)
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-15)


def test_a_corner_has_a_cubic() -> None:
    cubic = inertia_tensor("box", ("a/2", "b/2", "c/2"))["characteristic"]
    tensor = np.array(inertia_tensor("box", ("a/2", "b/2", "c/2"))["I"].subs(NUMBERS), dtype=float)
    for moment in np.linalg.eigvalsh(tensor):
        assert float(cubic.subs({**NUMBERS, sympy.Symbol("lambda"): moment})) == pytest.approx(0.0, abs=1e-13)
    cube = {b: a, c: a}
    expected = (sympy.Symbol("lambda") - m * a**2 / 6) * (sympy.Symbol("lambda") - 11 * m * a**2 / 12) ** 2
    assert sympy.expand(cubic.subs(cube) - expected) == 0


def test_what_is_refused_and_written() -> None:
    with pytest.raises(UsageError, match="shape cannot be 'bal'"):
        inertia_tensor("bal")
    with pytest.raises(UsageError, match="about cannot be"):
        inertia_tensor("ball", about=(0, 0))
    assert "I₁ = (3/20) m (R² + 4 h²)" in inertia_tensor("cone", "origin", symbols={"a": "R"}).text()
