"""Laws that act briefly or narrowly are seen by every method, whatever their steps would be without them."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import atwood
import atwood_library as lib
from atwood import (
    Component,
    ExternalFunction,
    Load,
    Point,
    Scalar,
    Scene,
    connector,
    external,
    force,
    parameter,
    potential,
    simulate,
)

PLAIN = ("explicit", "taylor", "ida")
ALL = ("auto", *PLAIN, "gauss", "composition")
BOUND = {"ida": 3e-4}
"""Errors at the usual tolerances; of what is not named 1e-5."""


def on_a_line(potential: str | None = None, force: Any = None, speed: float = 1.0, x: float = 0.0) -> Scene:
    """Return one mass of 1 kg on a line for ten seconds, with a potential of its place or a force."""
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    mass = scene.add("mass", lib.Mass1D(mass=1.0))
    if potential is not None:
        field = scene.add("field", lib.Potential(energy_function=potential))
        scene.connect(field.point, mass.flange)
    if force is not None:
        push = scene.add("push", lib.Force(direction=(1, 0, 0), value=force))
        scene.connect(push.point, mass.flange)
    scene.start.update({"mass.displacement": x, "mass.speed": speed})
    return scene


class Bell(Component):
    """A hill at 2 m."""

    point: Point = connector(Point, "What is on it.")
    width: float = parameter(1.0, unit="m", doc="Its width.")

    @potential
    def hill(self) -> Scalar:
        return 0.45 * atwood.exp(-(((self.point.position.x - 2.0) / self.width) ** 2))


def delayed(potential: Any, at: float, width: float, speed: float = 1.0) -> float:
    """Return where a mass is after ten seconds that began at zero: the integral of one over the speed."""
    energy = 0.5 * speed**2

    def lost(x: float) -> float:
        return 1.0 / math.sqrt(2.0 * (energy - potential(x))) - 1.0 / speed

    edges = [at + k * width for k in (-8, -4, -2, -1, 0, 1, 2, 4, 8)]
    delay = sum(quad(lost, a, b, epsabs=1e-14)[0] for a, b in pairwise(edges))
    return speed * (10.0 - delay)


def impulse(force: Any, at: float, width: float) -> tuple[float, float]:
    """Return place and speed after ten seconds of 1 kg at rest that a force pushes about one moment."""
    edges = [at + k * width for k in (-40, -8, -4, -2, -1, 0, 1, 2, 4, 8, 40)]
    pairs = list(pairwise(edges))
    speed = sum(quad(force, a, b, epsabs=1e-14)[0] for a, b in pairs)
    return sum(quad(lambda t: (10.0 - t) * force(t), a, b, epsabs=1e-14)[0] for a, b in pairs), speed


@pytest.mark.sample(5)
@pytest.mark.parametrize("solver", ALL)
@pytest.mark.parametrize(("width", "height"), [(0.1, 0.45), (1e-4, 0.45), (1e-3, -3.0)])
def test_a_narrow_hill_or_well_is_crossed(solver: str, width: float, height: float) -> None:
    scene = on_a_line(f"{height}*exp(-((x-2)/{width})^2)")
    expected = delayed(lambda x: height * math.exp(-(((x - 2) / width) ** 2)), 2.0, width)
    result = simulate(scene, solver=solver)
    assert result["mass.displacement"][-1] == pytest.approx(expected, abs=BOUND.get(solver, 1e-5))
    assert result["mass.speed"][-1] == pytest.approx(1.0, abs=BOUND.get(solver, 1e-5))


@pytest.mark.parametrize("solver", ["auto", "taylor", "ida", "composition"])
def test_an_accuracy_that_is_asked_for_is_had_across_a_hill(solver: str) -> None:
    expected = delayed(lambda x: 0.45 * math.exp(-(((x - 2) / 0.1) ** 2)), 2.0, 0.1)
    result = simulate(on_a_line("0.45*exp(-((x-2)/0.1)^2)"), solver=solver, accuracy=1e-8)
    assert abs(result["mass.displacement"][-1] - expected) < 10 * 1e-8
    assert result.accuracy.reached < 1e-8


PULSES = {
    "tap": (lambda t: 1e2 * atwood.exp(-(((t - 5.123) / 5.6418958e-3) ** 2)), 5.123, 5.6418958e-3),
    "tap of a microsecond": (lambda t: 1e6 * atwood.exp(-(((t - 5.123) / 5.6418958e-7) ** 2)), 5.123, 5.6418958e-7),
    "edges": (lambda t: 50 * (atwood.tanh((t - 4) / 1e-3) - atwood.tanh((t - 4.01) / 1e-3)), 4.005, 5e-3),
    "burst": (lambda t: 1e3 * atwood.sin(3e3 * (t - 6)) * atwood.exp(-(((t - 6.001) / 2e-3) ** 2)), 6.001, 2e-3),
    "power": (lambda t: 50 * ((1 + atwood.cos(t - 4)) / 2) ** 100_000, 4.0, 6e-3),
    "bell of steps": (lambda t: 50 * (1 - atwood.tanh((t - 3) / 1e-3) ** 2), 3.0, 1e-3),
}


@pytest.mark.parametrize("solver", PLAIN)
@pytest.mark.parametrize("pulse", PULSES)
def test_a_brief_force_on_what_rests_is_felt(solver: str, pulse: str) -> None:
    force, at, width = PULSES[pulse]
    place, speed = impulse(force, at, width)
    result = simulate(on_a_line(force=force, speed=0.0), solver=solver)
    assert result["mass.speed"][-1] == pytest.approx(speed, abs=1e-6)
    assert result["mass.displacement"][-1] == pytest.approx(place, abs=1e-5)


@pytest.mark.parametrize("width", [1e-3, 1e-9])
@pytest.mark.parametrize("solver", ["explicit", "ida"])
def test_what_exponentials_divide_is_at_rest_where_these_are_large(solver: str, width: float) -> None:
    def edge(t: Any) -> Any:  # before 3.3 s
        return 1.0 / (1.0 + atwood.exp((t - 3.3) / width))

    def pulse(t: Any) -> Any:
        return 1.0 / (math.pi * width * atwood.cosh((t - 3.3) / width))

    for law, speed, place in ((edge, 3.3, 0.5 * 3.3**2 + 3.3 * 6.7), (pulse, 1.0, 6.7)):
        result = simulate(on_a_line(force=law, speed=0.0), solver=solver, outputs=2, max_steps=1000)
        assert result.status == "finished"
        assert result["mass.speed"][-1] == pytest.approx(speed, abs=2e-6)
        assert result["mass.displacement"][-1] == pytest.approx(place, abs=2e-5)


@pytest.mark.parametrize("solver", ["explicit", "ida"])
@pytest.mark.parametrize("width", [1e-9, 1e-8])
def test_a_roof_with_corners_is_crossed_however_narrow(width: float, solver: str) -> None:
    result = simulate(on_a_line(f"0.4*max(0, 1 - abs(x - 1.5)/{width})"), solver=solver, outputs=2)
    assert result["mass.speed"][-1] == pytest.approx(1.0, abs=1e-5)
    assert result["mass.displacement"][-1] == pytest.approx(10.0, abs=1e-4)


@pytest.mark.parametrize(
    "law",
    [
        lambda z: math.exp(100.0) / atwood.exp(100.0 + z * z),
        lambda z: math.exp(100.0) / (1.0 + atwood.exp(100.0 + z * z)),
        lambda z: atwood.exp(100.0 + 0.0 * z) / atwood.exp(100.0 + z * z),
        lambda z: 1.0 / (1e-45 * atwood.exp(103.6163291847 + z * z)),
    ],
)
@pytest.mark.parametrize("solver", ["explicit", "ida"])
def test_exponentials_as_divisors_are_large_beside_what_they_divide(solver: str, law: Any) -> None:
    """A tap of a millisecond was passed over where the exponent is large all the time."""
    result = simulate(on_a_line(force=lambda t: 1e3 * law((t - 2.3) * 1e3), speed=0.0), solver=solver, outputs=2)
    assert result["mass.speed"][-1] == pytest.approx(math.sqrt(math.pi), abs=1e-4)


def test_a_force_that_dies_away_slowly_beside_its_peak_is_felt() -> None:
    expected = 1e-3 * (math.atan(7e3) + math.atan(3e3))  # the integral of 1/(1 + s^2)
    for solver in PLAIN:
        result = simulate(on_a_line(force=lambda t: 1 / (1 + ((t - 3) / 1e-3) ** 2), speed=0.0), solver=solver)
        assert result["mass.speed"][-1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("solver", ["explicit", "ida"])
def test_a_bump_of_the_road_under_a_mass_at_rest_is_felt(form: str, solver: str) -> None:
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    ground = scene.add("ground", lib.Ground())
    road = scene.add("road", lib.Drive(motion=lambda t: 0.05 * atwood.exp(-(((t - 5.3) / 0.015) ** 2))))
    spring = scene.add("spring", lib.Spring(stiffness=40.0, natural_length=1.0))
    mass = scene.add("mass", lib.Mass1D(mass=1.0))
    scene.connect(ground.frame, road.a)
    scene.connect(road.b, spring.a)
    scene.connect(spring.b, mass.flange)
    scene.start.update({"mass.displacement": 1.0, "mass.speed": 0.0})
    w = math.sqrt(40.0)

    def pushed(t: float) -> float:
        return w * math.sin(w * (10.0 - t)) * 0.05 * math.exp(-(((t - 5.3) / 0.015) ** 2))

    expected = 1.0 + quad(pushed, 5.1, 5.5, points=[5.3], epsabs=1e-14)[0]
    result = simulate(scene, form=form, solver=solver)
    assert result["mass.displacement"][-1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.sample(5)
@pytest.mark.parametrize("solver", ALL)
def test_what_turns_back_within_a_narrow_wall_has_its_speed_again(solver: str) -> None:
    result = simulate(on_a_line("1e3*exp(-500*(3-x))"), solver=solver)
    assert result["mass.speed"][-1] == pytest.approx(-1.0, abs=BOUND.get(solver, 1e-5))


def in_a_plane(potential: str, velocity: tuple[float, float], scale: float = 1.0) -> Scene:
    scene = Scene(gravity=0.0, t_end=10.0)
    mass = scene.add("mass", lib.PointMass(mass=1.0))
    field = scene.add("field", lib.Potential(energy_function=potential))
    scene.connect(field.point, mass.point)
    for axis, speed in zip("xz", velocity, strict=True):
        scene.start.update({f"mass.position.{axis}": 0.0, f"mass.velocity.{axis}": scale * speed})
    return scene


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_ridge_across_the_way_is_felt_whatever_its_direction_and_size(form: str, scale: float) -> None:
    c, s = math.cos(0.7), math.sin(0.7)
    ridge = f"{0.3 * scale**2}*exp(-((x*{c}+z*{s}-{2 * scale})/{0.01 * scale})^2)"
    along = delayed(lambda x: 0.3 * math.exp(-(((x - 2) / 0.01) ** 2)), 2.0, 0.01)
    result = simulate(in_a_plane(ridge, (c, s), scale), form=form)
    assert result["mass.position.x"][-1] / scale == pytest.approx(along * c, abs=1e-6)


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ALL)
def test_what_passes_close_by_a_centre_is_turned_away(solver: str) -> None:
    near = 1e-3

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2:], -0.01 * y[:2] / np.hypot(*y[:2]) ** 3])

    exact = solve_ivp(rates, (0, 10), [-5, near, 1, 0], method="DOP853", rtol=1e-13, atol=1e-15, max_step=0.1).y[:, -1]
    scene = in_a_plane("-0.01/sqrt(x^2+z^2)", (1.0, 0.0))
    scene.start.update({"mass.position.x": -5.0, "mass.position.z": near})
    result = simulate(scene, solver=solver)
    assert result["mass.position.x"][-1] == pytest.approx(exact[0], abs=2e-4)
    assert result["mass.position.z"][-1] == pytest.approx(exact[1], abs=2e-4)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("solver", ["explicit", "ida"])
def test_a_small_magnet_on_the_way_of_a_pendulum_acts(form: str, solver: str) -> None:
    scene = Scene(t_end=3.0)
    ground, rod = scene.add("ground", lib.Ground()), scene.add("rod", lib.Rod(length=1.0))
    bob = scene.add("bob", lib.PointMass(mass=1.0))
    magnet = scene.add("magnet", lib.Potential(energy_function="-3*exp(-((x-0.5)^2+(z+0.8660254)^2)/2e-3^2)"))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(magnet.point, bob.point)
    scene.start.update({"rod.angle": "80 deg", "rod.angular_velocity": 0.0})
    result = simulate(scene, form=form, solver=solver)
    assert result["rod.angle"][-1] == pytest.approx(pendulum_over_a_magnet(), abs=1e-4)


@cache
def pendulum_over_a_magnet() -> float:
    """Return the angle after three seconds, by steps far shorter than the magnet is small."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        x, z = math.sin(y[0]), -math.cos(y[0])
        well = -3 * math.exp(-((x - 0.5) ** 2 + (z + 0.8660254) ** 2) / 4e-6)
        pull = well * (-2 / 4e-6) * ((x - 0.5) * math.cos(y[0]) + (z + 0.8660254) * math.sin(y[0]))
        return [y[1], -9.81 * math.sin(y[0]) - pull]

    start = [math.radians(80), 0]
    exact = solve_ivp(rates, (0, 3), start, method="DOP853", rtol=1e-12, atol=1e-13, max_step=2e-3)
    return float(exact.y[0, -1])


