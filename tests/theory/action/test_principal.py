"""Hamilton's principal function and action variables as formulas, against books, runs and quadratures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy

from atwood import (
    Scene,
    UnsupportedError,
    action_angle,
    boundary_value_motions,
    hamiltonian,
    principal_function,
)
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library import PointMass, Potential
from atwood_library.scenes import SCENES, Oscillators, SimplePendulum

m, k, a, g, l, E, t, u, u0 = sympy.symbols("m k a g l E t u u_0", positive=True)
K, EE = sympy.elliptic_k, sympy.elliptic_e


def positive(value: Any) -> Any:
    """Return an expression with positive letters in the place of those with their names."""
    letters = {one.name: one for one in (m, k, a, g, l, E, t, u, u0)}
    return value.xreplace({one: letters[one.name] for one in value.free_symbols if one.name in letters})


WAVE = sympy.sqrt(k / m)
BOOK = {
    "free": m * (u - u0) ** 2 / (2 * t),
    "harmonic": m * WAVE / (2 * sympy.sin(WAVE * t)) * ((u**2 + u0**2) * sympy.cos(WAVE * t) - 2 * u * u0),
    "inverted": m * WAVE / (2 * sympy.sinh(WAVE * t)) * ((u**2 + u0**2) * sympy.cosh(WAVE * t) - 2 * u * u0),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", BOOK)
def test_the_principal_function_of_one_coordinate(kind: str) -> None:
    """Landau and Lifshitz, Mechanics, section 43, and Goldstein, section 10.2; the action of a run is its number."""
    scene = Oscillators(kind=kind)
    h = hamiltonian(scene)
    found = principal_function(h)
    assert vanishes([positive(found.expression) - a**2 * BOOK[kind]]).holds
    assert "proven" in found.verdict
    start, end, span = 0.5, 0.8, 0.6
    [motion] = boundary_value_motions(scene, {"track.parameter": end}, t_end=span)
    there = {**{positive(one): value for one, value in h.values.items()}, u0: start, u: end, t: span}
    assert float(positive(found.expression).subs(there)) == pytest.approx(motion.action.value, rel=1e-9)
    [momentum] = found.momenta.values()
    assert float(positive(momentum).subs(there)) == pytest.approx(motion.action.gradient["track.parameter"], rel=1e-9)


def well(energy: str, place: float) -> Scene:
    """Return a mass of 1 kg on a line in a potential."""
    scene = Scene(gravity=0.0, space="line")
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(mass=1.0))
    scene.connect(field.point, body.point)
    scene.set("field.energy_function", energy)
    scene.start.update({"body.position.x": place, "body.velocity.x": 0.0})
    return scene


def test_the_principal_function_of_a_uniform_field() -> None:
    """``m (x - x_0)^2/(2 t) - m f t (x + x_0)/2 - m f^2 t^3/24`` with V = m f x (Goldstein, section 10.2)."""
    found = principal_function(hamiltonian(well("3*x", 0.0)))
    [x], [x0], [mass] = found.coordinates, found.starts, [sympy.Symbol("m")]
    time = sympy.Symbol("t")
    book = mass * (x - x0) ** 2 / (2 * time) - 3 * time * (x + x0) / 2 - 9 * time**3 / (24 * mass)
    assert vanishes([found.expression - book]).proven
    assert found.verdict == "proven for all values"


@pytest.mark.sample(0)
def test_the_principal_function_of_two_coordinates_and_of_fields() -> None:
    """Free in the plane; and a charge in E and B, whose action is that of its run."""
    scene = SCENES["charged-particle"]()
    h = hamiltonian(scene)
    found = principal_function(h)
    assert "proven" in found.verdict
    names = [str(one) for one in (*found.coordinates, *found.starts)]
    q0 = h.start()[0]
    end = q0 + np.array([0.2, 0.1])
    [motion, *_] = boundary_value_motions(scene, dict(zip(h.paths, map(float, end), strict=True)), t_end=0.5)
    there = {**h.values, **dict(zip(map(sympy.Symbol, names), (*end, *q0), strict=True)), sympy.Symbol("t"): 0.5}
    for one, path in zip(found.momenta.values(), h.paths, strict=True):
        assert float(one.subs(there)) == pytest.approx(motion.action.gradient[path], rel=1e-8)


def test_what_has_no_such_formula_names_the_term() -> None:
    with pytest.raises(UnsupportedError, match="m g l cos θ is left over"):
        principal_function(hamiltonian(SimplePendulum()))
    with pytest.raises(UnsupportedError, match=r"cos\(Ω t\).* is left over"):
        principal_function(hamiltonian(SCENES["driven-pendulum"]()))


@pytest.mark.sample(1)
@pytest.mark.parametrize("rate", [0.0, 9.0])
def test_the_pendulum_s_action_by_legendre_s_integrals(rate: float) -> None:
    """``J = 16 sqrt(g l) m l (E(k) - (1 - k^2) K(k))``, ``T = 4 sqrt(l/g) K(k)``, ``k^2 = (E + m g l)/(2 m g l)``.

    Where it goes round, with the inverse of k.
    """
    scene = SimplePendulum(release_angle=0.7)
    scene.start["rod.angular_velocity"] = rate
    found = action_angle(scene)
    square = (E + m * g * l) / (2 * m * g * l)
    swings = 16 * m * l * sympy.sqrt(g * l) * (EE(square) - (1 - square) * K(square)), 4 * sympy.sqrt(l / g) * K(square)
    top = sympy.sqrt(2 * m * l**2 * (E + m * g * l))
    turns = 4 * top * EE(1 / square), 4 * m * l**2 / top * K(1 / square)
    action, period = turns if rate else swings
    assert found.kind == ("rotation" if rate else "libration")
    assert vanishes([positive(found.action_formula) - action, positive(found.period_formula) - period]).holds
    there = {**found.hamiltonian.values, sympy.Symbol("E"): found.energy}
    assert float(found.action_formula.subs(there)) == pytest.approx(found.action, rel=1e-12)
    assert float(found.period_formula.subs(there)) == pytest.approx(found.period, rel=1e-12)
    assert "K(" in found.text()
    assert r"K\left(" in found.latex()
    assert vanishes([positive(found.action_formula).diff(E) - positive(found.period_formula)]).holds


@pytest.mark.sample(1)
@pytest.mark.parametrize(("energy", "away"), [("x**4 + x**2", 0.8), ("x**4 - 3*x**2", 0.5), ("x**4 - 3*x**2", 2.0)])
def test_wells_of_fourth_degree(energy: str, away: float) -> None:
    """Within one well, over the hill between two, and a hardening spring: formula beside quadrature."""
    found = action_angle(well(energy, away))
    there = {**found.hamiltonian.values, sympy.Symbol("E"): found.energy}
    assert float(found.action_formula.subs(there)) == pytest.approx(found.action, rel=1e-11)
    assert float(found.period_formula.subs(there)) == pytest.approx(found.period, rel=1e-11)


def test_where_no_integral_is_closed_there_is_no_formula() -> None:
    found = action_angle(well("x**4 + x**3 + x**2", 0.3))
    assert found.action_formula is None
    assert found.action > 0.0
