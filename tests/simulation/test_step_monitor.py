"""Looking out for singular positions while IDA goes on, compiled: the same looks, at next to no cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from atwood import assemble, simulate
from atwood.codegen.python.backend import BoundKernel
from atwood.codegen.sundials.step_monitor import MonitorData, slope_lists
from atwood.integrators.ida import library as sundials_library
from atwood.numerics.matrices import to_array
from atwood.simulation.singular.branches import Sample
from atwood.simulation.singular.crossing import RankMeasure
from atwood.simulation.singular.monitor import SingularityMonitor
from atwood_library.scenes import Bricard, FourBar, FourBarRow, ScottRussellLift, SliderCrank, Strandbeest

from ..helpers.runs import FORMS

pytestmark = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")


def fast_slider_crank() -> SliderCrank:
    scene = SliderCrank(crank_length=0.15, rod_length=0.35)
    scene.start.update({"crank.angular_velocity": 30.0})
    return scene


@pytest.fixture
def guards(monkeypatch: pytest.MonkeyPatch) -> list[SingularityMonitor]:
    """Every guard of the runs that follow."""
    made: list[SingularityMonitor] = []
    begin = SingularityMonitor.__init__

    def noted(self: SingularityMonitor, *arguments: Any) -> None:
        begin(self, *arguments)
        made.append(self)

    monkeypatch.setattr(SingularityMonitor, "__init__", noted)
    return made


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "scene", [fast_slider_crank(), FourBar(), Bricard()], ids=["slider-crank", "four-bar", "bricard"]
)
def test_where_nothing_is_near_nothing_is_asked_in_python(
    scene: Any, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, calls, looks = [False], [0], [0]
    call, look = BoundKernel.__call__, SingularityMonitor.look

    def counted(self: BoundKernel, *groups: Any) -> Any:
        calls[0] += inside[0]
        return call(self, *groups)

    def looking(self: SingularityMonitor, step_result: Any, between: bool, at_end: bool) -> Any:
        inside[0], looks[0] = True, looks[0] + between
        try:
            return look(self, step_result, between, at_end)
        finally:
            inside[0] = False

    monkeypatch.setattr(BoundKernel, "__call__", counted)
    monkeypatch.setattr(SingularityMonitor, "look", looking)
    assert simulate(scene, form=form, t_end=1.0).singular_crossings == ()
    assert calls[0] == 0  # one for every eight looks before, and each look was a stop
    assert looks[0] <= 2 * (scene.space == "space")  # where constraints are redundant, others may be kept


@pytest.mark.parametrize("form", FORMS)
def test_compiled_looks_are_those_of_python(
    form: str, guards: list[SingularityMonitor], monkeypatch: pytest.MonkeyPatch
) -> None:
    noted: list[Sample] = []
    note = SingularityMonitor.note

    def in_python(self: SingularityMonitor, step_result: Any) -> None:
        note(self, step_result)
        noted.append(Sample(step_result.t, step_result.y, step_result.yp))

    compiled = simulate(fast_slider_crank(), form=form, t_end=0.1, solver="ida")
    looks = guards[0]._compiled.take()
    monkeypatch.setattr(SingularityMonitor, "note", in_python)
    monkeypatch.setattr(SingularityMonitor, "step_monitor", property(lambda self: None))
    plain = simulate(fast_slider_crank(), form=form, t_end=0.1, solver="ida")
    assert len(looks) > 5
    for (t, y, yp), one in zip(looks[:-1], noted, strict=False):
        assert t == pytest.approx(one.t, rel=1e-9)  # IDA sums up y' in another order
        assert np.allclose(y, one.y, rtol=1e-7, atol=1e-7 * np.max(np.abs(y)))
        assert np.allclose(yp, one.yp, rtol=1e-6, atol=1e-6 * np.max(np.abs(yp)))
    assert len(compiled.singular_crossings) == len(plain.singular_crossings)


@pytest.mark.parametrize("form", FORMS)
def test_pivots_are_what_is_left_of_each_constraint(form: str, guards: list[SingularityMonitor]) -> None:
    simulate(fast_slider_crank(), form=form, t_end=0.1, solver="ida")
    monitor = guards[0]
    plan, data = monitor.plan, monitor._compiled
    t, y, _ = data.take()[-1]
    slope = to_array(plan.balance.constraints_at(t, y[: monitor._n], np.zeros_like(plan.sizes)).jacobian) * plan.sizes
    left = np.diag(np.linalg.qr(slope[list(plan.finding.kept)].T)[1]) ** 2
    assert np.allclose(data._arrays["pivots"][list(plan.finding.kept)], left, rtol=1e-9)


def test_outputs_between_looks_change_no_look(guards: list[SingularityMonitor]) -> None:
    for outputs in (2, 1001, 3001):
        simulate(fast_slider_crank(), t_end=0.1, outputs=outputs, solver="ida")
    few, *others = ([one[0] for one in monitor._compiled.take()] for monitor in guards)
    assert all(many == few for many in others)
    assert len(few) > 3


def test_conditions_that_depend_on_no_coordinate_have_lists() -> None:
    """As of a rope along a rod on a line, which the rod holds already."""
    lists = slope_lists(1, ())
    assert all(len(numbers) == 0 for numbers in lists.values())


@pytest.mark.parametrize(
    ("scene", "end", "crossings"), [(ScottRussellLift(), 0.4, 0), (Strandbeest(), 2.0, 0), (FourBarRow(), 2.0, 2)]
)
def test_looks_that_find_nothing_stay_in_machine_code(
    scene: Any, end: float, crossings: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    count, look = [0], SingularityMonitor.look

    def looking(self: SingularityMonitor, step_result: Any, between: bool, at_end: bool) -> Any:
        count[0] += between
        return look(self, step_result, between, at_end)

    monkeypatch.setattr(SingularityMonitor, "look", looking)
    judged = simulate(scene, form="dae", t_end=end)
    few, count[0] = count[0], 0
    monkeypatch.setattr(MonitorData, "judge_from", lambda self, start: None)
    asked = simulate(scene, form="dae", t_end=end)
    assert few <= (count[0] if crossings else 0) < 2 * count[0]
    times = [[one.time for one in run.singular_crossings] for run in (judged, asked)]
    assert times[0] == pytest.approx(times[1], abs=1e-10)  # a position is passed within the steps, or by Python
    assert len(times[0]) == crossings
    if not crossings:
        assert all(np.array_equal(judged[path], asked[path]) for path in judged.paths)


@pytest.mark.parametrize("scene", [FourBarRow(), FourBar(space="space"), Strandbeest()])
def test_machine_code_measures_what_numpy_does(scene: Any, guards: list[SingularityMonitor]) -> None:
    simulate(scene, form="dae", t_end=0.5)
    monitor, random = guards[0], np.random.default_rng(1)
    plan, data = monitor.plan, monitor._compiled
    y = np.array([one[1][: monitor._n] for one in data.take()]).T
    q = y + 1e-2 * random.normal(size=y.shape) * plan.coordinate_sizes[:, None]
    plain, t = RankMeasure(plan), np.zeros(q.shape[1])
    for known in (2, q.shape[1]):
        rows, found = data.rows.copy(), data.measures(t, q, known, np.zeros(len(data.rows)))
        plain.rows = rows
        assert np.allclose(found, plain.learn(t, q, known), rtol=1e-9, atol=1e-13)
        assert np.allclose(data.rows, rows, rtol=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_looks_leave_their_tape_at_any_time(
    form: str, guards: list[SingularityMonitor], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same looks, crossings and bits, whenever machine code takes the place of a tape."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    assembly, spend = assemble(FourBarRow(), form=form), MonitorData.spend
    told: dict[str, Any] = {"t_end": 1.0, "rtol": 1e-5, "solver": "explicit", "progress": lambda t: None}
    known, calls = [0.0], [0]

    def spending(self: MonitorData, seconds: float) -> None:
        tiers, calls[0] = self.code.tiers, calls[0] + 1
        tiers._left = 0.0 if calls[0] > known[0] else np.inf
        spend(self, seconds)

    monkeypatch.setattr(MonitorData, "spend", spending)
    known[0] = np.inf
    first = simulate(assembly, **told)
    assert len(first.singular_crossings) == 1
    monitor = guards[0]._compiled.code
    quick, better, many = monitor.tiers.now, monitor.tiers._better, calls[0]
    assert better is not None
    best = better()
    assert many > 2
    for before in range(0, many, 5):
        monitor.tiers.now, monitor.tiers._better = quick, lambda: best
        known[0], calls[0] = before, 0
        again = simulate(assembly, **told)
        assert monitor.tiers.now is best
        assert all(np.array_equal(first[path], again[path]) for path in first.paths)
