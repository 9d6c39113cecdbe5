"""Forces and torques in every kind of axes, torsion, drag: exact answers, energy, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import atwood_library as lib
from atwood import AtwoodError, DeclarationError, ParameterError, Result, Scene, UnsupportedError, assemble, simulate

from ..helpers.runs import FORMS

AXIS = (0.3, 1.0, -0.2)
UNIT = np.array(AXIS) / np.linalg.norm(AXIS)
MOMENTS, PRODUCTS = (0.1, 0.15, 0.12), (0.01, -0.02, 0.015)
TENSOR = np.array([[0.1, 0.01, -0.02], [0.01, 0.15, 0.015], [-0.02, 0.015, 0.12]])


def body(**settings: Any) -> lib.RigidBody:
    """Return a body without symmetry."""
    return lib.RigidBody(**{"mass": 1.3, "moments": MOMENTS, "products": PRODUCTS, **settings})


def vectors(result: Result, path: str) -> NDArray[np.float64]:
    """Return a vector at every output."""
    return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=1)


def on_a_hinge(space: str, axis: tuple[float, float, float], *parts: tuple[str, Any]) -> Scene:
    """Return a body on a hinge without weight, with parts between the ground and the body."""
    scene = Scene(space=space, gravity=0.0)
    ground, hinge, wheel = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot(axis=axis)), None
    wheel = scene.add("wheel", body())
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, wheel.frame)
    for name, part in parts:
        added = scene.add(name, part)
        scene.connect(ground.frame, added.a)
        scene.connect(added.b, wheel.frame)
    return scene


def moment_about(axis: tuple[float, float, float]) -> float:
    """Return the body's moment of inertia about an axis through its centre."""
    n = np.array(axis) / np.linalg.norm(axis)
    return float(n @ TENSOR @ n)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), [("plane", (0.0, -1.0, 0.0)), ("plane", (0.0, 1.0, 0.0)), ("space", AXIS)])
def test_torsion_pendulum(space: str, axis: tuple[float, float, float], form: str) -> None:
    c, start, rest = 2.0, 0.9, 0.2
    parts = [
        ("spring", lib.TorsionSpring(stiffness=c, natural_angle=rest, axis=axis)),
        ("sensor", lib.AngleSensor(axis=axis)),
    ]
    scene = on_a_hinge(space, axis, *parts)
    scene.start.update({"hinge.angle": start, "hinge.angular_velocity": 0.0})
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-11, outputs=31)
    n = math.sqrt(c / moment_about(axis))
    exact = rest + (start - rest) * np.cos(n * result.time)
    for path in ("hinge.angle", "spring.angle", "sensor.angle"):
        assert np.allclose(result[path], exact, atol=2e-9), path
    assert np.allclose(result["spring.torque"], -c * (exact - rest), atol=5e-9)
    rate = -n * (start - rest) * np.sin(n * result.time)
    assert np.allclose(result["spring.rate"], rate, atol=2e-8)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_torsion_damper_stops_a_wheel(form: str) -> None:
    scene = on_a_hinge("space", AXIS, ("damper", lib.TorsionDamper(damping=0.05, axis=AXIS)))
    scene.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": 8.0})
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10, outputs=16)
    decay = 0.05 / moment_about(AXIS)
    exact = 8.0 * np.exp(-decay * result.time)
    assert np.allclose(result["hinge.angular_velocity"], exact, atol=1e-7)
    assert np.allclose(result["damper.torque"], -0.05 * exact, atol=1e-8)
    assert result.energy.max_drift < 1e-7


def test_torsion_between_frames_that_bend_keeps_energy_and_momentum() -> None:
    """Two free bodies: whatever the spring does between them is internal, and the damper takes what it takes."""
    for damping in (0.0, 0.3):
        scene = Scene(space="space", gravity=0.0)
        one, other = scene.add("one", body()), scene.add("other", body(mass=0.7, moments=(0.2, 0.25, 0.16)))
        for name, part in (("spring", lib.TorsionSpring(axis=AXIS)), ("damper", lib.TorsionDamper(damping=damping))):
            added = scene.add(name, part)
            scene.connect(one.frame, added.a)
            scene.connect(added.b, other.frame)
        scene.start.update({f"other.spin.{k}": v for k, v in zip("xyz", (0.8, -0.5, 1.0), strict=True)})
        result = simulate(scene, t_end=1.5, rtol=1e-10, outputs=16)
        total = sum(vectors(result, f"{name}.angular_momentum") for name in ("one", "other"))
        assert np.allclose(total, total[0], atol=1e-9)
        assert result.energy.max_drift < 1e-8
        rates = np.gradient(result["spring.angle"], result.time)
        assert np.allclose(rates[1:-1], result["spring.rate"][1:-1], atol=0.1)