def place_after(potential: Any, seconds: float) -> float:
    """Return where a mass of 1 kg is that begins at zero with 1 m/s: time as an integral of place, turned round."""
    x = np.linspace(0.0, 20.0, 2_000_001)
    slowness = 1.0 / np.sqrt(1.0 + 2.0 * (potential(np.zeros(1)) - potential(x)))
    times = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1])) * x[1]])
    return float(np.interp(seconds, times, x))


UNEVEN = {
    "0.03*sqrt((x-2.2)^2+1e-6)": lambda x: 0.03 * np.sqrt((x - 2.2) ** 2 + 1e-6),
    "0.02*((x-2.2)^2+1e-6)^0.35": lambda x: 0.02 * ((x - 2.2) ** 2 + 1e-6) ** 0.35,
    "0.1*sin(200*x)*exp(-((x-5)/0.1)^2)": lambda x: 0.1 * np.sin(200 * x) * np.exp(-(((x - 5) / 0.1) ** 2)),
    "0.05*cos(300*x)/(1+((x-4)/0.2)^2)": lambda x: 0.05 * np.cos(300 * x) / (1 + ((x - 4) / 0.2) ** 2),
    "0.2*tanh((x-3)/0.002)": lambda x: 0.2 * np.tanh((x - 3) / 0.002),
    "0.001*sin(50*x)^2*x^2": lambda x: 0.001 * np.sin(50 * x) ** 2 * x**2,
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["gauss", "composition"])
@pytest.mark.parametrize("potential", UNEVEN)
def test_steps_of_fixed_length_see_corners_and_waves_farther_on(solver: str, potential: str) -> None:
    expected = place_after(UNEVEN[potential], 10.0)
    assert simulate(on_a_line(potential), solver=solver)["mass.displacement"][-1] == pytest.approx(expected, abs=3e-6)
    if solver == "composition":
        result = simulate(on_a_line(potential), solver=solver, accuracy=1e-7)
        assert result["mass.displacement"][-1] == pytest.approx(expected, abs=3e-6)


