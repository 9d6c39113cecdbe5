"""What a motion keeps: energy, momentum, angular momentum, constraints; and how errors fall with the tolerance."""

import math
from itertools import pairwise

import numpy as np
import pytest

from atwood import Scene
from atwood.pipeline import simulate
from atwood_library import (
    Damper,
    EnergySensor,
    Force,
    Ground,
    Link,
    Mass1D,
    Pivot,
    PointMass,
    RotaryDrive,
    Sine,
    Spring,
    TorsionDamper,
)
from atwood_library.scenes import (
    SCENES,
    DoublePendulum,
    DrivenPendulum,
    FourBar,
    PendulumOnCart,
    SimplePendulum,
)

from ..helpers.runs import EVERYDAY, FORMS

UNDRIVEN = [name for name in EVERYDAY if name != "driven-pendulum"]


@pytest.mark.sample(5)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", UNDRIVEN)
def test_energy_of_undriven_scenes(name: str, form: str) -> None:
    result = simulate(SCENES[name](), form=form, rtol=1e-10, outputs=21)
    energy = result.energy
    assert np.max(np.abs(energy.work)) == 0.0
    assert energy.exchanged > 0.0
    told = energy.max_drift * energy.exchanged + energy.uncertainty  # which looks between outputs, too
    assert np.max(np.abs(energy.total - energy.total[0])) <= 1.001 * told + 1e-12 * energy.exchanged
    assert energy.max_drift < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_horizontal_momentum_of_the_pendulum_on_the_cart(form: str) -> None:
    scene = PendulumOnCart()
    scene.start["rail.speed"] = 0.4
    result = simulate(scene, form=form, rtol=1e-10, outputs=41)
    momentum = 2.0 * result.array("cart.velocity.x") + result.array("bob.velocity.x")
    assert np.max(np.abs(momentum - momentum[0])) < 1e-7
    assert momentum[0] == pytest.approx(3.0 * 0.4)


def two_bodies() -> Scene:
    scene = Scene(gravity=0.0, t_end=4.0)
    one = scene.add("one", PointMass(mass=2.0))
    two = scene.add("two", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=5.0, natural_length=0.7))
    scene.connect(spring.a, one.point)
    scene.connect(spring.b, two.point)
    scene.start.update({"one.position.x": 0.0, "one.position.z": 0.0, "two.position.x": 1.0, "two.position.z": 0.2})
    scene.start.update({"one.velocity.x": 0.1, "one.velocity.z": -0.5, "two.velocity.x": 0.3, "two.velocity.z": 1.4})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_momentum_and_angular_momentum_of_two_bodies(form: str) -> None:
    result = simulate(two_bodies(), form=form, rtol=1e-11, outputs=41)
    spin = 0.0
    for name, mass in (("one", 2.0), ("two", 1.0)):
        x, z = result.array(f"{name}.position.x"), result.array(f"{name}.position.z")
        vx, vz = result.array(f"{name}.velocity.x"), result.array(f"{name}.velocity.z")
        spin = spin + mass * (x * vz - z * vx)
    assert np.ptp(spin) < 1e-8
    for axis in "xz":
        momentum = 2.0 * result.array(f"one.velocity.{axis}") + result.array(f"two.velocity.{axis}")
        assert np.ptp(momentum) < 1e-8
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_work_of_a_drive(form: str) -> None:
    result = simulate(DrivenPendulum(), form=form, rtol=1e-10, outputs=201)
    energy = result.energy
    assert np.ptp(energy.work) > 0.1
    assert energy.max_drift < 1e-7
    # the same by hand: the drive's force times its speed, integrated with Simpson's rule
    from scipy.integrate import simpson

    power = result.array("drive.force.x") * 0.1 * 2.5 * np.cos(2.5 * result.time)
    assert energy.work[-1] == pytest.approx(simpson(power, x=result.time), abs=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_work_of_a_force_and_a_damper(form: str) -> None:
    scene = Scene(gravity=0.0, t_end=5.0)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", Mass1D(mass=1.5))
    spring = scene.add("spring", Spring(stiffness=8.0, natural_length=1.0))
    damper = scene.add("damper", Damper(damping=0.6))
    push, source = scene.add("push", Force()), scene.add("source", Sine(amplitude=2.0, angular_frequency=1.7))
    sensor = scene.add("sensor", EnergySensor())
    assert sensor.path == "sensor"
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, mass.flange)
    scene.connect(push.point, mass.flange)
    scene.connect(source.output("value"), push.input("value"))
    scene.start.update({"mass.displacement": 1.0, "mass.speed": 0.0})
    result = simulate(scene, form=form, rtol=1e-10, outputs=401)
    assert result.energy.max_drift < 1e-7
    v = result.array("mass.speed")
    from scipy.integrate import simpson

    power = 2.0 * np.sin(1.7 * result.time) * v - 0.6 * v**2
    assert result.energy.work[-1] == pytest.approx(simpson(power, x=result.time), abs=1e-6)
    assert np.allclose(result.array("sensor.total"), result.energy.total, atol=1e-12)
    assert np.allclose(result.array("sensor.kinetic"), 0.75 * v**2, atol=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_work_of_a_motor_and_a_torsion_damper(form: str) -> None:
    scene = Scene(t_end=3.0)
    ground, motor = scene.add("ground", Ground()), scene.add("motor", RotaryDrive())
    source = scene.add("source", Sine(amplitude=0.7, angular_frequency=3.0))
    crank, hinge = scene.add("crank", Link(length=0.5, mass=0.4)), scene.add("hinge", Pivot())
    arm, brake = scene.add("arm", Link(length=0.8, mass=0.3)), scene.add("brake", TorsionDamper(damping=0.05))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, crank.a)
    scene.connect(source.output("value"), motor.input("rotation"))
    scene.connect(crank.b, hinge.a)
    scene.connect(hinge.b, arm.a)
    scene.connect(crank.b, brake.a)
    scene.connect(arm.a, brake.b)
    scene.start.update({"arm.angle": -1.0, "arm.angular_velocity": 0.0})
    result = simulate(scene, form=form, rtol=1e-10, outputs=51)
    assert result.energy.max_drift < 1e-7
    assert np.ptp(result.energy.work) > 0.05


