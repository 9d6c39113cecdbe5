"""Mechanisms put together step by step, which the tests of topology, start and solve share."""

from __future__ import annotations

import math
from typing import Any

from atwood import Scene
from atwood_library import Ground, Link, Pivot, PointMass, Rod, Rope


def pendulum(**settings: Any) -> Scene:
    """Return a pendulum: ground, rod, bob."""
    scene = Scene(**{"t_end": 1.0, **settings})
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    return scene


def pendulum_on_a_string(**settings: Any) -> Scene:
    """Return a bob on a rope of length 1 below the ground; it starts at the bottom."""
    rope_settings = settings.pop("rope", {})
    scene = Scene(**{"t_end": 2.0, **settings})
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(**{"length": 1.0, **rope_settings}))
    bob = scene.add("bob", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    return scene


def parallel_four_bar(cranks: int = 2, angle: float = 1.0, rate: float = 2.0) -> Scene:
    """Return a parallelogram of length 2 and height 1 on two or more parallel cranks."""
    scene = Scene(t_end=1.0)
    coupler_length, places = 2.0, [2.0 * i / (cranks - 1) for i in range(cranks)]
    left = scene.add("coupler", Link(length=coupler_length, mass=1.0))
    for i, place in enumerate(places):
        ground = scene.add(f"ground{i}", Ground(position=(place, 0.0, 0.0)))
        low, high = scene.add(f"low{i}", Pivot()), scene.add(f"high{i}", Pivot())
        crank = scene.add(f"crank{i}", Link(length=1.0, mass=0.3))
        scene.connect(ground.frame, low.a)
        scene.connect(low.b, crank.a)
        scene.connect(crank.b, high.a)
        if i == 0:
            scene.connect(high.b, left.a)
        elif i == cranks - 1:
            scene.connect(high.b, left.b)
        else:
            from atwood_library import Weld

            eye = scene.add(f"eye{i}", Weld(displacement=(place, 0.0, 0.0)))
            scene.connect(left.a, eye.a)
            scene.connect(high.b, eye.b)
        scene.guess[f"crank{i}.angle"] = angle
    scene.start.update({"crank0.angle": angle, "crank0.angular_velocity": rate})
    scene.guess["coupler.angle"] = 0.0
    return scene


QUARTER = math.pi / 2.0
