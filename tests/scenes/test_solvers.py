"""IDA with compiled equations against the reference: IDA's own options, and equations in Python."""

import numpy as np
import pytest

from atwood import UsageError, simulate
from atwood.integrators.ida.library import available
from atwood_library.scenes import SCENES

from ..helpers.runs import EVERYDAY


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", EVERYDAY)
def test_both_drivers_agree(name: str, form: str) -> None:
    assert available()
    scene = SCENES[name]()
    end = min(scene.t_end, 1.0)
    native, reference = (
        simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=11, solver=solver) for solver in ("ida", "ida-sundae")
    )
    assert (native.run.solver, reference.run.solver) == ("ida", "ida-sundae")
    for path in native.paths:
        one, other = native.array(path), reference.array(path)
        assert np.max(np.abs(one - other)) <= 3e-6 * max(1.0, np.max(np.abs(other))), path


def test_an_unknown_solver_is_refused() -> None:
    with pytest.raises(UsageError, match="ida-sundae"):
        simulate(SCENES["atwood"](), solver="ida-sundea")


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", [name for name in EVERYDAY if name not in ("four-bar", "slider-crank")])
def test_the_explicit_method_agrees(name: str) -> None:
    scene = SCENES[name]()
    end = min(scene.t_end, 1.0)
    explicit = simulate(scene, t_end=end, rtol=1e-11, outputs=11, solver="explicit")
    reference = simulate(scene, t_end=end, rtol=1e-11, outputs=11, solver="ida")
    assert explicit.run.solver == "explicit"
    for path in reference.paths:
        one, other = explicit.array(path), reference.array(path)
        assert np.max(np.abs(one - other)) <= 3e-7 * max(1.0, np.max(np.abs(other))), path


@pytest.mark.parametrize(("name", "form"), [("bricard", "reduced"), ("double-pendulum", "dae"), ("four-bar", "dae")])
def test_series_and_the_explicit_method_agree_where_constraints_are_left(name: str, form: str) -> None:
    series, explicit = (
        simulate(SCENES[name](), form=form, t_end=1.0, rtol=1e-10, outputs=11, solver=solver)
        for solver in ("taylor", "explicit")
    )
    assert series.run.segments[0].plan.balance.constraints
    assert [series.run.solver, explicit.run.solver, series.status] == ["taylor", "explicit", "finished"]
    for path in explicit.paths:
        one, other = series.array(path), explicit.array(path)
        assert np.max(np.abs(one - other)) <= 2e-9 * max(1.0, np.max(np.abs(other))), path


def test_a_rope_is_watched_by_the_explicit_method_too() -> None:
    scene = SCENES["atwood"]()
    stopped = [simulate(scene, t_end=3.0, rtol=1e-10, solver=solver) for solver in ("ida", "explicit")]
    assert [one.status for one in stopped] == ["stopped", "stopped"]
    assert stopped[0].time[-1] == pytest.approx(stopped[1].time[-1], abs=1e-8)
