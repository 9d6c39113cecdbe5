"""The singularity monitor's way to a crossing: where it looks closer, and which arcs it takes from where."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from atwood.errors import SolveError
from atwood.integrators.protocol import Status
from atwood.simulation.singular import branches as module
from atwood.simulation.singular.branches import Sample
from atwood.simulation.singular.monitor import SingularityMonitor

from .test_monitor import Asked, crossing, given


def moving(times: list[float], largest: float = 1.0) -> SingularityMonitor:
    """Return a monitor that has looked at x = t^2, whose speed is 2 t."""
    one = given([1.0] * len(times), largest=largest)
    one._samples = [Sample(t, np.array([t * t, 2.0 * t]), np.array([2.0 * t, 2.0])) for t in times]
    return one


def measured(one: SingularityMonitor, at: float, floor: float = 0.0) -> SingularityMonitor:
    """Let the measure be the distance of x from a place."""
    distance = lambda t, q: np.abs(q[0] - at) + floor  # noqa: E731
    one._measures = SimpleNamespace(at=distance, learn=distance)
    return one


# -- the closer look ---------------------------------------------------------------------------------------------------


def test_the_motion_between_looks_is_seen_from_their_speeds() -> None:
    [found] = measured(moving([2.0, 4.0, 6.0]), 9.0)._closest(0, 2)
    assert found == (pytest.approx(3.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))
    one = measured(moving([2.0, 4.0, 6.0], largest=20.0), 27.0)  # between two of the places that are looked at
    [(time, away)] = one._closest(0, 2)
    assert time == pytest.approx(27.0**0.5, abs=0.07)
    assert away == pytest.approx(abs(time * time - 27.0), abs=1e-9)


def test_only_looks_between_the_given_ones_are_looked_at() -> None:
    one = measured(moving([2.0, 4.0, 6.0, 8.0]), 9.0)
    assert not one._closest(1, 3)  # the least is at the first of these looks
    assert len(one._closest(0, 1)) == 1
    assert not one._closest(1, 1)


def test_a_minimum_that_is_not_low_or_not_inside_is_none() -> None:
    assert len(measured(moving([2.0, 4.0, 6.0]), 9.0, floor=0.04)._closest(0, 2)) == 1
    assert not measured(moving([2.0, 4.0, 6.0]), 9.0, floor=0.06)._closest(0, 2)
    assert len(measured(moving([2.0, 4.0, 6.0], largest=2.0), 9.0, floor=0.06)._closest(0, 2)) == 1
    assert not measured(moving([2.0, 4.0, 6.0]), 36.0)._closest(0, 2)
    assert not measured(moving([2.0, 4.0, 6.0]), 4.0)._closest(0, 2)


def test_right_behind_the_first_look_it_is_looked_more_closely() -> None:
    near = 2.0 + 1e-3
    [found] = measured(moving([2.0, 4.0, 6.0]), near * near)._closest(0, 2)
    assert found[0] == pytest.approx(near, abs=1e-3)
    assert not measured(moving([1.0, 2.0, 4.0, 6.0]), near * near)._closest(1, 3)


def test_where_the_measure_has_no_value_nothing_is_said() -> None:
    one = moving([2.0, 4.0, 6.0])
    one._measures = SimpleNamespace(at=lambda t, q: np.where(q[0] > 30.0, np.nan, np.abs(q[0] - 9.0)))
    assert not one._closest(0, 2)


def test_states_between_looks_follow_the_motion() -> None:
    one = moving([2.0, 3.0, 5.0])
    q, u = one._between(np.array([2.0, 2.5, 3.0, 4.0, 5.0]))
    assert q[0] == pytest.approx([4.0, 6.25, 9.0, 16.0, 25.0])
    assert u[0] == pytest.approx([4.0, 5.0, 6.0, 8.0, 10.0])
    ahead, _ = one._between(np.array([4.5, 6.0, 9.0]))  # what is of second degree goes on as it was
    assert ahead[0] == pytest.approx([20.25, 36.0, 81.0])
    for outside in ([1.9, 2.5], [2.5, 10.1]):
        assert one._between(np.array(outside)) is None


# -- arcs --------------------------------------------------------------------------------------------------------------


class Arcs:
    """Stands for the collocation: gives arcs with given errors, and notes what was asked for."""

    def __init__(self, *errors: float | None) -> None:
        self.errors, self.asked = list(errors), []

    def __call__(self, plan: Any, t: float, q: Any, u: Any, end: float, *_: Any) -> Any:
        self.asked.append((t, end))
        error = self.errors.pop(0) if self.errors else 0.0
        if error is None:
            return None
        at = lambda s: (s[None, :] * s, 2.0 * s[None, :], np.full((1, len(s)), 2.0))  # noqa: E731
        return SimpleNamespace(start=t, end=end, error=error, at=at)


def with_arcs(monkeypatch: pytest.MonkeyPatch, one: SingularityMonitor, arcs: Arcs, *found: Any) -> SingularityMonitor:
    answers = list(found)
    monkeypatch.setattr(module, "find_arc", arcs)
    monkeypatch.setattr(module, "find_crossing", lambda measures, arc: answers.pop(0) if answers else None)
    monkeypatch.setattr(module, "stride_from", lambda plan, look, whole: 10.0)
    one.plan.balance.project = lambda t, q, u, sizes: (q, u)
    one._crossing = lambda arc, t, away, before=(): (*(one.start for one in (*before, arc)), arc.end, t, away)  # type: ignore[method-assign,assignment,return-value]
    one._state = lambda look: (look.t, np.zeros(1), np.zeros(1))  # type: ignore[method-assign,assignment]
    return one


STATE = (np.zeros(1), np.zeros(1))


def test_an_arc_goes_as_far_behind_the_place_as_it_begins_before(monkeypatch: pytest.MonkeyPatch) -> None:
    arcs = Arcs(0.0)
    one = with_arcs(monkeypatch, moving([0.0, 1.0]), arcs, (2.0, 0.1))
    assert one._over(2.0, 1.0, *STATE) == (1.0, 3.0, 2.0, 0.1)
    assert arcs.asked == [(1.0, 3.0)]


def test_an_arc_is_placed_anew_where_the_place_is_not_in_its_middle(monkeypatch: pytest.MonkeyPatch) -> None:
    arcs = Arcs()
    one = with_arcs(monkeypatch, moving([0.0, 1.0]), arcs, (2.07, 0.1), (2.1, 0.2))
    assert one._over(2.0, 1.0, *STATE) == (1.0, pytest.approx(3.14), 2.1, 0.2)
    assert arcs.asked == [(1.0, 3.0), (1.0, pytest.approx(3.14))]
    for found in (None, (0.9, 0.1), (1.0, 0.1)):
        assert with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(), found)._over(2.0, 1.0, *STATE) is None
    endless = with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(), *[(2.0 + 0.5 * k, 0.1) for k in range(1, 40)])
    assert endless._over(2.0, 1.0, *STATE) is None


@pytest.mark.parametrize("error", [None, 2e-6])
def test_an_arc_that_is_too_long_begins_nearer(monkeypatch: pytest.MonkeyPatch, error: float | None) -> None:
    arcs = Arcs(error, 0.0, 0.0)
    one = with_arcs(monkeypatch, moving([0.0, 1.0]), arcs, (2.0, 0.1))
    assert one._over(2.0, 1.0, *STATE) == (1.0, 1.5, 2.5, 2.0, 0.1)  # the first half is of the way, too
    assert arcs.asked == [(1.0, 3.0), (1.0, 1.5), (1.5, 2.5)]
    for worse in (None, 2e-6):
        assert (
            with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(error, worse), (2.0, 0.1))._over(2.0, 1.0, *STATE) is None
        )


def test_arcs_are_as_accurate_as_the_run_or_better(monkeypatch: pytest.MonkeyPatch) -> None:
    for tolerance, error, taken in ((1e-10, 5e-8, True), (1e-10, 5e-7, False), (1e-4, 5e-5, True), (1e-4, 5e-4, False)):
        one = with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(error, error), (2.0, 0.1))
        one.tolerance = tolerance
        assert (one._over(2.0, 1.0, *STATE) is not None) is taken


def test_arcs_are_tried_from_nearer_and_farther_places(monkeypatch: pytest.MonkeyPatch) -> None:
    one, found, tried = moving([0.0, 1.0]), crossing(2.0), []
    starts = {1.0: 1.0, 2.0: 0.5, 0.5: 1.0, 0.25: 1.6, 0.1: 1.8}
    one._begin = lambda near, reach: (starts[reach], *STATE)  # type: ignore[method-assign,assignment]

    def over(near: float, t: float, *_: Any) -> Any:
        tried.append(t)
        return found if t == 1.6 else None

    one._over = over  # type: ignore[method-assign]
    assert one._pass(2.0) is found
    assert tried == [1.0, 0.5, 1.6]  # none twice
    assert one.plan.compiles_columns


def test_where_no_arc_will_do_the_motion_is_followed_past_if_it_comes_close() -> None:
    for away, asked in ((0.019, 1), (0.021, 0)):
        one, past = moving([0.0, 1.0]), Asked(crossing(2.0))
        one._begin = lambda near, reach: (1.0, *STATE)  # type: ignore[method-assign,assignment]
        one._over, one._past = Asked(), past  # type: ignore[method-assign]
        one._from_start = lambda near: pytest.fail("it does not begin at the start")  # type: ignore[method-assign,misc]
        assert (one._pass(2.0, away, True) is not None) is bool(asked)
        assert len(past.calls) == asked
    assert past.calls == []


def test_at_the_start_the_way_on_is_sought_from_there() -> None:
    for begin in (None, (0.0, *STATE)):
        one, found = moving([0.0, 1.0]), crossing(0.1)
        one._begin = lambda near, reach, begin=begin: begin  # type: ignore[method-assign,misc]
        one._over, one._from_start, one._past = Asked(), Asked(found), Asked()  # type: ignore[method-assign]
        assert one._pass(0.1) is found
        one._from_start = Asked()  # type: ignore[method-assign]
        assert one._pass(0.1) is None
        assert len(one._past.calls) == (begin is not None)


def test_from_a_start_arcs_become_shorter_until_one_is_accurate(monkeypatch: pytest.MonkeyPatch) -> None:
    arcs = Arcs(None, 1e-3, 0.0)
    one = measured(with_arcs(monkeypatch, moving([0.0, 1.0]), arcs, (0.5, 0.1)), 100.0)
    assert one._from_start(0.2) == (0.0, 1.0, 0.5, 0.1)
    assert arcs.asked == [(0.0, 10.0), (0.0, 3.0), (0.0, 1.0)]
    far = with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(), (0.5, 0.1))
    assert far._from_start(1.01) is None  # beyond a tenth of a stride it is not at the start
    far._state = lambda look: None  # type: ignore[method-assign,assignment]
    assert far._from_start(0.2) is None


def test_a_motion_that_leaves_a_start_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The measure, x = t^2 from a place, rises along the whole arc; the longest accurate arc is taken."""
    one = measured(with_arcs(monkeypatch, moving([0.0, 1.0]), Arcs(None, 0.0, 0.0)), 0.0)
    found = one._from_start(0.2)
    assert found is not None
    assert (found.time, found.ways, found.path.start, found.path.end) == (0.0, 0, 0.0, 3.0)
    # 50 of 100 + 50 at the end is no small share; behind a position, at a tight tolerance, it is near enough, whether
    # the motion has been far from it or goes there now.
    cases = ((False, 1.0, 50.0, False), (True, 200.0, 50.0, True), (True, 80.0, 50.0, True), (True, 80.0, 500.0, False))
    for behind, largest, floor, follows in cases:
        one = measured(with_arcs(monkeypatch, moving([0.0, 1.0], largest), Arcs(0.0, None, None)), 0.0, floor=floor)
        one._is_behind = behind
        assert (one._from_start(0.2) is not None) is follows
    falls = measured(with_arcs(monkeypatch, moving([0.0, 1.0], 1e3), Arcs(0.0, None, None)), 30.0)
    falls._is_behind = True
    assert falls._from_start(0.2) is None


