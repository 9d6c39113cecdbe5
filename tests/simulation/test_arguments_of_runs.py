"""What a run is asked for: the form of an assembly, tolerances, and just the times that are given."""

import numpy as np
import pytest

from atwood import Scene, UsageError, assemble, connect, dynamics, equations, report, simulate, sweep
from atwood_library import Ground, PointMass, Rope
from atwood_library.scenes import Atwood, DoublePendulum, DoublePendulum3D, FourBar


@pytest.mark.parametrize(
    ("made", "asked"),
    [
        ({"form": "dae"}, {"form": "reduced"}),
        ({}, {"form": "dae"}),
        ({}, {"level": "ggl"}),
        ({"form": "dae", "level": "index1"}, {"level": "ggl"}),
        ({}, {"orientation": "euler-zyz"}),
    ],
)
def test_arguments_that_contradict_the_assembly_are_refused(made, asked):
    assembly = assemble(DoublePendulum(), **made)
    (name,) = asked
    with pytest.raises(UsageError, match=f"{name}=.* contradicts the assembly"):
        simulate(assembly, t_end=0.1, **asked)


@pytest.mark.parametrize("solve", [sweep, dynamics, equations, report])
def test_whatever_takes_an_assembly_refuses_what_contradicts_it(solve):
    with pytest.raises(UsageError, match="orientation=.* contradicts the assembly" if solve is not sweep else "form="):
        solve(assemble(DoublePendulum()), **({"form": "dae"} if solve is sweep else {"orientation": "euler-zyz"}))


def test_what_would_change_nothing_is_refused():
    with pytest.raises(UsageError, match="the reduced form has no levels") as no_level:
        simulate(DoublePendulum(), level="index1", t_end=0.1)
    assert "form='dae'" in str(no_level.value)
    with pytest.raises(UsageError, match="no orientations in a plane"):
        report(DoublePendulum(), orientation="euler-zyz")
    with pytest.raises(UsageError, match="no orientations in a line"):
        simulate(Atwood(), orientation="euler-zyz")


def test_arguments_that_agree_with_the_assembly_are_taken():
    assembly = assemble(DoublePendulum(), form="dae", level="index1")
    result = simulate(assembly, form="dae", level="index1", orientation="quaternion", t_end=0.1)
    assert (result.form, result.level) == ("dae", "index1")
    turned = assemble(DoublePendulum3D(), orientation="euler-zyz")
    assert simulate(turned, orientation="euler-zyz", t_end=0.05).status == "finished"


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
def test_a_smaller_absolute_tolerance_errs_less(solver):
    assembly = assemble(DoublePendulum())
    exact = simulate(assembly, t_end=2.0, rtol=1e-13, solver="taylor").array("rod1.angle")[-1]

    def error(**tolerances):
        return abs(simulate(assembly, t_end=2.0, solver=solver, **tolerances).array("rod1.angle")[-1] - exact)

    loose = error(rtol=1e-5, atol=1e-3)
    assert error(rtol=1e-5, atol=1e-8) < 0.3 * loose
    same = [simulate(assembly, t_end=2.0, solver=solver, rtol=1e-5, **one) for one in ({}, {"atol": 1e-5})]
    assert np.array_equal(*(one.array("rod1.angle") for one in same))


def test_an_absolute_tolerance_depends_on_no_unit_of_length():
    def steps(scale):
        scene = DoublePendulum(length1=scale, length2=scale, gravity=9.81 * scale)
        return simulate(scene, t_end=2.0, rtol=1e-9, atol=1e-5).statistics.steps

    assert steps(1.0) == steps(2.0**10) == steps(2.0**-10)


@pytest.mark.parametrize("atol", [0.0, -1e-6, 1.0, "small"])
def test_an_absolute_tolerance_that_means_nothing_is_refused(atol):
    with pytest.raises(UsageError, match="atol"):
        simulate(DoublePendulum(), t_end=0.1, atol=atol)


def falling():
    class Drop(Scene):
        """A mass falls until its rope is taut."""

        ground, mass, rope = Ground(), PointMass(mass=1.0), Rope(length=1.0, starts="slack")
        connections = [connect(ground.frame, rope.a), connect(rope.b, mass.point)]
        start = {"mass.position.x": 0.3, "mass.position.z": -0.2, "mass.velocity.x": 0.1, "mass.velocity.z": 0.0}

    return Drop()


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_results_have_just_the_times_that_are_given(form):
    every = simulate(falling(), form=form, t_end=1.0)
    event = every.events[0].time
    assert 0.1 < event < 0.9
    asked = [0.05, 0.2, 0.5, 0.75]
    result = simulate(falling(), form=form, t_end=1.0, outputs=asked)
    assert result.time.tolist() == asked
    assert result.events[0].time == pytest.approx(event, rel=1e-6)
    dense = simulate(falling(), form=form, t_end=1.0, outputs=np.linspace(0.0, 1.0, 201))
    assert len(dense.time) == 201 < len(every.time)
    for t in asked:
        here, there = result.time == t, np.isclose(dense.time, t, atol=1e-12)
        assert result.array("mass.position.z")[here] == pytest.approx(dense.array("mass.position.z")[there], abs=1e-6)


def test_an_event_at_a_time_that_is_given_shows_the_state_after_it():
    event = simulate(falling(), t_end=1.0).events[0].time
    result = simulate(falling(), t_end=1.0, outputs=[event])
    assert len(result.time) == 1
    speed = np.hypot(result.array("mass.velocity.x"), result.array("mass.velocity.z"))
    before = simulate(falling(), t_end=event - 1e-9, outputs=[event - 1e-9])
    assert speed < 0.9 * np.hypot(before.array("mass.velocity.x"), before.array("mass.velocity.z"))


def test_a_run_that_ends_before_the_first_time_shows_its_end():
    result = simulate(FourBar(), t_end=5.0, outputs=[4.0, 5.0], max_steps=20)
    assert result.status == "step_limit"
    assert len(result.time) == 1
    assert 0.0 < result.time[0] < 4.0
    assert np.isfinite(result.energy.total).all()
