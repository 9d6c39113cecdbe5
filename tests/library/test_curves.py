"""Points on curves and surfaces: one description gives joint, constraint and observable."""

import math

import numpy as np
import pytest

import atwood as aw
import atwood_library as lib
from atwood import ParameterError, Result, Scene, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def on(joint: aw.Component, start: dict[str, float], space: str = "plane") -> Scene:
    """Return a bead on a joint called 'wire', which the ground carries."""
    scene = Scene(space=space)
    ground, wire = scene.add("ground", lib.Ground()), scene.add("wire", joint)
    bead = scene.add("bead", lib.PointMass(mass=2.0))
    scene.connect(ground.frame, wire.a)
    scene.connect(wire.b, bead.point)
    scene.start.update(start)
    return scene


@pytest.mark.parametrize(
    "part",
    [
        lib.PointOnCurve(curve=("cos(p)", "p", "sin(p)")),
        lib.PointOnSurface(surface=("p", "q", "0.5*(p**2 + q**2)")),
        lib.PointOnLevelSurface(function="x**2 + 2*y**2 + z**2 - 1"),
    ],
    ids=lambda part: type(part).__name__,
)
def test_parts_with_shapes_are_sound(part: aw.Component) -> None:
    report = aw.check(part, run=False)
    assert report.ok, report


@pytest.mark.parametrize("form", FORMS)
def test_a_circle_as_a_curve_is_a_circle_and_counts_its_turns(form: str) -> None:
    curve = on(lib.PointOnCurve(curve=("sin(p)", 0, "-cos(p)"), scale=0.7), {"wire.parameter": 0.1, "wire.rate": 9.0})
    circle = on(lib.PointOnCircle(radius=0.7), {"wire.angle": math.pi + 0.1, "wire.angular_velocity": 9.0})
    one, other = (simulate(scene, form=form, t_end=3.0, rtol=1e-12) for scene in (curve, circle))
    turned = one.array("wire.parameter")
    assert turned[-1] > 4.0 * math.pi
    assert np.max(np.abs(turned - (other.array("wire.angle") - math.pi))) < 1e-7
    assert np.max(np.abs(one.array("wire.speed") - 0.7 * one.array("wire.rate"))) < 1e-12
    for axis in "xz":
        assert np.max(np.abs(one.array(f"wire.force.{axis}") + one.array("ground.force." + axis) * -1.0)) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_the_zero_and_the_sense_of_line_and_circle_in_a_plane(form: str) -> None:
    start = {"wire.displacement": 0.5, "wire.speed": 0.0}
    line = simulate(on(lib.PointOnLine(axis=(3.0, 0.0, 4.0)), start), form=form, t_end=0.5)
    assert line["bead.position.x"][0] == pytest.approx(0.3)
    assert line["wire.displacement"][-1] == pytest.approx(0.5 - 0.8 * 9.81 / 8.0)
    assert line["wire.side_force"][-1] == pytest.approx(2.0 * 9.81 * 0.6)  # to the left, which is upwards
    start = {"wire.angle": 0.3, "wire.angular_velocity": 0.5}
    circle = simulate(on(lib.PointOnCircle(radius=2.0), start), form=form, t_end=0.1)
    assert circle["bead.position.x"][0] == pytest.approx(-2.0 * math.sin(0.3))  # counter-clockwise from above
    assert circle["bead.position.z"][0] == pytest.approx(2.0 * math.cos(0.3))


def states(scene: Scene) -> tuple[int, int]:
    equations = assemble(scene).reduced
    return len(equations.coordinates) + len(equations.speeds), len(equations.constraints)


def test_states_of_beads() -> None:
    assert states(on(lib.PointOnCurve(), {})) == (2, 0)
    assert states(on(lib.PointOnCurve(curve=("cos(p)", "sin(p)", "p")), {}, "space")) == (2, 0)
    assert states(on(lib.PointOnSurface(), {}, "space")) == (4, 0)
    assert states(on(lib.PointOnLevelSurface(), {}, "space")) == (4, 0)  # a plane is linear, and is eliminated
    assert states(on(lib.PointOnLevelSurface(function="x**2 + y**2 + z**2 - 1"), {}, "space")) == (6, 1)


