"""Small oscillations as formulas, against books and against modes in numbers."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import sympy
from click.testing import CliRunner

import atwood
from atwood.cli.app import main
from atwood_library.scenes import (
    DoublePendulum,
    ElasticPendulum,
    MassSpringChain,
    PendulumOnCart,
    RotatingHoopDriven,
    SphericalPendulum,
    WilberforcePendulum,
)

from .scenes import chain, hanging, rotor, trap, turning_rod

g, l, k, m = sympy.symbols("g l k m", positive=True)


def plain(value: sympy.Expr) -> sympy.Expr:
    """Return an expression whose symbols are positive."""
    return value.subs({symbol: sympy.Symbol(symbol.name, positive=True) for symbol in value.free_symbols})


def squares(modes: atwood.SymbolicModes) -> list[sympy.Expr]:
    return [plain(one.square) for one in modes.modes]


def assert_same_numbers(scene: atwood.Scene, at: dict[str, float] | None, form: str = "reduced") -> None:
    """Formulas with the values of the scene are the modes in numbers, frequencies and shapes, to 1e-12."""
    formulas = atwood.normal_modes(atwood.assemble(scene, form=form), at=at, symbolic=True)
    rest = at if form == "reduced" and at is not None else dict(formulas.rest.numbers)
    numbers = atwood.normal_modes(scene, at=rest)
    rates = np.array([value for one in formulas.modes for value in one.number for _ in one.shapes])
    pairs = sorted(map(_pair, rates)), sorted(map(_pair, numbers.eigenvalues))
    assert np.allclose(*map(np.array, pairs), rtol=1e-12, atol=1e-12 * abs(rates).max())
    values = atwood.equations(scene, form=form).values
    for one in formulas.modes:
        for shape in one.shapes:
            found = np.array([complex(sympy.sympify(value).subs(values)).real for value in shape.values()])
            near = [
                j for j, rate in enumerate(numbers.eigenvalues) if abs(rate - one.number[0]) < 1e-9 * abs(rates).max()
            ]
            if form == "reduced" and numbers.shapes and list(numbers.shapes[0]) == list(shape):
                basis = numbers.matrix().real[:, near]
                left = found - basis @ np.linalg.lstsq(basis, found, rcond=None)[0]
                assert np.abs(left).max() <= 1e-10 * np.abs(found).max()


def _pair(value: complex) -> tuple[float, float]:
    return round(abs(value.imag), 9), round(abs(value.real), 9)


def test_two_equal_pendulums_have_the_frequencies_of_the_books() -> None:
    for names in (("upper", "lower"), ("b", "a")):
        modes = atwood.normal_modes(
            hanging(names), at=dict.fromkeys((f"{n}_rod.angle" for n in names), 0), symbolic=True
        )
        slow, fast = squares(modes)
        assert sympy.simplify(slow - (2 - sympy.sqrt(2)) * g / l) == 0
        assert sympy.simplify(fast - (2 + sympy.sqrt(2)) * g / l) == 0
        shapes = [list(one.shapes[0].values()) for one in modes.modes]
        assert shapes == [[1, sympy.sqrt(2)], [1, -sympy.sqrt(2)]]
        assert modes.rest.stable == True  # noqa: E712 - a truth value of sympy


def test_any_double_pendulum_is_that_of_landau_and_lifshitz() -> None:
    m1, m2, l1, l2 = sympy.symbols("m_1 m_2 l_1 l_2", positive=True)
    modes = atwood.normal_modes(DoublePendulum(), at={"rod1.angle": 0.0, "rod2.angle": 0.0}, symbolic=True)
    total = (m1 + m2) * (l1 + l2)
    root = sympy.sqrt((m1 + m2) * ((m1 + m2) * (l1 + l2) ** 2 - 4 * m1 * l1 * l2))
    for sign, square in zip((-1, 1), squares(modes), strict=True):
        book = g / (2 * m1 * l1 * l2) * (total + sign * root)  # section 23, problem 2
        assert sympy.expand((square - book).expand().subs(root, root)).equals(0)


@pytest.mark.sample(1)
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 11])
def test_masses_between_walls_have_sines_of_an_angle(count: int) -> None:
    modes = atwood.normal_modes(chain(count), symbolic=True)
    assert len(modes) == count
    for number, one in enumerate(modes.modes, 1):
        book = 4 * k / m * sympy.sin(number * sympy.pi / (2 * count + 2)) ** 2
        assert abs(sympy.N((plain(one.square) / book).subs({k: 3, m: 7}) - 1, 50)) < 1e-45
        (shape,) = one.shapes
        sines = [math.sin(number * math.pi * j / (count + 1)) for j in range(1, count + 1)]
        found = [float(value) for value in shape.values()]
        assert np.allclose(np.array(found) * sines[0], np.array(sines) * found[0], atol=1e-12)


def test_a_chain_with_a_free_end_has_every_other_sine_and_its_order_is_no_matter() -> None:
    for order in (1, -1):
        modes = atwood.normal_modes(chain(4, free_end=True, order=order), symbolic=True)
        for number, one in enumerate(modes.modes):
            book = 4 * k / m * sympy.sin((2 * number + 1) * sympy.pi / 18) ** 2
            assert abs(sympy.N((plain(one.square) / book).subs({k: 3, m: 7}) - 1, 50)) < 1e-45


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(3))
def test_formulas_are_the_numbers_for_any_parameters(seed: int) -> None:
    random = np.random.default_rng(seed)
    a, b, c, d = (float(x) for x in random.uniform(0.3, 3.0, 4))
    pendulum = DoublePendulum(length1=a, length2=b, mass1=c, mass2=d)
    for upper, lower in ((0.0, 0.0), (math.pi, 0.0), (math.pi, math.pi)):
        assert_same_numbers(pendulum, {"rod1.angle": upper, "rod2.angle": lower})
    assert_same_numbers(WilberforcePendulum(), None)
    assert_same_numbers(ElasticPendulum(stiffness=20.0 + a, natural_length=b, mass=c), None)
    assert_same_numbers(SphericalPendulum(length=a, mass=b), None)
    assert_same_numbers(chain(3, mass=a, stiffness=b), None)


def test_constraints_that_stay_give_the_same_frequencies() -> None:
    reduced = atwood.normal_modes(DoublePendulum(), at={"rod1.angle": 0.0, "rod2.angle": 0.0}, symbolic=True)
    dae = atwood.normal_modes(atwood.assemble(DoublePendulum(), form="dae"), symbolic=True)
    for one, other in zip(squares(reduced), squares(dae), strict=True):
        assert sympy.simplify(one - other) == 0


def test_the_bead_s_frequencies_about_the_bottom_and_aside() -> None:
    a, omega = sympy.symbols("a omega", positive=True)
    scene = RotatingHoopDriven()
    letters = {"hoop.radius": "a", "clock.slope": "omega", "bead.mass": "m"}
    (bottom,) = squares(atwood.normal_modes(scene, at={"hoop.angle": "180 deg"}, symbolic=True, symbols=letters))
    assert sympy.simplify(bottom - (g / a - omega**2)) == 0
    aside = {"hoop.angle": math.acos(-9.81 / 25.0)}
    (tilted,) = squares(atwood.normal_modes(scene, at=aside, symbolic=True, symbols=letters))
    assert sympy.simplify(tilted - (omega**2 - g**2 / (a**2 * omega**2))) == 0
    (mirrored,) = squares(atwood.normal_modes(scene, symbolic=True, symbols=letters))  # of two that mirror each other
    assert sympy.simplify(mirrored - tilted) == 0
    with pytest.raises(atwood.UsageError, match="0 of its states of rest have these values"):
        atwood.normal_modes(scene, at={"hoop.angle": 0.3}, symbolic=True)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_a_bead_on_a_spring_rests_on_both_sides_of_a_rod_that_turns(scale: float) -> None:
    """At ``k l/(k - m Omega^2)``, where ``k > m Omega^2``, and swings there with ``Omega_0^2 = k/m - Omega^2``."""
    scene = turning_rod(scale)
    omega = sympy.Symbol("Omega", positive=True)
    found = atwood.equilibria(scene, symbolic=True)
    there = k * l / (k - m * omega**2)
    for one, place in zip(found, (there, -there), strict=True):
        assert sympy.simplify(plain(one.values["rail.displacement"]) - place) == 0
    assert sorted(one.numbers["rail.displacement"] for one in found) == pytest.approx([-0.9 * scale, 0.9 * scale])
    assert all(one.stability == "stable" for one in found)
    (square,) = squares(atwood.normal_modes(scene, symbolic=True))
    assert sympy.simplify(square - (k / m - omega**2)) == 0


def test_normal_coordinates_make_both_energies_sums_of_squares_and_lead_back() -> None:
    modes = atwood.normal_modes(
        DoublePendulum(length2=0.7, mass1=1.3), at={"rod1.angle": 0, "rod2.angle": 0}, symbolic=True
    )
    a = modes.transformation
    values = atwood.equations(DoublePendulum(length2=0.7, mass1=1.3)).values
    number = {
        name: np.array(one.subs(values).tolist(), dtype=float)
        for name, one in (("a", a), ("m", modes.mass), ("k", modes.stiffness))
    }
    assert np.allclose(number["a"].T @ number["m"] @ number["a"], np.eye(2), atol=1e-13)
    omegas = [one.number[0].imag for one in modes.modes]
    assert np.allclose(number["a"].T @ number["k"] @ number["a"], np.diag(np.square(omegas)), atol=1e-12)
    away = {"rod1.angle": 0.1, "rod2.angle": -0.3}
    zeta = modes.to_normal(away)
    assert modes.from_normal(zeta) == pytest.approx(away, abs=1e-14)
    symbolic = modes.to_normal({"rod1.angle": sympy.Symbol("q")})
    assert symbolic[0].has(sympy.Symbol("q"))
    with pytest.raises(atwood.UsageError, match="independent"):
        modes.to_normal({"rod3.angle": 0.1})


def test_the_general_solution_begins_as_it_is_told_and_fulfils_the_equations() -> None:
    modes = atwood.normal_modes(hanging(), symbolic=True, at={"upper_rod.angle": 0, "lower_rod.angle": 0})
    t = sympy.Symbol("t")
    start, rate = {"upper_rod.angle": sympy.Rational(1, 10)}, {"lower_rod.angle": sympy.Rational(1, 5)}
    motion = modes.motion(start, rate)
    z = sympy.Matrix(list(motion.values()))
    values = atwood.equations(hanging()).values
    left = modes.mass * z.diff(t, 2) + modes.stiffness * z
    for instant in (0.0, 0.3, 1.7):
        assert max(abs(complex(one.subs(values).subs(t, instant))) for one in left) < 1e-12
    begin, speed = (one.subs(values).subs(t, 0.0) for one in (z, z.diff(t)))
    assert np.allclose(np.array(begin.tolist(), dtype=float).ravel(), [0.1, 0.0], atol=1e-15)
    assert np.allclose(np.array(speed.tolist(), dtype=float).ravel(), [0.0, 0.2], atol=1e-14)


def test_damped_masses_have_the_roots_of_the_characteristic_polynomial() -> None:
    scene = chain(2, mass=1.3, stiffness=7.0, damping=0.4)
    modes = atwood.normal_modes(scene, symbolic=True)
    c = sympy.Symbol("c", positive=True)
    found = {sympy.simplify(plain(one.rate)) for one in modes.modes}
    book = {
        sympy.simplify((-n * c + sign * sympy.sqrt(n**2 * c**2 - 4 * n * k * m)) / (2 * m))
        for n in (1, 3)
        for sign in (1, -1)
    }
    assert all(any(sympy.simplify(one - other) == 0 for other in book) for one in found)
    assert len(found) == 4
    assert modes.rest.stable == True  # noqa: E712
    (rest,) = atwood.equilibria(scene)
    numbers = atwood.normal_modes(scene, at=rest.values)
    told = {(round(value.real, 9), round(value.imag, 9)) for one in modes.modes for value in one.number}
    assert told == {(round(value.real, 9), round(value.imag, 9)) for value in numbers.eigenvalues}
    with pytest.raises(atwood.UnsupportedError, match="terms with velocities"):
        modes.to_normal({})


@pytest.mark.parametrize("scene", [trap(), trap(3.0, 3.0), trap(-1.0, -1.0, 4.0), chain(2, 1.3, 7.0, damping=0.4)])
@pytest.mark.sample(2)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_shapes_with_velocity_terms_solve_the_equations_and_are_those_in_numbers(
    scene: atwood.Scene, form: str
) -> None:
    modes = atwood.normal_modes(atwood.assemble(scene, form=form), at=None, symbolic=True)
    values = atwood.equations(scene, form=form).values
    terms = (modes.mass, modes.damping, modes.stiffness)
    m, c, k = (np.array(one.subs(values).tolist(), dtype=complex) for one in terms)
    numbers = atwood.normal_modes(scene, at=modes.rest.numbers)
    for one in modes.modes:
        (shape,) = one.shapes
        s = complex(sympy.sympify(one.rate).subs(values))
        z = np.array([complex(sympy.sympify(value).subs(values)) for value in shape.values()])
        assert np.abs((s**2 * m + s * c + k) @ z).max() < 1e-12 * np.abs(k @ z).max()
        j = int(np.argmin(abs(numbers.eigenvalues - one.number[0])))
        other = numbers.matrix()[:, j] if s.imag >= 0.0 else numbers.matrix()[:, j].conj()
        assert abs(z[0] * other[1] - z[1] * other[0]) < 1e-10 * np.abs(np.outer(z, other)).max()


def test_a_charge_in_a_round_trap_goes_round_to_both_sides() -> None:
    """Larmor: omega = sqrt(k/m + w^2) -+ w with w = e B/(2 m), on circles."""
    slow, fast = atwood.normal_modes(trap(3.0, 3.0), symbolic=True).modes
    e, mass = sympy.symbols("e m", positive=True)
    for sign, one in ((-1, slow), (1, fast)):
        book = (sympy.sqrt(3 / mass + (e / mass) ** 2) + sign * e / mass) ** 2
        assert sympy.simplify(plain(one.square) - book) == 0
        (shape,) = one.shapes
        across = complex(sympy.sympify(shape["body.position.z"]).subs({"e": 0.7, "m": 1.3}))
        assert abs(across) == pytest.approx(1.0, abs=1e-12)
        assert across.real == 0.0
    assert slow.shapes[0]["body.position.z"] != fast.shapes[0]["body.position.z"]


def test_a_rotor_s_polynomial_has_the_numbers_as_roots() -> None:
    modes, numbers = atwood.normal_modes(rotor(), symbolic=True), atwood.normal_modes(rotor())
    found = sorted(value.imag for one in modes.modes for value in one.number)
    assert found == pytest.approx(sorted(value.imag for value in numbers.eigenvalues), rel=1e-10)


def test_a_cart_is_free_and_its_pendulum_swings_faster() -> None:
    free, swinging = squares(atwood.normal_modes(PendulumOnCart(), symbolic=True))
    cart, bob = sympy.symbols("m_cart m_bob", positive=True)
    assert free == 0
    assert sympy.simplify(swinging - (cart + bob) * g / (cart * l)) == 0


def test_what_has_no_roots_in_closed_form_says_its_polynomial() -> None:
    scene = chain(3)
    scene.symbols.clear()
    modes = atwood.normal_modes(scene, symbolic=True)
    assert modes.modes[0].square is None
    assert sympy.degree(modes.modes[0].polynomial, sympy.Symbol("lambda")) == 3
    numbers = atwood.normal_modes(scene)
    assert np.allclose([one.imag for one in modes.modes[0].number], numbers.angular_frequencies, rtol=1e-12)
    with pytest.raises(atwood.UnsupportedError, match="no roots in closed form"):
        modes.motion({})


def test_the_commands_write_formulas() -> None:
    def ran(*arguments: str) -> str:
        done = CliRunner().invoke(main, arguments, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.stdout

    letters = [f"--symbol={path}={letter}" for path, letter in _EQUAL.items()]
    assert "(2 - √2) g / l" in ran("modes", "double-pendulum", "--symbolic", *letters)
    assert r"\omega_{1}^2 &= \frac{\left(2 - \sqrt{2}\right) g}{l}" in ran(
        "modes", "double-pendulum", "--symbolic", "--latex", *letters
    )
    data = json.loads(ran("modes", "mass-spring-chain", "--symbolic", "--json"))
    assert data["coordinates"] == ["m1.displacement", "m2.displacement"]
    assert "g > a ω²" in ran("equilibria", "rotating-hoop-driven", "--symbolic")
    assert r"\begin{tabular}" in ran("modes", "double-pendulum", "--latex")
    done = CliRunner().invoke(main, ("equilibria", "four-bar", "--symbolic"))
    assert done.exit_code != 0
    assert "symbolic" in done.output


_EQUAL = {"rod1.length": "l", "rod2.length": "l", "bob1.mass": "m", "bob2.mass": "m"}


def test_springs_of_one_letter_are_equal() -> None:
    letters = dict.fromkeys(("spring1.stiffness", "spring2.stiffness", "spring3.stiffness"), "k")
    letters |= {"m1.mass": "m", "m2.mass": "m"}
    slow, fast = squares(atwood.normal_modes(MassSpringChain(), symbolic=True, symbols=letters))
    assert (sympy.simplify(slow - k / m), sympy.simplify(fast - 3 * k / m)) == (0, 0)


def test_forces_of_a_deviation_without_potential_are_told_beside_v() -> None:
    """Drag at rest about a shaft that turns: ``-b Omega e_z x eta``, which is no slope of V."""
    found = atwood.normal_modes(rotor(), symbolic=True)
    eta_1, eta_2 = (sympy.Function(f"eta_{k}")(sympy.Symbol("t")) for k in (1, 2))
    b, omega = sympy.symbols("b Omega")
    first, second = found.circulatory
    assert sympy.expand(first**2 - (b * omega * eta_2) ** 2) == 0 == sympy.expand(second * eta_2 + first * eta_1)
    force = -found.stiffness * sympy.Matrix([eta_1, eta_2])
    slope = sympy.Matrix([found.energies[1].diff(one) for one in (eta_1, eta_2)])
    assert (force + slope - found.circulatory).expand().is_zero_matrix
    assert "circulatory forces" in found.as_text()
    assert "Q_{1} &=" in found.latex()
    assert "circulatory" not in atwood.normal_modes(chain(2), symbolic=True).as_text()
