"""Constraints between frames of one rigid body: they hold nothing, and change nothing."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, StartError, simulate
from atwood_library import Ground, Link, Pivot, Spherical, TorsionDamper, Weld


def bent(space: str, extra: str) -> Scene:
    """Return a pendulum of two links that are welded, and held together a second time."""
    scene = Scene(space=space, t_end=0.5)
    ground, pivot, one = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("one", Link(length=1.0))
    weld, two = scene.add("weld", Weld(angle=0.7)), scene.add("two", Link(length=0.5))
    for a, b in ((ground.frame, pivot.a), (pivot.b, one.a), (one.b, weld.a), (weld.b, two.a)):
        scene.connect(a, b)
    if extra == "ball":
        ball = scene.add("ball", Spherical())
        scene.connect(one.b, ball.a)
        scene.connect(two.a, ball.b)
    elif extra == "grounded ball":  # between two frames that never move
        ball, second = scene.add("ball", Spherical()), scene.add("second", Ground())
        scene.connect(ground.frame, ball.a)
        scene.connect(second.frame, ball.b)
    scene.start["pivot.angle"] = 0.3
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("extra", ["ball", "grounded ball"])
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_ball_between_two_frames_of_one_body_changes_nothing(space: str, extra: str, form: str) -> None:
    plain, held = (simulate(bent(space, one), form=form, rtol=1e-10, outputs=3) for one in ("", extra))
    for path in ("two.position.x", "two.position.z", "pivot.force.z", "weld.force.x"):
        np.testing.assert_allclose(held.array(path), plain.array(path), atol=1e-8)
    plans = [result.run.segments[0].plan for result in (plain, held)]
    moves = [len(plan.assembly.own_equations.speeds) - plan.finding.rank for plan in plans]
    assert moves == [1, 1]


def test_axes_that_point_against_each_other_are_said_to_be_the_reason() -> None:
    """The angle of twist between them has no value (0/0)."""
    scene = Scene(space="space", t_end=0.1)
    ground, ball, link = scene.add("ground", Ground()), scene.add("ball", Spherical()), scene.add("link", Link())
    turned, damper = scene.add("turned", Weld(angle="180 deg", axis=(1, 0, 0))), scene.add("damper", TorsionDamper())
    for a, b in ((ground.frame, ball.a), (ball.b, link.a), (ground.frame, turned.a), (turned.b, damper.a)):
        scene.connect(a, b)
    scene.connect(link.a, damper.b)
    with pytest.raises(StartError, match=r"damper: .*has no value") as refused:
        simulate(scene)
    assert "axes point against each other" in str(refused.value)
