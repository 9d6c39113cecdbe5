"""Contact, impact and dry friction against answers that are known: by hand, or from an analysis that is named."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.special

import atwood as aw
from atwood import Scene, simulate
from atwood.simulation.events.modes import find_event_functions
from atwood_library import (
    Box,
    BoxContact,
    Drive,
    Force,
    Ground,
    Link,
    Pivot,
    PointContact,
    PointMass,
    PointOnPlane,
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
@pytest.mark.parametrize("scene", ["bead", "block"])
def test_what_is_light_has_forces_of_its_own_size(form: str, scene: str) -> None:
    """A gram beside a thousand tons leaves a sphere, or slips, when it does so alone."""
    made, bead = Scene(), scene == "bead"
    ground, m, heavy = (
        made.add("ground", Ground()),
        made.add("m", PointMass(mass=1e-3)),
        made.add("heavy", PointMass(mass=1e6)),
    )
    floor = made.add("floor", PointContact(friction=0.3))
    made.connect(ground.frame, floor.plane)
    made.connect(heavy.point, floor.point)
    made.start.update({"heavy.position.x": 2.0, "heavy.position.z": 0.0})
    made.start.update({"heavy.velocity.x": 0.0, "heavy.velocity.z": 0.0})
    if bead:
        contact = made.add("c", SurfaceContact(function="x**2 + z**2 - 1"))
        made.connect(ground.frame, contact.a)
        made.connect(m.point, contact.b)
        start_at(made, 0.0, 1.0, 0.5, 0.0)
    else:
        contact, pull = made.add("c", PointContact(friction=0.5)), made.add("pull", Force(value=lambda t: 1e-3 * G * t))
        for ends in ((ground.frame, contact.plane), (m.point, contact.point), (m.point, pull.point)):
            made.connect(*ends)
        start_at(made, 0.0, 0.0, 0.0, 0.0)
    result = run(made, form, 1.0)
    told = [(one.part, one.kind) for one in result.events]
    assert told == [("c", "opens" if bead else "slips")]
    assert result.events[0].time == pytest.approx(0.7542388380 if bead else 0.5, abs=1e-9)
    assert bead or result["m.velocity.x"][-1] == pytest.approx(0.125 * G, abs=1e-9)


def test_a_start_inside_is_refused_with_the_part_and_the_depth() -> None:
    scene = on_plane(PointMass(mass=1.0), PointContact())
    start_at(scene, 0.0, -0.25, 0.0, 0.0)
    with pytest.raises(aw.StartError, match=r"c: it starts inside, by 0\.25 m"):
        simulate(scene, t_end=1.0)


@FORMS
def test_a_contact_of_what_cannot_move_by_itself_is_refused(form: str) -> None:
    scene = on_plane(Box(mass=1.0, length_x=1.0, length_z=0.1), VertexContact(friction=0.3))
    drive = scene.add("drive", Drive(axis=(1.0, 0.0, 0.0), motion=lambda t: 0.5 * t))
    scene.connect(scene.ground.frame, drive.a)
    scene.connect(drive.b, scene.m.frame)
    with pytest.raises(aw.UnsupportedError, match="c: nothing in the scene can move by itself"):
        run(scene, form, 1.0)


def strut(friction: float, law: str) -> Scene:
    """Return a rod on a hinge that turns at 1 rad/s until its end hits a floor 0.9 below, with a restitution of 0.5."""
    scene = Scene(gravity=0.0)
    ground, floor = scene.add("ground", Ground()), scene.add("floor", Ground(position=(0.0, 0.0, -0.9)))
    pivot, rod = scene.add("pivot", Pivot()), scene.add("rod", Link(length=1.0, mass=1.0))
    tip = scene.add("tip", VertexContact(friction=friction, restitution=0.5, impact_law=law))
    for ends in ((ground.frame, pivot.a), (pivot.b, rod.a), (floor.frame, tip.plane), (rod.b, tip.body)):
        scene.connect(*ends)
    scene.start.update({"pivot.angle": -0.8, "pivot.angular_velocity": -1.0})
    return scene


@FORMS
@pytest.mark.parametrize("friction", [0.3, 2.0])
def test_friction_acts_on_both_impulses_of_poisson_s_law(form: str, friction: float) -> None:
    """The rate is a share e (c - mu s)/(c + mu s) of what it was, c and s those of its slope; steep friction locks it.

    Friction turns round with the motion: it is with the first impulse, and against the second.
    """
    c, s = math.sqrt(1.0 - 0.81), 0.9
    result = run(strut(friction, "poisson"), form, 0.5)
    share = max(0.0, 0.5 * (c - friction * s) / (c + friction * s))
    assert result["pivot.angular_velocity"][-1] == pytest.approx(share, abs=1e-12)
    assert result.impacts[0].loss == pytest.approx((1.0 - share**2) / 6.0, rel=1e-9)
    if friction > c / s:  # by Newton's law it turns back, and no friction lets it
        with pytest.raises(aw.SolveError, match="no impulses satisfy") as said:
            run(strut(friction, "newton"), form, 0.5)
        assert "impact_law='poisson'" in str(said.value)


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


def block_on_floor(height: float, length: float = 0.5, angle: float = 0.15) -> Scene:
    """Return Housner's block on a floor somewhere, on its corner."""
    scene = Scene()
    ground = scene.add("ground", Ground(position=(0.0, 0.0, height)))
    m = scene.add("m", Box(length_x=length, length_z=2.0))
    contact = scene.add("c", BoxContact(length=length, height=2.0, friction=10.0))
    scene.connect(ground.frame, contact.plane)
    scene.connect(m.frame, contact.box)
    scene.start.update({"m.angle": angle, "m.angular_velocity.y": 0.0, "c.corner[0].gap": 0.0, "c.corner[0].slip": 0.0})
    return scene


