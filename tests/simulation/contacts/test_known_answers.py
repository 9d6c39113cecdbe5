"""Contact, impact and dry friction against answers that are known: by hand, or from an analysis that is named."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.special
from tests.helpers.contact_scenes import box_of_walls, rough_pendulum

import atwood as aw
from atwood import Scene, simulate
from atwood.simulation.events.modes import find_event_functions
from atwood_library import (
    BallContact,
    Box,
    BoxContact,
    DistanceContact,
    Ground,
    Inertia,
    Link,
    Mass1D,
    Pivot,
    PointContact,
    PointMass,
    PointOnPlane,
    RotationalFriction,
    RotationalSource,
    RotationalStop,
    Slider,
    Sphere,
    Spherical,
    Spring,
    SurfaceContact,
    Universal,
    VertexContact,
)

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def run(scene: Scene, form: str, end: float, **options: object) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=[0.0, end], **options)


def times(result: aw.Result, kind: str) -> list[float]:
    return [one.time for one in result.events if one.kind == kind]


def on_plane(part: aw.Component, contact: aw.Component, **space: str) -> Scene:
    """Return a scene with a part, called m, on a plane, called c."""
    scene = Scene(**space)
    ground, m, c = scene.add("ground", Ground()), scene.add("m", part), scene.add("c", contact)
    scene.connect(ground.frame, c.plane)
    ends = {"PointContact": "point", "BallContact": "ball", "VertexContact": "body", "BoxContact": "box"}
    own = m.point if isinstance(part, PointMass) else m.a if isinstance(part, Link) else m.frame
    scene.connect(own, getattr(c, ends[type(contact).__name__]))
    return scene


def start_at(scene: Scene, x: float, z: float, vx: float, vz: float) -> None:
    scene.start.update({"m.position.x": x, "m.position.z": z, "m.velocity.x": vx, "m.velocity.z": vz})


@pytest.mark.sample(2)
@FORMS
@pytest.mark.parametrize("size", [1.0, 1e3, 1e-3])
def test_a_ball_bounces_and_comes_to_rest(form: str, size: float) -> None:
    scene = on_plane(PointMass(mass=2.0), PointContact(restitution=0.9))
    start_at(scene, 0.0, size, 0.0, 0.0)
    unit = math.sqrt(size)
    result = run(scene, form, 10.0 * unit)
    assert times(result, "impact")[9] == pytest.approx(5.4302180026 * unit, abs=1e-9 * unit)
    assert times(result, "rests")[-1] == pytest.approx(8.5789491787 * unit, abs=1e-9 * unit)
    assert result["m.position.z"][-1] == pytest.approx(0.0, abs=1e-12 * size)
    assert result["c.normal_force"][-1] == pytest.approx(2.0 * G)
    assert result["c.gap_state"][-1] == 1.0


@FORMS
@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_what_bounces_and_slides_is_rubbed_until_its_impacts_have_accumulated(form: str, rtol: float) -> None:
    """With e 1/2, mu 1/10, from the floor at (3, 2): hop k takes 4/(g 2^k) at 2.4 + 0.6/2^k; then 2.4 m/s go."""
    scene = on_plane(PointMass(mass=2.0), PointContact(restitution=0.5, friction=0.1))
    start_at(scene, 0.0, 0.0, 3.0, 2.0)
    result = simulate(scene, form=form, t_end=4.0, rtol=rtol, outputs=[0.0, 4.0])
    assert result["m.position.x"][-1] == pytest.approx(51.2 / G, abs=10.0 * rtol)
    assert times(result, "sticks") == pytest.approx([32.0 / G], abs=10.0 * rtol)


@pytest.mark.sample(1)
@FORMS
def test_a_ball_in_a_box_is_reflected_as_light_is(form: str) -> None:
    """Unfolded, its way is straight: after 4,321 s the place is that of a triangle wave of each coordinate."""
    result = run(box_of_walls(), form, 4321.0)
    assert len(times(result, "impact")) == 10_322
    assert result["m.position.x"][-1] == pytest.approx(0.5, abs=2e-10)
    assert result["m.position.z"][-1] == pytest.approx(0.4, abs=2e-10)


@pytest.mark.sample(1)
@FORMS
@pytest.mark.parametrize("friction", [0.0, 1e-12])
def test_an_elastic_ball_keeps_its_energy(form: str, friction: float) -> None:
    """Times of impacts are rounded, all the same way: what a ball falls in the rest of an ulp adds up."""
    scene = on_plane(PointMass(), PointContact(restitution=1.0, friction=friction))
    start_at(scene, 0.0, 1.0, 0.3, 0.0)
    result = run(scene, form, 1000.3)
    height, speed = result["m.position.z"][-1], result["m.velocity.z"][-1]
    assert len(result.impacts) == 1108
    assert height + speed**2 / (2.0 * G) == pytest.approx(1.0, abs=2e-11)


def on_slope(angle: float, speed: float, across: float | None = None, friction: float = 0.4) -> Scene:
    normal = (-math.sin(angle), 0.0, math.cos(angle))
    scene = on_plane(
        PointMass(mass=2.0),
        PointContact(normal=normal, friction=friction),
        space="plane" if across is None else "space",
    )
    start_at(scene, 0.0, 0.0, speed * math.cos(angle), speed * math.sin(angle))
    if across is not None:
        scene.start.update({"m.position.y": 0.0, "m.velocity.y": across})
    return scene


def along(result: aw.Result, angle: float, quantity: str) -> float:
    x, z = (float(result[f"m.{quantity}.{axis}"][-1]) for axis in "xz")
    return x * math.cos(angle) + z * math.sin(angle)


@FORMS
def test_a_block_slides_up_a_slope_and_stays(form: str) -> None:
    result = run(on_slope(0.3, 1.0), form, 1e4)
    slowing = G * (math.sin(0.3) + 0.4 * math.cos(0.3))
    assert along(result, 0.3, "position") == pytest.approx(0.5 / slowing, abs=1e-12)
    assert times(result, "sticks") == [pytest.approx(1.0 / slowing, abs=1e-10)]
    assert result["c.friction_force"][-1] == pytest.approx(2.0 * G * math.sin(0.3))
    assert result["c.slip_state"][-1] == 2.0


@FORMS
def test_a_block_slides_up_a_slope_and_back(form: str) -> None:
    result = run(on_slope(0.6, 1.0), form, 0.3364573836)
    assert along(result, 0.6, "position") == pytest.approx(0.0, abs=1e-9)
    assert along(result, 0.6, "velocity") == pytest.approx(-0.5119431119, abs=1e-9)
    assert len(times(result, "reverses")) == 1


@FORMS
def test_a_block_that_slides_across_a_slope_is_turned_down(form: str) -> None:
    """With tan(angle) as friction, speed and its part downwards always add up to the same (a puck on a slope)."""
    result = run(on_slope(0.3, 0.0, 2.0, math.tan(0.3)), form, 1.0)
    assert math.hypot(along(result, 0.3, "velocity"), result["m.velocity.y"][-1]) == pytest.approx(
        1.0081781882, abs=1e-9
    )


@FORMS
def test_a_mass_on_a_spring_stops_where_friction_holds_it(form: str) -> None:
    scene = on_plane(PointMass(mass=2.0), PointContact(friction=0.3))
    spring = scene.add("spring", Spring(stiffness=50.0))
    scene.connect(scene.ground.frame, spring.a)
    scene.connect(scene.m.point, spring.b)
    start_at(scene, 1.0, 0.0, 0.0, 0.0)
    result = run(scene, form, 5.0)
    assert times(result, "sticks")[-1] == pytest.approx(2.5132741229, abs=1e-9)
    assert result["m.position.x"][-1] == pytest.approx(0.05824, abs=1e-9)


@FORMS
def test_a_mass_on_a_belt_sticks_and_slips(form: str) -> None:
    contact = PointContact(friction=0.4, static_friction=0.6, surface_velocity=0.2)
    scene = on_plane(PointMass(mass=1.0), contact)
    wall, spring = (
        scene.add("wall", Ground(position=(-5.0, 0.0, 0.0))),
        scene.add("spring", Spring(stiffness=100.0, natural_length=5.0)),
    )
    scene.connect(wall.frame, spring.a)
    scene.connect(scene.m.point, spring.b)
    start_at(scene, 0.0, 0.0, 0.2, 0.0)
    periods = np.diff(times(run(scene, form, 3.0), "slips"))
    assert periods == pytest.approx(np.full(len(periods), 0.6693570623), abs=1e-9)


@FORMS
def test_a_sliding_ball_comes_to_roll(form: str) -> None:
    scene = on_plane(Sphere(mass=1.0, radius=0.1), BallContact(friction=0.2, radius=0.1))
    start_at(scene, 0.0, 0.1, 8.0, 0.0)
    scene.start["m.angular_velocity.y"] = 0.0
    result = run(scene, form, 2.0)
    assert times(result, "sticks") == [pytest.approx(1.1649919907, abs=1e-9)]
    assert result["m.velocity.x"][-1] == pytest.approx(5.0 / 7.0 * 8.0, abs=1e-9)


@FORMS
def test_a_cue_ball_with_spin_comes_to_roll(form: str) -> None:
    """Friction keeps its direction while it slips: it rolls after 2 u/(7 mu g), u the slip at first."""
    scene = on_plane(Sphere(mass=1.0, radius=0.0286), BallContact(friction=0.25, radius=0.0286), space="space")
    start_at(scene, 0.0, 0.0286, 2.0, 0.0)
    scene.start.update({"m.position.y": 0.0, "m.velocity.y": 0.0})
    scene.start.update({f"m.angular_velocity.{axis}": value for axis, value in zip("xyz", (30, 40, 10), strict=True)})
    result = run(scene, form, 0.5)
    assert times(result, "sticks") == [pytest.approx(0.1411949146, abs=1e-9)]
    assert result["m.velocity.x"][-1] == pytest.approx(1.7554285714, abs=1e-9)
    assert result["m.velocity.y"][-1] == pytest.approx(-0.2451428571, abs=1e-9)


@FORMS
def test_a_ladder_leaves_the_wall(form: str) -> None:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", Link(length=2.0, mass=1.0))
    for name, normal, end in (("floor", (0, 0, 1), m.a), ("wall", (1, 0, 0), m.b)):
        contact = scene.add(name, VertexContact(normal=normal))
        scene.connect(ground.frame, contact.plane)
        scene.connect(end, contact.body)
    scene.start.update({"m.angle": 0.5 * math.pi + 0.3, "m.angular_velocity": 0.0, "floor.gap": 0.0, "wall.gap": 0.0})
    result = run(scene, form, 0.7)
    assert [(one.part, one.kind) for one in result.events] == [("wall", "opens")]
    assert result.events[0].time == pytest.approx(0.6505624421, abs=1e-9)


@FORMS
def test_a_bead_leaves_a_sphere(form: str) -> None:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", SurfaceContact(function="x**2 + z**2 - 1"))
    scene.connect(ground.frame, contact.a)
    scene.connect(m.point, contact.b)
    start_at(scene, 0.0, 1.0, 0.5, 0.0)
    assert times(run(scene, form, 1.0), "opens") == [pytest.approx(0.7542388380, abs=1e-9)]


@FORMS
def test_a_stick_that_falls_slips(form: str) -> None:
    scene = on_plane(Link(length=1.0, mass=1.0), VertexContact(friction=0.25))
    scene.start.update({"m.angle": 0.5 * math.pi + 0.1, "m.angular_velocity": 0.0, "c.gap": 0.0, "c.slip": 0.0})
    assert times(run(scene, form, 0.6), "slips") == [pytest.approx(0.4962296185, abs=1e-9)]


@pytest.mark.sample(1)
@FORMS
def test_a_block_rocks(form: str) -> None:
    """G. Housner's block (Bull. Seism. Soc. Am. 53, 1963): each impact leaves 1 - 3/2 sin^2(alpha) of the rate."""
    box = BoxContact(length=0.5, height=2.0, friction=10.0)
    scene = on_plane(Box(mass=1.0, length_x=0.5, length_z=2.0), box)
    scene.start.update({"m.angle": 0.15, "m.angular_velocity.y": 0.0, "c.corner[0].gap": 0.0, "c.corner[0].slip": 0.0})
    result = run(scene, form, 9.0)
    found = times(result, "impact")
    assert found[0] == pytest.approx(0.5999358452, abs=1e-9)
    assert found[3] == pytest.approx(2.9278155896, abs=1e-9)
    assert times(result, "rests") == [pytest.approx(8.6907773166, abs=1e-8)]
    assert result["m.angle"][-1] == pytest.approx(0.0, abs=1e-9)


