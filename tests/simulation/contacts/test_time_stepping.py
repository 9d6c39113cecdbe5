"""Moreau's time stepping beside motions that look for events, and beside answers that are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import atwood as aw
from atwood import Scene, assemble, simulate
from atwood.expr import live
from atwood_library import (
    BallContact,
    BallPairContact,
    Box,
    BoxContact,
    Disc,
    Ground,
    Link,
    Pivot,
    PointContact,
    PointMass,
    RigidBody,
    Sphere,
)
from atwood_library.scenes import BouncingBall, Clutches, DoublePendulum, NewtonsCradle, StickSlip

from .test_known_answers import along, on_plane, on_slope, start_at

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def stepped(scene: Scene, form: str, end: float, step: float, **options: object) -> aw.Result:
    given = {"outputs": 2, "samples": 1, **options}
    return simulate(scene, form=form, t_end=end, solver="moreau", step=step, **given)


def state(result: aw.Result) -> np.ndarray:
    last = result.run.segments[-1]
    return np.concatenate([last.coordinates[:, -1], last.speeds[:, -1]])


def errors(make: Callable[[], Scene], form: str, end: float, steps: list[float]) -> np.ndarray:
    exact = state(simulate(make(), form=form, t_end=end, rtol=1e-10, outputs=2, samples=1))
    return np.array([np.max(np.abs(state(stepped(make(), form, end, h)) - exact)) for h in steps])


@FORMS
def test_it_is_of_order_two_where_nothing_touches(form: str) -> None:
    found = errors(DoublePendulum, form, 0.5, [0.01, 0.005])
    assert found[1] < 1e-3
    assert math.log2(found[0] / found[1]) == pytest.approx(2.0, abs=0.15)


@FORMS
def test_it_is_of_order_one_over_impacts(form: str) -> None:
    """Where in a step an impact falls is chance: errors are means over heights."""
    heights = np.linspace(0.8, 1.2, 8)
    coarse, fine = np.mean(
        [errors(lambda h=h: BouncingBall(height=h, restitution=0.8), form, 0.6, [0.02, 0.0025]) for h in heights],
        axis=0,
    )
    assert math.log2(coarse / fine) / 3.0 == pytest.approx(1.0, abs=0.35)


@FORMS
@pytest.mark.parametrize(("make", "end", "bound"), [(StickSlip, 0.8, 2e-3), (Clutches, 1.1, 2e-3)])
def test_it_comes_to_what_slips_and_sticks(make: Callable[[], Scene], end: float, bound: float, form: str) -> None:
    coarse, fine = errors(make, form, end, [0.008, 0.002])
    assert coarse < bound
    assert fine < 0.4 * coarse


@FORMS
@pytest.mark.parametrize("size", [1.0, 1e3])
def test_a_ball_comes_to_rest_and_does_not_creep(form: str, size: float) -> None:
    unit = math.sqrt(size)
    scene = on_plane(PointMass(mass=2.0), PointContact(restitution=0.5))
    start_at(scene, 0.0, size, 0.0, 0.0)
    result = stepped(scene, form, 3.0 * unit, 0.01 * unit, outputs=[0.0, 2.0 * unit, 3.0 * unit])
    assert result["m.position.z"][-1] == pytest.approx(result["m.position.z"][-2], abs=1e-15 * size)
    assert result["m.position.z"][-1] == pytest.approx(0.0, abs=2e-3 * size)
    assert result["c.normal_force"][-1] == pytest.approx(2.0 * G)
    assert result["c.gap_state"].tolist() == [0.0, 1.0, 1.0]
    assert all(one.loss >= 0.0 for one in result.impacts)


@FORMS
def test_a_block_on_a_slope_sticks_below_the_angle_of_friction_and_slips_above(form: str) -> None:
    stays = stepped(on_slope(0.3, 0.0), form, 2.0, 0.01)
    assert abs(along(stays, 0.3, "position")) < 1e-14
    assert stays["c.slip_state"][-1] == 2.0
    assert stays["c.friction_force"][-1] == pytest.approx(2.0 * G * math.sin(0.3))
    slips = stepped(on_slope(0.6, 0.0), form, 2.0, 0.01)
    rate = G * (math.sin(0.6) - 0.4 * math.cos(0.6))
    assert along(slips, 0.6, "velocity") == pytest.approx(-2.0 * rate, rel=1e-12)
    assert along(slips, 0.6, "position") == pytest.approx(-2.0 * rate, rel=1e-12)  # constant forces have no error


@FORMS
def test_a_block_slides_up_a_slope_and_the_ledger_has_what_it_loses(form: str) -> None:
    result = stepped(on_slope(0.3, 1.0), form, 0.3, 2e-3, outputs=7)
    slowing = G * (math.sin(0.3) + 0.4 * math.cos(0.3))
    assert along(result, 0.3, "position") == pytest.approx(0.5 / slowing, abs=1e-4)
    assert [one.kind for one in result.events] == ["sticks"]
    assert result.events[0].time == pytest.approx(1.0 / slowing, abs=4e-3)
    assert result.energy.work[-1] == pytest.approx(-0.4 * 2.0 * G * math.cos(0.3) * 0.5 / slowing, rel=3e-2)


@FORMS
def test_a_ball_begins_to_roll(form: str) -> None:
    scene = on_plane(Sphere(mass=1.0, radius=0.1), BallContact(radius=0.1, friction=0.2), space="space")
    speeds = {"m.velocity.x": 8.0, "m.velocity.y": 0.0, "m.velocity.z": 0.0}
    places = {"m.position.x": 0.0, "m.position.y": 0.0, "m.position.z": 0.1}
    turns = dict.fromkeys((f"m.angular_velocity.{axis}" for axis in "xyz"), 0.0)
    scene.start.update({**speeds, **places, **turns})
    result = stepped(scene, form, 1.5, 0.02)
    assert result["m.velocity.x"][-1] == pytest.approx(5.7142857143, rel=1e-9)
    assert result["c.slip_in_space_state"][-1] == 2.0


@FORMS
def test_discs_collide_without_a_change_of_momentum_or_a_gain_of_energy(form: str) -> None:
    scene = Scene(gravity=0.0)
    discs = [scene.add(f"disc{i}", Disc(mass=1.0 + i, radius=0.1)) for i in range(3)]
    for i, (one, other) in enumerate(pairwise(discs)):
        touch = scene.add(f"touch{i}", BallPairContact(restitution=0.7, friction=0.3))
        scene.connect(one.frame, touch.a)
        scene.connect(other.frame, touch.b)
    for i, (x, z, v) in enumerate(((0.0, 0.0, 1.0), (0.4, 0.05, 0.0), (0.8, -0.05, -0.5))):
        scene.start.update({f"disc{i}.position.x": x, f"disc{i}.position.z": z, f"disc{i}.angle": 0.0})
        scene.start.update({f"disc{i}.velocity.x": v, f"disc{i}.velocity.z": 0.0})
        scene.start[f"disc{i}.angular_velocity.y"] = 3.0 * i
    result = stepped(scene, form, 1.5, 0.01, outputs=16)
    assert len([one for one in result.events if one.kind == "impact"]) >= 2
    momentum = sum((1.0 + i) * result[f"disc{i}.velocity.x"] for i in range(3))
    assert momentum == pytest.approx(-0.5, abs=1e-12)
    assert np.all(np.diff(result.energy.kinetic) <= 1e-12)


@FORMS
def test_a_box_rests_on_its_corners(form: str) -> None:
    scene = on_plane(Box(mass=3.0, length_x=0.4, length_z=0.2), BoxContact(length=0.4, height=0.2, friction=0.5))
    start_at(scene, 0.0, 0.12, 0.3, 0.0)
    scene.start.update({"m.angle": 0.05, "m.angular_velocity.y": 0.0})
    result = stepped(scene, form, 1.5, 0.005, outputs=[0.0, 1.2, 1.5])
    assert np.ptp(result["m.position.x"][1:]) < 1e-12
    assert np.ptp(result["m.position.z"][1:]) < 1e-12
    assert result["m.position.z"][-1] == pytest.approx(0.1, abs=4e-3)  # as far as it falls in a step


def test_a_cradle_of_five_shares_its_speed_as_impacts_together_do() -> None:
    scene = NewtonsCradle()
    quarter = scene.first_impact()
    result = stepped(scene, "reduced", 1.02 * quarter, 1e-3)
    speeds = np.array([float(result[f"rod{i}.angular_velocity"][-1]) for i in range(1, 6)])
    assert speeds / abs(speeds[0]) * 0.6 == pytest.approx([0.6, -0.4, -0.4, -0.4, -0.4], abs=0.05) or (
        speeds / abs(speeds[0]) * 0.6 == pytest.approx([-0.6, 0.4, 0.4, 0.4, 0.4], abs=0.05)
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"step": None}, "takes a step"),
        ({"order": 4}, "takes a step"),
        ({"step": None, "accuracy": 1e-4}, "accuracy"),
        ({"until": "ball.position.z crosses 0.5"}, "looks for no event"),
        ({"impacts": "one_by_one"}, "does not tell impacts in a step apart"),
        ({"first_step": 1e-3}, "equal"),
    ],
)
def test_what_it_does_not_take_is_named(options: dict[str, object], said: str) -> None:
    with pytest.raises(aw.AtwoodError, match=said):
        simulate(BouncingBall(), **{"solver": "moreau", "step": 1e-2, **options})


def test_a_start_inside_is_refused() -> None:
    scene = Scene()
    ground, m, c = scene.add("ground", Ground()), scene.add("m", PointMass()), scene.add("c", PointContact())
    scene.connect(ground.frame, c.plane)
    scene.connect(m.point, c.point)
    start_at(scene, 0.0, -0.1, 0.0, 0.0)
    with pytest.raises(aw.StartError, match=r"starts inside, by 0\.1 m"):
        simulate(scene, solver="moreau", step=1e-2, t_end=1.0)


def figures(count: int, bones: int) -> Scene:
    """Return chains of bones over a floor that each bone and each hinge may touch."""
    scene = Scene()
    ground = scene.add("ground", Ground())
    for k in range(count):
        ends = [scene.add(f"f{k}bone{i}", RigidBody(mass=2.0, moments=(0.02, 0.02, 0.02))).frame for i in range(bones)]
        places = [(end, f"f{k}c{i}", 0.05) for i, end in enumerate(ends)]
        for i, (a, b) in enumerate(pairwise(ends)):
            halves = [scene.add(f"f{k}half{i}{side}", Link(length=0.15)) for side in "ab"]
            hinge = scene.add(f"f{k}hinge{i}", Pivot())
            joined = ((a, halves[0].a), (halves[0].b, hinge.a), (hinge.b, halves[1].a), (halves[1].b, b))
            for one, other in joined:
                scene.connect(one, other)
            places.append((halves[0].b, f"f{k}k{i}", 0.02))
            scene.start.update({f"f{k}hinge{i}.angle": -0.3 * (-1) ** i, f"f{k}hinge{i}.angular_velocity": 0.0})
        for end, name, radius in places:
            touch = scene.add(name, PointContact(radius=radius, friction=0.3))
            scene.connect(ground.frame, touch.plane)
            scene.connect(end, touch.point)
        moves = {"velocity.x": 1.0, "velocity.z": 0.0, "angle": 0.1, "angular_velocity.y": 0.0}
        places_now = {"position.x": 3.0 * k, "position.z": 0.3}
        scene.start.update({f"f{k}bone0.{name}": value for name, value in {**places_now, **moves}.items()})
    return scene


def test_what_is_jointed_and_touches_in_more_places_than_it_can_move_is_not_refused() -> None:
    """Speeds in a step keep joints at its ends, and not in its middle, where what touches is told."""
    exact = simulate(figures(1, 4), t_end=0.43, rtol=1e-9, outputs=2, samples=1)
    result = stepped(figures(1, 4), "dae", 0.43, 0.01)
    names = [f"f0bone{i}.position.{axis}" for i in range(4) for axis in "xz"]
    assert max(abs(float(result[name][-1] - exact[name][-1])) for name in names) < 0.03
    assert result.energy.kinetic[-1] + result.energy.potential[-1] < 0.2 * result.energy.potential[0]


def test_forces_of_figures_that_share_nothing_are_solved_for_one_by_one() -> None:
    """A system of all of them made the start cubic in their number: of ten ragdolls it did not end."""
    sizes = []
    for count in (1, 3):
        nodes = live(assemble(figures(count, 4), form="dae").maximal.rows)
        sizes.append(max(node.payload for node in nodes if node.operation == "solve"))
    assert sizes[0] == sizes[1]
