"""Legendre transforms of given functions, with where they are."""

from __future__ import annotations

import pytest
import sympy

from atwood import UnsupportedError, UsageError, legendre_transform
from atwood.theory.hamiltonian.phase_space import vanishes

m, c, l, g, v, x, y, p, q, theta = sympy.symbols("m c l g v x y p q theta")


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("function", "between", "expected", "goes"),
    [
        ("m*v**2/2", None, p**2 / (2 * m), "-infinity to infinity"),
        ("-m*c**2*sqrt(1 - v**2/c**2)", ("-c", "c"), sympy.sqrt(p**2 * c**2 + m**2 * c**4), "-infinity to infinity"),
        ("exp(v)", None, p * sympy.log(p) - p, "0 to infinity"),
        ("v**3/3", (0, None), 2 * p ** sympy.Rational(3, 2) / 3, "0 to infinity"),
        ("log(1 + exp(v))", None, p * sympy.log(p) + (1 - p) * sympy.log(1 - p), "0 to 1"),
        ("m*v**2/2", ("-c", "c"), p**2 / (2 * m), "-m c to m c"),
    ],
)
def test_of_one_variable(function: str, between: tuple[object, object] | None, expected: sympy.Expr, goes: str) -> None:
    found = legendre_transform(function, ["v"], ["p"], between=None if between is None else {"v": between})
    positive = {one: sympy.Symbol(one.name, positive=True) for one in (m, c, p)}
    # The entropy's logarithms are real for p between 0 and 1.
    at = {p: sympy.Rational(3, 7), m: 2, c: 3}
    assert abs(sympy.N((found.expression - expected).subs(at), 50)) < 1e-45
    if "log(1" not in function:
        assert vanishes([(found.expression - expected).xreplace(positive)]).holds
    assert found.ranges == {"p": goes}


@pytest.mark.parametrize("function", [m * v**2 / 2 + v, sympy.exp(v)])
def test_the_transform_of_the_transform_is_the_function(function: sympy.Expr) -> None:
    found = legendre_transform(function, ["v"], ["p"])
    back = legendre_transform(found.expression, ["p"], ["v"], between={"p": (0, None)})
    assert vanishes([back.expression - function]).proven


def test_of_several_variables() -> None:
    """The spherical pendulum's H from its L in two velocities; a form that is not diagonal has the inverse matrix."""
    a, b = sympy.symbols("a b")
    energy = m * l**2 * (a**2 + sympy.sin(theta) ** 2 * b**2) / 2 + m * g * l * sympy.cos(theta)
    found = legendre_transform(energy, [a, b], [p, q])
    book = p**2 / (2 * m * l**2) + q**2 / (2 * m * l**2 * sympy.sin(theta) ** 2) - m * g * l * sympy.cos(theta)
    assert vanishes([found.expression - book]).proven
    crossed = legendre_transform(x**2 + x * y + y**2, [x, y], [p, q])
    matrix = sympy.Matrix([[2, 1], [1, 2]])
    expected = (sympy.Matrix([[p, q]]) * matrix.inv() * sympy.Matrix([p, q]))[0, 0] / 2
    assert sympy.expand(crossed.expression - expected) == 0
    assert crossed.hessian == 3


def test_what_has_none_says_why() -> None:
    with pytest.raises(UsageError, match="determinant of second derivatives is zero"):
        legendre_transform("x + 2", ["x"])
    with pytest.raises(UsageError, match="changes its sign at 0"):
        legendre_transform("x**3", ["x"])
    with pytest.raises(UsageError, match=r"changes its sign at -.*6.*, .*6"):
        legendre_transform("x**4 - x**2", ["x"])
    with pytest.raises(UnsupportedError, match="p_x = x³"):
        legendre_transform("x**4/4", ["x"])
    with pytest.raises(UsageError, match="1 slopes for 2 variables"):
        legendre_transform("x*y", ["x", "y"], ["p"])
