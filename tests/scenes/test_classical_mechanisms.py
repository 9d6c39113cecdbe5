"""Scenes of ropes, rigid bodies, oscillators and moving frames against their stated answers, in every form."""

import itertools
import math

import numpy as np
import pytest
from scipy.special import jv, yv

from atwood import Result, Scene, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS

TIGHT = 1e-12

STATES = {
    "rotating-frame": (4, 0),
    "falling-with-drag": (4, 0),
    "free-symmetric-body": (13, 0),
    "elastic-pendulum": (4, 0),
    "wilberforce-pendulum": (4, 0),
    "oscillators": (2, 0),
    "triple-atwood": (6, 0),
    "pulley-with-inertia": (2, 0),
    "swinging-atwood": (4, 0),
    "overhead-crane": (2, 0),
    "trebuchet": (6, 0),  # the sling is a gap, and closes no loop
}


@pytest.mark.parametrize("name", STATES)
def test_states(name: str) -> None:
    equations = assemble(SCENES[name]()).reduced
    assert (len(equations.coordinates) + len(equations.speeds), len(equations.constraints)) == STATES[name]


def gap(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a) - np.asarray(b))))


VARIANTS: list[tuple[str, dict[str, object], float]] = [
    ("rotating-frame", {}, 1e-8),
    ("rotating-frame", {"rate": -2.0, "speed_up": 0.0, "acceleration": 0.0, "mass": 3.0}, 1e-8),
    ("falling-with-drag", {}, 1e-8),
    ("falling-with-drag", {"law": "quadratic", "coefficient": 0.05}, 1e-8),
    ("wilberforce-pendulum", {"t_end": 20.0}, 2e-8),  # an angle of 6 rad
    ("oscillators", {"kind": "free"}, 1e-8),
    ("oscillators", {"kind": "harmonic", "radius": 0.4}, 1e-8),
    ("oscillators", {"kind": "inverted", "stiffness": 1.0}, 1e-8 * math.exp(5.0)),
    ("triple-atwood", {}, 1e-8),
    ("triple-atwood", {"mass1": 1.0, "mass4": 4.0}, 1e-8),
    ("pulley-with-inertia", {}, 1e-8),
    ("pulley-with-inertia", {"inertia": 0.2, "mass2": 3.0}, 1e-8),
]


