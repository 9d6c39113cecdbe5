"""How parts are mounted, measured and driven: frames, directions, sensors, rotors, housings, springs with mass."""

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import atwood as aw
import atwood_library as lib
from atwood import ParameterError, Scene, simulate

FORMS = ["reduced", "dae"]


def axes(result: aw.Result, body: str) -> Any:
    return np.array([[result[f"{body}.{axis}_axis.{k}"][0] for axis in "xyz"] for k in "xyz"])


def turned(**weld: Any) -> Any:
    """Return the axes of a body that is welded to another, in the axes of that one."""
    scene = Scene(space="space", gravity=0.0)
    first, joint = scene.add("first", lib.Box()), scene.add("joint", lib.Weld(**weld))
    second = scene.add("second", lib.Cylinder())
    scene.connect(first.frame, joint.a)
    scene.connect(joint.b, second.frame)
    scene.start["first.phi"], scene.start["first.theta"] = 0.3, 0.7
    result = simulate(scene, t_end=0.01, outputs=2)
    return axes(result, "first").T @ axes(result, "second")


@pytest.mark.sample(3)
@pytest.mark.parametrize("convention", ["xyz", "zxz", "zyx", "yxz"])
def test_a_frame_displaced_by_three_angles(convention: str) -> None:
    expected = Rotation.from_euler(convention.upper(), (0.3, -0.4, 1.5)).as_matrix()
    found = turned(turned_by="three angles", convention=convention, angles=(0.3, -0.4, 1.5))
    assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("x", "y"), [((1.0, 2.0, 3.0), (0.0, 1.0, 0.5)), ("z", (0.0, 3.0, 0.0)), ("-x", (0.2, 1.0, 0.0)), ("-z", (1, 0, 0))]
)
def test_a_frame_displaced_by_two_axes(x: Any, y: Any) -> None:
    found = turned(turned_by="two axes", x_axis=x, y_axis=y)
    given = np.array({"z": (0, 0, 1), "-x": (-1, 0, 0), "-z": (0, 0, -1)}.get(x, x), dtype=float)
    first = given / np.linalg.norm(given)
    second = np.array(y, dtype=float) - first * (first @ np.array(y, dtype=float))
    second /= np.linalg.norm(second)
    assert_allclose(found, np.array([first, second, np.cross(first, second)]).T, atol=1e-12)


def test_in_a_plane_a_frame_turns_about_the_normal() -> None:
    def angle(**weld: Any) -> float:
        scene = Scene(gravity=0.0)
        first, joint = scene.add("first", lib.Box()), scene.add("joint", lib.Weld(**weld))
        second = scene.add("second", lib.Box())
        scene.connect(first.frame, joint.a)
        scene.connect(joint.b, second.frame)
        scene.start["first.angle"] = 0.2
        return float(simulate(scene, t_end=0.01, outputs=2)["second.angle"][0]) - 0.2

    assert angle(turned_by="two axes", x_axis=(cos(0.5), 0.0, sin(0.5))) == pytest.approx(0.5)
    assert angle(turned_by="three angles", convention="yxy", angles=(-0.3, 0.0, -0.1)) == pytest.approx(0.4)
    with pytest.raises(ParameterError, match="nothing turns about x"):
        angle(turned_by="three angles", angles=(0.1, 0.0, 0.0))
    with pytest.raises(ParameterError, match="parallel"):
        angle(turned_by="two axes", y_axis=(2.0, 0.0, 0.0))


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_body_along_any_direction_is_the_turned_body(form: str) -> None:
    direction, upward = np.array([1.0, 2.0, 3.0]) / sqrt(14.0), np.array([0.0, 1.0, 0.0])
    across = np.cross(upward, direction)
    across /= np.linalg.norm(across)
    weld = lib.Weld(turned_by="two axes", x_axis=tuple(direction), y_axis=tuple(across))
    sizes = {"length_x": 0.6, "length_y": 0.2, "length_z": 0.4}

    def run(box: lib.Box, mount: lib.Weld) -> aw.Result:
        scene = Scene(space="space")
        ball, fixed = scene.add("ball", lib.Spherical()), scene.add("mount", mount)
        ground, body = scene.add("ground", lib.Ground()), scene.add("box", box)
        frame = scene.add("plate", lib.RigidBody(mass=1.0, center=(0.1, 0.2, 0.0), moments=(0.1, 0.2, 0.25)))
        scene.connect(ground.frame, ball.a)
        scene.connect(ball.b, frame.frame)
        scene.connect(frame.frame, fixed.a)
        scene.connect(fixed.b, body.frame)
        scene.connect(body.b, scene.add("tip", lib.PointMass(mass=0.5)).point)
        scene.start["plate.spin.x"], scene.start["plate.spin.y"], scene.start["plate.spin.z"] = 1.0, 0.0, 2.0
        return simulate(scene, t_end=1.0, form=form, rtol=1e-9, outputs=5)

    along = run(lib.Box(direction=tuple(direction), upward=tuple(upward), **sizes), lib.Weld())
    turned_box = run(lib.Box(**sizes), weld)
    for path in ("plate.spin.x", "plate.spin.y", "tip.position.x", "tip.position.z"):
        assert_allclose(along[path], turned_box[path], atol=2e-7)
    drawn = lib.Box(direction=tuple(direction), upward=tuple(upward)).outline()
    assert_allclose(drawn.axes[:, 0], direction, atol=1e-12)
    with pytest.raises(ParameterError, match="parallel"):
        run(lib.Box(direction="z"), lib.Weld())