@pytest.mark.parametrize(("order", "rtol"), [(2, 1e-4), (4, 1e-6), (8, 1e-6)])
@pytest.mark.parametrize("solver", ["gauss", "composition"])
def test_a_corner_on_a_slanted_way_far_off_is_seen_with_any_order(solver: str, order: int, rtol: float) -> None:
    c, s = math.cos(0.7), math.sin(0.7)
    scene = in_a_plane(f"0.03*sqrt(((x-300)*{c}+(z-400)*{s}-2.2)^2+1e-6)", (c, s))
    scene.start.update({"mass.position.x": 300.0, "mass.position.z": 400.0})
    along = place_after(lambda x: 0.03 * np.sqrt((x - 2.2) ** 2 + 1e-6), 10.0)
    result = simulate(scene, solver=solver, order=order, rtol=rtol)
    assert result["mass.position.x"][-1] == pytest.approx(300.0 + c * along, abs=100 * rtol)


@pytest.mark.parametrize("solver", ["gauss", "composition"])
def test_steps_that_resolve_a_wave_or_a_spring_from_the_start_stay_equal(solver: str) -> None:
    from atwood_library.scenes import ElasticPendulum

    for scene in (on_a_line("0.2*cos(x)"), on_a_line("0.3*sin(5*x)"), ElasticPendulum()):
        assert simulate(scene, solver=solver).statistics.error_test_failures == 0


