"""Sweeps over scenes with events, many runs at a time: the same answers as runs one by one."""

import math
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood import Component, Point, Scalar, Scene, connector, event, parameter, potential, simulate, sweep
from atwood.study.sweeps import batch as sweep_batch
from atwood_library import Mass1D, PointMass, TranslationalGap
from atwood_library.scenes import DoublePendulum, FreeBody

from ..helpers.latches import Latch
from ..helpers.mechanisms import pendulum_on_a_string
from ..helpers.runs import free_scene
from ..helpers.tethers import Tether
from .test_sweep import assert_same, one_by_one


class Floor(Component):
    """An elastic floor at z = 0, and a ceiling that ends the run."""

    modes = ("apart", "touching")

    stiffness: float = parameter(1e4, unit="N/m", above=0.0, doc="Force for each metre that it is pressed in.")
    ceiling: float = parameter(3.0, unit="m", above=0.0, doc="Where the run ends.")
    ball: Point = connector(Point, "What falls on it.")

    @potential(modes=("touching",))
    def pressed(self) -> Scalar:
        """Return the energy of the floor."""
        return 0.5 * self.stiffness * self.ball.position.z * self.ball.position.z

    @event(modes=("apart",), direction=-1, unit="m", target="touching", message="it touches")
    def touches(self) -> Scalar:
        """Return the height."""
        return self.ball.position.z

    @event(modes=("touching",), direction=1, unit="m", target="apart", message="it lets go")
    def lets_go(self) -> Scalar:
        """Return the height."""
        return self.ball.position.z

    @event(direction=1, unit="m", target="stop", message="it flies away")
    def flies_away(self) -> Scalar:
        """Return how far it is above the ceiling."""
        return self.ball.position.z - self.ceiling


def ball() -> Scene:
    scene = Scene(t_end=2.0)
    mass, floor = scene.add("ball", PointMass(mass=1.0)), scene.add("floor", Floor())
    scene.connect(mass.point, floor.ball)
    scene.start.update({"ball.position.x": 0.0, "ball.position.z": 1.0, "ball.velocity.x": 0.3, "ball.velocity.z": 0.0})
    return scene


def between_stops() -> Scene:
    scene = Scene(t_end=2.0, gravity=0.0)
    mass = scene.add("mass", Mass1D(mass=1.0))
    gap = scene.add("gap", TranslationalGap(against="ground", lower=-0.2, upper=0.3, stiffness=4e3))
    scene.connect(mass.slide, gap.b)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 1.0})
    return scene


def damped_stops() -> Scene:
    scene = between_stops()
    scene["gap"].damping = 3.0
    return scene


def latched() -> Scene:
    scene = free_scene(t_end=1.0)
    one, two, hook = (
        scene.add("one", PointMass(mass=1.0)),
        scene.add("two", PointMass(mass=3.0)),
        scene.add("l", Latch()),
    )
    scene.connect(hook.a, two.point)
    scene.connect(hook.b, one.point)
    scene.start.update({"one.position.x": -1.0, "one.velocity.x": 2.0, "one.velocity.z": 0.3})
    scene.start.update({"two.position.x": 0.0, "two.velocity.x": 0.0})
    return scene


HEIGHTS = [0.4, 0.7, 1.0, 1.3]
CASES: dict[str, tuple[Callable[[], Scene], dict[str, Any]]] = {
    "heights": (ball, {"start": {"ball.position.z": HEIGHTS}}),
    "outputs": (ball, {"start": {"ball.position.z": HEIGHTS}, "outputs": 23, "quantities": ["ball"]}),
    "stiffness": (ball, {"vary": {"floor.stiffness": [1e3, 1e4, 1e5]}, "outputs": 5}),
    "masses": (
        ball,
        {"vary": {"ball.mass": [0.5, 3.0]}, "start": {"ball.position.z": [0.5, 0.8]}, "solver": "explicit"},
    ),
    "stopped": (ball, {"start": {"ball.velocity.z": [0.0, 2.0, 5.0]}, "vary": {"floor.ceiling": [1.1]}, "outputs": 9}),
    "stopped at the end": (ball, {"start": {"ball.velocity.z": [0.0, 2.0, 5.0]}, "vary": {"floor.ceiling": [1.1]}}),
    "stops": (between_stops, {"start": {"mass.speed": [0.5, 1.0, 3.0]}, "outputs": 11}),
    "other coordinates": (latched, {"start": {"one.velocity.x": [1.5, 2.0, 3.0]}, "outputs": 5}),
    "damped": (damped_stops, {"start": {"mass.speed": [0.5, 1.0, 3.0]}, "outputs": 11}),
    "until": (ball, {"start": {"ball.velocity.z": [0.0, 2.0, 5.0]}, "until": "ball.position.x rises above 0.5"}),
    "until one of two": (
        DoublePendulum,
        {
            "start": {"rod1.angle": [0.5, 1.0, 3.0]},
            "until": ["rod1.angle crosses 0", lambda q: q["bob2.velocity.x"] > 2.5],
            "outputs": 23,
            "t_end": 3.0,
        },
    ),
    "until never": (DoublePendulum, {"start": {"rod1.angle": [0.5, 1.0]}, "until": "rod1.tension rises above 1e6"}),
    "nothing happens": (between_stops, {"start": {"mass.speed": [0.01, 0.02]}}),
}


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", CASES)
def test_many_at_a_time_is_one_by_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, given = CASES[name]
    found = sweep(scene(), threads=1, **given)
    single = one_by_one(monkeypatch, scene(), threads=1, **given)
    assert found.status == single.status
    assert found.messages == single.messages
    if name in ("stops", "damped"):  # the force of a stop compares what moves: such runs are made one by one
        assert found.statistics.batched == 0
        return
    assert_same(found, single, 1e-10)


