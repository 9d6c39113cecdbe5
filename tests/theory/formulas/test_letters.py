"""Letters of formulas: of declarations, of a scene, and of a call, which wins; paths stay as they are."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from atwood import (
    Component,
    Number,
    ParameterError,
    Point,
    Scene,
    UsageError,
    assemble,
    connect,
    connector,
    conserved,
    equations,
    from_data,
    hamiltonian,
    parameter,
    potential,
    reduced,
    routhian,
    simulate,
    to_data,
)
from atwood_library import Ground, PointMass, Potential, Rod, Spring
from atwood_library.scenes import (
    BeadOnSurface,
    ChargedParticle,
    DoublePendulum,
    MassSpringChain,
    Oscillators,
    OverheadCrane,
    PendulumOnCart,
    RotatingFrame,
    RotatingHoopDriven,
    RotatingHoopFree,
    SimplePendulum,
)

LETTERS = {"hoop.angle": "theta", "hoop.radius": "a"}


def names(scene: Scene, **given: object) -> dict[str, str]:
    """Return the letter of each path."""
    return {one.path: one.name for one in equations(scene, **given).legend}


def test_the_letters_of_a_call_win_over_those_of_the_scene() -> None:
    scene = RotatingHoopDriven()
    scene.symbols = {"hoop.angle": "φ", "clock.slope": "ω₀"}
    assert names(scene)["hoop.angle"] == "phi"
    assert names(scene)["clock.slope"] == "omega_0"
    assert names(scene, symbols=LETTERS)["hoop.angle"] == "theta"
    assert names(scene, symbols=LETTERS)["clock.slope"] == "omega_0"
    assert names(scene, symbols=LETTERS)["hoop.radius"] == "a"


def test_a_scene_keeps_its_letters_when_it_is_copied_and_written() -> None:
    scene = RotatingHoopDriven()
    scene.symbols["hoop.angle"] = "phi"
    assert dict(scene.copy().symbols) == dict(from_data(to_data(scene)).symbols) == {"hoop.angle": "phi"}
    assert not RotatingHoopDriven().symbols
    assert "symbols" not in str(to_data(RotatingHoopDriven()))


def test_paths_stay_as_they_are() -> None:
    eq = equations(RotatingHoopDriven(), symbols=LETTERS)
    assert str(eq.symbol("hoop.radius")) == "a"
    assert str(eq.symbol("hoop.angle")) == "theta(t)"
    assert {one["path"] for one in eq.to_dict()["symbols"]} == set(names(RotatingHoopDriven()))
    assert "a = 1.0  # hoop.radius" in eq.python().replace("a_ = ", "a = ")


def test_every_function_that_writes_formulas_takes_letters() -> None:
    scene = RotatingHoopFree()
    angle = next(path for path in names(scene) if path.endswith("hoop.angle"))
    given = {angle: "chi"}
    assert "p_chi" in str(hamiltonian(scene, symbols=given).expression)
    assert "chi" in str(routhian(scene, symbols=given).expression)
    assert "chi" in str(reduced(scene, symbols=given).routhian.expression)
    assert "chi" in str([one.expression for one in conserved(scene, symbols=given)])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"hoop.angel": "theta"}, "hoop.angle"),
        ({"hoop.angle": "m", "bead.mass": "m"}, "stands for it and for"),
        ({"hoop.angle": "t"}, "time"),
        ({"hoop.angle": "a b"}, "A letter has"),
        ({"bead.mass": "p_theta", "hoop.angle": "theta"}, "stands for it and for"),
    ],
)
def test_what_cannot_be_a_letter_is_refused(given: dict[str, str], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        equations(RotatingHoopDriven(), symbols=given)


def test_a_letter_in_a_scene_is_checked_when_it_is_given() -> None:
    scene = RotatingHoopDriven()
    with pytest.raises(UsageError, match="time"):
        scene.symbols["hoop.angle"] = "t"


def test_equal_parameters_may_share_a_letter_and_others_may_not() -> None:
    scene = MassSpringChain()
    given = {f"spring{i}.stiffness": "k" for i in (1, 2, 3)}
    eq = equations(scene, symbols=given)
    assert [one.path for one in eq.legend if one.name == "k"] == ["spring1.stiffness"]
    assert all(str(eq.symbol(path)) == "k" for path in given)
    scene.spring2.stiffness = 11.0
    with pytest.raises(UsageError, match="k stands for it and for spring1"):
        equations(scene, symbols=given)


def test_a_letter_for_the_parameter_of_a_scene_goes_where_it_is_passed_on() -> None:
    scene = MassSpringChain()
    eq = equations(scene, symbols={"stiffness": "K"})
    assert {str(eq.symbol(f"spring{i}.stiffness")) for i in (1, 2, 3)} == {"K"}
    scene.spring2.stiffness = 11.0
    eq = equations(scene, symbols={"stiffness": "K"})
    assert str(eq.symbol("spring2.stiffness")) != "K"
    assert eq.values[eq.symbol("spring2.stiffness")] == 11.0


def test_a_part_has_what_stands_below_its_letters() -> None:
    found = names(DoublePendulum(), symbols={"rod1": "a", "bob2": "b"})
    assert found["rod1.angle"] == "theta_a"
    assert found["rod1.length"] == "l_a"
    assert found["bob2.mass"] == "m_b"


def test_other_names_keep_clear_of_a_letter_that_was_given() -> None:
    found = names(DoublePendulum(), symbols={"bob1.mass": "theta_2"})
    assert found["bob1.mass"] == "theta_2"
    assert len(set(found.values())) == len(found)


class Well(Component):
    """A potential with letters of its own."""

    depth: Number = parameter(2.0, unit="N/m", doc="How steep it is.", symbol="kappa")
    place: tuple[float, float, float] = parameter((0.1, 0.2, 0.3), unit="m", size=3, doc="Where it is.", symbol="s")
    point: Point = connector(Point, "What is in it.")

    @potential
    def energy(self) -> object:
        """Return the energy."""
        r = self.point.position
        return 0.5 * self.depth * ((r.x - self.place[0]) ** 2 + (r.z - self.place[2]) ** 2)


def test_declarations_have_letters_and_their_components() -> None:
    scene = Scene()
    well, other = scene.add("well", Well()), scene.add("other", Well())
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(well.point, bob.point)
    scene.connect(other.point, bob.point)
    found = names(scene)
    assert {found["well.depth"], found["other.depth"]} == {"kappa_well", "kappa_other"}
    assert found["well.place.x"].startswith("s_x")
    assert names(scene, symbols={"well.place": "c"})["well.place.z"] == "c_z"


class Pair(Scene):
    """Two rods of one length, which has a letter."""

    length: Number = parameter(1.0, unit="m", doc="Length of both.", symbol="L")
    ground: Ground = Ground()
    rod1: Rod = Rod(length=length)
    rod2: Rod = Rod(length=length)
    bob1: PointMass = PointMass(mass=1.0)
    bob2: PointMass = PointMass(mass=2.0)
    spring: Spring = Spring()

    def build(self) -> None:
        """Hang one below the other."""
        self.connect(self.ground.frame, self.rod1.a)
        self.connect(self.rod1.b, self.bob1.point)
        self.connect(self.bob1.point, self.rod2.a)
        self.connect(self.rod2.b, self.bob2.point)
        self.connect(self.ground.frame, self.spring.a)
        self.connect(self.bob2.point, self.spring.b)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_parameter_with_a_letter_is_one_wherever_it_is_passed_on(form: str) -> None:
    eq = equations(Pair(), form=form)
    assert str(eq.symbol("rod1.length")) == str(eq.symbol("rod2.length")) == "L"
    assert eq.symbol("rod1.length") in eq.mass_matrix.free_symbols if form == "reduced" else True
    assert names(Pair(), form=form, symbols={"rod1.angle": "phi"}).get("rod1.angle", "phi") == "phi"


# -- parameters that functions take by name ---------------------------------------------------------------------------


def test_field_strengths_stay_letters_and_the_motion_is_as_before() -> None:
    scene = ChargedParticle(electric_x=0.25)
    eq = equations(scene)
    m, q, B, E_x, E_z, t = sympy.symbols("m q B E_x E_z t")
    x, z = eq.coordinates
    lorentz = q * B * (z * x.diff(t) - x * z.diff(t)) / 2 + q * (E_x * x + E_z * z)
    assert sympy.expand(eq.lagrangian - m * (x.diff(t) ** 2 + z.diff(t) ** 2) / 2 - lorentz) == 0
    run = simulate(scene, rtol=1e-11)
    for path, expected in scene.closed_form(run.time).items():
        assert np.allclose(run[path], expected, rtol=0.0, atol=1e-8)


def test_other_values_of_what_a_function_takes_by_name() -> None:
    made = assemble(ChargedParticle())
    other = made.with_values({"magnetic": 3.0})
    values = equations(other).values
    assert values[sympy.Symbol("B")] == 3.0
    assert other.shared is made.shared
    anew = simulate(ChargedParticle(magnetic=3.0), t_end=2.0)
    assert np.allclose(simulate(other, t_end=2.0)["particle.position.x"], anew["particle.position.x"], atol=1e-12)


def test_functions_with_letters_are_written_and_read_again() -> None:
    scene = from_data(to_data(ChargedParticle()))
    assert equations(scene).lagrangian == equations(ChargedParticle()).lagrangian
    scene = from_data(to_data(OverheadCrane()))
    assert equations(scene).lagrangian == equations(OverheadCrane()).lagrangian


def test_the_rate_of_a_frame_and_its_derivative_stay_letters() -> None:
    eq = equations(RotatingFrame())
    m, a, w, alpha, t = sympy.symbols("m a omega alpha t")
    x, y = eq.coordinates
    turn, rate = w * t + alpha * t**2 / 2, w + alpha * t
    along = x.diff(t) - rate * y + a * t * sympy.cos(turn)
    across = y.diff(t) + rate * x - a * t * sympy.sin(turn)
    difference = eq.kinetic_energy - m * (along**2 + across**2) / 2
    assert sympy.expand(difference).subs(sympy.sin(turn) ** 2, 1 - sympy.cos(turn) ** 2).expand() == 0


@pytest.mark.parametrize("kind", ["harmonic", "inverted", "pendulum"])
def test_oscillators_have_k_and_a(kind: str) -> None:
    eq = equations(Oscillators(kind=kind))
    assert {str(one) for one in eq.lagrangian.free_symbols} == {"m", "k", "a", "t"}


def test_parameters_of_a_surface_have_the_letters_of_its_shape() -> None:
    eq = equations(BeadOnSurface())
    theta, phi, a, m, t = *eq.coordinates, *sympy.symbols("a m t")
    book = m * a**2 * (theta.diff(t) ** 2 + sympy.sin(theta) ** 2 * phi.diff(t) ** 2) / 2
    assert [str(theta), str(phi)] == ["theta(t)", "phi(t)"]
    assert sympy.expand(eq.kinetic_energy - book) == 0
    assert "T = ½ m a² (θ̇² + φ̇² sin² θ)" in eq.text()


def test_a_function_may_not_take_what_the_model_around_does_not_have() -> None:
    scene = Scene()
    well = scene.add("well", Potential())
    well.energy_function = lambda x, *, stiffness: stiffness * x**2
    scene.connect(well.point, scene.add("bob", PointMass(mass=1.0)).point)
    with pytest.raises(ParameterError, match="stiffness"):
        equations(scene)


class Halved(Scene):
    """A pendulum on a pendulum of twice its length and half its mass."""

    length: Number = parameter(0.8, unit="m", above=0.0, doc="Length of the upper rod.", symbol="l")
    mass: Number = parameter(3.0, unit="kg", above=0.0, doc="Mass of the upper bob.", symbol="m")

    ground: Ground = Ground()
    rod1: Rod = Rod(length=length)
    rod2: Rod = Rod(length=length / 2)
    bob1: PointMass = PointMass(mass=mass / 3)
    bob2: PointMass = PointMass(mass=2 * mass / 3)
    connections = [
        connect(ground.frame, rod1.a),
        connect(rod1.b, bob1.point),
        connect(bob1.point, rod2.a),
        connect(rod2.b, bob2.point),
    ]
    start = {"rod1.angle": 0.3, "rod2.angle": 0.1}


def test_what_is_worked_out_from_a_letter_is_written_with_it() -> None:
    """``l/2`` has no letter of its own, nor has ``m/3``, of which m itself stands nowhere."""
    eq = equations(Halved())
    assert [one.name for one in eq.legend] == ["theta_1", "theta_2", "l", "g", "m"]
    l, m, g = (eq.symbol(path) for path in ("rod1.length", "mass", "gravity"))
    assert eq.symbol("rod2.length") == l / 2
    assert eq.symbol("bob2.mass") == 2 * m / 3
    assert eq.values == {l: 0.8, m: 3.0, g: 9.81}
    one, two = eq.coordinates
    assert sympy.expand(eq.potential_energy + m * g * l * (sympy.cos(one) + sympy.cos(two) / 3)) == 0
    assert "V = -⅓ m g l (3 cos θ₁ + cos θ₂)" in eq.text()
    numbers = equations(Halved(), parameters="values").potential_energy
    assert float((numbers - eq.potential_energy.subs(eq.values)).subs({one: 0.3, two: 0.1})) == pytest.approx(0.0)


def test_a_value_that_was_changed_keeps_a_letter_of_its_own() -> None:
    changed = assemble(Halved()).with_values({"rod2.length": 0.7})
    eq = equations(changed)
    assert "l_2" in [one.name for one in eq.legend]
    assert eq.values[eq.symbol("rod2.length")] == 0.7


def test_letters_given_to_a_part_win_over_what_its_value_is_worked_out_from() -> None:
    eq = equations(Halved(), symbols={"rod2.length": "b", "mass": "M"})
    assert str(eq.symbol("rod2.length")) == "b"
    assert str(eq.symbol("bob1.mass")) == "M/3"


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("kind", "signs"),
    [
        (PendulumOnCart, {"rod.angle": "-phi"}),
        (DoublePendulum, {"rod1.angle": "-phi", "rod2.angle": "-psi"}),
        (RotatingHoopDriven, {"hoop.angle": "-theta"}),
        (SimplePendulum, {"bob.position.z": "-h"}),
    ],
)
def test_a_coordinate_with_the_other_sign_is_a_change_of_coordinates(kind: type, signs: dict, form: str) -> None:
    """T, V, and constraints in ``-q``, with the signs of momenta and equations that belong to it."""
    plain = equations(kind(), form=form)
    paths = [one.path for one in plain.legend if one.kind == "coordinate"]
    signs = {path: letter for path, letter in signs.items() if path in paths}
    if not signs or not plain.is_readable:
        return
    other = equations(kind(), form=form, symbols=signs)
    by = {q: other.symbol(path) for path, q in zip(paths, plain.coordinates, strict=True)}
    factors = [-1 if path in signs else 1 for path in paths]

    def moved(value: sympy.Expr) -> sympy.Expr:
        return value.subs(by).doit()

    for name in ("kinetic_energy", "potential_energy", "lagrangian"):
        assert sympy.expand(moved(getattr(plain, name)) - getattr(other, name), trig=True) == 0
    for name in ("rows", "momenta", "rates"):
        for factor, one, turned in zip(factors, getattr(plain, name), getattr(other, name), strict=True):
            assert sympy.expand(factor * moved(one) - turned, trig=True) == 0
    for one, turned in zip(plain.constraints, other.constraints, strict=True):
        assert sympy.expand(moved(one) - turned, trig=True) == 0
    assert f"-{next(iter(signs))}" in other.text()


def test_a_sign_belongs_to_a_coordinate_of_equations() -> None:
    turned = equations(PendulumOnCart(), symbols={"rod.angle": "-phi"})
    assert turned.symbol("rod.angle") == -turned.symbol("-rod.angle") == -turned.coordinates[1]
    x, phi = turned.coordinates
    m, l, g = (turned.symbol(path) for path in ("bob.mass", "rod.length", "gravity"))
    t = sympy.Symbol("t")
    pull = m * (x.diff(t, 2) * sympy.sin(phi) + l * phi.diff(t) ** 2 + g * sympy.cos(phi))
    assert sympy.expand(turned.quantity("rod.tension") - pull) == 0
    with pytest.raises(UsageError, match="only such a one has another sign"):
        equations(PendulumOnCart(), symbols={"rod.length": "-b"})
    with pytest.raises(UsageError, match="-b"):
        hamiltonian(PendulumOnCart(), symbols={"rod.angle": "-b"})
