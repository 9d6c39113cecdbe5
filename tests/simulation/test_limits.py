"""Limits of time hold everywhere: whoever works for long looks at the clock."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.calls import calls

from atwood import Result, Scene, assemble, clock as clock_module, exp, simulate, sweep
from atwood.clock import Clock, TimeIsUp, check_time, more_time, time_left, within_time
from atwood.errors import ResultError
from atwood.integrators import explicit_session, session
from atwood.integrators.ida import native as ida_native
from atwood.integrators.protocol import Budget, Status, StepResult
from atwood.simulation.initialization import mobility as massless_directions
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run import stall_diagnosis as run_tolerances
from atwood.simulation.run.session import SolverRequest
from atwood_library import Force, PointMass
from atwood_library.scenes import DoublePendulum, FourBar, FourBarRow, SimplePendulum

FORMS = ("reduced", "dae")


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A clock that goes on by a second whenever somebody looks at it."""
    count = [0]

    def perf_counter() -> float:
        count[0] += 1
        return float(count[0])

    for module in (clock_module, ida_native, explicit_session, session):
        monkeypatch.setattr(module, "time", SimpleNamespace(perf_counter=perf_counter))
    return count


@pytest.mark.parametrize("form", FORMS)
def test_a_limit_of_time_is_looked_at_all_along(form: str, looks: list[int]) -> None:
    scene = FourBarRow(windows=1)
    for _ in range(6):  # what pays is compiled from then on
        simulate(scene, form=form, t_end=20.0)
    before = looks[0]
    whole = simulate(scene, form=form, t_end=20.0, max_seconds=1e9)
    needed = looks[0] - before
    assert whole.status == "finished", whole.message
    assert len(whole.singular_crossings) > 10
    for share in (1e-9, 0.1, 0.3, 0.6, 0.8):
        before = looks[0]
        found = simulate(scene, form=form, t_end=20.0, max_seconds=share * needed)
        assert found.status == "time_limit"
        assert f"the limit of {share * needed:g} s was used up" in found.message
        assert looks[0] - before < share * needed + 0.05 * needed + 20
        if found.run.segments:
            count = np.searchsorted(found.time, whole.time[-1], side="right")
            np.testing.assert_array_equal(found.time[: count - 1], whole.time[: count - 1])


def test_what_is_asked_of_a_run_afterwards_is_beyond_its_time() -> None:
    """How large a scene is was asked within a time that was used up, and nobody took that up."""
    scene = Scene(space="line")
    mass, push = scene.add("mass", PointMass(mass=1.0)), scene.add("push", Force(direction="x"))
    scene.connect(push.point, mass.point)
    scene.set("push.value", lambda t: exp(1e-7 * t) / exp(1e-7 * t + (1e9 * t) ** 2))  # which takes short steps
    scene.start["mass.position.x"] = 1.0
    for _ in range(2):  # the second has its start from the first
        assert simulate(scene, t_end=5.0, max_seconds=0.3).status == "time_limit"


def test_a_crossing_is_left_when_the_time_is_used_up(looks: list[int]) -> None:
    assembly = assemble(FourBarRow(windows=10))
    whole = [simulate(assembly, t_end=2.0) for _ in range(6)][-1]  # what pays is compiled from then on
    assert len(whole.singular_crossings) == 2
    before = looks[0]
    with calls() as made:
        simulate(assembly, t_end=2.0)
    needed, crossing = looks[0] - before, made.count / 2
    for share in np.arange(0.1, 1.0, 0.1):
        end = looks[0] + share * needed
        with calls(after=lambda end=end: looks[0] > end) as late:
            result = simulate(assembly, max_seconds=share * needed, t_end=2.0)
        assert result.status == "time_limit"
        assert late.count < 0.3 * crossing  # what is done by then is put together


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_run_without_time_for_its_start_has_nothing_and_says_so(form: str) -> None:
    with calls() as made:
        result: Result = simulate(FourBarRow(windows=60), form=form, max_seconds=1e-9)
    assert made.count < 1_000_000  # the start makes six times as many
    assert result.status == "time_limit"
    assert "before the start was found" in result.message
    with pytest.raises(ResultError, match=r"there is nothing in it: the limit of 1e-09 s was used up.*more time"):
        _ = result.time


def test_what_has_inertia_everywhere_needs_no_singular_values(monkeypatch: pytest.MonkeyPatch) -> None:
    # those of rows of four-bars cannot be interrupted, and took longer than all else at their start
    def refuse(*_: object) -> None:
        raise AssertionError("what is free to move is looked for")

    monkeypatch.setattr(massless_directions, "open_directions", refuse)
    assert simulate(FourBarRow(windows=3), t_end=0.01).status == "finished"


