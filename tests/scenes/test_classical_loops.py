"""Scenes with closed loops, and driven ones, against published values and geometry."""

import math

import numpy as np
import pytest

from atwood import report, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def gap(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a) - np.asarray(b))))


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("name", "freedom"),
    [
        ("andrews-squeezer", 1),
        ("strandbeest", 1),
        ("scott-russell-lift", 2),
        ("car-axis", 2),
        ("double-cardan-twice", 1),
    ],
)
def test_degrees_of_freedom(name: str, freedom: int) -> None:
    assert report(SCENES[name]()).degrees_of_freedom == freedom


@pytest.mark.parametrize("form", FORMS)
def test_andrews_squeezer_meets_its_reference(form: str) -> None:
    """Own values with 20 trusted digits at 0.03 s; the published list is right to 9 digits."""
    result = simulate(SCENES["andrews-squeezer"](), form=form, rtol=1e-12, outputs=[0.0, 0.015, 0.03])
    at = result.at(-1)
    beta, theta, gamma = 15.81077119515370709712, -15.75637105841183946973, 0.04082224011964580485828
    phi, delta, epsilon = -0.5347301163420795937702, 0.5244099658799540693717, 1.048080741041937873069
    expected = {
        "k1.angle": beta,
        "k2.angle": beta + theta,
        "k3.angle": gamma,
        "k4.angle": phi + delta - 0.5 * math.pi,
        "k5.angle": delta,
        "k6.angle": epsilon - phi,
        "k7.angle": epsilon,
    }
    rates = {
        "k1.angular_velocity": 1139.920302259106064198,
        "k2.angular_velocity": 1139.920302259106064198 - 1424.379295177540073196,
        "k5.angular_speed": 0.5735699148295024538177,
        "k3.angular_speed": 11.03291191061859374533,
    }
    for path, value in expected.items():
        found = at[path]
        assert math.remainder(found - value, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-8 * 16.0), path
    for path, value in rates.items():
        assert at[path] == pytest.approx(value, abs=1e-8 * 1140.0 * 16.0), path


@pytest.mark.parametrize("form", FORMS)
def test_the_car_axis_meets_its_reference(form: str) -> None:
    result = simulate(SCENES["car-axis"](), form=form, rtol=1e-12, outputs=[0.0, 1.5, 3.0])
    at = result.at(-1)
    expected = {
        "left.position.x": 0.0493455784275240921315268,
        "left.position.z": 0.496989460230008106762934,
        "right.position.x": 1.04174252488542611519478,
        "right.position.z": 0.373911027265365819357898,
        "left.velocity.x": -0.0770583684035920842839406,
        "left.velocity.z": 0.00744686659206841649140175,
        "right.velocity.x": 0.0175568157535417366297406,
        "right.velocity.z": 0.770341043779601063120643,
    }
    for path, value in expected.items():
        assert at[path] == pytest.approx(value, abs=1e-8 if "position" in path else 1e-7), path


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_double_cardan_shaft_turns_evenly(form: str) -> None:
    scene = SCENES["double-cardan-twice"]()
    result = simulate(scene, form=form, rtol=1e-10)
    first = result.array("bearing1.angle")
    assert first[-1] > 2.0 * math.pi
    for name in ("bearing2", "bearing3"):
        assert gap(result.array(f"{name}.angle"), first) < 1e-9, name
    # the slanting shafts turn unevenly: tan(turn) = tan(angle)/cos(bend), twice a turn
    rate = np.sqrt(sum(result.array(f"slant1.angular_velocity.{axis}") ** 2 for axis in "xyz"))
    assert np.ptp(rate) > 0.05 * np.mean(rate)


def test_a_double_cardan_shaft_is_named_redundant() -> None:
    found = report(SCENES["double-cardan-twice"]())
    assert len(found.redundant) == 2
    assert all(any(name in str(one) for name in ("bearing", "cross")) for one in found.redundant)


@pytest.mark.parametrize("form", FORMS)
def test_the_lift_goes_straight_up(form: str) -> None:
    result = simulate(SCENES["scott-russell-lift"](), form=form, rtol=1e-11)
    foot, angle = result.array("track.displacement"), result.array("arm.angle")
    beam = result.array("beam.angle")
    top = foot + np.cos(beam)  # the beam is one metre long
    assert gap(top, 0.0) < 1e-12
    assert gap(foot, np.cos(angle)) < 1e-12
    assert np.ptp(np.sin(angle)) > 0.02
    assert result.energy.max_drift < 1e-8


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_feet_are_where_circles_meet(form: str) -> None:
    scene = SCENES["strandbeest"]()
    result = simulate(scene, form=form, rtol=1e-9, outputs=41)
    turned = result.array("crank.angle") - 0.5 * math.pi
    assert turned[-1] - turned[0] > 2.0 * math.pi
    for n, angle in enumerate(turned):
        places = scene.places(float(angle))  # type: ignore[attr-defined]
        for name in (
            f"{leg}_{joint}" for leg in ("left", "right") for joint in ("top", "back", "knee", "heel", "foot")
        ):
            x, z = places[name]
            assert result[f"{name}.position.x"][n] == pytest.approx(x, abs=1e-12), (name, n)
            assert result[f"{name}.position.z"][n] == pytest.approx(z, abs=1e-12), (name, n)
    assert result.energy.max_drift < 1e-6


def test_scenes_with_loops_are_parts_like_any_other() -> None:
    equations = assemble(SCENES["strandbeest"]()).reduced
    assert len(equations.coordinates) - len(equations.constraints) == 1
