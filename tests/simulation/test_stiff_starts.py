"""Stiff scenes that are sound from their start on, against exact solutions of linear systems."""

from typing import Any

import pytest

from atwood import Scene, UsageError, simulate

from ..helpers.chains import exact_chain, pushed_chain


def chain(stiffness: tuple[float, ...], damping: tuple[float, ...], rate: float, at: float = 0.0) -> Scene:
    """Return a chain whose last mass is pushed by the least k sin(rate t)."""
    return pushed_chain(stiffness, damping, (min(stiffness), rate), at)


def exact(stiffness: tuple[float, ...], damping: tuple[float, ...], rate: float, at: float, t: float) -> Any:
    """Return its displacements from balance."""
    return exact_chain(stiffness, damping, (min(stiffness), rate), at, t)[0]


CASES = {
    "critical": ((1e8,), (2e4,), 3.0, 0.0),
    "overdamped": ((1e6,), (1e6,), 3.0, 0.0),
    "stiffer": ((1e10,), (2e5,), 2.0, 0.0),
    "faster push": ((1e8,), (2e4,), 100.0, 0.0),
    "chain": ((1e4, 1e8), (200.0, 2e4), 1.0, 0.0),
    "off balance": ((1e8,), (1e6,), 3.0, 1e-3),
}


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("case", CASES)
def test_a_sound_start_runs_at_the_default_tolerance(case: str, form: str) -> None:
    stiffness, damping, rate, at = CASES[case]
    run = simulate(chain(stiffness, damping, rate, at), form=form, t_end=0.1, outputs=11)
    found = [run[f"m{i}.position.x"][-1] - i - 1.0 for i in range(len(stiffness))]
    assert found == pytest.approx(exact(stiffness, damping, rate, at, 0.1), abs=1e-7)


@pytest.mark.parametrize("solver", ["ida", "ida-sundae"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_both_ways_to_ida_find_their_first_step(solver: str, rtol: float) -> None:
    stiffness, damping, rate, at = (1e10,), (2e5,), 3.0, 0.0
    run = simulate(chain(stiffness, damping, rate), solver=solver, rtol=rtol, t_end=1e-3, outputs=3)
    assert run["m0.position.x"][-1] - 1.0 == pytest.approx(
        exact(stiffness, damping, rate, at, 1e-3)[0], abs=10.0 * rtol
    )


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida", "ida-sundae"])
def test_a_first_step_is_taken(solver: str) -> None:
    scene = chain((100.0,), (1.0,), 3.0)
    runs = [simulate(scene, solver=solver, t_end=1.0, outputs=3, first_step=one) for one in (1e-12, None)]
    assert runs[0].statistics.steps != runs[1].statistics.steps
    if not solver.startswith("ida"):  # which is not asked for single steps
        one = simulate(scene, solver=solver, t_end=1.0, outputs=3, max_steps=1, first_step=1e-7)
        assert one.time[-1] == pytest.approx(1e-7)
    run = simulate(scene, solver=solver, t_end=1.0, outputs=3, first_step=0.5)
    assert run["m0.position.x"][-1] - 1.0 == pytest.approx(exact((100.0,), (1.0,), 3.0, 0.0, 1.0)[0], abs=1e-6)


@pytest.mark.parametrize("given", [0.0, -1.0, 1e-40, 3.0, "soon"])
def test_first_steps_that_are_none_are_refused(given: Any) -> None:
    with pytest.raises(UsageError, match="first_step"):
        simulate(chain((100.0,), (1.0,), 3.0), t_end=1.0, first_step=given)
    with pytest.raises(UsageError, match="first_step"):
        simulate(chain((100.0,), (1.0,), 3.0), t_end=1.0, first_step=0.1, solver="gauss")


@pytest.mark.parametrize("damping", [1.9e4, 2e4, 1e5])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_steps_of_order_one_do_not_stay_as_short_as_a_transient(damping: float, rtol: float) -> None:
    """They were 80,000 to 170,000 a second: each that was made longer was repeated, and no higher order was tried."""
    run = simulate(chain((1e8,), (damping,), 3.0), solver="ida", rtol=rtol, t_end=2.0, outputs=3)
    assert run.statistics.steps < 10_000
    assert run["m0.position.x"][-1] - 1.0 == pytest.approx(exact((1e8,), (damping,), 3.0, 0.0, 2.0)[0], abs=1e-8)


@pytest.mark.parametrize("at", [0.0, 0.1])
def test_the_solver_is_chosen_again_once_a_vibration_has_died(at: float) -> None:
    """Explicit steps would follow a vibration of 100 rad/s, of which nothing is left, for 1e6 s."""
    run = simulate(chain((1e4,), (5.0,), 1e-3, at), t_end=1e5, outputs=3)
    assert [one.solver for one in run.run.choices] == ["explicit", "ida"]
    assert run.statistics.steps < 10_000
    assert run["m0.position.x"][-1] - 1.0 == pytest.approx(exact((1e4,), (5.0,), 1e-3, at, 1e5)[0], abs=1e-7)