# -- past a place, and failures ----------------------------------------------------------------------------------------


def past(monkeypatch: pytest.MonkeyPatch, follows: bool) -> tuple[SingularityMonitor, list[tuple[float, float]]]:
    asked: list[tuple[float, float]] = []

    def follow(plan: Any, begin: Any, end: float, tolerance: float, at: Any) -> Any:
        asked.append((end, tolerance))
        if not follows:
            raise SolveError("no way")
        arc = Arcs()(None, 1.0, None, None, 3.0)
        return SimpleNamespace(arcs=(arc,), at=arc.at, start=1.0, end=3.0)

    monkeypatch.setattr(module, "follow", follow)
    monkeypatch.setattr(module, "nearly_lost", lambda measure, near, q: int(q[0]))
    monkeypatch.setattr(module, "labels_of", lambda plan, lost: ((f"c{lost[0]}",), ("part",)))
    one = measured(moving([0.0, 1.0, 2.0]), 6.25)
    return one, asked


def test_a_motion_is_followed_as_far_behind_as_it_began_before(monkeypatch: pytest.MonkeyPatch) -> None:
    one, asked = past(monkeypatch, True)
    found = one._past(2.0, (1.0, *STATE), False)
    assert found is not None
    assert found.time == pytest.approx(2.5)
    assert (found.ways, found.constraints, found.path.end) == (0, (), 3.0)
    assert asked == [(3.0, pytest.approx(1e-8))]
    one.tolerance = 1e-12
    one._past(2.0, (1.0, *STATE), False)
    assert asked[1][1] == 1e-10


