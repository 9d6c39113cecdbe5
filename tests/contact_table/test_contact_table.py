"""Rows of the table of contacts, each in one of its views and in one form; `python -m tests.contact_table` has all."""

from __future__ import annotations

import math

import pytest

from atwood import Scene, simulate
from atwood_library import Ground, Link, Pivot, PointMass, RotationalFriction

from .rows import ROWS
from .views import VIEWS, View


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("row", ROWS)
def test_a_scene_with_contacts_has_the_answer_that_is_known(row: str, view: str, form: str) -> None:
    for what, found, known in ROWS[row].check(VIEWS[view], form):
        assert found == pytest.approx(known, rel=0.0, abs=ROWS[row].off), what


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("row", "view"),
    [
        ("lossy gear", View(size=1e-6)),
        ("lossy gear", View(size=1e6)),
        ("cue ball", View(move=1e8)),
        ("rolling", View(move=1e8)),
        ("pendulum", View(size=1e6)),
        ("woodpecker", View(size=1e-5)),
        ("woodpecker", View(size=1e-6)),
    ],
)
def test_answers_are_the_same_far_away_and_in_units_that_are_far_from_one(row: str, view: View, form: str) -> None:
    """A gear at moments of 1e-12 kg m^2 stuck for ever; a start at 1e6 m was inside by rounding, and refused.

    Friction in a hinge of a link without mass was refused, since radians were weighed as metres. Of a woodpecker of
    1e-5 of its size the sleeve was held, since 1/kg was compared with 1/(kg m^2): it came down twice as often.
    """
    for what, found, known in ROWS[row].check(view, form):
        assert found == pytest.approx(known, rel=0.0, abs=ROWS[row].off), what


def test_what_sticks_stays_in_maximal_coordinates_also_where_it_is_long() -> None:
    """A pendulum of 10 km that friction holds crept by 6 mm in 50 s, at a torque that was 1e-5 off."""
    scene, size = Scene(), 1e4
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    link, bob = scene.add("link", Link(length=size, mass=0.0)), scene.add("bob", PointMass(mass=1.0))
    rub = scene.add("rub", RotationalFriction(sliding=f"{5.0 * size!r}", against="ground"))
    for one, other in (
        (ground.frame, pivot.a),
        (pivot.b, link.a),
        (link.b, bob.point),
        (pivot.shaft, rub.b),
    ):
        scene.connect(one, other)
    scene.start.update({"pivot.angle": 0.3 - 0.5 * math.pi, "pivot.angular_velocity": 0.0})
    result = simulate(scene, form="dae", t_end=50.0, rtol=1e-10, outputs=[0.0, 50.0])
    assert result["bob.position.x"][-1] == pytest.approx(size * math.sin(0.3), rel=1e-13)
    assert result["rub.torque"][-1] == pytest.approx(9.81 * size * math.sin(0.3), rel=1e-12)
