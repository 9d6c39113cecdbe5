"""Equilibria of known potentials and mechanisms: all of them, each once, none that is none, and their stability."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from atwood import Scene, equilibria, exp
from atwood_library import Ground, PointMass, Potential, Rod
from atwood_library.scenes import ElasticPendulum, RotatingHoopDriven, RotatingHoopFree, SphericalPendulum


def particle(energy: Callable[..., Any], start: tuple[float, ...] = (0.3, 0.2), **others: Any) -> Scene:
    """Return a point mass in a potential, in the plane or in space."""
    axes = "xz" if len(start) == 2 else "xyz"
    scene = Scene(space="plane" if len(start) == 2 else "space", gravity=0.0)
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(**{"mass": 1.3, **others}))
    scene.connect(field.point, body.point)
    scene.set("field.energy_function", energy)
    for axis, value in zip(axes, start, strict=True):
        scene.start[f"body.position.{axis}"], scene.start[f"body.velocity.{axis}"] = value, 0.0
    return scene


def turned(energy: Callable[[Any, Any], Any], size: float = 1.0) -> Callable[[Any, Any], Any]:
    """Return a potential turned by 0.7 rad, moved to (5, -3) and made larger."""
    c, s = math.cos(0.7), math.sin(0.7)
    return lambda x, z: energy(
        (c * (x / size - 5.0) + s * (z / size + 3.0)), (-s * (x / size - 5.0) + c * (z / size + 3.0))
    )


WELLS: dict[str, tuple[Callable[[Any, Any], Any], str, int]] = {
    "x^4 + z^2": (lambda x, z: x**4 + z**2, "stable", 0),
    "-x^4 + z^2": (lambda x, z: z**2 - x**4, "unstable", 0),
    "x^3 + z^2": (lambda x, z: z**2 + x**3, "unstable", 0),
    "x^5 + z^2": (lambda x, z: z**2 + x**5, "unstable", 0),
    "x^6 + z^2": (lambda x, z: z**2 + x**6, "stable", 0),
    "x^4 + z^4": (lambda x, z: x**4 + z**4, "stable", 0),
    "x^4 - z^4": (lambda x, z: x**4 - z**4, "unstable", 0),
    "monkey saddle": (lambda x, z: x**3 - 3.0 * x * z**2, "unstable", 0),
    "(z - x^2/2)^2 + 3/4 x^4": (lambda x, z: x**4 - x**2 * z + z**2, "stable", 0),
    "(z - 3/2 x^2)^2 - 5/4 x^4": (lambda x, z: x**4 - 3.0 * x**2 * z + z**2, "unstable", 0),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "size"), [*((name, 1.0) for name in WELLS), ("x^4 + z^2", 1e-6), ("x^3 + z^2", 1e6)])
def test_what_the_linear_model_does_not_decide_higher_derivatives_do(name: str, size: float) -> None:
    energy, stability, family = WELLS[name]
    scene = particle(turned(energy, size), (5.3 * size, -3.2 * size))
    box = {"body.position.x": (3.0 * size, 7.0 * size), "body.position.z": (-5.0 * size, -1.0 * size)}
    [one] = equilibria(scene, region=box)
    assert one.values["body.position.x"] == pytest.approx(5.0 * size, abs=1e-6 * size)
    assert one.values["body.position.z"] == pytest.approx(-3.0 * size, abs=1e-6 * size)
    assert (one.stability, one.family, one.stable) == (stability, family, stability == "stable")


def test_what_stands_where_it_starts_is_put_into_the_balance() -> None:
    """V = x^4 + z^2 has one critical point; no coordinate without stiffness keeps the value of the start."""
    [one] = equilibria(particle(lambda x, z: x**4 + z**2))
    assert max(map(abs, one.values.values())) < 1e-6


@pytest.mark.sample(2)
@pytest.mark.parametrize(("stiffness", "length", "mass"), [(0.5, 0.1, 20.0), (2.0, 0.75, 1.0), (39.24, 0.1, 1.0)])
def test_a_soft_spring_sags_by_many_times_its_length(stiffness: float, length: float, mass: float) -> None:
    [one] = equilibria(ElasticPendulum(stiffness=stiffness, natural_length=length, mass=mass))
    assert one.stable
    assert one.values["bob.position.z"] == pytest.approx(-length - mass * 9.81 / stiffness, rel=1e-9)


@pytest.mark.sample(0)
def test_a_ring_is_one_family() -> None:
    ring = turned(lambda x, z: (x**2 + z**2 - 1.0) ** 2)
    found = equilibria(particle(ring, (5.3, -3.2)), region={"body.position.x": (3, 7), "body.position.z": (-5, -1)})
    assert sorted((one.stability, one.family) for one in found) == [("stable", 1), ("unstable", 0)]
    on = next(one for one in found if one.stable).values
    assert math.hypot(on["body.position.x"] - 5.0, on["body.position.z"] + 3.0) == pytest.approx(1.0, abs=1e-10)
    assert "family in 1 direction" in str(found)
    assert {one["family"] for one in found.to_data()} == {0, 1}
    parabola = equilibria(particle(lambda x, z: (z - x**2) ** 2))
    assert [(one.stable, one.family) for one in parabola] == [(True, 1)]


def test_valleys_that_cross_are_no_single_minimum() -> None:
    found = equilibria(particle(lambda x, z: x**2 * z**2))
    for one in found:
        assert abs(one.values["body.position.x"] * one.values["body.position.z"]) < 1e-9
        assert one.family or one.stability == "undecided"


@pytest.mark.sample(0)
def test_a_narrow_well_and_the_tail_of_a_force_that_dies_away() -> None:
    [one] = equilibria(particle(lambda x, z: -exp(-((x / 0.1) ** 2 + (z / 0.1) ** 2)), (0.05, 0.03)))
    assert one.stable
    assert max(map(abs, one.values.values())) < 1e-10


@pytest.mark.sample(2)
@pytest.mark.parametrize("ratio", [0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0001, 1.1])
def test_hoop_about_its_critical_rate(ratio: float) -> None:
    """``cos(theta) = -g/(omega^2 a)``, where that is; the lowest point is stable up to the critical rate."""
    found = equilibria(RotatingHoopDriven(rate=ratio * math.sqrt(9.81)))
    expected = [(0.0, False), (math.pi, ratio <= 1.0)]
    if ratio > 1.0:
        # pi - acos(1/ratio^2) without the loss of digits that acos has near 1
        off = 2.0 * math.asin(math.sqrt(0.5 * (ratio - 1.0) * (ratio + 1.0)) / ratio)
        expected += [(math.pi - off, True), (off - math.pi, True)]
    angles = sorted((one.values["hoop.angle"], one.stable) for one in found)
    assert [stable for _, stable in angles] == [stable for _, stable in sorted(expected)]
    np.testing.assert_allclose([angle for angle, _ in angles], [angle for angle, _ in sorted(expected)], atol=1e-7)


@pytest.mark.sample(1)
@pytest.mark.parametrize("coordinates", ["angles", "places"])
def test_spherical_pendulum_hangs_and_stands(coordinates: str) -> None:
    found = equilibria(SphericalPendulum(coordinates=coordinates))
    assert sorted(one.stable for one in found) == [False, True]


@pytest.mark.parametrize("inertia", [0.0, 0.1])
def test_a_hoop_that_turns_freely_has_two(inertia: float) -> None:
    found = equilibria(RotatingHoopFree(inertia=inertia))
    assert [(round(math.cos(one.values["hoop.angle"]), 9), one.stable) for one in found] == [(1.0, False), (-1.0, True)]


def test_neumann_s_problem_has_six() -> None:
    """``V = sum a_k x_k^2`` on a sphere: both ends of each axis; those of the least a are stable."""
    scene = Scene(space="space", gravity=0.0)
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0))
    bob, field = scene.add("bob", PointMass(mass=1.0)), scene.add("field", Potential())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(field.point, bob.point)
    scene.set("field.energy_function", lambda x, y, z: x**2 + 2.0 * y**2 + 4.0 * z**2)
    scene.start.update({"bob.position.x": 0.6, "bob.position.y": 0.5})
    scene.guess["bob.position.z"] = 0.6
    found = equilibria(scene)
    places = {tuple(round(value, 9) + 0.0 for value in one.values.values()): one.stable for one in found}
    expected = {tuple(sign * float(i == k) + 0.0 for i in range(3)): k == 0 for k in range(3) for sign in (1.0, -1.0)}
    assert places == expected
