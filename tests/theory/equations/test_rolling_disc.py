"""The rolling disc as books have it (Neimark and Fufaev, chapter III; Routh, Advanced Rigid Dynamics, art. 244)."""

import numpy as np
import pytest
import sympy

import atwood
from atwood_library.scenes import RollingDisc

NORMAL, ALONG_X = "contact.normal_force", "contact.friction_1"
m, r, g, t = sympy.symbols("m r g t")
phi, theta, psi = (sympy.Function(name)(t) for name in ("phi", "theta", "psi"))
turn, fall, spin = phi.diff(t), theta.diff(t), psi.diff(t) + phi.diff(t) * sympy.cos(theta)
ACROSS, ALONG = m * r**2 / 4, m * r**2 / 2
BOOK = [
    ACROSS * (turn.diff(t) * sympy.sin(theta) + 2 * turn * fall * sympy.cos(theta)) - ALONG * spin * fall,
    (ACROSS + m * r**2) * fall.diff(t)
    - ACROSS * turn**2 * sympy.sin(theta) * sympy.cos(theta)
    + (ALONG + m * r**2) * turn * spin * sympy.sin(theta)
    + m * g * r * sympy.cos(theta),
    (ALONG + m * r**2) * spin.diff(t) - m * r**2 * turn * fall * sympy.sin(theta),
]


@pytest.fixture(scope="module")
def equations():
    letters = {"contact.radius": "r", "disc.radius": "r"}
    return atwood.equations(RollingDisc(), orientation="euler-zxz", solved=True, symbols=letters)


def test_equations_and_accelerations_are_those_of_the_book(equations):
    rates = {turn.diff(t), fall.diff(t), psi.diff(t, 2)}
    [wanted] = sympy.solve(BOOK, rates, dict=True)
    for rate, found in equations.solved.items():
        assert sympy.simplify(found - wanted[rate]) == 0, rate
        assert len(sympy.Add.make_args(found)) <= len(sympy.Add.make_args(sympy.expand(wanted[rate])))
    first, second, third = equations.rows
    assert sympy.simplify(second - BOOK[1]) == sympy.simplify(third - BOOK[2]) == 0
    assert sympy.simplify(first - sympy.sin(theta) * BOOK[0] - sympy.cos(theta) * BOOK[2]) == 0
    assert not any(one.atoms(sympy.Pow) & {sympy.sqrt(sympy.sin(theta) ** 2)} for one in equations.rows)
    assert equations.potential_energy == m * g * r * sympy.sin(theta)


def test_reactions_are_the_rate_of_the_momentum(equations):
    """The centre is r sin(theta) above the table, and moves as it must to roll."""
    height = r * sympy.sin(theta)
    normal, along = (equations.quantity(path) for path in (NORMAL, ALONG_X))
    assert sympy.expand(normal - m * (g + height.diff(t, 2))) == 0
    assert len(sympy.Add.make_args(normal)) == 3
    forward, inward = psi.diff(t) + turn * sympy.cos(theta), fall * sympy.sin(theta)
    x = -r * forward * sympy.cos(phi) + r * inward * sympy.sin(phi)
    assert sympy.expand(along - m * x.diff(t)) == 0


def test_what_is_written_has_the_numbers_of_the_scene(equations):
    """Also at random states, and where it says that the sine has one sign, it says so in what is exported."""
    assert "sin theta is positive" in equations.python()
    assert "sin theta is positive" in equations.text()
    run = atwood.simulate(RollingDisc(), orientation="euler-zxz", t_end=0.5, rtol=1e-10)
    state = {phi: "disc.phi", theta: "disc.theta", psi: "disc.psi"}
    rates = {turn: "disc.phi_rate", fall: "disc.theta_rate", psi.diff(t): "disc.psi_rate"}
    own = {m: 0.5, r: 0.1, g: 9.81}
    normal = equations.quantity(NORMAL).xreplace(equations.solved).xreplace(own)
    numbers = sympy.lambdify([*rates, *state], normal, "numpy")(
        *(run[path] for path in (*rates.values(), *state.values()))
    )
    assert np.allclose(numbers, run[NORMAL], rtol=1e-6)
