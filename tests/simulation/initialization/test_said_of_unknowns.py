"""A start that says coordinates and speeds themselves is taken as it is said: no iteration, no decision of rank."""

from __future__ import annotations

import math
from typing import Any

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood import Scene, assemble
from atwood.forms.assembly import Assembly
from atwood.simulation.initialization import positions, positions as speeds
from atwood.simulation.initialization.start import Start, find_start
from atwood_library import Ground, PointMass, Rod

from ...helpers.smooth import SMOOTH as SCENES


def rods(start: dict[str, Any], guess: dict[str, Any] | None = None) -> Assembly:
    """Two rods in a row, with masses."""
    scene = Scene(t_end=1.0)
    ground = scene.add("ground", Ground())
    last: Any = ground.frame
    for k in (1, 2):
        rod, bob = scene.add(f"rod{k}", Rod(length=0.5 * k)), scene.add(f"bob{k}", PointMass())
        scene.connect(last, rod.a)
        scene.connect(rod.b, bob.point)
        last = rod.b
    scene.start.update(start)
    scene.guess.update(guess or {})
    return assemble(scene)


def iterated(monkeypatch: pytest.MonkeyPatch, assembly: Assembly) -> Start:
    """Return the start as it is found where something else is said."""
    with monkeypatch.context() as patched:
        patched.setattr(positions, "named_once", lambda *_: None)
        patched.setattr(speeds, "_speeds_alone", lambda *_: None)
        return find_start(assembly)


SAID: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "all": (
        {"rod1.angle": 0.3, "rod2.angle": -1.0, "rod1.angular_velocity": 2.0, "rod2.angular_velocity": -0.7},
        {},
    ),
    "some": ({"rod1.angle": 7.0, "rod2.angular_velocity": 1e-9}, {}),
    "nothing": ({}, {}),
    "guesses": ({"rod1.angle": 0.3}, {"rod2.angle": 40.0, "rod1.angular_velocity": -3.0}),
    "a guess beside": ({"rod1.angle": 0.3}, {"rod1.angle": 0.5}),
}


@pytest.mark.parametrize("case", SAID)
def test_it_is_what_an_iteration_finds(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = iterated(monkeypatch, rods(*SAID[case]))
    for module in (positions, speeds):
        monkeypatch.setattr(module, "System", None)
        monkeypatch.setattr(module, "counted", None)
    found = find_start(rods(*SAID[case]))
    assert_array_equal(found.coordinates, expected.coordinates)
    assert_allclose(found.speeds, expected.speeds, rtol=1e-15)
    for name in ("free_coordinates", "free_speeds", "repeated"):
        assert getattr(found, name) == getattr(expected, name), name


@pytest.mark.parametrize(
    "start",
    [
        {"rod1.angle": 0.3, "bob1.velocity.x": 1.0},
        {"bob1.position.x": 0.1},
        {"rod1.angle": 0.3, "bob1.position.x": 0.5 * math.sin(0.3)},
    ],
)
def test_what_is_said_of_anything_else_is_solved_for(start: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    expected = iterated(monkeypatch, rods(start))
    found = find_start(rods(start))
    assert_array_equal(found.coordinates, expected.coordinates)
    assert_array_equal(found.speeds, expected.speeds)
    assert found.repeated == expected.repeated


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCENES)
def test_scenes_start_where_they_did(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected, found = iterated(monkeypatch, assemble(SCENES[name]())), find_start(assemble(SCENES[name]()))
    assert_allclose(found.coordinates, expected.coordinates, rtol=1e-14, atol=1e-14)
    assert_allclose(found.speeds, expected.speeds, rtol=1e-12, atol=1e-12)
    for one in ("free_coordinates", "free_speeds", "repeated"):
        assert getattr(found, one) == getattr(expected, one), one
