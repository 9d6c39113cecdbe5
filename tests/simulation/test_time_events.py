"""Time events: relations of functions of time change exactly when they do, in every solver and form."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from atwood import (
    Component,
    Load,
    Point,
    Scalar,
    Scene,
    Vector,
    acos,
    atan,
    atan2,
    compare,
    connector,
    cos,
    external,
    force,
    maximum,
    parameter,
    potential,
    select,
    sign,
    simulate,
    sin,
    sqrt,
    sweep,
    tan,
)
from atwood.errors import SolveError
from atwood.expr import ExternalFunction
from atwood.pipeline import assemble
from atwood.simulation.events.time_events import find_schedule
from atwood_library import Drive, Force, Ground, Link, Pivot, PointMass, Rod, Rope, RotaryDrive
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS

SOLVERS = [
    *(("reduced", solver) for solver in ("ida", "ida-sundae", "explicit", "taylor")),
    ("dae", "ida"),
]
"""Both forms, and every solver."""

Function = Callable[[Any], Any]


def pushed(force: Function, t_end: float = 1.0, t_start: float = 0.0) -> Scene:
    """A free mass of 1 kg at rest, pushed along x."""
    scene = Scene(gravity=0.0, t_end=t_end, t_start=t_start)
    bob, push = scene.add("bob", PointMass()), scene.add("push", Force(value=force))
    scene.connect(push.point, bob.point)
    for quantity in ("position", "velocity"):
        scene.start.update({f"bob.{quantity}.x": 0.0, f"bob.{quantity}.z": 0.0})
    return scene


def driven(motion: Function, angle: float = 0.0) -> Scene:
    """A pendulum whose pivot moves along x as prescribed."""
    scene = Scene(t_end=1.0)
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive(motion=motion))
    rod, bob = scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": 0.0})
    return scene


def times_of(function: Function, end: float = 1.0, start: float = 0.0) -> list[float]:
    """The time events of a force."""
    return find_schedule(assemble(pushed(function, end, start)), start, end).times.tolist()


def square_wave(t: np.ndarray, period: float) -> np.ndarray:
    """The place of a mass that is pushed to and fro with 1 N for half a period each."""
    half = 0.5 * period
    done = np.floor(t / period + 1e-9)
    past = t - done * period
    back = half * half - 0.5 * (period - past) ** 2
    return done * half * half + np.where(past < half, 0.5 * past * past, back)


def roots(t: np.ndarray) -> np.ndarray:
    """The place of a mass that is pushed with the root of 0.6 - t."""
    return 2.0 / 3.0 * (0.6**1.5 * t - 0.4 * (0.6**2.5 - (0.6 - t) ** 2.5))


def later_roots(past: np.ndarray) -> np.ndarray:
    """How far it goes on with the root of t - 0.4 from t = 0.5 on."""
    before = 2.0 / 3.0 * (0.6**1.5 - 0.1**1.5)
    past = np.maximum(past, 0.0)
    return before * past + 2.0 / 3.0 * (0.4 * ((past + 0.1) ** 2.5 - 0.1**2.5) - 0.1**1.5 * past)


FORCES: dict[str, tuple[Function, Callable[[np.ndarray], np.ndarray]]] = {
    "one moment at the start": (lambda t: select(t <= 0, 1e9, 0.0), lambda t: 0.0 * t),
    "square wave": (lambda t: select(sin(100.0 * math.pi * t) > 0, 1.0, -1.0), lambda t: square_wave(t, 0.02)),
    "sign": (lambda t: sign(sin(100.0 * math.pi * t)), lambda t: square_wave(t, 0.02)),
    "short pulse": (
        lambda t: select((t > 0.3) & (t < 0.3 + 1e-7), 1e7, 0.0),
        lambda t: np.maximum(t - 0.3 - 5e-8, 0.0),
    ),
    "two at nearly one time": (
        lambda t: select((t > 0.3) & (t < 0.3 + 1e-12), 1.0, 0.0) + select(t < 0.1 * 3.0, 1.0, 0.0),
        lambda t: np.where(t < 0.3, 0.5 * t * t, 0.045 + 0.3 * (t - 0.3)),
    ),
    "kink": (
        lambda t: maximum(t - 1.0 / 3.0, 0.0),
        lambda t: np.maximum(t - 1.0 / 3.0, 0.0) ** 3 / 6.0,
    ),
    "nested": (
        lambda t: select(select(t < 0.5, t, 1.0 - t) < 0.25, 2.0, 0.0),
        lambda t: np.where(
            t < 0.25, t * t, np.where(t < 0.75, 0.0625 + 0.5 * (t - 0.25), 0.3125 + 0.5 * (t - 0.75) + (t - 0.75) ** 2)
        ),
    ),
    "saw-tooth": (
        lambda t: atan(tan(10.0 * math.pi * (t - 0.05))) / math.pi,
        lambda t: (
            -(n := np.floor(10.0 * t + 1e-9)) / 1200.0 + 5.0 * (t - 0.1 * n) ** 3 / 3.0 - (t - 0.1 * n) ** 2 / 4.0
        ),
    ),
    "triangular wave": (
        lambda t: 0.5 * math.pi - acos(cos(2.0 * math.pi * t)),
        lambda t: np.where(
            t < 0.5,
            math.pi * (0.25 * t * t - t**3 / 3.0),
            math.pi / 48.0 + math.pi * ((t - 0.5) ** 3 / 3.0 - 0.25 * (t - 0.5) ** 2),
        ),
    ),
    "turn": (
        lambda t: atan2(sin(2.0 * math.pi * t), cos(2.0 * math.pi * t)),
        lambda t: np.where(
            t < 0.5,
            math.pi * t**3 / 3.0,
            math.pi / 24.0 + 0.25 * math.pi * (t - 0.5) + math.pi * ((t - 0.5) ** 3 / 3.0 - 0.5 * (t - 0.5) ** 2),
        ),
    ),
    "branches without a value elsewhere": (
        lambda t: select(t < 0.5, sqrt(0.6 - t), sqrt(t - 0.4)),
        lambda t: roots(np.minimum(t, 0.5)) + np.where(t < 0.5, 0.0, later_roots(t - 0.5)),
    ),
    "remainder": (
        lambda t: t % 0.1,
        lambda t: (
            (n := np.floor(10.0 * t + 1e-9)) * (n - 1.0) / 2.0 * 5e-4
            + n * 1e-3 / 6.0
            + 5e-3 * n * (r := t - 0.1 * n)
            + r**3 / 6.0
        ),
    ),
    "whole numbers": (
        lambda t: math.floor(2.0 * t + 0.5),
        lambda t: 0.5 * np.maximum(t - 0.25, 0.0) ** 2 + 0.5 * np.maximum(t - 0.75, 0.0) ** 2,
    ),
    "at the very end": (lambda t: select(t < 1.0, 1.0, 1e9), lambda t: 0.5 * t * t),
}


@pytest.mark.sample(4)
@pytest.mark.parametrize(("form", "solver"), SOLVERS)
@pytest.mark.parametrize("name", FORCES)
def test_a_switch_is_exact_in_every_solver(name: str, form: str, solver: str) -> None:
    force, exact = FORCES[name]
    result = simulate(pushed(force), form=form, solver=solver, rtol=1e-8)
    assert len(result.time) == 201
    bound = 1e-6 if solver.startswith("ida") else 1e-9  # what a run without a switch errs
    np.testing.assert_allclose(result.array("bob.position.x"), exact(result.time), rtol=0.0, atol=bound)
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_what_is_asked_for_at_a_switch_is_what_comes_after_it(form: str, solver: str) -> None:
    result = simulate(pushed(lambda t: select(t < 0.5, 1.0, -1.0)), form=form, solver=solver, outputs=[0, 0.5, 1.0])
    assert result.time.tolist() == [0.0, 0.5, 1.0]
    assert result.array("push.force").tolist() == [1.0, -1.0, -1.0]
    np.testing.assert_allclose(result.array("bob.acceleration.x"), [1.0, -1.0, -1.0], rtol=1e-9)


def test_a_sweep_has_at_a_switch_what_a_run_has() -> None:
    scene = pushed(lambda t: select(t < 0.5, 1.0, -1.0))
    alone = simulate(scene, outputs=[0.0, 0.3, 0.5, 1.0])
    many = sweep(
        scene, {"bob.mass": [1.0, 2.0]}, quantities=["bob.velocity.x", "push.force"], outputs=[0.0, 0.3, 0.5, 1.0]
    )
    for path in ("bob.velocity.x", "push.force"):
        np.testing.assert_allclose(many[path][0], alone.array(path), rtol=1e-9, atol=1e-12)
    assert np.all(np.isfinite(many["push.force"]))


SCHEDULES: dict[str, tuple[Function, float, list[float]]] = {
    "affine": (lambda t: select(t < 0.1, 1.0, 0.0), 1.0, [0.1]),
    "pulse in a long run": (lambda t: select(abs(t - 5e4) < 1e-6, 1.0, 0.0), 1e5, [5e4 - 1e-6, 5e4, 5e4 + 1e-6]),
    "touches": (lambda t: select(sin(t) > 1.0, 1.0, 0.0), 10.0, []),
    "touches from below": (lambda t: select((t - 0.5) ** 2 > 0.0, 1.0, 0.0), 1.0, []),
    "triple root": (lambda t: select((t - 0.3) ** 3 > 0.0, 1.0, 0.0), 1.0, [0.3]),
    "never": (lambda t: select(t < 5.0, 1.0, 0.0), 1.0, []),
    "at the start and the end": (lambda t: select((t <= 0) | (t >= 1), 1.0, 0.0), 1.0, []),
    "a narrow bell": (
        lambda t: select(1.0 / (1.0 + ((t - 0.7) * 1e9) ** 2) > 0.5, 1.0, 0.0),
        1.0,
        [0.7 - 1e-9, 0.7 + 1e-9],
    ),
}


@pytest.mark.parametrize("name", SCHEDULES)
def test_time_events_are_found_from_the_expression(name: str) -> None:
    function, end, expected = SCHEDULES[name]
    np.testing.assert_allclose(times_of(function, end), expected, rtol=1e-14)


def test_a_function_in_python_is_looked_at_often_and_that_is_said() -> None:
    late = ExternalFunction("late", lambda t: t - 0.3)
    scene = pushed(lambda t: select(external(late, t) < 0.0, 1.0, 0.0))
    with pytest.warns(UserWarning, match=r"push\.value: .*a function in Python"):
        result = simulate(scene, solver="ida")
    assert result.array("bob.velocity.x")[-1] == pytest.approx(0.3, rel=1e-9)


def test_many_events_are_all_found() -> None:
    found = times_of(lambda t: select(sin(2000.0 * math.pi * t) > 0.0, 1.0, 0.0), 10.0)
    np.testing.assert_allclose(found, np.arange(1, 20_000) * 5e-4, rtol=1e-13)


def test_parameters_may_say_when_something_switches() -> None:
    class Burst(Component):
        last: float = parameter(0.5, unit="s", doc="Its end.")
        at: Point = connector(Point, "Where it pushes.")

        @force
        def push(self) -> Iterable[Load]:
            """Yield the push."""
            yield Load(self.at, Vector(select(self.time < self.last, 1.0, 0.0), 0.0, 0.0))

    scene = Scene(gravity=0.0, t_end=1.0)
    bob, burst = scene.add("bob", PointMass()), scene.add("burst", Burst())
    scene.connect(burst.at, bob.point)
    scene.start.update({f"bob.{q}.{a}": 0.0 for q in ("position", "velocity") for a in "xz"})
    assembly = assemble(scene)
    for last in (0.5, 0.25):
        changed = assembly.with_values({"burst.last": last})
        assert not changed.why_new
        result = simulate(changed)
        np.testing.assert_allclose(result.array("bob.velocity.x")[-1], last, rtol=1e-12)


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_jump_in_a_prescribed_speed_is_an_impact(form: str, solver: str, angle: float) -> None:
    result = simulate(driven(lambda t: select(t < 0.5, t, 0.5), angle), form=form, solver=solver, rtol=1e-10)
    before, after = (i for i, t in enumerate(result.time) if t == 0.5)
    along = np.array([math.cos(a := result.array("rod.angle")[after]), math.sin(a)])
    speeds = np.array([[result.array(f"bob.velocity.{axis}")[i] for axis in "xz"] for i in (before, after)])
    # The rod pushes along itself only: across it, the bob keeps its speed, along it, it has that of the pivot.
    np.testing.assert_allclose(speeds[1] @ along, speeds[0] @ along, rtol=1e-9)
    np.testing.assert_allclose(speeds[1] @ np.array([along[1], -along[0]]), 0.0, atol=1e-9)
    assert [one.part for one in result.events] == ["drive"]
    assert result.events[0].impact
    assert result.energy.max_drift < 3e-6


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_a_jump_in_a_prescribed_position_is_refused_by_name(form: str, solver: str) -> None:
    with pytest.raises(SolveError, match=r"t = 0\.5 .*jumps by 1 m") as caught:
        simulate(driven(lambda t: select(t < 0.5, 0.0, 1.0)), form=form, solver=solver)
    assert caught.value.where.startswith("drive.")


@pytest.mark.parametrize("form", FORMS)
def test_a_jump_in_a_prescribed_acceleration_is_no_event_of_its_own(form: str) -> None:
    result = simulate(driven(lambda t: select(t < 0.5, 0.0, (t - 0.5) ** 2)), form=form, rtol=1e-9)
    assert not result.events
    assert result.energy.max_drift < 1e-7


def two_links(space: str, rotation: Function, size: float = 1.0, mass: float = 1.0) -> Scene:
    """A link that is turned as prescribed, and one that hangs on its end."""
    scene = Scene(gravity=9.81 * size, t_end=1.0, space=space)
    ground, drive = scene.add("ground", Ground()), scene.add("drive", RotaryDrive(rotation=rotation))
    axial = {"axial_moment": 1e-2 * mass * size**2} if space == "space" else {}
    first = scene.add("first", Link(length=size, mass=mass, **axial))
    second = scene.add("second", Link(length=0.5 * size, mass=mass, **axial))
    pivot = scene.add("pivot", Pivot(axis=(0.0, -0.6, 0.8) if space == "space" else (0.0, -1.0, 0.0)))
    for a, b in (
        (ground.frame, drive.a),
        (drive.b, first.a),
        (first.b, pivot.a),
        (pivot.b, second.a),
    ):
        scene.connect(a, b)
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize(("space", "size", "mass"), [("plane", 1.0, 1.0), ("plane", 1e-3, 1e-6), ("space", 1e3, 1e6)])
def test_a_motor_that_stops_at_once_is_the_same_impact_in_every_form_and_size(
    space: str, size: float, mass: float
) -> None:
    rotation = lambda t: select(t < 0.5, 2.0 * t, 1.0)  # noqa: E731
    results = [simulate(two_links(space, rotation, size, mass), form=form, rtol=1e-9) for form in FORMS]
    for result in results:
        before, after = (i for i, t in enumerate(result.time) if t == 0.5)
        speeds = result.array("pivot.angular_velocity")
        assert abs(speeds[after] - speeds[before]) > 0.01
        assert result.energy.max_drift < 1e-6
        np.testing.assert_allclose(speeds, results[0].array("pivot.angular_velocity"), atol=1e-4)
    if space == "plane":  # about the pivot, where the impulse acts, the second link keeps its angular momentum
        turned, rates = (results[0].array(f"second.{name}") for name in ("angle", "angular_velocity"))
        x, z = (results[0].array(f"second.velocity.{axis}") for axis in "xz")
        momentum = rates * (0.5 * size) ** 2 / 12.0 + 0.25 * size * (z * np.cos(turned) - x * np.sin(turned))
        np.testing.assert_allclose(momentum[after], momentum[before], rtol=1e-7)


@pytest.mark.sample(3)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "jump"), [("plane", 0.1), ("plane", math.pi), ("space", 0.1), ("space", math.pi)])
def test_a_motor_that_jumps_is_refused_also_by_half_a_turn(form: str, space: str, jump: float) -> None:
    with pytest.raises(SolveError, match=r"t = 0\.5 .*jumps") as caught:
        simulate(two_links(space, lambda t: select(t < 0.5, 0.0, jump)), form=form)
    assert caught.value.where.startswith("drive.")


@pytest.mark.sample(1)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_motor_in_a_loop_may_turn_back_at_once(space: str) -> None:
    def rows(form: str) -> np.ndarray:
        scene = Scene(t_end=1.0, space=space)
        left, right = scene.add("left", Ground()), scene.add("right", Ground(position=(2.5, 0.0, 0.0)))
        drive = RotaryDrive(axis=(0.0, -1.0, 0.0), rotation=lambda t: 1.0 + select(t < 0.5, t, 1.5 - 2.0 * t))
        drive = scene.add("drive", drive)
        axial = {"axial_moment": 1e-2} if space == "space" else {}
        links = [
            scene.add(name, Link(length=length, mass=0.1 * length, **axial))
            for name, length in (("crank", 1.0), ("coupler", 2.5), ("rocker", 2.0))
        ]
        pivots = [scene.add(name, Pivot(axis=(0.0, -1.0, 0.0))) for name in ("pivot2", "pivot3", "pivot4")]
        for a, b in (
            (left.frame, drive.a),
            (drive.b, links[0].a),
            (links[0].b, pivots[0].a),
            (pivots[0].b, links[1].a),
            (links[1].b, pivots[1].a),
            (pivots[1].b, links[2].b),
            (links[2].a, pivots[2].b),
            (pivots[2].a, right.frame),
        ):
            scene.connect(a, b)
        scene.guess.update({"pivot2.angle": -0.7, "pivot4.angle": 1.9})
        result = simulate(scene, form=form, rtol=1e-9)
        assert len(result.events) == 1
        return result.array("pivot4.angular_velocity")

    speeds = rows("reduced")
    np.testing.assert_allclose(rows("dae"), speeds, rtol=1e-7, atol=1e-7)
    assert abs(speeds[101] + 2.0 * speeds[100]) < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_that_a_push_makes_slack_at_once_is_seen(form: str) -> None:
    scene = Scene(t_end=2.0)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(when_slack="slack"))
    bob = scene.add("bob", PointMass())
    thrown = Force(direction=(0.0, 0.0, 1.0), value=lambda t: select((t > 0.3) & (t < 0.4), 30.0, 0.0))
    push = scene.add("push", thrown)
    for a, b in ((ground.frame, rope.a), (rope.b, bob.point), (push.point, bob.point)):
        scene.connect(a, b)
    start = {"position.x": 0.0, "position.z": -1.0, "velocity.x": 0.0, "velocity.z": 0.0}
    scene.start.update({f"bob.{name}": value for name, value in start.items()})
    result = simulate(scene, form=form)
    fall = 0.1 * (30.0 - 9.81)  # the speed at which it is thrown
    height = 0.5 * 0.1 * fall
    again = 0.4 + (fall + math.sqrt(fall**2 + 2.0 * 9.81 * height)) / 9.81
    assert [one.time for one in result.events] == pytest.approx([0.3, again], rel=1e-9)


class Field(Component):
    """A spring to the origin that becomes stiffer at a time."""

    stiffness: float = parameter(100.0, unit="N/m", doc="Its stiffness before.")
    at: Point = connector(Point, "What it pulls.")

    @potential
    def energy(self) -> Scalar:
        """Return its energy."""
        k = select(self.time < 0.5, self.stiffness, 2.0 * self.stiffness)
        return 0.5 * k * (self.at.position.x**2 + self.at.position.z**2)


@pytest.mark.parametrize("form", FORMS)
def test_energy_that_an_input_puts_into_a_spring_at_once_is_work(form: str) -> None:
    scene = Scene(gravity=0.0, t_end=1.0)
    bob, field = scene.add("bob", PointMass()), scene.add("field", Field())
    scene.connect(bob.point, field.at)
    start = {"position.x": 0.1, "position.z": 0.0, "velocity.x": 0.0, "velocity.z": 0.0}
    scene.start.update({f"bob.{name}": value for name, value in start.items()})
    result = simulate(scene, form=form, rtol=1e-9)
    fast, x, v = math.sqrt(200.0), 0.1 * math.cos(5.0), -math.sin(5.0)
    end = x * math.cos(0.5 * fast) + v / fast * math.sin(0.5 * fast)
    assert result.array("bob.position.x")[-1] == pytest.approx(end, abs=1e-7)
    assert result.energy.work[-1] == pytest.approx(50.0 * x * x, abs=1e-7)
    assert result.energy.max_drift < 3e-5


def test_a_comparison_goes_through_an_impact() -> None:
    found = compare(driven(lambda t: select(t < 0.5, t, 0.5)), rtols=(1e-8,), outputs=11)
    assert all(row.error < 1e-5 for row in found.rows)


@pytest.mark.parametrize("form", FORMS)
def test_a_motion_that_starts_infinitely_fast_is_refused_by_name(form: str) -> None:
    with pytest.raises(SolveError, match=r"t = 0\.5 .*without a finite") as caught:
        simulate(driven(lambda t: sqrt(maximum(t - 0.5, 0.0))), form=form)
    assert caught.value.where == "drive"


@pytest.mark.parametrize("form", FORMS)
def test_a_motion_that_fits_but_for_its_digits_is_continuous(form: str) -> None:
    result = simulate(driven(lambda t: select(t < 0.5235988, sin(t), 0.5)), form=form, rtol=1e-10)
    assert len(result.events) == 1
    assert result.energy.max_drift < 1e-6


def test_each_part_whose_speed_jumps_is_told() -> None:
    scene = Scene(t_end=1.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    drive = scene.add("drive", Drive(motion=lambda t: select(t < 0.5, t, 0.5)))
    lift = scene.add("lift", Drive(axis=(0.0, 0.0, 1.0), motion=lambda t: select(t < 5 * 0.1, 2.0 * t, 1.0)))
    for a, b in ((ground.frame, drive.a), (drive.b, lift.a), (lift.b, rod.a), (rod.b, bob.point)):
        scene.connect(a, b)
    scene.start.update({"rod.angle": 0.3, "rod.angular_velocity": 0.0})
    assert [(one.time, one.part) for one in simulate(scene).events] == [(0.5, "drive"), (0.5, "lift")]


def test_switching_without_end_is_refused_by_name() -> None:
    with pytest.raises(SolveError, match="a relation of time switches more than") as caught:
        simulate(pushed(lambda t: select(sin(1e7 * t) > 0.0, 1.0, 0.0)))
    assert caught.value.where == "push.value"


def test_scenes_without_switches_have_no_schedule() -> None:
    assembly = assemble(driven(lambda t: 0.1 * sin(t)))
    assert not assembly.relations
    assert not len(find_schedule(assembly, 0.0, 1.0).times)


def test_a_scene_with_the_values_of_the_last_has_its_moments() -> None:
    made = [simulate(SCENES["six-axis-arm"](), t_end=2.0, outputs=3).run.segments for _ in range(2)]
    assert [one.time.tolist() for one in made[0]] == [one.time.tolist() for one in made[1]]
    plans = [segments[0].plan.assembly for segments in made]
    schedules = [find_schedule(one, 0.0, 2.0) for one in plans]
    assert len(schedules[0].times) > 0
    assert schedules[0] is schedules[1]
    assert find_schedule(plans[0], 0.0, 1.0).times.tolist() == [t for t in schedules[0].times.tolist() if t < 1.0]