def test_a_torsion_spring_in_space_stops_where_its_angle_is_not_told() -> None:
    scene = on_a_hinge("space", AXIS, ("spring", lib.TorsionSpring(stiffness=1e-3, axis=AXIS)))
    scene.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": 4.0})
    result = simulate(scene, t_end=3.0, outputs=16)
    assert [one.law for one in result.events] == ["comes_to_half_a_turn"]
    assert result.time[-1] == pytest.approx(0.999 * math.pi / 4.0, rel=1e-2)
    planar = on_a_hinge("plane", (0.0, -1.0, 0.0), ("spring", lib.TorsionSpring(stiffness=1e-3)))
    planar.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": 4.0})
    assert simulate(planar, t_end=3.0, outputs=4)["spring.angle"][-1] > 10.0


@pytest.mark.parametrize("form", FORMS)
def test_a_torsion_spring_in_a_plane_counts_turns(form: str) -> None:
    """What it watches in space is not watched here; steps are short enough to see it at every half turn."""
    scene = Scene(gravity=0.0)
    ground, wheel = scene.add("ground", lib.Ground()), scene.add("wheel", lib.Disc(mass=1.0, radius=1.0))
    hinge, spring = scene.add("hinge", lib.Pivot()), scene.add("spring", lib.TorsionSpring(stiffness=0.02))
    for a, b in ((ground.frame, hinge.a), (hinge.b, wheel.frame), (ground.frame, spring.a), (wheel.frame, spring.b)):
        scene.connect(a, b)
    rate, frequency = 2.0, math.sqrt(0.02 / 0.5)
    scene.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": rate})
    result = simulate(scene, t_end=5.0, form=form, max_step=2e-3, solver="ida-sundae", rtol=1e-9)
    assert result.status == "finished"
    assert result.at(-1)["spring.angle"] == pytest.approx(rate / frequency * math.sin(frequency * 5.0), abs=1e-6)


# -- applied forces and torques ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_a_thruster_turns_with_its_body(form: str) -> None:
    """A body spins about a fixed axis; its thrust goes round with it, so that its velocity is known."""
    scene = Scene(space="space", gravity=0.0)
    ship = scene.add("ship", lib.RigidBody(mass=2.0, moments=(1.0, 1.0, 1.0)))
    thrust = scene.add("thrust", lib.Force(resolved_in="body", direction=(1.0, 0.0, 0.0), value=3.0))
    scene.connect(ship.frame, thrust.frame)
    scene.start.update({"ship.spin.z": 0.7, "ship.position.x": 0.0})
    result = simulate(scene, form=form, t_end=5.0, rtol=1e-10, outputs=11)
    t = result.time
    assert np.allclose(result["ship.velocity.x"], 1.5 / 0.7 * np.sin(0.7 * t), atol=1e-8)
    assert np.allclose(result["ship.velocity.y"], 1.5 / 0.7 * (1.0 - np.cos(0.7 * t)), atol=1e-8)
    assert np.allclose(result["thrust.force_in_world.x"], 3.0 * np.cos(0.7 * t), atol=1e-8)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_a_force_in_another_frame_does_not_act_on_it(form: str) -> None:
    scene = Scene(space="space", gravity=0.0)
    compass = scene.add("compass", lib.RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    ball = scene.add("ball", lib.PointMass(mass=2.0))
    pull = scene.add("pull", lib.Force(resolved_in="other", direction=(0.0, 1.0, 0.0), value=lambda t: 3.0 * t))
    scene.connect(compass.frame, pull.other)
    scene.connect(ball.point, pull.point)
    scene.start.update({"compass.spin.z": 0.7})
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10, outputs=7)
    t, w = result.time, 0.7
    exact = -1.5 * (np.sin(w * t) - w * t * np.cos(w * t)) / w**2
    assert np.allclose(result["ball.velocity.x"], exact, atol=1e-8)
    assert np.allclose(vectors(result, "compass.velocity"), 0.0, atol=1e-12)
    assert np.allclose(result["compass.angular_velocity.z"], w, atol=1e-10)