@pytest.mark.sample(4)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("name", "settings", "bound"), VARIANTS)
def test_closed_forms(name: str, settings: dict[str, object], bound: float, form: str) -> None:
    scene = SCENES[name](**settings)
    result = simulate(scene, form=form, rtol=TIGHT)
    for path, values in scene.closed_form(result.time).items():  # type: ignore[attr-defined]
        assert gap(result.array(path), values) < bound, path
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_an_oscillator_on_a_circle_is_a_pendulum(form: str) -> None:
    result = simulate(SCENES["oscillators"](kind="pendulum", radius=0.7), form=form, rtol=TIGHT)
    # 1/2 p'^2 + (k/m)(1 - cos p) is kept
    p, rate = result.array("track.parameter"), result.array("track.rate")
    assert np.ptp(0.5 * rate**2 - 4.0 * np.cos(p)) < 1e-8
    pendulum = SCENES["simple-pendulum"](length=1.0, gravity=4.0, t_end=5.0)
    pendulum.start.update({"rod.angle": 0.5, "rod.angular_velocity": 0.3})
    assert gap(p, simulate(pendulum, form=form, rtol=TIGHT).array("rod.angle")) < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_the_forces_of_a_turning_frame_one_by_one(form: str) -> None:
    scene = SCENES["rotating-frame"](mass=1.7, t_end=2.0)
    result = simulate(scene, form=form, rtol=TIGHT)
    t = result.time
    rate, turn = 1.5 + 0.4 * t, 1.5 * t + 0.2 * t**2
    x, y = result.array("table.displacement_1"), result.array("table.displacement_2")
    vx, vy = result.array("table.speed_1"), result.array("table.speed_2")
    expected = {
        "translational_force": (-1.7 * 0.3 * np.cos(turn), 1.7 * 0.3 * np.sin(turn)),
        "euler_force": (1.7 * 0.4 * y, -1.7 * 0.4 * x),
        "coriolis_force": (2.0 * 1.7 * rate * vy, -2.0 * 1.7 * rate * vx),
        "centrifugal_force": (1.7 * rate**2 * x, 1.7 * rate**2 * y),
        "force": (0.0 * x, 0.0 * y),
        "position": (x, y),
        "velocity": (vx, vy),
    }
    for name, pair in expected.items():
        for axis, values in zip("xy", pair, strict=True):
            assert gap(result.array(f"observer.{name}.{axis}"), values) < 1e-7, name
    parts = ("force", "translational_force", "euler_force", "coriolis_force", "centrifugal_force")
    for axis in "xy":
        whole = sum(result.array(f"observer.{part}.{axis}") for part in parts)
        assert gap(1.7 * result.array(f"observer.acceleration.{axis}"), whole) < 1e-7


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("along", [1.6, 0.4])
def test_rates_of_a_symmetric_body(form: str, along: float) -> None:
    scene = SCENES["free-symmetric-body"](along=along)
    result = simulate(scene, form=form, rtol=TIGHT)
    in_body, outside = scene.rates()  # type: ignore[attr-defined]
    t = result.time
    across = along * 3.0 * math.tan(0.5)
    assert gap(result.array("body.spin.x"), -across * np.cos(in_body * t)) < 1e-8
    assert gap(result.array("body.spin.y"), -across * np.sin(in_body * t)) < 1e-8
    assert gap(result.array("body.z_axis.x"), math.sin(0.5) * np.cos(outside * t)) < 1e-8
    assert gap(result.array("body.z_axis.y"), math.sin(0.5) * np.sin(outside * t)) < 1e-8
    assert gap(result.array("angular_momentum.z"), along * 3.0 / math.cos(0.5)) < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_moments_and_tensions_of_rigid_bodies(form: str) -> None:
    scene = SCENES["rigid-bodies"](t_end=0.5)
    result = simulate(scene, form=form, rtol=1e-10, outputs=3)
    m, r, h, w = 1.2, 0.4, 0.5, 3.0
    x, y, z = 0.3, 0.5, 0.8
    moments = {
        "cuboid": (m * (y * y + z * z) / 12.0, m * (x * x + z * z) / 12.0, m * (x * x + y * y) / 12.0),
        "disc": (m * r * r / 4.0, m * r * r / 4.0, m * r * r / 2.0),
        "frame": (1.5 * m * r * r + 2.0 * m * h * h, 1.5 * m * r * r + 2.0 * m * h * h, 3.0 * m * r * r),
    }
    for name, values in moments.items():
        for axis, value in zip("xyz", values, strict=True):
            assert result[f"{name}.moments.{axis}"][0] == pytest.approx(value, rel=1e-9), (name, axis)
        assert result[f"{name}.angular_momentum.z"][-1] - result[f"{name}.center_of_mass.x"][-1] * result[
            f"{name}.momentum.y"
        ][-1] == pytest.approx(values[2] * w, rel=1e-7)
    # tensions of least size that give each mass its acceleration towards the axis
    places = scene.places()  # type: ignore[attr-defined]
    rods = list(itertools.combinations(range(5), 2))
    balance = np.zeros((15, len(rods)))
    for column, (i, j) in enumerate(rods):
        way = np.subtract(places[j], places[i]) / math.dist(places[i], places[j])
        balance[3 * i : 3 * i + 3, column], balance[3 * j : 3 * j + 3, column] = way, -way
    wanted = np.concatenate([[-m * w * w * p[0], -m * w * w * p[1], 0.0] for p in places])
    tensions = np.linalg.lstsq(balance, wanted, rcond=None)[0]
    for value, (i, j) in zip(tensions, rods, strict=True):
        assert result[f"frame.rod{i}{j}.tension"][0] == pytest.approx(value, abs=1e-7), (i, j)


@pytest.mark.parametrize("form", FORMS)
def test_an_elastic_pendulum_keeps_its_energy_and_goes_over_into_swinging(form: str) -> None:
    result = simulate(SCENES["elastic-pendulum"](), form=form, rtol=TIGHT)
    assert np.ptp(result.array("total_energy")) < 1e-7
    x, z = result.array("bob.position.x"), result.array("bob.position.z")
    vx, vz = result.array("bob.velocity.x"), result.array("bob.velocity.z")
    stretch = np.hypot(x, z) - 0.75
    assert np.ptp(0.5 * (vx**2 + vz**2) + 0.5 * 39.24 * stretch**2 + 9.81 * z) < 1e-7
    assert np.max(np.abs(x)) > 0.3


