"""Convex bodies in space in time stepping: on walls, on slopes, in stacks, turned, and beside solvers with events."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import atwood as aw
from atwood import Scene, simulate
from atwood.numerics.cone_impulses import Touches, impulses
from atwood.numerics.near_pairs import near_pairs
from atwood.simulation.contacts.convex_pairs import ConvexBodies
from atwood_library import BallPairContact, Box, ConvexContacts, Force, RigidBody, Sphere

G = 9.81
FLOOR = ((0.0, 0.0, 0.0, 0.0, 0.0, 1.0),)
SIZES = 0.4, 0.3, 0.2
Placed = tuple[aw.Component, dict[str, float]]


def turning(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    n = np.array(axis) / np.linalg.norm(axis)
    across = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    return np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * across @ across


def start(
    place: object, velocity: object = (0.0, 0.0, 0.0), turn: object = None, spin: object = (0.0, 0.0, 0.0)
) -> dict[str, float]:
    """Return start values; the spin is in the axes of the world."""
    axes = np.eye(3) if turn is None else np.asarray(turn)
    named = {
        "position": place,
        "velocity": velocity,
        "angular_velocity": spin,
        "x_axis": axes[:, 0],
        "z_axis": axes[:, 2],
    }
    return {f"{name}.{axis}": float(x) for name, each in named.items() for axis, x in zip("xyz", each, strict=True)}


def group(bodies: list[Placed], shapes: object, gravity: object = None, **given: object) -> Scene:
    scene = Scene(space="space") if gravity is None else Scene(space="space", gravity=gravity)
    ends = scene.add("c", ConvexContacts(count=len(bodies), shapes=shapes, **given)).body
    for i, (body, values) in enumerate(bodies):
        scene.connect(scene.add(f"b{i}", body).frame, ends[i])
        scene.start.update({f"b{i}.{name}": value for name, value in values.items()})
    return scene


def run(scene: Scene, end: float, step: float, **options: object) -> aw.Result:
    return simulate(scene, solver="moreau", step=step, t_end=end, **{"outputs": 3, "samples": 1, **options})


def vector(result: aw.Result, path: str, at: int = -1) -> np.ndarray:
    return np.array([result[f"{path}.{axis}"][at] for axis in "xyz"])


def box(mass: float = 1.0, sizes: tuple[float, ...] = SIZES) -> Box:
    return Box(mass=mass, length_x=sizes[0], length_y=sizes[1], length_z=sizes[2])


@pytest.mark.parametrize("share", [0.3, 0.9, 1.1])
def test_a_box_on_a_slope_slips_below_the_angle_of_friction_and_holds_above(share: float) -> None:
    turn = turning((1.0, 2.0, 0.0), 0.4)
    normal = turn[:, 2]
    scene = group(
        [(box(2.0), start(0.1 * normal, turn=turn))],
        ("box", *SIZES),
        walls=((0.0, 0.0, 0.0, *normal),),
        friction=share * math.tan(0.4),
    )
    velocity = vector(run(scene, 0.5, 5e-3), "b0.velocity")
    assert np.linalg.norm(velocity) == pytest.approx(max(0.0, 0.5 * G * math.sin(0.4) * (1.0 - share)), abs=1e-12)
    assert abs(velocity @ normal) < 1e-12


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_box_that_falls_comes_to_rest_and_makes_no_energy(form: str) -> None:
    placed = start((0.0, 0.0, 0.3), turn=turning((1.0, 2.0, 3.0), 0.5), spin=(0.5, 1.0, 0.0))
    scene = group([(box(), placed)], ("box", *SIZES), walls=FLOOR, friction=0.4)
    result = run(scene, 1.2, 2e-3, form=form, outputs=25)
    assert np.all(np.diff(result.energy.total) < 1e-12)
    assert result.energy.max_drift < 1e-3  # of steps in which it turns
    assert float(result["b0.position.z"][-1]) == pytest.approx(0.1, abs=5e-3)
    assert np.linalg.norm(vector(result, "b0.velocity")) < 1e-12


def test_a_scene_that_is_turned_moves_alike() -> None:
    def found(turn: np.ndarray) -> np.ndarray:
        first = turn @ turning((1.0, 1.0, 0.0), 0.3)
        placed = start(turn @ (0.1, 0.0, 0.35), turn @ (0.4, 0.2, 0.0), first, turn @ (1.0, 0.5, 2.0))
        wall = (0.0, 0.0, 0.0, *turn[:, 2])
        scene = group([(box(), placed)], ("box", *SIZES), 0.0, walls=(wall,), friction=0.3, restitution=0.3)
        weight = scene.add("weight", Force(direction=tuple(-turn[:, 2]), value=G))
        scene.connect(weight.point, scene["b0"].frame)
        result = run(scene, 0.4, 2e-3)
        return np.concatenate([turn.T @ vector(result, f"b0.{name}") for name in ("position", "velocity")])

    assert found(turning((0.3, -1.0, 0.5), 1.1)) == pytest.approx(found(np.eye(3)), abs=1e-9)


def test_a_ball_that_slides_rolls_at_last_and_keeps_its_spin_about_the_normal() -> None:
    placed = start((0.0, 0.0, 0.1), (2.0, 0.0, 0.0), spin=(0.0, 0.0, 3.0))
    result = run(group([(Sphere(mass=1.0, radius=0.1), placed)], ("ball", 0.1), walls=FLOOR, friction=0.3), 0.6, 1e-3)
    assert vector(result, "b0.velocity") == pytest.approx((10.0 / 7.0, 0.0, 0.0), abs=1e-6)
    assert vector(result, "b0.angular_velocity") == pytest.approx((0.0, 100.0 / 7.0, 3.0), abs=1e-4)


def test_an_ellipsoid_and_a_capsule_rest_on_a_floor() -> None:
    bodies = [
        (RigidBody(mass=1.0, moments=(0.01, 0.02, 0.02)), start((0.0, 0.0, 0.12), turn=turning((0.0, 1.0, 0.0), 0.2))),
        (
            RigidBody(mass=1.0, moments=(0.01, 0.01, 0.005)),
            start((2.0, 0.0, 0.1), turn=turning((0, 1, 0), math.pi / 2)),
        ),
    ]
    alone = [group([one], shape, walls=FLOOR, friction=0.5) for one, shape in zip(bodies, SHAPES, strict=True)]
    rolls, lies = (run(one, 0.5, 1e-3) for one in alone)
    assert abs(rolls["b0.angular_velocity.y"][-1]) > 0.1  # it rocks about its lowest point
    assert rolls.energy.max_drift < 1e-6
    assert float(lies["b0.position.z"][-1]) == pytest.approx(0.1, abs=1e-9)


SHAPES = ("ellipsoid", 0.2, 0.15, 0.1), ("capsule", 0.1, 0.3)


def two_balls(step: float | None) -> np.ndarray:
    """Return the velocities of two balls that collide with spin, found with events or in steps."""
    bodies = [
        (Sphere(mass=1.0, radius=0.1), start((0.0, 0.0, 1.0), (1.0, 0.2, 0.0), spin=(3.0, 1.0, 2.0))),
        (Sphere(mass=2.0, radius=0.1), start((0.5, 0.08, 1.05), (-0.5, 0.0, 0.1), spin=(0.0, 5.0, -1.0))),
    ]
    if step is not None:
        scene = group(bodies, ("ball", 0.1), 0.0, restitution=0.5, friction=0.3)
    else:
        scene = Scene(space="space", gravity=0.0)
        touch = scene.add("c", BallPairContact(radius_a=0.1, radius_b=0.1, restitution=0.5, friction=0.3))
        for i, (body, values) in enumerate(bodies):
            scene.connect(scene.add(f"b{i}", body).frame, (touch.a, touch.b)[i])
            scene.start.update({f"b{i}.{name}": value for name, value in values.items()})
    result = simulate(scene, t_end=0.5, rtol=1e-10) if step is None else run(scene, 0.5, step)
    names = "b0.velocity", "b0.angular_velocity", "b1.velocity", "b1.angular_velocity"
    return np.concatenate([vector(result, name) for name in names])


def test_an_impact_of_two_balls_is_that_of_a_solver_with_events_to_the_order_of_the_step() -> None:
    exact = two_balls(None)
    errors = [np.max(np.abs(two_balls(step) - exact)) for step in (8e-3, 1e-3, 1.25e-4)]
    assert all(before / after > 0.3 for before, after in pairwise(errors))
    assert errors[2] < 0.05 * errors[0]
    assert errors[2] < 2e-3


def lattice(count: int) -> tuple[ConvexBodies, np.ndarray, np.ndarray]:
    """Return balls of radius 0.1 pressed together, as a group and its state, and their speeds."""
    rng, wide = np.random.default_rng(0), round(count ** (1.0 / 3.0))
    places = np.stack(np.meshgrid(*[np.arange(wide)] * 3), axis=-1).reshape(-1, 3) * 0.199
    places += rng.uniform(-0.002, 0.002, places.shape)
    state = np.hstack([places, np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1))])
    speeds = np.vstack([rng.normal(size=(len(places), 6)), np.zeros((1, 6))])
    columns = np.arange(state.size).reshape(len(places), 7)
    rows = ((0.0, 0.1, 0.0, 0.0, 0.0),)
    none = np.zeros((0, 3)), np.zeros((0, 3))
    return ConvexBodies(rows, "c", columns, none), state.ravel(), speeds


def test_impulses_of_many_balls_meet_the_laws_and_keep_momentum() -> None:
    bodies, state, free = lattice(216)
    near = bodies.near(state, 0.0)
    inverse = np.array([np.diag([1.0] * 3 + [250.0] * 3)] * 216 + [np.zeros((6, 6))])
    touches, count = Touches(near.bodies, bodies.slopes(state, near), inverse, 0.3), len(near.gaps)
    assert count > 216
    v, p, missed = impulses(touches, free, np.zeros(count), np.zeros((3, count)), 1e-9, 1e-6)
    assert missed < 1e-9
    rates, rubs = touches.rates(v), np.hypot(*p[1:])
    assert np.all(p[0] >= 0.0)
    assert np.min(rates[0]) > -1e-7
    assert np.max(np.abs(p[0] * rates[0])) < 1e-7
    assert np.all(rubs <= 0.3 * p[0] + 1e-12)
    slides = np.hypot(*rates[1:]) > 1e-5
    assert np.max(np.abs(np.sum(p[1:] * rates[1:], axis=0) + rubs * np.hypot(*rates[1:]))[slides]) < 1e-5
    assert np.sum(v[:, :3], axis=0) == pytest.approx(np.sum(free[:, :3], axis=0), abs=1e-9)


def test_pairs_near_by_in_space_are_all_found_once() -> None:
    places = np.random.default_rng(2).uniform(-3.0, 3.0, (300, 3))
    pairs = near_pairs(places, 0.6)
    found = {tuple(sorted(one)) for one in pairs.tolist()}
    assert len(found) == len(pairs)
    distance = np.linalg.norm(places[:, None] - places[None], axis=2)
    assert {(i, j) for i, j in zip(*np.nonzero(distance <= 0.6), strict=True) if i < j} <= found


def test_what_shapes_and_walls_cannot_be_is_named() -> None:
    for shape in (("cube", 1.0), ("ball", -1.0), ("box", 1.0), ("hull", ((0, 0, 0),)), ("ball", math.nan), 3, ()):
        with pytest.raises(aw.ParameterError, match=r"no shape|ConvexContacts.shapes"):
            ConvexContacts(shapes=shape)

    def one() -> list[Placed]:
        return [(box(), start((0.0, 0.0, 1.0)))]

    with pytest.raises(aw.ParameterError, match="a wall is a row of 6 numbers"):
        run(group(one(), ("box", *SIZES), walls=((0.0, 0.0, 0.0, 1.0),)), 0.1, 1e-2)
    with pytest.raises(aw.UsageError, match="there are 3 shapes for 1 bodies"):
        run(group(one(), (("ball", 0.1),) * 3), 0.1, 1e-2)
    with pytest.raises(aw.UsageError, match="the corners of a hull are in one plane"):
        run(group(one(), ("hull", ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)))), 0.1, 1e-2)
    with pytest.raises(aw.StartError, match=r"body\[0\] starts inside wall 0, by 0\.05 m"):
        run(group([(box(), start((0.0, 0.0, 0.05)))], ("box", *SIZES), walls=FLOOR), 0.1, 1e-2)
    beside = RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1), center=(0.1, 0.0, 0.0))
    with pytest.raises(aw.UnsupportedError, match="no body that moves freely, with its frame at its centre"):
        run(group([(beside, start((0.0, 0.0, 1.0)))], ("box", *SIZES), walls=FLOOR), 0.1, 1e-2)


def test_pairs_that_are_not_both_balls_name_what_is_missing() -> None:
    pair = [(box(), start((0.0, 0.0, z))) for z in (0.1, 0.5)]
    scene = group(pair, ("box", *SIZES), walls=FLOOR)
    try:
        import coal  # noqa: F401
    except ImportError:
        with pytest.raises(aw.UsageError, match=r"coal, which is not installed\. pip install 'atwood\[coal\]'"):
            run(scene, 0.1, 1e-2)


def test_boxes_in_a_stack_rest_and_do_not_creep() -> None:
    pytest.importorskip("coal")
    sizes = 0.2, 0.2, 0.2
    bodies = [(box(1.0 + i, sizes), start((0.01 * i, 0.0, 0.1 + 0.2 * i))) for i in range(5)]
    result = run(group(bodies, ("box", *sizes), walls=FLOOR, friction=0.4), 0.5, 1e-2)
    for i in range(5):
        assert vector(result, f"b{i}.position") == pytest.approx((0.01 * i, 0.0, 0.1 + 0.2 * i), abs=1e-12)
    assert result.energy.max_drift < 1e-12


def test_a_box_slides_on_another_one_that_friction_takes_along() -> None:
    pytest.importorskip("coal")
    bodies = [(box(2.0, (2.0, 0.5, 0.2)), start((0.0, 0.0, 0.1))), (box(), start((0.0, 0.0, 0.3), (1.0, 0.0, 0.0)))]
    scene = group(
        bodies, (("box", 2.0, 0.5, 0.2), ("box", *SIZES)), walls=((0.0, 0.0, 0.0, 0.0, 0.0, 1.0),), friction=0.3
    )
    result = run(scene, 0.1, 1e-3)  # the floor holds the lower one, whose own friction is three times as much
    assert vector(result, "b1.velocity") == pytest.approx((1.0 - 0.3 * G * 0.1, 0.0, 0.0), abs=1e-9)
    assert np.linalg.norm(vector(result, "b0.velocity")) < 1e-12


def test_bodies_of_all_shapes_fall_on_each_other_and_make_no_energy() -> None:
    pytest.importorskip("coal")
    rng = np.random.default_rng(1)
    corners = tuple(map(tuple, 0.1 * rng.normal(size=(12, 3))))
    shapes = (
        ("box", 0.3, 0.2, 0.1),
        ("capsule", 0.08, 0.2),
        ("ellipsoid", 0.2, 0.1, 0.12),
        ("hull", corners),
        ("ball", 0.1),
    )
    bodies = [
        (
            RigidBody(mass=1.0, moments=(0.004, 0.005, 0.006)),
            start((0.05 * i, 0.03 * i, 0.4 + 0.35 * i), turn=turning((1, i, 2), i)),
        )
        for i in range(5)
    ]
    result = run(group(bodies, shapes, walls=FLOOR, friction=0.4, restitution=0.2), 0.8, 4e-3, outputs=21)
    assert np.all(np.diff(result.energy.total) < 1e-9)
    assert result.energy.max_drift < 1e-6
    for i in range(5):
        assert result[f"b{i}.position.z"][-1] > 0.02