def test_a_sweep_without_time_says_so_for_each_run() -> None:
    found = sweep(FourBarRow(windows=60), {"gravity": [9.0, 9.81]}, quantities=["crank[0].angle"], max_seconds=1e-9)
    assert found.status == ("time_limit", "time_limit")
    assert all("before the start was found" in one for one in found.messages.values())


def test_steps_are_counted_over_changes_of_the_solver_and_the_limit_is_said_as_asked_for() -> None:
    result = simulate(DoublePendulum(), max_steps=60, t_end=50.0)
    assert result.message.startswith("the limit of 60 steps was used up (at t = ")
    assert result.statistics.steps == 60


def test_what_cannot_look_at_the_clock_is_left_to_itself() -> None:
    release = threading.Event()
    with pytest.raises(TimeIsUp), Clock(0.02).kept():
        within_time(lambda: release.wait(10.0))
    release.set()
    with Clock(10.0).kept():
        assert within_time(lambda: 3) == 3
        with pytest.raises(ZeroDivisionError):
            within_time(lambda: 1 // 0)


def test_a_clock_is_kept_inside_its_block_alone() -> None:
    with Clock(-1.0).kept():
        with pytest.raises(TimeIsUp):
            check_time()
        with more_time():
            check_time()
            assert 0.0 < time_left() < 1.0
    check_time()
    with Clock(None).kept(), more_time():
        assert time_left() == float("inf")


@pytest.mark.parametrize(
    ("scene", "form", "rtol"),
    [(FourBarRow(windows=3), "reduced", 1e-13), (FourBar(), "dae", 1e-15)],
)
def test_a_tolerance_below_rounding_is_raised_to_one_that_does(scene: Scene, form: str, rtol: float) -> None:
    with pytest.warns(UserWarning, match=r"below what rounding allows here: 1e-1\d is taken instead"):
        result = simulate(scene, form=form, rtol=rtol, max_steps=50_000, t_end=1.0, solver="ida")
    assert result.status == "finished"
    assert rtol < result.run.options.relative_tolerance < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_a_tolerance_below_the_error_of_one_operation_is_raised_and_said(form: str) -> None:
    with pytest.warns(UserWarning, match="rtol = 1e-16 is below what rounding allows: 1e-15 is taken instead"):
        result = simulate(SimplePendulum(), form=form, rtol=1e-16, t_end=1.0, max_steps=50_000)
    assert result.status == "finished"
    assert result.run.options.relative_tolerance == 1e-15


def test_rounding_behind_a_singular_position_keeps_no_solver_from_going_on() -> None:
    # Newton's iteration failed right behind the first place: rounding is larger there than the tolerance allows
    result = simulate(FourBarRow(windows=2, space="space"), form="dae", rtol=1e-12, t_end=0.8, outputs=11, samples=1)
    assert result.status == "finished"
    assert [one.ways for one in result.singular_crossings] == [2]
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize(("came", "begins"), [(1e-9, 0.0), (0.5, 0.5)])
def test_larger_tolerances_are_tried_from_the_start_where_a_run_has_not_come_far(
    monkeypatch: pytest.MonkeyPatch, came: float, begins: float
) -> None:
    """A start that one tolerance lets go wrong is none for another; what fails later, for another cause, does."""
    asked: list[tuple[float, float]] = []

    def opened(request: Any, solver: str, t: float, y: Any, yp: Any) -> Any:
        asked.append((request.options.relative_tolerance, t))
        ends = t + (1e-8 if request.options.relative_tolerance < 5e-12 else 0.05)
        return SimpleNamespace(advance=lambda end: StepResult(ends, y, yp, Status.FAILED))

    monkeypatch.setattr(run_tolerances, "open_session", opened)
    flat = SimpleNamespace(flat=SimpleNamespace(name="scene"))
    y = np.zeros(1)
    options = RunOptions(t_end=1.0, relative_tolerance=1e-13)
    plan: Any = SimpleNamespace(assembly=flat)
    nothing: Any = None
    request = SolverRequest(plan, nothing, options, 1.0, Budget(), nothing)
    failed, start = (StepResult(t, y, y, Status.FAILED, message="no") for t in (came, 0.0))
    error = run_tolerances.too_tight(request, "ida", failed, start)
    assert error is not None
    assert getattr(error, "tolerance", None) == pytest.approx(1e-11)
    assert asked == [(pytest.approx(1e-12), begins), (pytest.approx(1e-11), begins)]