def test_round_bodies_along_any_direction() -> None:
    n = np.array([2.0, -1.0, 2.0]) / 3.0
    for part in (lib.Cylinder(mass=2.0), lib.Tube(mass=2.0), lib.Bar(mass=2.0)):
        along = np.diag(np.array(part.tensor(), dtype=float))
        part.axis, part.direction = "direction", tuple(n)
        tensor = np.array(part.tensor(), dtype=float)
        assert_allclose(tensor, along[0] * np.eye(3) + (along[2] - along[0]) * np.outer(n, n), atol=1e-15)
        assert_allclose(part.outline().axes[:, 2], n)
        report = aw.check(part, run=False)
        assert report.ok, report


@pytest.mark.parametrize("form", FORMS)
def test_sensors_in_any_axes(form: str) -> None:
    """On a pendulum, in its own axes: centripetal and tangential, acceleration and force."""
    scene = Scene()
    ground, pivot, link = (
        scene.add("ground", lib.Ground()),
        scene.add("pivot", lib.Pivot()),
        scene.add("rod", lib.Link()),
    )
    cut, tip = scene.add("cut", lib.ForceSensor(resolved_in="frame")), lib.PositionSensor(resolved_in="frame")
    scene.add("tip", tip)
    back = scene.add("back", lib.RelativePositionSensor(resolved_in="frame"))
    for a, b in (
        (ground.frame, pivot.a), (pivot.b, cut.a), (cut.b, link.a), (link.a, cut.axes), (link.b, tip.point),
        (link.a, tip.axes), (link.b, back.a), (ground.frame, back.b), (link.a, back.axes),
    ):  # fmt: skip
        scene.connect(a, b)
    scene.start["pivot.angle"], scene.start["pivot.angular_velocity"] = -0.3, 1.0
    r = simulate(scene, t_end=1.0, form=form, rtol=1e-9)
    angle, rate = r["pivot.angle"], r["pivot.angular_velocity"]
    second = -1.5 * 9.81 * np.cos(angle)
    assert_allclose(r["tip.acceleration.x"], -(rate**2), atol=1e-12)
    assert_allclose(r["tip.acceleration.z"], second, atol=1e-12)
    assert_allclose(r["tip.velocity.z"], rate, atol=1e-12)
    assert_allclose(r["back.position.x"], -1.0, atol=1e-12)
    assert_allclose(r["cut.resolved_force.x"], 9.81 * np.sin(angle) - 0.5 * rate**2, atol=1e-11)
    assert_allclose(r["cut.resolved_force.z"], 9.81 * np.cos(angle) + 0.5 * second, atol=1e-11)


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["line", "plane"])
def test_a_spring_with_mass(form: str, space: str) -> None:
    """A third of an even spring moves with the bob, and half of it hangs there; in the middle a quarter, and half."""
    for place, moving in ((None, 1.0 / 3.0), (0.5, 0.25), (1.0, 1.0)):
        settings: Any = {"line_axis": (0.0, 0.0, 1.0)} if space == "line" else {}
        scene = Scene(space=space, **settings)
        ground, bob = scene.add("ground", lib.Ground()), scene.add("bob", lib.PointMass(mass=1.0))
        spring = scene.add("spring", lib.Spring(stiffness=40.0, natural_length=0.5, mass=0.6, mass_at=place))
        scene.connect(ground.frame, spring.a)
        scene.connect(spring.b, bob.point)
        scene.start["bob.position.z"], scene.start["bob.velocity.z"] = -0.5, 0.0
        if space == "plane":
            scene.start["bob.position.x"] = 0.0
        r = simulate(scene, t_end=1.0, form=form, rtol=1e-9)
        hanging = 1.3 if place != 1.0 else 1.6
        w, sag = sqrt(40.0 / (1.0 + 0.6 * moving)), hanging * 9.81 / 40.0
        assert_allclose(r["bob.position.z"], -0.5 - sag + sag * np.cos(w * r.time), atol=1e-6)
        assert r.energy.max_drift < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_a_rotor_on_a_free_body_is_a_gyrostat(form: str) -> None:
    """Euler's equations with a rotor: ``h = J w + I n (w . n + s)``, driven by a torque about n."""
    j, n, inertia, torque = np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, 0.8]), 0.5, 0.7

    def rates(_: float, y: Any) -> Any:
        w, s = y[:3], y[3]
        h = j * w + inertia * n * (w @ n + s)
        mass = np.zeros((4, 4))
        mass[:3, :3] = np.diag(j) + inertia * np.outer(n, n)
        mass[:3, 3] = mass[3, :3] = inertia * n
        mass[3, 3] = inertia
        return np.linalg.solve(mass, [*-np.cross(w, h), torque])

    scene = Scene(space="space", gravity=0.0)
    body = scene.add("body", lib.RigidBody(moments=tuple(j)))
    rotor = scene.add("rotor", lib.Rotor(moment=inertia, axis=tuple(n), motor=torque))
    scene.connect(body.frame, rotor.a)
    scene.start.update({"body.spin.x": 0.3, "body.spin.y": 1.0, "body.spin.z": -0.4})
    scene.start.update({"rotor.angle": 0.0, "rotor.angular_velocity": 4.0})
    r = simulate(scene, t_end=2.0, form=form, rtol=1e-10, outputs=5)
    exact = solve_ivp(rates, (0.0, 2.0), [0.3, 1.0, -0.4, 4.0], "DOP853", r.time, rtol=1e-12, atol=1e-12).y
    for row, path in zip(exact, ("body.spin.x", "body.spin.y", "body.spin.z", "rotor.angular_velocity"), strict=True):
        assert_allclose(r[path], row, atol=2e-7)