def test_torque_about_body_axes_spins_up_as_euler_says() -> None:
    """About a principal axis of the body a constant torque gives a constant angular acceleration."""
    scene = Scene(space="space", gravity=0.0)
    ship = scene.add("ship", lib.RigidBody(mass=2.0, moments=(1.0, 2.0, 2.5)))
    scene.start["ship.theta"] = 1.1
    jet = scene.add("jet", lib.Torque(resolved_in="body", axis=(0.0, 0.0, 1.0), value=0.5))
    scene.connect(ship.frame, jet.frame)
    result = simulate(scene, t_end=2.0, rtol=1e-10, outputs=5)
    assert np.allclose(result["ship.spin.z"], 0.2 * result.time, atol=1e-10)
    assert np.allclose(vectors(result, "ship.z_axis"), vectors(result, "ship.z_axis")[0], atol=1e-10)
    along = vectors(result, "ship.z_axis")[0]
    assert np.allclose(vectors(result, "jet.torque_in_world"), 0.5 * along, atol=1e-10)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), [("plane", (0.0, -1.0, 0.0)), ("space", (0.0, 0.0, 1.0))])
def test_a_torque_between_two_frames_changes_no_angular_momentum(
    space: str, axis: tuple[float, float, float], form: str
) -> None:
    scene = Scene(space=space, gravity=0.0)
    moments = {"one": (1.0, 2.0, 3.0), "other": (2.0, 1.0, 2.0)}
    one, other = (scene.add(name, lib.RigidBody(mass=1.0, moments=moments[name])) for name in moments)
    motor = scene.add("motor", lib.Torque(axis=axis, resolved_in="other", reacts_on="other", value=lambda t: 1.0 + t))
    scene.connect(one.frame, motor.frame)
    scene.connect(other.frame, motor.other)
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-10, outputs=5)
    impulse, k = result.time + result.time**2 / 2.0, int(np.argmax(np.abs(axis)))
    sign, name = np.sign(axis[k]), "xyz"[k]
    for path, moment, sense in (("one", moments["one"][k], 1.0), ("other", moments["other"][k], -1.0)):
        key = f"{path}.angular_velocity.{name}" if space == "space" else f"{path}.angle"
        if space == "space":
            assert np.allclose(result[key], sense * sign * impulse / moment, atol=1e-9)
        else:
            angle = result.time**2 / 2.0 + result.time**3 / 6.0
            assert np.allclose(result[key], sense * angle / moment, atol=1e-9)


# -- drag -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("space", ["line", "plane", "space"])
def test_terminal_velocity_by_the_hyperbolic_tangent(space: str) -> None:
    m, k, g = 0.4, 0.03, 9.81
    scene = Scene(space=space, gravity=g, **({"line_axis": (0.0, 0.0, 1.0)} if space == "line" else {}))
    ball = scene.add("ball", lib.PointMass(mass=m))
    drag = scene.add("drag", lib.Drag(density=1.2, area=0.1, drag_coefficient=0.5))
    assert pytest.approx(k) == 0.5 * 1.2 * 0.1 * 0.5
    scene.connect(ball.point, drag.point)
    result = simulate(scene, t_end=6.0, rtol=1e-10, outputs=13)
    final = math.sqrt(m * g / k)
    assert np.allclose(result["ball.velocity.z"], -final * np.tanh(g * result.time / final), atol=1e-7)
    height = -(final**2) / g * np.log(np.cosh(g * result.time / final))
    assert np.allclose(result["ball.position.z"], height, atol=1e-7)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_projectile_with_linear_drag_in_a_wind(form: str) -> None:
    m, b, g, wind = 0.5, 0.2, 9.81, np.array([3.0, -1.0, 0.5])
    scene = Scene(space="space", gravity=g)
    ball = scene.add("ball", lib.PointMass(mass=m))
    drag = scene.add("drag", lib.Drag(linear=b, wind=tuple(wind)))
    scene.connect(ball.point, drag.point)
    start = np.array([4.0, 2.0, 9.0])
    scene.start.update({f"ball.velocity.{k}": v for k, v in zip("xyz", start, strict=True)})
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-10, outputs=9)
    rate, final = b / m, wind + np.array([0.0, 0.0, -m * g / b])
    decay = np.exp(-rate * result.time)[:, None]
    assert np.allclose(vectors(result, "ball.velocity"), final + (start - final) * decay, atol=1e-8)
    path = final * result.time[:, None] + (start - final) * (1.0 - decay) / rate
    assert np.allclose(vectors(result, "ball.position"), path, atol=1e-8)
    assert result.energy.max_drift < 1e-7


