"""Flows of functions, algebras of brackets, and generating functions with arcs and roots, against books."""

from typing import Any

import pytest
import sympy

from atwood import (
    UnsupportedError,
    UsageError,
    bracket_algebra,
    canonical_transformation,
    flow_of,
    generated_transformation,
    hamiltonian,
    poisson_bracket,
    poisson_brackets,
    simulate,
    total_derivative,
)
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library.scenes import SCENES

q, p, Q, P, s, m, k, w, t = sympy.symbols("q p Q P s m k omega t")
x, y, z, px, py, pz = sympy.symbols("x y z p_x p_y p_z")
ONE, SPACE = ((q,), (p,)), ((x, y, z), (px, py, pz))
L = (y * pz - z * py, z * px - x * pz, x * py - y * px)


def same(found: Any, expected: Any) -> bool:
    """Return whether expressions are equal: proven, or to fifty digits."""
    return vanishes([sympy.sympify(found) - expected]).holds


def test_angular_momentum_turns_and_momentum_shifts() -> None:
    turned = flow_of(L[2], SPACE, s)
    assert turned.coordinates == (x * sympy.cos(s) - y * sympy.sin(s), x * sympy.sin(s) + y * sympy.cos(s), z)
    assert same(turned.of(px**2 + py**2), px**2 + py**2)
    assert flow_of(px, SPACE, s).coordinates == (x + s, y, z)
    assert r"x &\to s + x" in flow_of(px, SPACE, s).latex()
    assert turned.transformation(["X", "Y", "Z"], ["A", "B", "C"]).is_canonical


def test_the_flow_of_h_is_the_motion() -> None:
    swing = flow_of(p**2 / (2 * m) + k * q**2 / 2, ONE, s)
    rate = sympy.sqrt(k / m)
    positive = {one: sympy.Symbol(one.name, positive=True) for one in (m, k)}
    expected = q * sympy.cos(rate * s) + p * sympy.sin(rate * s) / (m * rate)
    assert same(swing.coordinates[0].xreplace(positive), expected.xreplace(positive))
    moved = swing.transformation(["Q"], ["P"])
    assert moved.verdict.proven
    assert same(moved.inverse[q].xreplace({Q: swing.coordinates[0], P: swing.momenta[0]}), q)
    at = swing.integrated({q: 0.3, p: -0.2, m: 1.3, k: 2.0}, 1.7)
    numbers = {q: 0.3, p: -0.2, m: 1.3, k: 2.0, s: 1.7}
    assert at[q] == pytest.approx(float(swing.coordinates[0].subs(numbers)), abs=1e-10)
    fall = flow_of(p**2 / (2 * m) + m * k * q, ONE, s)
    assert same(fall.coordinates[0], q + p * s / m - k * s**2 / 2)


def test_two_masses_on_a_spring_swing_about_what_moves_evenly() -> None:
    """``x = (m x + M y + (p + w) s)/(m + M) + M/(m + M) ((x - y) cos + (p/m - w/M) sin/omega)``, as short."""
    M, w = sympy.symbols("M w")
    positive = {one: sympy.Symbol(one.name, positive=True) for one in (m, M, k)}
    h = p**2 / (2 * m) + w**2 / (2 * M) + k * (x - y) ** 2 / 2
    found = flow_of(h, ((x, y), (p, w)), s).coordinates[0].xreplace(positive)
    rate = sympy.sqrt(k * (m + M) / (m * M))
    swing = (x - y) * sympy.cos(rate * s) + (p / m - w / M) * sympy.sin(rate * s) / rate
    expected = ((m * x + M * y + (p + w) * s + M * swing) / (m + M)).xreplace(positive)
    assert same(found, expected)
    assert found.count_ops() < 150
    with pytest.raises(UnsupportedError, match="another formula on each side"):
        flow_of(p**2 + sympy.sqrt(q**2), ONE, s)


def test_a_series_and_the_run_of_a_scene() -> None:
    scene = SCENES["simple-pendulum"]()
    h = hamiltonian(scene)
    with pytest.raises(UnsupportedError, match="ever new functions"):
        flow_of(h.expression, h, s)
    series = flow_of(h.expression, h, s, order=6)
    (angle,), (momentum,) = h.coordinates, h.momenta
    begun = dict(zip((angle, momentum), (float(one[0]) for one in h.start()), strict=True))
    run = simulate(scene, t_end=0.1, outputs=[0.0, 0.1], rtol=1e-11)
    after = series.integrated({**begun, **h.values}, 0.1)[angle]
    assert after == pytest.approx(run["rod.angle"][-1], abs=1e-9)
    near = series.coordinates[0].subs({**begun, **h.values, s: 0.1})
    assert float(near) == pytest.approx(after, abs=1e-5)
    infinitesimal = flow_of(h.expression, h, s, order=1)
    assert same(infinitesimal.coordinates[0], angle + s * h.expression.diff(momentum))
    with pytest.raises(UsageError, match="to that order"):
        series.transformation(["Q"], ["P"])


