"""Poisson brackets of angular momentum, of the Laplace-Runge-Lenz vector, of random functions, and of scenes."""

import random
from typing import Any

import pytest
import sympy

from atwood import UsageError, hamiltonian, poisson_bracket, poisson_brackets, total_derivative
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library.scenes import SCENES

x, y, z, px, py, pz, m, k, t = sympy.symbols("x y z p_x p_y p_z m k t")
SPACE = ((x, y, z), (px, py, pz))
L = (y * pz - z * py, z * px - x * pz, x * py - y * px)
R = sympy.sqrt(x**2 + y**2 + z**2)
A = tuple(sympy.Matrix([px, py, pz]).cross(sympy.Matrix(L)) - m * k * sympy.Matrix([x, y, z]) / R)
H = (px**2 + py**2 + pz**2) / (2 * m) - k / R
EACH = [(i, j) for i in range(3) for j in range(3)]


def across(i: int, j: int, vector: tuple[Any, ...]) -> Any:
    return sum(sympy.LeviCivita(i, j, n) * vector[n] for n in range(3))


def test_angular_momenta() -> None:
    found = poisson_brackets(L, SPACE)
    for i, j in EACH:
        assert sympy.expand(found[i, j] - across(i, j, L)) == 0


@pytest.mark.sample(0)
def test_the_laplace_runge_lenz_vector() -> None:
    for i, j in EACH:
        turned = vanishes([poisson_bracket(L[i], A[j], SPACE) - across(i, j, A)])
        other = vanishes([poisson_bracket(A[i], A[j], SPACE) + 2 * m * H * across(i, j, L)])
        assert turned.holds
        assert turned.proven
        assert other.holds
        assert other.proven
        assert vanishes([poisson_bracket(A[i], H, SPACE)]).proven
    assert not vanishes([poisson_bracket(A[0], A[1], SPACE) + 2.01 * m * H * L[2]]).holds


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(2))
def test_jacobi_s_identity_of_random_functions(seed: int) -> None:
    chance = random.Random(seed)
    symbols = (x, y, z, px, py, pz)
    functions = [sympy.sin(x), sympy.cos(py), sympy.exp(z / 3), 1 / (2 + x**2), sympy.sqrt(1 + pz**2), *symbols]

    def one() -> Any:
        terms = [chance.randint(-4, 4) * chance.choice(functions) * chance.choice(functions) for _ in range(3)]
        return sum(terms) + chance.choice(symbols) ** 2 * chance.choice(symbols)

    def bracket(f: Any, g: Any) -> Any:
        return poisson_bracket(f, g, SPACE)

    f, g, h = one(), one(), one()
    total = bracket(f, bracket(g, h)) + bracket(g, bracket(h, f)) + bracket(h, bracket(f, g))
    found = vanishes([total])
    assert found.holds, found.sentence
    wrong = bracket(f, bracket(g, h)) - bracket(g, bracket(h, f)) + bracket(h, bracket(f, g))
    assert not vanishes([wrong + x]).holds


def test_constants_of_a_scene_and_poisson_s_theorem() -> None:
    scene = SCENES["two-body"]()
    h = hamiltonian(scene)
    q, p = dict(zip(h.paths, h.coordinates, strict=True)), dict(zip(h.paths, h.momenta, strict=True))

    def about(first: str, second: str) -> Any:
        names = [(f"{one}.position.{first}", f"{one}.position.{second}") for one in ("body1", "body2")]
        return sum(q[a] * p[b] - q[b] * p[a] for a, b in names)

    lx, ly, lz = about("y", "z"), about("z", "x"), about("x", "y")
    for one in (lx, ly):
        assert total_derivative(one, h) == 0
    third = poisson_bracket(lx, ly, h)  # the bracket of two constants is one, too
    assert sympy.expand(third - lz) == 0
    assert total_derivative(third, h) == 0
    moment = sum(sympy.Symbol(f"m_{n}") * q[f"body{n}.position.x"] for n in (1, 2))
    momentum = sum(p[f"body{n}.position.x"] for n in (1, 2))
    assert total_derivative(moment - t * momentum, h) == 0  # depends on time, and is constant
    assert total_derivative(lx * q["body1.position.x"], h) != 0
    assert total_derivative(h.expression, h) == 0


def test_what_is_no_phase_space_is_refused() -> None:
    with pytest.raises(UsageError, match="no phase space"):
        poisson_bracket(x, y, ((x, y), (px,)))
    with pytest.raises(UsageError, match="neither a coordinate"):
        poisson_bracket(sympy.Function("f")(x), px, SPACE)
    with pytest.raises(UsageError, match=r"hamiltonian cannot be 'kepler'.*or a pair"):
        poisson_bracket(x, px, "kepler")


def test_names_in_text_are_coordinates_and_momenta() -> None:
    """A symbol of the name of theta(t) is that coordinate: otherwise the bracket of both would be zero."""
    h = hamiltonian(SCENES["simple-pendulum"]())
    [theta], [momentum] = h.coordinates, h.momenta
    assert poisson_bracket("theta", "p_theta", h) == 1
    assert poisson_bracket(sympy.Symbol("theta"), momentum, h) == 1
    assert total_derivative("cos(theta)", h) == total_derivative(sympy.cos(theta), h) != 0
    with pytest.raises(UsageError, match="no finite value"):
        poisson_bracket("1/0", theta, h)
