"""A page of formulas for each chapter of the course, as files; what stands there is what a book has, and no longer.

``python -m tests.theory.test_chapters`` writes the files in `tests/theory/chapters` anew.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sympy
from click.testing import CliRunner
from sympy import cos, diff, sin, sqrt

import atwood
from atwood.cli import main
from atwood.theory.formulas.reading import read_formula
from atwood_library.scenes import (
    ChargedParticle,
    DoubleAtwood,
    DoublePendulum,
    Kepler,
    LagrangeTop,
    RotatingHoopDriven,
    SimplePendulum,
)

HERE = Path(__file__).parent / "chapters"
POLAR = ("body.position.x=r*cos(phi)", "body.position.z=r*sin(phi)")
TWINS = {"rod1.length": "l", "rod2.length": "l", "bob1.mass": "m", "bob2.mass": "m"}
HANGING = {"rod1.angle": 0.0, "rod2.angle": 0.0}
COMMANDS: dict[str, list[list[str]]] = {
    "1-dynamics": [
        ["equations", "simple-pendulum", "--quantity", "rod.tension"],
        ["equations", "rotating-frame", "--solved", "--quantity", "observer.coriolis_force.x"],
    ],
    "2-lagrange": [
        ["equations", "double-pendulum"],
        ["equations", "spherical-pendulum", "--set", "coordinates=angles"],
        ["equations", "double-atwood"],
        ["equations", "rotating-hoop-driven"],
        ["equations", "simple-pendulum", "--form", "dae"],
    ],
    "3-noether": [["conserved", "kepler"], ["routhian", "lagrange-top"]],
    "4-small-oscillations": [
        ["equilibria", "rotating-hoop-driven", "--symbolic"],
        [
            *("modes", "double-pendulum", "--symbolic", "--at", "rod1.angle=0", "--at", "rod2.angle=0"),
            *(word for path, letter in TWINS.items() for word in ("--symbol", f"{path}={letter}")),
        ],
    ],
    "5-rigid-bodies": [
        ["equations", "lagrange-top", "--orientation", "euler-zxz"],
        ["rigid-body", "free-body"],
    ],
    "6-hamilton": [["hamiltonian", name] for name in ("double-pendulum", "charged-particle", "lagrange-top")],
    "7-hamilton-jacobi": [
        ["separation", "kepler", *(word for one in POLAR for word in ("--coordinate", one))],
        ["reduced", "kepler", *(word for one in POLAR for word in ("--old", one))],
    ],
}
"""Of each chapter the commands whose formulas are on its page."""


def rendered(chapter: str) -> str:
    """Return the page of a chapter: its commands, and what they write in LaTeX."""
    blocks = []
    for command in COMMANDS[chapter]:
        done = CliRunner().invoke(main, [*command, "--latex"], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        blocks.append(f"% atwood {' '.join(command)} --latex\n{done.stdout.strip()}\n")
    return "\n".join(blocks)


@pytest.mark.sample(3)
@pytest.mark.parametrize("chapter", COMMANDS)
def test_the_page_of_a_chapter_is_as_it_was_read(chapter: str) -> None:
    assert rendered(chapter) == (HERE / f"{chapter}.tex").read_text(encoding="utf-8")


def letters(eq: Any, *paths: str) -> list[Any]:
    return [eq.symbol(path) for path in paths]


def tension() -> tuple[Any, Any]:
    eq = atwood.equations(SimplePendulum())
    m, l, g = letters(eq, "bob.mass", "rod.length", "gravity")
    (theta,) = eq.coordinates
    return eq.quantity("rod.tension"), m * g * cos(theta) + m * l * diff(theta) ** 2


def kinetic_energy_of_two_rods() -> tuple[Any, Any]:
    eq = atwood.equations(DoublePendulum())
    m1, m2, l1, l2 = letters(eq, "bob1.mass", "bob2.mass", "rod1.length", "rod2.length")
    a, b = eq.coordinates
    first = (m1 + m2) * l1**2 * diff(a) ** 2 / 2
    return eq.kinetic_energy, first + m2 * l2**2 * diff(b) ** 2 / 2 + m2 * l1 * l2 * diff(a) * diff(b) * cos(a - b)


def machine() -> tuple[Any, Any]:
    eq = atwood.equations(DoubleAtwood())
    m1, m2, m3 = letters(eq, "m1.mass", "m2.mass", "m3.mass")
    a, b = map(diff, eq.coordinates)
    return eq.kinetic_energy, m1 * a**2 / 2 + m2 * b**2 / 2 + m3 * (2 * a + b) ** 2 / 2


def hoop() -> tuple[Any, Any]:
    eq = atwood.equations(RotatingHoopDriven())
    (theta,) = eq.coordinates
    solved = atwood.equations(RotatingHoopDriven(), solved=True).solved[eq.accelerations[0]]
    g, a, omega = (next(one for one in eq.values if str(one) == name) for name in ("g", "a", "omega"))
    return solved, g * sin(theta) / a + omega**2 * sin(theta) * cos(theta)


def angular_momentum() -> tuple[Any, Any]:
    found = atwood.conserved(Kepler())
    (one,) = (law for law in found if law.unit == "kg*m^2/s")
    x, z = (sympy.Function(name)(sympy.Symbol("t")) for name in "xz")
    made = sympy.sympify(one.expression)
    m = next(iter(made.free_symbols - {sympy.Symbol("t")}))
    sign = sympy.sign(made.subs({diff(z): 1, diff(x): 0, x: 1, z: 0, m: 1}))
    return made, sign * m * (x * diff(z) - z * diff(x))


def frequency() -> tuple[Any, Any]:
    modes = atwood.normal_modes(DoublePendulum(), at=HANGING, symbolic=True, symbols=TWINS)
    g, l = sympy.Symbol("g"), sympy.Symbol("l")
    made = modes.modes[0].square
    named = {one: sympy.Symbol(one.name) for one in made.free_symbols}
    return made.subs(named), (2 - sqrt(2)) * g / l


def momentum_of_the_top() -> tuple[Any, Any]:
    eq = atwood.equations(LagrangeTop(), orientation="euler-zxz")
    phi, theta, psi = eq.coordinates
    i1, i3, m, c = letters(eq, "top.moments.x", "top.moments.z", "top.mass", "top.center.z")
    return eq.kinetic_energy, (i1 + m * c**2) * (diff(theta) ** 2 + sin(theta) ** 2 * diff(phi) ** 2) / 2 + i3 * (
        diff(psi) + cos(theta) * diff(phi)
    ) ** 2 / 2


def energy_of_two_rods() -> tuple[Any, Any]:
    h = atwood.hamiltonian(DoublePendulum())
    m1, m2, l1, l2, g = (
        next(one for one in h.expression.free_symbols if str(one) == name) for name in ("m_1", "m_2", "l_1", "l_2", "g")
    )
    (a, b), (p, q) = h.coordinates, h.momenta
    above = m2 * l2**2 * p**2 + (m1 + m2) * l1**2 * q**2 - 2 * m2 * l1 * l2 * p * q * cos(a - b)
    kinetic = above / (2 * m2 * l1**2 * l2**2 * (m1 + m2 * sin(a - b) ** 2))
    return h.expression, kinetic - (m1 + m2) * g * l1 * cos(a) - m2 * g * l2 * cos(b)


def charge() -> tuple[Any, Any]:
    h = atwood.hamiltonian(ChargedParticle())
    by = {str(one): one for one in h.expression.free_symbols}
    (x, z), (p, q) = h.coordinates, h.momenta
    m, e, b, field = by["m"], by["q"], by["B"], by["E_z"]
    return h.expression, (p - e * b * z / 2) ** 2 / (2 * m) + (q + e * b * x / 2) ** 2 / (2 * m) - e * field * z


BOOK: list[tuple[Callable[[], tuple[Any, Any]], int]] = [
    (tension, 2),
    (kinetic_energy_of_two_rods, 3),
    (machine, 3),
    (hoop, 2),
    (angular_momentum, 2),
    (frequency, 1),
    (momentum_of_the_top, 3),
    (energy_of_two_rods, 4),
    (charge, 3),
]
"""What is written and what a book has, and how many terms that has."""


@pytest.mark.parametrize(("formula", "terms"), BOOK, ids=[one.__name__ for one, _ in BOOK])
def test_a_formula_is_the_books_and_has_no_more_terms(formula: Callable[[], tuple[Any, Any]], terms: int) -> None:
    made, book = formula()
    assert sympy.simplify(made - book) == 0
    assert len(read_formula(made).terms) <= terms


if __name__ == "__main__":
    HERE.mkdir(exist_ok=True)
    for chapter in COMMANDS:
        (HERE / f"{chapter}.tex").write_text(rendered(chapter), encoding="utf-8")
