"""A run that stops at sample times or time events opens one session of an explicit method and begins it again."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from numpy.testing import assert_array_equal
from tests.calls import calls

from atwood import Model, Scene, assemble, select, simulate, sin
from atwood.integrators.embedded.stepper import CompiledStepper
from atwood.integrators.explicit_session import ExplicitSession
from atwood.simulation.run.run import Walk
from atwood.simulation.run.session import KeptSession
from atwood_library import Force, Ground, PointMass, Rod
from atwood_library.scenes import CartPole, FourBar, Kepler, ScottRussellLift, SliderCrank

from ...helpers.runs import FORMS


def switched() -> Scene:
    """A pendulum whose bob is pushed to and fro by the clock."""
    scene = Scene(t_end=1.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    push = scene.add("push", Force(direction=(1.0, 0.0, 0.0), value=lambda t: select(sin(60.0 * t) > 0.0, 3.0, -1.0)))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(push.point, bob.point)
    scene.start.update({"rod.angle": 0.3, "rod.angular_velocity": 0.0})
    return scene


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of steppers that were made, as the length of a list."""
    made: list[int] = []
    first = CompiledStepper.__init__

    def counted(self: CompiledStepper, *given: object) -> None:
        made.append(1)
        first(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(CompiledStepper, "__init__", counted)
    return made


@pytest.mark.parametrize(("make", "segments"), [(CartPole, 50), (switched, 20)])
def test_one_session_serves_all_segments_of_a_run(
    make: Callable[[], Model], segments: int, opened: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = assemble(make())
    monkeypatch.setattr(Walk, "passes_moments", False)
    kept = simulate(scene, t_end=1.0, solver="explicit")
    assert len(opened) == 1
    opened.clear()
    monkeypatch.setattr(KeptSession, "begin_again", lambda *_: None)
    anew = simulate(scene, t_end=1.0, solver="explicit")
    assert len(opened) >= segments
    for path, values in anew.table().items():
        assert_array_equal(kept[path], values, err_msg=path)
    ours, theirs = (
        {name: getattr(one.statistics, name) for name in type(one.statistics).__annotations__ if name != "seconds"}
        for one in (kept, anew)
    )
    assert ours == theirs


def test_a_run_with_events_begins_its_session_again_for_each_segment(opened: list[int]) -> None:
    """Compiled events have parameters of their own, which are filled in anew."""
    scene = CartPole()
    plain = simulate(scene, t_end=0.4, solver="explicit")
    opened.clear()
    watched = simulate(scene, t_end=0.4, solver="explicit", record="rail.displacement crosses 1 mm")
    assert len(opened) == 1
    for path in ("hinge.angle", "push.force"):
        assert_array_equal(watched[path][-1], plain[path][-1])


def test_a_kept_session_belongs_to_one_run() -> None:
    """Runs of one assembly at the same time, and of others in between, are those of each alone."""
    scenes = [assemble(CartPole(lean=lean)) for lean in (0.2, 0.1)]
    scenes.append(scenes[0].with_values({"lean": 0.15}))
    alone = [simulate(one, t_end=0.5)["hinge.angle"] for one in scenes]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(lambda k: simulate(scenes[k % 3], t_end=0.5)["hinge.angle"], range(6)))
    for k, found in enumerate(together):
        assert_array_equal(found, alone[k % 3])


def test_an_update_that_raises_leaves_nothing_behind() -> None:
    scene = assemble(CartPole())
    expected = simulate(scene, t_end=0.5)["hinge.angle"]

    def stop(t: float) -> None:
        if t > 0.2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        simulate(scene, t_end=0.5, progress=stop)
    assert_array_equal(simulate(scene, t_end=0.5)["hinge.angle"], expected)


@pytest.mark.parametrize("make", [FourBar, SliderCrank, Kepler])
@pytest.mark.parametrize("solver", ["taylor", "explicit"])
def test_the_next_run_goes_on_with_formulas_of_loops_and_judged_steps(
    make: Callable[[], Model], solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gives the bits of a run that begins anew, also where it is longer, and where others came between."""
    made: list[float] = []
    first = ExplicitSession.__init__

    def counted(self: ExplicitSession, *given: object, **named: object) -> None:
        made.append(1)
        first(self, *given, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(ExplicitSession, "__init__", counted)
    scene = assemble(make())
    found = [simulate(scene, t_end=end, solver=solver, outputs=11) for end in (0.3, 0.3, 0.7, 0.3)]
    assert len(made) == 3  # of another length, and then anew
    for one, end in zip(found, (0.3, 0.3, 0.7, 0.3), strict=True):
        anew = simulate(assemble(make()), t_end=end, solver=solver, outputs=11)
        for path, values in anew.table().items():
            assert_array_equal(one[path], values, err_msg=path)
        assert one.statistics.steps == anew.statistics.steps


@pytest.mark.parametrize("solver", ["explicit", "taylor"])
def test_loops_that_look_out_for_dead_centres_begin_their_session_again(solver: str, opened: list[int]) -> None:
    assembly = assemble(ScottRussellLift())
    first = simulate(assembly, outputs=21, solver=solver)
    opened.clear()
    again = simulate(assembly, outputs=21, solver=solver)
    assert not opened
    alone = simulate(assemble(ScottRussellLift()), outputs=21, solver=solver)
    assert first.run.statistics.event_evaluations
    for path, values in first.table().items():
        assert_array_equal(again[path], values, err_msg=path)
        assert_array_equal(alone[path], values, err_msg=path)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("solver", ["taylor", "ida"])
def test_time_events_between_runs_of_other_values_leave_nothing_behind(form: str, solver: str) -> None:
    """Recurrences and starts are those of the relations and parameters of each stretch."""
    kept = assemble(switched(), form=form)
    heavy = kept.with_values({"bob.mass": 3.0})
    for end, mass in ((0.3, None), (0.3, 3.0), (0.1, None), (0.3, None), (0.2, 3.0), (0.3, 3.0)):
        fresh = assemble(switched(), form=form)
        fresh = fresh if mass is None else fresh.with_values({"bob.mass": mass})
        found, anew = (simulate(one, t_end=end, solver=solver) for one in (heavy if mass else kept, fresh))
        assert_array_equal(found["rod.angle"], anew["rod.angle"])
        assert found.statistics.steps == anew.statistics.steps


@pytest.mark.parametrize(("form", "most"), [("reduced", 280), ("dae", 345)])
def test_a_time_event_under_series_makes_few_calls(form: str, most: int) -> None:
    """The session is begun again: opened anew there are a third more, and in the dae form two thirds."""
    assembly = assemble(switched(), form=form)
    for _ in range(4):
        simulate(assembly, solver="taylor")
    with calls() as made:
        events = len(simulate(assembly, solver="taylor").run.segments)
    assert made.count < most * events