def test_constraints_hold_for_a_hundred_seconds() -> None:
    result = simulate(DoublePendulum(), form="dae", rtol=1e-8, t_end=100.0, outputs=101)
    found = result.constraint_max
    assert found["position"] < 1e-12
    assert found["velocity"] < 1e-12
    # by hand, from the quantities that are reported
    x1, z1 = result.array("bob1.position.x"), result.array("bob1.position.z")
    x2, z2 = result.array("bob2.position.x") - x1, result.array("bob2.position.z") - z1
    assert np.max(np.abs(np.hypot(x1, z1) - 1.0)) < 1e-12
    assert np.max(np.abs(np.hypot(x2, z2) - 1.0)) < 1e-12
    # what the solver itself held is reported as well, and is of the order of its tolerance
    assert 1e-12 < found["held_position"] < 1e-5
    assert 1e-12 < found["held_velocity"] < 1e-4


def test_index_one_drifts_and_says_so() -> None:
    plain = simulate(DoublePendulum(), form="dae", level="index1", rtol=1e-6, t_end=20.0, outputs=21)
    kept = simulate(DoublePendulum(), form="dae", level="index1-projected", rtol=1e-6, t_end=20.0, outputs=21)
    assert (plain.level, kept.level) == ("index1", "index1-projected")
    assert plain.constraint_max["position"] > 1e-6
    assert plain.constraint_max["position"] == pytest.approx(plain.constraint_max["held_position"], rel=0.5)
    assert kept.constraint_max["position"] < 1e-12
    assert kept.constraint_max["velocity"] < 1e-12
    # the drift is what it says: by hand from the quantities
    x, z = plain.array("bob1.position.x"), plain.array("bob1.position.z")
    assert np.max(np.abs(np.hypot(x, z) - 1.0)) > 1e-7


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["double-pendulum", "four-bar", "double-atwood", "driven-pendulum"])
@pytest.mark.parametrize("level", ["index1", "index1-projected"])
def test_every_level_gives_the_same_motion(name: str, level: str) -> None:
    reference = simulate(SCENES[name](), rtol=1e-11, t_end=1.0, outputs=6)
    result = simulate(SCENES[name](), form="dae", level=level, rtol=1e-9, t_end=1.0, outputs=6)
    for path in reference.paths:
        expected = reference.array(path)
        assert np.max(np.abs(result.array(path) - expected)) < 1e-5 * max(1.0, np.max(np.abs(expected))), path


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("form", "level"), [("reduced", "ggl"), ("dae", "ggl"), ("dae", "index1"), ("dae", "index1-projected")]
)
def test_error_falls_with_the_tolerance(form: str, level: str) -> None:
    tolerances = [1e-4, 1e-6, 1e-8, 1e-10]
    errors = []
    for rtol in tolerances:
        scene = SimplePendulum(release_angle=1.5)
        result = simulate(scene, form=form, level=level, rtol=rtol, t_end=4.0, outputs=41, solver="ida")
        errors.append(np.max(np.abs(result.array("rod.angle") - scene.closed_form(result.time)["rod.angle"])))
    assert all(b < a for a, b in pairwise(errors))
    # error per step is held, so the error of the run falls a little more slowly than the tolerance
    slope = np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0]
    assert 0.65 < slope < 1.25
    assert errors[-1] < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_error_falls_with_the_tolerance_in_a_loop(form: str) -> None:
    reference = simulate(FourBar(), rtol=1e-12, t_end=1.5, outputs=16).array("crank.angle")
    errors = [
        np.max(
            np.abs(simulate(FourBar(), form=form, rtol=rtol, t_end=1.5, outputs=16).array("crank.angle") - reference)
        )
        for rtol in (1e-4, 1e-6, 1e-8)
    ]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
    assert errors[2] < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_outputs_never_change_the_solution(form: str) -> None:
    few = simulate(DoublePendulum(), form=form, rtol=1e-8, outputs=[0.0, 1.5, 3.0])
    many = simulate(DoublePendulum(), form=form, rtol=1e-8, outputs=301)
    assert few.array("rod2.angle")[1] == pytest.approx(many.array("rod2.angle")[150], abs=1e-6)
    assert few.array("rod2.angle")[-1] == pytest.approx(many.array("rod2.angle")[-1], abs=1e-5)


def test_runs_are_deterministic() -> None:
    one, two = (simulate(FourBar(), form="dae", rtol=1e-7, outputs=11).table() for _ in range(2))
    assert all(np.array_equal(one[path], two[path]) for path in one)


def test_angles_count_their_turns() -> None:
    scene = SimplePendulum(t_end=4.0)
    scene.start.update({"rod.angle": 20.0 * math.pi, "rod.angular_velocity": 9.0})
    for form in FORMS:
        angle = simulate(scene, form=form, rtol=1e-9, outputs=9).array("rod.angle")
        assert angle[0] == pytest.approx(20.0 * math.pi, abs=1e-9)
        assert angle[-1] - angle[0] > 25.0
        assert np.all(np.diff(angle) > 0.0)
