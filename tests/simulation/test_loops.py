"""Mechanisms with loops in the reduced form: which coordinates are dependent, and runs in which that changes."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from atwood import simulate
from atwood.forms.residuals import null_space_program
from atwood.integrators.ida import library as sundials_library
from atwood.simulation.dynamics.redundancy import POOR, choose_dependent_coordinates, review_partitioning
from atwood.simulation.problem.implicit_scene import choice_lists, null_space_shape
from atwood.simulation.problem.problem import SceneProblem
from atwood_library.scenes import FourBar, SliderCrank

from ..helpers.mechanisms import double_four_bar, pendulum_on_a_string, two_four_bars
from ..helpers.runs import prepare

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")


def rocking(rate: float = 2.0) -> FourBar:
    """Return a four-bar none of whose links can turn fully, so that every choice becomes poor at times."""
    scene = FourBar(crank_length=1.0, coupler_length=1.2, rocker_length=1.0, frame_length=2.2)
    scene.start["crank.angular_velocity"] = rate
    return scene


def ratios(slope: Any, dependent: tuple[int, ...]) -> Any:
    free = [i for i in range(slope.shape[1]) if i not in dependent]
    return np.abs(np.linalg.solve(slope[:, dependent], slope[:, free]))


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 5), st.integers(0, 5), st.integers(0, 10**6))
def test_choices_are_as_good_as_can_be_reached_by_exchanges(rows: int, more: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    slope = random.standard_normal((rows, rows + more)) * 10.0 ** random.uniform(-3.0, 3.0, (rows, 1))
    scales = 10.0 ** random.uniform(-2.0, 2.0, rows + more)
    chosen = choose_dependent_coordinates(slope, scales)
    assert len(set(chosen)) == rows
    assert chosen == tuple(sorted(chosen))
    worst = min(combinations(range(rows + more), rows), key=lambda one: abs(np.linalg.det((slope * scales)[:, one])))
    for start in (chosen, worst):
        settled = review_partitioning(slope, scales, start)
        assert np.max(ratios(slope * scales, settled), initial=0.0) <= POOR + 1e-9
        # what is good enough stays, so that choices do not flicker
        assert review_partitioning(slope, scales, settled) == settled
    assert review_partitioning(7.0 * slope, scales, worst) == review_partitioning(slope, scales, worst)


def test_the_first_choice_is_that_of_a_pivoted_factorisation() -> None:
    from scipy.linalg import qr

    random = np.random.default_rng(3)
    for rows, columns in ((1, 3), (2, 5), (6, 9), (20, 31)):
        slope, scales = random.standard_normal((rows, columns)), np.ones(columns)
        size = np.max(np.abs(slope), axis=1)
        *_, pivots = qr(slope / size[:, None], pivoting=True, mode="economic")
        assert choose_dependent_coordinates(slope, scales) == tuple(sorted(int(one) for one in pivots[:rows]))


@pytest.mark.parametrize("share", [0.04, 0.1, 1.0])
def test_the_first_choice_in_a_large_mechanism_is_that_of_a_pivoted_factorisation(share: float) -> None:
    from scipy.linalg import qr
    from scipy.sparse import csr_array

    random = np.random.default_rng(4)
    for rows, columns in ((60, 61), (60, 90), (130, 150)):
        slope, scales = random.standard_normal((rows, columns)), 10.0 ** random.uniform(-1.0, 1.0, columns)
        slope *= (random.random(slope.shape) < share) | np.eye(rows, columns, dtype=bool)
        size = np.max(np.abs(slope * scales), axis=1)
        *_, pivots = qr(slope * scales / size[:, None], pivoting=True, mode="economic")
        expected = tuple(sorted(int(one) for one in pivots[:rows]))
        assert choose_dependent_coordinates(slope, scales) == expected
        assert choose_dependent_coordinates(csr_array(slope), scales) == expected


def test_a_choice_that_cannot_be_solved_is_left() -> None:
    slope = np.array([[1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.5]])
    assert review_partitioning(slope, np.ones(4), (0, 1)) in {(0, 3), (1, 3)}
    nothing = np.zeros((1, 2))
    assert len(review_partitioning(nothing, np.ones(2), (0,))) == 1


def test_loops_that_share_nothing_are_solved_apart() -> None:
    prepared = prepare(two_four_bars(), "reduced")
    assembly = prepared.assembly
    program = null_space_program("two", assembly.own_equations, assembly.parameters, assembly.rows)
    shape = null_space_shape(program)
    lists = choice_lists(program, prepared.plan.dependent)
    at = shape.choice
    assert lists[at["blocks"]] == 2
    assert lists[at["starts"] : at["starts"] + 3].tolist() == [0, 2, 4]
    assert sorted(lists[at["dependent"] : at["dependent"] + 4]) == list(prepared.plan.dependent)
    # dependent coordinates of one linkage alone cannot be solved for, and are handed on to say so in numbers
    names = [one.name for one in assembly.own_equations.names]
    first = (*(i for i, name in enumerate(names) if "1" in name), prepared.plan.dependent[-1])
    assert len(first) == 4
    assert choice_lists(program, first)[at["blocks"]] == 1


@pytest.mark.sample(2)
@needs_sundials
@pytest.mark.parametrize("make", [FourBar, SliderCrank, rocking, double_four_bar, two_four_bars])
def test_compiled_and_plain_rows_take_a_mechanism_to_the_same_place(make: Any) -> None:
    rtol = 1e-9
    native = simulate(make(), t_end=1.5, rtol=rtol, solver="ida", outputs=31)
    plain = simulate(make(), t_end=1.5, rtol=rtol, solver="ida-sundae", outputs=31)
    for path in native.paths:
        if path.endswith((".angle", ".angular_velocity")):
            a, b = native.array(path), plain.array(path)
            assert np.max(np.abs(a - b)) < 3e-6 * max(1.0, np.max(np.abs(b))), path


@needs_sundials
def test_other_dependent_coordinates_leave_no_trace() -> None:
    result = simulate(rocking(), t_end=10.0, rtol=1e-9, solver="ida", outputs=101)
    plan = result.run.segments[0].plan
    assert plan.switches > 10
    assert result.statistics.reinitializations == 0
    assert result.energy.max_drift < 1e-5
    reference = simulate(rocking(), form="dae", t_end=10.0, rtol=1e-10, solver="ida", outputs=101)
    assert np.max(np.abs(result.array("crank.angle") - reference.array("crank.angle"))) < 1e-4


@needs_sundials
def test_a_bob_that_goes_round_on_a_rope_changes_coordinates_four_times_a_turn() -> None:
    # horizontal and vertical position in turn follow from the other; there is no angle
    def turning(form: str, rtol: float) -> Any:
        scene = pendulum_on_a_string()
        scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": 9.0})
        scene.guess["bob.position.z"] = -1.0
        return simulate(scene, form=form, t_end=10.0, rtol=rtol, solver="ida", outputs=101)

    result = turning("reduced", 1e-9)
    angle = np.unwrap(np.arctan2(result.array("bob.position.x"), result.array("bob.position.z")))
    turns = np.ptp(angle) / (2.0 * np.pi)
    plan = result.run.segments[0].plan
    assert abs(plan.switches - 4 * turns) <= 4
    assert result.statistics.steps < 5000
    assert result.energy.max_drift < 1e-5
    reference = turning("dae", 1e-11)
    for axis in "xz":
        path = f"bob.position.{axis}"
        assert np.max(np.abs(result.array(path) - reference.array(path))) < 1e-4


@needs_sundials
def test_no_python_runs_between_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    kernels, review = SceneProblem.kernels, SceneProblem.review_partitioning
    monkeypatch.setattr(SceneProblem, "kernels", lambda self: calls.append("kernels") or kernels(self))
    monkeypatch.setattr(SceneProblem, "review_partitioning", lambda *given: calls.append("review") or review(*given))
    result = simulate(FourBar(), t_end=5.0, solver="ida", outputs=11)
    assert result.statistics.steps > 300
    assert calls == []
    result = simulate(rocking(), t_end=5.0, solver="ida", outputs=11)
    switches = result.run.segments[0].plan.switches
    assert 0 < switches <= len(calls) <= 2 * switches + 2
    assert set(calls) == {"review"}


@needs_sundials
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_singular_passages_keep_to_their_branch(rtol: float) -> None:
    # IFToMM benchmark A02: ten passages in 10 s; angle from the upright, clockwise, by quadrature
    result = simulate(double_four_bar(), t_end=10.0, rtol=rtol, solver="ida", outputs=[1.0, 2.0, 5.0, 10.0])
    expected = np.array([3.33787080310509773, 6.34103336131233161, 16.6543534866534826, 31.7505971869861018])
    turned = np.pi / 2.0 - result.array("crank0.angle")[-4:]
    assert np.max(np.abs(turned - expected)) < 3e4 * rtol
    for name in ("crank1", "crank2"):
        assert np.allclose(result.array(f"{name}.angle"), result.array("crank0.angle"), atol=3e4 * rtol)
    assert np.allclose(np.sin(result.array("coupler1.angle")), 0.0, atol=3e4 * rtol)