CHOICES = {
    "exp(-100*maximum(x-3,0.0))": lambda x: np.exp(-100 * np.maximum(x - 3, 0)),
    "0.1*tanh(select(x<3,(x-3)*40,(x-3)*4))": lambda x: 0.1 * np.tanh((x - 3) * np.where(x < 3, 40, 4)),
    "0.3*exp(-select(x<3, 9, (x-6)/0.01)^2)": lambda x: 0.3 * np.exp(-(np.where(x < 3, 9, (x - 6) / 0.01) ** 2)),
    "0.3*exp(-(asin((x-5)/20)/1e-3)^2)": lambda x: 0.3 * np.exp(-((np.arcsin((x - 5) / 20) / 1e-3) ** 2)),
    "0.3*exp(-acos((x-5)/20)^2)": lambda x: 0.3 * np.exp(-(np.arccos((x - 5) / 20) ** 2)),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("solver", ALL)
@pytest.mark.parametrize("potential", CHOICES)
def test_a_curved_function_of_a_choice_or_an_arc_holds_no_run_up(solver: str, potential: str) -> None:
    expected = place_after(CHOICES[potential], 10.0)
    result = simulate(on_a_line(potential), solver=solver, max_seconds=5)
    assert result["mass.displacement"][-1] == pytest.approx(expected, abs=BOUND.get(solver, 1e-5))


LARGE = {
    "0.3/cosh((x-3.3)/0.004)": lambda x: 0.3 / np.cosh(np.clip((x - 3.3) / 0.004, -700, 700)),
    "0.3/cosh((x-3.3)/0.004)^2": lambda x: 0.3 / np.cosh(np.clip((x - 3.3) / 0.004, -300, 300)) ** 2,
    "0.3/(1+exp(-(x-3)/0.002))": lambda x: 0.3 / (1 + np.exp(np.clip(-(x - 3) / 0.002, -700, 700))),
    "0.3*exp(-((x-3)/0.02)^2)*exp(-10*((x-3)/0.02))": lambda x: (
        0.3 * np.exp(-(((x - 3) / 0.02) ** 2) - 10 * (x - 3) / 0.02)
    ),
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["auto", "explicit", "ida", "gauss", "composition"])
@pytest.mark.parametrize("potential", LARGE)
def test_a_divisor_or_a_factor_too_large_for_a_number_is_no_bar(solver: str, potential: str) -> None:
    scale = math.exp(25.0) if "*exp(-10" in potential else 1.0  # the product's own height
    expected = place_after(lambda x: LARGE[potential](x) / scale, 10.0)
    result = simulate(on_a_line(f"({potential})/{scale!r}"), solver=solver)
    assert result["mass.displacement"][-1] == pytest.approx(expected, abs=BOUND.get(solver, 1e-5))


def test_sweeps_and_other_values_are_watched_with_their_own() -> None:
    def expected(width: float, speed: float) -> float:
        return delayed(lambda x: 0.45 * math.exp(-(((x - 2) / width) ** 2)), 2.0, width, speed)

    hill = in_a_plane("0.45*exp(-((x-2)/0.1)^2)", (1.0, 0.0))
    speeds = {"mass.velocity.x": [1.0, 1.5, 2.0]}
    found = atwood.sweep(hill, start=speeds, quantities=["mass.position.x"], t_end=10.0)
    assert found.statistics.batched == 3
    for speed, place in zip((1.0, 1.5, 2.0), found.quantities["mass.position.x"][:, -1], strict=True):
        assert place == pytest.approx(expected(0.1, speed), abs=1e-5)
    bell = Scene(space="line", gravity=0.0, t_end=10.0)
    mass, slope = bell.add("mass", lib.Mass1D(mass=1.0)), bell.add("bell", Bell(width=1e3))
    bell.connect(slope.point, mass.flange)
    bell.start.update({"mass.displacement": 0.0, "mass.speed": 1.0})
    first = atwood.assemble(bell)
    simulate(first)
    narrow = first.with_values({"bell.width": 1e-3})
    assert not narrow.why_new
    assert simulate(narrow)["mass.displacement"][-1] == pytest.approx(expected(1e-3, 1.0), abs=1e-5)


def test_laws_no_faster_than_coordinates_are_not_watched() -> None:
    from atwood.simulation.problem.curved_laws import find_curved
    from atwood_library.scenes import DoublePendulum, ElasticPendulum, FourBar, LagrangeTop

    for scene in (DoublePendulum(), FourBar(), ElasticPendulum(), LagrangeTop()):
        assert not find_curved(atwood.assemble(scene))


def slope_of_bell(x: float) -> float:
    return 90 * (x - 2) * math.exp(-(((x - 2) / 0.1) ** 2))


def bend_of_bell(x: float) -> float:
    return 90 * (1 - 200 * (x - 2) ** 2) * math.exp(-(((x - 2) / 0.1) ** 2))


TAP = ExternalFunction("tap", lambda t: 100 * math.exp(-(((t - 5.123) / 5.6418958e-3) ** 2)))
SLOPE = ExternalFunction("slope", slope_of_bell, (ExternalFunction("bend", bend_of_bell),))


class Pushed(Component):
    """A hill at 2 m, by a function in Python."""

    point: Point = connector(Point, "What is on it.")

    @force
    def push(self) -> list[Load]:
        return [Load(self.point, force=atwood.Vector(external(SLOPE, self.point.position.x), 0.0, 0.0))]


@pytest.mark.sample(2)
@pytest.mark.filterwarnings("ignore:.*is evaluated in Python")
@pytest.mark.parametrize("solver", ["explicit", "ida", "ida-sundae"])
def test_functions_in_python_are_sampled_and_that_is_said(solver: str) -> None:
    with pytest.warns(UserWarning, match="nothing is known of tap but samples"):
        result = simulate(on_a_line(force=lambda t: external(TAP, t), speed=0.0), solver=solver)
    assert result["mass.speed"][-1] == pytest.approx(100 * 5.6418958e-3 * math.sqrt(math.pi), abs=1e-6)
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    mass, hill = scene.add("mass", lib.Mass1D(mass=1.0)), scene.add("hill", Pushed())
    scene.connect(hill.point, mass.flange)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 1.0})
    with pytest.warns(UserWarning, match="nothing is known of slope but samples"):
        result = simulate(scene, solver=solver)
    expected = delayed(lambda x: 0.45 * math.exp(-(((x - 2) / 0.1) ** 2)), 2.0, 0.1)
    assert result["mass.displacement"][-1] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("solver", ["explicit", "ida"])