@pytest.mark.parametrize(
    ("height", "rtol", "off"), [(0.0, 1e-11, 1e-10), (0.0, 1e-12, 1e-10), (0.0, 1e-13, 1e-10), (1e4, 1e-10, 1e-5)]
)
def test_impacts_come_to_an_end_where_rounding_tells_in_their_intervals(height: float, rtol: float, off: float) -> None:
    """A block hops by 1e-14 m at last; rounding would have it go on for ever. The sum is that of earlier intervals."""
    result = simulate(block_on_floor(height), t_end=9.0, rtol=rtol, outputs=[0.0, 9.0])
    assert times(result, "rests") == [pytest.approx(8.690777316623845, abs=off)]


@pytest.mark.parametrize(
    ("length", "angle", "rests"), [(0.3, 0.1, 24.446796526006732), (0.25, 0.05, 27.92141675027858)]
)
@pytest.mark.parametrize(("rtol", "off"), [(1e-6, 3e-5), (1e-9, 1e-7), (1.42e-13, 5e-9)])
def test_the_sum_of_impacts_that_lose_little_is_that_of_long_intervals(
    length: float, angle: float, rests: float, rtol: float, off: float
) -> None:
    """Slender blocks keep 0.967 and 0.977 of their rate, so that the sum has a thousand times the errors of intervals.

    At 1e-6 what rises is as slow as what rests before the end of the series is near: the sum is told all the same.
    Known times are sums of elliptic integrals, with 40 digits.
    """
    end = 1.02 * rests
    result = simulate(block_on_floor(0.0, length, angle), t_end=end, rtol=rtol, outputs=[0.0, end])
    assert times(result, "rests") == [pytest.approx(rests, abs=off)]


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize(
    ("restitution", "rtol"), [(0.97, 1e-13), (0.985, 1e-11), (0.995, 1e-8), (0.995, 1e-13), (0.99, 1e-12)]
)
def test_impacts_that_lose_little_come_to_an_end_when_their_sum_says(
    restitution: float, rtol: float, friction: float
) -> None:
    """At tight tolerances these were taken for bounces that rounding makes, and ended 1e-5 s too early.

    How far it has gone along the floor says nothing of how well its height is known: the last had no end.
    """
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", PointContact(restitution=restitution, friction=friction))
    scene.connect(ground.frame, contact.plane)
    scene.connect(m.point, contact.point)
    start_at(scene, 0.0, 1.0, 1.0, 0.0)
    rests = math.sqrt(2.0 / 9.81) * (1.0 + restitution) / (1.0 - restitution)
    result = simulate(scene, t_end=1.02 * rests, rtol=rtol, outputs=[0.0, 1.02 * rests])
    assert times(result, "rests") == [pytest.approx(rests, abs=3e-9)]


@pytest.mark.sample(4)
@FORMS
@pytest.mark.parametrize("friction", [0.0, 0.05])
@pytest.mark.parametrize(
    ("turn", "restitution", "rtol", "off"),
    [(1.0, 0.995, 1e-10, 1e-3), (1.0, 0.99, 1e-12, 1e-5), (0.3, 0.995, 1e-10, 1e-4), (1.0, 0.98, 1e-10, 2e-9)],
)
def test_bounces_far_down_a_slope_come_to_an_end(
    form: str, turn: float, restitution: float, rtol: float, friction: float, off: float
) -> None:
    """250 km away heights are known to 1e-11 m, and each bounce gains what rounding makes: they went on for ever.

    The last gap of a series is then further off than what is small; with 0.3 rad the time of rest was off by 8 ms.
    """
    scene, (x, z) = Scene(), (math.sin(turn), math.cos(turn))
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", PointContact(normal=(-x, 0.0, z), restitution=restitution, friction=friction))
    scene.connect(ground.frame, contact.plane)
    scene.connect(m.point, contact.point)
    start_at(scene, -x, z, z, x)
    rests = math.sqrt(2.0 / (9.81 * z)) * (1.0 + restitution) / (1.0 - restitution)
    result = simulate(scene, form=form, t_end=1.02 * rests, rtol=rtol, outputs=[0.0, 1.02 * rests])
    assert times(result, "rests") == [pytest.approx(rests, abs=off)]


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