def test_the_algebra_of_angular_momentum_and_of_kepler() -> None:
    found = bracket_algebra(SPACE, ["L_x", "L_y", "L_z"], L)
    assert found.closes
    assert found.brackets[0, 1] == sympy.Symbol("L_z")
    r, big = sympy.sqrt(x**2 + y**2 + z**2), sympy.Matrix([px, py, pz])
    h = (px**2 + py**2 + pz**2) / (2 * m) - k / r
    a = big.cross(sympy.Matrix(L)) - m * k * sympy.Matrix([x, y, z]) / r
    kepler = bracket_algebra(SPACE, ["H", "L_z", "A_x", "A_y"], [h, L[2], a[0], a[1]])
    assert not kepler.closes
    assert kepler.brackets[2, 3] == -2 * m * sympy.Symbol("H") * sympy.Symbol("L_z")
    assert kepler.brackets[0, 2] == 0
    assert r"\begin{array}" in kepler.latex()
    open_ = bracket_algebra(ONE, ["A", "B"], [q**2 * p, p**3])
    assert open_.left_over == (("A", "B"),)


def test_what_a_scene_conserves_and_poisson_s_theorem() -> None:
    h = hamiltonian(SCENES["kepler"]())
    found = bracket_algebra(h)
    assert tuple(map(str, found.names)) == ("h", "L", "A", "A_2")
    assert all(found.brackets[0, k] == 0 for k in range(4))
    for one in found.functions:
        assert total_derivative(one, h) == 0
    assert same(total_derivative(poisson_bracket(found.functions[2], found.functions[3], h), h), 0)


def test_jacobi_s_identity() -> None:
    def b(f: Any, g: Any) -> Any:
        return poisson_bracket(f, g, SPACE)

    f, g, h = x * py**2, L[0] * x, sympy.sin(z) * px
    assert vanishes([b(f, b(g, h)) + b(g, b(h, f)) + b(h, b(f, g))]).proven


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("f", "kind", "old"),
    [
        (P * sympy.asin(q / sympy.sqrt(2 * P)) + q * sympy.sqrt(2 * P - q**2) / 2, 2, "sin"),
        (
            P * sympy.asin(q * sympy.sqrt(m * w / (2 * P))) + q * sympy.sqrt(2 * m * w * P - (m * w * q) ** 2) / 2,
            2,
            "sin",
        ),
        (-P * sympy.acos(q / sympy.sqrt(2 * P)) + q * sympy.sqrt(2 * P - q**2) / 2, 2, "cos"),
        (m * w * q**2 * sympy.cot(Q) / 2, 1, "sin"),
    ],
)
def test_action_and_angle_from_generating_functions_with_arcs(f: Any, kind: int, old: str) -> None:
    found = generated_transformation(f, kind, ONE, [Q], [P])
    unit = m * w if f.has(w) else 1
    assert found.verdict.proven
    assert same(found.new_momenta[0], (p**2 / unit + unit * q**2) / 2)
    wave = sympy.sin if old == "sin" else sympy.cos
    positive = {one: sympy.Symbol(one.name, positive=True) for one in (m, w, P)}
    assert same(found.inverse[q].xreplace(positive), (sympy.sqrt(2 * P / unit) * wave(Q)).xreplace(positive))
    # The angle is that of a point on the circle, and goes on beyond a quarter turn.
    numbers = {q: sympy.Rational(3, 10), p: sympy.Rational(7, 10), m: 2, w: 3}
    angle = found.new_coordinates[0].subs(numbers)
    there = {Q: angle, P: found.new_momenta[0].subs(numbers), **numbers}
    assert float(found.inverse[p].subs({m: 2, w: 3}).subs({Q: there[Q], P: there[P]})) == pytest.approx(0.7, abs=1e-12)


def test_composition_and_inverse() -> None:
    first = canonical_transformation(ONE, {Q: q * sympy.exp(s)}, {P: p * sympy.exp(-s)})
    second = canonical_transformation(((Q,), (P,)), {"A": P}, {"B": -Q})
    both = first.then(second)
    assert both.new_coordinates == (p * sympy.exp(-s),)
    assert both.is_canonical
    assert both.inverse[q] == -sympy.Symbol("B") * sympy.exp(-s)
    back = first.then(first.inverted())
    assert same(back.new_coordinates[0], q)
    assert same(back.new_momenta[0], p)
    with pytest.raises(UsageError, match="begins with"):
        second.then(second)


def test_the_inverse_is_in_the_coordinates_of_the_scene() -> None:
    h = hamiltonian(SCENES["simple-pendulum"]())
    [theta], [momentum] = h.coordinates, h.momenta
    found = canonical_transformation(h, {Q: momentum}, {P: -theta})
    assert found.inverse == {theta: -P, momentum: Q}


def test_a_name_that_the_scene_has_not_is_an_error() -> None:
    h = hamiltonian(SCENES["simple-pendulum"]())
    with pytest.raises(UsageError, match="thetta is neither"):
        poisson_bracket("thetta", "p_theta", h)
    assert poisson_bracket("c*theta", "p_theta", h, constants=["c"]) == sympy.Symbol("c")
    with pytest.raises(UsageError, match="foo"):
        total_derivative("foo", h)
    with pytest.raises(UsageError, match=r"(?s)p_thetta is neither.*p_theta"):
        flow_of("p_thetta", h, s)
    [moved] = flow_of("c*p_theta", h, s, constants=["c"]).coordinates
    assert moved == h.coordinates[0] + sympy.Symbol("c") * s


def test_brackets_of_nothing_in_particular_are_the_fundamental_ones() -> None:
    h = hamiltonian(SCENES["double-pendulum"]())
    one, none = sympy.eye(2), sympy.zeros(2, 2)
    assert poisson_brackets(hamiltonian=h) == sympy.Matrix([[none, one], [-one, none]])
    with pytest.raises(UsageError, match="hamiltonian"):
        poisson_brackets()