@pytest.mark.parametrize(
    ("depth", "centre", "start"), [(-0.45, 7.353191649647968, 10.0), (100.0, 4.911627301488903, 10.0)]
)
def test_a_narrow_well_or_roof_with_corners_keeps_energy_far_off(
    depth: float, centre: float, start: float, solver: str
) -> None:
    scene = on_a_line(f"{-depth}*max(0, 1 - abs(x - {start + centre})/1e-7)", x=start)
    result = simulate(scene, solver=solver, outputs=2, max_steps=1000)
    assert result["mass.speed"][-1] == pytest.approx(1.0, abs=3e-5)
    assert result["mass.displacement"][-1] == pytest.approx(start + 10.0, abs=2e-4)


def pushed_by_a_table(rows: list[tuple[float, float]], t_end: float) -> Scene:
    scene = Scene(space="line", gravity=0.0, t_end=t_end)
    mass, table = scene.add("mass", lib.Mass1D(mass=1.0)), scene.add("table", lib.Table(table=rows))
    push = scene.add("push", lib.Force(direction=(1, 0, 0)))
    scene.connect(table.output("value"), push.input("value"))
    scene.connect(push.point, mass.flange)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 0.0})
    return scene


@pytest.mark.parametrize("solver", PLAIN)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9])
def test_steep_flanks_of_tables_give_their_momentum(width: float, form: str, solver: str) -> None:
    rows = [(0.0, 0.3), (1.3, 0.3), (1.3 + width, -0.5), (2.7, -0.5), (2.7 + width, 0.3), (8.0, 0.3)]
    for t_end in (1.3 + 0.4 * width, 2.7 + width, 7.3):  # within a flank, at a corner, behind all
        speed = place = 0.0
        for (a, x), (b, y) in pairwise(rows):
            h = max(0.0, min(b, t_end) - a)
            slope = (y - x) / (b - a)
            place += speed * h + x * h**2 / 2 + slope * h**3 / 6
            speed += x * h + slope * h**2 / 2
        result = simulate(pushed_by_a_table(rows, t_end), form=form, solver=solver, outputs=2)
        assert result["mass.speed"][-1] == pytest.approx(speed, abs=BOUND.get(solver, 1e-5))
        assert result["mass.displacement"][-1] == pytest.approx(place, abs=BOUND.get(solver, 1e-5))
