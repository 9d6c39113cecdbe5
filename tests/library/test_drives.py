"""One-dimensional drives against closed forms, in every form and space that they have."""

from math import cos, exp, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import Scene, simulate
from atwood_library import (
    FirstOrder,
    Gear,
    Ground,
    Inertia,
    Link,
    Mass1D,
    Pivot,
    PlanetaryGear,
    RackAndPinion,
    RotationalCoupling,
    RotationalGap,
    RotationalMaxwell,
    RotationalMotion,
    RotationalResistance,
    RotationalSource,
    RotationalSpringDamper,
    Sine,
    TranslationalCoupling,
    TranslationalGap,
    TranslationalMaxwell,
    TranslationalMotion,
    TranslationalResistance,
    TranslationalSource,
    TranslationalSpringDamper,
)

BOTH = ["rotational", "translational"]
EVERY = [("reduced", "plane"), ("dae", "plane"), ("reduced", "space"), ("dae", "space")]
PARTS: dict[str, dict[str, Any]] = {
    "rotational": {
        "spring": RotationalSpringDamper, "maxwell": RotationalMaxwell, "gap": RotationalGap,
        "resistance": RotationalResistance, "source": RotationalSource, "coupling": RotationalCoupling,
        "motion": RotationalMotion,
    },
    "translational": {
        "spring": TranslationalSpringDamper, "maxwell": TranslationalMaxwell, "gap": TranslationalGap,
        "resistance": TranslationalResistance, "source": TranslationalSource, "coupling": TranslationalCoupling,
        "motion": TranslationalMotion,
    },
}  # fmt: skip


class Drive:
    """A scene of rotors, or of masses on a line, of one domain."""

    def __init__(self, domain: str, space: str = "plane") -> None:
        self.domain, self.parts = domain, PARTS[domain]
        self.scene = Scene(space=space, gravity=0.0)
        self.place, self.rate = ("angle", "angular_velocity") if domain == "rotational" else ("displacement", "speed")

    def body(self, name: str, inertia: float, place: float | None = 0.0, rate: float | None = 0.0) -> Any:
        """Add a rotor, or a mass, and return its flange."""
        if self.domain == "rotational":
            flange = self.scene.add(name, Inertia(moment=inertia)).flange
        else:
            flange = self.scene.add(name, Mass1D(mass=inertia)).slide
        if place is not None:
            self.scene.start[f"{name}.{self.place}"] = place
        if rate is not None:
            self.scene.start[f"{name}.{self.rate}"] = rate
        return flange

    def join(self, name: str, kind: str, b: Any, a: Any = None, **values: Any) -> Any:
        """Add a part on b, against a or the ground."""
        if kind != "coupling":
            values["against"] = "ground" if a is None else "flange"
        part = self.scene.add(name, self.parts[kind](**values))
        self.scene.connect(b, part.b)
        if a is not None:
            self.scene.connect(a, part.a)
        return part


def combinations(*domains: str) -> list[tuple[str, str, str]]:
    """Return domains with forms and spaces; a mass on a line is none of space."""
    return [(d, f, s) for d in domains or BOTH for f, s in EVERY if d == "rotational" or s == "plane"]


@pytest.mark.parametrize(("domain", "form", "space"), combinations())
def test_two_bodies_on_a_spring_and_a_damper(domain: str, form: str, space: str) -> None:
    """The difference is a damped oscillator with the reduced inertia; the centre moves evenly."""
    drive = Drive(domain, space)
    a, b = drive.body("a", 2.0, 0.0, 0.5), drive.body("b", 3.0, 0.4, 0.0)
    drive.join("spring", "spring", b, a, stiffness=30.0, damping=0.6, natural=0.1)
    result = simulate(drive.scene, t_end=2.0, form=form, rtol=1e-10)
    t, mu = result.time, 6.0 / 5.0
    decay, w = 0.3 / mu, sqrt(30.0 / mu - (0.3 / mu) ** 2)
    x0, v0 = 0.3, -0.5
    expected = 0.1 + np.exp(-decay * t) * (x0 * np.cos(w * t) + (v0 + decay * x0) / w * np.sin(w * t))
    assert_allclose(result["spring.extension"], expected, atol=2e-7)
    centre = (2.0 * result[f"a.{drive.place}"] + 3.0 * result[f"b.{drive.place}"]) / 5.0
    assert_allclose(centre, 0.24 + 0.2 * t, atol=2e-7)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize(("domain", "form", "space"), combinations())
