"""Singular positions that steps pass by themselves, in machine code: as Python passes them, and told alike."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from atwood import Scene, simulate
from atwood.simulation.singular import passing
from atwood.simulation.singular.collocation import points
from atwood.simulation.singular.crossing_routine import POINTS, sign_change
from atwood.simulation.singular.monitor import SingularityMonitor
from atwood.simulation.singular.passing import PassedCrossing
from atwood_library import Ground, Link, Pivot
from atwood_library.scenes import FourBar, FourBarRow, ScottRussellLift

from ...helpers.runs import FORMS
from ...references.pendulum import FourBarRow as ExactRow


def parallelograms(angles: tuple[float, ...], rates: tuple[float, ...], size: float = 1.0, tilt: float = 0.0) -> Scene:
    """Return parallelograms side by side that have nothing to do with each other, of a size, all on a tilted line."""
    scene, along = Scene(t_end=1.0), np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    for n, (angle, rate) in enumerate(zip(angles, rates, strict=True)):
        ends = [
            scene.add(f"{name}{n}", Ground(position=tuple(size * x * along))) for name, x in (("a", n), ("b", n + 2))
        ]
        crank, coupler, rocker = (
            scene.add(f"{name}{n}", Link(length=size * length, mass=length))
            for name, length in (("crank", 1.0), ("coupler", 2.0), ("rocker", 1.0))
        )
        joined = ((ends[0].frame, crank.a), (crank.b, coupler.a), (coupler.b, rocker.b), (rocker.a, ends[1].frame))
        for i, (one, other) in enumerate(joined):
            pin = scene.add(f"pin{n}{i}", Pivot())
            scene.connect(one, pin.a)
            scene.connect(pin.b, other)
        scene.start.update({f"crank{n}.angle": angle + tilt, f"crank{n}.angular_velocity": rate})
        scene.guess.update({f"coupler{n}.angle": tilt, f"rocker{n}.angle": angle + tilt})
    return scene


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """When Python was asked to look within a run."""
    times, look = list[float](), SingularityMonitor.look

    def looking(self: SingularityMonitor, step_result: Any, between: bool, at_end: bool) -> Any:
        times.extend([step_result.t] if between else [])
        return look(self, step_result, between, at_end)

    monkeypatch.setattr(SingularityMonitor, "look", looking)
    return times


def crossings(result: Any) -> list[Any]:
    return sorted(result.singular_crossings, key=lambda one: one.time)


@pytest.mark.parametrize("form", FORMS)
def test_a_row_passes_its_places_without_python(form: str, asked: list[float]) -> None:
    result = simulate(FourBarRow(windows=1), form=form, t_end=10.0, rtol=1e-9, outputs=2001)
    assert asked == []
    made = [isinstance(one, PassedCrossing) for one in crossings(result)]
    assert sum(made) == len(made) - (form == "reduced")  # formulas end at the first of them
    assert len(made) == 10
    angle = 0.5 * np.pi - result["foot[0].angle"]
    assert np.max(np.abs(angle - ExactRow(1).crank_angle(result.time))) < 1e-6
    assert len(result.time) == 2001
    assert result.energy.max_drift < 1e-7
    passed = [ExactRow(1).crank_angle(np.array([one.time]))[0] / (0.5 * np.pi) for one in crossings(result)]
    assert np.allclose(passed, [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0, 17.0, 19.0], atol=1e-6)


def test_a_way_out_of_a_place_is_none_into_another(asked: list[float]) -> None:
    """Behind some places of the lift little is left of what constraints are, but it rises."""
    result = simulate(ScottRussellLift(), form="dae", t_end=4.0)
    assert asked == []
    assert [isinstance(one, PassedCrossing) for one in result.singular_crossings] == [True] * 9
    arcs = [len(one.arcs) for one in result.singular_crossings]
    assert max(arcs) > 1  # where one is not accurate
    assert sum(arcs) <= 23  # 26 with arcs over half of the way each


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("make", "end"),
    [(lambda: FourBarRow(windows=2), 3.0), (ScottRussellLift, 2.0), (lambda: parallelograms((1.0,), (6.0,)), 2.0)],
)
def test_python_passes_them_alike(
    make: Callable[[], Scene], end: float, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = simulate(make(), form=form, t_end=end, rtol=1e-9)
    assert any(isinstance(one, PassedCrossing) for one in own.singular_crossings)
    monkeypatch.setattr(SingularityMonitor, "pass_in_steps", lambda *_: None)
    plain = simulate(make(), form=form, t_end=end, rtol=1e-9)
    assert not any(isinstance(one, PassedCrossing) for one in plain.singular_crossings)
    for one, other in zip(crossings(own), crossings(plain), strict=True):
        assert one.time == pytest.approx(other.time, abs=3e-8)
        assert (one.ways, one.constraints, one.parts) == (other.ways, other.constraints, other.parts)
        assert one.gap == pytest.approx(other.gap, abs=1e-11)
        assert one.describe()[20:].split(" (")[0] == other.describe()[20:].split(" (")[0]
    for path in ("angle", "angular_velocity"):
        for name in (one for one in own.paths if one.endswith(path)):
            scale = 1.0 + np.max(np.abs(plain[name]))
            assert np.max(np.abs(own[name] - plain[name])) < 1e-6 * scale


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("size", "tilt"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 0.7)])
def test_size_and_direction_change_nothing(size: float, tilt: float, form: str) -> None:
    scene, plain = parallelograms((1.0,), (6.0,), size, tilt), parallelograms((1.0,), (6.0,))
    for one in (scene, plain):
        one.gravity = 0.0
    result, expected = (simulate(one, form=form, t_end=1.5, rtol=1e-9) for one in (scene, plain))
    assert len(result.singular_crossings) == len(expected.singular_crossings) > 1
    assert any(isinstance(one, PassedCrossing) for one in result.singular_crossings)
    assert len(result.time) == len(expected.time) == 201  # also where a way begins at an output
    assert np.max(np.abs(result["coupler0.angle"] - tilt)) < 1e-9
    assert np.max(np.abs(result["crank0.angle"] - tilt - expected["crank0.angle"])) < 1e-7


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("apart", "slower"), [(0.0, 1.0), (1e-6, 1.0), (0.03, 1.0), (0.0, 3.0)])
def test_two_mechanisms_stay_on_their_ways(apart: float, slower: float, form: str) -> None:
    scene = parallelograms((1.0, 1.0 + apart), (6.0, 6.0 / slower))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what comes too close to tell is told
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-8)
    assert result.status == "finished"
    for n in (0, 1):
        assert np.max(np.abs(result[f"coupler{n}.angle"])) < 1e-9
        assert np.max(np.abs(result[f"crank{n}.angle"] - result[f"rocker{n}.angle"])) < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_each_place_of_two_mechanisms_is_told(form: str) -> None:
    result = simulate(parallelograms((1.0, 1.0), (6.0, 2.0)), form=form, t_end=3.0, rtol=1e-8)
    turns = [result[f"crank{n}.angle"][-1] / np.pi for n in (0, 1)]
    passed = sum(int(abs(one)) for one in turns)
    assert passed == len(result.singular_crossings) == 9
    assert {one.ways for one in result.singular_crossings} == {1}
    named = [sorted(one.parts)[0][-2] for one in crossings(result)]
    assert sorted(map(int, {*named})) == [0, 1]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("longer", [1e-3, 1e-5, 1e-7])
def test_a_near_miss_is_left_to_python(longer: float, form: str) -> None:
    scene = FourBar(crank_length=1.0, coupler_length=2.0 * (1.0 + longer), rocker_length=1.0, frame_length=2.0)
    scene.start.update({"crank.angle": 1.0, "crank.angular_velocity": 6.0})
    scene.guess.update({"coupler.angle": 0.0, "rocker.angle": 1.0})
    result = simulate(scene, form=form, t_end=0.6, rtol=1e-8)
    assert not any(isinstance(one, PassedCrossing) for one in result.run.singular_crossings)
    assert np.max(np.abs(result["coupler.angle"])) > 0.1  # it turns from one way to move into the other


@pytest.mark.parametrize("form", FORMS)
def test_what_has_no_room_any_more_is_passed_by_python(
    form: str, asked: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = simulate(FourBarRow(windows=1), form=form, t_end=10.0, rtol=1e-9)
    monkeypatch.setattr(passing, "_MOST", 2)
    result = simulate(FourBarRow(windows=1), form=form, t_end=10.0, rtol=1e-9)
    assert len(asked) == 3
    times = [[one.time for one in crossings(run)] for run in (whole, result)]
    assert times[0] == pytest.approx(times[1], abs=1e-7)
    assert np.max(np.abs(whole["foot[0].angle"] - result["foot[0].angle"])) < 1e-6


def test_what_stops_a_run_and_what_is_told_on_the_way_lose_nothing() -> None:
    told = list[float]()
    usual = simulate(FourBarRow(windows=1), form="dae", t_end=3.0, outputs=301)
    result = simulate(FourBarRow(windows=1), form="dae", t_end=3.0, outputs=301, progress=told.append)
    assert np.max(np.abs(usual["foot[0].angle"] - result["foot[0].angle"])) < 1e-9
    assert told[-1] == 3.0
    assert usual.statistics.reinitializations == 3
    for most in range(20, usual.statistics.steps, 7):
        stopped = simulate(FourBarRow(windows=1), form="dae", t_end=3.0, outputs=301, max_steps=most)
        assert stopped.status == "step_limit"
        shared = np.isin(stopped.time, usual.time)
        known = usual["foot[0].angle"][np.isin(usual.time, stopped.time)]
        assert np.max(np.abs(stopped["foot[0].angle"][shared] - known)) < 1e-7
        assert np.all(np.diff(stopped.time) > 0.0)
    short = simulate(FourBarRow(windows=1), form="dae", t_end=usual.singular_crossings[1].time + 1e-4)
    assert 1 <= len(short.singular_crossings) <= 2
    again = pickle.loads(pickle.dumps(usual.singular_crossings[0].path))
    assert again.end == usual.singular_crossings[0].path.end


def test_a_measure_that_falls_to_zero_and_rises_again_changes_its_sign() -> None:
    x, series, _ = points()
    assert len(x) == POINTS
    for root in (-0.7, -0.1, 0.0, 0.25, 0.8):
        away = np.abs((x - root) * (2.0 + x))
        assert sign_change(away, x, series) == pytest.approx(root, abs=1e-14)
    assert sign_change(x + 2.0, x, series) is None
    assert sign_change(np.where(x > 0.0, np.nan, np.abs(x)), x, series) is None
