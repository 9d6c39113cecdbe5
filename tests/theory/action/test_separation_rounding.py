"""Separation where coordinates hold by relations between decimal numbers, and where they do nearly."""

from __future__ import annotations

import math

import pytest

from atwood import Scene, separation
from atwood_library import PointMass, Potential
from atwood_library.scenes import SCENES


@pytest.mark.sample(1)
@pytest.mark.parametrize(("share", "separates"), [(0.7, True), (0.8, False), (0.7 + 1e-9, False)])
def test_two_bodies_separate_in_the_centre_of_mass_and_polar_coordinates(share: float, separates: bool) -> None:
    coordinates = {}
    for axis, along in (("x", "r*cos(phi)"), ("z", "r*sin(phi)")):
        coordinates[f"body1.position.{axis}"] = f"C{axis} + {share / (1.3 + share)!r}*{along}"
        coordinates[f"body2.position.{axis}"] = f"C{axis} - {1.3 / (1.3 + share)!r}*{along}"
    found = separation(SCENES["two-body"](space="plane", mass1=1.3, mass2=0.7), coordinates)
    assert found.separates is separates
    assert not found.expression.atoms(type(found.coordinates[0])) - {
        *found.coordinates,
        *found.momenta,
        *found.values,
    }  # no stand-in is left


def oscillator(coupling: float) -> Scene:
    scene = Scene(gravity=0.0)
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(mass=1.0))
    scene.connect(field.point, body.point)
    scene.set("field.energy_function", lambda x, z: x**2 + 2.0 * z**2 + coupling * x * z)
    scene.start.update({"body.position.x": 0.3, "body.position.z": 0.2})
    return scene


def test_coupled_oscillators_separate_in_normal_coordinates() -> None:
    angle = 0.5 * math.atan2(0.7, -1.0)
    c, s = math.cos(angle), math.sin(angle)
    normal = {"body.position.x": f"{c!r}*u - {s!r}*v", "body.position.z": f"{s!r}*u + {c!r}*v"}
    assert separation(oscillator(0.7), normal).separates
    assert not separation(oscillator(0.7)).separates
    assert not separation(oscillator(0.7 + 1e-8), normal).separates


@pytest.mark.parametrize("coupling", [1e-3, 1e-9, 1e-14])
def test_a_weak_coupling_is_one(coupling: float) -> None:
    assert separation(oscillator(0.0)).separates
    assert not separation(oscillator(coupling)).separates