def test_a_spring_and_a_damper_in_series_relax(domain: str, form: str, space: str) -> None:
    """At a constant extension the force dies away in d/k; here one end is moved evenly, and the force tends to d v."""
    drive = Drive(domain, space)
    b = drive.body("b", 1.0, None, None)
    drive.join("drive", "motion", b, place=lambda t: 0.2 * t)
    drive.join("series", "maxwell", b, stiffness=5.0, damping=2.0)
    result = simulate(drive.scene, t_end=2.0, form=form, rtol=1e-10)
    force = result["series.torque" if domain == "rotational" else "series.force"]
    assert_allclose(force, 0.4 * (1.0 - np.exp(-2.5 * result.time)), atol=1e-7)


@pytest.mark.parametrize(("domain", "form", "space"), combinations())
def test_a_source_against_a_resistance(domain: str, form: str, space: str) -> None:
    """``J w' = M - k w^2`` from rest gives ``w = sqrt(M/k) tanh(t sqrt(M k)/J)``."""
    drive = Drive(domain, space)
    b = drive.body("b", 2.0)
    drive.join("motor", "source", b, value=3.0)
    drive.join("fan", "resistance", b, quadratic=0.5)
    result = simulate(drive.scene, t_end=4.0, form=form, rtol=1e-10)
    expected = sqrt(6.0) * np.tanh(result.time * sqrt(1.5) / 2.0)
    assert_allclose(result[f"b.{drive.rate}"], expected, atol=1e-7)
    assert_allclose(result["motor.power"], 3.0 * expected, atol=3e-7)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("domain", BOTH)
def test_a_resistance_takes_a_constant_power_or_force_at_its_level(domain: str) -> None:
    """``2 w' = -P/w`` gives ``w^2 = w0^2 - P t``, and ``2 w' = -c`` a straight line; below the limit both decay."""
    drive = Drive(domain)
    a, b, c = (drive.body(name, 2.0) for name in "abc")
    drive.join("power", "resistance", a, power=3.0, smooth_below=0.5)
    drive.join("dry", "resistance", b, constant=4.0, smooth_below=0.5)
    drive.join("half", "resistance", c, constant=4.0, smooth_below=0.5, level=0.5)
    for name in "abc":
        drive.scene.start[f"{name}.{drive.rate}"] = 2.5
    result = simulate(drive.scene, t_end=2.0, rtol=1e-10)
    t = result.time

    def straight(slope: float) -> np.ndarray:
        """Return the speed under a constant deceleration, and its decay from 0.5 on."""
        since = t - 2.0 / slope
        return np.where(since < 0.0, 0.5 - slope * since, 0.5 * np.exp(-slope * np.maximum(since, 0.0) / 0.5))

    late = (2.5**2 - 0.5**2) / 3.0
    expected = np.where(t < late, np.sqrt(np.maximum(2.5**2 - 3.0 * t, 0.25)), 0.5 * np.exp(-6.0 * (t - late)))
    assert_allclose(result[f"a.{drive.rate}"], expected, atol=1e-6)
    assert_allclose(result[f"b.{drive.rate}"], straight(2.0), atol=1e-6)
    assert_allclose(result[f"c.{drive.rate}"], straight(1.0), atol=1e-6)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("domain", BOTH)
