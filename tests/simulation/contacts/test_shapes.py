"""Ellipsoids, polygons, tops and elastic balls on a plane against known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import atwood as aw
from atwood import Scene, normal_modes, simulate
from atwood_library import (
    BallContact,
    CompliantContact,
    EllipsoidContact,
    Ground,
    PolygonContact,
    RigidBody,
    Sphere,
)

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def on_plane(body: aw.Component, contact: aw.Component, end: str, **settings: object) -> Scene:
    """Return a scene with a body, called m, on a plane, called c."""
    scene = Scene(**settings)
    ground, m, c = scene.add("ground", Ground()), scene.add("m", body), scene.add("c", contact)
    scene.connect(ground.frame, c.plane)
    scene.connect(m.frame, getattr(c, end))
    return scene


@pytest.mark.parametrize("size", [1.0, 1e3, 1e-3])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_an_ellipse_rocks(friction: float, size: float) -> None:
    """Its centre rises by (a^2 - c^2)/(2 c) t^2; it turns about its centre, or rolls, about where it touches."""
    a, c, mass = 0.3 * size, 0.2 * size, 2.0
    own = mass * (a * a + c * c) / 5.0
    body = RigidBody(mass=mass, moments=(own, own, own))
    scene = on_plane(body, EllipsoidContact(semi_axes=(a, a, c), friction=friction), "body")
    scene.start.update({"m.position.x": 0.0, "m.position.z": c, "m.angle": 0.0})
    modes = normal_modes(scene)
    inertia = own + (mass * c * c if friction else 0.0)
    known = math.sqrt(mass * G * (a * a - c * c) / c / inertia)
    assert modes.angular_frequencies == pytest.approx([0.0, known], rel=1e-9)
    assert modes.contacts.get("c.slip") == ("sticks" if friction else None)


@FORMS
def test_an_ellipsoid_that_falls_loses_no_energy_where_nothing_rubs(form: str) -> None:
    body = RigidBody(mass=1.0, moments=(0.02, 0.03, 0.01))
    contact = EllipsoidContact(semi_axes=(0.1, 0.2, 0.3), restitution=1.0)
    scene = on_plane(body, contact, "body", space="space")
    scene.start.update({f"m.position.{axis}": value for axis, value in zip("xyz", (0.0, 0.0, 0.5), strict=True)})
    scene.start.update(
        {f"m.angular_velocity.{axis}": value for axis, value in zip("xyz", (1.0, 2.0, 3.0), strict=True)}
    )
    result = simulate(scene, form=form, t_end=1.0, rtol=1e-10, monitor=aw.conserved(scene))
    assert len(result.impacts) >= 2
    assert result.conserved["h"].max_drift < 1e-9
    assert min(result["c.gap"]) > -1e-9


@FORMS
def test_a_triangle_falls_on_its_side(form: str) -> None:
    """Its corners are wherever they are given; at rest the floor carries it."""
    contact = PolygonContact(vertices=((-0.5, -0.3), (0.5, -0.3), (0.0, 0.6)), friction=0.5)
    scene = on_plane(RigidBody(mass=1.0, moments=(1.0, 0.1, 1.0)), contact, "body")
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.9, "m.angle": 0.3})
    result = simulate(scene, form=form, t_end=3.0)
    assert result["m.position.z"][-1] == pytest.approx(0.3, abs=1e-8)
    assert result["m.angle"][-1] == pytest.approx(0.0, abs=1e-8)
    force = sum(float(result[f"c.corner[{i}].normal_force"][-1]) for i in range(3))
    assert force == pytest.approx(G, rel=1e-8)


def test_corners_that_are_none_are_refused() -> None:
    with pytest.raises(aw.ParameterError, match="rows of two or of three numbers"):
        aw.assemble(on_plane(RigidBody(), PolygonContact(vertices=(1.0, 2.0)), "body"))


@FORMS
def test_a_tippe_top_keeps_jellett_s_integral(form: str) -> None:
    """The angular momentum along the way from the centre of mass to the contact, whatever friction does (1872)."""
    radius, off, moments = 0.02, -0.004, (8e-7, 8e-7, 7e-7)
    body = RigidBody(mass=0.006, moments=moments, center=(0.0, 0.0, off))
    scene = on_plane(body, BallContact(radius=radius, friction=0.3), "ball", space="space")
    scene.start.update({"m.position.x": 0.0, "m.position.y": 0.0, "c.gap": 0.0})
    scene.start.update({"m.z_axis.x": 0.1, "m.z_axis.y": 0.0})
    scene.start.update({"m.angular_velocity.x": 0.0, "m.angular_velocity.y": 0.0, "m.angular_velocity.z": 150.0})
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-10)
    spin = np.array([result[f"m.angular_velocity.{axis}"] for axis in "xyz"])
    axis = np.array([result[f"m.z_axis.{one}"] for one in "xyz"])
    along = np.sum(spin * axis, axis=0)
    momentum = moments[0] * spin + (moments[2] - moments[0]) * along * axis
    arm = -radius * np.array([0.0, 0.0, 1.0])[:, None] - off * axis
    jellett = np.sum(momentum * arm, axis=0)
    assert np.ptp(jellett) < 1e-8 * abs(jellett[0])
    assert np.ptp(axis[2]) > 0.01


@pytest.mark.parametrize("share", [0.9, 0.5])
@pytest.mark.parametrize("law", ["hunt-crossley", "flores"])
@FORMS
def test_an_elastic_ball_loses_what_its_law_says(form: str, law: str, share: float) -> None:
    """From v dv/dx = -K x^n (1 + k v)/m: k v - ln(1 + k v) is the same before and after, whatever K and n are."""
    speed = 0.7
    contact = CompliantContact(radius=0.1, modulus=1e7, law=law, restitution=share, impact_speed=speed)
    scene = on_plane(Sphere(mass=2.0, radius=0.1), contact, "ball", gravity=0.0)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.101, "m.velocity.x": 0.0, "m.velocity.z": -speed})
    result = simulate(scene, form=form, t_end=0.02, rtol=1e-10)
    k = 1.5 * (1.0 - share) / speed if law == "hunt-crossley" else 1.6 * (1.0 - share) / share / speed
    before = k * speed - math.log(1.0 + k * speed)
    after = brentq(lambda v: before + k * v + math.log(1.0 - k * v), 0.0, 0.999999 * min(1.0 / k, speed))
    assert result["m.velocity.z"][-1] == pytest.approx(after, rel=1e-6)
    assert after / speed == pytest.approx(share, abs=0.17 if law == "hunt-crossley" and share == 0.5 else 0.031)


def test_hertz_presses_as_deep_as_he_says_and_friction_fades_at_rest() -> None:
    scene = on_plane(Sphere(mass=2.0, radius=0.1), CompliantContact(radius=0.1, modulus=1e7), "ball", gravity=0.0)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.101, "m.velocity.x": 0.0, "m.velocity.z": -0.7})
    result = simulate(scene, t_end=0.02, rtol=1e-10, outputs=4001)
    stiffness = 4.0 / 3.0 * 1e7 * math.sqrt(0.1)
    assert max(result["c.depth"]) == pytest.approx((1.25 * 2.0 * 0.49 / stiffness) ** 0.4, rel=1e-5)
    contact = CompliantContact(radius=0.1, modulus=1e7, friction=0.2, restitution=0.5)
    scene = on_plane(Sphere(mass=1.0, radius=0.1), contact, "ball", space="space")
    depth = (G / stiffness) ** (2.0 / 3.0)
    scene.start.update({"m.position.x": 0.0, "m.position.y": 0.0, "m.position.z": 0.1 - depth})
    scene.start.update({"m.velocity.x": 2.0, "m.velocity.y": 0.0, "m.velocity.z": 0.0})
    result = simulate(scene, t_end=1.0)
    assert result["m.velocity.x"][-1] == pytest.approx(2.0 * 5.0 / 7.0, rel=1e-3)
