"""What starts at zero happens, when it comes back, at the time at which it is zero."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from atwood import (
    Component,
    Load,
    Point,
    Scalar,
    Scene,
    SolveError,
    Vector,
    connector,
    event,
    force,
    parameter,
    simulate,
)
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


class Booster(Component):
    """A force against a body, until its kinetic energy has fallen to a level; then the same until it is back there."""

    modes = ("fast", "slow", "through")

    level: float = parameter(1.0, unit="J", doc="Kinetic energy at which the modes change.")
    push: float = parameter(1.0, unit="N", doc="Force.")
    mass: float = parameter(1.0, unit="kg", doc="Mass of the body.")
    body: Point = connector(Point, "What it pushes.")

    def above(self) -> Scalar:
        """Return the kinetic energy above the level."""
        return 0.5 * self.mass * self.body.velocity.x**2 - self.level

    @force
    def load(self) -> Iterable[Load]:
        """Return the force."""
        yield Load(self.body, Vector(-self.push, 0.0, 0.0))

    @event(modes=("fast",), direction=-1, unit="J", target="slow", message="it is slow")
    def slows(self) -> Scalar:
        """Return the kinetic energy above the level."""
        return self.above()

    @event(modes=("slow",), direction=1, unit="J", target="through", message="it is back")
    def returns(self) -> Scalar:
        """Return the kinetic energy above the level."""
        return self.above()


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_what_is_small_is_so_by_the_sizes_of_the_scene(size: float) -> None:
    """In a scene of micrometres and picograms every energy is below 1e-20 J, and the events happen all the same."""
    mass, speed = size**3, np.sqrt(size)
    scene = Scene(gravity=0.0)
    booster = scene.add("booster", Booster(level=0.5 * mass * size, push=mass, mass=mass))
    body = scene.add("body", PointMass(mass=mass))
    scene.connect(booster.body, body.point)
    scene.start["body.position.x"], scene.start["body.velocity.x"] = size, 3.0 * speed
    result = simulate(scene, t_end=6.0 * speed, rtol=1e-8)
    assert [one.time / speed for one in result.events] == pytest.approx([2.0, 4.0], abs=1e-6)


class Bistable(Component):
    """A force against the motion that pushes a body out of either of its modes into the other one."""

    modes = ("forth", "back")

    body: Point = connector(Point, "What it pushes.")

    @force(modes=("forth",))
    def brakes(self) -> Iterable[Load]:
        """Return the force."""
        yield Load(self.body, Vector(-3.0, 0.0, 0.0))

    @force(modes=("back",))
    def drives(self) -> Iterable[Load]:
        """Return the force."""
        yield Load(self.body, Vector(3.0, 0.0, 0.0))

    @event(modes=("forth",), direction=-1, unit="m/s", target="back", message="it goes back")
    def turns_back(self) -> Scalar:
        """Return the speed."""
        return self.body.velocity.x

    @event(modes=("back",), direction=1, unit="m/s", target="forth", message="it goes forth")
    def turns_forth(self) -> Scalar:
        """Return the speed."""
        return self.body.velocity.x


def test_modes_that_push_each_other_out_end_the_run() -> None:
    """Between two changes the speed passes the margin, and nothing else happens: there would be millions of them."""
    scene = Scene(gravity=0.0)
    part, body = scene.add("part", Bistable()), scene.add("body", PointMass(mass=1.0))
    scene.connect(part.body, body.point)
    scene.start["body.velocity.x"] = 2.0
    with pytest.raises(SolveError, match="part changes its mode endlessly at t = 0\\.6666"):
        simulate(scene, t_end=2.0, rtol=1e-8, max_steps=20_000)