def test_a_source_may_follow_a_law_of_displacement_rate_and_time(domain: str, form: str) -> None:
    """``v' = -v^3`` gives ``v = v0/sqrt(1 + 2 v0^2 t)``; a spring by a law, driven, oscillates as one."""
    drive = Drive(domain)
    a, b, c = drive.body("a", 2.0, 0.0, 1.5), drive.body("b", 3.0, 0.4), drive.body("c", 1.0)
    drive.join("brake", "source", a, law="-2*v**3")
    drive.join("spring", "source", b, c, law=lambda x, v, t: -12.0 * x + 0.6 * t, value=0.3)
    result = simulate(drive.scene, t_end=2.0, form=form, rtol=1e-10)
    t = result.time
    assert_allclose(result[f"a.{drive.rate}"], 1.5 / np.sqrt(1.0 + 4.5 * t), atol=1e-7)
    w = sqrt(12.0 / 0.75)
    between = 0.025 + 0.05 * t + 0.375 * np.cos(w * t) - 0.05 / w * np.sin(w * t)
    assert_allclose(result[f"b.{drive.place}"] - result[f"c.{drive.place}"], between, atol=1e-7)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize(("domain", "form", "space"), combinations())
def test_a_source_between_two_bodies_follows_a_command(domain: str, form: str, space: str) -> None:
    drive = Drive(domain, space)
    a, b = drive.body("a", 1.0), drive.body("b", 2.0)
    motor = drive.join("motor", "source", b, a)
    lag = drive.scene.add("lag", FirstOrder(u=2.0, time_constant=0.5))
    drive.scene.connect(lag.output("y"), motor.input("value"))
    result = simulate(drive.scene, t_end=2.0, form=form, rtol=1e-10)
    impulse = 2.0 * (result.time - 0.5 * (1.0 - np.exp(-2.0 * result.time)))
    assert_allclose(result[f"b.{drive.rate}"], impulse / 2.0, atol=1e-7)
    assert_allclose(result[f"a.{drive.rate}"], -impulse, atol=1e-7)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize(("domain", "form", "space"), combinations())
@pytest.mark.parametrize("follows", ["place", "speed"])
def test_a_motion_is_followed_and_a_coupling_measures_what_it_takes(
    follows: str, domain: str, form: str, space: str
) -> None:
    drive = Drive(domain, space)
    a, b = drive.body("a", 1.0, None, None), drive.body("b", 2.0, None, None)
    if follows == "speed":
        drive.scene.start[f"a.{drive.place}"] = 0.5
        drive.join("drive", "motion", a, follows="speed", speed=lambda t: 0.3 * 2.0 * _cos(2.0 * t))
    else:
        drive.join("drive", "motion", a, place=lambda t: 0.5 + 0.3 * _sin(2.0 * t))
    drive.join("joint", "coupling", b, a)
    result = simulate(drive.scene, t_end=2.0, form=form, rtol=1e-10)
    assert_allclose(result[f"b.{drive.place}"], 0.5 + 0.3 * np.sin(2.0 * result.time), atol=2e-7)
    load = "torque" if domain == "rotational" else "force"
    assert_allclose(result[f"joint.{load}"], -2.4 * np.sin(2.0 * result.time), atol=1e-6)
    assert_allclose(result[f"drive.{load}"], -3.6 * np.sin(2.0 * result.time), atol=1e-6)


def _sin(x: Any) -> Any:
    from atwood import sin

    return sin(x)


def _cos(x: Any) -> Any:
    from atwood import cos

    return cos(x)


@pytest.mark.sample(5)
@pytest.mark.parametrize(("domain", "form", "space"), combinations())
def test_play_is_passed_freely_and_the_contact_is_half_an_oscillation(domain: str, form: str, space: str) -> None:
    """To and fro between two elastic ends: twice the free way and twice half a period of the contact."""
    drive = Drive(domain, space)
    b = drive.body("b", 1.0, 0.0, 1.0)
    drive.join("gap", "gap", b, stiffness=400.0, lower=-0.2, upper=0.3)
    period = 2.0 * 0.5 / 1.0 + 2.0 * pi / 20.0
    result = simulate(drive.scene, t_end=period, form=form, rtol=1e-10)
    assert result[f"b.{drive.place}"][-1] == pytest.approx(0.0, abs=1e-6)
    assert result[f"b.{drive.rate}"][-1] == pytest.approx(1.0, abs=1e-6)
    times = [one.time for one in result.events]
    assert times == pytest.approx([0.3, 0.3 + pi / 20.0, 0.8 + pi / 20.0, 0.8 + pi / 10.0], abs=1e-7)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize("domain", BOTH)