def test_an_angle_within_one_turn_is_met_one_by_one() -> None:
    spins = {"body.spin.y": [0.5, 1.0]}
    found = sweep(FreeBody(), start=spins, until="body.spin.x falls below 0.5", t_end=2.0, threads=1)
    assert found.statistics.batched == 2
    found = sweep(FreeBody(), start=spins, until="body.psi crosses 10 deg", t_end=2.0, threads=1)
    assert found.statistics.batched == 0
    assert "one turn" in found.statistics.why_single


def test_each_run_is_that_of_simulate() -> None:
    found = sweep(ball(), start={"ball.position.z": HEIGHTS}, outputs=9)
    assert found.statistics.batched == len(HEIGHTS)
    for run, height in enumerate(HEIGHTS):
        scene = ball()
        scene.start["ball.position.z"] = height
        alone = simulate(scene, outputs=9)
        assert len(alone.events) >= 3
        shown = np.searchsorted(alone.time, found.time, side="right") - 1
        assert_allclose(found["ball.position.z"][run], alone["ball.position.z"][shown], atol=1e-12)
        assert found.steps[run] == alone.statistics.steps


def test_a_ball_comes_back_to_its_height() -> None:
    """An elastic floor gives back all energy: ``m g (z - h) = k d^2/2`` at the lowest place, and z is h once more."""
    period = [2.0 * math.sqrt(2.0 * h / 9.81) + _contact(h) for h in HEIGHTS]
    for height, t in zip(HEIGHTS, period, strict=True):
        found = sweep(ball(), start={"ball.position.z": [height]}, t_end=t, rtol=1e-10, solver="explicit")
        assert found.statistics.batched == 1
        assert_allclose(found["ball.position.z"], height, rtol=3e-8)
        assert_allclose(found["ball.position.x"], 0.3 * t, rtol=1e-9)


def _contact(height: float, stiffness: float = 1e4) -> float:
    """Return how long 1 kg that falls from a height is in contact."""
    w, speed = math.sqrt(stiffness), math.sqrt(2.0 * 9.81 * height)
    return 2.0 * (math.pi - math.atan2(speed * w, 9.81)) / w


def test_threads_change_nothing() -> None:
    options = {"start": {"ball.position.z": np.linspace(0.4, 1.4, 9)}, "outputs": 5}
    alone, together = (sweep(ball(), **options, threads=n) for n in (1, 3))
    assert alone.statistics.batched == together.statistics.batched == 9
    for path in alone.paths:
        assert_array_equal(alone[path], together[path])


def test_what_needs_more_is_made_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """A string that comes taut keeps a constraint: those runs that get there are made one by one."""
    scene = pendulum_on_a_string(t_end=0.6, rope=Tether(starts="slack"))
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.1, "bob.velocity.x": 0.0})
    options = {"start": {"bob.velocity.z": [0.0, 3.0, -6.0]}, "threads": 1}
    found, single = sweep(scene, **options), one_by_one(monkeypatch, scene, **options)
    assert 0 < found.statistics.batched < 3
    assert found.status == single.status
    for path in single.paths:
        assert_allclose(found[path], single[path], rtol=1e-10, atol=1e-10)


def test_it_can_be_stopped() -> None:
    """The event that Ctrl-C sets ends the work between two stretches."""
    stop = threading.Event()
    stop.set()
    request = []
    original = sweep_batch.Waves

    class Seen(original):  # type: ignore[misc, valid-type]
        def work(self, runs: Any, _: threading.Event) -> int:
            request.append(super().work(runs, stop))
            return request[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep_batch, "Waves", Seen)
        found = sweep(ball(), start={"ball.position.z": HEIGHTS}, threads=1)
    assert request
    assert set(request) == {0}
    assert found.statistics.batched == 0  # and were made one by one after all
    assert set(found.status) == {"finished"}


def test_stops_have_the_bits_of_single_runs() -> None:
    """Accelerations at the start are worked out in another way for many runs; times of stops do not tell."""
    first, second, mass = np.linspace(0.3, 2.0, 12), np.linspace(0.5, 1.0, 12), np.linspace(0.5, 2.0, 12)
    options: dict[str, Any] = {"t_end": 3.0, "until": "rod1.angle crosses 0"}
    start = {"rod1.angle": first, "rod2.angle": second}
    found = sweep(DoublePendulum(), {"mass2": mass}, start=start, combine="list", **options)
    for run in range(12):
        scene = DoublePendulum(mass2=float(mass[run]))
        scene.start.update({"rod1.angle": float(first[run]), "rod2.angle": float(second[run])})
        alone = simulate(scene, **options)
        assert found.end_time[run] == alone.time[-1]
        assert found["rod2.angle"][run, -1] == alone["rod2.angle"][-1]
