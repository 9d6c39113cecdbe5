"""What starts at zero happens, when it comes back, at the time at which it is zero."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from atwood import Component, Load, Point, Scalar, Scene, Vector, connector, event, force, simulate
from atwood_library import PointMass

GRAVITY, PUSH = 9.81, 30.0


class Trampoline(Component):
    """A constant force upwards below z = -1 m."""

    modes = ("above", "below")

    ball: Point = connector(Point, "What it pushes.")

    def height(self) -> Scalar:
        """Return the height above the change."""
        return self.ball.position.z + 1.0

    @force(modes=("below",))
    def push(self) -> Iterable[Load]:
        """Return the force."""
        yield Load(self.ball, Vector(0.0, 0.0, PUSH))

    @event(modes=("above",), direction=-1, unit="m", target="below", message="it meets it")
    def meets(self) -> Scalar:
        """Return the height."""
        return self.height()

    @event(modes=("below",), direction=1, unit="m", target="above", message="it leaves it")
    def leaves(self) -> Scalar:
        """Return the height."""
        return self.height()


@pytest.mark.parametrize(("form", "solver"), [("reduced", "taylor"), ("reduced", "explicit"), ("dae", "ida")])
def test_bounces_are_not_late(form: str, solver: str) -> None:
    """Each event starts at zero in its mode, and comes back to it; the motion is made of parabolas."""
    scene = Scene()
    trampoline, ball = scene.add("trampoline", Trampoline()), scene.add("ball", PointMass(mass=1.0))
    scene.connect(trampoline.ball, ball.point)
    result = simulate(scene, form=form, solver=solver, t_end=10.0, rtol=1e-6)
    fall = np.sqrt(2.0 / GRAVITY)
    speed = GRAVITY * fall
    below, above = 2.0 * speed / (PUSH - GRAVITY), 2.0 * speed / GRAVITY
    times = fall + np.cumsum([0.0, *([below, above] * 7)])
    assert [one.time for one in result.events] == pytest.approx(times, abs=1e-7)
