"""States of rest as formulas, against books and against states that are found in numbers."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import sympy

import atwood
from atwood_library.scenes import (
    BallInShell,
    Bricard,
    Chain,
    DoublePendulum,
    ElasticPendulum,
    FourBar,
    MassSpringChain,
    PendulumOnCart,
    QuarterCar,
    RotatingHoopDriven,
    SliderCrank,
    SphericalPendulum,
)

from .scenes import chain, governor, hanging

g, a, m, M, k, l, omega = sympy.symbols("g a m M k l omega", positive=True)


def equal(one: sympy.Expr, other: sympy.Expr) -> bool:
    """Return whether two expressions are the same for positive parameters, angles up to whole turns."""
    positive = {symbol: sympy.Symbol(symbol.name, positive=True) for symbol in one.free_symbols}
    return bool(sympy.simplify(one.subs(positive) - other) % (2 * sympy.pi) == 0)


def same(one: sympy.Basic, other: sympy.Basic) -> bool:
    """Return whether two relations are the same for positive parameters."""
    positive = {symbol: sympy.Symbol(symbol.name, positive=True) for symbol in one.free_symbols}
    return bool(one.subs(positive).canonical == other.canonical)


def test_the_bead_on_a_hoop_has_a_tilted_state_from_a_rate_on() -> None:
    found = atwood.equilibria(
        RotatingHoopDriven(),
        symbolic=True,
        symbols={"hoop.radius": "a", "clock.slope": "omega", "hoop.angle": "theta", "bead.mass": "m"},
    )
    values = [one.values["hoop.angle"] for one in found]
    tilted = sympy.acos(-g / (a * omega**2))
    assert all(equal(*pair) for pair in zip(values, (sympy.S(0), sympy.pi, tilted, -tilted), strict=True))
    top, bottom, *both = found
    assert top.exists == bottom.exists == True  # noqa: E712 - truth values of sympy
    assert top.stable == False  # noqa: E712
    assert same(bottom.stable, a * omega**2 < g)
    for one in both:
        assert same(one.exists, g <= a * omega**2)
        assert same(one.stable, g < a * omega**2)
    assert [one.stability for one in found] == ["unstable", "unstable", "stable", "stable"]


@pytest.mark.sample(1)
@pytest.mark.parametrize("rate", [2.0, 3.0, 3.4, 7.0])
def test_the_hoop_s_formulas_are_the_numbers_of_newton_s_method(rate: float) -> None:
    scene = RotatingHoopDriven(rate=rate, radius=0.83)
    formulas = [one for one in atwood.equilibria(scene, symbolic=True) if one.stability != "does not exist"]
    numbers = {round(one.values["hoop.angle"] % (2 * math.pi), 6): one for one in atwood.equilibria(scene)}
    assert len(formulas) == len(numbers)
    for one in formulas:
        other = numbers[round(one.numbers["hoop.angle"] % (2 * math.pi), 6)]
        assert math.isclose(
            math.cos(one.numbers["hoop.angle"]), math.cos(other.values["hoop.angle"]), rel_tol=0.0, abs_tol=1e-12
        )
        assert one.stability == other.stability


def test_watt_s_governor_opens_from_a_rate_on() -> None:
    found = atwood.equilibria(governor(rate=12.0), symbolic=True)
    opened = [one for one in found if one.stability == "stable" and abs(one.numbers["guide.displacement"]) > 1e-9]
    cosine = (m + 2 * M) * g / (m * l * omega**2)  # of the arm from below; each ball bears half of a common sleeve
    assert len(opened) == 2
    for one in opened:
        assert equal(sympy.cos(one.values["arm.angle"]), -cosine)
        assert equal(one.values["guide.displacement"], 2 * l * cosine)
        assert same(one.exists, (m + 2 * M) * g <= m * l * omega**2) or one.exists.lhs.free_symbols
        assert one.stable == True  # noqa: E712
        number = (0.7 + 2.6) * 9.81 / (0.7 * 0.4 * 144.0)
        assert math.isclose(math.cos(one.numbers["arm.angle"]), -number, rel_tol=1e-13)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_double_pendulum_rests_in_four_places(form: str) -> None:
    found = atwood.equilibria(atwood.assemble(DoublePendulum(), form=form), symbolic=True)
    assert sorted(one.stability for one in found) == ["stable", "unstable", "unstable", "unstable"]
    (hanging_down,) = (one for one in found if one.stability == "stable")
    if form == "reduced":
        assert set(hanging_down.values.values()) == {sympy.S(0)}
    else:
        l1, l2 = sympy.symbols("l_1 l_2")
        assert hanging_down.values["bob2.position.z"] == -l1 - l2
        assert hanging_down.stable == True  # noqa: E712


def test_names_and_the_order_of_parts_change_nothing() -> None:
    for names in (("upper", "lower"), ("b", "a")):
        found = atwood.equilibria(hanging(names), symbolic=True)
        stable = [one for one in found if one.stable == True]  # noqa: E712
        assert len(found) == 4
        assert [tuple(one.values.values()) for one in stable] == [(0, 0)]
    for order in (1, -1):
        (rest,) = atwood.equilibria(chain(3, order=order), symbolic=True)
        assert rest.stable == True  # noqa: E712
        assert [rest.numbers[f"m{k}.displacement"] for k in (1, 2, 3)] == pytest.approx([1, 2, 3], abs=1e-13)


def test_springs_between_walls_are_solved_for_any_stiffness() -> None:
    random = np.random.default_rng(5)
    scene = MassSpringChain()
    (formulas,) = atwood.equilibria(scene, symbolic=True)
    symbol = atwood.equations(scene).symbol
    for _ in range(3):
        values = {f"spring{k}.{name}": float(random.uniform(0.5, 2.0)) for k in (1, 2, 3) for name in _SPRING}
        values["right.position.x"] = float(random.uniform(2.0, 4.0))
        for path, value in values.items():
            if not path.startswith("right"):
                part, name = path.split(".")
                setattr(getattr(scene, part), name, value)
        scene.right.position = (values["right.position.x"], 0.0, 0.0)
        (numbers,) = atwood.equilibria(scene)
        by = {symbol(path): value for path, value in values.items()}
        for path, value in formulas.values.items():
            assert math.isclose(float(value.subs(by)), numbers.values[path], rel_tol=1e-12, abs_tol=1e-12)


_SPRING = ("stiffness", "natural_length")


def test_a_mass_on_a_spring_stands_above_it_where_the_spring_is_strong() -> None:
    found = atwood.equilibria(ElasticPendulum(), symbolic=True)
    l0, above, below = sympy.Symbol("l_0", positive=True), *sorted(found, key=lambda one: one.stability)[::-1]
    assert equal(below.values["bob.position.z"], -l0 - m * g / k)
    assert below.stable == True  # noqa: E712
    assert equal(above.values["bob.position.z"], l0 - m * g / k)
    assert same(above.exists, m * g < k * l0)
    assert above.stable == False  # noqa: E712


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_spherical_pendulum_hangs_in_places_with_a_constraint(form: str) -> None:
    up, down = atwood.equilibria(atwood.assemble(SphericalPendulum(), form=form), symbolic=True)
    length = sympy.Symbol("l")
    assert (up.values["bob.position.z"], down.values["bob.position.z"]) == (length, -length)
    assert (up.stable, down.stable) == (False, True)


def test_what_may_stand_anywhere_is_free() -> None:
    down, up = atwood.equilibria(PendulumOnCart(), symbolic=True)
    assert len(down.free) == 1
    assert (down.stability, up.stability) == ("stable", "unstable")


@pytest.mark.sample(0)
def test_a_slider_crank_rests_where_its_crank_is_upright() -> None:
    found = atwood.equilibria(SliderCrank(), symbolic=True)
    there = [one for one in found if one.stability != "does not exist"]
    numbers = atwood.equilibria(SliderCrank())
    assert len(there) == len(numbers)
    assert {one.stability for one in there} == {"stable", "unstable"}


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (Bricard, "no closed form"),
        (FourBar, "no closed form"),
        (Chain, "more than 32"),
        (QuarterCar, "depend on time"),
        (BallInShell, "euler-zxz"),
    ],
)
def test_what_has_no_closed_form_is_refused_soon(scene: type, said: str) -> None:
    assembly = atwood.assemble(scene())
    start = time.process_time()
    with pytest.raises(atwood.UnsupportedError, match=said):
        atwood.equilibria(assembly, symbolic=True)
    assert time.process_time() - start < 20.0  # a second or two on a machine that does nothing else


def test_letters_and_regions_belong_to_one_kind_each() -> None:
    with pytest.raises(atwood.UsageError, match="Leave out the region"):
        atwood.equilibria(DoublePendulum(), symbolic=True, region={"rod1.angle": (0.0, 1.0)})  # type: ignore[call-overload]
    with pytest.raises(atwood.UsageError, match="symbolic=True"):
        atwood.equilibria(DoublePendulum(), symbols={"rod1.length": "l"})  # type: ignore[call-overload]


def test_they_are_written_as_a_table_in_latex_and_as_data() -> None:
    found = atwood.equilibria(RotatingHoopDriven(), symbolic=True)
    assert "g ≤ a ω²" in str(found)
    assert r"\theta = \arccos\left(-\frac{g}{a \omega^{2}}\right)" in found.latex()
    data = found.to_data()
    assert [one["stability"] for one in data] == ["unstable", "unstable", "stable", "stable"]
    assert data[2]["values"] == {"hoop.angle": "acos(-g/(a*omega**2))"}