@pytest.mark.parametrize("form", FORMS)
def test_a_gear_in_a_housing_that_turns(form: str) -> None:
    """Three rotors with ``a - h = 3 (b - h)``: Newton's equations with one multiplier."""
    scene = Scene(gravity=0.0)
    a, b, h = (scene.add(name, lib.Inertia(moment=m)) for name, m in (("a", 1.0), ("b", 2.0), ("h", 4.0)))
    gear, motor = scene.add("gear", lib.Gear(ratio=3.0, support="flange")), scene.add("motor", lib.RotationalSource())
    motor.value = 2.0
    for one, other in ((a.flange, gear.a), (b.flange, gear.b), (h.flange, gear.housing), (a.flange, motor.b)):
        scene.connect(one, other)
    r = simulate(scene, t_end=1.0, form=form, rtol=1e-9)
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[3, :3] = np.diag([1.0, 2.0, 4.0]), (1.0, -3.0, 2.0)
    matrix[:3, 3] = -matrix[3, :3]
    *rates, multiplier = np.linalg.solve(matrix, [2.0, 0.0, 0.0, 0.0])
    assert [r[f"{name}.angular_velocity"][-1] for name in "abh"] == pytest.approx(rates, abs=1e-8)
    loads = [r[f"gear.{name}"][-1] for name in ("torque_a", "torque_b", "housing_torque")]
    assert loads == pytest.approx([multiplier, -3.0 * multiplier, 2.0 * multiplier], abs=1e-8)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_an_acceleration_that_is_given_and_measured(form: str, space: str) -> None:
    scene = Scene(space=space, gravity=0.0)
    rotor, sensor = scene.add("rotor", lib.Inertia(moment=2.0)), scene.add("sensor", lib.RotationalSensor())
    motion = lib.RotationalMotion(follows="acceleration", acceleration=lambda t: aw.cos(3.0 * t))
    scene.connect(rotor.flange, scene.add("motion", motion).b)
    scene.connect(rotor.flange, sensor.b)
    scene.start["motion.planned"], scene.start["rotor.angle"] = 9.0, 0.2
    r = simulate(scene, t_end=2.0, form=form, rtol=1e-9)
    t = r.time
    assert_allclose(r["sensor.angle"], 0.2 + 9.0 * t + (1.0 - np.cos(3.0 * t)) / 9.0, atol=1e-6)
    assert r["sensor.angle"][-1] > 5.0 * pi  # turns are counted
    assert_allclose(r["sensor.angular_acceleration"], np.cos(3.0 * t), atol=1e-12)
    assert_allclose(r["motion.torque"], 2.0 * np.cos(3.0 * t), atol=1e-12)
    assert r.energy.max_drift < 1e-6


