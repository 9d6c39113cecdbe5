"""Places that share a load as springs do: what a table on four legs tells of each leg, and how it slides."""

from __future__ import annotations

import math
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import atwood as aw
from atwood import Scene, SolveError, assemble, simulate
from atwood.plotting.live.program import live_program
from atwood_library import Ground, PointContact, PointMass, RigidBody, VertexContact

from ...exported_scenes import FLAGS, apart, built, compiler, printed

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
STIFF, MU, CENTER, HEIGHT = (1e4, 2e4, 3e4, 5e4), (0.1, 0.2, 0.3, 0.15), (0.1, -0.05), 0.4


def turned(place: tuple[float, float], angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * place[0] - s * place[1], s * place[0] + c * place[1]


def table(
    stiffness: tuple[float | None, ...] = STIFF,
    friction: tuple[float, ...] = MU,
    velocity: tuple[float, float] = (1.0, 0.3),
    size: float = 1.0,
    turn: float = 0.0,
    order: tuple[int, ...] = (0, 1, 2, 3),
) -> Scene:
    """Return a table that slides, in lengths of some size, turned about the vertical, its legs in some order."""
    scene = Scene(space="space")
    ground = scene.add("ground", Ground())
    center = tuple(size * x for x in (*turned(CENTER, turn), 0.0))
    moments = (0.1 * size**2, 0.1 * size**2, 0.15 * size**2)
    body = scene.add("body", RigidBody(mass=2.0, moments=moments, center=center))
    for i in order:
        x, y = turned(places()[i], turn)
        place = size * x, size * y, -size * HEIGHT
        leg = scene.add(f"leg{i}", VertexContact(place=place, friction=friction[i], stiffness=stiffness[i]))
        scene.connect(ground.frame, leg.plane)
        scene.connect(body.frame, leg.body)
    x, y = turned(velocity, turn)
    scene.start.update({"body.position.x": 0.0, "body.position.y": 0.0, "body.position.z": size * HEIGHT})
    scene.start.update({"body.velocity.x": x, "body.velocity.y": y, "body.velocity.z": 0.0})
    scene.start.update({f"body.angular_velocity.{axis}": 0.0 for axis in "xyz"})
    return scene


def places() -> list[tuple[float, float]]:
    return [(0.5, 0.4), (-0.5, 0.4), (-0.5, -0.4), (0.5, -0.4)]


def statics(
    stiffness: tuple[float, ...] = STIFF,
    friction: tuple[float, ...] = MU,
    way: tuple[float, float] = (1.0, 0.3),
) -> np.ndarray:
    """Return the forces of the legs: three conditions of balance, and that springs of the legs fit a flat floor."""
    rows, (x, y) = np.zeros((4, 4)), np.array(way) / (math.hypot(*way) or 1.0)
    for i, place in enumerate(places()):
        arm = np.array([place[0] - CENTER[0], place[1] - CENTER[1], -HEIGHT])
        moment = np.cross(arm, [-friction[i] * x, -friction[i] * y, 1.0])
        rows[:3, i] = 1.0, moment[0], moment[1]
    rows[3] = np.array([1.0, -1.0, 1.0, -1.0]) / stiffness
    return np.linalg.solve(rows, [2.0 * G, 0.0, 0.0, 0.0])


def pressed(result: aw.Result, at: int = 0) -> list[float]:
    return [float(result[f"leg{i}.normal_force"][at]) for i in range(4)]


@pytest.mark.sample(3)
@FORMS
@pytest.mark.parametrize("change", [{}, {"size": 1e3}, {"size": 1e-3}, {"turn": 0.7}, {"order": (2, 0, 3, 1)}])
def test_legs_of_a_table_that_slides_press_as_springs_do(form: str, change: dict[str, object]) -> None:
    scene = table(**change)  # type: ignore[arg-type]
    result = simulate(scene, form=form, t_end=1e-6, rtol=1e-10, outputs=[0.0, 1e-6])
    assert pressed(result) == pytest.approx(statics(), abs=1e-9)
    rubs = [math.hypot(*(result[f"leg{i}.friction_{k}"][0] for k in (1, 2))) for i in range(4)]
    assert rubs == pytest.approx(statics() * MU, abs=1e-9)


def test_only_ratios_of_stiffness_count() -> None:
    soft = tuple(1e-6 * one for one in STIFF)
    result = simulate(table(soft), t_end=1e-6, rtol=1e-10)
    assert pressed(result) == pytest.approx(statics(), abs=1e-9)


def test_a_table_comes_to_rest_and_bears_its_weight_as_springs_do() -> None:
    result = simulate(table(), t_end=1.0, rtol=1e-10)
    assert [one.kind for one in result.events] == ["sticks"] * 4
    still = statics(way=(0.0, 0.0))
    assert pressed(result, -1) == pytest.approx(still, abs=1e-9)
    assert abs(result["body.angular_velocity.z"][-1]) < 1e-12
    assert result.energy.max_drift < 1e-9


def test_a_leg_that_springs_would_pull_is_off_the_floor() -> None:
    stiffness = 1e4, 1e6, 3e4, 5e5
    assert min(statics(stiffness)) < 0.0
    found = pressed(simulate(table(stiffness), t_end=1e-6, rtol=1e-10))
    assert found[2] == 0.0
    assert sum(found) == pytest.approx(2.0 * G, abs=1e-9)


def test_impulses_of_a_table_that_lands_are_shared_alike() -> None:
    scene = table(friction=(0.0,) * 4, velocity=(0.0, 0.0))
    scene.start["body.position.z"] = HEIGHT + 0.05
    result = simulate(scene, t_end=0.11, rtol=1e-10)
    impulses = np.array([one.impulse for one in result.impacts])
    assert [one.part for one in result.impacts] == ["leg0", "leg1", "leg2", "leg3"]
    fall = math.sqrt(2.0 * G * 0.05) / G  # an impulse in place of a force
    assert impulses == pytest.approx(statics(friction=(0.0,) * 4) * fall, abs=1e-8)


def test_stiffness_decides_only_where_each_has_one() -> None:
    with pytest.raises(SolveError, match=r"\(leg0, leg1, leg2, leg3\)\. Stiffness decides only.* leg1, leg3, too"):
        simulate(table((1e4, None, 2e4, None)), t_end=0.1)
    with pytest.raises(SolveError, match="Give each of them a stiffness"):
        simulate(table((None,) * 4), t_end=0.1)
    with pytest.raises(aw.ParameterError, match="stiffness"):
        VertexContact(stiffness=0.0)


def bar(stiffness: tuple[float | None, ...], friction: tuple[float, ...], height: float = 0.0) -> Scene:
    """Return a bar in a plane on three places, and a ball that bounces, so that changes are soon compiled."""
    scene = Scene()
    ground, body = scene.add("ground", Ground()), scene.add("bar", RigidBody(mass=1.0, moments=(0.0, 0.1, 0.0)))
    for i, (k, mu) in enumerate(zip(stiffness, friction, strict=True)):
        place = scene.add(f"c{i}", VertexContact(place=(i - 1.0, 0.0, 0.0), friction=mu, stiffness=k))
        scene.connect(ground.frame, place.plane)
        scene.connect(body.frame, place.body)
    scene.start.update({"bar.position.x": 0.0, "bar.position.z": height, "bar.angle": 0.0})
    scene.start.update({"bar.velocity.x": 2.0, "bar.velocity.z": 0.0, "bar.angular_velocity.y": 0.0})
    return scene


@FORMS
def test_places_in_a_row_brake_as_their_springs_share_the_load(form: str) -> None:
    """Two conditions of balance, and that the middle gives way by the mean of the ends."""
    stiffness, friction = (1.0, 2.0, 4.0), (0.1, 0.3, 0.2)
    shares = np.linalg.solve([[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [1.0, -1.0, 0.25]], [G, 0.0, 0.0])
    scene = bar(stiffness, friction, height=0.5)
    ball, court = scene.add("ball", PointMass(mass=1.0)), scene.add("court", PointContact(restitution=0.8))
    scene.connect(scene.ground.frame, court.plane)
    scene.connect(ball.point, court.point)
    scene.start.update({"ball.position.x": 0.0, "ball.position.z": 0.02, "ball.velocity.x": 0.0})
    scene.start["ball.velocity.z"] = 0.0
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-10)
    assert [result[f"c{i}.normal_force"][-1] for i in range(3)] == pytest.approx(shares, abs=1e-9)
    fall = math.sqrt(1.0 / G)
    brake = float(shares @ friction)
    assert result["bar.velocity.x"][-1] == pytest.approx(2.0 - brake * (fall + 0.5 - fall), abs=1e-8)


def test_exports_say_that_they_do_not_share_loads_by_stiffness(tmp_path: Path) -> None:
    with pytest.raises(aw.UnsupportedError, match="c0 shares loads by its stiffness"):
        aw.export_c(bar((1.0, 2.0, 4.0), (0.1, 0.3, 0.2)), tmp_path)


def test_exports_refuse_what_no_run_can_begin_with(tmp_path: Path) -> None:
    """A program in C slid on by least forces, where a run is refused."""
    scene = bar((None, None, None), (0.1, 0.3, 0.2))
    with pytest.raises(SolveError, match="friction depends on how forces are shared, which nothing determines"):
        aw.export_c(scene, tmp_path)
    assert not list(tmp_path.iterdir())
    assert "friction depends on how forces are shared" in live_program(scene).reason


NONE, QUICK = (None, None, None), ["-O0", *FLAGS[1:]]
UNDETERMINED = "at t = 0.319275428.* friction depends on how forces are shared, which nothing determines"
needs_a_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")


@needs_a_compiler
@FORMS
def test_c_stops_where_friction_depends_on_shares_that_nothing_determines(form: str, tmp_path: Path) -> None:
    """It slid on by least forces, where a run is refused."""
    scene = bar(NONE, (0.1, 0.3, 0.2), height=0.5)
    with pytest.raises(SolveError, match=UNDETERMINED):
        simulate(scene, form=form, t_end=0.6, rtol=1e-11)
    program = built(scene, tmp_path, form, QUICK)
    done = subprocess.run([program, "0.6", "1e-11", "3"], capture_output=True, text=True)
    assert done.returncode != 0
    assert re.match(UNDETERMINED, done.stderr)


@needs_a_compiler
@FORMS
def test_c_goes_on_where_no_share_moves_anything(form: str, tmp_path: Path) -> None:
    """Where friction is the same at all places it brakes alike, however they share the load."""
    scene = bar(NONE, (0.2, 0.2, 0.2), height=0.5)
    result = simulate(scene, form=form, t_end=0.6, rtol=1e-11, outputs=np.linspace(0.0, 0.6, 5), solver="explicit")
    assert result["bar.velocity.x"][-1] == pytest.approx(2.0 - 0.2 * G * 0.6, abs=1e-9)
    found = printed(built(scene, tmp_path, form, QUICK), 0.6, 1e-11, 5)
    worst, where, _ = apart(found, result, assemble(scene, form=form))
    assert worst <= 1e-9, where
