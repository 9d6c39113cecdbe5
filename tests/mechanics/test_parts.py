"""Parts against hand calculations: reactions, drives, dampers, inputs, massive rods, sliders on what moves."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import ellipk

from atwood import Component, Point as PointConnector, Scalar, Scene, connector, observable, parameter
from atwood.pipeline import simulate
from atwood_library import (
    Damper,
    Force,
    ForceSensor,
    Ground,
    Link,
    Mass1D,
    Pivot,
    PointMass,
    Ramp,
    Rod,
    RotaryDrive,
    Sine,
    Slider,
    Spring,
    TorsionDamper,
    TorsionSpring,
    Weld,
)

from ..helpers.runs import FORMS, assert_agree, run_both

G = 9.81


def cantilever() -> Scene:
    scene = Scene(t_end=1.0)
    ground, weld = scene.add("ground", Ground()), scene.add("weld", Weld(displacement=(0.5, 0.0, 0.0)))
    beam, cell = scene.add("beam", Link(length=1.5, mass=2.0)), scene.add("cell", ForceSensor())
    mass = scene.add("mass", PointMass(mass=3.0))
    scene.connect(ground.frame, weld.a)
    scene.connect(weld.b, beam.a)
    scene.connect(beam.b, cell.a)
    scene.connect(cell.b, mass.point)
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_reactions_of_a_cantilever(form: str) -> None:
    end = simulate(cantilever(), form=form, outputs=3).at(-1)
    assert [end["cell.force.x"], end["cell.force.z"], end["cell.torque"]] == pytest.approx([0.0, 3.0 * G, 0.0])
    at_weld = 2.0 * G * 0.75 + 3.0 * G * 1.5
    assert [end["weld.force.x"], end["weld.force.z"], end["weld.torque"]] == pytest.approx([0.0, 5.0 * G, at_weld])
    assert [end["ground.force.z"], end["ground.torque"]] == pytest.approx([5.0 * G, at_weld + 5.0 * G * 0.5])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("turned_ground", [True, False])
def test_slider_on_an_incline(form: str, turned_ground: bool) -> None:
    slope = 0.5
    scene = Scene(t_end=1.0)
    ground = scene.add("ground", Ground(angle=slope if turned_ground else 0.0))
    axis = (1.0, 0.0, 0.0) if turned_ground else (math.cos(slope), 0.0, math.sin(slope))
    slide, body = scene.add("slide", Slider(axis=axis)), scene.add("body", Link(length=1.0, mass=2.0))
    scene.connect(ground.frame, slide.a)
    scene.connect(slide.b, body.a)
    scene.start.update({"slide.displacement": 0.0, "slide.speed": 0.0})
    end = simulate(scene, form=form, rtol=1e-10, outputs=3).at(-1)
    assert end["slide.displacement"] == pytest.approx(-0.5 * G * math.sin(slope), abs=1e-7)
    assert end["slide.side_force"] == pytest.approx(2.0 * G * math.cos(slope), abs=1e-7)
    assert end["body.angle"] == pytest.approx(slope if turned_ground else 0.0)
    # The guide's force acts at frame a of the body: across the slope it turns about the centre half a metre on.
    arm = 0.5 if turned_ground else 0.5 * math.cos(slope)
    assert end["slide.torque"] == pytest.approx(arm * 2.0 * G * math.cos(slope), abs=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_bead_on_a_turning_arm(form: str) -> None:
    # r'' = w^2 r, side force 2 m w r', torque of the motor r times it
    scene = Scene(gravity=0.0, t_end=1.0)
    ground, motor, ramp = (
        scene.add("ground", Ground()),
        scene.add("motor", RotaryDrive()),
        scene.add("ramp", Ramp(slope=2.0)),
    )
    arm, slide, bead = scene.add("arm", Link()), scene.add("slide", Slider()), scene.add("bead", PointMass(mass=0.5))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, arm.a)
    scene.connect(ramp.output("value"), motor.input("rotation"))
    scene.connect(arm.a, slide.a)
    scene.connect(slide.b, bead.point)
    scene.start.update({"slide.displacement": 0.3, "slide.speed": 0.0})
    result = simulate(scene, form=form, rtol=1e-11, outputs=11)
    r, v = 0.3 * np.cosh(2.0 * result.time), 0.6 * np.sinh(2.0 * result.time)
    for path, expected in {
        "slide.displacement": r,
        "slide.speed": v,
        "slide.side_force": 2.0 * 0.5 * 2.0 * v,
        "motor.torque": 2.0 * 0.5 * 2.0 * v * r,
    }.items():
        assert np.max(np.abs(result.array(path) - expected)) < 1e-6, path
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_torque_of_a_motor(form: str) -> None:
    scene = Scene(t_end=1.0)
    ground, motor = scene.add("ground", Ground()), scene.add("motor", RotaryDrive())
    wave, arm = scene.add("wave", Sine(amplitude=1.0, angular_frequency=2.0)), scene.add("arm", Link(mass=1.5))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, arm.a)
    scene.connect(wave.output("value"), motor.input("rotation"))
    result = simulate(scene, form=form, rtol=1e-8, outputs=11)
    angle = np.sin(2.0 * result.time)
    torque = 1.5 / 3.0 * -4.0 * angle + 1.5 * G * 0.5 * np.cos(angle)
    assert np.max(np.abs(result.array("motor.torque") - torque)) < 1e-9
    assert np.max(np.abs(result.array("ground.torque") - torque)) < 1e-9
    assert result.energy.max_drift < 1e-8


def decay(t: np.ndarray, stiffness: float, inertia: float, damping: float) -> np.ndarray:
    """Return the free vibration that starts from 1 at rest."""
    d = 0.5 * damping / inertia
    w = math.sqrt(stiffness / inertia - d * d)
    return np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))


@pytest.mark.parametrize("form", FORMS)
def test_damped_oscillator_in_the_plane(form: str) -> None:
    scene = Scene(t_end=3.0)
    ground, mass = scene.add("ground", Ground(position=(-5.0, 0.0, 0.0))), scene.add("mass", Mass1D(mass=1.0))
    spring, damper = (
        scene.add("spring", Spring(stiffness=9.0, natural_length=5.0)),
        scene.add("damper", Damper(damping=0.4)),
    )
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, mass.flange)
    scene.start.update({"mass.displacement": 1.0, "mass.speed": 0.0})
    result = simulate(scene, form=form, rtol=1e-11, outputs=31)
    assert np.max(np.abs(result.array("mass.displacement") - decay(result.time, 9.0, 1.0, 0.4))) < 1e-7
    assert np.allclose(result.array("mass.side_force"), G)
    assert np.allclose(result.array("damper.tension"), 0.4 * result.array("mass.speed"))
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_torsion_spring_and_damper(form: str) -> None:
    scene = Scene(gravity=0.0, t_end=3.0)
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link(mass=3.0))
    spring = scene.add("spring", TorsionSpring(stiffness=9.0, natural_angle=0.2))
    damper = scene.add("damper", TorsionDamper(damping=0.4))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, link.a)
    scene.start.update({"link.angle": 1.2, "link.angular_velocity": 0.0})
    result = simulate(scene, form=form, rtol=1e-11, outputs=31)
    expected = 0.2 + decay(result.time, 9.0, 1.0, 0.4)
    assert np.max(np.abs(result.array("link.angle") - expected)) < 1e-7
    assert np.allclose(result.array("spring.torque"), -9.0 * (expected - 0.2), atol=1e-6)
    assert np.allclose(result.array("damper.torque"), -0.4 * result.array("link.angular_velocity"))


class Controller(Component):
    """Feeds back a position: what a spring would do."""

    gain: float = parameter(9.0, unit="N/m", doc="Force for a deviation of one metre.")
    point: PointConnector = connector(PointConnector, "Where it measures.")

    @observable(unit="N", doc="Force that it asks for.")
    def command(self) -> Scalar:
        return -(self.gain * self.point.position.x)


def controlled() -> Scene:
    scene = Scene(gravity=0.0, t_end=3.0)
    mass, force, controller = (
        scene.add("mass", Mass1D()),
        scene.add("force", Force()),
        scene.add("controller", Controller()),
    )
    scene.connect(controller.point, mass.flange)
    scene.connect(force.point, mass.flange)
    scene.connect(controller.output("command"), force.input("value"))
    scene.start.update({"mass.displacement": 1.0, "mass.speed": 0.0})
    return scene


def test_feedback_is_a_spring() -> None:
    reduced, dae = run_both(controlled, rtol=1e-11, outputs=31)
    assert_agree(reduced, dae, 1e-7)
    assert np.max(np.abs(reduced.array("mass.displacement") - np.cos(3.0 * reduced.time))) < 1e-7
    assert np.allclose(reduced.array("force.force"), -9.0 * reduced.array("mass.displacement"))
    assert reduced.energy.max_drift < 1e-7


def massive_rod() -> Scene:
    scene = Scene(t_end=2.0)
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.2, mass=0.7))
    scene.connect(ground.frame, rod.a)
    scene.start.update({"rod.angle": 2.0, "rod.angular_velocity": 0.0})
    return scene


def test_massive_rod_is_a_compound_pendulum() -> None:
    # a rod swings like a pendulum of 2/3 of its length: T = 4 sqrt(2 l/(3 g)) K(sin^2(theta0/2))
    period = 4.0 * math.sqrt(2.0 * 1.2 / (3.0 * G)) * ellipk(math.sin(1.0) ** 2)
    times = [0.0, period / 4.0, period / 2.0, period]
    reduced, dae = run_both(massive_rod, rtol=1e-11, t_end=period, outputs=times)
    assert_agree(reduced, dae, 1e-6)
    assert reduced.array("rod.angle") == pytest.approx([2.0, 0.0, -2.0, 2.0], abs=1e-7)
    # at the bottom the pivot carries the weight and m (l/2) w^2, with w^2 = 3 g/l (1 - cos(theta0))
    lift = 0.7 * G + 0.7 * 0.6 * (3.0 * G / 1.2) * (1.0 - math.cos(2.0))
    assert reduced.array("ground.force.z")[1] == pytest.approx(lift, abs=1e-6)


def slider_on_a_swing() -> Scene:
    scene = Scene(t_end=0.5)
    ground, pivot, swing = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("swing", Link())
    slide, body = scene.add("slide", Slider(axis=(0.6, 0.0, 0.8))), scene.add("body", Link(length=0.5, mass=0.7))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, swing.a)
    scene.connect(swing.b, slide.a)
    scene.connect(slide.b, body.a)
    scene.start.update(
        {"swing.angle": 0.2, "swing.angular_velocity": 0.5, "slide.displacement": 0.1, "slide.speed": 0.3}
    )
    return scene


@pytest.mark.parametrize("make", [slider_on_a_swing, cantilever, massive_rod])
def test_forms_agree(make: Callable[[], Scene]) -> None:
    assert_agree(*run_both(make, rtol=1e-11, outputs=5), 1e-6)
