"""Scenes with contacts that several tests and benchmarks look at."""

from __future__ import annotations

import math

from atwood import Scene
from atwood_library import Ground, Link, Pivot, PointContact, PointMass, RigidBody, RotationalFriction, Slider


def box_of_walls(restitution: float = 1.0, lean: float = 0.0, gravity: float = 0.0, mass: float = 1.0) -> Scene:
    """Return a ball of radius 0.05 in a box of 1 by 0.7; its floor leans by the slope `lean`."""
    scene = Scene(gravity=gravity)
    m = scene.add("m", PointMass(mass=mass))
    for name, place, normal in (
        ("a", (0, 0, 0), (1, 0, 0)),
        ("b", (1, 0, 0), (-1, 0, 0)),
        ("c", (0, 0, 0), (lean, 0, 1)),
        ("d", (0, 0, 0.7), (0, 0, -1)),
    ):
        ground = scene.add(f"ground_{name}", Ground(position=place))
        wall = scene.add(name, PointContact(normal=normal, radius=0.05, restitution=restitution))
        scene.connect(ground.frame, wall.plane)
        scene.connect(m.point, wall.point)
    scene.start.update({"m.position.x": 0.3, "m.position.z": 0.2, "m.velocity.x": 1.1, "m.velocity.z": 0.7})
    return scene


def rough_pendulum(angle: float | None = None) -> Scene:
    """Return a pendulum of m and l one with a torque of friction of 0.5 in its hinge, at an angle from its rest."""
    scene = Scene()
    ground, pivot, link = (
        scene.add("ground", Ground()),
        scene.add("pivot", Pivot()),
        scene.add("link", Link(length=1.0, mass=0.0)),
    )
    bob, rub = (
        scene.add("bob", PointMass(mass=1.0)),
        scene.add("rub", RotationalFriction(sliding="0.5", against="ground")),
    )
    for ends in ((ground.frame, pivot.a), (pivot.b, link.a), (link.b, bob.point), (pivot.shaft, rub.b)):
        scene.connect(*ends)
    if angle is not None:
        scene.start.update({"pivot.angle": angle - 0.5 * math.pi, "pivot.angular_velocity": 0.0})
    return scene


def wedge_between(angle: float, upper: float, lower: float, wedge: float, load: float) -> Scene:
    """Return a wedge `m` between a floor and a block in a vertical guide that lies on it, at rest; both faces rub."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=wedge))
    below = scene.add("below", PointContact(friction=lower))
    above = scene.add("above", PointContact(friction=upper, normal=(math.sin(angle), 0.0, -math.cos(angle))))
    block, guide = scene.add("block", RigidBody(mass=load)), scene.add("guide", Slider(axis=(0, 0, 1)))
    for a, b in (
        (ground.frame, below.plane),
        (mass.point, below.point),
        (ground.frame, guide.a),
        (guide.b, block.frame),
        (block.frame, above.plane),
        (mass.point, above.point),
    ):
        scene.connect(a, b)
    scene.start.update({f"m.{what}.{axis}": 0.0 for what in ("position", "velocity") for axis in "xz"})
    scene.start.update({"guide.displacement": 0.0, "guide.speed": 0.0})
    return scene
