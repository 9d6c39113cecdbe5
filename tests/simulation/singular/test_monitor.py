"""The singularity monitor's decisions, on given measures: when to look closer, and whether the solver did well."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import atwood
from atwood import Scene, simulate
from atwood.integrators.protocol import Status
from atwood.simulation.singular import branches as ways, monitor as module
from atwood.simulation.singular.branches import Sample
from atwood.simulation.singular.crossing import SingularCrossing, labels_of
from atwood.simulation.singular.monitor import SingularityMonitor, singularity_monitor_of
from atwood_library import Force, Ground, PointMass, Slider
from atwood_library.scenes import DoublePendulum, FourBar, FourBarRow

INF = float("inf")


def crossing(time: float, path: Any = None) -> SingularCrossing:
    return SingularCrossing(time, 1, ("loop",), ("part",), path)


def given(away: list[float], step: float = 1.0, largest: float = 1.0) -> SingularityMonitor:
    """Return a monitor that has looked at regular times, with what its measure was."""
    one = object.__new__(SingularityMonitor)
    kinematic_map = SimpleNamespace(normalized=lambda q: q)
    one.plan = SimpleNamespace(
        balance=SimpleNamespace(kinematic_map=kinematic_map),
        sizes=np.array([2.0]),
        coordinate_sizes=np.array([4.0]),
        scales=SimpleNamespace(time=10.0),
    )
    one.tolerance, one.seconds, one.agreed, one._whole = 1e-6, 0.0, [], 100.0
    one._n, one._m = 1, 1
    one._samples = [Sample(step * k, np.array([float(k), 1.0]), np.zeros(2)) for k in range(len(away))]
    one._away, one._judged, one._largest = list(away), -INF, largest
    one._compiled, one._is_behind, one._measures = None, False, None
    one.trouble = None
    return one


class Asked:
    """Stands for what looks closer: notes what it is asked, and answers as it is told."""

    def __init__(self, *answers: SingularCrossing | None) -> None:
        self.answers, self.calls = list(answers), []

    def __call__(self, *arguments: Any, **named: Any) -> SingularCrossing | None:
        self.calls.append((*arguments, *named.values()))
        return self.answers.pop(0) if self.answers else None


# -- which looks are minima --------------------------------------------------------------------------------------------


def minimum(away: list[float], at_end: bool = False, largest: float = 1.0) -> list[tuple[int, int]]:
    """Return between which looks it is looked closer."""
    one = given(away, largest=largest)
    between: list[tuple[int, int]] = []
    one._closest = lambda *looks: between.append(looks) or []  # type: ignore[method-assign,assignment,func-returns-value]
    one._heading = lambda i: None  # type: ignore[method-assign,assignment]
    assert one._first_minimum(at_end, False) is None
    return between


def test_only_a_low_minimum_is_looked_at_more_closely() -> None:
    assert minimum([0.9, 0.2, 0.9]) == [(0, 2)]
    assert minimum([0.9, 0.29, 0.9]) == []
    assert minimum([0.9, 0.28, 0.9]) == [(0, 2)]
    assert minimum([0.9, 0.2, 0.1]) == []
    assert minimum([0.1, 0.2, 0.9]) == [(0, 1)]  # the first look is one
    assert minimum([0.9, 0.5, 0.9], largest=2.0) == [(0, 2)]  # low, relative to the largest so far
    assert minimum([0.9, 0.8, 0.2, 0.8, 0.1, 0.9]) == [(1, 3), (3, 5)]


def test_the_last_look_is_judged_when_what_comes_behind_is_known() -> None:
    assert minimum([0.9, 0.5, 0.1]) == []
    assert minimum([0.9, 0.5, 0.1], at_end=True) == [(1, 2)]


def test_each_look_is_judged_once() -> None:
    one = given([0.9, 0.2, 0.9])
    asked = Asked()
    one._closest = lambda first, last: [(1.1, 0.01)]  # type: ignore[method-assign]
    one._heading = lambda i: None  # type: ignore[method-assign,assignment]
    one._pass = asked  # type: ignore[method-assign]
    assert one._first_minimum(False, True) is None
    assert asked.calls == [(1.1, 0.01, True)]
    assert one._judged == 1.0
    assert one._first_minimum(False, True) is None
    assert len(asked.calls) == 1


def test_a_crossing_that_the_solver_missed_is_returned_and_one_that_it_made_is_noted() -> None:
    for went_along in (False, True):
        one, found = given([0.9, 0.2, 0.9]), crossing(1.1)
        one._closest = lambda first, last: [(1.1, 0.01)]  # type: ignore[method-assign]
        one._pass = Asked(found)  # type: ignore[method-assign]
        one._went_along = lambda _, answer=went_along: answer  # type: ignore[method-assign,misc]
        assert one._first_minimum(False, False) is (None if went_along else found)
        assert one.agreed == ([found] if went_along else [])


def test_where_the_measure_has_fallen_to_nothing_it_is_where_the_motion_was_heading() -> None:
    """It stays low behind: the solver has leapt into another way to move, or moves along the singular place."""
    one, found = given([0.9, 0.005, 0.001, 0.001]), crossing(1.0)
    one._closest = lambda first, last: []  # type: ignore[method-assign]
    headings: list[int] = []
    one._heading = lambda i: headings.append(i) or (1.05, 0.005)  # type: ignore[method-assign,func-returns-value]
    one._pass = Asked(found)  # type: ignore[method-assign]
    one._went_along = lambda _: False  # type: ignore[method-assign]
    assert one._first_minimum(False, False) is found
    assert headings == [1]
    # It was low before: nothing has fallen. And 0.02 is not low enough.
    for away in ([0.02, 0.019, 0.018], [0.9, 0.02, 0.018, 0.017]):
        one = given(away)
        one._heading = lambda i: pytest.fail("nothing has fallen")  # type: ignore[method-assign,misc]
        one._closest = lambda first, last: []  # type: ignore[method-assign]
        assert one._first_minimum(False, False) is None


# -- where the motion is heading ---------------------------------------------------------------------------------------


def test_a_measure_that_falls_evenly_is_followed_to_its_zero() -> None:
    assert given([0.9, 0.6, 0.3, 0.5])._heading(2) == (3.0, 0.3)
    time, away = given([0.9, 0.8, 0.2, 0.5], step=0.5)._heading(2) or (0.0, 0.0)
    assert time == pytest.approx(1.0 + 0.5 * 0.2 / 0.6)
    assert away == 0.2


def test_a_measure_that_would_fall_for_long_is_heading_nowhere_near() -> None:
    assert given([0.9, 0.8, 0.7, 0.7])._heading(2) is None
    assert given([0.7, 0.8, 0.9, 0.9])._heading(2) is None
    assert given([0.5])._heading(0) is None


def test_where_the_look_itself_rose_the_one_before_tells() -> None:
    assert given([0.9, 0.3, 0.31, 0.9])._heading(2) == (pytest.approx(1.5), 0.31)


def test_where_a_solver_failed_the_motion_before_it_tells() -> None:
    found = crossing(2.5)
    one = given([0.9, 0.6, 0.3])
    one._pass = Asked(found)  # type: ignore[method-assign]
    assert one._ahead() is found
    assert one._pass.calls == [(3.0, True)]  # type: ignore[attr-defined]
    for away in ([0.9, 0.95, 0.96], [0.5], [0.9, np.nan, 0.3]):
        one = given(away)
        one._pass = Asked(found)  # type: ignore[method-assign]
        assert one._ahead() is None
    far = given([0.99, 0.96, 0.93])  # it would take 31 more steps
    far._pass = Asked(found)  # type: ignore[method-assign]
    assert far._ahead() is None
    assert not far._pass.calls  # type: ignore[attr-defined]
    last_rose = given([0.9, 0.5, 0.6])
    last_rose._pass = Asked(found)  # type: ignore[method-assign]
    assert last_rose._ahead() is found
    assert last_rose._pass.calls[0][0] == pytest.approx(1.0 + 0.5 / 0.4)  # type: ignore[attr-defined]


# -- whether the solver did well ---------------------------------------------------------------------------------------


def path(off: float = 0.0, off_speed: float = 0.0) -> Any:
    """Return a path from 0 to 4 whose places and speeds are off those of the looks."""
    at = lambda t: (t[None, :] + off, np.full((1, len(t)), 1.0 + off_speed), np.zeros((1, len(t))))  # noqa: E731
    return SimpleNamespace(start=0.0, end=4.0, at=at)


def test_a_solver_has_gone_along_if_its_states_behind_the_place_agree() -> None:
    one = given([1.0] * 6)
    allowed = 30.0 * one.tolerance
    assert one._went_along(crossing(2.0, path()))
    assert one._went_along(crossing(2.0, path(off=0.9 * 4.0 * allowed)))
    assert not one._went_along(crossing(2.0, path(off=1.1 * 4.0 * allowed)))
    assert not one._went_along(crossing(2.0, path(off=-1.1 * 4.0 * allowed)))
    assert one._went_along(crossing(2.0, path(off_speed=0.9 * 0.2 * allowed)))  # sizes of speeds: 2 in 10 s
    assert not one._went_along(crossing(2.0, path(off_speed=1.1 * 0.2 * allowed)))


def test_only_looks_behind_the_place_and_on_the_path_count() -> None:
    one = given([1.0] * 6)
    one._samples[1] = Sample(1.0, np.array([9.0, 9.0]), np.zeros(2))
    one._samples[5] = Sample(5.0, np.array([9.0, 9.0]), np.zeros(2))
    assert one._went_along(crossing(2.0, path()))
    one._samples = one._samples[:3]  # the last is at the place itself
    assert not one._went_along(crossing(2.0, path()))
    one._samples = [Sample(2.15, np.array([9.0, 9.0]), np.zeros(2)), *given([1.0] * 4)._samples[3:]]
    assert one._went_along(crossing(2.0, path()))  # within a tenth of the way from the place to the end


def test_a_place_without_a_path_was_passed_by_the_solver() -> None:
    assert given([1.0] * 3)._went_along(crossing(2.0, None))


# -- bookkeeping -------------------------------------------------------------------------------------------------------


def test_the_last_six_looks_are_kept() -> None:
    for count, kept in ((3, 3), (6, 6), (7, 6), (20, 6)):
        one = given([float(k) for k in range(count)])
        one._forget()
        assert len(one._samples) == len(one._away) == kept
        assert one._away[-1] == count - 1.0


def test_looks_are_measured_once_and_the_largest_is_remembered() -> None:
    one = given([0.5, 0.4])
    one._largest = 0.6
    one._samples += [Sample(2.0 + k, np.array([float(k), 0.0]), np.zeros(2)) for k in range(3)]
    seen: list[np.ndarray] = []

    def learn(t: np.ndarray, q: np.ndarray, known: int) -> np.ndarray:
        assert known == 3
        seen.append(t)
        assert q.shape == (1, 3)
        return np.array([0.1, 0.9, np.inf])

    one._measures = SimpleNamespace(learn=learn)
    one._measure()
    assert [one.tolist() for one in seen] == [[2.0, 3.0, 4.0]]
    assert one._away == [0.5, 0.4, 0.1, 0.9, np.inf]
    assert one._largest == 0.9
    one._measure()
    assert len(seen) == 1


def test_a_state_is_noted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "stride_from", lambda plan, one, whole: 0.25)
    one = given([1.0] * 3)
    one.note(SimpleNamespace(t=2.0, y=np.zeros(2), yp=np.zeros(2)))
    assert len(one._samples) == 3
    one.note(SimpleNamespace(t=2.5, y=np.zeros(2), yp=np.zeros(2)))
    assert len(one._samples) == 4
    assert one.next == 2.75


@pytest.mark.parametrize(
    ("status", "between", "at_end", "looks"),
    [
        (Status.REACHED, False, False, False),
        (Status.REACHED, True, False, True),
        (Status.REACHED, False, True, True),
        (Status.NOTICED, False, False, False),
        (Status.FAILED, False, False, True),
        (Status.INTERRUPTED, True, True, False),
    ],
)
def test_when_it_looks(status: Status, between: bool, at_end: bool, looks: bool) -> None:
    one = given([1.0] * 3)
    taken: list[tuple[bool, bool]] = []
    one._take = lambda step, at_end, ended: bool(taken.append((at_end, ended)))  # type: ignore[method-assign,func-returns-value]
    assert one.look(SimpleNamespace(status=status, t=2.5), between, at_end) is None
    assert taken == ([(at_end, status is Status.FAILED)] if looks else [])


def test_several_looks_are_judged_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "stride_from", lambda plan, one, whole: 0.25)
    one = given([1.0] * 3)
    states = (SimpleNamespace(t=3.0 + k, y=np.zeros(2), yp=np.zeros(2)) for k in range(20))
    assert [one._take(next(states), False, False) for _ in range(8)] == [False] * 7 + [True]
    assert one._take(next(states), False, True)
    assert given([1.0] * 3)._take(next(states), True, False)


def test_an_arc_begins_where_the_motion_has_gone_far_enough() -> None:
    one = given([1.0] * 6)
    one._state = lambda look: look.t  # type: ignore[method-assign,assignment]
    # Speeds of 1 with sizes of 2: from t to near it moves by (near - t) / 2; wanted is 0.2 times the reach.
    assert one._begin(4.0, 1.0) == 3.0
    assert one._begin(4.0, 4.0) == 2.0
    assert one._begin(4.0, 0.0) == 4.0
    assert one._begin(4.0, 100.0) == 0.0  # the first look, if it cannot be so far
    assert one._begin(0.0, 100.0) is None


def test_only_mechanisms_with_loops_are_looked_at() -> None:
    step = SimpleNamespace(t=0.0)
    for scene, form in ((DoublePendulum(), "reduced"), (DoublePendulum(), "dae")):
        plan = atwood.simulate(scene, form=form, t_end=0.01).first_plan
        assert singularity_monitor_of(plan, 1e-8, 1.0, step) is None
    plain = atwood.simulate(FourBar(), form="dae", level="index1", t_end=0.01).first_plan
    assert singularity_monitor_of(plain, 1e-8, 1.0, step) is None


def test_what_is_said_of_constraints_names_each_part_once() -> None:
    one = given([1.0])
    made = [SimpleNamespace(label=f"c{k}", key=(part, "pin", k)) for k, part in enumerate(("a", "a", "b"))]
    one.plan.assembly = SimpleNamespace(own_equations=SimpleNamespace(constraints=made))
    assert labels_of(one.plan, (2, 0, 1)) == (("c2", "c0", "c1"), ("b", "a"))


def test_a_failure_is_explained_only_where_it_was_at_a_singular_position() -> None:
    one = given([1.0])
    assert one.explain("no step") is None
    constraint = SimpleNamespace(label="loop.pin", key=("loop", "pin", 0))
    one.plan.assembly = SimpleNamespace(own_equations=SimpleNamespace(constraints=[None, constraint]))
    one.trouble = (1.5, 1)
    error = one.explain("no step")
    assert error is not None
    assert error.where == "loop"
    assert "near t = 1.5" in str(error)


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", ["auto", "ida"])
def test_no_output_is_lost_where_a_way_begins_with_half_of_it(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where arcs are to be more accurate, the first covers half of the way: a way began behind outputs to come."""
    monkeypatch.setattr(module, "ACCURATE", 1e-11)
    monkeypatch.setattr(ways, "ACCURATE", 1e-11)
    result = simulate(FourBarRow(), form="dae", rtol=1e-11, outputs=2001, t_end=0.9, solver=solver)
    assert [len(one.path.arcs) > 1 for one in result.singular_crossings if one.path] == [True]
    assert len(result.time) == 2001


