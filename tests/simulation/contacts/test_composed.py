"""Scenes that somebody would put together from the library, with contacts, against answers by hand.

A table that shakes, a ball in a drum that turns, plates whose speed jumps, a block that is pushed ever harder, jaws
that hold a box, a wedge that is pressed out: what drives them moves with time, and does work in impacts, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import atwood as aw
from atwood import Scene, simulate
from atwood_library import (
    BallPairContact,
    Disc,
    Drive,
    Force,
    Ground,
    PointContact,
    PointMass,
    Pulley,
    RigidBody,
    Rope,
    RotaryDrive,
    Slider,
    Table,
    TranslationalSource,
    VertexContact,
)

from ...helpers.contact_scenes import wedge_between

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def run(scene: Scene, form: str, end: float, **options: object) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, **options)  # type: ignore[arg-type]


def times(result: aw.Result, kind: str) -> list[float]:
    return [one.time for one in result.events if one.kind == kind]


def on_plate(axis: tuple[float, ...], motion: object, at: Sequence[float], **contact: object) -> Scene:
    """Return a mass at x, z with the velocity vx, vz over a plate that is moved along an axis."""
    scene = Scene()
    ground, drive, plate = scene.add("ground", Ground()), scene.add("drive", Drive(axis=axis)), RigidBody(mass=1.0)
    scene.add("plate", plate)
    mass, touch = scene.add("m", PointMass(mass=1.0)), scene.add("c", PointContact(**contact))  # type: ignore[arg-type]
    if isinstance(motion, str):
        drive.motion = motion
    else:
        rows = scene.add("rows", Table(table=motion))
        scene.connect(rows.output("value"), drive.input("motion"))
    for a, b in (
        (ground.frame, drive.a),
        (drive.b, plate.frame),
        (plate.frame, touch.plane),
        (mass.point, touch.point),
    ):
        scene.connect(a, b)
    names = ("position.x", "position.z", "velocity.x", "velocity.z")
    scene.start.update({f"m.{name}": one for name, one in zip(names, at, strict=True)})
    return scene


def shaken(restitution: float, height: float, rate: float, count: int) -> list[float]:
    """Return when a ball that falls from 0.1 m meets a table at ``height sin(rate t)``."""
    t, z, v, found = 0.0, 0.1, 0.0, list[float]()
    while len(found) < count:

        def above(now: float, t: float = t, z: float = z, v: float = v) -> float:
            return z + v * (now - t) - 0.5 * G * (now - t) ** 2 - height * math.sin(rate * now)

        ahead = t + 1e-9 + 1e-4 * np.arange(10_000)
        first = int(np.flatnonzero(np.array([above(one) for one in ahead]) < 0.0)[0])
        hit = float(brentq(above, ahead[first - 1], ahead[first], xtol=1e-15))
        speed = height * rate * math.cos(rate * hit)
        z, v = height * math.sin(rate * hit), speed + restitution * (speed - v + G * (hit - t))
        t = hit
        found.append(hit)
    return found


@FORMS
def test_a_table_that_shakes_does_work_in_impacts(form: str) -> None:
    """The ledger counted what impacts take, and not what the table gives."""
    result = run(on_plate((0, 0, 1), "0.02*sin(30*t)", (0.0, 0.1, 0.0, 0.0), restitution=0.5), form, 1.5)
    # Errors of 1e-14 in early impacts grow two hundred times.
    assert times(result, "impact") == pytest.approx(shaken(0.5, 0.02, 30.0, 12), abs=1e-11)
    assert any(one.loss > 0.0 for one in result.impacts)
    assert result.energy.max_drift < 1e-9


@FORMS
def test_the_ledger_of_a_ball_in_a_drum_that_is_turned_balances(form: str) -> None:
    scene = Scene()
    ground, motor = scene.add("ground", Ground()), scene.add("motor", RotaryDrive(rotation="3*t"))
    drum, ball = (
        scene.add("drum", RigidBody(mass=1.0, moments=(0, 5, 0))),
        scene.add("ball", Disc(mass=1.0, radius=0.1)),
    )
    inside = BallPairContact(radius_a=1.0, radius_b=0.1, touches="inside", friction=0.4, restitution=0.3)
    scene.add("c", inside)
    for a, b in ((ground.frame, motor.a), (motor.b, drum.frame), (drum.frame, inside.a), (ball.frame, inside.b)):
        scene.connect(a, b)
    scene.start.update({"ball.position.x": 0.0, "ball.position.z": -0.5, "ball.velocity.x": 0.3, "ball.velocity.z": 0})
    scene.start.update({"ball.angle": 0.0, "ball.angular_velocity.y": 0.0})
    result = run(scene, form, 2.0)
    kinds = [one.kind for one in result.events]
    assert kinds == ["impact"] * 8 + ["closes", "sticks", "rests"]
    assert result.energy.max_drift < 1e-9
    # It rolls: with the angle p from below, 1.5 p'' = -g sin(p)/0.9.
    after = result.time > 0.6
    x, z = result["ball.position.x"][after], result["ball.position.z"][after]
    swing = 0.75 * (result["ball.velocity.x"] ** 2 + result["ball.velocity.z"] ** 2)[after] + G * z
    assert np.ptp(swing) < 1e-8
    assert np.max(np.abs(np.hypot(x, z) - 0.9)) < 1e-10


@FORMS
def test_a_plate_whose_speed_jumps_throws_what_lies_on_it(form: str) -> None:
    """It goes up by 1 m/s from 0.5 s on, and stands still from 1 s on: then the mass flies for 2 v/g."""
    result = run(on_plate((0, 0, 1), [(0, 0), (0.5, 0), (1, 0.5), (9, 0.5)], (0, 0, 0, 0)), form, 1.5)
    assert times(result, "impact") == pytest.approx([0.5, 1.0 + 2.0 / G], abs=1e-12)
    assert times(result, "opens") == pytest.approx([1.0], abs=1e-12)
    assert result.energy.max_drift < 1e-9


@FORMS
def test_a_plate_that_jumps_aside_slips_under_what_lies_on_it(form: str) -> None:
    rows = [(0, 0), (0.5, 0), (1.5, 1), (9, 1)]
    result = run(on_plate((1, 0, 0), rows, (0, 0, 0, 0), friction=0.3), form, 3.0)
    assert times(result, "slips") == pytest.approx([0.5, 1.5], abs=1e-12)
    assert times(result, "sticks") == pytest.approx([0.5 + 1.0 / (0.3 * G), 1.5 + 1.0 / (0.3 * G)], abs=1e-9)
    assert float(result["m.position.x"][-1]) == pytest.approx(1.0, abs=1e-9)


@FORMS
@pytest.mark.parametrize("static", [0.35, 0.4, 0.5])
def test_what_slips_from_the_origin_is_not_too_slow_for_the_clock(form: str, static: float) -> None:
    """All states are zero there: the first step behind the event was worked out from these, and moved no time."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    floor = scene.add("c", PointContact(friction=0.3, static_friction=static))
    push = scene.add("push", Force(value=".35*19.62*t"))
    for a, b in ((ground.frame, floor.plane), (mass.point, floor.point), (mass.point, push.point)):
        scene.connect(a, b)
    scene.start.update({f"m.{what}.{axis}": 0.0 for what in ("position", "velocity") for axis in "xz"})
    result = run(scene, form, 3.0)
    begins = static / 0.35
    assert times(result, "slips") == pytest.approx([begins], abs=1e-12)
    speed = G * (0.5 * 0.35 * (9.0 - begins**2) - 0.3 * (3.0 - begins))
    assert float(result["m.velocity.x"][-1]) == pytest.approx(speed, abs=1e-9)