def test_two_masses_accelerated_against_each_other() -> None:
    scene = Scene(gravity=0.0)
    a, b = scene.add("a", lib.Mass1D(mass=1.0)), scene.add("b", lib.Mass1D(mass=3.0))
    motion = scene.add("motion", lib.TranslationalMotion(follows="acceleration", acceleration=2.0, against="flange"))
    sensor = scene.add("sensor", lib.TranslationalSensor(against="flange"))
    for flange, part in ((a.slide, motion.a), (b.slide, motion.b), (a.slide, sensor.a), (b.slide, sensor.b)):
        scene.connect(flange, part)
    scene.start.update({"a.displacement": 0.0, "b.displacement": 1.0, "a.speed": 0.0})
    r = simulate(scene, t_end=1.0, rtol=1e-9)
    assert_allclose(r["sensor.displacement"], 1.0 + r.time**2, atol=1e-7)
    assert_allclose(r["sensor.acceleration"], 2.0, atol=1e-12)
    assert_allclose(r["motion.force"], 2.0 * 0.75, atol=1e-12)
    assert_allclose(r["a.speed"] + 3.0 * r["b.speed"], 0.0, atol=1e-8)


def test_a_place_cannot_follow_a_state() -> None:
    class Follower(aw.Component):
        """A point that is held where a state says."""

        point: aw.Point = aw.connector(aw.Point, "The point.")
        place: aw.Scalar = aw.state(0.0, unit="m", doc="Where it is.")

        @aw.derivative("place")
        def rate(self) -> aw.Scalar:
            """Return the rate."""
            return 1.0

        @aw.constraint(reaction="force", unit="N", doc="Force.")
        def hold(self) -> aw.Scalar:
            """Return by how much it is off."""
            return self.point.position.x - self.place

    scene = Scene(space="line")
    scene.connect(scene.add("mass", lib.PointMass()).point, scene.add("follower", Follower()).point)
    with pytest.raises(aw.UnsupportedError, match=r"follower\.hold: a constraint on positions cannot follow"):
        simulate(scene, t_end=1.0)
