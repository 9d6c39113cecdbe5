"""Ropes: winches, heavy pulleys, drums, ropes that stretch, that let go, and that are heavy."""

import math

import numpy as np
import pytest

import atwood_library as lib
from atwood import Scene, simulate
from atwood.pipeline import assemble

from ..helpers.runs import FORMS


def machine(inertia: float) -> Scene:
    """Return two masses on a rope over a fixed pulley with inertia, on a line."""
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    ground, pulley = scene.add("ground", lib.Ground()), scene.add("pulley", lib.Pulley())
    rope = scene.add("rope", lib.Rope(pulleys=1, length=4.0, pulley_inertia=inertia))
    m1, m2 = scene.add("m1", lib.PointMass(mass=2.0)), scene.add("m2", lib.PointMass(mass=1.0))
    scene.connect(ground.frame, pulley.center)
    scene.connect(rope.over[0], pulley.groove)
    scene.connect(rope.a, m1.point)
    scene.connect(rope.b, m2.point)
    scene.start.update({"m1.position.z": -1.0, "m1.velocity.z": 0.0})
    scene.guess["m2.position.z"] = -3.0
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_a_pulley_with_inertia_on_a_line(form: str) -> None:
    result = simulate(machine(0.7), form=form, t_end=0.5, rtol=1e-11)
    a = 9.81 / (3.0 + 0.7)
    assert np.max(np.abs(result.array("m1.position.z") - (-1.0 - 0.5 * a * result.time**2))) < 1e-9
    assert np.max(np.abs(result.array("rope.tension_a") - 2.0 * (9.81 - a))) < 1e-8
    assert np.max(np.abs(result.array("rope.tension") - (9.81 + a))) < 1e-8
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_a_drum_is_the_same_pulley_with_its_radius(form: str) -> None:
    """Two ropes wound either way on one wheel, with masses guided straight below where they leave it."""
    scene = Scene()
    radius, inertia = 0.3, 0.7 * 0.3**2
    ground, hinge = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot())
    wheel = scene.add("wheel", lib.RigidBody(mass=1.0, moments=(0.0, inertia, 0.0)))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, wheel.frame)
    for name, side, mass, way in (("left", -1.0, 2.0, "counter-clockwise"), ("right", 1.0, 1.0, "clockwise")):
        post = scene.add(f"{name}_post", lib.Ground(position=(side * radius, 0.0, 0.0)))
        rail = scene.add(f"{name}_rail", lib.PointOnLine(axis=(0.0, 0.0, -1.0)))
        ball = scene.add(name, lib.PointMass(mass=mass))
        rope = scene.add(f"{name}_rope", lib.WoundRope(radius=radius, length=1.5, unwinds=way))
        scene.connect(post.frame, rail.a)
        scene.connect(rail.b, ball.point)
        scene.connect(rope.drum, wheel.frame)
        scene.connect(rope.end, ball.point)
        scene.guess[f"{name}_rail.displacement"] = 1.5
    scene.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": 0.0})
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-10)
    a = 9.81 / (3.0 + 0.7)
    assert np.max(np.abs(result.array("left_rail.displacement") - 1.5 - 0.5 * a * result.time**2)) < 1e-8
    assert np.max(np.abs(result.array("right_rope.tension") - (9.81 + a))) < 1e-6
    assert np.max(np.abs(result.array("left_rope.tension") - 2.0 * (9.81 - a))) < 1e-6
    assert np.max(np.abs(result.array("left_rope.swing"))) < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_a_pendulum_that_winds_itself_up(form: str) -> None:
    """A mass swings on a thread that winds on a fixed post: energy is kept, and the thread's material length too."""
    scene = Scene(gravity=4.0)
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.PointMass())
    rope = scene.add("rope", lib.WoundRope(radius=0.2, length=1.0))
    scene.connect(ground.frame, rope.drum)
    scene.connect(rope.end, ball.point)
    scene.start.update({"ball.position.x": 0.4, "ball.velocity.x": 1.0})
    scene.guess["ball.position.z"] = -0.8
    result = simulate(scene, form=form, t_end=1.0, rtol=1e-10)
    straight, swing = result.array("rope.straight"), result.array("rope.swing")
    assert np.max(np.abs(straight + 0.2 * swing - 1.0)) < 1e-9
    assert np.ptp(straight) > 0.05
    assert result.energy.max_drift < 1e-7
    # the tangent is square to the radius at the point where the rope leaves, and ends at the ball
    x, z = result.array("ball.position.x"), result.array("ball.position.z")
    leaves = -0.2 * np.cos(swing), -0.2 * np.sin(swing)
    assert np.max(np.abs(leaves[0] + straight * np.sin(swing) - x)) < 1e-9
    assert np.max(np.abs(leaves[1] - straight * np.cos(swing) - z)) < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_a_winch_hauls_a_load_up(form: str) -> None:
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    ground, load = scene.add("ground", lib.Ground()), scene.add("load", lib.PointMass(mass=3.0))
    rope = scene.add("rope", lib.Rope(length=2.0, paid_out=lambda t: -0.25 * t**2))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, load.point)
    scene.guess["load.position.z"] = -2.0
    result = simulate(scene, form=form, t_end=1.0, rtol=1e-10)
    assert np.max(np.abs(result.array("load.position.z") + 2.0 - 0.25 * result.time**2)) < 1e-9
    assert np.max(np.abs(result.array("rope.tension") - 3.0 * (9.81 + 0.5))) < 1e-7
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_sling_lets_go(space: str) -> None:
    scene = Scene(space=space)
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.PointMass())
    sensor = scene.add("sensor", lib.PositionSensor())
    rope = scene.add("rope", lib.Rope(length=1.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, ball.point)
    scene.connect(sensor.point, ball.point)
    scene.connect(sensor.output("position.z"), rope.input("release"))
    scene.start.update({"ball.position.x": 0.6, "ball.velocity.x": 3.0})
    scene.guess.update({"ball.position.z": 0.8, "ball.velocity.z": -4.0})
    result = simulate(scene, t_end=1.0, rtol=1e-10)
    assert [one.message for one in result.events if "let go" in one.message]
    at = next(one.time for one in result.events if "let go" in one.message)
    late = result.time > at
    x, z, t = result.array("ball.position.x")[late], result.array("ball.position.z")[late], result.time[late] - at
    speed = math.sqrt(3.75**2 + 2.0 * 9.81 * 0.8)
    assert np.max(np.abs(x - 1.0)) < 1e-7
    assert np.max(np.abs(z + speed * t + 0.5 * 9.81 * t**2)) < 1e-7
    assert np.all(result.array("rope.tension")[late] == 0.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_that_stretches_over_a_pulley(form: str) -> None:
    """Two equal masses on it, one thrown down: the extension swings with k (1/m + 1/m) and the middle stays."""
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    ground, pulley = scene.add("ground", lib.Ground()), scene.add("pulley", lib.Pulley())
    rope = scene.add("rope", lib.ElasticRope(pulleys=1, length=4.0, stiffness=50.0))
    m1, m2 = scene.add("m1", lib.PointMass(mass=2.0)), scene.add("m2", lib.PointMass(mass=2.0))
    scene.connect(ground.frame, pulley.center)
    scene.connect(rope.over[0], pulley.groove)
    scene.connect(rope.a, m1.point)
    scene.connect(rope.b, m2.point)
    start = {"m1.position.z": -2.0, "m2.position.z": -2.0, "m1.velocity.z": -1.0, "m2.velocity.z": 0.0}
    scene.start.update(start)
    scene.gravity = 0.0
    result = simulate(scene, form=form, t_end=0.4, rtol=1e-11)
    rate = math.sqrt(50.0 * (0.5 + 0.5))
    assert np.max(np.abs(result.array("rope.reach") - 4.0 - np.sin(rate * result.time) / rate)) < 1e-8
    scene.set("rope.length", 5.0)  # slack: nothing pulls
    free = simulate(scene, form=form, t_end=0.4, rtol=1e-11)
    assert np.max(np.abs(free.array("m1.position.z") + 2.0 + free.time)) < 1e-12
    assert np.max(free.array("rope.tension")) == 0.0


def test_a_heavy_rope_in_one_part() -> None:
    scene = Scene()
    ground = scene.add("ground", lib.Ground())
    rope = scene.add("rope", lib.LinkedRope(links=4, length=2.0, mass=1.2))
    scene.connect(ground.frame, rope.a)
    for n in range(4):
        scene.start[f"rope.rod[{n}].angle"] = 0.3
        scene.start[f"rope.rod[{n}].angular_velocity"] = 0.0
    assert len(assemble(scene).reduced.coordinates) == 4
    result = simulate(scene, t_end=1.0, rtol=1e-9)
    assert result.energy.max_drift < 1e-7
    assert result["rope.mass"][0] == pytest.approx(1.2)
    assert result["rope.knot[4].position.x"][0] == pytest.approx(2.0 * math.sin(0.3))


def double_machine(aside: float = 0.0) -> Scene:
    """Return Atwood's double machine in the plane: ropes wound on two wheels, of which one hangs on the other."""
    scene = Scene()
    ground, hinge = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot())
    outer = scene.add("outer", lib.RigidBody(mass=1.0, moments=(0.0, 0.05, 0.0)))
    inner = scene.add("inner", lib.RigidBody(mass=0.5, moments=(0.0, 0.004, 0.0)))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, outer.frame)
    balls = {name: scene.add(name, lib.PointMass(mass=mass)) for name, mass in (("m0", 3.0), ("m1", 2.0), ("m2", 1.0))}
    hung = (
        ("left", outer, 0.4, balls["m0"].point, "counter-clockwise"),
        ("right", outer, 0.4, inner.frame, "clockwise"),
        ("first", inner, 0.15, balls["m1"].point, "counter-clockwise"),
        ("second", inner, 0.15, balls["m2"].point, "clockwise"),
    )
    for name, wheel, radius, end, way in hung:
        rope = scene.add(name, lib.WoundRope(radius=radius, length=2.0, unwinds=way))
        scene.connect(wheel.frame, rope.drum)
        scene.connect(end, rope.end)
    scene.start.update({"hinge.angle": 0.0, "hinge.angular_velocity": 0.0, "inner.angle": 0.0})
    scene.start["inner.angular_velocity.y"] = 0.0
    places = {"m0": (-0.4, -2.0), "inner": (0.4, -2.0), "m1": (0.25, -4.0), "m2": (0.55, -4.0)}
    for name, (x, z) in places.items():
        scene.start.update({f"{name}.position.x": x, f"{name}.velocity.x": aside * (name == "m1")})
        scene.guess[f"{name}.position.z"] = z
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_the_double_machine_in_the_plane(form: str) -> None:
    """The weight m0 sinks with a, m1 past the inner wheel with b; wheels count by J/R^2 (Goldstein, section 1.4)."""
    result = simulate(double_machine(), form=form, t_end=0.4, rtol=1e-10)
    g, w0, w1 = 9.81, 0.05 / 0.4**2, 0.004 / 0.15**2
    # (m0 + M + m1 + m2 + w0) a - (m1 - m2) b = (m0 - M - m1 - m2) g;  -(m1 - m2) a + (m1 + m2 + w1) b = (m1 - m2) g
    a, b = np.linalg.solve([[6.5 + w0, -1.0], [-1.0, 3.0 + w1]], [-0.5 * g, g])
    half = 0.5 * result.time**2
    assert np.max(np.abs(result["m0.position.z"] + 2.0 + a * half)) < 1e-8
    assert np.max(np.abs(result["m1.position.z"] + 4.0 + (b - a) * half)) < 1e-8
    assert np.max(np.abs(result["left.tension"] - 3.0 * (g - a))) < 1e-6
    assert np.max(np.abs(result["first.tension"] - 2.0 * (g - (b - a)))) < 1e-6
    assert np.max(np.abs(result["second.tension"] - 1.0 * (g + b + a))) < 1e-6


def test_the_double_machine_swings_alike_in_both_forms() -> None:
    runs = [simulate(double_machine(0.8), form=form, t_end=0.4, rtol=1e-10, outputs=[0.0, 0.2, 0.4]) for form in FORMS]
    assert abs(runs[0]["first.swing"][-1]) > 0.1
    for path in ("m1.position.x", "m2.position.z", "inner.position.x", "left.tension"):
        assert runs[0][path] == pytest.approx(runs[1][path], abs=1e-7)
    assert max(one.energy.max_drift for one in runs) < 1e-8
