"""Drift over many periods: bounded with the symplectic method, growing with the others, and told as it is."""

from __future__ import annotations

import json
import math

import pytest

from atwood import LongComparison, compare_long, simulate
from atwood.study.comparison import long_runs
from atwood_library.scenes import Kepler, SimplePendulum


@pytest.fixture(scope="module")
def pendulum() -> LongComparison:
    return compare_long(SimplePendulum(), periods=100)


def row(found: LongComparison, form: str, solver: str, rtol: float = 1e-8) -> long_runs.LongRow:
    return next(one for one in found.rows if (one.form, one.solver, one.rtol) == (form, solver, rtol))


def test_period_is_that_of_the_motion(pendulum):
    """A pendulum of one metre from its start: 4 K(sin(a/2)) sqrt(l/g)."""
    from scipy.special import ellipk

    half = float(simulate(SimplePendulum(), t_end=0.01)["rod.angle"][0]) / 2.0
    exact = 4.0 * math.sqrt(1.0 / 9.81) * float(ellipk(math.sin(half) ** 2))
    assert pendulum.period == pytest.approx(exact, rel=1e-3)


def test_symplectic_errors_stay_and_others_grow(pendulum):
    gauss, ida = row(pendulum, "reduced", "gauss"), row(pendulum, "reduced", "ida")
    assert pendulum.marks == (1, 10, 100)
    assert not gauss.grows
    assert gauss.energy[2] < 3.0 * gauss.energy[0]
    assert ida.energy[2] > 10.0 * ida.energy[0]
    assert row(pendulum, "reduced", "taylor", 1e-15).energy[2] < 1e-11
    assert row(pendulum, "reduced", "explicit").grows
    assert "does not grow with reduced, gauss, rtol 1e-08" in pendulum.verdict


@pytest.mark.parametrize(
    ("errors", "grows"),
    [
        ((4e-10, 4.5e-8, 9e-8), True),  # in proportion to the time
        ((1e-7, 2e-4, 1.6e-4), False),  # of bounded size, which the first periods do not show
        ((2e-15, 3e-15, 4e-15), False),  # rounding
        ((1e-9, 3e-9, None), True),
        ((1e-9, None, None), False),
    ],
)
def test_what_grows_is_told_from_the_last_marks(errors, grows):
    assert (
        long_runs.LongRow("reduced", "taylor", 1e-8, (1, 5 if errors[-1] is None else 10, 20), energy=errors).grows
        is grows
    )


def test_how_long_a_run_is_does_not_change_its_first_errors(pendulum):
    shorter = compare_long(SimplePendulum(), periods=10)
    for form, solver in (("reduced", "gauss"), ("reduced", "ida")):
        assert row(shorter, form, solver).energy[1] == pytest.approx(row(pendulum, form, solver).energy[1], rel=0.3)


def test_other_invariants_are_followed_too():
    found = compare_long(Kepler(), periods=10)
    assert found.conserved
    assert len(row(found, "reduced", "ida").invariants) == len(found.marks)
    assert row(found, "reduced", "gauss").invariants[-1] < 1e-6


def test_what_there_is_no_time_for_is_left_open():
    found = compare_long(SimplePendulum(), periods=1_000_000, period=2.0, max_seconds=0.05)
    late = row(found, "dae", "ida")
    assert late.energy[-1] is None
    assert 0.0 <= late.reached < 1e6
    assert "Out of time before the end" in found.verdict
    assert json.loads(json.dumps(found.to_dict()))["rows"][-1]["energy"][-1] is None
    assert "-" in str(found)
