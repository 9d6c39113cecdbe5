"""Runs that stop at a condition, and conditions that are noted."""

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import Scene, UsageError, assemble, load_result, save_result, simulate
from atwood_library import FirstOrder
from atwood_library.scenes import DoublePendulum, FourBar, SimplePendulum, SphericalPendulum

FORMS = [
    ("reduced", "explicit"), ("reduced", "taylor"), ("reduced", "ida"), ("reduced", "ida-sundae"), ("dae", "ida"),
]  # fmt: skip


@pytest.mark.parametrize(("form", "solver"), FORMS)
def test_a_run_stops_where_a_quantity_crosses_a_value(form: str, solver: str) -> None:
    scene = SimplePendulum()
    result = simulate(scene, t_end=3.0, form=form, solver=solver, rtol=1e-9, until="rod.angle crosses 0")
    assert result.status == "stopped"
    assert abs(result["rod.angle"][-1]) < 1e-7
    assert result.events[-1].message == "rod.angle crosses 0"
    assert result.time[-1] == pytest.approx(result.events[-1].time)


def test_rising_and_falling_are_told_apart_and_units_are_read() -> None:
    scene = SimplePendulum()
    ways = ("crosses", "rises above", "falls below")
    times = {
        way: [one.time for one in simulate(scene, t_end=8.0, record=f"rod.angle {way} 20 deg").events] for way in ways
    }
    assert times["crosses"] == pytest.approx(sorted(times["rises above"] + times["falls below"]), rel=1e-12)
    assert len(times["rises above"]) in (2, 3)
    result = simulate(scene, t_end=8.0, record="rod.angle falls below 20 deg")
    at = np.isin(result.time, times["falls below"])
    assert_allclose(result["rod.angle"][at], pi / 9.0, atol=1e-6)
    assert np.all(result["rod.angular_velocity"][at] < 0.0)


@pytest.mark.sample(4)
@pytest.mark.parametrize(("form", "solver"), FORMS)
def test_what_is_noted_changes_nothing_in_a_run(form: str, solver: str) -> None:
    plain = simulate(DoublePendulum(), t_end=2.0, form=form, solver=solver)
    noted = simulate(
        DoublePendulum(), t_end=2.0, form=form, solver=solver,
        record=["rod1.angle crosses 0", lambda q: q["bob2.position.x"] < 1.0],
    )  # fmt: skip
    assert noted.statistics.steps == plain.statistics.steps
    assert [one.message for one in noted.events if one.message != "<lambda>"] == ["rod1.angle crosses 0"]
    assert len(noted.events) >= 2
    shared = np.isin(noted.time, plain.time)
    assert_allclose(noted["bob2.position.x"][shared], plain["bob2.position.x"], rtol=0, atol=0)


def test_a_function_says_when_to_stop() -> None:
    scene = DoublePendulum()
    low = simulate(scene, t_end=5.0, until=lambda q: q["bob2.position.z"] < -1.5)
    assert low["bob2.position.z"][-1] == pytest.approx(-1.5, abs=1e-7)
    meets = simulate(scene, t_end=5.0, until=lambda q: q["bob1.position.x"] - q["bob2.position.x"])
    assert meets["bob1.position.x"][-1] == pytest.approx(meets["bob2.position.x"][-1], abs=1e-7)
    later = simulate(scene, t_end=5.0, until=lambda q: q.time > 1.25)
    assert later.time[-1] == pytest.approx(1.25, rel=1e-12)
    pull = simulate(scene, t_end=5.0, until="rod1.tension rises above 20")
    assert pull["rod1.tension"][-1] == pytest.approx(20.0, rel=1e-6)


def test_two_quantities_are_compared_and_the_first_condition_stops() -> None:
    result = simulate(
        DoublePendulum(), t_end=5.0, until=["rod1.angle crosses rod2.angle", "bob1.position.x crosses 99"]
    )
    assert result["rod1.angle"][-1] == pytest.approx(result["rod2.angle"][-1], abs=1e-7)


def test_it_may_be_true_from_the_start_and_counts_when_it_becomes_so() -> None:
    """The pendulum starts at rest at its largest angle, above the value; the start is no crossing."""
    result = simulate(SimplePendulum(), t_end=8.0, until="rod.angle rises above 20 deg")
    assert result.time[-1] > 1.0


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_an_angle_that_comes_within_one_turn_has_no_crossing_on_its_far_side(form: str) -> None:
    scene = SimplePendulum()
    scene.start["rod.angular_velocity"] = 9.0  # goes round
    result = simulate(scene, t_end=2.0, form=form, record="rod.angle rises above 0.5")
    angle = np.unwrap(result["rod.angle"])
    first, last = np.floor((angle[[0, -1]] - 0.5) / (2.0 * pi))
    assert len(result.events) in ((1,) if form == "reduced" and angle[0] < 0.5 else (0, int(last - first)))


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_loops_and_space_stop_too(form: str) -> None:
    loop = simulate(FourBar(), t_end=3.0, form=form, until="crank.angle crosses 90 deg")
    assert loop.status == "stopped"
    bob = simulate(SphericalPendulum(), t_end=3.0, form=form, until="bob.position.y crosses 0")
    assert abs(bob["bob.position.y"][-1]) < 1e-7


def test_states_stop_a_run_and_it_is_saved(tmp_path: Any) -> None:
    scene = Scene()
    scene.add("lag", FirstOrder(time_constant=0.5, u=1.0))
    result = simulate(scene, t_end=9.0, rtol=1e-10, until="lag.y rises above 0.5")
    assert result.time[-1] == pytest.approx(0.5 * np.log(2.0), rel=1e-8)
    save_result(result, tmp_path / "lag.npz")
    assert load_result(tmp_path / "lag.npz").status == "stopped"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("rod.angel crosses 0", r"rod\.angel: there is no such quantity.*Did you mean 'rod\.angle'"),
        ("rod.angle croses 0", "it cannot be read.*Did you mean 'crosses'"),
        ("rod.angle falls under 0", "it cannot be read.*Did you mean 'falls below'"),
        ("rod.angle", "it cannot be read.*Write it as"),
        ("rod.angle crosses 3 m", "rod.angle crosses 3 m: .*"),
        (lambda q: 3.0, "it returns 3.0, which no motion changes"),
        (lambda q: q["rod.angel"], r"rod\.angel: there is no such quantity"),
        (lambda q: q.nothing, "it cannot be evaluated on terms"),
        (7, "a condition such as"),
    ],
)
def test_what_is_no_condition_is_refused(given: Any, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        simulate(assemble(SimplePendulum()), t_end=1.0, until=given)
