"""What bodies in space do on planes, with events, against answers by hand and against joints that roll."""

from __future__ import annotations

import math

import numpy as np
import pytest

import atwood as aw
from atwood import Scene, simulate
from atwood_library import (
    BallContact,
    EllipsoidContact,
    Ground,
    RigidBody,
    RollingEllipsoid,
    RotaryDrive,
    Sphere,
    VertexContact,
)

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
UP, RADIUS = np.array([0.0, 0.0, 1.0]), 0.1


def begin(scene: Scene, **named: object) -> None:
    for name, each in named.items():
        scene.start.update({f"b.{name}.{axis}": float(x) for axis, x in zip("xyz", np.asarray(each), strict=True)})


def vector(result: aw.Result, name: str) -> np.ndarray:
    return np.array([result[f"b.{name}.{axis}"][-1] for axis in "xyz"])


@FORMS
def test_a_ball_on_a_turntable_goes_in_circles_two_sevenths_as_fast(form: str) -> None:
    scene, turns = Scene(space="space"), 2.0
    ground, drive = scene.add("g", Ground()), scene.add("p", RotaryDrive(axis="z", rotation=lambda t: turns * t))
    ball, touch = (
        scene.add("b", Sphere(mass=1.0, radius=RADIUS)),
        scene.add("c", BallContact(radius=RADIUS, friction=5.0)),
    )
    for ends in ((ground.frame, drive.a), (drive.b, touch.plane), (ball.frame, touch.ball)):
        scene.connect(*ends)
    place, velocity = np.array([0.5, 0.0, RADIUS]), np.array([0.1, 0.3, 0.0])
    slip = velocity - np.cross(turns * UP, place)
    begin(scene, position=place, velocity=velocity, angular_velocity=np.cross(UP, slip) / RADIUS + 0.7 * UP)
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10)
    angle = 2.0 / 7.0 * turns * 3.0
    c, s = math.cos(angle), math.sin(angle)
    assert vector(result, "velocity")[:2] == pytest.approx((0.1 * c - 0.3 * s, 0.1 * s + 0.3 * c), abs=1e-9)
    assert not result.events


@FORMS
def test_a_ball_with_spin_bounces_on_a_floor_as_by_hand(form: str) -> None:
    """Each impact takes slip away by its friction, or all of it by 2/7 of the slip."""
    share, friction = 0.8, 0.1
    scene = Scene(space="space")
    ground, ball = scene.add("g", Ground()), scene.add("b", Sphere(mass=1.0, radius=RADIUS))
    touch = scene.add("c", BallContact(radius=RADIUS, friction=friction, restitution=share))
    scene.connect(ground.frame, touch.plane)
    scene.connect(ball.frame, touch.ball)
    v, w, arm = np.array([1.0, 0.5, 0.0]), np.array([20.0, -30.0, 5.0]), -RADIUS * UP
    begin(scene, position=(0.0, 0.0, 1.0 + RADIUS), velocity=v, angular_velocity=w)
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10)
    speed = math.sqrt(2.0 * G)
    time = speed / G
    while time < 3.0:
        slip = v + np.cross(w, arm)
        push = -slip * min(friction * (1.0 + share) * speed / max(np.linalg.norm(slip), 1e-300), 2.0 / 7.0)
        v, w, speed = v + push, w + np.cross(arm, push) / (0.4 * RADIUS**2), share * speed
        time += 2.0 * speed / G
    assert vector(result, "velocity")[:2] == pytest.approx(v[:2], abs=1e-9)
    assert vector(result, "angular_velocity") == pytest.approx(w, abs=1e-9)


def test_an_ellipsoid_that_does_not_slip_moves_as_the_joint_that_rolls() -> None:
    axes = np.array([0.2, 0.15, 0.1])
    z = np.array([0.6 * math.sin(0.3), 0.8 * math.sin(0.3), math.cos(0.3)])
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    turn = np.array([x, np.cross(z, x), z]).T
    normal, spin = turn.T @ UP, np.array([0.5, 0.8, 0.3])
    height = math.sqrt(float(np.sum((axes * normal) ** 2)))
    velocity = np.cross(spin, turn @ (axes**2 * normal / height))

    def found(part: EllipsoidContact | RollingEllipsoid) -> np.ndarray:
        scene = Scene(space="space")
        ground, body = scene.add("g", Ground()), scene.add("b", RigidBody(mass=1.0, moments=(0.02, 0.03, 0.025)))
        scene.add("c", part)
        is_contact = isinstance(part, EllipsoidContact)
        scene.connect(ground.frame, part.plane if is_contact else part.a)
        scene.connect(body.frame, part.body if is_contact else part.b)
        begin(scene, x_axis=x, z_axis=z, angular_velocity=spin)
        scene.start.update({"b.position.x": 0.0, "b.position.y": 0.0})
        if is_contact:
            scene.start["b.position.z"] = height
            begin(scene, velocity=velocity)
        result = simulate(scene, t_end=1.5, rtol=1e-10)
        assert not result.events
        return np.concatenate([vector(result, name) for name in ("position", "angular_velocity", "z_axis")])

    sizes = tuple(map(float, axes))
    assert found(EllipsoidContact(semi_axes=sizes, friction=3.0)) == pytest.approx(
        found(RollingEllipsoid(semi_axes=sizes)), abs=1e-8
    )


@FORMS
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.25])
def test_what_tips_about_one_place_rubs_there_against_its_slip(form: str, friction: float) -> None:
    """The other place opens at once, and what would rub there has no say."""
    scene = Scene(space="space")
    body, arms = scene.add("b", RigidBody(mass=1.0, moments=(0.02, 0.03, 0.04))), ((0.1, 0.02, -0.3), (0.4, 0.05, -0.3))
    ground = scene.add("ground", Ground(position=(0.0, 0.0, -0.3)))
    for name, arm in zip(("near", "far"), arms, strict=True):
        place = scene.add(name, VertexContact(place=arm, friction=friction))
        scene.connect(body.frame, place.body)
        scene.connect(ground.frame, place.plane)
    begin(scene, position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0))
    result = simulate(scene, form=form, t_end=0.01, rtol=1e-10, outputs=5)
    force = np.array([result[f"near.force.{axis}"][0] for axis in "xyz"])
    turned = np.cross(arms[0], force) / (0.02, 0.03, 0.04)
    near, far = (force - G * UP + np.cross(turned, arm) for arm in arms)  # accelerations
    assert far[2] > 1.0
    assert (near[2], result["far.normal_force"][0]) == pytest.approx((0.0, 0.0), abs=1e-9)
    slips = near[:2] / np.linalg.norm(near[:2])
    assert force[:2] == pytest.approx(-friction * force[2] * slips, abs=1e-6)
    assert np.all(np.diff(result.energy.total) < 1e-9)
