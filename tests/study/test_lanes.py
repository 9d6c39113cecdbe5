"""Runs of a sweep side by side have the bits that each has alone, whatever the width, the order and the neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from atwood import Component, Point, Scalar, Scene, assemble, connector, event, parameter, sweep
from atwood.forms.assembly import Assembly
from atwood.integrators.batch import NOTICED
from atwood.integrators.lanes import LaneBatch
from atwood.study.sweeps import motions, waves
from atwood.study.sweeps.result import Sweep
from atwood_library.scenes import SCENES, DoublePendulum

from .test_sweep_events import ball

RUNS = 19

VARIED = {
    "double-pendulum": ("bob1.mass", 0.5, 2.0),
    "free-body": ("body.spin.y", 0.5, 2.9),
    "slider-crank": ("gravity", 5.0, 15.0),
    "charged-particle": ("particle.mass", 0.5, 2.0),
}


def made(assembly: Assembly, width: int, monkeypatch: pytest.MonkeyPatch, vary: Any, **more: Any) -> Sweep:
    """Make a sweep in one thread, with so many runs side by side; 1 is one after another."""
    for module in (motions, waves):
        monkeypatch.setattr(module, "lane_count", lambda: width if width > 1 else 10**9)
    given: dict[str, Any] = {"t_end": 1.0, "outputs": 12, "threads": 1, "combine": "list", "solver": "taylor", **more}
    return sweep(assembly, vary, **given)


def numbers(found: Sweep) -> np.ndarray[Any, Any]:
    """Return all that a sweep has found: quantities by run and time, and steps."""
    return np.array([*(found[path].tobytes() for path in found.paths), found.steps.tobytes()])


@pytest.mark.parametrize("solver", ["taylor", "explicit", "tsitouras", "auto"])
@pytest.mark.parametrize("name", VARIED)
def test_lanes_of_every_width_have_the_bits_of_runs_alone(
    name: str, solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly = assemble(SCENES[name]())
    path, low, high = VARIED[name]
    column = {path: np.random.default_rng(1).uniform(low, high, RUNS)}
    vary: Any = column
    more: dict[str, Any] = {"solver": solver}
    if path in assembly.flat.start:
        vary, more["start"] = None, column
    alone = made(assembly, 1, monkeypatch, vary, **more)
    assert not alone.failed
    assert alone.statistics.batched == RUNS
    for width in (2, 4, 8):
        wide = made(assembly, width, monkeypatch, vary, **more)
        assert wide.statistics.batched == RUNS
        assert np.array_equal(numbers(wide), numbers(alone))


def test_neighbours_and_the_order_of_the_queue_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    assembly = assemble(SCENES["double-pendulum"]())
    angles = np.random.default_rng(2).uniform(-2.5, 2.5, RUNS)
    order = np.random.default_rng(3).permutation(RUNS)
    first = made(assembly, 4, monkeypatch, None, start={"rod1.angle": angles})
    other = made(assembly, 4, monkeypatch, None, start={"rod1.angle": angles[order]})
    for path in first.paths:
        assert np.array_equal(first[path][order], other[path])
    assert np.array_equal(first.steps[order], other.steps)
    assert len(set(first.steps.tolist())) > 3


@pytest.mark.parametrize("solver", ["taylor", "explicit"])
def test_a_run_that_ends_early_does_so_in_a_lane(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assembly = assemble(SCENES["double-pendulum"]())
    start = {"rod1.angle": np.linspace(0.1, 3.0, RUNS)}
    steps = made(assembly, 1, monkeypatch, None, start=start, solver=solver).steps
    limit = int(np.median(steps))
    alone, wide = (
        made(assembly, one, monkeypatch, None, start=start, solver=solver, max_steps=limit) for one in (1, 8)
    )
    assert 0 < len(wide.failed) < RUNS
    assert wide.status == alone.status
    assert wide.messages == alone.messages
    assert np.array_equal(numbers(wide), numbers(alone))


@pytest.mark.parametrize("solver", ["taylor", "explicit"])
def test_a_run_that_fails_fails_as_alone(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that fall into the centre, among others that do not."""
    assembly = assemble(SCENES["kepler"]())
    speeds = np.linspace(0.8, 1.7, RUNS)
    speeds[::6] = 0.0
    start = {"body.velocity.z": speeds}
    alone, wide = (made(assembly, one, monkeypatch, None, start=start, solver=solver) for one in (1, 4))
    assert wide.failed == alone.failed == tuple(range(0, RUNS, 6))
    assert wide.messages == alone.messages
    assert np.array_equal(numbers(wide), numbers(alone))


def test_fewer_runs_than_lanes_and_what_judges_steps_go_one_after_another(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[int] = []
    kept = motions.open_lanes

    def noted(*given: Any) -> Any:
        found = kept(*given)
        opened.append(0 if found is None else found.lanes)
        return found

    monkeypatch.setattr("atwood.study.sweeps.batch.open_lanes", noted)
    assembly = assemble(SCENES["double-pendulum"]())
    for count, lanes in ((7, 0), (8, 8)):
        found = made(assembly, 8, monkeypatch, {"gravity": np.linspace(5.0, 15.0, count)})
        assert found.statistics.batched == count
        assert opened.pop() == lanes


class Wall(Component):
    """The run ends where a point passes it."""

    place: float = parameter(1.0, unit="m", doc="Where it stands.")
    point: Point = connector(Point, "What may pass it.")

    @event(direction=1, unit="m", target="stop", message="it is past the wall")
    def passes(self) -> Scalar:
        """Return how far the point is behind it."""
        return self.point.position.x - self.place


def before_a_wall(place: float) -> Scene:
    scene = DoublePendulum()
    wall = scene.add("wall", Wall(place=place))
    scene.connect(scene["bob2"].point, wall.point)
    scene.start["rod2.angle"] = 0.0
    return scene


WATCHED: dict[str, tuple[Any, dict[str, Any]]] = {
    "never met": (lambda: before_a_wall(50.0), {"start": {"rod1.angle": (-2.5, 2.5)}}),
    "met by some": (lambda: before_a_wall(1.3), {"start": {"rod1.angle": (-1.5, 0.3)}, "outputs": 40}),
    "again and again": (ball, {"start": {"ball.position.z": (0.01, 1.0)}}),
    "ends alone": (ball, {"start": {"ball.velocity.z": (-2.0, 9.0)}, "outputs": None}),
}


@pytest.mark.parametrize("name", WATCHED)
def test_runs_that_are_watched_leave_their_lanes_where_something_happens(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, more = WATCHED[name]
    (path, (low, high)), *_ = more["start"].items()
    assembly, given = assemble(scene()), {"t_end": 2.0, "solver": "explicit", **more}
    given["start"] = {path: np.random.default_rng(4).uniform(low, high, 4 * RUNS)}
    codes: list[int] = []
    kept = LaneBatch.advance

    def noted(self: LaneBatch) -> bool:
        is_done = kept(self)
        codes.extend(self.codes.tolist() if is_done else ())
        return is_done

    monkeypatch.setattr(LaneBatch, "advance", noted)
    alone = made(assembly, 1, monkeypatch, None, **given)
    assert not codes
    assert not alone.failed
    for width in (2, 8):
        wide = made(assembly, width, monkeypatch, None, **given)
        assert wide.statistics.batched == alone.statistics.batched == 4 * RUNS
        assert np.array_equal(numbers(wide), numbers(alone))
        assert (wide.status, wide.messages) == (alone.status, alone.messages)
        assert np.array_equal(wide.end_time, alone.end_time)
    assert set(codes) == ({0} if name == "never met" else {0, NOTICED})