@FORMS
@pytest.mark.parametrize(
    ("impacts", "speeds"), [("together", [-0.6, 0.4, 0.4, 0.4, 0.4]), ("one_by_one", [0, 0, 0, 0, 1])]
)
def test_newton_s_cradle(form: str, impacts: str, speeds: list[float]) -> None:
    scene = Scene(space="line")
    balls = [scene.add(f"m{i}", Mass1D(mass=1.0)) for i in range(5)]
    for i in range(4):
        contact = scene.add(f"c{i}", DistanceContact(lower=0.1, restitution=1.0))
        scene.connect(balls[i].flange, contact.a)
        scene.connect(balls[i + 1].flange, contact.b)
    for i in range(5):
        scene.start.update({f"m{i}.displacement": 0.1 * i - 0.5 * (i == 0), f"m{i}.speed": float(i == 0)})
    result = run(scene, form, 1.0, impacts=impacts)
    assert [float(result[f"m{i}.speed"][-1]) for i in range(5)] == pytest.approx(speeds, abs=1e-12)


@FORMS
def test_an_engine_runs_into_ten_wagons(form: str) -> None:
    scene = Scene(space="line")
    wagons = [scene.add(f"m{i}", Mass1D(mass=1.0)) for i in range(11)]
    for i in range(10):
        contact = scene.add(f"c{i}", DistanceContact(lower=1.0))
        scene.connect(wagons[i].flange, contact.a)
        scene.connect(wagons[i + 1].flange, contact.b)
    for i in range(11):
        scene.start.update({f"m{i}.displacement": 1.1 * i, f"m{i}.speed": 3.0 * (i == 0)})
    result = run(scene, form, 2.0)
    assert times(result, "impact")[-1] == pytest.approx(sum(0.1 * k / 3.0 for k in range(1, 11)), abs=1e-9)
    assert result["m10.speed"][-1] == pytest.approx(3.0 / 11.0)