@FORMS
def test_jaws_close_on_a_box_and_hold_it_until_it_is_pulled_too_hard(form: str) -> None:
    """Both press by 20 N, with friction of 0.5: it is pulled by 30 N/s, and slips at 20 N."""
    scene = Scene(gravity=0.0)
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    for i, side in enumerate((1, -1)):
        jaw, guide = scene.add(f"jaw{i}", RigidBody(mass=1.0)), scene.add(f"guide{i}", Slider(axis=(0, 0, 1)))
        touch = scene.add(f"c{i}", PointContact(normal=(0, 0, -side), friction=0.5, radius=0.1))
        push = scene.add(f"push{i}", TranslationalSource(value=-20.0 * side))
        for a, b in ((ground.frame, guide.a), (guide.b, jaw.frame), (jaw.frame, touch.plane)):
            scene.connect(a, b)
        scene.connect(mass.point, touch.point)
        scene.connect(guide.carriage, push.b)
    pull = scene.add("pull", Force(value="30*t"))
    scene.connect(mass.point, pull.point)
    scene.start.update({f"m.{what}.{axis}": 0.0 for what in ("position", "velocity") for axis in "xz"})
    scene.start.update({"guide0.displacement": 0.12, "guide1.displacement": -0.15})
    scene.start.update({"guide0.speed": 0.0, "guide1.speed": 0.0})
    result = run(scene, form, 1.0)
    # The upper jaw takes 0.02 m and sticks to the box, which goes down with it against the lower one.
    first = math.sqrt(2.0 * 0.02 / 20.0)
    assert times(result, "impact")[0] == pytest.approx(first, abs=1e-12)
    assert len(times(result, "impact")) == 2
    # Which share each takes is known but for rounding, so one may slip first, and the other when it is past its margin.
    assert times(result, "slips") == pytest.approx([2.0 / 3.0, 2.0 / 3.0], abs=1e-9)
    assert result.energy.max_drift < 1e-9