def test_a_damped_contact_never_pulls(domain: str) -> None:
    drive = Drive(domain)
    b = drive.body("b", 1.0, 0.0, 1.0)
    drive.join("gap", "gap", b, stiffness=400.0, damping=30.0, ends="upper", upper=0.1)
    result = simulate(drive.scene, t_end=1.0, rtol=1e-9)
    speed = result[f"b.{drive.rate}"]
    assert np.all(np.diff(speed) < 1e-9)  # pushed back, and never forth
    assert -1.0 < speed[-1] < -0.05


@pytest.mark.parametrize(("form", "space"), EVERY)
def test_gears_between_rotors_and_a_rack(form: str, space: str) -> None:
    """A planetary gear with its ring held is a gear of 1 + ratio; a rack carries a mass (in the plane)."""
    drive = Drive("rotational", space)
    sun, carrier, ring = (
        drive.body("sun", 1.0),
        drive.body("carrier", 3.0, None, None),
        drive.body("ring", 1.0, None, None),
    )
    scene = drive.scene
    gear = scene.add("gear", PlanetaryGear(ratio=3.0))
    for flange, end in ((sun, gear.sun), (carrier, gear.carrier), (ring, gear.ring)):
        scene.connect(flange, end)
    drive.join("held", "motion", ring, place=0.0)
    drive.join("motor", "source", sun, value=2.0)
    total = 1.0 + 3.0 / 16.0
    if space == "plane":
        rack = scene.add("rack", RackAndPinion(radius=0.5))
        scene.connect(carrier, rack.pinion)
        scene.connect(scene.add("mass", Mass1D(mass=8.0)).slide, rack.rack)
        total += 8.0 * 0.25 / 16.0
    result = simulate(scene, t_end=1.0, form=form, rtol=1e-10)
    assert result["sun.angular_velocity"][-1] == pytest.approx(2.0 / total, rel=1e-7)
    assert result["carrier.angle"][-1] == pytest.approx(0.25 / total, rel=1e-7)


@pytest.mark.parametrize(("form", "space"), EVERY)
def test_a_drive_turns_a_joint(form: str, space: str) -> None:
    """A motor with inertia behind a gear lifts a link: both as one pendulum with a larger moment of inertia."""
    scene = Scene(space=space, gravity=9.81)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    link, motor, gear = scene.add("link", Link(length=1.0)), scene.add("motor", Inertia(moment=0.01)), Gear(ratio=10.0)
    scene.add("gear", gear)
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.connect(motor.flange, gear.a)
    scene.connect(pivot.shaft, gear.b)
    scene.start["pivot.angle"], scene.start["pivot.angular_velocity"] = -pi / 2.0 + 0.002, 0.0
    result = simulate(scene, t_end=1.0, form=form, rtol=1e-11)
    w = sqrt(9.81 * 0.5 / (1.0 / 3.0 + 1.0))
    assert_allclose(result["pivot.angle"] + pi / 2.0, 0.002 * np.cos(w * result.time), atol=1e-7)
    turned, motor = (result[path] - result[path][0] for path in ("pivot.angle", "motor.angle"))
    assert_allclose(motor, 10.0 * turned, atol=1e-7)


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida", "ida-sundae"])
def test_every_solver_takes_loads_on_coordinates(solver: str) -> None:
    drive = Drive("rotational")
    b = drive.body("b", 2.0, 0.3)
    motor = drive.join("motor", "source", b)
    sine = drive.scene.add("sine", Sine(amplitude=4.0, angular_frequency=3.0))
    drive.scene.connect(sine.output("value"), motor.input("value"))
    drive.join("brake", "resistance", b, linear=1.0)
    result = simulate(drive.scene, t_end=2.0, solver=solver, rtol=1e-10)
    # 2 w' + w = 4 sin 3t
    t = 2.0
    expected = 4.0 / 37.0 * (sin(3 * t) - 6.0 * cos(3 * t) + 6.0 * exp(-t / 2.0))
    assert result["b.angular_velocity"][-1] == pytest.approx(expected, abs=1e-7)
