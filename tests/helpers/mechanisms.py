"""Mechanisms put together step by step, which the tests of topology, start and solve share."""

from __future__ import annotations

import math
from typing import Any

from atwood import Component, Scene
from atwood_library import Ground, Link, Pivot, PointMass, Rod, Rope


def pendulum(**settings: Any) -> Scene:
    """Return a pendulum: ground, rod, bob."""
    scene = Scene(**{"t_end": 1.0, **settings})
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    return scene


def pendulum_on_a_string(**settings: Any) -> Scene:
    """Return a bob below the ground on a rope, given by its settings or as a part; it starts at the bottom."""
    given = settings.pop("rope", {})
    scene = Scene(**{"t_end": 2.0, **settings})
    rope = given if isinstance(given, Component) else Rope(**{"length": 1.0, **given})
    ground, rope = scene.add("ground", Ground()), scene.add("rope", rope)
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


def double_four_bar(rate: float = 1.0, windows: int = 2) -> Scene:
    """Return parallelograms side by side, all bars of length 1 and mass 1, cranks upright at first.

    When all bars are in line the cranks could go on in more than one way (IFToMM benchmark A02).
    """
    scene = Scene(t_end=10.0)
    before = None
    for i in range(windows + 1):
        ground, pivot = scene.add(f"ground{i}", Ground(position=(float(i), 0.0, 0.0))), scene.add(f"pivot{i}", Pivot())
        crank = scene.add(f"crank{i}", Link(length=1.0, mass=1.0))
        scene.connect(ground.frame, pivot.a)
        scene.connect(pivot.b, crank.a)
        scene.guess[f"crank{i}.angle"] = QUARTER
        if before is not None:
            coupler = scene.add(f"coupler{i}", Link(length=1.0, mass=1.0))
            left, right = scene.add(f"left{i}", Pivot()), scene.add(f"right{i}", Pivot())
            scene.connect(before.b, left.a)
            scene.connect(left.b, coupler.a)
            scene.connect(coupler.b, right.a)
            scene.connect(right.b, crank.b)
            scene.guess[f"coupler{i}.angle"] = 0.0
        before = crank
    del scene.guess["crank0.angle"]
    scene.start.update({"crank0.angle": QUARTER, "crank0.angular_velocity": -rate})
    return scene


def two_four_bars() -> Scene:
    """Return two four-bar linkages that have nothing to do with each other."""
    scene = Scene(t_end=1.0)
    for number, angle in ((1, 1.0), (2, 0.7)):
        links = {"crank": (1.0, 0.1), "coupler": (2.5, 0.25), "rocker": (2.0, 0.2)}
        crank, coupler, rocker = (
            scene.add(f"{name}{number}", Link(length=length, mass=mass)) for name, (length, mass) in links.items()
        )
        ends = [scene.add(f"ground{number}{side}", Ground(position=(x, 0.0, 0.0))) for side, x in ((1, 0.0), (2, 2.5))]
        joined = [(ends[0].frame, crank.a), (crank.b, coupler.a), (coupler.b, rocker.b), (rocker.a, ends[1].frame)]
        for k, (one, other) in enumerate(joined):
            pivot = scene.add(f"pivot{number}{k}", Pivot())
            scene.connect(one, pivot.a)
            scene.connect(pivot.b, other)
        scene.start.update({f"crank{number}.angle": angle, f"crank{number}.angular_velocity": 1.0})
        scene.guess.update({f"coupler{number}.angle": 0.3, f"rocker{number}.angle": 1.9})
    return scene