@pytest.mark.parametrize("form", FORMS)
def test_a_level_surface_is_the_surface(form: str) -> None:
    start = {"bead.position.x": 0.5, "bead.position.y": 0.2, "bead.velocity.x": 0.0, "bead.velocity.y": 1.0}
    level = on(lib.PointOnLevelSurface(function="z - 0.5*(x**2 + 2*y**2)"), start, "space")
    graph = on(lib.PointOnSurface(surface=("p", "q", "0.5*(p**2 + 2*q**2)")), start, "space")
    one, other = (simulate(scene, form=form, t_end=2.0, rtol=1e-11) for scene in (level, graph))
    for axis in "xyz":
        assert np.max(np.abs(one.array(f"bead.position.{axis}") - other.array(f"bead.position.{axis}"))) < 1e-8
    push = np.sqrt(sum(other.array(f"wire.force.{axis}") ** 2 for axis in "xyz"))
    assert np.max(np.abs(one.array("wire.normal_force") - push)) < 1e-6


def test_a_curve_on_what_moves_pushes_back() -> None:
    """A bead in a bowl on a cart: the momentum along the rail is kept, and both forms agree."""

    def make() -> Scene:
        scene = Scene()
        ground, rail = scene.add("ground", lib.Ground()), scene.add("rail", lib.Slider())
        cart = scene.add("cart", lib.RigidBody(mass=3.0))
        bowl = scene.add("wire", lib.PointOnCurve(curve=("p", 0, "p**2")))
        bead = scene.add("bead", lib.PointMass(mass=1.0))
        scene.connect(ground.frame, rail.a)
        scene.connect(rail.b, cart.frame)
        scene.connect(cart.frame, bowl.a)
        scene.connect(bowl.b, bead.point)
        scene.start.update({"wire.parameter": 1.0, "wire.rate": 0.0, "rail.displacement": 0.0, "rail.speed": 0.0})
        return scene

    results: list[Result] = [simulate(make(), form=form, t_end=2.0, rtol=1e-11) for form in FORMS]
    for result in results:
        momentum = 3.0 * result.array("cart.velocity.x") + result.array("bead.velocity.x")
        assert np.max(np.abs(momentum)) < 1e-9
        assert np.ptp(result.array("wire.parameter")) > 1.0
    assert np.max(np.abs(results[0].array("wire.parameter") - results[1].array("wire.parameter"))) < 1e-8
    assert states(make()) == (4, 0)


def test_a_curve_in_a_loop() -> None:
    """A rod between two beads, each on a wire of its own: one of the curves closes the loop."""

    def make() -> Scene:
        scene = Scene()
        ground = scene.add("ground", lib.Ground())
        rod = scene.add("rod", lib.Link(length=1.5, mass=1.0))
        for end, shape in (("a", ("p", 0, "0.3*p**2")), ("b", ("p", 0, "0.5*sin(p)"))):
            wire = scene.add(f"wire_{end}", lib.PointOnCurve(curve=shape))
            scene.connect(ground.frame, wire.a)
            scene.connect(wire.b, getattr(rod, end))
        scene.start["wire_a.parameter"] = -0.7
        scene.guess["wire_b.parameter"] = 0.7
        return scene

    one, other = (simulate(make(), form=form, t_end=1.0, rtol=1e-10) for form in FORMS)
    for path in ("wire_a.parameter", "wire_b.parameter", "wire_a.rate"):
        assert np.max(np.abs(one.array(path) - other.array(path))) < 1e-7, path
    x, z = one.array("wire_b.parameter"), one.array("wire_b.local_position.z")
    assert np.max(np.abs(z - 0.5 * np.sin(x))) < 1e-12
    assert one.energy.max_drift < 1e-5  # of 6 mJ


def test_the_end_of_a_curve_is_an_event_with_a_name() -> None:
    slope = lib.PointOnCurve(curve=("p", 0, "-p"), upper_end=2.0)
    result = simulate(on(slope, {"wire.parameter": 0.0, "wire.rate": 0.0}), t_end=10.0)
    assert result.time[-1] == pytest.approx(math.sqrt(4.0 * math.sqrt(2.0) / (9.81 / math.sqrt(2.0))), rel=1e-8)
    assert "end of the curve" in result.message
    edge = lib.PointOnSurface(surface=("p", "q", "-p"), edge="1 - p**2 - q**2")
    start = {"wire.parameter_1": 0.0, "wire.rate_1": 0.1, "wire.parameter_2": 0.0}
    assert "edge of the surface" in simulate(on(edge, start, "space"), t_end=10.0).message


@pytest.mark.parametrize(
    ("curve", "said"),
    [
        (("p", 0, "abs(p)"), "corner at p = 0"),
        (("p", 0, "max(p - 1, 0)"), "corner at p = 1"),
        (("p", 0, "select(p < 2, 0, 1)"), "jumps at p = 2"),
        (("p - sin(p)", 0, "cos(p)"), "cusp"),
    ],
)
def test_a_curve_that_is_not_smooth_is_one_clear_error(curve: tuple[object, ...], said: str) -> None:
    with pytest.raises(ParameterError, match=said) as found:
        assemble(on(lib.PointOnCurve(curve=curve), {}))
    assert "wire.curve" in str(found.value)
    assert "\n" not in str(found.value)