@FORMS
def test_a_wedge_is_pressed_out_by_what_lies_on_it(form: str) -> None:
    """Friction of 0.3 on both faces holds an angle of up to 2 atan(0.3) = 0.583 rad."""
    angle, friction, wedge, load = 0.62, 0.3, 0.5, 5.0
    scene = wedge_between(angle, friction, friction, wedge, load)
    s, c = math.sin(angle), math.cos(angle)
    rows = [
        [wedge, friction * c - s, friction],
        [0.0, -(c + friction * s), 1.0],
        [load * s / c, c + friction * s, 0.0],
    ]
    acceleration, pressed, carried = np.linalg.solve(rows, [0.0, wedge * G, load * G])
    result = run(scene, form, 0.5)
    assert float(result["m.velocity.x"][-1]) == pytest.approx(0.5 * acceleration, abs=1e-10)
    assert float(result["above.normal_force"][-1]) == pytest.approx(pressed, abs=1e-8)
    assert float(result["below.normal_force"][-1]) == pytest.approx(carried, abs=1e-8)


@FORMS
@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
def test_conditions_are_met_by_jumps_too(form: str, solver: str) -> None:
    """The speed goes from -4.4 to 2.2 m/s in no time, and the force of the floor from nothing to the weight."""
    falls = math.sqrt(2.0 / G)
    plain = {"form": form, "t_end": 1.0, "rtol": 1e-10, "solver": solver}

    def thrown(restitution: float) -> Scene:
        return on_plate((0, 0, 1), "0", (0.0, 1.0, 1.0, 0.0), restitution=restitution, friction=0.1)

    for until in ("m.velocity.z rises above 0", lambda q: q["m.velocity.z"] > 1.0):
        result = simulate(thrown(0.5), until=until, **plain)  # type: ignore[arg-type]
        assert (result.status, result.events[0].kind) == ("stopped", "impact")
        assert float(result.time[-1]) == pytest.approx(falls, abs=1e-9)
        assert float(result["m.velocity.z"][-1]) == pytest.approx(0.5 * G * falls, abs=1e-9)
    loaded = simulate(thrown(0.0), until="c.normal_force rises above 5", **plain)  # type: ignore[arg-type]
    assert (loaded.status, float(loaded["c.normal_force"][-1])) == ("stopped", pytest.approx(G))
    speeds = ["m.velocity.z falls below -1", "m.velocity.z rises above 1"]
    noted = simulate(thrown(0.5), record=speeds, **plain)  # type: ignore[arg-type]
    passed = [one.time for one in noted.events if one.kind == "event"]
    up = falls + (0.5 * G * falls + 1.0) / G
    assert passed == pytest.approx([1.0 / G, falls, up, 2.0 * falls], abs=1e-8)