@pytest.mark.parametrize("failed", [False, True])
def test_what_cannot_be_followed_is_told(monkeypatch: pytest.MonkeyPatch, failed: bool) -> None:
    one, _ = past(monkeypatch, False)
    found = one._past(1.4, (0.0, *STATE), failed)
    if failed:
        assert found is None
        assert one.trouble == (1.4, 1)  # what is nearly lost at the look that is nearest
    else:
        assert found is not None
        assert (found.time, found.ways, found.constraints, found.path) == (1.4, 0, ("c1",), None)
        assert one.trouble is None


@pytest.mark.parametrize("status", [Status.REACHED, Status.FAILED])
def test_a_failed_solver_is_helped_over_what_lay_ahead(status: Status) -> None:
    one, found = given([1.0] * 3), crossing(2.5)
    one._take = lambda *_: True  # type: ignore[method-assign]
    one._measure = lambda **_: None  # type: ignore[method-assign]
    one._first_minimum = Asked(None)  # type: ignore[method-assign]
    one._ahead, one._from_start = Asked(None), Asked(found)  # type: ignore[method-assign]
    one._coming = Asked(None)  # type: ignore[method-assign]
    step = SimpleNamespace(status=status, t=2.2)
    assert one.look(step, True, False) is (found if status is Status.FAILED else None)
    assert one._first_minimum.calls == [(status is Status.FAILED, status is Status.FAILED)]
    assert one._from_start.calls == ([(2.2,)] if status is Status.FAILED else [])
    assert 0.0 < one.seconds < 60.0
    sooner = crossing(1.0)
    one._first_minimum = Asked(sooner)  # type: ignore[method-assign]
    one._ahead = lambda: pytest.fail("it was found already")  # type: ignore[method-assign,misc]
    assert one.look(step, True, False) is sooner
