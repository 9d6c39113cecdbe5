"""Bifurcations of states of rest by kind, against books and against what there is on both sides in numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

import atwood
from atwood_library import Pivot, PointMass, Rod
from atwood_library.scenes import DoublePendulum, ElasticPendulum, RotatingHoopDriven, WilberforcePendulum

from .scenes import governor, rotor, torqued, trap, wire

g, a, omega, m, M, l, tau = sympy.symbols("g a omega m M l tau")


def kinds(found: atwood.SymbolicEquilibria) -> list[tuple[str, str]]:
    return [(one.sense, one.kind) for one in found.bifurcations]


def is_at(condition: sympy.Basic, zero: sympy.Expr) -> bool:
    """Return whether an equality says that something is zero."""
    return not sympy.cancel((condition.lhs - condition.rhs) / zero).free_symbols


def test_the_hoop_has_a_pitchfork() -> None:
    letters = {"hoop.radius": "a", "clock.slope": "omega"}
    found = atwood.equilibria(RotatingHoopDriven(), symbolic=True, symbols=letters)
    (one,) = found.bifurcations
    assert (one.sense, one.kind) == ("supercritical", "pitchfork")
    assert is_at(one.condition, g - a * omega**2)
    assert len(one.states) == 3
    assert "supercritical pitchfork  a ω² = g" in str(found)
    assert r"\text{pitchfork} &\quad a \omega^{2} = g" in found.latex()


def test_watt_s_governor_has_one_for_each_place_of_the_sleeve() -> None:
    found = atwood.equilibria(governor(), symbolic=True).bifurcations
    assert {(one.sense, one.kind) for one in found} == {("supercritical", "pitchfork")}
    assert any(is_at(one.condition, m * l * omega**2 - (m + 2 * M) * g) for one in found)


def test_a_pitchfork_whose_branches_are_unstable_is_subcritical() -> None:
    for height, sense in (("p**2/2-p**4/4", "subcritical"), ("p**2/2+p**4/4", "supercritical")):
        found = atwood.equilibria(wire(height), symbolic=True)
        assert kinds(found) == [(sense, "pitchfork")]
        assert is_at(found.bifurcations[0].condition, g - a * omega**2)


def test_what_is_unstable_beside_does_not_change_the_sense() -> None:
    """With an inverted pendulum in the scene both branches are unstable, and the pitchfork is what it was."""
    scene = RotatingHoopDriven()
    rod, bob = scene.add("rod", Rod(length=0.7)), scene.add("bob", PointMass(mass=1.4))
    axle = scene.add("axle", Pivot(axis=(0.0, 1.0, 0.0)))
    scene.connect(scene.ground.frame, axle.a)
    scene.connect(axle.b, rod.a)
    scene.connect(rod.b, bob.point)
    found = atwood.equilibria(scene, symbolic=True)
    assert set(kinds(found)) == {("supercritical", "pitchfork")}
    assert len(found.bifurcations) == 2


@pytest.mark.sample(1)
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_steady_torque_lifts_a_link_up_to_a_saddle_node(turn: float) -> None:
    (one,) = atwood.equilibria(torqued(turn * 2.0), symbolic=True).bifurcations
    assert one.kind == "saddle-node"
    assert is_at(one.condition, m * g * l - turn * 2 * tau)
    limit = 0.5 * 9.81 * 0.8
    assert len(atwood.equilibria(torqued(turn * 0.99 * limit))) == 2
    with pytest.raises(atwood.UsageError, match="no equilibrium"):
        atwood.equilibria(torqued(turn * 1.01 * limit))


def test_states_that_pass_each_other_exchange_their_stability() -> None:
    found = atwood.equilibria(wire("p**2/2+p**3/3"), symbolic=True)
    (one,) = found.bifurcations
    assert one.kind == "transcritical"
    assert is_at(one.condition, g - a * omega**2)
    slow, fast = (atwood.equilibria(wire("p**2/2+p**3/3", rate), symbolic=True) for rate in (3.0, 3.3))
    assert [state.stability for state in slow] == ["stable", "unstable"]
    assert [state.stability for state in fast] == ["unstable", "stable"]


def test_friction_inside_a_shaft_makes_it_whirl() -> None:
    """Above sqrt(k/m) (1 + b/c), c inside and b outside (Bolotin, Nonconservative Problems, section 3.3)."""
    found = atwood.equilibria(rotor(), symbolic=True)
    (one,) = found.bifurcations
    b, c, k, rate = sympy.symbols("b c k Omega")
    assert one.kind == "Hopf"
    assert is_at(one.condition, k * (b + c) ** 2 - m * rate**2 * c**2)
    limit = np.sqrt(4.0 / 1.3) * (1.0 + 0.3 / 0.2)
    growth = [max(atwood.normal_modes(rotor(share * limit)).growth_rates) for share in (0.999, 1.001)]
    assert growth[0] < 0.0 < growth[1]


def test_a_charge_on_a_hill_is_held_by_a_field_from_a_strength_on() -> None:
    """(e B)^2 = 4 m k, where both frequencies are one; of the field alone B is a number, 4."""
    found = atwood.equilibria(trap(-1.0, -1.0, 4.0), symbolic=True)
    (one,) = found.bifurcations
    assert one.kind == "Hamiltonian Hopf"
    assert is_at(one.condition, 4 * sympy.Symbol("e") ** 2 - m)


@pytest.mark.sample(2)
@pytest.mark.parametrize("scene", [DoublePendulum, WilberforcePendulum, ElasticPendulum])
def test_where_nothing_branches_off_nothing_is_said(scene: type) -> None:
    found = atwood.equilibria(scene(), symbolic=True)
    assert found.bifurcations == ()
    assert "bifurcation" not in str(found)