@pytest.mark.parametrize("form", FORMS)
def test_the_second_integral_of_the_swinging_machine(form: str) -> None:
    result = simulate(SCENES["swinging-atwood"](angle=1.0), form=form, rtol=TIGHT)
    r, rate = result.array("swing.displacement"), result.array("swing.speed")
    a, spin = result.array("hinge.angle"), result.array("hinge.angular_velocity")
    # Tufillaro's integral for M = 3 m: r^2 a' (r' cos(a/2) - r a' sin(a/2)/2) + g r^2 sin(a/2) cos(a/2)^2
    half = 0.5 * a
    second = r**2 * spin * (rate * np.cos(half) - 0.5 * r * spin * np.sin(half))
    second = second + 9.81 * r**2 * np.sin(half) * np.cos(half) ** 2
    assert np.ptp(second) < 1e-7
    assert np.ptp(r) > 0.1
    other = simulate(SCENES["swinging-atwood"](angle=1.0, ratio=2.0, t_end=1.0), form=form, rtol=1e-9)
    r, rate = other.array("swing.displacement"), other.array("swing.speed")
    a, spin = other.array("hinge.angle"), other.array("hinge.angular_velocity")
    second = r**2 * spin * (rate * np.cos(a / 2) - 0.5 * r * spin * np.sin(a / 2))
    assert np.ptp(second + 9.81 * r**2 * np.sin(a / 2) * np.cos(a / 2) ** 2) > 1e-2


def bessel(length: np.ndarray, hoist: float, sway: float, start: float) -> np.ndarray:
    """Return the small sway under a rope that is let out evenly."""
    s = 2.0 * np.sqrt(9.81 * length) / abs(hoist)
    first = 2.0 * math.sqrt(9.81 * start) / abs(hoist)
    # theta = (A J1 + B Y1)/sqrt(l), and no rate at the start: d(J1(s)/s)/ds = -J2(s)/s
    matrix = [[jv(1, first), yv(1, first)], [jv(2, first), yv(2, first)]]
    a, b = np.linalg.solve(matrix, [sway * math.sqrt(start), 0.0])
    return (a * jv(1, s) + b * yv(1, s)) / np.sqrt(length)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("hoist", [0.5, -0.2])
def test_the_sway_of_a_load_that_is_hoisted(form: str, hoist: float) -> None:
    sway = 1e-3
    result = simulate(SCENES["overhead-crane"](hoist=hoist, sway=sway), form=form, rtol=TIGHT)
    exact = bessel(4.0 + hoist * result.time, hoist, sway, 4.0)
    assert gap(result.array("hook.angle"), exact) < 1e-8
    assert np.ptp(exact) > sway


def test_a_trolley_that_starts_makes_the_load_hang_back() -> None:
    result = simulate(SCENES["overhead-crane"](hoist=0.0, sway=0.0, acceleration=0.5), rtol=1e-10)
    angle, rate = result.array("hook.angle"), result.array("hook.angular_velocity")
    energy = 0.5 * rate**2 * 4.0 - 9.81 * np.cos(angle) + 0.5 * np.sin(angle)
    assert np.ptp(energy) < 1e-8
    assert np.min(angle) == pytest.approx(-2.0 * math.atan(0.5 / 9.81), rel=1e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_trebuchet_keeps_its_energy_and_throws_a_parabola(form: str) -> None:
    scene = SCENES["trebuchet"](t_end=1.6)
    result: Result = simulate(scene, form=form, rtol=1e-11)
    assert np.ptp(result.array("total_energy")) < 1e-6 * 2e4
    (at,) = [one.time for one in result.events if "let go" in one.message]
    late = np.flatnonzero(result.time > at)
    first, t = late[0], result.time[late] - result.time[late[0]]
    x, z, vx, vz = (result.array(f"ball.{name}") for name in ("position.x", "position.z", "velocity.x", "velocity.z"))
    assert gap(x[late], x[first] + vx[first] * t) < 1e-7
    assert gap(z[late], z[first] + vz[first] * t - 0.5 * 9.81 * t**2) < 1e-7
    ranges = [scene.flight(x[i], z[i], vx[i], vz[i]) for i in late]  # type: ignore[attr-defined]
    assert np.ptp(ranges) < 1e-5
    assert ranges[0] < -100.0


def test_a_scene_is_a_part_like_any_other() -> None:
    for name in ("pulley-with-inertia", "trebuchet", "wilberforce-pendulum"):
        inner = SCENES[name](t_end=0.2)
        outer = Scene(space=inner.space, line_axis=inner.line_axis, gravity=inner.gravity)
        outer.add("inner", SCENES[name](t_end=0.2))
        alone, inside = (simulate(one, rtol=1e-9, t_end=0.2, outputs=3) for one in (inner, outer))
        for path in list(alone.paths)[::7]:
            assert gap(inside.array(f"inner.{path}"), alone.array(path)) < 1e-6 * (1.0 + np.max(np.abs(alone[path]))), (
                path
            )
