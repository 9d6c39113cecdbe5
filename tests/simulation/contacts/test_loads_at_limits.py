"""What rests though the least forces would not hold it: some share of the load does, and C has the same one."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from atwood import Scene, SolveError, assemble, simulate
from atwood_library import (
    BallContact,
    BallPairContact,
    Disc,
    Force,
    Ground,
    Inertia,
    Link,
    Pivot,
    PointContact,
    PointMass,
    PointOnLine,
    Ratchet,
    RigidBody,
    RotaryDrive,
    Slider,
    TranslationalSpringDamper,
    Weld,
)

from ...exported_scenes import FLAGS, apart, built, compiler, printed
from ...helpers.contact_scenes import wedge_between
from ...soak.sets import draw, make

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
needs_a_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")


def disc_in_a_groove(left: float, right: float, friction: float, spin: float) -> Scene:
    """Return a disc between two planes that lean by some angles."""
    scene = Scene()
    ground, disc = scene.add("ground", Ground()), scene.add("d", Disc(mass=1.0, radius=0.1))
    normals = [(-math.sin(left), 0.0, math.cos(left)), (math.sin(right), 0.0, math.cos(right))]
    for k, normal in enumerate(normals):
        side = scene.add(f"c{k}", BallContact(radius=0.1, friction=friction, normal=normal))
        scene.connect(ground.frame, side.plane)
        scene.connect(disc.frame, side.ball)
    x, z = np.linalg.solve([[one[0], one[2]] for one in normals], [0.1, 0.1])
    scene.start.update({"d.position.x": float(x), "d.position.z": float(z), "d.velocity.x": 0.0, "d.velocity.z": 0.0})
    scene.start.update({"d.angle": 0.0, "d.angular_velocity.y": spin})
    return scene


@needs_a_compiler
@pytest.mark.parametrize(
    ("scene", "states"),
    [
        (disc_in_a_groove(0.4, 0.4, 0.2, 0.0), (2.0, 2.0)),
        (disc_in_a_groove(0.6, 0.9, 0.3, 0.0), (0.0, 2.0)),
        (disc_in_a_groove(0.6, 0.9, 0.5, -5.0), (2.0, 2.0)),
    ],
)
def test_c_shares_what_rests_as_runs_do(scene: Scene, states: tuple[float, float], tmp_path: Path) -> None:
    """It slipped without speed by C, and by runs once it had come to rest."""
    result = simulate(scene, t_end=0.1, rtol=1e-11, outputs=np.linspace(0.0, 0.1, 3), solver="explicit")
    assert tuple(result[f"c{k}.slip_state"][-1] for k in (0, 1)) == states
    assert {one.kind for one in result.events} <= {"sticks"}
    assert abs(float(result["d.angular_velocity.y"][-1])) < 1e-12
    found = printed(built(scene, tmp_path, "reduced", ["-O0", *FLAGS[1:]]), 0.1, 1e-11, 3)
    worst, where, _ = apart(found, result, assemble(scene))
    assert worst <= 1e-9, where
    for k in (0, 1):
        assert np.array_equal(found[f"c{k}.slip_state"], result[f"c{k}.slip_state"])


@FORMS
@pytest.mark.parametrize(("angle", "upper"), [(0.5, 0.3), (0.57, 0.3), (0.5, 0.2)])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_wedge_locks_itself_until_it_is_pushed_out_or_in(form: str, angle: float, upper: float, way: float) -> None:
    """It was refused: neither the least forces hold it, nor those without friction at one of its faces."""
    lower, wedge, load, rate = 0.3, 0.5, 5.0, 5.0
    s, c = math.sin(angle), math.cos(angle)
    scene = wedge_between(angle, upper, lower, wedge, load)
    push = scene.add("push", Force(value=f"{way * rate}*t"))
    scene.connect(scene.m.point, push.point)
    pressed = load * G / (c + way * upper * s)  # both faces are at their limits when it moves
    begins = (lower * (wedge + load) * G - way * pressed * (s - way * upper * c)) / rate
    result = simulate(scene, form=form, t_end=begins + 0.1, rtol=1e-10, outputs=[0.0, begins - 1e-6, begins + 0.1])
    moving = [one.time for one in result.events if one.kind == "slips"]
    assert moving[-1] == pytest.approx(begins, abs=1e-9)
    x, speed = result["m.position.x"], result["m.velocity.x"]
    assert abs(x[result.time < begins]).max() < 1e-12
    slope = (s - way * upper * c) / (c + way * upper * s)
    inertia = wedge + load * s / c * (slope - way * lower)
    assert float(speed[-1]) == pytest.approx(way * 0.5 * rate * 0.01 / inertia, abs=1e-7)


@needs_a_compiler
@pytest.mark.parametrize(
    ("seed", "form"),
    [
        *((787000159, "reduced"), (787000161, "dae"), (787000398, "reduced"), (787000491, "dae")),
        *((787000190, "dae"), (787000227, "reduced"), (791000103, "reduced")),
    ],
)
def test_c_finds_sets_and_shares_that_contradict_nothing(seed: int, form: str, tmp_path: Path) -> None:
    """Least forces were judged without those of hinges, so that it changed without end; an impact was refused.

    So were rests: slips at gaps that open had to stay, and shares were asked of a set that another was taken for.
    """
    draft = draw(seed)
    scene = make(draft)
    result = simulate(scene, form=form, t_end=0.03, rtol=1e-9, outputs=np.linspace(0.0, 0.03, 3))
    found = printed(built(scene, tmp_path, form, ["-O0", *FLAGS[1:]]), 0.03, 1e-9, 3)
    worst, where, _ = apart(found, result, assemble(scene))
    assert worst <= 1e-9, where
    for k, one in enumerate(draft.touches):
        pressed, rubs = found[f"c{k}.normal_force"], abs(found.get(f"c{k}.friction_force", np.zeros(3)))
        assert min(pressed) >= -1e-9
        assert max(rubs - one.most * pressed) <= 1e-9


@needs_a_compiler
def test_c_decides_an_impact_where_slip_and_gap_move_each_other(tmp_path: Path) -> None:
    """A follower has one freedom, along which its gap and its slip on the cam both move; it was refused."""
    scene = Scene()
    ground, drive, cam = (
        scene.add("ground", Ground()),
        scene.add("drive", RotaryDrive(rotation="40*t")),
        Link(length=0.05),
    )
    scene.add("offset", cam)
    disc, guide = scene.add("disc", RigidBody(mass=1.0)), scene.add("guide", Slider(axis=(0, 0, 1)))
    follower = scene.add("follower", RigidBody(mass=0.5))
    touch = scene.add("touch", BallPairContact(radius_a=0.2, radius_b=0.05, restitution=0.4, friction=0.1))
    spring = scene.add("spring", TranslationalSpringDamper(stiffness=50.0, natural=0.1, against="ground"))
    for a, b in (
        (ground.frame, drive.a),
        (drive.b, cam.a),
        (cam.b, disc.frame),
        (ground.frame, guide.a),
        (guide.b, follower.frame),
        (disc.frame, touch.a),
        (follower.frame, touch.b),
        (guide.carriage, spring.b),
    ):
        scene.connect(a, b)
    scene.start.update({"guide.displacement": math.sqrt(0.06) + 1e-9, "guide.speed": 2.0})
    result = simulate(scene, t_end=0.5, rtol=1e-11, outputs=np.linspace(0.0, 0.5, 3), solver="explicit")
    assert sum(one.kind == "impact" for one in result.events) >= 6
    found = printed(built(scene, tmp_path, "reduced", ["-O0", *FLAGS[1:]]), 0.5, 1e-11, 3)
    worst, where, _ = apart(found, result, assemble(scene))
    assert worst <= 1e-9, where


@needs_a_compiler
def test_c_throws_a_ball_out_of_a_rough_corner(tmp_path: Path) -> None:
    """Each wall rubs along the normal of the other; changed one by one, states came round, and C refused the impact."""
    scene = Scene(gravity=0.0)
    ground, ball = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    walls = {"f": ((0.0, 0.0, 1.0), 0.5, 0.1), "w": ((1.0, 0.0, 0.0), 0.8, 0.2)}
    for name, (normal, restitution, friction) in walls.items():
        wall = scene.add(name, PointContact(normal=normal, restitution=restitution, friction=friction))
        scene.connect(ground.frame, wall.plane)
        scene.connect(ball.point, wall.point)
    scene.start.update({f"m.{what}.{axis}": x for what, x in (("position", 0.5), ("velocity", -1.0)) for axis in "xz"})
    found = printed(built(scene, tmp_path, "reduced", ["-O0", *FLAGS[1:]]), 1.0, 1e-11, 3)
    assert found["m.velocity.x"][-1] == pytest.approx(0.8, abs=1e-12)
    assert found["m.velocity.z"][-1] == pytest.approx(0.5, abs=1e-12)
    worst, where, _ = apart(found, simulate(scene, t_end=1.0, rtol=1e-11, outputs=[0.0, 0.5, 1.0]), assemble(scene))
    assert worst <= 1e-9, where


@needs_a_compiler
def test_c_counts_the_teeth_of_a_ratchet(tmp_path: Path) -> None:
    """It was refused: the count of teeth was no formula."""
    scene = Scene()
    wheel, ratchet = scene.add("wheel", Inertia(moment=0.2)), scene.add("ratchet", Ratchet(teeth=12, against="ground"))
    scene.connect(wheel.flange, ratchet.b)
    scene.start.update({"wheel.angle": 0.1, "wheel.angular_velocity": 1.0})
    found = printed(built(scene, tmp_path, "reduced", ["-O0", *FLAGS[1:]]), 2.0, 1e-11, 3)
    assert found["ratchet.passed"][-1] == 4.0  # 2.1 rad


def on_its_hinge(space: str, center: float, friction: float | None) -> Scene:
    """Return a body on a hinge, with a place on the axis of it that touches a plane, where friction is given."""
    scene = Scene(space=space)
    ground, body = scene.add("ground", Ground()), scene.add("body", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1)))
    pivot = scene.add("pivot", Pivot() if space == "plane" else Pivot(axis=(0, 1, 0)))
    arm, toe = (scene.add(name, Weld(displacement=(-center, 0, 0))) for name in ("arm", "toe"))
    for one, other in ((body.frame, arm.a), (ground.frame, pivot.a), (pivot.b, arm.b), (body.frame, toe.a)):
        scene.connect(one, other)
    if friction is not None:
        floor = scene.add("floor", PointContact(friction=friction))
        scene.connect(ground.frame, floor.plane)
        scene.connect(toe.b, floor.point)
    scene.start.update({"pivot.angle": 0.3, "pivot.angular_velocity": 2.0})
    return scene


@FORMS
@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_place_on_the_axis_of_a_hinge_is_open(space: str, friction: float, form: str) -> None:
    """Nothing presses it. Without friction it had no finite value; in space friction was refused as undetermined."""
    for center in (0.5, 1.0 / 3.0):
        result = simulate(on_its_hinge(space, center, friction), form=form, t_end=1.0, rtol=1e-10)
        known = simulate(on_its_hinge(space, center, None), t_end=1.0, rtol=1e-12)
        assert result["pivot.angle"][-1] == pytest.approx(known["pivot.angle"][-1], abs=1e-9)
        assert not np.any(result["floor.gap_state"])
        assert not result.events


@FORMS
def test_a_floor_along_a_guide_rubs_by_a_share_that_nothing_determines(form: str) -> None:
    """Joints hold the gap as they do on the axis of a hinge, but what slips there moves."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=1.0))
    guide, floor = scene.add("guide", PointOnLine(axis=(1, 0, 0))), scene.add("floor", PointContact(friction=0.3))
    pairs = (ground.frame, guide.a), (mass.point, guide.b), (ground.frame, floor.plane), (mass.point, floor.point)
    for one, other in pairs:
        scene.connect(one, other)
    scene.start.update({"mass.position.x": 0.0, "mass.velocity.x": 1.0})
    with pytest.raises(SolveError, match="which nothing determines"):
        simulate(scene, form=form, t_end=1.0)


@FORMS
@pytest.mark.parametrize("above", [2e-9, 1e-11, 0.0, -1e-11])
def test_a_push_above_the_limit_moves(above: float, form: str) -> None:
    """A push of up to 2e-9 above it was held."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=1.0))
    floor, push = (
        scene.add("floor", PointContact(friction=0.3)),
        scene.add("push", Force(value=0.3 * G * (1.0 + above))),
    )
    for one, other in ((ground.frame, floor.plane), (mass.point, floor.point), (push.point, mass.point)):
        scene.connect(one, other)
    scene.start.update({f"mass.{what}.{axis}": 0.0 for what in ("position", "velocity") for axis in "xz"})
    found = simulate(scene, form=form, t_end=1e3, rtol=1e-10)["mass.position.x"][-1]
    assert found == pytest.approx(0.5e6 * 0.3 * G * max(above, 0.0), rel=1e-4)