@FORMS
def test_two_rotors_with_play(form: str) -> None:
    scene = Scene()
    a, b = scene.add("a", Inertia(moment=1.0)), scene.add("b", Inertia(moment=2.0))
    play = scene.add("play", RotationalStop(lower=-0.1, upper=0.1, restitution=0.6))
    scene.connect(a.flange, play.a)
    scene.connect(b.flange, play.b)
    scene.start.update({"a.angle": 0.0, "b.angle": 0.0, "a.angular_velocity": 5.0, "b.angular_velocity": 0.0})
    assert times(run(scene, form, 1.3), "impact")[5] == pytest.approx(1.2060082305, abs=1e-9)


@FORMS
def test_a_pendulum_with_friction_in_its_hinge_stays(form: str) -> None:
    result = run(rough_pendulum(1.5), form, 15.0)
    assert (result.events[-1].kind, result.events[-1].time) == ("sticks", pytest.approx(13.6445534015, abs=1e-9))


@FORMS
def test_modelica_s_coupled_clutches(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.CoupledClutches: times at which its clutches stick and slip."""
    scene, turn = Scene(), 2.0 * math.pi
    rotors = [scene.add(f"J{i}", Inertia(moment=1.0)) for i in range(4)]
    motor = scene.add("motor", RotationalSource(value=lambda t: 10.0 * aw.sin(turn * 5.0 * t), against="ground"))
    scene.connect(rotors[0].flange, motor.b)
    levels = [
        lambda t: aw.sin(turn * 0.2 * t + 0.5 * math.pi),
        lambda t: aw.select(t < 0.4, 0.0, 1.0),
        lambda t: aw.select(t < 0.9, 0.0, 1.0),
    ]
    for i, level in enumerate(levels):
        clutch = scene.add(f"clutch{i}", RotationalFriction(sliding="10", peak=1.1, level=level))
        scene.connect(rotors[i].flange, clutch.a)
        scene.connect(rotors[i + 1].flange, clutch.b)
    for i in range(4):
        scene.start.update({f"J{i}.angle": 0.0, f"J{i}.angular_velocity": 10.0 * (i == 0)})
    known = [0.7096214747, 0.7916623592, 0.8311085061, 0.9068501928, 1.0002958599, 1.1439674925]
    found = [one.time for one in run(scene, form, 1.2).events if one.time > 0.5 and one.time != 0.9]
    assert found == pytest.approx(known, abs=1e-9)


@FORMS
def test_a_ball_bounces_in_a_circle(form: str) -> None:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", SurfaceContact(function="0.25 - x**2 - z**2", restitution=0.9))
    scene.connect(ground.frame, contact.a)
    scene.connect(m.point, contact.b)
    start_at(scene, 0.1, 0.0, 0.3, 0.0)
    assert times(run(scene, form, 2.2), "impact")[5] == pytest.approx(2.1345199766, abs=1e-9)


@FORMS
def test_painleve_s_rod_jams(form: str) -> None:
    scene = on_plane(Link(length=2.0, mass=1.0), VertexContact(friction=1.6))
    scene.start.update({"m.angle": 1.0, "m.angular_velocity": 0.0, "c.gap": 0.0, "c.slip": -1.0})
    result = run(scene, form, 0.01)
    assert times(result, "jams") == [0.0]


def test_a_start_inside_is_refused_with_the_part_and_the_depth() -> None:
    scene = on_plane(PointMass(mass=1.0), PointContact())
    start_at(scene, 0.0, -0.25, 0.0, 0.0)
    with pytest.raises(aw.StartError, match=r"c: it starts inside, by 0\.25 m"):
        simulate(scene, t_end=1.0)


def turned_run(turned: float) -> tuple[float, list[float]]:
    """Return how far a mass has slid that a spring pulls onto a plane, and its impacts, with all turned by an angle."""
    normal, tangent = (-math.sin(turned), math.cos(turned)), (math.cos(turned), math.sin(turned))
    contact = PointContact(normal=(normal[0], 0.0, normal[1]), friction=0.3, restitution=0.5)
    scene = on_plane(PointMass(mass=1.0), contact)
    scene.gravity = 0.0
    anchor = scene.add("anchor", Ground(position=(-2.0 * normal[0], 0.0, -2.0 * normal[1])))
    spring = scene.add("spring", Spring(stiffness=20.0))
    scene.connect(anchor.frame, spring.a)
    scene.connect(scene.m.point, spring.b)
    place = [0.4 * tangent[i] + 0.3 * normal[i] for i in (0, 1)]
    speed = [0.2 * tangent[i] - 0.1 * normal[i] for i in (0, 1)]
    start_at(scene, *place, *speed)
    result = run(scene, "reduced", 2.0)
    end = [float(result[f"m.position.{axis}"][-1]) for axis in "xz"]
    return end[0] * tangent[0] + end[1] * tangent[1], times(result, "impact")[:3]


@pytest.mark.parametrize("turned", [0.7, 2.5])
def test_contacts_are_the_same_however_a_scene_is_turned(turned: float) -> None:
    (place, impacts), (known, known_impacts) = turned_run(turned), turned_run(0.0)
    assert len(known_impacts) == 3
    assert place == pytest.approx(known, abs=1e-9)
    assert impacts == pytest.approx(known_impacts, abs=1e-9)


@FORMS
def test_what_is_far_away_takes_no_step_more_and_is_watched_by_its_gap_alone(form: str) -> None:
    def away(count: int) -> tuple[int, int, int]:
        scene = Scene()
        m = scene.add("m", PointMass(mass=1.0))
        for i in range(count):
            ground = scene.add(f"ground_{i}", Ground(position=(0.0, 0.0, -100.0 - i)))
            floor = scene.add(f"c_{i}", PointContact(friction=0.3))
            scene.connect(ground.frame, floor.plane)
            scene.connect(m.point, floor.point)
        start_at(scene, 0.0, 0.0, 1.0, 2.0)
        result = run(scene, form, 1.0)
        statistics = result.statistics
        return statistics.steps, statistics.residual_evaluations, len(find_event_functions(result.run.assembly))

    steps, evaluations, _ = away(1)
    assert away(5) == (steps, evaluations, 5)


def test_without_friction_nothing_slips() -> None:
    scene = on_plane(PointMass(mass=2.0), PointContact())
    start_at(scene, 0.0, 0.1, 0.3, 0.0)
    result = run(scene, "reduced", 1.0)
    assert [one.kind for one in result.events] == ["impact", "closes"]
    assert [result[f"c.{name}"][-1] for name in ("slip", "slip_state", "friction_force")] == [0.3, 0.0, 0.0]


@pytest.mark.parametrize("space", ["plane", "space"])
@FORMS
def test_a_pendulum_hits_a_rigid_stop_of_its_hinge(form: str, space: str) -> None:
    """From 0.5 rad it hangs straight after a quarter of its period, K(sin(1/4)) sqrt(l/g), and bounces back."""
    scene = Scene(space=space)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=2.0))
    pivot = scene.add("pivot", Pivot(lower_stop=-0.5 * math.pi, stop_restitution=0.6))
    link = scene.add("link", Link(length=1.0, mass=0.0))
    for ends in ((ground.frame, pivot.a), (pivot.b, link.a), (link.b, bob.point)):
        scene.connect(*ends)
    scene.start.update({"pivot.angle": 0.5 - 0.5 * math.pi, "pivot.angular_velocity": 0.0})
    result = run(scene, form, 3.0)

    def quarter(swing: float) -> float:
        return float(scipy.special.ellipk(math.sin(0.5 * swing) ** 2)) / math.sqrt(G)

    first, second = (2.0 * math.asin(0.6**n * math.sin(0.25)) for n in (0, 1))
    third = 2.0 * math.asin(0.36 * math.sin(0.25))
    known = np.cumsum([quarter(first), 2.0 * quarter(second), 2.0 * quarter(third)])
    assert times(result, "impact")[:3] == pytest.approx(known.tolist(), abs=1e-9)
    speed = 2.0 * math.sqrt(G) * math.sin(0.25)
    assert result.impacts[0].impulse == pytest.approx(2.0 * 1.6 * speed, rel=1e-9)
    assert "pivot.below_upper_stop" not in result


@FORMS
def test_stops_count_turns_and_hold_slides(form: str) -> None:
    scene = Scene(space="space", gravity=0.0)
    ground, body = scene.add("ground", Ground()), scene.add("body", Sphere(mass=1.0, radius=0.1))
    pivot = scene.add("pivot", Pivot(axis=(0.6, 0.0, 0.8), upper_stop=10.0, stop_restitution=0.5))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, body.frame)
    scene.start.update({"pivot.angle": 0.0, "pivot.angular_velocity": 2.0})
    result = run(scene, form, 8.0)
    assert times(result, "impact") == [pytest.approx(5.0, abs=1e-9)]
    assert result["pivot.angle"][-1] == pytest.approx(7.0, abs=1e-9)
    slide = Scene(space="line")
    ground, m = slide.add("ground", Ground()), slide.add("m", PointMass(mass=1.0))
    rail = slide.add("rail", Slider(lower_stop=-1.0, stop_restitution=0.5))
    slide.connect(ground.frame, rail.a)
    slide.connect(rail.b, m.point)
    slide.start.update({"rail.displacement": 0.0, "rail.speed": -2.0})
    assert run(slide, form, 2.0)["rail.displacement"][-1] == pytest.approx(0.5, abs=1e-9)


@FORMS
def test_cones_crosses_and_rims_are_rigid_stops(form: str) -> None:
    """What turns or flies freely between stops that leave a share e of its speed."""

    def jointed(joint: aw.Component, body: aw.Component, start: dict[str, float]) -> Scene:
        scene = Scene(space="space", gravity=0.0)
        ground, held = scene.add("ground", Ground()), scene.add("body", body)
        made = scene.add("joint", joint)
        scene.connect(ground.frame, made.a)
        scene.connect(made.b, held.point if isinstance(held, PointMass) else held.frame)
        scene.start.update(start)
        return scene

    still = {f"body.angular_velocity.{axis}": 2.0 if axis == "x" else 0.0 for axis in "xyz"}
    result = run(jointed(Spherical(bend_stop=1.0, stop_restitution=0.5), Sphere(radius=0.1), still), form, 7.0)
    assert times(result, "impact") == pytest.approx([0.5, 2.5, 6.5], abs=1e-9)
    assert [one.impulse for one in result.impacts] == pytest.approx([0.012, 0.006, 0.003], rel=1e-9)
    cross = Universal(lower_stop_a=-0.5, upper_stop_a=1.0, lower_stop_b=-1.0, upper_stop_b=1.0, stop_restitution=0.5)
    turning = dict.fromkeys(("joint.angle_a", "joint.angle_b", "joint.rate_b"), 0.0) | {"joint.rate_a": 2.0}
    result = run(jointed(cross, Sphere(radius=0.1), turning), form, 6.0)
    assert times(result, "impact") == pytest.approx([0.5, 2.0, 5.0], abs=1e-9)
    flying = {"body.position.x": 0.3, "body.position.y": 0.0, "body.velocity.x": 0.0, "body.velocity.y": 1.0}
    result = run(jointed(PointOnPlane(rim=0.5, stop_restitution=0.9), PointMass(mass=2.0), flying), form, 0.6)
    assert times(result, "impact") == pytest.approx([0.4], abs=1e-9)
    assert result.impacts[0].impulse == pytest.approx(3.04, rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "what"),
    [
        ({"stop_restitution": 0.5}, "its rigid stops are nowhere"),
        ({"stop_restitution": 0.5, "lower_stop": 0.0, "stop_stiffness": 1.0}, "cannot be elastic and rigid"),
    ],
)
def test_stops_that_mean_nothing_are_refused(settings: dict[str, float], what: str) -> None:
    scene = Scene()
    scene.add("pivot", Pivot(**settings))
    with pytest.raises(aw.ParameterError, match=what):
        aw.assemble(scene)


def block_on_floor(height: float) -> Scene:
    """Return Housner's block on a floor somewhere, on its corner."""
    scene = Scene()
    ground = scene.add("ground", Ground(position=(0.0, 0.0, height)))
    m = scene.add("m", Box(length_x=0.5, length_z=2.0))
    contact = scene.add("c", BoxContact(length=0.5, height=2.0, friction=10.0))
    scene.connect(ground.frame, contact.plane)
    scene.connect(m.frame, contact.box)
    scene.start.update({"m.angle": 0.15, "m.angular_velocity.y": 0.0, "c.corner[0].gap": 0.0, "c.corner[0].slip": 0.0})
    return scene


@pytest.mark.parametrize(
    ("height", "rtol", "off"), [(0.0, 1e-11, 2e-9), (0.0, 1e-12, 1e-9), (0.0, 1e-13, 2e-9), (1e4, 1e-10, 1e-5)]
)
def test_impacts_come_to_an_end_where_rounding_tells_in_their_intervals(height: float, rtol: float, off: float) -> None:
    """A block hops by 1e-14 m at last; rounding would have it go on for ever. The sum is that of earlier intervals."""
    result = simulate(block_on_floor(height), t_end=9.0, rtol=rtol, outputs=[0.0, 9.0])
    assert times(result, "rests") == [pytest.approx(8.690777316623845, abs=off)]


@pytest.mark.parametrize(
    ("restitution", "angle", "rtol", "off"),
    [(0.3, 0.23, 1e-7, 1e-4), (0.1, 0.15, 1e-9, 1e-7), (0.1, 0.15, 1e-10, 1e-9), (0.15, 0.23, 1e-9, 1e-7)],
)
def test_impacts_at_two_ends_in_turn_are_no_series_of_one(
    restitution: float, angle: float, rtol: float, off: float
) -> None:
    """A plank lands askew: its ends bounce in turn, by uneven intervals, and come to rest one after the other.

    With 0.1 and 0.15 rad it lands flat to 1e-6 m, where the end that still flies is no end that rests.
    """

    def rests(rtol: float) -> list[float]:
        scene = Scene()
        ground, m = scene.add("ground", Ground()), scene.add("m", Box(mass=1.0, length_x=2.0, length_z=0.1))
        contact = scene.add("c", BoxContact(length=2.0, height=0.1, restitution=restitution))
        scene.connect(ground.frame, contact.plane)
        scene.connect(m.frame, contact.box)
        scene.start["m.angle"] = angle
        start_at(scene, 0.0, 0.6, 0.0, 0.0)
        scene.start["m.angular_velocity.y"] = 0.0
        return times(simulate(scene, t_end=0.6, rtol=rtol, outputs=[0.0, 0.6]), "rests")

    found, known = rests(rtol), rests(1e-11)
    assert found == pytest.approx(known, abs=off)
    assert found[-1] == pytest.approx(known[-1], abs=1e-3 * off if restitution < 0.2 else off)