def test_drag_is_smooth_at_rest() -> None:
    """A ball at rest in still air stays there, in every method; one at rest in a wind is taken along."""
    scene = Scene(space="space", gravity=0.0)
    ball = scene.add("ball", lib.PointMass(mass=1.0))
    drag = scene.add("drag", lib.Drag(linear=0.0, quadratic=2.0))
    scene.connect(ball.point, drag.point)
    for solver in ("ida", "explicit"):
        result = simulate(scene, solver=solver, t_end=1.0, outputs=3)
        assert np.all(vectors(result, "ball.position") == 0.0)
    drag.wind = (1.0, 0.0, 0.0)
    result = simulate(scene, t_end=2.0, rtol=1e-10, outputs=5)
    assert np.allclose(result["ball.velocity.x"], 1.0 - 1.0 / (1.0 + 2.0 * result.time), atol=1e-9)


# -- what is refused --------------------------------------------------------------------------------------------------


def test_a_wrong_choice_gives_near_matches() -> None:
    with pytest.raises(ParameterError, match=r"Force\.resolved_in.*Did you mean 'world'\? Choose from world, body"):
        lib.Force(resolved_in="wold")
    scene = Scene(space="space")
    push = scene.add("push", lib.Force(resolved_in="body"))
    with pytest.raises(DeclarationError, match=r"push: it has no connector 'point' as it is set.*resolved_in='world'"):
        _ = push.point


@pytest.mark.parametrize(
    ("part", "settings"),
    [
        (lib.TorsionSpring, {"stiffness": -1.0}),
        (lib.TorsionDamper, {"damping": -1.0}),
        (lib.Drag, {"quadratic": -1.0}),
        (lib.Drag, {"area": -1.0}),
        (lib.Bushing, {"stiffness": (1.0, -1.0, 1.0)}),
        (lib.Bushing, {"turning_damping": (1.0, 1.0, -1e-9)}),
        (lib.CentralGravity, {"gravitational_parameter": -1.0}),
    ],
)
def test_negative_factors_are_refused(part: Any, settings: dict[str, Any]) -> None:
    (name,) = settings
    with pytest.raises(ParameterError, match=rf"{part.__name__}\.{name}.*too small"):
        part(**settings)


def test_an_axis_out_of_the_plane_is_refused() -> None:
    scene = on_a_hinge("plane", (0.0, -1.0, 0.0), ("spring", lib.TorsionSpring(axis=(1.0, 0.0, 0.0))))
    with pytest.raises(AtwoodError, match=r"spring\.axis.*normal"):
        simulate(scene)


@pytest.mark.parametrize(
    ("space", "part", "said"),
    [
        ("plane", lib.Cylindrical, "exists in space only, and the scene is in a plane.*space='space'"),
        ("plane", lib.OrientationSensor, "exists in space only"),
        ("line", lib.Torque, "exists in a plane and in space only, and the scene is on a line"),
        ("line", lib.TorsionSpring, "exists in a plane and in space only"),
        ("line", lib.AngleSensor, "exists in a plane and in space only"),
    ],
)
def test_a_part_in_the_wrong_space_is_refused(space: str, part: Any, said: str) -> None:
    scene = Scene(space=space)
    ground, added = scene.add("ground", lib.Ground()), scene.add("odd", part())
    scene.connect(ground.frame, added.frame if part is lib.Torque else added.a)
    with pytest.raises(UnsupportedError, match=f"odd: {part.__name__} {said}"):
        assemble(scene)