@FORMS
@pytest.mark.parametrize("height", [1e-12, 1e-14, 5.6e-17])
def test_a_height_that_is_rounding_is_no_size_of_the_scene(form: str, height: float) -> None:
    """Impacts were taken for slow beside a scene of that size, and went on for ever: 4,000 in five seconds."""
    scene = on_plate((0, 0, 1), "0", (0.0, height, 1.0, -1.0), restitution=0.5, friction=0.3)
    result = run(scene, form, 0.5, max_steps=3000)
    assert result.status == "finished"
    assert times(result, "rests") == pytest.approx([2.0 / G], abs=1e-9)


def test_a_step_of_a_force_meets_conditions() -> None:
    scene = on_plate((0, 0, 1), "0", (0.0, 0.0, 0.0, 0.0), friction=0.1)
    push = scene.add("push", Force(value="select(t < 0.5, 0, select(t < 1, 10, 0))"))
    mass: Any = scene.parts["m"]
    scene.connect(mass.point, push.point)
    conditions = ["m.acceleration.x rises above 1", "m.acceleration.x falls below -0.5"]
    result = run(scene, "reduced", 1.2, record=conditions)
    assert [one.time for one in result.events if one.kind == "event"] == pytest.approx([0.5, 1.0], abs=1e-12)


@FORMS
def test_what_bounces_far_away_is_measured_by_what_it_bounces_on(form: str) -> None:
    """A place over a floor does not float: a height of 1 m was as good as zero beside a way of 1e9 m, and closed."""
    scene = on_plate((0, 0, 1), "0", (1e9, 1.0, 1.0, 0.0), restitution=0.5)
    result = run(scene, form, 1.0)
    falls = math.sqrt(2.0 / G)
    assert times(result, "impact") == pytest.approx([falls, 2.0 * falls], abs=1e-9)
    assert result.energy.max_drift < 1e-9


@FORMS
@pytest.mark.parametrize("end", [0.5, 3.0])
def test_what_is_driven_against_a_floor_is_named_when_it_comes_there(form: str, end: float) -> None:
    """Something else moves by itself; no force would change the speed of what is driven."""
    scene = Scene()
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive(axis=(0, 0, 1), motion="1 - t"))
    body, touch, mass = scene.add("body", RigidBody()), scene.add("c", VertexContact()), scene.add("m", PointMass())
    for a, b in ((ground.frame, drive.a), (drive.b, body.frame), (ground.frame, touch.plane), (body.frame, touch.body)):
        scene.connect(a, b)
    scene.start.update({f"{mass.path}.{what}.{axis}": 0.0 for what in ("position", "velocity") for axis in "xz"})
    if end < 1.0:
        assert float(run(scene, form, end)["c.gap"][-1]) == pytest.approx(0.5)
        return
    with pytest.raises(aw.SolveError, match="c: at t = 1 no impulses satisfy"):
        run(scene, form, end)


@FORMS
def test_a_part_whose_force_has_no_value_is_named_by_its_path(form: str) -> None:
    """A light pulley on a rope is free to swing: nothing says how it moves, and the floor's force follows from that."""
    scene = Scene()
    top, ground, pulley = scene.add("top", Ground(position=(0, 0, 5))), scene.add("ground", Ground()), Pulley()
    scene.add("pulley", pulley)
    hung, over = (
        scene.add("hung", Rope(length=1.0, when_slack="slack")),
        Rope(length=7.5, when_slack="slack", pulleys=1),
    )
    scene.add("over", over)
    a, b = scene.add("a", PointMass(mass=1.0)), scene.add("b", PointMass(mass=3.0))
    floor = scene.add("floor", PointContact(friction=0.5))
    for one, other in (
        (top.frame, hung.a),
        (pulley.center, hung.b),
        (ground.frame, floor.plane),
        (a.point, floor.point),
        (a.point, over.a),
        (pulley.groove, over.over[0]),
        (b.point, over.b),
    ):
        scene.connect(one, other)
    places = {"a": 0.0, "b": 0.5}
    scene.start.update({f"{name}.position.{axis}": places[name] * (axis == "z") for name in places for axis in "xz"})
    scene.start.update({f"{name}.velocity.{axis}": 0.0 for name in places for axis in "xz"})
    scene.start.update({"pulley.position.x": 0.0, "pulley.position.z": 4.0})
    with pytest.raises(aw.StartError) as error:
        run(scene, form, 1.0)
    assert error.value.where in ("floor", "pulley")