def test_of_two_places_that_one_look_sees_both_are_passed() -> None:
    """The second only if the way over the first one does not lead over it."""
    for end, count in ((1.05, 2), (1.2, 1)):
        one, path = given([0.9, 0.2, 0.9]), SimpleNamespace(end=end)
        one._closest = lambda first, last: [(1.0, 0.01), (1.1, 0.01)]  # type: ignore[method-assign]
        one._pass = lambda *_, path=path: SimpleNamespace(time=1.0, path=path)  # type: ignore[method-assign]
        one._went_along = lambda _: True  # type: ignore[method-assign]
        assert one._first_minimum(False, False) is None
        assert len(one.agreed) == count


@pytest.mark.parametrize("late", [1e-8, -1e-8, 1e-6])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_run_that_begins_anew_on_a_singular_position_says_so(form: str, late: float) -> None:
    """A step of a force just behind the place: in maximal coordinates the speeds were wrong by a tenth, in silence."""
    place = 0.70845000868
    scene = Scene(t_end=1.0)
    scene.add("row", FourBarRow(windows=1))
    ground, slider = scene.add("ground", Ground()), scene.add("slider", Slider(axis=(1, 0, 0)))
    bead = scene.add("bead", PointMass())
    push = scene.add("push", Force(direction=(1, 0, 0), value=lambda t: atwood.select(t > place + late, 1.0, 0.0)))
    for a, b in ((ground.frame, slider.a), (slider.b, bead.point), (bead.point, push.point)):
        scene.connect(a, b)
    if form == "dae" and abs(late) < 1e-7:
        with pytest.raises(atwood.SolveError, match="begins anew where the mechanism is in a singular position"):
            simulate(scene, form=form, rtol=1e-9)
    else:
        assert simulate(scene, form=form, rtol=1e-9).energy.max_drift < 2e-7
