"""Rest with contacts against statics: gaps push, friction is within its limit, what sticks may stand elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.helpers.contact_scenes import rough_pendulum

from atwood import Scene, UsageError, equilibria
from atwood_library import (
    Ground,
    Link,
    PointContact,
    PointMass,
    PolygonContact,
    RigidBody,
    Spring,
    SurfaceContact,
    VertexContact,
)

G = 9.81


def block(
    slope: float = 0.0, friction: float = 0.3, stiffness: float = 50.0, size: float = 1.0, **contact: float
) -> Scene:
    up = (-math.sin(slope), 0.0, math.cos(slope))
    scene = Scene()
    ground, m = scene.add("ground", Ground(position=(3.0 * size, 0.0, -size))), scene.add("m", PointMass(mass=2.0))
    c = scene.add("c", PointContact(normal=up, friction=friction, **contact))
    scene.connect(ground.frame, c.plane)
    scene.connect(m.point, c.point)
    if stiffness:
        spring = scene.add("spring", Spring(stiffness=stiffness / size))
        scene.connect(ground.frame, spring.a)
        scene.connect(m.point, spring.b)
    x = 3.3 * size
    scene.start.update({"m.position.x": x, "m.position.z": (x - 3.0 * size) * math.tan(slope) - size})
    return scene


@pytest.mark.parametrize("size", [1.0, 1e3, 1e-3])
def test_a_block_on_a_spring_rests_in_an_interval(size: float) -> None:
    """It stays within mu m g/k of where spring and weight balance."""
    for slope in (0.0, 0.2):
        [rest] = equilibria(block(slope, size=size))
        middle = 3.0 * size - 2.0 * G * size * math.sin(slope) / 50.0 * math.cos(slope)
        wide = 0.3 * 2.0 * G * size * math.cos(slope) / 50.0 * math.cos(slope)
        assert rest.values["m.position.x"] == pytest.approx(middle, abs=1e-8 * size)
        assert (rest.stability, rest.family) == ("stable", 1)
        assert rest.contacts == {"c.gap": "closed", "c.slip": "sticks"}
        assert rest.reserves["c.slip"] == pytest.approx(0.6 * G * math.cos(slope), rel=1e-8)
        ends = sorted(side["m.position.x"] for side in rest.ends)
        assert ends == pytest.approx([middle - wide, middle + wide], abs=1e-8 * size)


def test_without_friction_it_stands_alone_and_on_a_belt_friction_pulls_it_aside() -> None:
    [smooth] = equilibria(block(friction=0.0))
    assert (smooth.family, smooth.ends, dict(smooth.reserves)) == (0, (), {})
    [pulled] = equilibria(block(surface_velocity=-1.0))
    assert pulled.contacts["c.slip"] == "slips forwards"
    assert pulled.values["m.position.x"] == pytest.approx(3.0 - 0.6 * G / 50.0, abs=1e-9)


def test_a_slope_holds_what_is_rough_enough() -> None:
    [rest] = equilibria(block(0.3, 0.4, stiffness=0.0))
    assert rest.reserves["c.slip"] == pytest.approx(2.0 * G * (0.4 * math.cos(0.3) - math.sin(0.3)))
    assert "c.slip sticks, with 1.69937 in reserve; closed: c.gap" in str(rest)
    with pytest.raises(UsageError, match="no equilibrium in the region, whatever touches and sticks"):
        equilibria(block(0.3, 0.3, stiffness=0.0))


def test_a_triangle_stands_on_its_sides_and_balances_on_its_corners() -> None:
    """It turns until a corner, or the outward normal of a side, points down, as far from its centre as this is."""
    corners = np.array([(-0.5, -0.3), (0.5, -0.3), (0.0, 0.6)])
    scene = Scene()
    ground = scene.add("ground", Ground())
    m = scene.add("m", RigidBody(mass=3.0, moments=(0.3, 0.3, 0.3)))
    c = scene.add("c", PolygonContact(vertices=corners, friction=0.3))
    scene.connect(ground.frame, c.plane)
    scene.connect(m.frame, c.body)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.3, "m.angle": 0.0})
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([sides[:, 1], -sides[:, 0]]) / np.linalg.norm(sides, axis=1)[:, None]
    down = [(*one, "unstable") for one in corners]
    down += [(*(n * (n @ corner)), "stable") for n, corner in zip(normals, corners, strict=True)]
    known = [(-0.5 * math.pi - math.atan2(z, x), math.hypot(x, z), said) for x, z, said in down]
    found = [(one.values["m.angle"], one.values["m.position.z"], one.stability) for one in equilibria(scene)]

    def told(states: list[tuple[float, float, str]]) -> list[tuple[float, float, float, str]]:
        return sorted((round(z, 7), round(math.cos(t), 7) + 0.0, round(math.sin(t), 7) + 0.0, s) for t, z, s in states)

    assert told(found) == told(known)


def test_a_ladder_leans_up_to_the_angle_of_friction() -> None:
    """At a smooth wall: tan(lean) = 2 mu. Upright the wall feels nothing, which is the border of this set."""
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", Link(length=2.0, mass=1.0))
    for name, normal, end, rough in (("floor", (0, 0, 1), m.a, 0.4), ("wall", (1, 0, 0), m.b, 0.0)):
        contact = scene.add(name, VertexContact(normal=normal, friction=rough))
        scene.connect(ground.frame, contact.plane)
        scene.connect(end, contact.body)
    scene.start.update({"m.angle": 0.5 * math.pi + 0.3, "floor.gap": 0.0, "wall.gap": 0.0})
    [rest] = [
        one for one in equilibria(scene) if one.values["m.position.z"] > 0.0 and one.contacts["wall.gap"] == "closed"
    ]
    leans = sorted(side["m.angle"] - 0.5 * math.pi for side in rest.ends)
    assert leans == pytest.approx([0.0, math.atan(0.8)], abs=1e-8)
    assert rest.stability == "undecided"


def test_friction_in_a_hinge_and_in_a_bowl() -> None:
    scene = rough_pendulum()
    found = equilibria(scene)
    wide = math.asin(0.5 / G)
    assert [round(one.values["link.angle"], 6) for one in found] == [-1.570796, 1.570796]
    for one in found:
        assert abs(one.ends[1]["link.angle"] - one.ends[0]["link.angle"]) == pytest.approx(2.0 * wide, abs=1e-8)
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    bowl = scene.add("c", SurfaceContact(function="1 - x**2 - z**2", friction=0.3))
    scene.connect(ground.frame, bowl.a)
    scene.connect(m.point, bowl.b)
    scene.start.update({"m.position.x": 0.1, "m.position.z": -0.5})
    [rest] = equilibria(scene)
    assert abs(rest.ends[0]["m.position.x"]) == pytest.approx(math.sin(math.atan(0.3)), abs=1e-8)
