"""What joints of space carry: springs, dampers, motors and stops, against exact motions and in both forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipj, ellipk

import atwood as aw
import atwood_library as lib
from atwood import Scene, simulate

LOADS: dict[str, tuple[Any, dict[str, Any]]] = {
    "pivot": (
        lambda: lib.Pivot(
            axis=(0.3, 1.0, -0.2), stiffness=3.0, natural_angle=0.2, damping=0.1, motor=lambda t: aw.sin(3.0 * t),
            upper_stop=0.8, stop_stiffness=200.0,
        ),
        {"joint.angle": 0.7, "joint.angular_velocity": 1.0},
    ),
    "slider": (
        lambda: lib.Slider(axis=(1.0, 0.4, -0.3), stiffness=30.0, damping=0.5, actuator=lambda t: aw.cos(2.0 * t)),
        {"joint.displacement": 0.2, "joint.speed": 0.5},
    ),
    "cylindrical": (
        lambda: lib.Cylindrical(
            axis=(1.0, 0.2, 0.5), stiffness=40.0, natural_length=0.1, damping=0.3, lower_stop=-0.1,
            stop_stiffness=900.0, torsional_stiffness=2.0, natural_angle=-0.2, torsional_damping=0.1,
            upper_angle_stop=0.5, angle_stop_stiffness=50.0, motor=0.4, actuator=lambda t: aw.sin(t),
        ),
        {"joint.angle": 0.3, "joint.speed": 0.4},
    ),
    "screw": (
        lambda: lib.Screw(axis=(0.1, 0.2, 1.0), pitch=0.7, stiffness=8.0, damping=0.2, motor=0.5, lower_stop=-0.5,
                          stop_stiffness=100.0),
        {"joint.angle": 0.4},
    ),
    "spherical": (
        lambda: lib.Spherical(stiffness=5.0, damping=0.1, bend_stop=0.3, stop_stiffness=40.0, stop_axis=(0.1, 0.0, 1.0),
                              motor_x=0.2, motor_y=lambda t: aw.sin(4.0 * t), motor_z=-0.1),
        {"body.spin.x": 1.0, "body.spin.y": -0.5, "body.spin.z": 0.8},
    ),
    "universal": (
        lambda: lib.Universal(
            stiffness_a=6.0, natural_angle_a=0.1, damping_a=0.1, motor_a=lambda t: aw.cos(2.0 * t), upper_stop_a=0.6,
            stiffness_b=4.0, natural_angle_b=-0.1, damping_b=0.05, motor_b=0.3, lower_stop_b=-0.45, stop_stiffness=60.0,
        ),
        {"joint.angle_a": 0.5, "joint.angle_b": -0.4, "joint.rate_a": 1.0},
    ),
    "planar": (
        lambda: lib.Planar(
            axis=(0.2, 0.3, 1.0), stiffness=20.0, damping=0.4, rim=0.15, stop_stiffness=300.0, actuator_1=0.5,
            actuator_2=lambda t: aw.sin(5.0 * t), torsional_stiffness=1.0, torsional_damping=0.05, motor=0.2,
        ),
        {"joint.displacement_1": 0.1, "joint.angle": 0.3},
    ),
    "constant-velocity": (
        lambda: lib.ConstantVelocity(stiffness=6.0, damping=0.1, bend_stop=0.4, stop_stiffness=30.0, motor_x=0.3),
        {"body.spin.x": 0.9, "body.spin.y": -0.4},
    ),
}  # fmt: skip


def hung(scene: Scene, joint: Any, frame: Any, body: Any) -> Any:
    """Hang a body on a frame by a joint."""
    placed, held = scene.add("joint", joint), scene.add("body", body)
    scene.connect(frame, placed.a)
    scene.connect(placed.b, held.point if isinstance(body, lib.PointMass) else held.frame)
    return placed


def on_carrier(name: str) -> Scene:
    """Return a carrier on a ball joint, and a body that hangs on it by the joint."""
    make, start = LOADS[name]
    scene = Scene(space="space")
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.Spherical())
    carrier = scene.add("carrier", lib.RigidBody(mass=2.0, center=(0.1, 0.2, -0.5), moments=(0.3, 0.4, 0.2)))
    weld = scene.add("weld", lib.Weld(displacement=(0.2, -0.1, -0.8), angle=0.3))
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, carrier.frame)
    scene.connect(carrier.frame, weld.a)
    hung(scene, make(), weld.b, lib.RigidBody(mass=1.0, center=(0.3, 0.1, -0.2), moments=(0.1, 0.15, 0.12)))
    scene.start.update({"carrier.spin.x": 0.3, "carrier.spin.y": 0.8, **start})
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LOADS)
def test_both_forms_agree_and_the_energy_ledger_closes(name: str) -> None:
    scene = on_carrier(name)
    reduced, dae = (simulate(scene, form=form, t_end=0.6, rtol=1e-9, outputs=121) for form in ("reduced", "dae"))
    # What motors put in and dampers take out is integrated by splines through the samples; forces of stops have kinks.
    assert reduced.energy.max_drift < 1e-5
    assert dae.energy.max_drift < 1e-5
    assert np.ptp(reduced.energy.kinetic + reduced.energy.potential) > 1e-2
    for path in ("body.position.x", "body.position.z", "joint.force.x", "ball.force.z"):
        if path in reduced.assembly.observables:
            scale = float(np.max(np.abs(reduced[path])))
            assert_allclose(dae[path], reduced[path], rtol=0.0, atol=1e-6 * max(scale, 1.0))


def swinging(joint: Any, body: Any, start: dict[str, Any], t_end: float = 2.0) -> aw.Result:
    """Return the motion of a body on the ground by a joint, without weight."""
    scene = Scene(space="space", gravity=0.0)
    hung(scene, joint, scene.add("ground", lib.Ground()).frame, body)
    scene.start.update(start)
    return simulate(scene, t_end=t_end, rtol=1e-11)


def compact(mass: float = 2.0, moment: float = 0.5) -> lib.RigidBody:
    """Return a body whose inertia knows no direction."""
    return lib.RigidBody(mass=mass, center=(0.0, 0.0, 0.0), moments=(moment, moment, moment))


def pendulum(t: Any, amplitude: float, frequency: float) -> Any:
    """Return the angle of ``x'' = -frequency^2 sin x`` released at an amplitude (Whittaker and Watson, 22)."""
    m = np.sin(0.5 * amplitude) ** 2
    sn = ellipj(frequency * t + ellipk(m), m)[0]
    return 2.0 * np.arcsin(np.sqrt(m) * sn)


def test_the_shaft_oscillates_along_and_about_its_axis() -> None:
    joint = lib.Cylindrical(stiffness=8.0, natural_length=0.3, torsional_stiffness=4.5, natural_angle=0.1)
    found = swinging(joint, compact(), {"joint.displacement": 0.5, "joint.angle": 1.1})
    assert_allclose(found["joint.displacement"], 0.3 + 0.2 * np.cos(2.0 * found.time), atol=1e-9)
    assert_allclose(found["joint.angle"], 0.1 + np.cos(3.0 * found.time), atol=1e-9)


def test_the_nut_on_the_thread_has_the_inertia_of_both_motions() -> None:
    pitch = 0.9
    inertia = 0.5 + 2.0 * (pitch / (2.0 * np.pi)) ** 2
    found = swinging(lib.Screw(pitch=pitch, stiffness=4.0), compact(), {"joint.angle": 8.0})
    assert_allclose(found["joint.angle"], 8.0 * np.cos(np.sqrt(4.0 / inertia) * found.time), atol=1e-8)


def test_the_plate_is_an_oscillator_in_two_directions_with_friction() -> None:
    joint = lib.Planar(stiffness=8.0, damping=2.0, torsional_stiffness=2.0, torsional_damping=0.5)
    start = {"joint.displacement_1": 0.4, "joint.displacement_2": -0.2, "joint.angle": 2.0}
    found = swinging(joint, compact(), start)
    decay, frequency = 0.5, np.sqrt(4.0 - 0.25)
    phase = frequency * found.time
    shape = np.exp(-decay * found.time) * (np.cos(phase) + decay / frequency * np.sin(phase))
    assert_allclose(found["joint.displacement_1"], 0.4 * shape, atol=1e-9)
    assert_allclose(found["joint.displacement_2"], -0.2 * shape, atol=1e-9)
    assert_allclose(found["joint.angle"], 2.0 * shape, atol=1e-8)


def test_a_point_on_a_plane_pushed_and_held() -> None:
    joint = lib.PointOnPlane(stiffness=4.0, actuator_1=2.0)
    found = swinging(joint, lib.PointMass(mass=1.0), {"joint.displacement_2": 0.3})
    assert_allclose(found["joint.displacement_1"], 0.5 * (1.0 - np.cos(2.0 * found.time)), atol=1e-9)
    assert_allclose(found["joint.displacement_2"], 0.3 * np.cos(2.0 * found.time), atol=1e-9)


def test_a_point_on_a_line_with_a_damped_actuator() -> None:
    found = swinging(lib.PointOnLine(damping=2.0, actuator=3.0), lib.PointMass(mass=1.0), {"joint.displacement": 0.0})
    assert_allclose(found["joint.speed"], 1.5 * (1.0 - np.exp(-2.0 * found.time)), atol=1e-9)


def test_a_point_on_a_circle_with_a_motor() -> None:
    found = swinging(lib.PointOnCircle(radius=0.5, motor=0.75), lib.PointMass(mass=1.0), {"joint.angle": 0.2})
    assert_allclose(found["joint.angular_velocity"], 3.0 * found.time, atol=1e-9)
    sprung = swinging(lib.PointOnCircle(radius=0.5, stiffness=1.0), lib.PointMass(mass=1.0), {"joint.angle": 1.2})
    assert_allclose(sprung["joint.angle"], 1.2 * np.cos(2.0 * sprung.time), atol=1e-9)


@pytest.mark.parametrize("make", [lib.Spherical, lib.ConstantVelocity])
def test_the_spring_of_a_ball_swings_as_a_pendulum(make: Any) -> None:
    start = {"body.theta": 1.3, "body.phi": 0.4, "body.psi": -0.4}
    found = swinging(make(stiffness=2.0), compact(moment=0.5), start)
    assert_allclose(np.cos(found["body.theta"]), np.cos(pendulum(found.time, 1.3, 2.0)), atol=1e-8)


def test_each_hinge_of_a_cross_has_its_own_spring_and_motor() -> None:
    start = {"joint.angle_b": 0.9, "joint.angle_a": 0.0}
    about_b = swinging(lib.Universal(stiffness_b=2.0), compact(moment=0.5), start)
    assert_allclose(about_b["joint.angle_b"], 0.9 * np.cos(2.0 * about_b.time), atol=1e-9)
    assert_allclose(about_b["joint.angle_a"], 0.0, atol=1e-9)
    motor = swinging(lib.Universal(motor_a=0.25), compact(moment=0.5), {"joint.angle_a": 0.0, "joint.angle_b": 0.0})
    assert_allclose(motor["joint.rate_a"], 0.5 * motor.time, atol=1e-9)


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("joint", "body", "start", "path", "stop", "stiffness", "inertia"),
    [
        (lib.PointOnLine(upper_stop=0.5, stop_stiffness=4e4), "point", {"joint.speed": 1.0}, "joint.displacement", 0.5,
         4e4, 1.0),
        (lib.PointOnPlane(rim=0.5, stop_stiffness=4e4), "point", {"joint.speed_2": 1.0}, "joint.displacement_2", 0.5,
         4e4, 1.0),
        (lib.Spherical(bend_stop=0.5, stop_stiffness=4e4), "body", {"body.spin.x": 1.0}, "body.theta", 0.5, 4e4, 0.5),
        (lib.Universal(upper_stop_b=0.5, stop_stiffness=4e4), "body", {"joint.rate_b": 1.0}, "joint.angle_b", 0.5, 4e4,
         0.5),
        (lib.Cylindrical(upper_angle_stop=0.5, angle_stop_stiffness=4e4), "body", {"joint.angular_velocity": 1.0},
         "joint.angle", 0.5, 4e4, 0.5),
    ],
)  # fmt: skip
def test_what_runs_against_a_stop_comes_back(
    joint: Any, body: str, start: dict[str, Any], path: str, stop: float, stiffness: float, inertia: float
) -> None:
    held: Any = lib.PointMass(mass=inertia) if body == "point" else compact(moment=inertia)
    found = swinging(joint, held, start, t_end=0.8)
    contact = np.pi * np.sqrt(inertia / stiffness)  # half a period of the mass on the stop
    deepest = np.sqrt(inertia / stiffness)
    # A rim and a cone yield by r + r^2/(2 R) and alike, which is the distance while it is small.
    assert_allclose(found[path].max(), stop + deepest, atol=0.1 * deepest)
    assert_allclose(found[path][-1], stop - (0.8 - stop - contact), atol=2e-3 * stop)
    assert found.energy.max_drift < 1e-9