def test_what_is_smooth_where_the_point_goes_is_not_refused() -> None:
    assemble(on(lib.PointOnCurve(curve=("p - sin(p)", 0, "cos(p)"), lower_end=0.1, upper_end=6.1), {}))
    assemble(on(lib.PointOnCurve(curve=("p", 0, "log(p)"), lower_end=0.01), {"wire.parameter": 1.0}))
    assemble(on(lib.PointOnCurve(curve=("p", 0, "select(p < 0, p**2, p**3)")), {}))


def test_a_cam_with_a_roller() -> None:
    """An eccentric disc lifts a follower in line with its axle: e cos + sqrt((R + r)^2 - e^2 sin^2)."""
    e, big, small = 0.1, 0.3, 0.05

    def make() -> Scene:
        scene = Scene()
        ground, hinge = scene.add("ground", lib.Ground()), scene.add("hinge", lib.Pivot())
        wheel = scene.add("wheel", lib.RigidBody(mass=1.0, moments=(0.0, 0.4, 0.0)))
        # clockwise along the disc, so that outside is to the left
        disc = (f"{e} + {big}*cos(p)", 0, f"-{big}*sin(p)")
        cam = scene.add("wire", lib.PointOnCurve(curve=disc, offset=small))
        guide = scene.add("guide", lib.PointOnLine(axis=(0.0, 0.0, 1.0), stiffness=200.0, natural_length=0.1))
        roller = scene.add("roller", lib.PointMass(mass=0.5))
        scene.connect(ground.frame, hinge.a)
        scene.connect(hinge.b, wheel.frame)
        scene.connect(wheel.frame, cam.a)
        scene.connect(ground.frame, guide.a)
        scene.connect(guide.b, roller.point)
        scene.connect(cam.b, roller.point)
        scene.start.update({"hinge.angle": 0.3, "hinge.angular_velocity": 6.0})
        scene.guess.update({"guide.displacement": 0.35, "wire.parameter": 0.3 - 0.5 * math.pi})
        return scene

    one, other = (simulate(make(), form=form, t_end=1.5, rtol=1e-10) for form in FORMS)
    for result in (one, other):
        turned = result.array("hinge.angle") - 0.5 * math.pi  # of the eccentricity from the follower's line
        lift = e * np.cos(turned) + np.sqrt((big + small) ** 2 - (e * np.sin(turned)) ** 2)
        assert np.max(np.abs(result.array("guide.displacement") - lift)) < 1e-10
        assert result.array("hinge.angle")[-1] > 2.0 * math.pi
        assert result.energy.max_drift < 1e-7
    assert np.max(np.abs(one.array("wire.speed") - other.array("wire.speed"))) < 1e-6
    assert states(make())[1] > 0  # a loop


def test_the_speed_along_a_curve_with_an_offset() -> None:
    scene = on(lib.PointOnCurve(curve=("p", 0, "0.5*p**2"), offset=0.2), {"wire.parameter": 0.4, "wire.rate": 1.0})
    result = simulate(scene, t_end=0.5, rtol=1e-10)
    speed = np.hypot(result.array("bead.velocity.x"), result.array("bead.velocity.z"))
    assert np.max(np.abs(np.abs(result.array("wire.speed")) - speed)) < 1e-9


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_car_on_a_round_track_is_a_compound_pendulum(form: str, space: str) -> None:
    radius, inertia, mass = 0.8, 0.3, 1.5
    scene = Scene(space=space)
    ground = scene.add("ground", lib.Ground())
    track = scene.add("track", lib.FrameOnCurve(curve=("sin(p)", 0, "-cos(p)"), scale=radius))
    car = scene.add("car", lib.RigidBody(mass=mass, moments=(0.1, inertia, 0.2)))
    scene.connect(ground.frame, track.a)
    scene.connect(track.b, car.frame)
    scene.start.update({"track.parameter": 1.0, "track.rate": 0.0})
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-11)
    pendulum = SCENES["simple-pendulum"](length=radius + inertia / (mass * radius), t_end=2.0)
    pendulum.start.update({"rod.angle": 1.0, "rod.angular_velocity": 0.0})
    exact = simulate(pendulum, rtol=1e-11).array("rod.angle")
    assert np.max(np.abs(result.array("track.parameter") - exact)) < 1e-7
    assert np.max(np.abs(result.array("track.slope_angle") - result.array("track.parameter"))) < 1e-9
    assert result.energy.max_drift < 1e-7
